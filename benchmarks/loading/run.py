"""Benchmark of loading calibration blocks over a line and a supply that fail; ``run.py [--quick]``.

The drive is its generated C with undefined behaviour trapped, the PC is the session of `dzdesign load`, and the line
and the clock between them are simulated. Exit status 1 if a limit is missed.
"""

import contextlib
import os
import random
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]

from scoreboard import Row, print_rows, run_parts, say  # noqa: E402

from dzdesign.codegen.loading.session import LoadSession  # noqa: E402
from tests.support.loading.bench import session  # noqa: E402
from tests.support.loading.exchanges import KINDS, Bench, DyingLine, load  # noqa: E402
from tests.support.loading.files import blocks, new_bench  # noqa: E402
from tests.support.loading.seeded_faults import FAULTS, is_found  # noqa: E402

TRAPPED = ("-fsanitize=undefined", "-fsanitize-undefined-trap-on-error")


def print_exchanges(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows: what became of the blocks in exchanges of every kind of fault."""
    count, rng = 900 if quick else 10_000, random.Random(seed)
    with TemporaryDirectory() as folder:
        bench = new_bench(Path(folder), None, *TRAPPED)
        say(f"{count} faulty exchanges")
        for number in range(count):
            bench.exchange(KINDS[number % len(KINDS)], rng)
    for (kind, end), times in sorted(bench.ends.items()):
        print(f"{kind}: {end} {times} times")
    wrongly = bench.wrongly_done + sum(times for (_, end), times in bench.ends.items() if end.endswith("wrongly"))
    of = f"of {count} exchanges, seed {seed}"
    rows = [
        Row(what="invalid blocks accepted", value=bench.invalid_accepted, limit=0, note=of),
        Row(what="old blocks lost", value=bench.old_lost, limit=0, note=of),
        Row(what="another block than the sender was told", value=wrongly, limit=0, note=of),
        Row(what="blocks taken into use with the output not held", value=bench.used_unheld, limit=0, note=of),
        Row(what="drives that took no block afterwards", value=bench.stuck, limit=0, note=of),
    ]
    print_rows("Faulty exchanges", rows)
    return rows


def print_lost_supply(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows: supply or sender go at each octet of a load, the supply at each word too."""
    step = 10 if quick else 1
    old, new = blocks()[1:3]
    wrong, tried = {"octets": 0, "words": 0, "sender": 0}, {"octets": 0, "words": 0, "sender": 0}
    with TemporaryDirectory() as folder:
        bench = new_bench(Path(folder), None, *TRAPPED)
        octets = _octets_of_a_load(bench)
        for what, last in (("octets", octets), ("words", bench.words_of_a_load)):
            say(f"the supply goes at each of {last} {what}")
            for cut in (*range(0, last, step), last - 1):
                for again in range(1 if what == "octets" else 3):
                    _start(bench)
                    bench.drive.power_on(seed=seed + cut + again * last)
                    bench.drive.set(**{f"{what}_left": cut})
                    ended = load(session(bench.drive), new)
                    held = bench.drive.power_on()
                    tried[what] += 1
                    wrong[what] += ended == "done" or held not in ((old, new) if cut == last - 1 else (old,))
        say(f"the sender goes at each of {octets} octets")
        for cut in range(0, octets, step):
            tried["sender"] += 1
            wrong["sender"] += not _sender_goes(bench, cut)
    texts = {"octets": "supply lost at an octet", "words": "supply lost at a word", "sender": "sender lost at an octet"}
    rows = [
        Row(what=f"{text}: neither the old nor the new block", value=wrong[what], limit=0, note=f"of {tried[what]}")
        for what, text in texts.items()
    ]
    print_rows("Lost supply", rows)
    return rows


def _start(bench: Bench) -> None:
    bench.drive.erase()
    bench.drive.power_on()
    load(session(bench.drive), blocks()[1])


def _sender_goes(bench: Bench, cut: int) -> bool:
    """Have a sender die after so many octets; tell whether the drive went on with the old block, held no longer."""
    _start(bench)
    line = DyingLine(bench.drive, cut)
    with contextlib.suppress(BrokenPipeError):
        load(LoadSession(line), blocks()[2])
    for _ in range(50):
        line.read(0.05)
    drive = bench.drive
    return drive.block() == blocks()[1] == drive.power_on() and not drive.code.drive_is_held()


def _octets_of_a_load(bench: Bench) -> int:
    sent = 0
    feed = bench.drive.code.drive_feed

    class Counted:
        def __call__(self, octets: bytes, count: int) -> None:
            nonlocal sent
            sent += count
            feed(octets, count)

    _start(bench)
    bench.drive.code.drive_feed = Counted()
    load(session(bench.drive), blocks()[2])
    bench.drive.code.drive_feed = feed
    return sent


def print_seeded_faults(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the row: faults seeded in the C that the exchanges and checks do not find."""
    faults = FAULTS[:: 6 if quick else 1]
    missed = []
    for number, fault in enumerate(faults):
        say(f"seeded fault {number + 1} of {len(faults)}")
        with TemporaryDirectory() as folder:
            if not is_found(fault, Path(folder), 12):
                missed.append(fault)
    for fault in missed:
        print(f"not found: {fault}")
    rows = [Row(what="seeded faults not found", value=len(missed), limit=0, note=f"of {len(faults)}")]
    print_rows("Seeded faults", rows)
    return rows


PARTS = {"exchanges": (print_exchanges, 24), "supply": (print_lost_supply, 7), "faults": (print_seeded_faults, 0)}

if __name__ == "__main__":
    raise SystemExit(run_parts(__doc__.splitlines()[0], PARTS, "a tenth of each", None))
