"""Flow against command without and with the compensator, both sides on one axis: the figure of the first page."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.plots.style import CYCLE
from dzdesign.report.characteristic.curves import ORIGIN_WORDS, CharacteristicCurve, same_pressure
from dzdesign.report.figures.figure import (
    LIGHT,
    WIDTH,
    ReportFigure,
    apart,
    csv_text,
    new_figure,
    to_report_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Dash of a curve without and with the compensator, and its width.
DASHES = {"before": ((0, (4, 1.8)), 1.2), "after": ("-", 1.5)}
SAMPLE: dict[str, Any] = {"marker": "o", "linestyle": "", "ms": 2.8, "mfc": "none", "mew": 0.6}
WITH_WORDS = {"before": "without the compensator", "after": "with the compensator"}
#: Height of the figure, inches; room for the pressure drops at the ends of the curves; of a label, per axis height.
HEIGHT, LABEL_ROOM, LABEL_HEIGHT = 3.75, 0.62, 0.055
#: Width and height for a narrow page, and the room below the axes, inches.
NARROW, NARROW_HEIGHT, NARROW_BOTTOM = 3.7, 2.8, 0.98
#: Room in the axes for the pressure drops at the ends of negative commands, per cent of command.
LEFT_ROOM = 16


def characteristic_figure(curves: Sequence[CharacteristicCurve], units: RecordedUnits) -> ReportFigure | None:
    """Draw flow against command at every pressure drop; None without any curve."""
    curves = [curve for curve in curves if curve.branches]
    if not curves:
        return None
    return to_report_figure(
        _drawn(curves, units), "characteristic", _caption(curves), _description(curves, units), _csv(curves),
        narrow=_drawn(curves, units, narrow=True),
    )  # fmt: skip


def _drawn(curves: Sequence[CharacteristicCurve], units: RecordedUnits, *, narrow: bool = False) -> "Figure":
    """Draw the curves; narrow for a page as wide as a telephone, where the words of a wide one would be too small."""
    hues = _hues(curves)
    low, high = ("negative" in {curve.side for curve in curves}, "positive" in {curve.side for curve in curves})
    handles = 1 + len({curve.set for curve in curves})
    figure = new_figure(
        NARROW_HEIGHT if narrow else HEIGHT, width=NARROW if narrow else WIDTH, legend_rows=handles if narrow else 1,
        right=LABEL_ROOM if high else 0.2, top=0.16,
    )  # fmt: skip
    if narrow:
        figure.subplots_adjust(bottom=NARROW_BOTTOM / NARROW_HEIGHT)
    axes = figure.subplots()
    for curve in curves:
        _draw(axes, curve, hues[id(curve)], units)
    axes.set(
        xlabel="command (% of full)", ylabel=f"flow Q ({units.label('L/min')})",
        xlim=(-100 - (1 + narrow) * LEFT_ROOM if low else 0, 100 if high else 0),
        xticks=range(-100 if low else 0, 101 if high else 1, 50 if narrow and low and high else 20),
    )  # fmt: skip
    if low and high:
        for line in (axes.axhline, axes.axvline):
            line(0, color=LIGHT["soft"], lw=0.8, zorder=1)
    elif high:
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]) if any(curve.samples for curve in curves) else 0.0)
    _label_ends(axes, curves, hues, units, LABEL_HEIGHT * (1 + 0.7 * narrow))
    _legend(figure, axes, curves, 1 if narrow else handles)
    return figure


def _hues(curves: Sequence[CharacteristicCurve]) -> Mapping[int, str]:
    """Return the hue of each curve: one a pressure drop, whichever side and set."""
    known: list[float | None] = []
    places = {}
    for curve in sorted(curves, key=lambda each: (each.dp_MPa or 0.0)):
        at = next((i for i, dp in enumerate(known) if same_pressure(dp, curve.dp_MPa)), len(known))
        if at == len(known):
            known.append(curve.dp_MPa)
        places[id(curve)] = LIGHT[CYCLE[at % len(CYCLE)]]
    return places


def _draw(axes: "Axes", curve: CharacteristicCurve, hue: str, units: RecordedUnits) -> None:
    dash, width = DASHES[curve.set]
    for points in curve.samples:
        axes.plot(100 * points.command, units.convert(points.q_L_min, "L/min"), color=hue, zorder=3, **SAMPLE)
    for points in curve.branches.values():
        axes.plot(100 * points.command, units.convert(points.q_L_min, "L/min"), linestyle=dash, color=hue, lw=width,
                  zorder=2)  # fmt: skip


def _label_ends(
    axes: "Axes", curves: Sequence[CharacteristicCurve], hues: Mapping[int, str], units: RecordedUnits, room: float
) -> None:
    """Write the pressure drop beside the far end of each curve: at the right, and of negative commands at the left."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high)
    for side in ("positive", "negative"):
        ends: dict[str, tuple[float, str]] = {}
        for curve in curves:
            if curve.side == side and curve.dp_MPa is not None:
                flow = units.convert(curve.end[1], "L/min")
                ends.setdefault(units.number(curve.dp_MPa, ".2f MPa"), (flow, hues[id(curve)]))
        names = sorted(ends, key=lambda name: ends[name][0])
        places = apart([ends[name][0] for name in names], room * (high - low))
        right = side == "positive"
        for name, place in zip(names, places, strict=True):
            axes.annotate(
                name, (100 if right else -100, place), xytext=(5 if right else -5, 0), textcoords="offset points",
                va="center", ha="left" if right else "right", fontsize=8, color=ends[name][1], annotation_clip=False,
            )  # fmt: skip
    if any(curve.dp_MPa is not None for curve in curves):
        right = any(curve.side == "positive" for curve in curves)
        axes.annotate(f"dP ({units.label('MPa')})", (1 if right else 0, 1), xycoords="axes fraction",
                      xytext=(5, 4), textcoords="offset points", fontsize=8, color=LIGHT["soft"],
                      annotation_clip=False)  # fmt: skip


def _legend(figure: "Figure", axes: "Axes", curves: Sequence[CharacteristicCurve], columns: int) -> None:
    handles = []
    for name in ("before", "after"):
        of_set = [curve for curve in curves if curve.set == name]
        if of_set:
            dash, width = DASHES[name]
            origin = ORIGIN_WORDS[of_set[0].origin]
            label = f"{WITH_WORDS[name]} ({origin})"
            handles += axes.plot([], [], linestyle=dash, lw=width, color=LIGHT["soft"], label=label)
    if any(curve.samples for curve in curves):
        handles += axes.plot([], [], color=LIGHT["soft"], label="samples", **SAMPLE)
    figure.legend(handles=handles, loc="lower center", ncols=columns, columnspacing=1.4, borderpad=0.1,
                  borderaxespad=0.1)  # fmt: skip


def _caption(curves: Sequence[CharacteristicCurve]) -> str:
    sides = {curve.side for curve in curves}
    lines = ["Flow against command, opening and closing, at every pressure drop."]
    if len(sides) == 1:
        none = "negative" if "positive" in sides else "positive"
        lines.append(f"No {none} commands were tested.")
    if any(curve.samples for curve in curves):
        lines.append("Of the samples a few of each branch are drawn, at equal steps of the command.")
    return " ".join(lines)


def _description(curves: Sequence[CharacteristicCurve], units: RecordedUnits) -> str:
    parts = []
    for name, words in WITH_WORDS.items():
        ends = [abs(curve.end[1]) for curve in curves if curve.set == name]
        if ends:
            flows = f"{units.number(min(ends), '.1f L/min')} to {units.text(max(ends), '.1f L/min')}"
            parts.append(f"{words} the flow at full command is {flows}")
    return f"Flow against command, {len(curves)} curves: {'; '.join(parts)}."


def _csv(curves: Sequence[CharacteristicCurve]) -> str:
    rows: list[tuple[object, ...]] = []
    for curve in curves:
        of = (curve.side, curve.dp_MPa, "without" if curve.set == "before" else "with", curve.origin)
        parts = [*curve.branches.items(), *(("sample", points) for points in curve.samples)]
        for what, points in parts:
            pairs = np.column_stack([100 * points.command, points.q_L_min]).round(4).tolist()
            rows += [(*of, what, command, flow) for command, flow in pairs]
    return csv_text(("side", "dp_MPa", "compensator", "from", "what", "command_percent", "flow_L_min"), rows)
