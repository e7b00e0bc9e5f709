"""Cycles a call on an ATmega1280 in simavr, by the chip's own timers; `int` has 16 bits and `double` 32 there."""

import re
from collections.abc import Sequence
from pathlib import Path

from building import Counts, Toolchain, build, known_core, run, section_bytes
from contender import Contender
from tried_inputs import Codes, inputs_header

CHIP, CLOCK_HZ = "atmega1280", 16_000_000
AVR = Toolchain(
    compiler="avr-gcc",
    size="avr-size",
    machine_flags=(f"-mmcu={CHIP}", f"-DF_CPU={CLOCK_HZ}UL"),
    link_flags=("-Wl,--gc-sections", "-lm"),
    sections=(".text", ".data"),
    needs={"avr-gcc": "gcc-avr and avr-libc", "avr-size": "binutils-avr", "simavr": "simavr"},
)
KNOWN = (".global dz_comp\n.type dz_comp, STT_FUNC\ndz_comp:", "ret")
RETURN = 4  # cycles of a function that only returns
COLOUR = re.compile(r"\x1b\[[0-9]*m")
REPORT = re.compile(r"^(\d+) (\d+) (\d+) \.?$")


def known(length: int) -> Contender:
    """Return a core of `length` + `RETURN` cycles."""
    return known_core(*KNOWN, length)


def count(contender: Contender, inputs: Sequence[Codes], folder: Path) -> Counts:
    """Count cycles from the first instruction of ``dz_comp`` to its return, library functions it calls included."""
    headers = {"inputs.h": inputs_header(inputs, 1, program_memory=True)}
    program = build(AVR, contender, ["count_avr.c"], headers, folder)
    said = COLOUR.sub("", run(["simavr", "-m", CHIP, "-f", str(CLOCK_HZ), program], folder))
    rows = [tuple(map(int, found.groups())) for line in said.splitlines() if (found := REPORT.match(line.strip()))]
    if len(rows) != len(inputs):
        raise RuntimeError(f"simavr reported {len(rows)} inputs of {len(inputs)}")
    return Counts(
        counts=tuple(full - empty + RETURN for empty, full, _ in rows), compares=tuple(row[2] for row in rows)
    )


def code_bytes(contender: Contender, folder: Path) -> int:
    """Return the code and constants that the core adds to a program, library functions it calls included."""
    header = {"inputs.h": inputs_header([(0, 0, 0)], 1, program_memory=True)}
    with_it, without = (
        section_bytes(AVR, build(AVR, each, ["count_avr.c"], header, folder / name))
        for each, name in ((contender, "with"), (known(0), "without"))
    )
    return with_it - without
