"""Checks of a folder with Structured Text or for MATLAB: the law of its text at every input, evaluated and run.

`text_values` evaluates the text's own assignments, GNU Octave runs a function for MATLAB, block after block of inputs;
`every_pair` tries either at every input, and `exact_block` says what it must give.
"""

import os
import re
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial, reduce
from itertools import count
from math import lcm
from pathlib import Path

import numpy as np

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.processes.programs import find_program
from dzdesign.core.processes.running import run_program
from dzdesign.core.scratch import scratch_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.verify.evidence import OutputChecks, TriedInputs
from dzdesign.verify.exhaustive.all_inputs import input_check, input_checks
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs, differences
from dzdesign.verify.exhaustive.zero_command import (
    PressureDrops,
    ZeroCommandMargin,
    guarded_bounds,
    margins_of_drives,
    pressure_drops,
)
from dzdesign.verify.outputs.every_pair import STARTED_ANEW, EveryPair, Program, Tried
from dzdesign.verify.outputs.exact_block import PER_MPa
from dzdesign.verify.outputs.text_values import Overflow, TextValues
from dzdesign.verify.requirements import EXACT_LAW, FALLBACK, OVERFLOW, STATES, ZERO_COMMAND, Check
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from dzdesign.verify.toolchain.machines import run_child

Say = Callable[[str], None]
BLOCK, FUNCTIONS = "FB_DeadZone", {1: "dz_comp", -1: "dz_comp_negative"}
INTERFACES = ("plc", "codes")
#: What a function block remembers of a new instance.
FIRST = {"side": "0", "at_rest": "TRUE"}
#: Of Octave: the program that it runs, and itself, the one without a window first.
PROGRAM = Path(__file__).parent / "programs" / "answers_of.m"
NAMES = ("octave-cli", "octave")
#: No file of the user's or the site's is run, and nothing of the run is kept.
FLAGS = ("--norc", "--no-init-file", "--no-site-file", "--no-history", "--no-window-system", "--quiet")
MISSING = "GNU Octave not found; install it (Debian: apt install octave) to have the function itself run"
#: A block of inputs that takes longer hangs, s; and so many characters of what Octave says are told.
TIMEOUT_S, LONGEST = 120.0, 300
OUTPUTS = ("compare", "status", "beta")


def block_checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check a folder with Structured Text."""
    interface = manifest.settings.get("interface", "")
    if interface not in INTERFACES:
        raise InputError(
            f"the manifest's settings.interface is '{interface[:40]}', expected {' or '.join(INTERFACES)}; make the "
            "output again with `dzdesign codegen`"
        )
    say("comparing every input of the function block with the exact law")
    name = f"{BLOCK}.st"
    every = EveryPair(compensator, interface, compensator.signals.signs, remembers=True)
    return _TriedText(folder, name, "st", every).checks()


def function_checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check a folder for MATLAB: each function evaluated and run in Octave, and the C code beside it."""
    del manifest  # it has no settings
    octave = available_octave()
    found = OutputChecks(checks=(), versions=octave.versions)
    for sign in compensator.signals.signs:
        name = f"{FUNCTIONS[sign]}.m"
        say(f"comparing every input of {name} with the exact law")
        every = EveryPair(compensator, "codes", (sign,), remembers=False)
        text = _TriedText(folder, name, "m", every)
        parts = [text.checks()]
        if octave.path:
            say(f"trying every input of {name} in Octave")
            parts.append(text.in_octave(octave.path))
        else:
            parts.append(
                OutputChecks(checks=(EXACT_LAW.check(holds=None, text=octave.missing, name=f"{name} in Octave"),))
            )
        say(f"trying every input of the C code beside {name}")
        parts.append(_of_core(folder, compensator, sign))
        for part in parts:
            found = replace(found, checks=(*found.checks, *part.checks), inputs=(*found.inputs, *part.inputs))
    return found


def _of_function(run: Program) -> Program:
    """Return a function for MATLAB with the names of a block's inputs and output."""

    def renamed(given: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        found = run({"u": given["command"], "p_a": given["pressure_a"], "p_b": given["pressure_b"]})
        return {"output_a": found["compare"], "status": found["status"], "beta": found["beta"]}

    return renamed


def _of_core(folder: Path, compensator: Compensator, sign: int) -> OutputChecks:
    """Try every input of the C code."""
    core, prepared = CompiledCore(folder, sign), PreparedInputs(ExactLaw(compensator, sign))
    found = input_check(prepared, core.sha256, core.check(prepared.everything()))
    checks = input_checks(found, compensator.valve.recorded_units, both_signs=False)
    tried = TriedInputs(name=f"core/{core.name}: codes, {found.side} commands", inputs=found.inputs, wrong=found.wrong,
                        outputs_hash=found.outputs_hash)  # fmt: skip
    return OutputChecks(checks=tuple(replace(each, name=f"core/{core.name}: {each.name}") for each in checks),
                        inputs=(tried,))  # fmt: skip


@dataclass(frozen=True)
class _TriedText:
    """One text, and the inputs that it is tried at."""

    folder: Path
    name: str
    language: str
    every: EveryPair

    def checks(self) -> OutputChecks:
        """Evaluate the text, and compare it with the exact law."""
        content = read_bytes(self.folder / self.name, "text of the law").decode("ascii", "replace")
        of_text: Program
        try:
            text = TextValues(content, self.language, self.name)
            if text.first != {name: value for name, value in FIRST.items() if name in text.first}:
                raise RequirementError(f"{self.name} does not begin at rest: {text.first}")
            of_text = text.run if self.language == "st" else _of_function(text.run)
            found = self._compared(of_text, self.name)
        except Overflow as error:
            return OutputChecks(checks=(self._named(OVERFLOW.check(holds=False, text=str(error))),))
        except RequirementError as error:
            return OutputChecks(checks=(self._named(EXACT_LAW.check(holds=False, text=str(error))),))
        kind = "DINT" if self.language == "st" else "int64"
        fits = f"{len(text.lines)} assignments evaluated as they are written, 0 results beyond their {kind}"
        return OutputChecks(
            checks=(
                *found[0],
                self._named(OVERFLOW.check(holds=True, text=fits)),
                *(self._zero_command(of_text, place) for place in range(len(self.every.laws))),
            ),
            inputs=tuple(found[1]),
        )

    def in_octave(self, path: str) -> OutputChecks:
        """Run the function in Octave on the same inputs."""
        text, name = read_bytes(self.folder / self.name, "text of the law"), self.name.removesuffix(".m")
        try:
            self.every.at_once = STARTED_ANEW
            with running(path, name, text) as function:
                checks, inputs = self._compared(_of_function(function), f"{self.name} in Octave")
        except RequirementError as error:
            check = EXACT_LAW.check(holds=False, text=str(error), name=f"{self.name} in Octave: {EXACT_LAW.title}")
            return OutputChecks(checks=(check,))
        return OutputChecks(checks=tuple(checks), inputs=tuple(inputs))

    def _named(self, check: Check, what: str = "") -> Check:
        return replace(check, name=f"{what or self.name}: {check.name}")

    def _compared(self, program: Program, what: str) -> tuple[list[Check], list[TriedInputs]]:
        """Return what trying every input of a program found."""
        pairs = [self.every.every_command(program, place) for place in range(len(self.every.laws))]
        pressures, extremes = self.every.every_pressure(program), self.every.extremes(program)
        of_pairs, others = reduce(Tried.and_then, pairs), reduce(Tried.and_then, [*pressures, extremes])
        all_of = of_pairs.and_then(others)
        first = f" ({all_of.first_wrong})" if all_of.first_wrong else ""
        hashes = ", ".join(each.outputs_hash for each in pairs)
        found = [
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
                text=f"{all_of.calls} calls, {all_of.wrong_status} wrong status words, {all_of.wrong_state} wrong "
                "states",
            ),
        ]
        units = "in codes" if self.every.of_codes else "in 0.01 % and 0.1 bar"
        names = [f"{what}: commands and pressure drops {units}, {law.exact.side} commands" for law in self.every.laws]
        inputs = [TriedInputs(name=name, inputs=each.pairs, wrong=each.wrong, outputs_hash=each.outputs_hash)
                  for name, each in zip(names, pairs, strict=True)]  # fmt: skip
        inputs.append(TriedInputs(name=f"{what}: pressures {units} at zero command", inputs=pressures[0].pairs,
                                  wrong=pressures[0].wrong, outputs_hash=pressures[0].outputs_hash))  # fmt: skip
        return list(map(partial(self._named, what=what), found)), inputs

    def _zero_command(self, program: Program, place: int) -> Check:
        exact = self.every.laws[place].exact
        margin = self.zero_margin(program, place)
        title = f"{exact.side} commands: {ZERO_COMMAND.title}" if len(self.every.laws) > 1 else ZERO_COMMAND.title
        name = f"{self.name}: {title}"
        if margin is None:
            text = "no pair of valid pressures makes a tested pressure drop, so no bound is known"
            return ZERO_COMMAND.check(holds=False, text=text, name=name)
        left = exact.compensator.valve.recorded_units.text(1e3 * float(margin.margin_V), ".3f mV")
        text = f"{margin.exceeded} pressure drops above the threshold's lower bound, smallest margin {left}"
        return ZERO_COMMAND.check(holds=margin.exceeded == 0, text=text, name=name)

    def zero_margin(self, program: Program, place: int) -> ZeroCommandMargin | None:
        """Return what the output of one side at zero command leaves to the bounds, at every pressure drop.

        In units of a PLC a pressure drop stands for all within one unit, and the sensors' own errors come on top.
        """
        exact = self.every.laws[place].exact
        bounds = guarded_bounds(exact.compensator, exact.sign)
        tested = {Fraction(repr(dp)) for dp in bounds.dp_MPa}
        if exact.of_codes:
            found = differences(exact)
            drops, b = pressure_drops(exact, found, tested), np.minimum(found.b_first, exact.code_max)
            a = exact.turn * found.values + found.slant[b]
        else:
            ahead, behind = exact.sensors if exact.turn > 0 else exact.sensors[::-1]
            values = np.arange(ahead.low - behind.high, ahead.high - behind.low + 1)
            second = np.maximum(behind.low, ahead.low - values)
            a, b = (values + second, second)[:: exact.turn]
            drops = self._drops(place, values, tested)
        outputs = self.every.at_zero(program, place, a, b)
        (margin,) = margins_of_drives(drops, outputs, exact.compensator.u_max_V / exact.compare_max, [bounds])
        return margin

    def _drops(self, place: int, values: np.ndarray, tested: set[Fraction]) -> PressureDrops:
        """Return the least and the largest pressure drop that each number of a PLC may stand for."""
        exact = self.every.laws[place].exact
        (a_least, a_most), (b_least, b_most) = exact.a.error_MPa, exact.b.error_MPa
        ends = sorted(exact.turn * error for error in (a_least - b_most, a_most - b_least))
        scale = lcm(PER_MPa, *(value.denominator for value in (*ends, *tested)))
        least = (values - 1).astype(object) * (scale // PER_MPa) + int(ends[0] * scale)
        most = (values + 1).astype(object) * (scale // PER_MPa) + int(ends[1] * scale)
        kind = np.int64 if max(abs(int(each)) for each in (least[0], most[-1])) < 2**61 else object
        return PressureDrops(scale=scale, least=least.astype(kind), most=most.astype(kind),
                             made=np.ones(values.size, dtype=bool))  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Octave:
    """Octave on this machine: its path, and as what its version stands in the evidence; or why it can't be run."""

    path: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
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
    return Octave(path=path, versions={"octave": f"GNU Octave {version[1]}"})


@contextmanager
def running(path: str, name: str, text: bytes) -> Iterator[Program]:
    """Give a function with this text, run by Octave in a folder of its own and with nothing of the user's.

    It takes codes u, p_a and p_b, which broadcast against each other. One that fails or hangs is a `RequirementError`.
    """
    with scratch_folder() as place:
        (place / f"{name}.m").write_bytes(text)
        (place / PROGRAM.name).write_bytes(PROGRAM.read_bytes())
        # It does little linear algebra, and a thread of a library for each core would only wait.
        own = {"HOME": str(place), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        kept = {each: value for each, value in os.environ.items() if each == "OCTAVE_HOME" or each[:6] != "OCTAVE"}
        numbers = count()

        def run(given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
            codes, job = np.broadcast_arrays(*(given[each] for each in ("u", "p_a", "p_b"))), next(numbers)
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
