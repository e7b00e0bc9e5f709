"""The output at zero command under the threshold's lower bound."""

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.figures.figure import LIGHT, Curves, ReportFigure, legend_below, new_figure, to_report_figure


def zero_figure(curves: Curves, side: str, guard: str, units: RecordedUnits) -> ReportFigure:
    """Draw the output at zero command under the threshold's lower bound, at every code of the tested interval.

    From zero_command_<side>.csv.
    """
    dp, drive, bound = (curves.columns[name] for name in ("dp_MPa", "drive_V", "bound_V"))
    above = drive > bound
    least = int(np.argmin(bound - drive))
    margin, at = units.text(1e3 * (bound - drive)[least], ".2f mV"), units.text(dp[least], ".2f MPa")
    dp, drive, bound = units.convert(dp, "MPa"), units.convert(drive, "V"), units.convert(bound, "V")
    figure = new_figure(3.4, legend_rows=2)
    axes = figure.subplots()
    axes.fill_between(dp, drive, bound, where=~above, step="mid", color=LIGHT["green"], alpha=0.16, lw=0,
                      label="margin")  # fmt: skip
    axes.step(dp, bound, where="mid", color=LIGHT["green"], lw=1.8, label=f"lower bound of the {guard} threshold")
    axes.plot(dp, drive, "--", color=LIGHT["purple"], lw=1.7, label="drive at zero command, of the compiled C")
    if above.any():
        axes.fill_between(dp, drive, bound, where=above, step="mid", facecolor="none", edgecolor=LIGHT["vermilion"],
                          hatch="xxxx", lw=1, label="OVER-COMPENSATED")  # fmt: skip
    axes.plot(dp[least], drive[least], "o", ms=9, mfc="none", mec=LIGHT["ink"], mew=1.3)
    axes.annotate(margin, (dp[least], drive[least]), xytext=(9, 7),
                  textcoords="offset points", ha="left", va="bottom", fontsize=8.5)  # fmt: skip
    axes.margins(y=0.14)
    axes.set(xlabel=f"pressure drop dP ({units.label('MPa')})", ylabel=f"command u ({units.label('V')})")
    if units.falling:
        axes.invert_yaxis()
    legend_below(figure, 2)
    return to_report_figure(
        figure,
        f"zero-{side}",
        f"Zero command, {side} side, where it matters most: the output against what is certified, at "
        "every code of the tested interval. Ringed: the smallest margin. What is certified outside the interval stands "
        "beside the law.",
        f"At {int(above.sum())} of {dp.size} codes of the pressure drop the output at zero command lies above the "
        f"threshold's lower bound; the smallest margin is {margin} at {at}.",
        curves.text,
    )
