"""Figures of the closed loop: flow against command, and the dead zone before and after."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.plots.style import CYCLE
from dzdesign.report.figures.figure import (
    LIGHT,
    Curves,
    ReportFigure,
    csv_text,
    label_ends,
    legend_below,
    new_figure,
    side_words,
    titled_axes,
    to_report_figure,
)
from dzdesign.verify.loop_results import PressureResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Where the enlarged panel ends, percent of full command.
NEAR_ZERO = 15.0


def loop_figure(
    curves: Curves, side: str, both: bool, units: RecordedUnits, unseen_below_L_min: float | None = None
) -> ReportFigure:
    """Draw flow against command without and with the compensator, whole and near zero, from closed_loop_<side>.csv.

    Below `unseen_below_L_min` nothing of the flow was recorded: the lines go on there as the first flows do.
    """
    ends = [name.removeprefix("q_with_") for name in curves.columns if name.startswith("q_with_")]
    figure = new_figure(3.9, top=0.3, right=0.5)
    wide, near = figure.subplots(1, 2, width_ratios=(1.35, 1), gridspec_kw={"wspace": 0.36})
    _draw_whole(wide, curves, ends, units)
    _draw_near_zero(near, curves, ends, units)
    hidden = ""
    if unseen_below_L_min is not None:
        near.axhspan(0, units.convert(unseen_below_L_min, "L/min"), color=LIGHT["soft"], alpha=0.15, lw=0, zorder=0)
        shown = units.text(unseen_below_L_min, ".2f L/min")
        hidden = f" Shaded: below {shown} the recordings show no flow, and the first flows are continued."
    starts = {
        which: [_first_flow(curves, f"q_{which}_{end}") for end in ends] for which in ("without", "with")
    }
    return to_report_figure(
        figure,
        f"loop-{side}",
        f"Closed loop: a ramp up and down, the generated C driving the simulated valve{side_words(side, both)}. Of "
        f"two branches the one at lower commands is closing; what lies between is the valve's hysteresis.{hidden}",
        f"Flow against command at {len(ends)} pressure drops. First flow on the ramp up: without the "
        f"compensator at {_percents(starts['without'])}, with it at {_percents(starts['with'])} of full command.",
        curves.text,
    )


def _percents(values: Sequence[float]) -> str:
    return f"{min(values):.1f} to {max(values):.1f} %"


def _draw_whole(axes: "Axes", curves: Curves, ends: Sequence[str], units: RecordedUnits) -> None:
    command, labels = curves.columns["command_percent"], []
    for index, end in enumerate(ends):
        hue = LIGHT[CYCLE[index % len(CYCLE)]]
        bare, driven = (
            units.convert(curves.columns[f"q_{which}_{end}"], "L/min") for which in ("without", "with")
        )
        axes.plot(command, bare, ":", color=hue, lw=1.4)
        axes.plot(command, driven, "-", color=hue, lw=1.5)
        labels.append((100.0, float(driven.max()), _pressure(end, units), hue))
    label_ends(axes, labels)
    axes.plot([], [], "-", color=LIGHT["soft"], label="with")
    axes.plot([], [], ":", color=LIGHT["soft"], label="without")
    axes.legend(loc="upper left", title="the compensator", alignment="left")
    axes.set(xlabel="command (% of full)", ylabel=f"flow Q ({units.label('L/min')})", xlim=(0, 100), ylim=(0, None),
             title=f"whole range; dP in {units.label('MPa')} at the end")  # fmt: skip


def _draw_near_zero(axes: "Axes", curves: Curves, ends: Sequence[str], units: RecordedUnits) -> None:
    command, labels, top = curves.columns["command_percent"], [], 0.0
    opening = np.arange(command.size) <= int(np.argmax(command))
    for index, end in enumerate(ends):
        hue, driven = LIGHT[CYCLE[index % len(CYCLE)]], units.convert(curves.columns[f"q_with_{end}"], "L/min")
        for dash, branch in (("-", opening), ("--", ~opening)):
            inside = branch & (command <= NEAR_ZERO)
            axes.plot(command[inside], driven[inside], dash, color=hue, lw=1.5)
            top = max(top, float(driven[inside].max()))
            if dash == "-":
                labels.append((NEAR_ZERO, float(driven[inside][-1]), _pressure(end, units), hue))
    label_ends(axes, labels)
    for dash, word in (("-", f"opening, dP in {units.label('MPa')} at the end"), ("--", "closing")):
        axes.plot([], [], dash, color=LIGHT["soft"], label=word)
    axes.legend(loc="upper left")
    flow = f"flow Q ({units.label('L/min')})"
    axes.set(xlabel="command (% of full)", ylabel=flow, xlim=(0, NEAR_ZERO), ylim=(0, 1.1 * top or 1),
             title="with the compensator, near zero")  # fmt: skip


def _pressure(end: str, units: RecordedUnits) -> str:
    return units.number(float(end.removesuffix("_MPa_L_min")), ".2f MPa")


def _first_flow(curves: Curves, column: str) -> float:
    """Return the first command at which there is flow, percent."""
    flowing = curves.columns["command_percent"][curves.columns[column] > 0]
    return float(flowing[0]) if flowing.size else 100.0


def dead_zone_figure(
    pressures: Sequence[PressureResult], side: str, both: bool, units: RecordedUnits
) -> ReportFigure:
    """Draw the dead zone of one side on both branches against the pressure drop, before and after."""
    figure, axes = titled_axes(3.0, side, both, legend_rows=1)
    dp = [each.dp_MPa for each in pressures]
    lines = {
        "dead_zone_opening": ("without, opening", "^", "-", "vermilion"),
        "dead_zone_closing": ("without, closing", "v", "--", "vermilion"),
        "residual_opening": ("with, opening", "^", "-", "blue"),
        "residual_closing": ("with, closing", "v", "--", "blue"),
    }
    percent = {key: [100 * getattr(each, key) for each in pressures] for key in lines}
    at = units.convert(np.array(dp), "MPa")
    for key, (label, marker, dash, hue) in lines.items():
        axes.plot(at, percent[key], dash, marker=marker, ms=5.5, lw=1.6, color=LIGHT[hue], label=label)
    axes.set(xlabel=f"pressure drop dP ({units.label('MPa')})", ylabel="dead zone (% of command)", ylim=(0, None))
    legend_below(figure, 4)
    worst = {key: max(values) for key, values in percent.items()}
    return to_report_figure(
        figure,
        f"dead-zone-{side}",
        f"Dead zone in the closed loop, without and with the compensator{side_words(side, both)}.",
        f"The dead zone on opening falls from at most {worst['dead_zone_opening']:.1f} % to at most "
        f"{worst['residual_opening']:.1f} % of command, on closing from {worst['dead_zone_closing']:.1f} % to "
        f"{worst['residual_closing']:.1f} %.",
        csv_text(
            ("dp_MPa", *(f"{key}_percent" for key in lines)),
            zip(dp, *([round(value, 4) for value in values] for values in percent.values()), strict=True),
        ),
    )
