"""Checks of a folder with Structured Text or for MATLAB: the law of its text at every input.

`text_values` evaluates a function block's own assignments, and GNU Octave runs a function for MATLAB; `every_pair`
tries either at every input, and `exact_block` says what it must give.
"""

import os
import re
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import reduce
from itertools import count
from math import lcm
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.placing import scratch_folder
from dzdesign.core.processes import find_program, run_program
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.verify.evidence import OutputChecks, TriedInputs
from dzdesign.verify.exhaustive.all_inputs import core_checks
from dzdesign.verify.exhaustive.test_vectors import differences
from dzdesign.verify.exhaustive.zero_command import (
    PressureDrops,
    ZeroCommandMargin,
    guarded_bounds,
    margins_of_drives,
    pressure_drops,
)
from dzdesign.verify.outputs.every_cycle import check_cycles
from dzdesign.verify.outputs.every_pair import EveryPair, Program, Tried
from dzdesign.verify.outputs.exact_block import ExactBlock, PER_MPa, cycles_of
from dzdesign.verify.outputs.text_values import Overflow, TextValues
from dzdesign.verify.requirements import EXACT_LAW, FALLBACK, OVERFLOW, STATES, ZERO_COMMAND, Check
from dzdesign.verify.toolchain.machines import run_child

Say = Callable[[str], None]
BLOCK, FUNCTIONS = "FB_DeadZone", {1: "dz_comp", -1: "dz_comp_negative"}
INTERFACES = ("plc", "codes")
#: Files that hold the block for a tool, and their elements with its text; PLCopen's has its values once more.
IMPORTED, TEXT_OF_BLOCK = (".xml", ".TcPOU"), ("}xhtml", "Declaration", "ST")
NAMESPACE = "{http://www.plcopen.org/xml/tc6_0200}"
#: Of Octave: the program that it runs, and itself, the one without a window first.
PROGRAM = Path(__file__).parent / "programs" / "answers_of.m"
NAMES = ("octave-cli", "octave")
#: No file of the user's or the site's is run, and nothing of the run is kept.
FLAGS = ("--norc", "--no-init-file", "--no-site-file", "--no-history", "--no-window-system", "--quiet")
MISSING = "GNU Octave not found; install it (Debian: apt install octave) to have the function run"
#: A block of inputs that takes longer hangs, s; so many characters of what Octave says are told; and so many inputs are
#: given to it at once, as it starts anew for each.
TIMEOUT_S, LONGEST, STARTED_ANEW = 120.0, 300, 1 << 20
OUTPUTS = ("output_a", "status", "beta")


def block_checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check a folder with Structured Text."""
    interface, name = manifest.settings.get("interface", ""), f"{BLOCK}.st"
    if interface not in INTERFACES:
        raise InputError(
            f"the manifest's settings.interface is '{interface[:40]}', expected {' or '.join(INTERFACES)}; make the "
            "output again with `dzdesign codegen`"
        )
    say("comparing every input of the function block with the exact law")
    cycles = cycles_of(compensator, manifest.settings.get("cycle_time", ""))
    every = EveryPair(compensator, interface, compensator.signals.signs, remembers=True, cycles=cycles)
    content = read_bytes(folder / name, "text of the law").decode("ascii", "replace")
    try:
        text = TextValues(content, name)
        first = {each: str(value).upper() for each, value in every.first().items()}
        if text.first != first:
            raise RequirementError(f"{name} begins with {text.first}, expected {first}")
        _check_imported(folder, content, text)
        found = every_input_of(text.run, every, name)
        counted = [_named(check_cycles(text.run, every), name)] if cycles else []
    except Overflow as error:
        return OutputChecks(checks=(_named(OVERFLOW.check(holds=False, text=str(error)), name),))
    except RequirementError as error:
        return OutputChecks(checks=(_named(EXACT_LAW.check(holds=False, text=str(error)), name),))
    fits = f"{len(text.lines)} assignments evaluated as they are written, 0 results beyond their DINT"
    overflow = _named(OVERFLOW.check(holds=True, text=fits), name)
    zero = [_zero_command(text.run, every, place, name) for place in range(len(every.laws))]
    return replace(found, checks=(*found.checks, *counted, overflow, *zero))


def _check_imported(folder: Path, content: str, text: TextValues) -> None:
    """Refuse a file that a PLC's tool imports if it holds another block than the text that is evaluated."""
    for path in sorted(each for each in folder.iterdir() if each.suffix in IMPORTED):
        try:
            top = ElementTree.fromstring(read_bytes(path, "function block as a tool imports it"))
        except ElementTree.ParseError as error:
            raise RequirementError(f"{path.name} is no XML: {error}") from error
        told = {"".join(each.itertext()).strip() for each in top.iter() if each.tag.endswith(TEXT_OF_BLOCK)}
        cut = content.rindex("END_VAR\n") + len("END_VAR\n")
        if told != {content[:cut].strip(), content[cut:].rpartition("END_FUNCTION_BLOCK")[0].strip()}:
            raise RequirementError(f"{path.name} holds another text than {text.name}")
        typed: dict[str, list[str]] = {}
        for each in top.iter(f"{NAMESPACE}variable"):
            values = [value.get("value", "") for value in each.iter(f"{NAMESPACE}simpleValue")]
            typed |= {each.get("name", ""): values} if values else {}
        values_of = {name: [str(value) for value in np.ravel(each)] for name, each in text.known.items()}
        if typed and typed != values_of | {name: [value] for name, value in text.first.items()}:
            raise RequirementError(f"{path.name} holds other values than {text.name}")


def function_checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check a folder for MATLAB: each function run in Octave, and the C code beside it."""
    del manifest  # it has no settings
    octave, parts = available_octave(), []
    for sign in compensator.signals.signs:
        name = f"{FUNCTIONS[sign]}.m"
        say(f"comparing every input of {name}, in Octave, with the exact law")
        parts += [function_in_octave(folder, sign, compensator, octave), core_checks(folder, compensator, sign)]
    return OutputChecks(
        checks=tuple(check for part in parts for check in part.checks),
        inputs=tuple(each for part in parts for each in part.inputs),
        versions={"octave": octave.version} if octave.path else {},
    )


def function_in_octave(folder: Path, sign: int, compensator: Compensator, octave: "Octave") -> OutputChecks:
    """Run the function of one side in Octave, and compare it with the exact law."""
    name = f"{FUNCTIONS[sign]}.m in Octave"
    if not octave.path:
        return OutputChecks(checks=(_named(EXACT_LAW.check(holds=None, text=octave.missing), name),))
    every = EveryPair(compensator, "codes", (sign,), remembers=False, at_once=STARTED_ANEW)
    text = read_bytes(folder / f"{FUNCTIONS[sign]}.m", "text of the law")
    try:
        with running(octave.path, FUNCTIONS[sign], text) as function:
            found = every_input_of(function, every, name)
            return replace(found, checks=(*found.checks, _zero_command(function, every, 0, name)))
    except RequirementError as error:
        return OutputChecks(checks=(_named(EXACT_LAW.check(holds=False, text=str(error)), name),))


def _named(check: Check, what: str) -> Check:
    return replace(check, name=f"{what}: {check.name}")


def every_input_of(program: Program, every: EveryPair, what: str) -> OutputChecks:
    """Return what trying every input of a program found."""
    pairs = [every.every_command(program, place) for place in range(len(every.laws))]
    pressures, extremes = every.every_pressure(program), every.extremes(program)
    of_pairs, others = reduce(Tried.and_then, pairs), reduce(Tried.and_then, [*pressures, extremes])
    all_of = of_pairs.and_then(others)
    first = f" ({all_of.first_wrong})" if all_of.first_wrong else ""
    hashes = ", ".join(each.outputs_hash for each in pairs)
    checks = (
        EXACT_LAW.check(
            holds=of_pairs.wrong == 0,
            text=f"{of_pairs.pairs} pairs of command and pressure drop, {of_pairs.wrong} wrong{first}; "
            f"hash of all {hashes}",
        ),
        FALLBACK.check(
            holds=others.wrong == 0,
            text=f"{pressures[0].pairs} pairs of pressures at zero command, "
            f"{others.pairs - pressures[0].pairs - extremes.pairs} at other commands and {extremes.pairs} extreme "
            f"inputs, {others.wrong} wrong{first}",
        ),
        STATES.check(
            holds=all_of.wrong_status + all_of.wrong_state == 0,
            text=f"{all_of.calls} calls, {all_of.wrong_status} wrong status words, {all_of.wrong_state} wrong states",
        ),
    )
    units = "in codes" if every.of_codes else "in 0.01 % and 0.1 bar"
    named = {f"commands and pressure drops {units}, {law.exact.side} commands": each
             for law, each in zip(every.laws, pairs, strict=True)}  # fmt: skip
    named[f"pressures {units} at zero command"] = pressures[0]
    return OutputChecks(
        checks=tuple(_named(check, what) for check in checks),
        inputs=tuple(
            TriedInputs(name=f"{what}: {name}", inputs=each.pairs, wrong=each.wrong, outputs_hash=each.outputs_hash)
            for name, each in named.items()
        ),
    )


def _zero_command(program: Program, every: EveryPair, place: int, what: str) -> Check:
    exact, margin = every.laws[place].exact, zero_margin(program, every, place)
    title = f"{exact.side} commands: {ZERO_COMMAND.title}" if len(every.laws) > 1 else ZERO_COMMAND.title
    name = f"{what}: {title}"
    if margin is None:
        text = "no pair of valid pressures makes a tested pressure drop, so no bound is known"
        return ZERO_COMMAND.check(holds=False, text=text, name=name)
    left = exact.compensator.valve.recorded_units.text(1e3 * float(margin.margin_V), ".3f mV")
    text = f"{margin.exceeded} pressure drops above the threshold's lower bound, smallest margin {left}"
    return ZERO_COMMAND.check(holds=margin.exceeded == 0, text=text, name=name)


def zero_margin(program: Program, every: EveryPair, place: int) -> ZeroCommandMargin | None:
    """Return what the output of one side at zero command leaves to the bounds, at every pressure drop.

    In units of a PLC a pressure drop stands for all within one unit, and the sensors' own errors come on top.
    """
    exact = every.laws[place].exact
    bounds = guarded_bounds(exact.compensator, exact.sign)
    tested = {Fraction(repr(dp)) for dp in bounds.dp_MPa}
    if exact.of_codes:
        found = differences(exact)
        drops, b = pressure_drops(exact, found, tested), np.minimum(found.b_first, exact.code_max)
        a = found.values + found.slant[b]
    else:
        ahead, behind = exact.sensors
        values = np.arange(ahead.low - behind.high, ahead.high - behind.low + 1)
        b = np.maximum(behind.low, ahead.low - values)
        a = values + b
        drops = _drops(exact, values, tested)
    outputs = every.at_zero(program, place, a, b)
    (margin,) = margins_of_drives(drops, outputs, exact.compensator.u_max_V / exact.compare_max, [bounds])
    return margin


def _drops(exact: ExactBlock, values: np.ndarray, tested: set[Fraction]) -> PressureDrops:
    """Return the least and the largest pressure drop that each number of a PLC may stand for."""
    (a_least, a_most), (b_least, b_most) = exact.ahead.error_MPa, exact.behind.error_MPa
    ends = (a_least - b_most, a_most - b_least)
    scale = lcm(PER_MPa, *(value.denominator for value in (*ends, *tested)))
    least = (values - 1).astype(object) * (scale // PER_MPa) + int(ends[0] * scale)
    most = (values + 1).astype(object) * (scale // PER_MPa) + int(ends[1] * scale)
    kind = np.int64 if max(abs(int(each)) for each in (least[0], most[-1])) < 2**61 else object
    return PressureDrops(scale=scale, least=least.astype(kind), most=most.astype(kind),
                         made=np.ones(values.size, dtype=bool))  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Octave:
    """Octave on this machine, and its version; or why it can't be run."""

    path: str = ""
    version: str = ""
    missing: str = ""


def available_octave() -> Octave:
    """Return Octave where it runs."""
    path = next((found for name in NAMES if (found := find_program(name))), None)
    if path is None:
        return Octave(missing=MISSING)
    try:
        done = run_program([path, "--version"], timeout=60.0)
    except (OSError, subprocess.TimeoutExpired) as error:
        return Octave(missing=f"'{path}' does not run: {error}")
    version = re.search(r"GNU Octave, version (\S+)", done.stdout)
    if version is None:
        return Octave(missing=f"'{path} --version' does not say that it is GNU Octave; install it anew")
    return Octave(path=path, version=f"GNU Octave {version[1]}")


@contextmanager
def running(path: str, name: str, text: bytes) -> Iterator[Program]:
    """Give a function with this text, run by Octave in a folder of its own and with nothing of the user's.

    It takes the codes of `every_pair`, which broadcast against each other. One that fails or hangs is a
    `RequirementError`.
    """
    with scratch_folder() as place:
        (place / f"{name}.m").write_bytes(text)
        (place / PROGRAM.name).write_bytes(PROGRAM.read_bytes())
        # It does little linear algebra, and a thread of a library for each core would only wait.
        own = {"HOME": str(place), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        kept = {each: value for each, value in os.environ.items() if each == "OCTAVE_HOME" or each[:6] != "OCTAVE"}
        numbers = count()

        def run(given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
            codes, job = np.broadcast_arrays(*given.values()), next(numbers)
            asked, answers = place / f"{job}.in", place / f"{job}.out"
            asked.write_bytes(b"".join(np.ascontiguousarray(each, dtype="<u2").tobytes() for each in codes))
            command = [path, *FLAGS, PROGRAM.name, name, asked.name, answers.name]
            ended = run_child(command, f"{name}.m in Octave", TIMEOUT_S, place=place, environment={**kept, **own})
            octets = answers.read_bytes() if answers.exists() else b""
            if ended.reason or len(octets) != 2 * len(OUTPUTS) * codes[0].size:
                said = " ".join(ended.complaint.split())[:LONGEST]
                raise RequirementError(f"{name}.m gave no answer in Octave: {said or 'it ended before'}")
            rows = np.frombuffer(octets, dtype="<u2").reshape(len(OUTPUTS), *codes[0].shape)
            return {each: row.astype(np.int64) for each, row in zip(OUTPUTS, rows, strict=True)}

        yield run
