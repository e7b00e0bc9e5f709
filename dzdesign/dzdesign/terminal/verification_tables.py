"""A verification as tables on stdout: every requirement, the closed loop, the scenarios."""

from typing import TYPE_CHECKING

from dzdesign.core.display import NOT_ASKED_FOR, NOT_REQUIRED, verdict_words
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.terminal.page import new_console, put_line, put_rows, volts

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rich.console import Console

    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.loop_results import PressureResult, ScenarioResult
    from dzdesign.verify.outputs.verification import OutputVerification
    from dzdesign.verify.verification import Verification


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


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
    if verification.loops:
        _put_closed_loop(console, verification, units)
    print_scenarios(verification.evidence.scenarios, console, units)
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


def _put_closed_loop(console: "Console", verification: "Verification", units: "RecordedUnits") -> None:
    plant = verification.evidence.closed_loop.plant_source
    pressure, flow = (units.label(unit) for unit in ("MPa", "L/min"))
    both = len({loop.result.side for loop in verification.loops}) > 1
    columns: dict[str, Callable[[PressureResult], str]] = {
        f"dP ({pressure})": lambda loop: (f"{loop.side} " if both else "") + units.number(loop.dp_MPa, ".2f MPa"),
        "uncompensated: opening": lambda loop: _percent(loop.dead_zone_opening),
        "uncompensated: closing": lambda loop: _percent(loop.dead_zone_closing),
        "compensated: opening": lambda loop: _percent(loop.residual_opening),
        "compensated: closing": lambda loop: _percent(loop.residual_closing),
        "Q at zero, constant offset": lambda loop: loop.in_words(loop.q_zero_without_beta_L_min, units),
        "Q at zero": lambda loop: loop.in_words(loop.q_zero_L_min, units),
        "Q max, uncompensated": lambda loop: units.number(loop.q_max_direct_L_min, ".1f L/min"),
        "Q max, compensated": lambda loop: units.number(loop.q_max_L_min, ".1f L/min"),
    }
    hidden = verification.loops[0].result.unseen_below_L_min is not None
    onset = "onset of flow" + (" (the first flow seen, continued to none)" if hidden else "")
    title = f"Closed loop: the C code with the simulated valve ({plant}); dead zones in % of full command, "
    title += f"at the {onset}; flow Q in {flow}"
    put_rows(console, title, [loop.result for loop in verification.loops], columns)
    backs = ", ".join(units.text(each, ".2f MPa") for each in verification.evidence.closed_loop.back_MPa)
    put_line(console, f"Pressure behind the edge: {backs}; ramps at the highest, failing sensors at each.")
    _put_readings(console, verification, {f"dP ({pressure})": columns[f"dP ({pressure})"]}, units)


def _put_readings(
    console: "Console",
    verification: "Verification",
    where: "Mapping[str, Callable[[PressureResult], str]]",
    units: "RecordedUnits",
) -> None:
    """Print the dead zones read at the reading flow, as a bench reads them, beside an ideal line's."""
    results = [loop.result for loop in verification.loops]
    columns: dict[str, Callable[[PressureResult], str]] = {
        **where,
        "uncompensated: opening": lambda loop: _percent(loop.reading_opening_without),
        "uncompensated: closing": lambda loop: _percent(loop.reading_closing_without),
        "compensated: opening": lambda loop: _percent(loop.reading_opening),
        "compensated: closing": lambda loop: _percent(loop.reading_closing),
        "ideal line": lambda loop: _percent(loop.ideal_line),
    }
    flow = units.text(results[0].reading_flow_L_min, ".2f L/min")
    put_rows(console, f"Dead zones read at {flow}; an ideal line rises straight from zero", results, columns)


def print_scenarios(
    scenarios: "Sequence[ScenarioResult]", console: "Console", units: "RecordedUnits" = AS_COMPUTED
) -> None:
    """Print every scenario once: its worst over the pressures, and below the table what else was read there.

    One that is required at some pressures only stands twice.
    """

    def severity(each: "ScenarioResult") -> tuple[float, float, float]:
        return each.q_zero_L_min, each.q_peak_at_zero_L_min, each.dp_MPa

    def name_of(each: "ScenarioResult") -> str:
        return each.name + (f" (not required: {each.not_required})" if each.not_required else "")

    names = dict.fromkeys(map(name_of, scenarios))
    shown = [max((each for each in scenarios if name_of(each) == name), key=severity) for name in names]
    flow = units.label("L/min")
    columns: dict[str, Callable[[ScenarioResult], str]] = {
        "scenario": name_of,
        f"dP ({units.label('MPa')})": lambda each: units.number(each.dp_MPa, ".2f MPa"),
        "behind": lambda each: units.number(each.back_MPa, ".2f MPa"),
        f"Q at zero, at the end ({flow})": lambda each: each.in_words(each.q_zero_L_min, units),
        f"on the way, at most ({flow})": lambda each: each.in_words(each.q_peak_at_zero_L_min, units),
    }
    if shown:
        title = "Scenarios with the compensator, worst of all pressure drops and pressures behind the edge"
        put_rows(console, title, shown, columns)
    for each in shown:  # words of many lines in a narrow column are not a table
        if each.figures:
            put_line(console, f"{name_of(each)}: {_figures(each, units)}")


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
    """Print the demo's closing table: per pressure drop, what was found and what the compensator does."""
    tests = {round(test.dp_MPa or 0.0, 6): test for test in valve.positive.tests}

    def thresholds(loop: "PressureResult") -> str:
        test = tests[round(loop.dp_MPa, 6)]
        return f"{volts(test.u_knee_rising_V)} / {volts(test.u_knee_falling_V)}"

    columns: dict[str, Callable[[PressureResult], str]] = {
        "dP (MPa)": lambda loop: f"{loop.dp_MPa:.2f}",
        "threshold open/close (V)": thresholds,
        "uncompensated: opening": lambda loop: _percent(loop.dead_zone_opening),
        "compensated: opening": lambda loop: _percent(loop.residual_opening),
        "compensated: closing": lambda loop: _percent(loop.residual_closing),
        "Q at zero, constant offset": lambda loop: loop.in_words(loop.q_zero_without_beta_L_min, AS_COMPUTED),
        "Q at zero": lambda loop: loop.in_words(loop.q_zero_L_min, AS_COMPUTED),
    }
    console = new_console()
    title = "Simulated example valve, 0-10 V ramps in closed loop with the generated C; flow Q in L/min"
    put_rows(console, title, [loop.result for loop in verification.loops], columns)
    reference = valve.positive.reference.dp_MPa
    put_line(
        console,
        "beta: change of the threshold with the pressure drop, which the firmware applies to its offset. Without beta "
        f"the offset stays that of {reference:g} MPa, and flow (Q) passes at zero command where "
        "the threshold is lower.",
    )
    _put_readings(console, verification, {"dP (MPa)": columns["dP (MPa)"]}, AS_COMPUTED)
    checked, wrong = (sum(getattr(each, name) for each in verification.evidence.inputs) for name in ("inputs", "wrong"))
    put_line(console, f"Inputs checked: {checked}, wrong: {wrong}")
    put_line(console, verification.verdict)
    put_line(console, f"Open first: {folder}/evidence/report.html")
