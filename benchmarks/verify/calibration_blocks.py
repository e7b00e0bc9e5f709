"""Calibration blocks: random and adversarial ones with a right CRC, and wrong checks of blocks."""

import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path
from time import perf_counter

import numpy as np
from equal_verdicts import SOLVER, equal_verdicts
from scoreboard import Row, print_rows, say

sys.path.insert(0, str(Path(__file__).parents[2]))  # for the blocks and mutants that the tests share

from check_mutants import CHECK, Corpus, drawn_mutants

from tests.codegen.calibration.test_check import changed_blocks, forms
from tests.support.block_corners import corners
from tests.support.claimed_blocks import CLAIMS, Drawn, TriedBlocks, random_block, random_octets

#: Blocks of which half and more are accepted; those that are tried; pairs of pressures of each.
BLOCKS, QUICK_BLOCKS, PAIRS = 10_000, 300, 6
QUICK_MUTANTS, CORPUS = 20, 300
KILLED, REFUSED = "killed by a verdict", "refused by the compiler"
KILLED_SANITIZED = "killed by a read beyond a table or a shift too far"
SAME_CODE, PROVED_EQUAL = "of the same machine code", "proved equal by Z3"
DIFFERS, NO_ANSWER = "not equal, given away by no block", "not shown equal"


def print_blocks(quick: bool = False, seed: int = 0) -> list[Row]:
    """Try random blocks and wrong checks, print and return the rows."""
    rows = [*_random_blocks(QUICK_BLOCKS if quick else BLOCKS, seed)]
    rows += _wrong_checks(QUICK_MUTANTS if quick else None, seed)
    print_rows("Calibration blocks", rows)
    return rows


def _random_blocks(wanted: int, seed: int) -> list[Row]:
    """Return what holds of every accepted block: all commands at some pressures."""
    found, tried, accepted, unlike = np.zeros(1, dtype=CLAIMS)[0], 0, 0, 0
    places = [each for each in forms() if each[0] != "current"]
    cores = [(built, block, TriedBlocks(built)) for _, built, block in places]
    begin = perf_counter()
    while accepted < wanted:
        for number, (built, block, core) in enumerate(cores):
            octets, expected = random_octets(block, built, seed + 1000 * tried + number, 200)
            verdicts = [core.accepted(each) for each in octets]
            good = [each for each, holds in zip(octets, verdicts, strict=True) if holds]
            unlike += verdicts != expected
            claims = core.claims(good, PAIRS)
            for name in CLAIMS.names or ():
                found[name] += min(int(claims[name].sum()), 2**31) if name != "calls" else 0
            tried, accepted = tried + len(octets), accepted + len(good)
        say(f"{accepted} of {tried} random blocks accepted ...")
    note = f"of {accepted} accepted blocks of {tried}, all commands at {PAIRS} pairs of pressures; "
    note += f"{perf_counter() - begin:.0f} s"
    return [
        Row(what="verdicts of the check that are not those of exact integers", value=unlike, limit=0),
        Row(what="outputs that are not those of the law in 128 bits", value=float(found["wrong"]), limit=0, note=note),
        Row(what="outputs above the limit", value=float(found["above_limit"]), limit=0),
        Row(what="outputs that fall with a rising command", value=float(found["falls"]), limit=0),
        Row(what="sums outside 0 to 2^63", value=float(found["wraps"]), limit=0),
    ]


def _wrong_checks(count: int | None, seed: int) -> list[Row]:
    """Return how many wrong checks are neither given away by a block nor equal; each that is left is printed."""
    corpora = []
    for name, built, block in forms():
        say(f"{name}: blocks ...")
        drawn = Drawn(seed)
        more = [random_block(block, built, drawn) for _ in range(CORPUS)]
        rng = np.random.default_rng(seed)
        corpora.append(Corpus(built, [block, *changed_blocks(block, rng), *corners(block, built), *more]))
    _try_solver()
    begin, mutants = perf_counter(), drawn_mutants(corpora, count, seed)
    if any(corpus.killed(corpus.sources[CHECK]) is not False for corpus in corpora):
        raise RuntimeError("the right check does not give the blocks their verdicts: the mutants show nothing")
    fates: Counter[str] = Counter()
    for number, (corpus, mutant) in enumerate(mutants):
        fate = _fate(corpus, mutant.text)
        fates[fate] += 1
        if fate not in (KILLED, REFUSED):
            print(f"{fate}: {CHECK} line {mutant.line} of shape {corpus.built.shape}: {mutant.change}", flush=True)
        if number % 200 == 199:
            say(f"{number + 1} of {len(mutants)} wrong checks ...")
    note = ", ".join(f"{fates[each]} {each}" for each in sorted(fates)) + f"; {perf_counter() - begin:.0f} s"
    left = sum(fates[each] for each in (DIFFERS, NO_ANSWER))
    return [Row(what=f"wrong checks of {len(mutants)} neither given away nor equal", value=left, limit=0, note=note)]


def _fate(corpus: Corpus, text: str) -> str:
    """Return what becomes of a wrong check."""
    killed = corpus.killed(text)
    if killed is not False:
        return REFUSED if killed is None else KILLED
    with tempfile.TemporaryDirectory() as folder:
        if corpus.killed_sanitized(text, Path(folder)):
            return KILLED_SANITIZED
        if corpus.same_code(text, Path(folder)):
            return SAME_CODE
    if not shutil.which(SOLVER):
        return NO_ANSWER
    equal = equal_verdicts(corpus.sources, text, CHECK)
    return NO_ANSWER if equal is None else PROVED_EQUAL if equal else DIFFERS


#: A check of two numbers, and others: whether each says the same.
SMALL = """#include "small.h"
uint16_t dz_calibration_check(const struct dz_calibration *block)
{
    uint16_t found = (uint16_t)((block->a[0] > 7u) ? 1u : 0u);

    for (uint16_t index = 0u; index < 2u; index++) {
        if ((found & 1u) == 0u) {
            found |= (uint16_t)(((block->a[index] * block->a[1]) > 49u) ? 2u : 0u);
        }
    }
    return found;
}
"""
SMALL_HEADER = "#include <stdint.h>\nstruct dz_calibration\n{\n    uint16_t a[2];\n};\n"
OTHERS = {"> 7u": (">= 8u", True), "> 49u": (">= 49u", False), "index = 0u": ("index = 1u", True),
          "index < 2u": ("index < 1u", False), "== 0u": ("< 1u", True), "? 2u": ("? 3u", False)}  # fmt: skip


def _try_solver() -> None:
    """Raise an error where the solver's verdict is not right for a small check and others of known equality."""
    if not shutil.which(SOLVER):
        say(f"{SOLVER} not found: apt install {SOLVER}; equal checks count as not shown equal")
        return
    for old, (new, equal) in OTHERS.items():
        if equal_verdicts({"small.h": SMALL_HEADER, "small.c": SMALL}, SMALL.replace(old, new), "small.c") != equal:
            raise RuntimeError(f"{SOLVER} does not say {equal} of {old} made {new}")
