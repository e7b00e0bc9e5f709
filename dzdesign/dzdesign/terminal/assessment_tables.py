"""An assessment on stdout: each quantity before and after, what could not be seen, the limits."""

from dataclasses import replace
from typing import TYPE_CHECKING

from dzdesign.core.display import DOES_NOT_HOLD, verdict_words
from dzdesign.terminal.page import new_console, put_facts, put_line
from dzdesign.terminal.tables import meter_line, put_units

if TYPE_CHECKING:
    from dzdesign.assess.assessment import Assessment, PressureAssessment


def print_assessment(assessment: "Assessment") -> None:
    """Print each quantity before and after, what is not observable and why, notes and limits."""
    from dzdesign.identify.valve.model import lag_in_words
    from dzdesign.report.sections.characteristic import characteristic_section
    from dzdesign.report.sections.quantities import characteristic_quantities

    page, units, meter = new_console(), assessment.recorded_units, assessment.meter
    shown = replace(assessment, pressures=tuple(_shown_pressures(assessment)) or assessment.pressures)
    section = characteristic_section(characteristic_quantities(None, shown, (), ()), units)
    put_facts(page, *section.tables)
    lines = [
        *section.lines,
        *_ideal_line(assessment),
        *_not_observable(assessment),
        *_remarks(assessment),
        meter_line(meter.floor_L_min, lag_in_words(meter.lag_s, meter.lag_is), units),
        *(f"note [{each.code}] {f'{each.source}: ' if each.source else ''}{each.text}" for each in assessment.notes),
        *_limits(assessment),
    ]
    for line in lines:
        put_line(page, line)
    put_units(page, units, "assessment.json")


def _ideal_line(assessment: "Assessment") -> list[str]:
    """Return what a straight line from zero to the largest flow would read at the reading flow."""
    read = [
        f"{found.value:.2f} % ({item.place(assessment.recorded_units)})"
        for item in _shown_pressures(assessment)
        if (found := item.quantities["ideal_line"].after) and found.value is not None
    ]
    return [f"At the reading flow an ideal line from zero reads {', '.join(read)}."] if read else []


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
