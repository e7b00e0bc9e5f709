"""Table of the characteristic, in terms of ISO 10770-1: each quantity at each pressure drop of each side."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

from dzdesign.assess.limits import LIMITED, LimitResult
from dzdesign.assess.quantities import LOSS, QUANTITIES
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.characteristic.curves import ORIGIN_WORDS
from dzdesign.report.characteristic.quantities import (
    KEYS,
    CharacteristicQuantities,
    Found,
    PressureQuantities,
)
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, in_number_font, number, recorded

#: Key -> name in the table. The terms are those of valve tests; the dead zone at a flow says at which.
NAMES = {
    "onset_opening": "Dead zone at the onset of flow, opening",
    "onset_closing": "Dead zone at the onset of flow, closing",
    "dead_zone_opening": "Dead zone at the reading flow, opening",
    "dead_zone_closing": "Dead zone at the reading flow, closing",
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
    tables[-1] = replace(
        tables[-1],
        notes=(
            "Terms as in ISO 10770-1; the formulas are those of dzdesign, and no conformity is claimed.",
            *(f"{NAMES[key]}: {QUANTITIES[key].formula}." for key in EXPLAINED),
        ),
    )
    return Section(
        tables=tables,
        lines=(" ".join((f"{arrow}.", *origins, *_reading_flows(found.pressures, units))),),
    )


def _reading_flows(pressures: Sequence[PressureQuantities], units: RecordedUnits) -> Iterator[str]:
    flows = [each.reading_flow_L_min for each in pressures if each.reading_flow_L_min > 0]
    if flows:
        ends = dict.fromkeys(units.text(end, ".2f L/min") for end in (min(flows), max(flows)))
        yield f"Reading flow: {' … '.join(ends)}."


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
    text = after if key == LOSS else before if not driven else f"{before} → {after}"
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
