"""Whether two checks of calibration blocks say the same of every block: proved by the SMT solver Z3.

The C, read by pycparser, is carried out on words of unknown bits, every loop unrolled. Both checks run on the same
unknown block, so that what they share is one term. Their CRC is one unknown number: checks that differ in it are not
for this. A signed overflow wraps here; that there is none is Eva's to show.
"""

import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

from c_runs import ENTRY, Place, Run
from c_words import Terms, Unreadable, any_of, flags_of
from pycparser import c_ast, c_parser

SOLVER, TIMEOUT_S = "z3", 120
#: Bits of `int` and of `long`, by Frama-C's name of a machine.
MACHINES = {"x86_64": (32, 64), "x86_16": (16, 32)}


def equal_verdicts(right: Mapping[str, str], text: str, file: str, machine: str = "x86_64") -> bool | None:
    """Return whether a check says the same as the right one of every block; None: the solver finds no answer.

    Products of two unknown numbers are first any function of these, which is no less a proof and sooner found.
    """
    terms = Terms()
    try:
        left, other = (_verdict({**right, file: each}, file, machine, terms) for each in (right[file], text))
    except Unreadable:
        return None
    found = [_same_bit(terms, left.get(bit, frozenset()), other.get(bit, frozenset())) for bit in {*left, *other}]
    return None if None in found and False not in found else all(found)


def _same_bit(terms: Terms, left: frozenset[str], other: frozenset[str]) -> bool | None:
    """Return whether one of these statements holds where one of those does."""
    if left == other:
        return True
    common = "\n".join(f"(assert (not {each}))" for each in sorted(left & other))
    goal = f"(assert (not (= {any_of(left - other)} {any_of(other - left)})))"
    for exact in ((), (16, 32), (16, 32, 64)):
        for assumed in ("", common):
            answer = _solved(terms, f"{assumed}\n{goal}", exact)
            if answer == "unsat":
                return True
    return False if answer == "sat" else None


def _solved(terms: Terms, goal: str, exact: tuple[int, ...]) -> str:
    head = []
    for bits in (16, 32, 64):
        sort = f"(_ BitVec {bits})"
        unknown = f"(declare-fun product{bits} ({sort} {sort}) {sort})"
        product = f"(define-fun product{bits} ((x {sort}) (y {sort})) {sort} (bvmul x y))"
        head.append(product if bits in exact else unknown)
    text = "\n".join([*head, *terms.needed(goal), goal, "(check-sat)"])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "equal.smt2"
        path.write_text(text)
        done = subprocess.run([SOLVER, f"-T:{TIMEOUT_S}", path], capture_output=True, text=True, check=False)
    if "error" in done.stdout:
        raise RuntimeError(done.stdout[:500])
    return done.stdout.split()[0] if done.stdout.split() else "no answer"


def _verdict(sources: Mapping[str, str], file: str, machine: str, terms: Terms) -> dict[int, frozenset[str]]:
    short, long = MACHINES[machine]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for each, content in sources.items():
            (folder / each).write_text(content)
        suffix = "u" if short == 32 else "uL"
        types = "typedef unsigned short uint16_t; typedef unsigned int uint32_t; typedef unsigned long long uint64_t;"
        (folder / "stdint.h").write_text(f"{types}\n#define UINT32_C(x) x##{suffix}\n")
        (folder / "limits.h").write_text("#define CHAR_BIT 8\n")
        command = ["gcc", "-E", "-P", "-nostdinc", f"-I{folder}", folder / file]
        text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    block = Place(("block",), c_ast.Struct("dz_calibration", None))
    found = Run(c_parser.CParser().parse(text), short, long, terms).call(ENTRY, [block])
    if isinstance(found.term, str):
        raise Unreadable("a verdict that is not made of statements")
    return dict(flags_of(found))
