"""A verification as tables on stdout: every requirement, the closed loop, the scenarios."""

from typing import TYPE_CHECKING

from dzdesign.core.display import NOT_ASKED_FOR, NOT_REQUIRED, verdict_words
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.terminal.page import new_console, put_facts, put_line

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.identify.valve.model import ValveModel
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


def print_demo(valve: "ValveModel", verification: "Verification", folder: str) -> None:
    """Print what the demo ends with: the dead zones and flows of the closed loop, and what was checked."""
    from dzdesign.report.sections.closed_loop import loops_table, readings_table

    console, pressures = new_console(), verification.evidence.closed_loop.pressures
    put_line(console, "Simulated example valve, 0-10 V ramps in closed loop with the generated C.")
    put_facts(console, loops_table(pressures, AS_COMPUTED), readings_table(pressures, AS_COMPUTED))
    put_line(
        console,
        "β (beta): change of the threshold with the pressure drop, which the firmware applies to its offset. Without "
        f"it the offset stays that of {valve.positive.reference.dp_MPa:g} MPa, and flow passes at zero command where "
        "the threshold is lower.",
    )
    checked, wrong = (sum(getattr(each, name) for each in verification.evidence.inputs) for name in ("inputs", "wrong"))
    put_line(console, f"Inputs checked: {checked}, wrong: {wrong}")
    put_line(console, verification.verdict)
    put_line(console, f"Open first: {folder}/evidence/report.html")
