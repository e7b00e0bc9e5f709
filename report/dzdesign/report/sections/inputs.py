"""Sections on the evidence: every input, closed loop, requirements."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.verdicts import NOT_CHECKED
from dzdesign.design.compensator import Compensator
from dzdesign.report.artefacts import Chain, laws_of
from dzdesign.report.cells import (
    whole,
)
from dzdesign.report.figure import LIGHT, ReportFigure, legend_below, new_figure, to_report_figure
from dzdesign.report.page import Section
from dzdesign.verify.closed_loop.ramps import Curves, csv_of, input_map_name, zero_command_name
from dzdesign.verify.evidence import InputCheck

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

#: How far the map of the tested interval reaches into commands of the other sign, percent.
OTHER_SIGN = 8.0


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
        drawn, zero = (chain.curves[name(side)] for name in (input_map_name, zero_command_name))
        guard = laws_of(compensator)[side].certificate.guard
        figures.append(map_figure(drawn, zero, compensator, each))
        figures.append(zero_figure(zero, side, guard, chain.recorded_units.of_side(side)))
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


def map_figure(
    curves: Curves, zero: Curves, compensator: Compensator, inputs: InputCheck
) -> ReportFigure:
    """Draw what the core gives against command and pressure drop, and where it falls back.

    From input_map_<side>.csv and, for where the valve is over-compensated, zero_command_<side>.csv.
    """
    side, units = inputs.side, compensator.valve.recorded_units.of_side(inputs.side)
    grid = _grid_of(curves, compensator, inputs)
    low, high = (units.convert(float(end), "MPa") for end in laws_of(compensator)[side].certificate.dp_MPa)
    room = max(0.14 * (high - low), 0.01 * float(np.ptp(grid.dp)))  # of one tested pressure drop, too, a strip is shown
    figure = new_figure(4.3, right=0.1, top=0.3)
    left, tested = figure.subplots(1, 2, width_ratios=(1, 2.7), gridspec_kw={"wspace": 0.16})
    _draw_map(left, grid, (low, high), (grid.dp.min(), grid.dp.max()))
    mesh = _draw_map(tested, grid, (low, high), (low - room, high + room))
    levels, mean = _levels(grid.output), grid.output.mean()
    lines = tested.contour(grid.u, grid.dp, grid.output, levels=levels, linewidths=0.8,
                           colors=["#f2f2f2" if level < mean else "#101418" for level in levels])  # fmt: skip
    over = _draw_zero_strip(tested, zero, units)
    first, last = grid.u.min(), grid.u.max()
    left.set(xlim=(first, last), ylabel=f"pressure drop dP ({units.label('MPa')})", title="every difference of codes")
    tested.set(xlim=(max(first, -OTHER_SIGN), last), title="the tested interval, dashed, and around it")
    bar = figure.colorbar(mesh, ax=tested, pad=0.02)
    bar.set_label(f"output u_O of the C code ({units.label('V')})")
    bar.outline.set_visible(False)
    bar.add_lines(lines)
    fallen = int(grid.fallen.sum())
    return to_report_figure(
        figure,
        f"map-{side}",
        f"The exactly rounded law for {side} commands, on a coarse grid of the pairs at which the compiled C was "
        f"compared with it; of all pairs {whole(inputs.wrong)} differ. "
        "Hatched: a command or a pressure drop that can't be, where the C code falls back to the safe value. Strip at "
        f"zero command: green where the output is below the threshold's bound, red and hatched where not ({over} "
        "codes).",
        f"Map of the output against command and pressure drop. {whole(inputs.inputs)} pairs checked, "
        f"{whole(inputs.wrong)} wrong. On the drawn grid {fallen} of {grid.output.size} points fall back to the safe "
        f"value; {over} codes are over-compensated at zero command.",
        csv_of(curves),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Grid:
    """What the core gives on a grid: command in percent, pressure drop and output in the units that are shown, and
    where it falls back, each (pressures, commands)."""

    u: np.ndarray
    dp: np.ndarray
    output: np.ndarray
    fallen: np.ndarray


def _grid_of(curves: Curves, compensator: Compensator, inputs: InputCheck) -> _Grid:
    """Return the rows of input_map_<side>.csv as a grid, codes as what they stand for."""
    sign, units = inputs.sign, compensator.valve.recorded_units.of_side(inputs.side)
    command, volt = compensator.signals.command, float(compensator.u_max_V) / compensator.signals.compare_max
    towards_full = command.direction(sign) * command.span(sign)
    codes, dp_codes = np.unique(curves["command_code"]), np.unique(curves["dp_code"])
    order = np.lexsort((curves["command_code"], curves["dp_code"]))
    output, status = (
        curves[name][order].reshape(dp_codes.size, codes.size) for name in ("compare", "status")
    )
    return _Grid(
        u=100 * (codes - command.zero_code) / towards_full,
        dp=units.convert(dp_codes * float(compensator.signals.pressure_a.per_code_MPa), "MPa"),
        output=units.convert(volt * output, "V"),
        fallen=status != 0,
    )


def _draw_map(
    axes: "Axes", grid: _Grid, certified: tuple[float, float], limits: tuple[float, float]
) -> "QuadMesh":
    """Draw the output as colours, the fallback hatched, the certified interval dashed."""
    from matplotlib.colors import ListedColormap

    mesh = axes.pcolormesh(grid.u, grid.dp, grid.output, cmap="cividis", shading="nearest", rasterized=True)
    fallen = np.ma.masked_equal(grid.fallen.astype(float), 0)
    if fallen.count():
        axes.pcolormesh(grid.u, grid.dp, fallen, cmap=ListedColormap(["#ffffff"]), alpha=0.35, shading="nearest",
                        rasterized=True)  # fmt: skip
        axes.contourf(grid.u, grid.dp, grid.fallen.astype(float), levels=[0.5, 1.5], colors="none", hatches=["///"])
    for end in certified:
        axes.axhline(end, color="#ffffff", lw=1.6, ls="--")
    axes.set(ylim=limits, xlabel="command u_i (% of full)")
    axes.grid(False)
    return mesh


def _levels(output: np.ndarray) -> np.ndarray:
    """Return round outputs between the least and the largest, at most some twelve."""
    low, high = float(output.min()), float(output.max())
    power = 10.0 ** np.floor(np.log10(max(high - low, 1e-12) / 12))
    step = next(step * power for step in (1.0, 2.5, 5.0, 10.0) if (high - low) / (step * power) <= 12)
    levels: np.ndarray = step * np.arange(np.floor(low / step) + 1, np.ceil(high / step))
    return levels


def _draw_zero_strip(axes: "Axes", zero: Curves, units: RecordedUnits) -> int:
    """Draw along zero command where the drive is certified and where not; return at how many codes it is not."""
    dp, above = zero["dp_MPa"], zero["drive_V"] > zero["bound_V"]
    dp, ends = units.convert(dp, "MPa"), (0.0, 2.0)  # percent of command: wide enough to be seen
    axes.fill_betweenx(dp, *ends, where=~above, color=LIGHT["green"], lw=0, zorder=4)
    axes.fill_betweenx(dp, *ends, where=above, facecolor="#ff2d2d", edgecolor="#ffffff", hatch="xxxx", lw=0, zorder=4)
    return int(above.sum())


def zero_figure(curves: Curves, side: str, guard: str, units: RecordedUnits) -> ReportFigure:
    """Draw the output at zero command under the threshold's lower bound, at every code of the tested interval.

    From zero_command_<side>.csv.
    """
    dp, drive, bound = (curves[name] for name in ("dp_MPa", "drive_V", "bound_V"))
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
        csv_of(curves),
    )
