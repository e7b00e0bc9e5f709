"""Figures of the evidence: inputs, zero command, closed loop, dead zone before and after."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.report.figures.figure import (
    CYCLE,
    LIGHT,
    ReportFigure,
    csv_text,
    label_ends,
    legend_below,
    new_figure,
    svg_of,
)
from dzdesign.report.sections.cells import whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

#: Where the enlarged panel of the closed loop ends, per cent of full command.
NEAR_ZERO = 15.0
#: How far the map of the tested interval reaches into commands of the other sign, per cent.
OTHER_SIGN = 8.0
Curves = Mapping[str, np.ndarray]


def map_figure(
    curves: Curves,
    text: str,
    compensator: dict[str, Any],
    side: str,
    inputs: dict[str, Any],
    zero: Curves | None,
) -> ReportFigure:
    """Draw what the core gives over command and pressure drop, and where it falls back or is wrong.

    Parameters
    ----------
    curves : mapping of str to array
        Of input_map_<side>.csv.
    text : str
        That file.
    compensator : dict
        compensator.json.
    side : str
        ``positive`` or ``negative``.
    inputs : dict
        The side's entry of verification.json's ``inputs``.
    zero : mapping of str to array, or None
        Of zero_command_<side>.csv: where the valve is over-compensated.
    """
    grid = _grid_of(curves, compensator, side)
    low, high = (float(Fraction(*end)) for end in compensator["sides"][side]["certificate"]["dp_MPa"])
    room = max(0.14 * (high - low), 0.01 * float(np.ptp(grid.dp)))  # of one tested pressure drop, too, a strip is shown
    figure = new_figure(4.3, right=0.1, top=0.3)
    left, tested = figure.subplots(1, 2, width_ratios=(1, 2.7), gridspec_kw={"wspace": 0.16})
    _draw_map(left, grid, (low, high), (grid.dp.min(), grid.dp.max()))
    mesh = _draw_map(tested, grid, (low, high), (low - room, high + room))
    levels, mean = _levels(grid.volts), grid.volts.mean()
    lines = tested.contour(grid.u, grid.dp, grid.volts, levels=levels, linewidths=0.8,
                           colors=["#f2f2f2" if level < mean else "#101418" for level in levels])  # fmt: skip
    over = _draw_zero_strip(tested, zero)
    first, last = grid.u.min(), grid.u.max()
    left.set(xlim=(first, last), ylabel="pressure drop dP (MPa)", title="every difference of codes")
    tested.set(xlim=(max(first, -OTHER_SIGN), last), title="the tested interval, dashed, and around it")
    bar = figure.colorbar(mesh, ax=tested, pad=0.02)
    bar.set_label("output u_O of the C (V)")
    bar.outline.set_visible(False)
    bar.add_lines(lines)
    wrong, fallen = int(grid.wrong.sum()), int(grid.fallen.sum())
    description = (
        f"Map of the output over command and pressure drop. {whole(inputs['inputs'])} pairs checked, "
        f"{whole(inputs['wrong'])} wrong. On the drawn grid {wrong} of {grid.volts.size} points are wrong, "
        f"{fallen} fall back to the safe value; {over} codes are over-compensated at zero command."
    )
    return ReportFigure(
        name=f"map-{side}",
        caption=f"What the compiled C puts out for {side} commands, on a coarse grid of the pairs that were checked. "
        "Hatched: a command or a pressure drop that can't be, where the C falls back to the safe value. "
        "Red crosses: points where it is not "
        f"the exactly rounded law; on this grid {wrong}, of all pairs {whole(inputs['wrong'])}. Strip at zero "
        f"command: green where the drive is below the threshold's bound, red and hatched where not ({over} codes).",
        description=description,
        svg=svg_of(figure, f"map-{side}", description),
        csv=text,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Grid:
    """What the core gives on a grid: command in per cent, pressure drop in MPa, output in V, and where it is wrong or
    falls back, each (pressures, commands)."""

    u: np.ndarray
    dp: np.ndarray
    volts: np.ndarray
    wrong: np.ndarray
    fallen: np.ndarray


def _grid_of(curves: Curves, compensator: dict[str, Any], side: str) -> _Grid:
    """Return the rows of input_map_<side>.csv as a grid, codes as what they stand for."""
    signals = compensator["signals"]
    command, sensor = signals["command"], signals["pressure_a"]
    full = command["full_code" if side == "positive" else "negative_full_code"]
    code_MPa = float(Fraction(*sensor["span_MPa"])) / (sensor["full_code"] - sensor["zero_code"])
    volt = float(Fraction(*compensator["u_max_V"])) / signals["compare_max"]
    codes, dp_codes = np.unique(curves["command_code"]), np.unique(curves["dp_code"])
    order = np.lexsort((curves["command_code"], curves["dp_code"]))
    output, error, status = (
        curves[name][order].reshape(dp_codes.size, codes.size) for name in ("compare", "error", "status")
    )
    return _Grid(
        u=100 * (codes - command["zero_code"]) / (full - command["zero_code"]),
        dp=dp_codes * code_MPa,
        volts=volt * output,
        wrong=error != 0,
        fallen=status != 0,
    )


def _draw_map(
    axes: "Axes", grid: _Grid, certified_MPa: tuple[float, float], limits_MPa: tuple[float, float]
) -> "QuadMesh":
    """Draw the output as colours, the fallback hatched, what is wrong as crosses, the certified interval dashed."""
    from matplotlib.colors import ListedColormap

    mesh = axes.pcolormesh(grid.u, grid.dp, grid.volts, cmap="cividis", shading="nearest", rasterized=True)
    fallen = np.ma.masked_equal(grid.fallen.astype(float), 0)
    if fallen.count():
        axes.pcolormesh(grid.u, grid.dp, fallen, cmap=ListedColormap(["#ffffff"]), alpha=0.35, shading="nearest",
                        rasterized=True)  # fmt: skip
        axes.contourf(grid.u, grid.dp, grid.fallen.astype(float), levels=[0.5, 1.5], colors="none", hatches=["///"])
    for end in certified_MPa:
        axes.axhline(end, color="#ffffff", lw=1.6, ls="--")
    rows, columns = np.nonzero(grid.wrong)
    axes.plot(grid.u[columns], grid.dp[rows], "x", color="#ff2d2d", ms=4.5, mew=1.6, zorder=5)
    axes.set(ylim=limits_MPa, xlabel="command u_i (% of full)")
    axes.grid(False)
    return mesh


def _levels(volts: np.ndarray) -> np.ndarray:
    """Return whole or half volts between the least and the largest, at most some ten."""
    low, high = float(volts.min()), float(volts.max())
    step = next((step for step in (0.1, 0.25, 0.5, 1.0, 2.5) if (high - low) / step <= 12), 10.0)
    return step * np.arange(np.floor(low / step) + 1, np.ceil(high / step))


def _draw_zero_strip(axes: "Axes", zero: Curves | None) -> int:
    """Draw along zero command where the drive is certified and where not; return at how many codes it is not."""
    if zero is None:
        return 0
    dp, above = zero["dp_MPa"], zero["drive_V"] > zero["bound_V"]
    ends = (0.0, 2.0)  # per cent of command: wide enough to be seen
    axes.fill_betweenx(dp, *ends, where=~above, color=LIGHT["green"], lw=0, zorder=4)
    axes.fill_betweenx(dp, *ends, where=above, facecolor="#ff2d2d", edgecolor="#ffffff", hatch="xxxx", lw=0, zorder=4)
    return int(above.sum())


def zero_figure(curves: Curves, text: str, side: str, guard: str) -> ReportFigure:
    """Draw the drive at zero command under the threshold's lower bound, at every code of the tested interval.

    Parameters
    ----------
    curves : mapping of str to array
        Of zero_command_<side>.csv.
    text : str
        That file.
    side : str
        ``positive`` or ``negative``.
    guard : str
        Threshold that is guarded.
    """
    dp, drive, bound = (curves[name] for name in ("dp_MPa", "drive_V", "bound_V"))
    above = drive > bound
    figure = new_figure(3.4, legend_rows=2)
    axes = figure.subplots()
    axes.fill_between(dp, drive, bound, where=~above, step="mid", color=LIGHT["green"], alpha=0.16, lw=0,
                      label="margin")  # fmt: skip
    axes.step(dp, bound, where="mid", color=LIGHT["green"], lw=1.8, label=f"lower bound of the {guard} threshold")
    axes.plot(dp, drive, "--", color=LIGHT["purple"], lw=1.7, label="drive at zero command, of the compiled C")
    if above.any():
        axes.fill_between(dp, drive, bound, where=above, step="mid", facecolor="none", edgecolor=LIGHT["vermilion"],
                          hatch="xxxx", lw=1, label="OVER-COMPENSATED")  # fmt: skip
    least = int(np.argmin(bound - drive))
    axes.plot(dp[least], drive[least], "o", ms=9, mfc="none", mec=LIGHT["ink"], mew=1.3)
    axes.annotate(f"{1e3 * (bound - drive)[least]:.2f} mV", (dp[least], drive[least]), xytext=(9, 7),
                  textcoords="offset points", ha="left", va="bottom", fontsize=8.5)  # fmt: skip
    axes.margins(y=0.14)
    axes.set(xlabel="pressure drop dP (MPa)", ylabel="command u (V)")
    legend_below(figure, 2)
    description = (
        f"At {int(above.sum())} of {dp.size} codes of the pressure drop the drive at zero command lies above the "
        f"threshold's lower bound; the smallest margin is {1e3 * (bound - drive)[least]:.2f} mV at {dp[least]:.2f} MPa."
    )
    return ReportFigure(
        name=f"zero-{side}",
        caption=f"Zero command, {side} side, where it matters most: the drive against what is certified, at "
        "every code of the tested interval. Ringed: the smallest margin. Outside the interval nothing is certified.",
        description=description,
        svg=svg_of(figure, f"zero-{side}", description),
        csv=text,
    )


def loop_figure(curves: Curves, text: str, side: str, both: bool) -> ReportFigure:
    """Draw flow over command without and with the compensator, whole and near zero.

    Parameters
    ----------
    curves : mapping of str to array
        Of closed_loop_<side>.csv.
    text : str
        That file.
    side : str
        ``positive`` or ``negative``.
    both : bool
        Whether the valve has two sides.
    """
    command = curves["command_percent"]
    columns = [name for name in curves if name.startswith("q_with_")]
    pressures = [name.removeprefix("q_with_").removesuffix("_MPa_L_min") for name in columns]
    figure = new_figure(3.9, top=0.3, right=0.5)
    wide, near = figure.subplots(1, 2, width_ratios=(1.35, 1), gridspec_kw={"wspace": 0.36})
    labels, near_labels, top, peak = [], [], 0.0, int(np.argmax(command))
    starts: dict[str, list[float]] = {"without": [], "with": []}
    for index, dp in enumerate(pressures):
        colour = LIGHT[CYCLE[index % len(CYCLE)]]
        bare, driven = (curves[f"q_{which}_{dp}_MPa_L_min"] for which in ("without", "with"))
        wide.plot(command, bare, ":", color=colour, lw=1.4)
        wide.plot(command, driven, "-", color=colour, lw=1.5)
        for dash, branch in (("-", np.arange(command.size) <= peak), ("--", np.arange(command.size) > peak)):
            inside = branch & (command <= NEAR_ZERO)
            near.plot(command[inside], driven[inside], dash, color=colour, lw=1.5)
            top = max(top, float(driven[inside].max()))
            if dash == "-":
                near_labels.append((NEAR_ZERO, float(driven[inside][-1]), f"{float(dp):.2f}", colour))
        for which, flow in (("without", bare), ("with", driven)):
            flowing = command[flow > 0]
            starts[which].append(float(flowing[0]) if flowing.size else 100.0)
        labels.append((100.0, float(driven.max()), f"{float(dp):.2f}", colour))
    label_ends(wide, labels)
    wide.plot([], [], "-", color=LIGHT["soft"], label="with")
    wide.plot([], [], ":", color=LIGHT["soft"], label="without")
    wide.legend(loc="upper left", title="the compensator", alignment="left")
    label_ends(near, near_labels)
    for dash, word in (("-", "opening, dP in MPa at the end"), ("--", "closing")):
        near.plot([], [], dash, color=LIGHT["soft"], label=word)
    near.legend(loc="upper left")
    wide.set(xlabel="command (% of full)", ylabel="flow Q (L/min)", xlim=(0, 100), ylim=(0, None),
              title="whole range; dP in MPa at the end")  # fmt: skip
    near.set(xlabel="command (% of full)", ylabel="flow Q (L/min)", xlim=(0, NEAR_ZERO), ylim=(0, 1.1 * top or 1),
             title="with the compensator, near zero")  # fmt: skip
    description = f"Flow over command at {len(pressures)} pressure drops. First flow on the ramp up: without the "
    description += f"compensator at {_span(starts['without'])}, with it at {_span(starts['with'])} of full command."
    return ReportFigure(
        name=f"loop-{side}",
        caption="Closed loop: a ramp up and down, the generated C driving the simulated valve"
        + (f", {side} commands" if both else "")
        + ". Of two branches the one at lower commands is closing; what lies between is the valve's "
        "hysteresis.",
        description=description,
        svg=svg_of(figure, f"loop-{side}", description),
        csv=text,
    )


def _span(values: Sequence[float]) -> str:
    return f"{min(values):.1f} to {max(values):.1f} %"


def dead_zone_figure(pressures: Sequence[dict[str, Any]], side: str, both: bool) -> ReportFigure:
    """Draw the dead zone on both branches over the pressure drop, before and after.

    Parameters
    ----------
    pressures : sequence of dict
        Of verification.json, of one side.
    side : str
        ``positive`` or ``negative``.
    both : bool
        Whether the valve has two sides.
    """
    figure = new_figure(3.0, legend_rows=1, top=0.3 if both else 0.12)
    axes = figure.subplots()
    if both:
        axes.set_title(f"{side} commands")
    dp = [each["dp_MPa"] for each in pressures]
    lines = (
        ("dead_zone_opening", "without, opening", "^", "-", "vermilion"),
        ("dead_zone_closing", "without, closing", "v", "--", "vermilion"),
        ("residual_opening", "with, opening", "^", "-", "blue"),
        ("residual_closing", "with, closing", "v", "--", "blue"),
    )
    for key, label, marker, dash, colour in lines:
        values = [100 * each[key] for each in pressures]
        axes.plot(dp, values, dash, marker=marker, ms=5.5, lw=1.6, color=LIGHT[colour], label=label)
    axes.set(xlabel="pressure drop dP (MPa)", ylabel="dead zone (% of command)", ylim=(0, None))
    legend_below(figure, 4)
    worst = {key: 100 * max(each[key] for each in pressures) for key, *_ in lines}
    description = (
        f"The dead zone on opening falls from at most {worst['dead_zone_opening']:.1f} % to at most "
        f"{worst['residual_opening']:.1f} % of command, on closing from {worst['dead_zone_closing']:.1f} % to "
        f"{worst['residual_closing']:.1f} %."
    )
    return ReportFigure(
        name=f"dead-zone-{side}",
        caption="Dead zone in the closed loop, without and with the compensator"
        + (f", {side} commands." if both else "."),
        description=description,
        svg=svg_of(figure, f"dead-zone-{side}", description),
        csv=csv_text(
            ("dp_MPa", *(f"{key}_percent" for key, *_ in lines)),
            [[each["dp_MPa"], *(round(100 * each[key], 4) for key, *_ in lines)] for each in pressures],
        ),
    )
