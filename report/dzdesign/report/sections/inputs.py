"""Section on the check of every input: the map of the output, and the margin at zero command."""

import numpy as np

from dzdesign.core.display import NOT_CHECKED
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.report.artefacts import Chain, laws_of
from dzdesign.report.figure import LIGHT, ReportFigure, legend_below, new_figure, to_report_figure
from dzdesign.report.page import Section, whole
from dzdesign.verify.closed_loop.ramps import Curves, csv_of, input_map_name, zero_command_name
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
        figures.append(map_figure(chain.curves[input_map_name(side)], compensator, each))
        figures.append(
            zero_figure(chain.curves[zero_command_name(side)], side, guard, chain.recorded_units.of_side(side))
        )
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


def map_figure(curves: Curves, compensator: Compensator, inputs: InputCheck) -> ReportFigure:
    """Draw what the core gives against command and pressure drop, and where it falls back.

    From input_map_<side>.csv, whose rows are those of a grid.
    """
    side, sign, signals = inputs.side, inputs.sign, compensator.signals
    units, volt = compensator.valve.recorded_units.of_side(side), float(compensator.u_max_V) / signals.compare_max
    codes, dp_codes = np.unique(curves["command_code"]), np.unique(curves["dp_code"])
    order = np.lexsort((curves["command_code"], curves["dp_code"]))
    compare, status = (curves[name][order].reshape(dp_codes.size, codes.size) for name in ("compare", "status"))
    command = 100 * (codes - signals.command.zero_code) / (signals.command.direction(sign) * signals.command.span(sign))
    dp = units.convert(dp_codes * float(signals.pair(sign).ahead.per_code_MPa), "MPa")
    output, fallen = units.convert(volt * compare, "V"), status != 0
    low, high = (units.convert(float(end), "MPa") for end in laws_of(compensator)[side].certificate.dp_MPa)
    room = max(0.3 * (high - low), 0.02 * float(np.ptp(dp)))  # of one tested pressure drop, too, a strip is shown
    figure = new_figure(4.0)
    axes = figure.subplots()
    mesh = axes.pcolormesh(command, dp, output, cmap="cividis", shading="nearest", rasterized=True)
    lines = axes.contour(command, dp, output, 12, linewidths=0.8, colors="#f2f2f2")
    if fallen.any():
        axes.contourf(command, dp, fallen.astype(float), levels=[0.5, 1.5], colors="none", hatches=["///"])
    for end in (low, high):
        axes.axhline(end, color="#ffffff", lw=1.6, ls="--")
    axes.set(xlabel="command u_i (% of full)", ylabel=f"pressure drop dP ({units.label('MPa')})",
             ylim=(low - room, high + room))  # fmt: skip
    axes.grid(False)
    bar = figure.colorbar(mesh, ax=axes, pad=0.02)
    bar.set_label(f"output u_O of the C code ({units.label('V')})")
    bar.outline.set_visible(False)
    bar.add_lines(lines)
    return to_report_figure(
        figure,
        f"map-{side}",
        f"The exactly rounded law for {side} commands, on a coarse grid of the pairs at which the compiled C was "
        f"compared with it, around the tested interval, dashed; the CSV has the others. Of all pairs "
        f"{whole(inputs.wrong)} differ. Hatched: a command or a pressure drop that can't be, where the C code falls "
        "back to the safe value.",
        f"Map of the output against command and pressure drop. {whole(inputs.inputs)} pairs checked, "
        f"{whole(inputs.wrong)} wrong. On the drawn grid {int(fallen.sum())} of {output.size} points fall "
        "back to the safe value.",
        csv_of(curves),
    )


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
