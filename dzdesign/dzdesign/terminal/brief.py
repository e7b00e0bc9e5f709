"""One screen for a valve, a design and a verification: the result and what limits it. ``-v`` has everything."""

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from dzdesign.core.display import verdict_words
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.terminal import design_tables, evidence_tables, tables
from dzdesign.terminal.page import Column, new_console, put_line, put_rows
from dzdesign.terminal.progress import is_verbose

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.assess.assessment import Assessment, PressureAssessment
    from dzdesign.assess.options import Set
    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.redesign import HysteresisChoice
    from dzdesign.identify.valve.model import ValveModel, Warning_
    from dzdesign.identify.valve.ramp_result import TestResult
    from dzdesign.verify.evidence import Evidence
    from dzdesign.verify.loop_results import PressureResult
    from dzdesign.verify.outputs.verification import OutputVerification
    from dzdesign.verify.verification import Verification

#: Characters of a warning beside its code, on a screen of 80.
LONGEST_WARNING = 76
#: Lines that warnings take at most.
MOST_WARNINGS = 4
#: Limits that do not hold of which each has a line.
MOST_MISSED = 3
MORE = "More: -v, and `dzdesign explain CODE`."


def print_valve(valve: "ValveModel") -> None:
    """Print the thresholds, the largest certified offset, what limits it, and each warning once."""
    if is_verbose():
        tables.print_valve(valve)
    else:
        put_valve(valve, new_console())
        if valve.warnings:
            put_line(new_console(), MORE)


def put_valve(valve: "ValveModel", console: "Console") -> None:
    """Put the screen of a valve on a page."""
    _put_thresholds(console, valve)
    _put_offsets(console, valve)
    put_line(console, tables.meter_line(valve.meter.floor_L_min, valve.meter.lag_in_words(), valve.recorded_units))
    tables.put_units(console, valve.recorded_units, "valve.json")
    for line in warning_lines(valve.warnings):
        put_line(console, line)


def _put_offsets(console: "Console", valve: "ValveModel") -> None:
    recorded = valve.recorded_units
    offsets = {name: recorded.of_side(name).text(side.curve.u_min0_V, ".3f V") for name, side in valve.sides.items()}
    (name, side), *others = valve.sides.items()
    confidence = f"{100 * side.certificate.confidence:.6g} %"
    if others:  # two sides fill the screen: what would gain most stands on the page of -v
        of_sides = ", ".join(f"{name} {offset}" for name, offset in offsets.items())
        put_line(console, f"Certified offset where beta is 1, {confidence}: {of_sides}")
        return
    units, dp0 = recorded.of_side(name), side.reference.dp_MPa
    at = "" if dp0 is None else f" at {units.text(dp0, '.2f MPa')}"
    gains = tables.gains_most(side, units)
    put_line(console, f"Certified offset at zero command: {offsets[name]}{at}, {confidence}. {gains}.")


def _put_thresholds(console: "Console", valve: "ValveModel") -> None:
    units, two_sided = valve.recorded_units, len(valve.sides) > 1
    rows = [
        (name, test, dict(zip((each.source for each in side.tests), side.beta.beta, strict=False)))
        for name, side in valve.sides.items()
        for test in side.tests
    ]

    def command(side: str, value: float | None) -> str:
        return "-" if value is None else units.of_side(side).number(value, ".3f V")

    columns: dict[str, Column[tuple[str, TestResult, dict[str, float]]]] = {
        **({"side": lambda row: row[0]} if two_sided else {}),
        f"dP ({units.label('MPa')})": lambda row: (
            "?" if row[1].dp_MPa is None else units.number(row[1].dp_MPa, ".2f MPa")
        ),
        "ramps": lambda row: str(len(row[1].ramps)),
        "opens": lambda row: command(row[0], row[1].u_knee_rising_V),
        "closes": lambda row: command(row[0], row[1].u_knee_falling_V),
        "bound": lambda row: command(row[0], row[1].u_guard_lower_V),
        "beta": lambda row: f"{row[2][row[1].source]:.4f}" if row[2] else "-",  # there is none without a known dP
        f"flow ({units.label('L/min')})": lambda row: units.number(row[1].q_max_L_min, ".1f L/min"),
    }
    words = (0,) if two_sided else ()
    put_rows(console, f"Thresholds ({units.label('V')}) and largest flow", rows, columns, words)


def print_design(compensator: "Compensator") -> None:
    """Print what dead zone and hysteresis remain with each choice, what the certificate covers, and the warnings."""
    if is_verbose():
        design_tables.print_design(compensator)
    else:
        put_design(compensator, new_console())
        put_line(new_console(), "More: -v, which also states the price of each choice.")


def put_design(compensator: "Compensator", console: "Console") -> None:
    """Put the screen of a design on a page."""
    from dzdesign.design.costs import design_warnings
    from dzdesign.design.position_loop import in_words
    from dzdesign.design.pressure_inputs import not_covered
    from dzdesign.design.redesign import hysteresis_choices, without_sensors

    units, sides = compensator.valve.recorded_units, dict[str, list[str]]()
    for sign in compensator.signals.signs:
        certificate = compensator.side(sign).certificate
        low, high = (float(end) for end in certificate.dp_MPa)
        sides.setdefault(
            f"at zero command the output stays below the {100 * certificate.confidence:.6g} % bound of the "
            f"{certificate.guard} threshold, {units.span(low, high, '.2f MPa')}, of {compensator.certified_of}.", []
        ).append(compensator.valve.side_name(sign))  # fmt: skip
    for line, names in sides.items():
        put_line(console, f"{' and '.join(names)}: {line}" if compensator.two_sided else line)
    choices = hysteresis_choices(compensator)
    if choices:
        _put_choices(console, (without_sensors(compensator), *choices))
    for line in in_words(compensator):
        put_line(console, f"{line[:1].upper()}{line[1:]}.")
    for line in not_covered(compensator):
        put_line(console, f"not covered: {line}")
    for line in design_warnings(compensator):
        put_line(console, f"warning: {line}")


def print_result(verification: "Verification | OutputVerification") -> None:
    """Print what does not hold or was not checked, the dead zones in closed loop, and the verdict on a C firmware.

    Of another output, which has few requirements, it is all of them.
    """
    from dzdesign.verify.verification import Verification

    if is_verbose() or not isinstance(verification, Verification):
        evidence_tables.print_result(verification)
    else:
        put_result(verification, new_console())


def put_result(verification: "Verification", console: "Console") -> None:
    """Put the screen of a firmware's verification on a page."""
    evidence = verification.evidence
    for check in evidence.checks:
        if check.holds is not True:
            put_line(console, f"{verdict_words(check.holds)}  {check.name}: {check.text}")
    held, tried, wrong = (
        sum(check.holds is True for check in evidence.checks),
        sum(each.inputs for each in evidence.inputs), sum(each.wrong for each in evidence.inputs),
    )  # fmt: skip
    put_line(console, f"{verdict_words(True)}  {held} requirements; {tried} inputs checked, {wrong} wrong")
    _put_untried(console, evidence)
    units = verification.derived.valve.recorded_units if verification.derived else AS_COMPUTED
    if evidence.closed_loop.pressures:
        _put_loop(console, evidence.closed_loop.pressures, units)
    put_line(console, verification.verdict)


def _put_untried(console: "Console", evidence: "Evidence") -> None:
    from dzdesign.verify.verification import label_of_untried, untried_requirements

    untried: dict[str, list[str]] = {}
    for each in untried_requirements(evidence):
        untried.setdefault(label_of_untried(each), []).append(each.id)
    for label, ids in untried.items():
        put_line(console, f"{label}  {', '.join(ids)}")


def _put_loop(console: "Console", pressures: "Sequence[PressureResult]", units: "RecordedUnits") -> None:
    def share(value: float | None) -> str:
        return "-" if value is None else f"{100 * value:.1f}"

    sides = {each.side for each in pressures}
    columns: dict[str, Column[PressureResult]] = {"side": lambda each: each.side} if len(sides) > 1 else {}
    columns |= {
        f"dP ({units.label('MPa')})": lambda each: units.number(each.dp_MPa, ".2f MPa"),
        "opens without (%)": lambda each: share(each.dead_zone_opening),
        "with (%)": lambda each: share(each.residual_opening),
        f"flow at zero ({units.label('L/min')})": lambda each: each.in_words(each.q_zero_L_min, units),
        f"largest ({units.label('L/min')})": lambda each: units.number(each.q_max_L_min, ".1f L/min"),
    }
    put_rows(console, "Closed loop: dead zone in % of command", pressures, columns, words=())


def _put_choices(console: "Console", choices: "Sequence[HysteresisChoice]") -> None:
    def share(value: float | None) -> str:
        return "-" if value is None else f"{100 * value:.2f}"

    columns: dict[str, Column[HysteresisChoice]] = {
        "choice": lambda each: each.given + (f" ({judged})" if (judged := each.judged) else ""),
        "dead zone": lambda each: share(each.onset),
        "hysteresis": lambda each: share(each.hysteresis),
    }
    put_rows(console, "Left (% of command): largest dead zone, mean hysteresis", choices, columns)
    for each in choices:
        if each.refused:
            put_line(console, f"{each.given}: {each.refused}")
        if each.possible:
            put_line(console, f"{each.given}: {each.possible}.")


def print_assessment(assessment: "Assessment") -> None:
    """Print dead zone, hysteresis and flows without and with the compensator, and the limits that do not hold."""
    if is_verbose():
        evidence_tables.print_assessment(assessment)
        return
    console, units = new_console(), assessment.recorded_units
    pressures = evidence_tables.shown_pressures(assessment) or assessment.pressures

    def change(key: str, form: str) -> "Column[PressureAssessment]":
        def shown(item: "PressureAssessment", name: "Set") -> str:
            reading = item.readings(name).get(key)
            known = None if reading is None else reading.at_most if reading.value is None else reading.value
            if reading is None or known is None:
                return "–"
            number = units.number(known, form) if "L/min" in form else f"{known:{form}}"
            return number if reading.value is not None else f"≤{number}"

        return lambda item: f"{shown(item, 'before')} → {shown(item, 'after')}"

    columns: dict[str, Column[PressureAssessment]] = {
        "side": lambda item: item.side,
        f"dP ({units.label('MPa')})": lambda item: (
            "–" if item.dp_MPa is None else units.number(item.dp_MPa, ".2f MPa")
        ),
        "dead zone (%)": change("dead_zone_opening", ".1f"),
        "hysteresis (%)": change("hysteresis", ".1f"),
        f"flow at zero ({units.label('L/min')})": change("flow_at_zero", ".2f L/min"),
        f"largest ({units.label('L/min')})": change("largest_flow", ".2f L/min"),
    }
    put_rows(console, "Without → with the compensator, on opening at the reading flow", pressures, columns)
    if hidden := evidence_tables.not_observable(assessment):
        put_line(console, f"not observable: {len(hidden)} kinds of reading, see -v")
    *limits, verdict = evidence_tables.limit_lines(assessment)
    missed = [line for line in limits if not line.startswith(f"{verdict_words(True)} ")]
    for line in (*warning_lines(assessment.notes, "note"), *map(_shortened, missed[:MOST_MISSED]), verdict):
        put_line(console, line)
    tables.put_units(console, units, "assessment.json")
    put_line(console, "More: -v, with every quantity.")


def warning_lines(warnings: "Iterable[Warning_]", word: str = "warning") -> Iterator[str]:
    """Yield a line for each code, with how often it was raised; of many the last ones' codes share a line."""
    counts: dict[str, int] = {}
    first: dict[str, str] = {}
    for each in warnings:
        counts[each.code] = counts.get(each.code, 0) + 1
        first.setdefault(each.code, f"{each.source}: {each.text}" if each.source else each.text)
    times = {code: f" ({count})" if count > 1 else "" for code, count in counts.items()}
    shown = len(counts) if len(counts) <= MOST_WARNINGS else MOST_WARNINGS - 1
    for code in list(counts)[:shown]:
        yield _shortened(f"{word} [{code}]{times[code]} {first[code]}")
    if rest := [code + times[code] for code in counts][shown:]:
        yield f"further {word}s: {', '.join(rest)}"


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_WARNING else f"{text[:LONGEST_WARNING].rpartition(' ')[0]} ..."
