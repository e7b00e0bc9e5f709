"""Every input of the check as files of codes, answered by a function in Octave, and judged by the same check as the C.

The check of every input is compiled C that calls a core. It runs twice: with the compiled core, while the codes that it
asks for are kept in their order, and with the function's answers to these codes in place of the core.
"""

import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import RequirementError
from dzdesign.core.scratch import scratch_folder
from dzdesign.verify.matlab.octave import PROGRAMS, run_octave
from dzdesign.verify.toolchain.compiled_core import CHECK, CompiledCore, Findings, findings_of
from dzdesign.verify.toolchain.machines import HOST, stored
from dzdesign.verify.toolchain.machines import PROGRAMS as CHECK_PROGRAMS

ADAPTER = "asked_codes.c"
#: What the check calls, in the order of the function's outputs.
OUTPUTS = ("core", "status", "beta")
#: Folder of what Octave answers, the one in which it may write.
ANSWERS = "answers"
ENDINGS = {1: "", -1: "_negative"}
#: Octets of the codes of an input, and of an answer.
CODES_SIZE, ANSWER_SIZE = 6, 2
#: Inputs from which they are divided among processes.
WORTH_A_PROCESS = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class AskedCodes:
    """The codes that the check asks for of one side, in files of a folder."""

    folder: Path
    sign: int
    #: Octets of the check's own table of inputs, and whether it is that of a sample.
    prepared: bytes
    sample: bool
    #: What the check found of the compiled core, and a command that asks for beta, which has none.
    compiled: Findings
    any_command: int

    def codes(self, output: str) -> Path:
        """Return the file with the codes that one output is asked for."""
        return self.folder / f"codes_{output}.bin"

    def count(self, output: str) -> int:
        """Return how many inputs one output is asked for."""
        path = self.codes(output)
        return path.stat().st_size // CODES_SIZE if path.exists() else 0

    def judged(self, answers: Mapping[str, Path], text: bytes, what: str) -> Findings:
        """Return what the check finds of the answers, output to file, of a function with this text."""
        program = _program(self.folder, self.sign, self.any_command, answers, core=None)
        return _checked(program, self.prepared, self.sample, text, what)


@contextmanager
def asked_codes(
    core: CompiledCore, sign: int, prepared: bytes, any_command: int, *, sample: bool = False
) -> Iterator[AskedCodes]:
    """Give the codes that the check asks a compiled core for, in a folder that goes afterwards."""
    with scratch_folder() as folder:
        made = core.compiled()
        program = _program(folder, sign, any_command, {}, made)
        compiled = _checked(program, prepared, sample, made.read_bytes(), f"the core {core.name}")
        yield AskedCodes(
            folder=folder, sign=sign, prepared=prepared, sample=sample, compiled=compiled, any_command=any_command
        )


def _program(folder: Path, sign: int, any_command: int, answers: Mapping[str, Path], core: Path | None) -> Path:
    """Return the check with the adapter: around a compiled core, or with answers in its place."""
    names = {"DZ_CORE": "dz_asked_core", "DZ_STATUS": "dz_asked_status", "DZ_BETA": "dz_asked_beta"}
    flags = [*HOST.check_flags, *(f"-D{macro}={name}" for macro, name in names.items())]
    own = [*flags, f"-DDZ_ANY_COMMAND={any_command}u"]
    for output in OUTPUTS:
        own.append(text_flag(f"DZ_CODES_{output.upper()}", str(folder / f"codes_{output}.bin")))
        own.append(text_flag(f"DZ_ANSWERS_{output.upper()}", str(answers.get(output, ""))))
    if core is not None:
        compiled = (("CORE", "comp"), ("STATUS", "status"), ("BETA", "beta"))
        own += ["-DDZ_RECORD", *(f"-DDZ_COMPILED_{macro}=dz_{name}{ENDINGS[sign]}" for macro, name in compiled)]
    adapter = HOST.compile(ADAPTER, {ADAPTER: (PROGRAMS / ADAPTER).read_bytes()}, tuple(own), "the adapter of answers")
    check = {name: (CHECK_PROGRAMS / name).read_bytes() for name in (*CHECK, HOST.main)} | HOST.headers
    units = [name for name in check if name.endswith(".c")]
    objects = [adapter, *(HOST.compile(name, check, tuple(flags), "the check") for name in units)]
    return HOST.link(objects if core is None else [*objects, core], "the check of answers")


def _checked(program: Path, prepared: bytes, sample: bool, checked: bytes, what: str) -> Findings:
    printed = HOST.run(program, [str(stored(prepared)), *(["sample"] if sample else [])], what)
    return findings_of(printed, sha256_of(checked), what)


def answers_of(
    octave: str, functions: Mapping[str, bytes], asked: AskedCodes, outputs: Sequence[str] = OUTPUTS
) -> dict[str, dict[str, Path | str]]:
    """Return the answers of functions, name to text, in files: by function and output; of one that fails the reason.

    They run in processes of Octave, in a folder that holds nothing but them.
    """
    work = asked.folder / "functions"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    (asked.folder / ANSWERS).mkdir(exist_ok=True)
    for name, text in functions.items():
        (work / f"{name}.m").write_bytes(text)
    jobs = [(output, first, count) for output in outputs for first, count in _pieces(asked.count(output))]

    def run(job: tuple[str, int, int]) -> None:
        output, first, count = job
        files = [part for name in functions for part in (name, str(_answers(asked, name, output, first)))]
        number = str(OUTPUTS.index(output) + 1)
        arguments = [number, str(asked.codes(output)), str(first), str(count), *files]
        run_octave(octave, "answers_of.m", arguments, work, len(functions))

    with ThreadPoolExecutor(min(os.cpu_count() or 1, 4)) as pool:
        list(pool.map(run, jobs))
    return {name: {output: _joined(asked, name, output) for output in outputs if asked.count(output)}
            for name in functions}  # fmt: skip


def _pieces(count: int) -> list[tuple[int, int]]:
    """Return what each process has of some inputs: the first, and how many."""
    processes = min(os.cpu_count() or 1, 4) if count > WORTH_A_PROCESS else 1
    ends = [count * part // processes for part in range(processes + 1)]
    return [(first, end - first) for first, end in pairwise(ends) if end > first]


def _answers(asked: AskedCodes, name: str, output: str, first: int) -> Path:
    return asked.folder / ANSWERS / f"{name}_{output}_{first}.bin"


def _joined(asked: AskedCodes, name: str, output: str) -> Path | str:
    """Return the answers of all pieces in one file, or the first reason why there are none."""
    whole = asked.folder / f"{name}_{output}.bin"
    pieces = _pieces(asked.count(output))
    with whole.open("wb") as to:
        for first, count in pieces:
            piece = _answers(asked, name, output, first)
            reason = piece.with_name(f"{piece.name}.error")
            if reason.exists():
                text = " ".join(reason.read_text(encoding="utf-8", errors="replace").split())
                reason.unlink()
                return text[:300]
            if not piece.exists() or piece.stat().st_size != count * ANSWER_SIZE:
                raise RequirementError(f"Octave gave no {count} answers of {name}, output {output}")
            with piece.open("rb") as content:
                shutil.copyfileobj(content, to, 1 << 20)
            piece.unlink()
    return whole


def text_flag(macro: str, text: str) -> str:
    """Return the flag that defines a string of C."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'-D{macro}="{escaped}"'
