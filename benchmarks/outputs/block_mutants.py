"""Sixty wrong function blocks of each kind, each judged on every input: what catches one, and which are equal.

A mutant that no input tells apart, from every state near zero command, is equal: all inputs were tried. A quick sample
goes first, so that most of them take a second.
"""

import sys
from pathlib import Path

from mutants_judged import EQUAL, rows_of
from scoreboard import Row, print_rows

from dzdesign.codegen.structured_text.files import structured_text
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.verify.structured_text.every_pair import ExactTables

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
from tests.support.block_mutants import evenly, killer, mutants  # noqa: E402

COUNT = 60
SOME = {"plc": (range(-60, 2400, 25), range(-300, 4300, 100)), "codes": (range(-40, 3300, 40), range(0, 4096, 64))}
CASES = (("goldens", "plc"), ("goldens", "codes"), ("goldens_full", "plc"), ("goldens_full", "codes"))


def judge(root: str, interface: str, count: int) -> dict[str, int]:
    """Return how many mutants of a golden compensator's block each check caught; print those that none did."""
    source = ROOT / "tests" / root / "compensator.json"
    compensator = read_artefact(source.read_bytes(), Compensator, source.name)
    text, found = structured_text(compensator, "0" * 64, interface), {}
    tables = ExactTables(compensator, interface)
    for mutant in evenly(mutants(text), count):
        caught = killer(mutant, tables, *SOME[interface]) or killer(mutant, tables) or EQUAL
        found[caught] = found.get(caught, 0) + 1
        if caught == EQUAL:
            print(f"  equal, line {mutant.line}, {mutant.change}: {text.splitlines()[mutant.line - 1].strip()[:90]}")
    return found


def print_block_mutants(quick: bool = False, seed: int = 0) -> list[Row]:
    """Judge the mutants, print and return the rows; quick: of one block."""
    del seed  # the mutants are spread evenly over the text
    rows = []
    for root, interface in CASES[:1] if quick else CASES:
        rows += rows_of(f"{root} {interface}", judge(root, interface, COUNT))
    print_rows("Wrong function blocks", rows)
    return rows
