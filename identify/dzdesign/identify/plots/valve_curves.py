"""Curves over the pressure drop that both `identify --plots` and the report show: thresholds and beta, drawn once.

What holds between two tests is the staircase: a chord between two bounds is certified by nothing.
"""

from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.plots.frame import HUES
from dzdesign.identify.valve.guard_curve import GuardCurve
from dzdesign.identify.valve.side_model import SideModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Of a branch: key in valve.json, name, marker, dash, hue.
BRANCHES = (("rising", "opening", "^", "-", "blue"), ("falling", "closing", "v", "--", "vermilion"))


def draw_thresholds(axes: "Axes", side: SideModel, curve: GuardCurve, units: RecordedUnits) -> None:
    """Draw knees and onsets with their errors, and of one guard the bounds, the staircase and the largest offset."""
    dp = units.convert(tested_pressures(side), "MPa")
    steps, lower, offset = (
        units.convert(np.array(values), "V") for values in (curve.certified_steps_V, curve.u_lower_V, curve.u_offset_V)
    )
    for branch, word, marker, _, hue in BRANCHES:
        for what, face, size in (("knee", HUES[hue], 5.5), ("onset", "none", 8.5)):
            at = [getattr(test, f"u_{what}_{branch}_V") for test in side.tests]
            seen = [i for i, value in enumerate(at) if value is not None]
            if seen:
                error = [2 * (getattr(side.tests[i], f"u_{what}_{branch}_se_V") or 0.0) for i in seen]
                known = units.convert(np.array([at[i] for i in seen]), "V")
                axes.errorbar(dp[seen], known, yerr=units.convert(np.array(error), "dV"), fmt=marker, ms=size, mfc=face,
                              mec=HUES[hue], ecolor=HUES[hue], capsize=3, lw=1, label=f"{what} {word} ± 2 s.e.",
                              zorder=4)  # fmt: skip
    axes.plot(dp, lower, "_", ms=13, mew=2, color=HUES["ink"], label="lower bound, at the test", zorder=5)
    if len(dp) > 1:
        axes.stairs(steps, dp, baseline=None, color=HUES["green"], lw=2,
                    label="certified staircase")  # fmt: skip
    axes.plot(dp, offset, "D-.", ms=4, lw=1.3, color=HUES["purple"], label="largest certified offset",
              zorder=6)  # fmt: skip
    axes.set_ylabel(f"command u ({units.label('V')})")
    if units.falling:
        axes.invert_yaxis()
    if side.tests[0].dp_MPa is None:
        axes.set(xlabel="pressure drop dP (not recorded)", xticks=[])
    else:
        axes.set_xlabel(f"pressure drop dP ({units.label('MPa')})")


def draw_beta(axes: "Axes", curve: GuardCurve, units: RecordedUnits) -> None:
    """Draw beta with its nodes, and over u_min0 what bounds it: the threshold, its lower bound and the staircase."""
    dp = units.convert(np.array(curve.beta_dp_MPa), "MPa")
    steps, lower, threshold = (
        np.array(values) / curve.u_min0_V for values in (curve.certified_steps_V, curve.u_lower_V, curve.u_threshold_V)
    )
    axes.fill_between(dp, lower, threshold, color=HUES["sky"], alpha=0.25, lw=0,
                      label="from bound to threshold, over u_min0")  # fmt: skip
    axes.plot(dp, threshold, ":", color=HUES["blue"], lw=1.4, label="threshold / u_min0")
    axes.stairs(steps, dp, baseline=None, color=HUES["green"], lw=2, label="certified staircase / u_min0")
    axes.plot(dp, curve.beta, "D-.", color=HUES["purple"], ms=4.5, lw=1.4, label="β(dP) of the valve")
    axes.set(xlabel=f"pressure drop dP ({units.label('MPa')})", ylabel="β (no unit)")


def tested_pressures(side: SideModel) -> np.ndarray:
    """Return the tested pressure drops, MPa; a single one that was not recorded stands at zero, without a number."""
    return np.array([test.dp_MPa or 0.0 for test in side.tests])
