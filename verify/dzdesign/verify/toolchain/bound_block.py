"""The calibration block of a firmware in block form, and what binds the core to it: in C, for every check's program."""

from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.verify.toolchain.machines import PROGRAMS

#: The struct of the valve's numbers; the numbers themselves, where they stand in the core; and the check of a block,
#: which only a core has that takes one.
BLOCK_HEADER, VALVE_HEADER, ACCEPTANCE = "dz_calibration.h", "dz_valve.h", "dz_calibration.c"
BOUND_HEADER, BOUND_SOURCE = "bound.h", "dz_bound.c"
WORDS_A_LINE = 12


def block_of(folder: Path) -> bytes | None:
    """Return the octets of a firmware's calibration block; None of a core with the numbers of its valve in it.

    A firmware in block form without one is a `RequirementError`: nothing says what its core computes.
    """
    if not (folder / "core" / ACCEPTANCE).exists():
        return None
    path = folder / BLOCK_FILE
    try:
        return path.read_bytes()
    except OSError as error:
        raise RequirementError(
            f"{path}: can't be read: {error.strerror}; this firmware takes its valve's numbers from a calibration "
            "block, make it again with `dzdesign codegen --calibration block`"
        ) from error


def bound_files(folder: Path) -> dict[str, str]:
    """Return what a program is compiled with beside a core in block form; nothing for a core with its valve's numbers.

    That is a header for the program, which calls the core's functions as those of the fixed form, and the block as C.
    """
    block = block_of(folder)
    if block is None:
        return {}
    words = [int.from_bytes(block[at : at + 2], "little") for at in range(0, len(block), 2)]
    lines = [words[at : at + WORDS_A_LINE] for at in range(0, len(words), WORDS_A_LINE)]
    numbers = "\n".join("    " + " ".join(f"{word}u," for word in line) for line in lines)
    includes = f'#include "{BLOCK_HEADER}"\n\n#include "{BOUND_HEADER}"\n\n'
    return {
        BOUND_HEADER: (PROGRAMS / BOUND_HEADER).read_text(encoding="utf-8"),
        BOUND_SOURCE: f"{includes}const union dz_bound dz_bound = {{{{\n{numbers}\n}}}};\n",
    }


def core_sources(folder: Path) -> dict[str, str]:
    """Return the C code of a firmware's core, and what binds one in block form to its block."""
    core = {path.name: path.read_text(encoding="utf-8") for path in sorted((folder / "core").glob("*.[ch]"))}
    return {**core, **bound_files(folder)}
