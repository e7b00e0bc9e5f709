"""A verification, an assessment and a reproduction as tables on stdout."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from dzdesign.core.display import DOES_NOT_HOLD, NOT_ASKED_FOR, NOT_REQUIRED, verdict_words
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.terminal.page import Column, new_console, put_facts, put_line, put_rows
from dzdesign.terminal.tables import meter_line, put_units

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.assess.assessment import Assessment, PressureAssessment
    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.reproduce.artefact import LawNumber, ProductResult, RejectedReading, Reproduction
    from dzdesign.verify.evidence import Evidence
    from dzdesign.verify.loop_results import ScenarioResult
    from dzdesign.verify.outputs.verification import OutputVerification
    from dzdesign.verify.verification import Verification


def print_result(verification: "Verification | OutputVerification") -> None:
    """Print a verification of a C firmware, or of another output."""
    from dzdesign.verify.verification import Verification

    if isinstance(verification, Verification):
        print_verification(verification)
    else:
        print_output_verification(verification)


def print_verification(verification: "Verification", console: "Console | None" = None) -> None:
    """Print every check, what was not tried, and the closed loop per pressure drop."""
    from dzdesign.verify.verification import label_of_untried, untried_requirements

    console = console or new_console()
    for check in verification.evidence.checks:
        put_line(console, f"{verdict_words(check.holds)}  {check.name}: {check.text}")
        for found in check.not_required:
            put_line(console, f"{NOT_REQUIRED}  {found}")
    for each in untried_requirements(verification.evidence):
        put_line(console, f"{label_of_untried(each)}  {each.title}: {each.how}".replace("`", ""))
    units = verification.derived.valve.recorded_units if verification.derived else AS_COMPUTED
    print_loop(verification.evidence, console, units)
    put_line(console, verification.verdict)


def print_output_verification(verification: "OutputVerification", console: "Console | None" = None) -> None:
    """Print every check of an output other than a C firmware, and what was not tried."""
    from dzdesign.verify.requirements import RAMPS

    console = console or new_console()
    for check in verification.evidence.checks:
        put_line(console, f"{verdict_words(check.holds)}  {check.name}: {check.text}")
    if not any(check.id == RAMPS.id for check in verification.evidence.checks):
        put_line(console, f"{NOT_ASKED_FOR}  {RAMPS.title}: {RAMPS.how}".replace("`", ""))
    put_line(console, verification.verdict)


def print_loop(evidence: "Evidence", console: "Console", units: "RecordedUnits" = AS_COMPUTED) -> None:
    """Print the tables of the closed loop, and what else was read in its scenarios."""
    from dzdesign.report.sections.closed_loop import facts, worst_of_each

    if evidence.closed_loop.pressures:
        backs = ", ".join(units.text(each, ".2f MPa") for each in evidence.closed_loop.back_MPa)
        plant = f"the simulated valve ({evidence.closed_loop.plant_source})"
        behind = f"pressure behind the edge: {backs}; ramps at the highest, failing sensors at each"
        put_line(console, f"Closed loop: the C code with {plant}; {behind}.")
    put_facts(console, *facts(evidence, units))
    for each in worst_of_each(evidence.scenarios):  # words of many lines in a narrow column are not a table
        if each.figures:
            put_line(console, f"{each.name}: {_figures(each, units)}")


#: How a figure's name begins -> of which valve it is; and how it ends -> its unit.
VALVES = {"compensated_": "with the compensator ", "direct_": "without it ", "": ""}
UNITS = {"_L_min": "L/min", "_MPa": "MPa", "_ms": "ms", "_mL": "mL", "_percent": "%", "": ""}
#: Those in which a valve may be recorded otherwise.
RECORDED = ("L/min", "MPa")


def _figures(result: "ScenarioResult", units: "RecordedUnits") -> str:
    """Return figures as words, those of one valve together: rise_ms is a rise in ms."""
    figures, unseen = result.figures, result.unseen_below_L_min
    groups: dict[str, list[str]] = {start: [] for start in VALVES}
    for key, value in figures.items():
        start, end = next(filter(key.startswith, VALVES)), next(filter(key.endswith, UNITS))
        name = key.removeprefix(start).removesuffix(end).replace("_", " ")
        # A change of flow may well be small; a flow that the recordings can't show is no small one.
        hidden = unseen is not None and name.endswith("flow") and value < unseen
        unit = UNITS[end]
        number = units.number(value, f".3g {unit}") if unit in RECORDED else f"{value:.3g}"
        number = result.in_words(value, units) if hidden else number
        groups[start].append(f"{name} {number} {units.label(unit) if unit in RECORDED else unit}".rstrip())
    return "; ".join(VALVES[start] + ", ".join(each) for start, each in groups.items() if each)


def print_assessment(assessment: "Assessment") -> None:
    """Print each quantity before and after, what is not observable and why, notes and limits."""
    from dzdesign.identify.valve.model import lag_in_words
    from dzdesign.report.sections.characteristic import characteristic_section
    from dzdesign.report.sections.quantities import characteristic_quantities

    page, units, meter = new_console(), assessment.recorded_units, assessment.meter
    shown = replace(assessment, pressures=tuple(shown_pressures(assessment)) or assessment.pressures)
    section = characteristic_section(characteristic_quantities(None, shown, (), ()), units)
    put_facts(page, *section.tables)
    lines = [
        *section.lines,
        *not_observable(assessment),
        *_remarks(assessment),
        meter_line(meter.floor_L_min, lag_in_words(meter.lag_s, meter.lag_is), units),
        *(f"note [{each.code}] {f'{each.source}: ' if each.source else ''}{each.text}" for each in assessment.notes),
        *limit_lines(assessment),
    ]
    for line in lines:
        put_line(page, line)
    put_units(page, units, "assessment.json")


def not_observable(assessment: "Assessment") -> list[str]:
    """Return a sentence for each reason why something is not observable, with all pressure drops that it holds for."""
    from dzdesign.assess.options import SETS
    from dzdesign.assess.quantities import QUANTITIES

    units = assessment.recorded_units
    reasons: dict[tuple[str, str], dict[str, list[str]]] = {}
    for item in shown_pressures(assessment):
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
        for item in shown_pressures(assessment)
        for name in SETS
        for key, reading in item.readings(name).items()
        if reading.note
    ]


def shown_pressures(assessment: "Assessment") -> list["PressureAssessment"]:
    """Return those with a recording with the compensator: of the others there is a note, and all in the JSON."""
    return [item for item in assessment.pressures if item.after]


def _one_sided(assessment: "Assessment") -> bool:
    return len({item.side for item in assessment.pressures}) == 1


def limit_lines(assessment: "Assessment") -> list[str]:
    """Return a line for each limit and recording, its verdict first, and a line for all of them."""
    from dzdesign.assess.quantities import LIMITED

    if not assessment.limits:
        return ["No limits were given (--limits, or [limits] in the file of options): nothing was required."]
    lines = [
        f"{verdict_words(result.holds)}  {LIMITED[result.quantity].name}, {result.place}: {result.text}"
        for result in assessment.limits
    ]
    bad = sum(not result.holds for result in assessment.limits)
    verdict = f"{DOES_NOT_HOLD}: {bad} of {len(lines)} limits are exceeded or could not be checked"
    return [*lines, verdict if bad else "Every limit holds."]


AGREES, MISSED, UNEXPLAINED = "agrees", "MISSED", "MISSED, NOBODY KNOWS WHY"


def print_reproduction(reproduction: "Reproduction") -> None:
    """Print the three tables: the paper against its law, the product on its valves, and readings that were rejected."""
    console = new_console()
    missed = [item for item in reproduction.law if not item.agrees]
    columns: dict[str, Column[LawNumber]] = {
        "valve": lambda item: item.valve,
        "": lambda item: item.quantity,
        "MPa": lambda item: f"{item.dp_MPa:g}",
        "paper": lambda item: _with_unit(item.published, item.unit),
        "its law": lambda item: _range(item.range),
        "verdict": lambda item: AGREES if item.agrees else f"{MISSED} [{1 + missed.index(item)}]",
    }
    put_rows(console, "(A) The paper's numbers against the paper's law", reproduction.law, columns, words=(0, 1, 5))
    for number, item in enumerate(missed, 1):
        itself = " The paper contradicts itself." if item.contradiction else ""
        put_line(console, f"[{number}] {item.reason or UNEXPLAINED}.{itself}")
    _put_product(console, reproduction.product)
    readings: dict[str, Column[RejectedReading]] = {
        "reading": lambda item: f"{item.valve}: {item.reading}",
        "number": lambda item: item.quantity,
        "paper": lambda item: _with_unit(item.published, item.unit),
        "reading gives": lambda item: _range(item.range) if item.holds else f"{_range(item.range)}, NOT RULED OUT",
    }
    put_rows(console, "(C) Readings of the paper that were tried and rejected", reproduction.rejected, readings,
             words=(0, 1))  # fmt: skip
    put_line(console, f"Given in (A): {reproduction.given}.")
    put_line(console, f"Assumed, as the paper does not say it: {'; '.join(reproduction.hypotheses)}.")
    for line in summary(reproduction):
        put_line(console, line)


def _put_product(console: "Console", results: "Sequence[ProductResult]") -> None:
    columns: dict[str, Column[ProductResult]] = {
        "valve": lambda item: item.valve,
        "MPa": lambda item: f"{item.dp_MPa:g}",
        "without": lambda item: f"{item.published_without} %",
        "paper": lambda item: f"{item.published} %",
        "dzdesign": lambda item: f"{item.dead_zone:.1f} %",
        "ideal line": lambda item: f"{item.ideal_line:.1f} %",
        "zero, paper without beta": lambda item: item.published_zero and f"{item.published_zero} L/min",
        "zero, dzdesign": lambda item: f"{item.zero_L_min:g} L/min",
    }
    put_rows(console, "(B) dzdesign on the same valves: dead zone at 0.6 L/min, flow at zero command", results, columns)
    for item in results:
        for fault in item.faults:
            put_line(console, f"WRONG, {item.valve}, {item.dp_MPa:g} MPa: {fault}")


def summary(reproduction: "Reproduction") -> list[str]:
    """Return what became of the predicted numbers, and of the product."""
    law = reproduction.law
    agree, itself = (sum(getattr(item, name) for item in law) for name in ("agrees", "contradiction"))
    unknown, faults = sum(not item.holds for item in law), sum(bool(item.faults) for item in reproduction.product)
    missed = len(law) - agree
    right = "dzdesign passes no flow at zero command, and its dead zone is that of the ideal line."
    return [
        f"{len(law)} numbers predicted: {agree} agree, {missed} are missed; in {itself} of these the paper contradicts "
        "itself.",
        f"{unknown} MISSED FOR NO REASON." if unknown else "Every miss has its reason.",
        f"dzdesign is WRONG in {faults} rows." if faults else right,
    ]


def _with_unit(published: str, unit: str) -> str:
    """Return a printed number with its unit; words have none."""
    return f"{published} {unit}" if published[0].isdigit() else published


def _range(ends: tuple[float, float]) -> str:
    """Return a range whose ends are rounded as they are printed; one number where they read alike."""
    return " to ".join(dict.fromkeys(f"{end:.2f}" for end in ends))
