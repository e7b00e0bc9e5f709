"""Section on the check of every input, and the margin at zero command."""

import numpy as np

from dzdesign.core.display import NOT_CHECKED
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.artefacts import Chain, laws_of
from dzdesign.report.figure import LIGHT, ReportFigure, legend_below, new_figure, to_report_figure
from dzdesign.report.page import Section, whole
from dzdesign.verify.closed_loop.ramps import Curves, csv_of, zero_command_name
from dzdesign.verify.evidence import InputCheck


def inputs_section(chain: Chain) -> Section:
    """Return the section on the check of every input."""
    compensator = chain.compensator
    if chain.evidence is None:
        return Section(missing="No evidence is here: `dzdesign verify` tries every input of the C code.")
    if compensator is None:
        return Section(missing="No compensator is here: `dzdesign design` makes compensator.json.")
    figures: list[ReportFigure] = []
    lines, missing = [], ""
    for each in chain.evidence.inputs:
        side = each.side
        lines += _input_lines(each, chain.recorded_units)
        guard = laws_of(compensator)[side].certificate.guard
        curves = chain.curves[zero_command_name(side)]
        if curves["dp_MPa"].size > 1:
            figures.append(zero_figure(curves, side, guard, chain.recorded_units.of_side(side)))
    if not chain.evidence.inputs:
        missing = f"{NOT_CHECKED}: the C code did not compile or did not run, see the requirements."
    return Section(figures=figures, lines=tuple(lines), missing=missing)


def _input_lines(found: InputCheck, units: RecordedUnits) -> list[str]:
    line = (
        f"{found.side.capitalize()} commands: {whole(found.inputs)} pairs of command and pressure-difference code "
        f"compared with the exactly rounded law, {whole(found.wrong)} wrong, largest error {found.largest_error} "
        f"counts; {found.over_compensated} pressure codes over-compensated, smallest margin of the C code's compare "
        f"values {units.text(1e3 * found.smallest_margin_V, '.3f mV')}."
    )
    return [line, f"First wrong: {found.first_wrong}."] if found.first_wrong else [line]


def zero_figure(curves: Curves, side: str, guard: str, units: RecordedUnits) -> ReportFigure:
    """Draw the output at zero command under the threshold's lower bound, at every code of the tested interval.

    From zero_command_<side>.csv.
    """
    dp, drive, bound = (curves[name] for name in ("dp_MPa", "drive_V", "bound_V"))
    above = drive > bound
    least = int(np.argmin(bound - drive))
    margin, at = units.text(1e3 * (bound - drive)[least], ".2f mV"), units.text(dp[least], ".2f MPa")
    dp, drive, bound = units.convert(dp, "MPa"), units.convert(drive, "V"), units.convert(bound, "V")
    figure = new_figure(3.4)
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
        csv_of(curves),
    )
