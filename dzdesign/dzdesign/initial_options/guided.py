"""`init` at a terminal: a question for each thing that the recordings can't tell, before anything is written."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import write_file
from dzdesign.core.errors import InputError, one_line
from dzdesign.core.option_readers import with_tolerance
from dzdesign.core.options import read_options
from dzdesign.core.units import parse_quantity
from dzdesign.initial_options.proposal import Declared
from dzdesign.stages.init import InitArguments, check_output, look
from dzdesign.stages.recordings import distinct_names
from dzdesign.terminal.questions import ask

if TYPE_CHECKING:
    from dzdesign.identify.reading.proposed_columns import ProposedColumns
    from dzdesign.initial_options.proposal import Proposal

INTRODUCTION = "Questions on what the recordings can't tell. Enter takes what stands in brackets or leaves it open."
#: What a column of pressure may be, and the answer for none of them.
PRESSURE_IS, NOT_USED = ("dP", "pP", "pA", "pB", "pT"), "-"
WHICH_PRESSURE = "dP (drop over the valve), pP, pA, pB, pT (at a port) or - (none)"
COLUMN_IS = {"time": "time", "u": "the command, u", "Q": "the flow, Q"}
#: Full command may lie this far below the largest command that was seen.
OVER_FULL = 1.02


def init_by_questions(arguments: InitArguments) -> "Proposal":
    """Look at recordings, ask what they leave open, and write the options file after the last answer.

    Raises
    ------
    InputError
        As `init`; and if the input ends before the last answer.
    """
    check_output(arguments)
    proposal, said = look(arguments), list[str]()
    _say_new(proposal, said)
    print(INTRODUCTION)
    answered, proposal = _with_columns_that_can_be_read(arguments, proposal)
    if dp := _drops(proposal.unknown_dp):
        proposal = look(answered, Declared(dp=dp))
    _say_new(proposal, said)
    declared = replace(_bench(proposal), dp=dp)
    if declared != Declared(dp=dp):
        proposal = look(answered, declared)
    if arguments.output is not None:
        check_output(arguments)  # once more: the answers took their time
        write_file(Path(arguments.output), proposal.text)
    return proposal


def _with_columns_that_can_be_read(
    arguments: InitArguments, proposal: "Proposal"
) -> tuple[InitArguments, "Proposal"]:
    """Ask for columns and pressures, again where the recordings can't be read so; return what is declared then."""
    while True:
        answered = _with_columns(arguments, proposal)
        if not arguments.dp:
            answered = _with_pressures(answered, look_at_first(answered, proposal), proposal)
        try:
            return answered, proposal if answered == arguments else look(answered)
        except InputError as error:
            print(one_line(str(error)))


def _say_new(proposal: "Proposal", said: list[str]) -> None:
    """Print what was seen and is not said yet."""
    new = [line for line in proposal.seen if line not in said]
    print("".join(f"{one_line(line)}\n" for line in new), end="")
    said += new


def look_at_first(arguments: InitArguments, proposal: "Proposal") -> "ProposedColumns":
    """Return how the columns of the first recording may be read, as far as they are declared."""
    from dzdesign.identify.reading.column_labels import parse_columns
    from dzdesign.identify.reading.proposed_columns import propose_columns

    return propose_columns(
        proposal.recordings[0],
        parse_columns(arguments.columns) if arguments.columns else {},
        read_options(arguments, ["skip_rows"])["skip_rows"],
        time_is_declared=bool(arguments.sample_rate),
    )


def _declare(arguments: InitArguments, columns: Mapping[str, str]) -> InitArguments:
    """Return arguments that declare more columns."""
    from dzdesign.identify.reading.column_labels import parse_columns

    declared = parse_columns(arguments.columns) if arguments.columns else {}
    return replace(arguments, columns={**declared, **columns})


def _with_columns(arguments: InitArguments, proposal: "Proposal") -> InitArguments:
    """Ask for the columns of time, command and flow that could not be told, and for the units that are missing."""
    wanted = {name: why for name, why in proposal.unclear.items() if name != "dP"}
    if wanted:
        print(f"Columns of '{proposal.recordings[0].name}': {one_line(', '.join(proposal.look.labels))}")
    for quantity, why in wanted.items():
        column = proposal.look.known.get(quantity)
        prefix = f"{column.label}:" if column and not column.unit and quantity != "u" else ""
        print(one_line(f"Column of {quantity}: {why}"))
        if prefix:
            question = f"  unit of '{prefix[:-1]}'"
        else:
            rate = ", or the sample rate such as 100 Hz" if quantity == "time" else ""
            question = f"  label of {COLUMN_IS.get(quantity, quantity)}, with :unit if it has none{rate}"
        check = _column_check(arguments, proposal, quantity, prefix)
        answer = ask(question, proposal.look.command_range if quantity == "u" else "", check)
        if answer and quantity == "time" and _is_rate(answer):
            arguments = replace(arguments, sample_rate=answer)
        elif answer:
            arguments = _declare(arguments, {quantity: f"{prefix}{answer}"})
    return arguments


def _is_rate(text: str) -> bool:
    try:
        return parse_quantity(text, "frequency", "the sample rate") > 0
    except InputError:
        return False


def _column_check(
    arguments: InitArguments, proposal: "Proposal", quantity: str, prefix: str
) -> Callable[[str], None]:
    """Return what refuses a column that the first recording does not have, or that can't be read so."""

    def check(answer: str) -> None:
        if quantity == "time" and _is_rate(answer):
            return
        found = look_at_first(_declare(arguments, {quantity: f"{prefix}{answer}"}), proposal)
        if quantity in found.unclear:
            raise InputError(found.unclear[quantity])

    return check


def _with_pressures(
    arguments: InitArguments, first: "ProposedColumns", proposal: "Proposal"
) -> InitArguments:
    """Ask which pressure is which; until the answers make a pressure drop, or are given twice."""
    names, before = distinct_names(list(proposal.recordings)), dict[str, str]()
    while first.pressures:
        columns = _which_pressures(first, proposal.guessed_dp)
        if proposal.guessed_dp and not columns:
            return replace(arguments, dp=_drops({name: () for name in names}, required=True))
        found = look_at_first(_declare(arguments, columns), proposal) if columns else first
        if not columns or columns == before or "dP" not in found.unclear:
            arguments = _declare(arguments, columns) if columns else arguments
            break
        print(one_line(found.unclear["dP"]))
        before = columns
    return arguments


def _which_pressures(first: "ProposedColumns", guessed: str) -> dict[str, str]:
    """Ask of each column of pressure what it is, and for its unit if it has none; return quantity -> column."""
    columns: dict[str, str] = {}
    known = {column.label: name for name, column in first.known.items() if name in PRESSURE_IS}

    def check(answer: str) -> None:
        quantity = _pressure_named(answer)
        if quantity in columns:
            raise InputError(f"{quantity} is '{columns[quantity]}' already; give another")

    for label, unit in first.pressures.items():
        default = known.get(label) or ("dP" if label == guessed else "")
        if default in columns:
            default = NOT_USED
        answer = ask(f"Which pressure is '{label}'? {WHICH_PRESSURE}", default, check)
        quantity = _pressure_named(answer) if answer else NOT_USED
        if quantity == NOT_USED:
            continue
        if not unit:
            stated = ask(f"  unit of '{label}', such as bar", check=_check_unit)
            if not stated:
                continue
        columns[quantity] = label if unit else f"{label}:{stated}"
    return columns


def _check_unit(text: str) -> None:
    parse_quantity(f"1 {text}", "pressure", "one of it")


def _check_pressure(text: str) -> None:
    parse_quantity(text, "pressure", "the pressure drop")


def _pressure_named(answer: str) -> str:
    """Return the quantity of an answer in letters of any case."""
    found = {name.lower(): name for name in (*PRESSURE_IS, NOT_USED)}.get(answer.lower())
    if found is None:
        raise InputError(f"'{answer}' is none of {', '.join((*PRESSURE_IS, NOT_USED))}")
    return found


def _drops(readings: Mapping[str, tuple[str, ...]], *, required: bool = False) -> dict[str, str]:
    """Ask for the pressure drop of recordings; return those that were given."""
    found: dict[str, str] = {}
    for name, texts in readings.items():
        hint = f" (its name may say {' or '.join(texts)})" if texts else ", such as 10 bar"
        answer = ""
        while not answer:
            answer = ask(f"Pressure drop of '{name}'{hint}", check=_check_pressure)
            if not required:
                break
        if answer:
            found[name] = answer
    return found


def _bench(proposal: "Proposal") -> Declared:
    """Ask for what no recording holds: full command, the meter's floor and lag."""
    seen, meter = proposal.u_seen_V, proposal.valve and proposal.valve.meter

    def check_full(text: str) -> None:
        full = parse_quantity(text, "voltage", "full command")
        if not full > 0 or (seen is not None and OVER_FULL * full < seen):
            raise InputError(f"full command is '{text}', expected more than {f'{seen:.3g}' if seen else '0'} V")

    u_max = meter_lag = ""
    if proposal.u_max_is_guess:
        where = f"the ramps end at {seen:.2f} V" if seen is not None else "what 100 % means"
        u_max = ask(f"Full command ({where})", f"{proposal.u_max_V:g} V", check_full)
    found = f"identify finds {meter.floor_L_min:.2f} L/min" if meter and meter.floor_L_min else "such as 0.6 L/min"
    floor = ask(
        f"Meter's floor by its data sheet, the flow below which it reads zero ({found})",
        check=lambda text: parse_quantity(text, "flow", "the meter's floor"),
    )
    if not (meter and meter.lag_is == "identified"):
        meter_lag = ask(
            "Meter's lag by its data sheet (such as 0.1 s, or 0.1 s +- 0.02 s)",
            check=lambda text: with_tolerance("time")(text, "the meter's lag"),
        )
    return Declared(u_max=u_max, meter_floor=floor, meter_lag=meter_lag)
