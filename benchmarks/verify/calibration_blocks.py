"""Calibration blocks: random and adversarial ones with a right CRC, and wrong checks of blocks."""

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from scoreboard import Row, print_rows, say

sys.path.insert(0, str(Path(__file__).parents[2]))  # for the blocks and mutants that the tests share

from tests.codegen.calibration.test_check import changed_blocks, forms
from tests.support.check_mutants import CHECK, Corpus, corners, drawn_mutants
from tests.support.claimed_blocks import CLAIMS, Drawn, TriedBlocks, random_block, random_octets

#: Blocks of which half and more are accepted; those that are tried; pairs of pressures of each.
BLOCKS, QUICK_BLOCKS, PAIRS = 10_000, 300, 6
MUTANTS, QUICK_MUTANTS, CORPUS = 200, 20, 1500


def print_blocks(quick: bool = False, seed: int = 0) -> list[Row]:
    """Try random blocks and wrong checks, print and return the rows."""
    rows = [*_random_blocks(QUICK_BLOCKS if quick else BLOCKS, seed)]
    rows += _wrong_checks(QUICK_MUTANTS if quick else MUTANTS, seed)
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


def _wrong_checks(count: int, seed: int) -> list[Row]:
    """Return how many wrong checks no block gives away; each that is left is printed."""
    corpora = []
    for name, built, block in forms():
        say(f"{name}: blocks ...")
        drawn = Drawn(seed)
        more = [random_block(block, built, drawn) for _ in range(CORPUS)]
        rng = np.random.default_rng(seed)
        corpora.append(Corpus(built, [block, *changed_blocks(block, rng), *corners(block, built), *more]))
    begin, left, refused = perf_counter(), [], 0
    mutants = drawn_mutants(corpora, count, seed)
    for corpus, mutant in mutants:
        killed = corpus.killed(mutant.text)
        refused += killed is None
        left += [mutant] if killed is False else []
    for mutant in left:
        print(f"no block tells it apart: {CHECK} line {mutant.line}: {mutant.change}")
    note = f"{len(mutants) - len(left) - refused} killed, {refused} refused by the compiler; "
    note += f"{perf_counter() - begin:.0f} s; those printed are to be shown equal"
    return [Row(what=f"wrong checks of {len(mutants)} that no block gives away", value=len(left), note=note)]
