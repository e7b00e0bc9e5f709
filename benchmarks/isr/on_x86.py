"""Instructions a call on x86-64 by callgrind, and every input against the exact law on the host."""

import re
from collections.abc import Sequence
from pathlib import Path

from building import Counts, Toolchain, build, known_core, run, section_bytes
from contender import Contender
from tried_inputs import Codes, inputs_header

X86 = Toolchain(
    compiler="gcc",
    size="size",
    machine_flags=(),
    # -z now: the dynamic linker does its work before main, not in the first call of a library function.
    link_flags=("-Wl,--gc-sections", "-Wl,-z,now", "-lm"),
    sections=(".text", ".rodata", ".data"),
    needs={"gcc": "gcc", "size": "binutils", "valgrind": "valgrind"},
)
KNOWN = (
    ".globl dz_comp\n.type dz_comp, STT_FUNC\ndz_comp:",
    "ret\n.size dz_comp, .-dz_comp\n.section .note.GNU-stack",
)
RETURN = 1  # instructions of a function that only returns


def known(length: int) -> Contender:
    """Return a core of `length` + 1 instructions."""
    return known_core(*KNOWN, length)


def count(contender: Contender, inputs: Sequence[Codes], folder: Path) -> Counts:
    """Count instructions from the first of ``dz_comp`` to its return, library functions it calls included."""
    program = build(X86, contender, ["count_x86.c"], {"inputs.h": inputs_header(inputs, 1)}, folder)
    profile = folder / "callgrind.out"
    said = run(
        [
            "valgrind",
            "-q",
            "--tool=callgrind",
            "--toggle-collect=dz_comp",
            "--dump-after=dz_comp",
            "--combine-dumps=yes",
            f"--callgrind-out-file={profile}",
            program,
        ],
        folder,
    )
    parts = re.findall(r"Trigger: --dump-after=dz_comp\n(?:.*\n)*?summary: (\d+)", profile.read_text(encoding="utf-8"))
    compares = [int(line) for line in said.splitlines() if line.isdigit()]
    if not len(parts) == len(compares) == len(inputs):
        raise RuntimeError(f"callgrind saw {len(parts)} calls of {len(inputs)}")
    return Counts(counts=tuple(map(int, parts)), compares=tuple(compares))


def code_bytes(contender: Contender, folder: Path) -> int:
    """Return the code and constants that the core adds to a program; the C library, being shared, is not among them."""
    header = {"inputs.h": inputs_header([(0, 0, 0)], 1)}
    with_it, without = (
        section_bytes(X86, build(X86, each, ["count_x86.c"], header, folder / name))
        for each, name in ((contender, "with"), (known(0), "without"))
    )
    return with_it - without


def check_all(contender: Contender, rows_header: str, folder: Path) -> tuple[int, int, int]:
    """Return inputs tried, wrong ones and the largest error in counts, over every pair of codes."""
    program = build(X86, contender, ["check_all.c"], {"exact_rows.h": rows_header}, folder)
    inputs, wrong, largest = map(int, run([program], folder).split())
    return inputs, wrong, largest
