"""Sixty wrong functions for MATLAB of each kind, judged in Octave: what catches one, and which are equal.

A mutant that gives the same answers at every input, and takes and refuses the same classes and sizes, is equal. A
sample goes first, for which all of them run in one process.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from mutants_judged import EQUAL, rows_of
from scoreboard import Row, print_rows

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
from dzdesign.verify.exhaustive.exact_law import ExactLaw  # noqa: E402
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs  # noqa: E402
from dzdesign.verify.matlab.asked_codes import asked_codes  # noqa: E402
from dzdesign.verify.toolchain.compiled_core import CompiledCore  # noqa: E402
from tests.support.block_mutants import evenly  # noqa: E402
from tests.support.matlab_mutants import killers, mutants  # noqa: E402
from tests.support.octave import OCTAVE, compensator_of, sampled_codes, written  # noqa: E402

COUNT = 60
CASES = (("goldens", "dz_comp", 1), ("goldens_full", "dz_comp", 1), ("goldens_full", "dz_comp_negative", -1))


def judge(root: str, name: str, sign: int, count: int) -> dict[str, int]:
    """Return how many mutants of a function each check caught; print those that none did."""
    made, found = compensator_of(ROOT / "tests" / root), {}
    with TemporaryDirectory() as place:
        folder = written(made, Path(place) / "matlab")
        text, script = (folder / f"{name}.m").read_text(), (folder / "setup_c_caller.m").read_bytes()
        chosen = evenly(mutants(text), count)
        prepared = PreparedInputs(ExactLaw(made, sign))
        every = asked_codes(CompiledCore(folder, sign), sign, prepared.everything(), prepared.exact.zero)
        with sampled_codes(folder, made, sign) as sample, every as everything:
            caught = killers(chosen, OCTAVE, text, script, name, sample, everything)
        for mutant, killer in zip(chosen, caught, strict=True):
            word = killer or EQUAL
            found[word] = found.get(word, 0) + 1
            if not killer:
                line = text.splitlines()[mutant.line - 1].strip()[:90]
                print(f"  equal, line {mutant.line}, {mutant.change}: {line}")
    return found


def print_matlab_mutants(quick: bool = False, seed: int = 0) -> list[Row]:
    """Judge the mutants, print and return the rows; quick: of one function. Without Octave that misses."""
    del seed  # the mutants are spread evenly over the text
    rows = []
    if OCTAVE is None:
        rows.append(Row(what="octave-cli is not on the path: apt install octave", value=1, limit=0))
    else:
        for root, name, sign in CASES[:1] if quick else CASES:
            rows += rows_of(f"{root} {name}", judge(root, name, sign, COUNT))
    print_rows("Wrong functions for MATLAB", rows)
    return rows
