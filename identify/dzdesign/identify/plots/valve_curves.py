"""Curves over the pressure drop that both `identify --plots` and the report show: thresholds and beta, drawn once.

What is certified is straight between the nodes of the bound.
"""

from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.plots.style import HUES
from dzdesign.identify.valve.guard_curve import CertifiedCurve
from dzdesign.identify.valve.side_model import SideModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Of a branch: key in valve.json, name, marker, dash, hue.
BRANCHES = (("rising", "opening", "^", "-", "blue"), ("falling", "closing", "v", "--", "vermilion"))

#: What is certified of the threshold.
BOUND_NAME = "certified bound"


def draw_thresholds(axes: "Axes", side: SideModel, curve: CertifiedCurve, units: RecordedUnits) -> None:
    """Draw knees and onsets with their errors, and of one guard the bounds on the interval and the largest offset."""
    dp = units.convert(tested_pressures(side), "MPa")
    lower, offset = (units.convert(np.array(values), "V") for values in (curve.u_lower_V, curve.offset_V))
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
        draw_bound(axes, curve, units, BOUND_NAME)
    nodes = units.convert(np.array(curve.offset_dp_MPa), "MPa") if curve.offset_dp_MPa else dp
    axes.plot(nodes, offset, "D-.", ms=3, lw=1.3, color=HUES["purple"], label="largest certified offset",
              zorder=6)  # fmt: skip
    axes.set_ylabel(f"command u ({units.label('V')})")
    if units.falling:
        axes.invert_yaxis()
    if side.tests[0].dp_MPa is None:
        axes.set(xlabel="pressure drop dP (not recorded)", xticks=[])
    else:
        axes.set_xlabel(f"pressure drop dP ({units.label('MPa')})")


def draw_bound(
    axes: "Axes", curve: CertifiedCurve, units: RecordedUnits, label: str, over_V: float | None = None
) -> None:
    """Draw what is certified of a threshold, in the units of the recordings or `over_V`."""
    bound = np.array(curve.bound_V)
    shown = units.convert(bound, "V") if over_V is None else bound / over_V
    line = "_" if curve.premise == "none" else "-"
    axes.plot(units.convert(np.array(curve.bound_dp_MPa), "MPa"), shown, line, color=HUES["green"], lw=2, label=label)


def draw_beta(axes: "Axes", side: SideModel, curve: CertifiedCurve, units: RecordedUnits) -> None:
    """Draw beta of both branches with its error; over the identified u_min0 the certified offset and its bound."""
    u_min0 = side.reference.u_min_V
    for (_, word, marker, dash, hue), name in zip(BRANCHES, ("opening", "closing"), strict=True):
        if name in side.identified:
            found = side.identified[name]
            dp = units.convert(np.array(found.dp_MPa), "MPa")
            axes.errorbar(dp, found.beta, yerr=[2 * se for se in found.beta_se], fmt=marker + dash, ms=5,
                          color=HUES[hue], capsize=3, lw=1.2, label=f"β(dP) {word} ± 2 s.e.")  # fmt: skip
    draw_bound(axes, curve, units, f"{BOUND_NAME} / u_min0", u_min0)
    nodes = units.convert(np.array(curve.offset_dp_MPa), "MPa")
    axes.plot(nodes, np.array(curve.offset_V) / u_min0, "D-.", color=HUES["purple"], ms=3, lw=1.4,
              label="largest certified offset / u_min0")  # fmt: skip
    axes.set(xlabel=f"pressure drop dP ({units.label('MPa')})", ylabel="β (no unit)")


def tested_pressures(side: SideModel) -> np.ndarray:
    """Return the tested pressure drops, MPa; a single one that was not recorded stands at zero, without a number."""
    return np.array([test.dp_MPa or 0.0 for test in side.tests])
