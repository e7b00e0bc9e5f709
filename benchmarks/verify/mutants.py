"""Every constant, comparison and operator of the generated core made wrong: what verify's checks let through."""

import random
import tempfile
from collections import Counter
from pathlib import Path
from time import perf_counter

from firmware import example_firmware
from scoreboard import Row, print_rows, say

from tests.support.core_mutants import KILLED, SURVIVED, MutationBench, all_mutants, judge_all

QUICK = 60


def print_mutants(quick: bool = False, seed: int = 0) -> list[Row]:
    """Judge all mutants, print and return the rows."""
    rows = []
    for target in ("f28335",):
        with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
            example_firmware(Path(folder) / "fw", target)
            bench = MutationBench(Path(folder) / "fw")
            bench.check_original()
            mutants = all_mutants(bench)
            tried = random.Random(seed).sample(mutants, QUICK) if quick else mutants
            say(f"{target}: {len(tried)} of {len(mutants)} mutants ...")
            start = perf_counter()
            outcomes = judge_all(bench, tried)
            seconds = perf_counter() - start
        found = Counter(each.verdict for each in outcomes)
        note = f"{', '.join(f'{count} {verdict}' for verdict, count in found.items())}; {seconds:.0f} s"
        rows.append(
            Row(what=f"{target}: mutants of {len(tried)} that survive", value=found[SURVIVED], limit=0, note=note)
        )
        for each in (each for each in outcomes if each.verdict != KILLED):
            print(f"{target}: {each.verdict}, {each.file} line {each.line}: {each.change}")
    print_rows("Wrong C", rows)
    return rows
