"""An assessment as tables on stdout: each pressure drop, what could not be seen, the formulas, the limits."""

from typing import TYPE_CHECKING

from dzdesign.core.display import DOES_NOT_HOLD, verdict_words
from dzdesign.terminal.page import Table, new_console, put_line, put_table
from dzdesign.terminal.tables import meter_line, put_units

if TYPE_CHECKING:
    from dzdesign.assess.assessment import Assessment, PressureAssessment
    from dzdesign.assess.quantities import Reading
    from dzdesign.core.recorded_units import RecordedUnits

#: Decimals in the unit of a quantity.
DECIMALS = {"%": 2, "L/min": 3, "L/min/V": 4}
#: Quantities of the overview.
OVERVIEW = ("dead_zone_opening", "dead_zone_closing", "hysteresis", "largest_flow")


def print_assessment(assessment: "Assessment") -> None:
    """Print each pressure drop, the reasons of what is not observable, formulas, notes and limits."""
    from dzdesign.identify.valve.model import lag_in_words

    page, units, meter = new_console(), assessment.recorded_units, assessment.meter
    shown = _shown_pressures(assessment)
    if len(shown) > 1:
        put_table(page, _overview_of(shown, units))
    for item in shown:
        put_table(page, _table_of(item, units))
    lines = [
        *_not_observable(assessment),
        *_remarks(assessment),
        f"{assessment.terms[0].upper()}{assessment.terms[1:]}:",
        *(f"  {text}" for text in _formulas(assessment)),
        meter_line(meter.floor_L_min, lag_in_words(meter.lag_s, meter.lag_is), units),
        *(f"note [{each.code}] {f'{each.source}: ' if each.source else ''}{each.text}" for each in assessment.notes),
        *_limits(assessment),
    ]
    for line in lines:
        put_line(page, line)
    put_units(page, units, "assessment.json")


def _overview_of(shown: list["PressureAssessment"], units: "RecordedUnits") -> Table:
    """Return a row for each pressure drop and side: what most readers look for, before and after."""
    from dzdesign.assess.quantities import QUANTITIES

    quantities = {key: QUANTITIES[key] for key in OVERVIEW}
    headers = [f"{each.name} ({_unit(each.unit, units)})" for each in quantities.values()]
    title = "Overview, before → after; a table of each pressure drop follows"
    table = Table(title, f"dP ({units.label('MPa')})", "commands", *headers, words=(0, 1))
    for item in shown:
        pairs = {key: (item.quantities[key].before, item.quantities[key].after) for key in quantities}
        table.add_row(
            "unknown" if item.dp_MPa is None else units.number(item.dp_MPa, ".2f MPa"),
            item.side,
            *(" → ".join(_shown(each, quantities[key].unit, units) for each in pair) for key, pair in pairs.items()),
        )
    return table


def _table_of(item: "PressureAssessment", units: "RecordedUnits") -> Table:
    from dzdesign.assess.quantities import QUANTITIES

    where = "pressure drop unknown" if item.dp_MPa is None else units.text(item.dp_MPa, ".2f MPa")
    reading = units.text(item.reading_flow_L_min, ".3g L/min")
    titles = ("quantity", "unit", "before", "after", "change", "s.e. of change")
    rows = Table(f"{where}, {item.side} commands; dead zones read at {reading}", *titles)
    for key, found in item.quantities.items():
        quantity, change, both = QUANTITIES[key], found.change, (found.before, found.after)
        if key == "symmetry" and all(reading is None or reading.value is None for reading in both):
            continue  # of a valve with one side: printed below where a limit asks for it
        rows.add_row(
            quantity.name,
            _unit(quantity.unit, units),
            *(_shown(reading, quantity.unit, units) for reading in both),
            _number(change.value if change else None, quantity.unit, units, "+"),
            _number(change.se if change else None, quantity.unit, units),
        )
    return rows


def _unit(unit: str, units: "RecordedUnits") -> str:
    return unit if unit == "%" else units.label(unit)


def _number(value: float | None, unit: str, units: "RecordedUnits", sign: str = "") -> str:
    if value is None:
        return "-"

    def text(shown: float) -> str:
        form = f"{sign}.{DECIMALS[unit]}f"
        return format(shown, form) if unit == "%" else units.number(shown, f"{form} {unit}")

    return text(value) if float(text(value)) else text(0.0)  # no -0.00


def _shown(reading: "Reading | None", unit: str, units: "RecordedUnits") -> str:
    """Return a value, or the bound of what is not observable."""
    if reading is None or reading.value is not None:
        return _number(reading.value if reading else None, unit, units)
    return "?" if reading.at_most is None else f"< {_number(reading.at_most, unit, units)}"


def _not_observable(assessment: "Assessment") -> list[str]:
    """Return a sentence for each reason why something is not observable, with all pressure drops that it holds for."""
    from dzdesign.assess.options import SETS
    from dzdesign.assess.quantities import QUANTITIES

    units = assessment.recorded_units
    reasons: dict[tuple[str, str], dict[str, list[str]]] = {}
    for item in _shown_pressures(assessment):
        for name in SETS:
            for key, reading in item.readings(name).items():
                if reading.value is None and not (key == "symmetry" and _one_sided(assessment)):
                    places = reasons.setdefault((QUANTITIES[key].name, reading.not_observable or ""), {})
                    where = "unknown" if item.dp_MPa is None else units.number(item.dp_MPa, ".2f MPa")
                    side = "" if _one_sided(assessment) else f", {item.side} commands"
                    places.setdefault(name.upper() + side, []).append(where)
    together: dict[tuple[str, str], list[str]] = {}
    for (quantity, reason), places in reasons.items():
        where = " and ".join(f"{name} at {', '.join(dp)} {units.label('MPa')}" for name, dp in places.items())
        together.setdefault((where, reason), []).append(quantity)
    return [
        f"not observable: {'; '.join(quantities)}: {where}, because {reason}"
        for (where, reason), quantities in together.items()
    ]


def _remarks(assessment: "Assessment") -> list[str]:
    """Return what must be known beside the values."""
    from dzdesign.assess.options import SETS
    from dzdesign.assess.quantities import QUANTITIES

    return [
        f"{QUANTITIES[key].name}, {name.upper()} at {item.place(assessment.recorded_units)}: {reading.note}"
        for item in _shown_pressures(assessment)
        for name in SETS
        for key, reading in item.readings(name).items()
        if reading.note
    ]


def _shown_pressures(assessment: "Assessment") -> list["PressureAssessment"]:
    """Return those with a recording with the compensator: of the others there is a note, and all in the JSON."""
    return [item for item in assessment.pressures if item.after]


def _one_sided(assessment: "Assessment") -> bool:
    return len({item.side for item in assessment.pressures}) == 1


def _formulas(assessment: "Assessment") -> list[str]:
    from dzdesign.assess.quantities import QUANTITIES

    low, high = assessment.options.linearity_window
    knee = "-".join(f"{share:.0%}" for share in assessment.options.knee_window).replace("%-", "-")
    shown = [each for key, each in QUANTITIES.items() if not (key == "symmetry" and _one_sided(assessment))]
    return [
        *(f"{each.name} = {each.formula}" for each in shown),
        "u_r(Q), u_f(Q): command at which the rising, the falling branch has the flow Q; every flow but the largest "
        "and that at zero is scaled by sqrt(dP) to its set's pressure drop at zero flow (of the two sets within 2 %); "
        f"straight part: {knee} of the largest flow, wider where the curve stays straight; window "
        f"of u: {low:.0%} to {high:.0%} of u_max",
    ]


def _limits(assessment: "Assessment") -> list[str]:
    """Return a line for each limit and recording, the verdict first."""
    from dzdesign.assess.limits import LIMITED

    if not assessment.limits:
        return ["No limits were given (--limits, or [limits] in the file of options): nothing was required."]
    lines = [
        f"{verdict_words(result.holds)}  {LIMITED[result.quantity].name}, {result.place}: {result.text}"
        for result in assessment.limits
    ]
    bad = sum(not result.holds for result in assessment.limits)
    verdict = f"{DOES_NOT_HOLD}: {bad} of {len(lines)} limits are exceeded or could not be checked"
    return [*lines, verdict if bad else "Every limit holds."]
