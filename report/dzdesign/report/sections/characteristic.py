"""Table and figure of the characteristic, in terms of ISO 10770-1: each quantity at each pressure drop of each side."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.assess.options import SETS
from dzdesign.assess.quantities import LIMITED, LOSS, QUANTITIES, LimitResult
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.figure import (
    LIGHT,
    PressureHues,
    ReportFigure,
    csv_text,
    label_ends,
    legend_below,
    new_figure,
    to_report_figure,
)
from dzdesign.report.page import Cell, Section, Table, in_number_font, number, recorded
from dzdesign.report.sections.quantities import (
    IDEAL,
    KEYS,
    ORIGIN_WORDS,
    CharacteristicCurve,
    CharacteristicQuantities,
    Found,
    PressureQuantities,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


#: Key -> name in the table. The terms are those of valve tests; the dead zone at a flow says at which.
NAMES = {
    "onset_opening": "Dead zone at the onset of flow, opening",
    "onset_closing": "Dead zone at the onset of flow, closing",
    "dead_zone_opening": "Dead zone at the reading flow, opening",
    "dead_zone_closing": "Dead zone at the reading flow, closing",
    IDEAL: "Dead zone of an ideal line at that flow",
    "hysteresis": "Hysteresis",
    "linearity": "Linearity",
    "symmetry": "Symmetry of the flow gains",
    "gain": "Flow gain",
    "largest_flow": "Largest flow",
    "flow_at_zero": "Flow at zero command",
    "knee_opening": "Knee, opening",
    "knee_closing": "Knee, closing",
    LOSS: "Loss of largest flow",
}
DECIMALS = {"%": 1, "L/min": 2, "L/min/V": 2}
IN_RECORDED_UNITS = ("L/min", "L/min/V")
#: Known of what is with the compensator alone, at times: then no arrow stands in their cells.
OF_ONE_SET = (LOSS, IDEAL)
#: Whose formulas stand below the table.
EXPLAINED = ("hysteresis", "linearity", "symmetry", "gain")
#: Verdict of a limit -> its word and kind.
VERDICTS = {True: ("✓", "pass", "good"), False: ("✗", "fail", "bad"), None: ("?", "not checked", "open")}


def characteristic_section(found: CharacteristicQuantities, units: RecordedUnits) -> Section:
    """Return the section with a table a side."""
    sides = dict.fromkeys(each.side for each in found.pressures)
    tables = [
        _side_table([each for each in found.pressures if each.side == side], side, units.of_side(side))
        for side in sides
    ]
    if not tables:
        return Section(missing="No characteristic is here: `dzdesign identify` makes valve.json.")
    origins = [
        f"{which}: {ORIGIN_WORDS[origin]}."
        for which, origin in (("Without", found.before), ("With", found.after))
        if origin
    ]
    arrow = "Values without → with the compensator" if found.after else "Values without the compensator"
    shown = {row[0].text for table in tables for row in table.rows}
    tables[-1] = replace(
        tables[-1],
        notes=(
            "Terms as in ISO 10770-1; the formulas are those of dzdesign, and no conformity is claimed.",
            *(f"{NAMES[key]}: {QUANTITIES[key].formula}." for key in EXPLAINED if NAMES[key] in shown),
        ),
    )
    flows = [each.reading_flow_L_min for each in found.pressures if each.reading_flow_L_min > 0]
    ends = dict.fromkeys(units.text(end(flows), ".2f L/min") for end in (min, max)) if flows else ()
    reading = [f"Reading flow: {' … '.join(ends)}."] if flows else []
    return Section(tables=tables, lines=(" ".join((f"{arrow}.", *origins, *reading)),))


def _side_table(pressures: Sequence[PressureQuantities], side: str, units: RecordedUnits) -> Table:
    known = set(chain.from_iterable((*each.before, *each.after) for each in pressures))
    limited = set(chain.from_iterable(each.limits for each in pressures))
    keys = [key for key in NAMES if (key in KEYS and key in known) or key in limited]
    head = [
        "–" if each.dp_MPa is None else units.number(each.dp_MPa, ".2f MPa") for each in pressures
    ]
    limits = ("limit", "verdict") if limited else ()
    return Table(
        caption=f"{side.capitalize()} commands, at pressure drops in {units.label('MPa')}",
        columns=("quantity", "unit", *head, *limits),
        rows=tuple(_row(key, pressures, units, with_limits=bool(limited)) for key in keys),
    )


def _row(
    key: str, pressures: Sequence[PressureQuantities], units: RecordedUnits, *, with_limits: bool
) -> tuple[Cell, ...]:
    unit = (LIMITED | QUANTITIES)[key].unit
    shown = units.label(unit) if unit in IN_RECORDED_UNITS else unit
    cells = [Cell(text=NAMES[key]), in_number_font(shown)]
    driven = any(each.after for each in pressures)
    cells += [_pair(key, each, unit, units, driven=driven) for each in pressures]
    if with_limits:
        limits = [each.limits[key] for each in pressures if key in each.limits]
        cells += [_limit(limits, units), _verdict(limits)]
    return tuple(cells)


def _pair(key: str, of: PressureQuantities, unit: str, units: RecordedUnits, *, driven: bool) -> Cell:
    """Return a quantity before and after, as far as either was recorded anywhere; marked where it misses its limit."""
    before, after = (_text(found.get(key), unit, units) for found in (of.before, of.after))
    text = after if key in OF_ONE_SET and before == "–" else before if not driven else f"{before} → {after}"
    missed = key in of.limits and of.limits[key].holds is False
    return Cell(text=f"{text} ✗", kind="bad") if missed else in_number_font("–" if text == "– → –" else text)


def _text(found: Found | None, unit: str, units: RecordedUnits) -> str:
    if found is None or (found.value is None and found.at_most is None):
        return "–"
    value = found.at_most if found.value is None else found.value
    digits = DECIMALS[unit]
    known = unit in IN_RECORDED_UNITS
    cell = recorded(value, f".{digits}f {unit}", units) if known else number(value, digits)
    # Without a space: with one, two bounds in a cell would make a table of six pressures scroll.
    return cell.text if found.value is not None else f"≤{cell.text}"


def _limit(limits: Sequence[LimitResult], units: RecordedUnits) -> Cell:
    if not limits:
        return in_number_font("")
    one = limits[0]
    known = one.unit in IN_RECORDED_UNITS
    value = units.number(one.limit, f".4g {one.unit}") if known else f"{one.limit:.4g}"
    return in_number_font(f"≤ {value}")


def _verdict(limits: Sequence[LimitResult]) -> Cell:
    if not limits:
        return Cell(text="")
    outcomes = {one.holds for one in limits}
    worst = False if False in outcomes else None if None in outcomes else True
    sign, text, kind = VERDICTS[worst]
    return Cell(text=f"{sign} {text}", kind=kind)


#: Dash of a curve without and with the compensator, and its width.
DASHES = {"before": ((0, (4, 1.8)), 1.2), "after": ("-", 1.5)}
SAMPLE: dict[str, Any] = {"marker": "o", "linestyle": "", "ms": 2.8, "mfc": "none", "mew": 0.6}
WITH_WORDS = {"before": "without the compensator", "after": "with the compensator"}
#: Room in the axes for the pressure drops at the ends of negative commands, per cent of command.
LEFT_ROOM = 16


def characteristic_figure(
    curves: Sequence[CharacteristicCurve], units: RecordedUnits, hues: PressureHues
) -> ReportFigure | None:
    """Draw flow against command at every pressure drop; None without any curve."""
    curves = [curve for curve in curves if curve.branches]
    if not curves:
        return None
    low, high = ("negative" in {curve.side for curve in curves}, "positive" in {curve.side for curve in curves})
    figure = new_figure(3.0)
    axes = figure.subplots()
    for curve in curves:
        _draw(axes, curve, hues.of(curve.dp_MPa), units)
    axes.set(
        xlabel="command (% of full)", ylabel=f"flow Q ({units.label('L/min')})",
        xlim=(-100 - LEFT_ROOM if low else 0, 100 if high else 0),
        xticks=range(-100 if low else 0, 101 if high else 1, 20),
    )  # fmt: skip
    if low and high:
        axes.margins(y=0.1)
        for line in (axes.axhline, axes.axvline):
            line(0, color=LIGHT["soft"], lw=0.8, zorder=1)
    elif high:
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]) if any(curve.samples for curve in curves) else 0.0)
    if ends := _ends(curves, units):
        label_ends(axes, ends)
        axes.annotate(f"dP ({units.label('MPa')})", (1 if high else 0, 1), xycoords="axes fraction", xytext=(5, 4),
                      textcoords="offset points", fontsize=8, color=LIGHT["soft"], annotation_clip=False)  # fmt: skip
    _name_lines(axes, curves)
    legend_below(figure, 3)
    return to_report_figure(figure, "characteristic", _caption(curves), _description(curves, units), _csv(curves))


def _draw(axes: "Axes", curve: CharacteristicCurve, hue: str, units: RecordedUnits) -> None:
    dash, width = DASHES[curve.set]
    for points in curve.samples:
        axes.plot(100 * points.command, units.convert(points.q_L_min, "L/min"), color=hue, zorder=3, **SAMPLE)
    for points in curve.branches.values():
        axes.plot(100 * points.command, units.convert(points.q_L_min, "L/min"), linestyle=dash, color=hue, lw=width,
                  zorder=2)  # fmt: skip


def _ends(curves: Sequence[CharacteristicCurve], units: RecordedUnits) -> list[tuple[float, float, str]]:
    """Return the far end of a curve at each pressure drop of each side, with that pressure drop."""
    ends: dict[tuple[str, str], tuple[float, float, str]] = {}
    for curve in curves:
        if curve.dp_MPa is not None:
            name, flow = units.number(curve.dp_MPa, ".2f MPa"), units.convert(curve.end[1], "L/min")
            ends.setdefault((curve.side, name), (100.0 if curve.side == "positive" else -100.0, flow, name))
    return list(ends.values())


def _name_lines(axes: "Axes", curves: Sequence[CharacteristicCurve]) -> None:
    for name in SETS:
        of_set = [curve for curve in curves if curve.set == name]
        if of_set:
            dash, width = DASHES[name]
            label = f"{WITH_WORDS[name]} ({ORIGIN_WORDS[of_set[0].origin]})"
            axes.plot([], [], linestyle=dash, lw=width, color=LIGHT["soft"], label=label)
    if any(curve.samples for curve in curves):
        axes.plot([], [], color=LIGHT["soft"], label="samples", **SAMPLE)


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
