"""Instructions a call on a Cortex-M4F in QEMU, and every input against the exact law by its machine code.

A program reads SysTick around many calls of the core and, in the same loop, of a function that only returns. With
``-icount shift=0`` QEMU's clock advances by 1 ns for every instruction, so the difference is a count of instructions.
"""

from collections.abc import Sequence
from pathlib import Path

from building import ON_TARGET, Counts, Toolchain, build, known_core, run, section_bytes
from contender import Contender
from tried_inputs import Codes, inputs_header

CORTEX_M4 = Toolchain(
    compiler="arm-none-eabi-gcc",
    size="arm-none-eabi-size",
    machine_flags=("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
    link_flags=("-nostartfiles", "-T", str(ON_TARGET / "cortex_m4.ld"), "-Wl,--gc-sections", "-lm"),
    sections=(".text", ".ARM.exidx"),
    needs={
        "arm-none-eabi-gcc": "gcc-arm-none-eabi and libnewlib-arm-none-eabi",
        "arm-none-eabi-size": "binutils-arm-none-eabi",
        "qemu-system-arm": "qemu-system-arm",
    },
)
MACHINE = ("qemu-system-arm", "-M", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "none")
SEMIHOSTING = ("-semihosting-config", "enable=on,target=native")
#: SysTick counts the board's 25 MHz, an instruction takes 1 ns.
INSTRUCTIONS_PER_TICK = 40
#: Each reading is right to a tick: two readings in 400 calls to a fifth of an instruction.
REPEATS = 400
#: What may be left of a fraction of an instruction.
FRACTION = 0.25
KNOWN = (".syntax unified\n.thumb\n.global dz_comp\n.thumb_func\ndz_comp:", "bx lr")
RETURN = 1  # instructions of a function that only returns


def known(length: int) -> Contender:
    """Return a core of `length` + 1 instructions."""
    return known_core(*KNOWN, length)


def count(contender: Contender, inputs: Sequence[Codes], folder: Path, *, averaged: bool = False) -> Counts:
    """Count instructions from the first of ``dz_comp`` to its return, library functions it calls included.

    An instruction that is skipped by its condition counts: it takes its cycle. `averaged` is for code with a state of
    its own, of whose calls the mean is counted.
    """
    headers = {"inputs.h": inputs_header(inputs, REPEATS) + contender.prelude}
    program = build(CORTEX_M4, contender, ["cortex_m4_start.c", "count_cortex_m4.c"], headers, folder)
    said = run([*MACHINE, *SEMIHOSTING, "-icount", "shift=0", "-kernel", program], folder)
    rows = [tuple(map(int, line.split())) for line in said.splitlines()]
    if len(rows) != len(inputs):
        raise RuntimeError(f"QEMU reported {len(rows)} inputs of {len(inputs)}")
    counts = []
    for empty, full, _ in rows:
        exact = (full - empty) * INSTRUCTIONS_PER_TICK / REPEATS + RETURN
        if abs(exact - round(exact)) > FRACTION and not averaged:
            raise RuntimeError(f"QEMU's clock gives {exact:.2f} instructions, expected a whole number")
        counts.append(round(exact))
    return Counts(counts=tuple(counts), compares=tuple(row[2] for row in rows))


def code_bytes(contender: Contender, folder: Path) -> int:
    """Return the code and constants that the core adds to a program, library functions it calls included."""
    header = {"inputs.h": inputs_header([(0, 0, 0)], 1)}
    with_it, without = (
        section_bytes(CORTEX_M4, build(CORTEX_M4, each, ["cortex_m4_start.c", "count_cortex_m4.c"], header, path))
        for each, path in ((contender, folder / "with"), (known(0), folder / "without"))
    )
    return with_it - without


def check_all(contender: Contender, rows_header: str, folder: Path) -> tuple[int, int, int]:
    """Return inputs tried, wrong ones and the largest error in counts, over every pair of codes, by machine code."""
    headers = {"exact_rows.h": rows_header}
    program = build(CORTEX_M4, contender, ["cortex_m4_start.c", "check_all.c"], headers, folder)
    inputs, wrong, largest = map(int, run([*MACHINE, *SEMIHOSTING, "-kernel", program], folder).split())
    return inputs, wrong, largest
