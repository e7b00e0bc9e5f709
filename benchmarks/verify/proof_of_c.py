"""Frama-C's Eva on the whole of the generated core: what it can't exclude where `int` has 16 bits."""

import tempfile
from pathlib import Path
from time import perf_counter

from firmware import example_firmware
from scoreboard import Row, print_rows, say

from dzdesign.verify.analysis.frama_c import prove

QUICK_ROWS = 20


def print_proof(quick: bool = False, seed: int = 0) -> list[Row]:
    """Analyse the example's core for two targets, print and return the rows."""
    rows = []
    for target in ("f28335", "avr"):
        with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
            firmware = Path(folder) / "fw"
            example_firmware(firmware, target)
            say(f"{target}: Frama-C ...")
            start = perf_counter()
            proof = prove(firmware, QUICK_ROWS if quick else None)
            seconds = perf_counter() - start
        note = f"{', '.join(proof.functions)} and the drive; {seconds:.0f} s, Frama-C {proof.version}"
        rows.append(Row(what=f"{target}: places left in doubt", value=len(proof.alarms), limit=0, note=note))
    print_rows("No undefined behaviour with an int of 16 bits", rows)
    return rows
