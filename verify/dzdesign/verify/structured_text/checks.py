"""Checks of an output in Structured Text: the text itself is read, and every input tried."""

from collections.abc import Callable
from pathlib import Path

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.design.compensator import Compensator
from dzdesign.design.output_manifest import OutputManifest
from dzdesign.verify.output_evidence import OutputChecks, TriedInputs
from dzdesign.verify.requirements import (
    EXACT_LAW,
    FALLBACK,
    OVERFLOW,
    SAME_TEXT,
    STATES,
    SUBSET,
    TWO_READINGS,
    ZERO_COMMAND,
    Check,
)
from dzdesign.verify.structured_text.every_pair import ExactTables, Tried, TriedBlock
from dzdesign.verify.structured_text.imported_files import plcopen_faults, read_xml, tcpou_faults
from dzdesign.verify.structured_text.parser import parse
from dzdesign.verify.structured_text.syntax import FunctionBlock, Kind
from dzdesign.verify.structured_text.type_check import check_types
from dzdesign.verify.structured_text.zero_output import zero_output_margin
from dzdesign.verify.toolchain.host_compiler import host_compiler, name_of

NAME = "FB_DeadZone"
INTERFACES, DIALECTS = ("plc", "codes"), ("codesys", "twincat")
#: Inputs and outputs that a block must have, in order; the last two of two solenoids, of one the first and the last.
INPUTS, OUTPUTS = ("command", "pressure_a", "pressure_b"), ("output_a", "output_b", "status")


def checks(
    folder: Path, manifest: OutputManifest, compensator: Compensator, say: Callable[[str], None]
) -> OutputChecks:
    """Check the folder of an output in Structured Text; settings that nobody knows are an `InputError`."""
    interface, dialect = (_setting(manifest, key, known) for key, known in
                          (("interface", INTERFACES), ("dialect", DIALECTS)))  # fmt: skip
    compiler = host_compiler()
    text = _text(folder / f"{NAME}.st")
    try:
        block = parse(text, f"{NAME}.st")
        kinds = check_types(block, f"{NAME}.st")
        _check_ends(block, compensator)
    except InputError as error:
        return OutputChecks(checks=(SUBSET.check(holds=False, text=str(error)),))
    lines = len(text.splitlines())
    found = [SUBSET.check(holds=True, text=f"{lines} lines, {len(kinds)} expressions of DINT, UDINT and BOOL")]
    found.append(_same_text(folder, text, block, dialect))
    say("comparing every input of the function block with the exact law")
    try:
        more, inputs = _tried(block, kinds, compensator, interface)
    except RequirementError as error:
        return OutputChecks(checks=(*found, EXACT_LAW.check(holds=False, text=str(error))))
    return OutputChecks(checks=(*found, *more), inputs=inputs, versions={"compiler": name_of(compiler)})


def _setting(manifest: OutputManifest, key: str, known: tuple[str, ...]) -> str:
    value = manifest.settings.get(key, "")
    if value not in known:
        raise InputError(
            f"the manifest's settings.{key} is '{value[:40]}', expected {' or '.join(known)}; make the output again "
            "with `dzdesign codegen`"
        )
    return value


def _text(path: Path) -> str:
    try:
        return read_bytes(path, "Structured Text").decode("ascii")
    except UnicodeDecodeError as error:
        raise InputError(f"'{path}' is not ASCII text; make it again with `dzdesign codegen`") from error


def _check_ends(block: FunctionBlock, compensator: Compensator) -> None:
    """Refuse a block with other inputs, outputs or states than are asked for: nothing of it could be compared."""
    if block.name != NAME:
        raise InputError(f"{NAME}.st has the function block {block.name}, expected {NAME}")
    both = len(compensator.signals.signs) == 2
    states = [*(["side"] if both else []), *(["at_rest"] if compensator.zero_band_codes else [])]
    outputs = [name for name in OUTPUTS if both or name != "output_b"]
    for section, expected in (("VAR_INPUT", list(INPUTS)), ("VAR_OUTPUT", outputs), ("VAR", states)):
        names = [variable.name for variable in block.of_section(section)]
        if names != expected:
            raise InputError(f"{section} of {NAME}.st has {', '.join(names)}, expected {', '.join(expected)}")
        for variable in block.of_section(section):
            if variable.kind != ("BOOL" if variable.name == "at_rest" else "DINT"):
                raise InputError(f"{NAME}.st, {variable.place}: {variable.name} is a {variable.kind}")
    for variable in block.of_section("VAR"):
        if variable.initial != (0 if variable.name == "side" else 1,):
            raise InputError(f"{NAME}.st, {variable.place}: {variable.name} does not start at rest")


def _same_text(folder: Path, text: str, block: FunctionBlock, dialect: str) -> Check:
    """Tell whether each file that a tool imports holds the text that is verified."""
    readers = {f"{NAME}.xml": plcopen_faults} | ({f"{NAME}.TcPOU": tcpou_faults} if dialect == "twincat" else {})
    faults: list[str] = []
    for name, reader in readers.items():
        try:
            faults += [f"{name}: {fault}" for fault in reader(read_xml(folder / name), block, text)]
        except InputError as error:
            faults.append(str(error))
    words = f"{' and '.join(readers)} read back: the text of {NAME}.st, and {len(block.variables)} typed variables"
    return SAME_TEXT.check(holds=not faults, text=and_more(faults, 2) if faults else words)


def _tried(
    block: FunctionBlock, kinds: dict[int, Kind], compensator: Compensator, interface: str
) -> tuple[list[Check], tuple[TriedInputs, ...]]:
    """Return what trying every input found."""
    tried = TriedBlock(block, kinds, ExactTables(compensator, interface))
    difference = tried.sample_differs()
    pairs, pressures, extremes = tried.every_pair(), tried.every_pressure(), tried.extremes()
    sets = (*pairs, pressures, extremes)
    units = "codes" if interface == "codes" else "0.01 % and 0.1 bar"
    names = [f"commands and pressure drops in {units}, {exact.side} commands" for exact in tried.exact]
    names += [f"pressures at zero command in {units}", "ends of the types and of what is valid"]
    found = [
        TWO_READINGS.check(
            holds=not difference,
            text=f"the text as C and as NumPy reads it: {difference or 'the same on a sample of inputs and states'}",
        ),
        _exact_law(pairs, interface),
        _overflow(sets),
        FALLBACK.check(
            holds=pressures.wrong + extremes.wrong == 0,
            text=f"{pressures.pairs} pairs of pressures at zero command and {extremes.pairs} extreme inputs, "
            f"{pressures.wrong + extremes.wrong} wrong{_first((pressures, extremes))}",
        ),
        STATES.check(
            holds=not any(each.wrong_status + each.wrong_state for each in sets),
            text=f"{sum(each.calls for each in sets)} calls from every state near zero command, "
            f"{sum(each.wrong_status for each in sets)} wrong status words, "
            f"{sum(each.wrong_state for each in sets)} wrong states",
        ),
        *(_zero_command(tried, place) for place in range(len(tried.exact))),
    ]
    inputs = tuple(
        TriedInputs(name=name, inputs=each.pairs, wrong=each.wrong, outputs_hash=each.outputs_hash)
        for name, each in zip(names, sets, strict=True)
    )
    return found, inputs


def _first(sets: tuple[Tried, ...] | list[Tried]) -> str:
    return next((f" ({each.first_wrong})" for each in sets if each.wrong), "")


def _exact_law(pairs: list[Tried], interface: str) -> Check:
    wrong, count = sum(each.wrong for each in pairs), sum(each.pairs for each in pairs)
    units = "converter codes" if interface == "codes" else "0.01 % and 0.1 bar, rounded down"
    hashes = ", ".join(each.outputs_hash for each in pairs)
    text = f"{count} pairs of command and pressure drop in {units}, {wrong} wrong{_first(pairs)}; hash of all {hashes}"
    return EXACT_LAW.check(holds=wrong == 0, text=text)


def _overflow(sets: tuple[Tried, ...]) -> Check:
    faults = sum(each.faults for each in sets)
    place = next((f", the first in {NAME}.st, {each.first_fault}" for each in sets if each.faults), "")
    text = f"{faults} results out of range of their type, divisions by zero and indices outside of arrays{place}"
    return OVERFLOW.check(holds=faults == 0, text=text)


def _zero_command(tried: TriedBlock, place: int) -> Check:
    exact = tried.exact[place]
    margin = zero_output_margin(tried, exact)
    name = f"{exact.side} commands: {ZERO_COMMAND.title}" if len(tried.exact) > 1 else ""
    if margin is None:
        text = "no pair of valid pressures makes a tested pressure drop, so no bound is known"
        return ZERO_COMMAND.check(holds=False, text=text, name=name)
    left = exact.compensator.valve.recorded_units.text(1e3 * float(margin.margin_V), ".3f mV")
    text = f"{margin.exceeded} pressure drops above the threshold's lower bound, smallest margin {left}"
    return ZERO_COMMAND.check(holds=margin.exceeded == 0, text=text, name=name)
