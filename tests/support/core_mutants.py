"""Wrong C: one constant, comparison or operator of a file changed at a time.

A constant is changed by one, or, beyond 16 bits, by one in the last of its 16 leading bits: the finest that a compare
value of 16 bits resolves. Below that lie the bits of a scaled product that its one rounding takes away.

Whether `verify` would see a wrong firmware: every constant, comparison and operator of its core changed by itself.

A mutant is killed if the check of all inputs (values, fallbacks, status, beta) or that of the drive finds a fault, or
if the program crashes or hangs. One that a compiler refuses is no evidence, and counted apart. What is left is
equivalent if its object is the same byte for byte, or if nothing tells the two apart: all inputs pass, so that its
compare value is the law's at every pair of command and pressure difference; the drive goes with its model; and at
`RANDOM_TRIPLES` random triples of 16-bit codes, most of which no converter can give, all functions of the law return
what the original's return. Otherwise it survives.
"""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.verify.exhaustive.drive_check import CompiledDrive, DriveCheck, PreparedDrive
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.folder import read_compensator
from dzdesign.verify.toolchain.compiled_core import CompiledCore, Findings
from dzdesign.verify.toolchain.machines import HOST

#: Comments, rows that fill a table beyond what is used, directives that hold no value, and what a mutation may meet;
#: the first that matches is taken.
TOKEN = re.compile(
    r"(?P<skip>/\*.*?\*/|//[^\n]*|(?:\{0u, 0u\},?\s*)+"
    r"|\#[ \t]*(?:include|ifndef|ifdef|endif|define[ \t]+\w+[ \t]*\n)[^\n]*"
    r"|\#[ \t]*define[ \t]+\w+)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<number>0[xX][0-9a-fA-F]+|\d+)(?P<suffix>[uUlL]*)"
    r"|(?P<operator><<=|>>=|<<|>>|<=|>=|==|!=|\+\+|--|\+=|-=|&=|\|=|&&|\|\||->|[-+<>&|^~!*/%=?:;,.(){}\[\]])",
    re.DOTALL,
)
#: What stands for an operator between two operands.
SWAPS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==",
    "+": "-", "-": "+", "<<": ">>", ">>": "<<", "&": "|", "|": "&", "&&": "||", "||": "&&",
    "+=": "-=", "-=": "+=", "++": "--", "--": "++",
}  # fmt: skip
#: Bits of the widest output, the compare value.
OUTPUT_BITS = 16
#: Left out where they stand before an operand.
DROPPED = ("-", "~", "!")
ENDS_OPERAND = re.compile(r"[\w\])]$")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """One change: its file, its line from 1, the change in words, and the whole file with it."""

    file: str
    line: int
    change: str
    text: str


def mutants_of(file: str, text: str) -> Iterator[Mutant]:
    """Yield every mutant of a file."""
    before = ""
    for token in TOKEN.finditer(text):
        if token["skip"] is not None:
            continue
        start, end = token.span("number") if token["number"] else token.span()
        for new in _instead(token, before):
            line = text.count("\n", 0, start) + 1
            code = text.splitlines()[line - 1].strip()
            change = f"{code[:70]}: {text[start:end]} -> {new or 'nothing'}"
            yield Mutant(file=file, line=line, change=change, text=text[:start] + new + text[end:])
        before = token[0]


def _instead(token: re.Match[str], before: str) -> list[str]:
    """Return what may stand in place of a token."""
    if token["number"]:
        value = int(token["number"], 0)
        change = 1 << max(value.bit_length() - OUTPUT_BITS, 0)
        return [str(value + change)] + ([str(value - change)] if value else [])
    operator = token["operator"]
    if operator in ("++", "--"):
        return [SWAPS[operator]]
    between = bool(ENDS_OPERAND.search(before)) and before != "return"
    if operator in SWAPS and between:
        return [SWAPS[operator]]
    return [""] if operator in DROPPED and not between else []


@dataclass(frozen=True, slots=True, kw_only=True)
class MutantOutcome:
    """Result of one mutant, and the check that caught it; empty if none did."""

    file: str
    line: int
    change: str
    verdict: str
    killer: str = ""


KILLED, REFUSED, SAME_OBJECT, SAME_OUTPUTS, SURVIVED = (
    "killed", "refused by the compiler", "same object code", "same outputs", "survived",
)  # fmt: skip
RANDOM_TRIPLES = 2**24


class MutationBench:
    """The checks that a mutant has to pass, prepared once."""

    def __init__(self, folder: Path) -> None:
        self._compensator = read_compensator(folder)
        self._signs = self._compensator.signals.signs
        self._cores = {sign: CompiledCore(folder, sign) for sign in self._signs}
        prepared = {sign: PreparedInputs(ExactLaw(self._compensator, sign)) for sign in self._signs}
        self._samples = {sign: each.sample() for sign, each in prepared.items()}
        self._everything = {sign: each.everything(impatient=True) for sign, each in prepared.items()}
        self._drive = CompiledDrive(folder)

    @cached_property
    def _drive_samples(self) -> PreparedDrive:
        return PreparedDrive(self._compensator)

    @property
    def sources(self) -> dict[str, str]:
        """The core's files, name to text."""
        return {name: text.decode(errors="surrogateescape") for name, text in self._drive.sources.items()}

    def check_original(self) -> None:
        """Run every check on the firmware as it is; if it fails one, no mutant's failing says anything."""
        _ = self._drive_samples
        for verdict in self._tried(self._cores, self._drive):
            if verdict:
                raise RequirementError(f"the firmware itself fails ({verdict}), so its mutants can't be judged")

    def judge(self, mutant: Mutant) -> MutantOutcome:
        """Compile a mutant and try everything on it."""
        text = mutant.text.encode(errors="surrogateescape")
        drive = self._drive.edited(mutant.file, text)
        cores = {
            sign: core.edited(mutant.file, text) for sign, core in self._cores.items() if mutant.file in core.sources
        }
        outcome = partial(MutantOutcome, file=mutant.file, line=mutant.line, change=mutant.change)
        try:
            objects = drive.objects()
        except RequirementError:
            return outcome(verdict=REFUSED)
        if [*map(Path.read_bytes, objects)] == [*map(Path.read_bytes, self._drive.objects())]:
            return outcome(verdict=SAME_OBJECT)
        for killer in self._tried(cores, drive):
            if killer:
                return outcome(verdict=KILLED, killer=killer)
        return outcome(verdict=SAME_OUTPUTS if self._agree(objects) else SURVIVED)

    def _tried(self, cores: dict[int, CompiledCore], drive: CompiledDrive) -> Iterable[str]:
        """Yield, check by check, what found a fault, or an empty text: first what is quick."""
        runs: tuple[tuple[str, Callable[[], Findings | DriveCheck]], ...] = (
            *(
                ("sample of inputs", partial(core.check, self._samples[sign], sample=True))
                for sign, core in cores.items()
            ),
            ("drive", partial(drive.check, self._drive_samples)),
            *(("all inputs", partial(core.check, self._everything[sign])) for sign, core in cores.items()),
        )
        for name, run in runs:
            try:
                yield name if run().faults else ""
            except RequirementError as error:
                yield f"{name}: {str(error).partition(':')[0]}"

    def _agree(self, objects: Sequence[Path]) -> bool:
        """Compare every function of the core with the original's at random triples of 16 bits."""
        results = []
        flags = (*HOST.check_flags, *(["-DDZ_BOTH"] if len(self._signs) > 1 else []))
        source = {"random_triples.c": Path(__file__).with_name("random_triples.c").read_bytes()}
        main = HOST.compile("random_triples.c", source, flags, "the random triples")
        for each in (objects, self._drive.objects()):
            program = HOST.link([*each, main], "the random triples")
            results.append(HOST.run(program, [str(RANDOM_TRIPLES)], "the core"))
        return results[0] == results[1]


def all_mutants(bench: MutationBench) -> list[Mutant]:
    """Return every mutant of the core's files, in their order."""
    return [mutant for name, text in bench.sources.items() for mutant in mutants_of(name, text)]


def judge_all(bench: MutationBench, mutants: Sequence[Mutant]) -> list[MutantOutcome]:
    """Judge mutants on all processors."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(bench.judge, mutants))
