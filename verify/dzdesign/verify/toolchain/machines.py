"""Compiled code in a child process with a time-out: a crash of it is one sentence that names its signal.

Programs around the compiled core, on the host, on a Cortex-M4 in QEMU and on an AVR in simavr.

The core's C is compiled by itself, with nothing of the check in sight, and only linked with it: a black box.

The calibration block of a firmware in block form, and what binds the core to it: in C, for every check's program.
"""

import logging
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes import find_program, run_program
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.verify.toolchain.host_compiler import built, host_compiler, words_of

#: Largest number that a program of ours prints has 32 bits; what has more digits is none of ours.
NUMBERS = re.compile(r"\s*\d{1,10}(?:\s+\d{1,10})*\s*", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """How a program ended, and what it printed."""

    #: Why it did not end well, in words; empty where it did.
    reason: str
    printed: str
    complaint: str


def run_child(
    command: Sequence[str],
    what: str,
    timeout_s: float,
    *,
    place: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program in a folder and return how it ended; one that does not start or end is a `RequirementError`."""
    try:
        done = run_program(command, timeout=timeout_s, cwd=place, env=environment)
    except subprocess.TimeoutExpired:
        raise RequirementError(f"{what} did not end within {timeout_s:g} s") from None
    except OSError as error:
        raise RequirementError(f"{what} did not start: {error}") from error
    return Ended(reason=reason_of(done.returncode), printed=done.stdout, complaint=done.stderr)


def reason_of(status: int) -> str:
    """Return why an exit status is not that of a good end, in words; empty where it is.

    Examples
    --------
    >>> reason_of(3), reason_of(-11)
    ('exit status 3', 'signal 11 (SIGSEGV)')
    """
    if status >= 0:
        return f"exit status {status}" if status else ""
    name = signal.Signals(-status).name if -status in {*signal.Signals} else "unknown"
    return f"signal {-status} ({name})"


def numbers_in(printed: str) -> list[list[int]]:
    """Return the lines of numbers in what was printed, whatever else there is.

    Examples
    --------
    >>> numbers_in("1 22 \\nnot 3\\n4\\n" + 5000 * "9")
    [[1, 22], [4]]
    """
    return [list(map(int, line.split())) for line in printed.splitlines() if NUMBERS.fullmatch(line)]


logger = logging.getLogger(__name__)

#: Folder of the checks' C.
PROGRAMS = Path(str(files("dzdesign.verify.toolchain"))) / "programs"
#: On this machine, of what becomes part of a library whose own calls are not looked up.
HOST_FLAGS = ("-std=c99", "-O2", *(() if sys.platform == "win32" else ("-fPIC", "-fno-semantic-interposition")))
#: With which simavr marks what the UART sends.
ESCAPES = re.compile(r"\x1b\[[0-9]*m")


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """What a core is compiled for and run on."""

    name: str
    #: Program; empty: the host's C compiler.
    compiler: str = ""
    #: Those of the target's makefile, and those for the check around the core.
    core_flags: tuple[str, ...]
    check_flags: tuple[str, ...]
    #: File in programs/ with how a program starts, puts numbers and ends, for what includes machine.h.
    start_up: str
    #: The program around the check of every input there; empty: it is a library.
    main: str = ""
    #: ``{programs}`` is the folder of that name.
    link_flags: tuple[str, ...] = ()
    #: Of the prepared inputs in the program.
    section: str = ""
    #: What runs the program: its path is added.
    runner: tuple[str, ...] = ()
    #: Program to the Debian package that has it.
    needs: Mapping[str, str] = field(default_factory=dict)
    #: Whether a sample is all there is time and memory for.
    small: bool = False
    #: A run that takes longer hangs.
    run_timeout_s: float = 60.0

    def missing(self) -> str:
        """Return what was not found, with what to install, or an empty text."""
        absent = [program for program in self.needs if not find_program(program)]
        packages = sorted({self.needs[program] for program in absent})
        return f"{' and '.join(absent)} not found; apt install {' '.join(packages)}" if absent else ""

    @property
    def headers(self) -> dict[str, bytes]:
        """What a program's own file may include of the machine, by name."""
        return {"machine.h": (PROGRAMS / self.start_up).read_bytes()}

    @property
    def _compiler(self) -> str:
        return self.compiler or host_compiler()

    def compile(self, name: str, sources: Mapping[str, bytes], flags: tuple[str, ...], what: str) -> Path:
        """Return the object of one file of `sources`, compiled once."""
        command = [*words_of(self._compiler), *flags, "-c", name]
        return built(f"{name}.o", command, sources, f"{what} ({Path(self._compiler).name})")

    def link(self, objects: list[Path], what: str) -> Path:
        """Link objects to a program, once."""
        flags = [flag.replace("{programs}", str(PROGRAMS)) for flag in self.link_flags]
        ending = ".exe" if sys.platform == "win32" and not self.compiler else ""
        return built(f"program{ending}", [*words_of(self._compiler), *map(str, objects), *flags], {}, what)

    def run(self, program: Path, arguments: list[str], what: str) -> list[list[int]]:
        """Run a program and return the lines of numbers that it printed; if it fails or hangs, `RequirementError`."""
        command = [*self.runner, str(program), *arguments]
        begin = time.perf_counter()
        ended = run_child(command, f"{what} on the {self.name}", self.run_timeout_s)
        logger.debug("%s (%.3f s)", shlex.join(command), time.perf_counter() - begin)
        if ended.reason:
            said = f": {ended.complaint.strip()[:200]}" if ended.complaint.strip() else ""
            raise RequirementError(f"{what} on the {self.name} ended with {ended.reason}{said}")
        # QEMU's semihosting writes to stderr where stdout is no terminal of its own.
        return numbers_in(ESCAPES.sub("", ended.printed + "\n" + ended.complaint).replace(" .", " "))


HOST = Machine(
    name="host", core_flags=HOST_FLAGS, check_flags=(*HOST_FLAGS, "-O3"), start_up="start_host.h"
)
_M4 = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=soft")
CORTEX_M4 = Machine(
    name="Cortex-M4",
    compiler="arm-none-eabi-gcc",
    core_flags=(*_M4, "-std=c99", "-ffreestanding", "-ffunction-sections", "-fdata-sections", "-O2"),
    check_flags=(*_M4, "-std=gnu99", "-ffreestanding", "-ffunction-sections", "-O2", "-funroll-loops"),
    main="cortex_m4.c",
    start_up="start_cortex_m4.h",
    link_flags=(*_M4, "-nostartfiles", "-nostdlib", "-T", "{programs}/cortex_m4.ld", "-Wl,--gc-sections", "-lgcc"),
    section='.section .rodata, "a", %progbits',
    runner=(
        "qemu-system-arm", "-M", "mps2-an386", "-cpu", "cortex-m4", "-nographic", "-monitor", "none", "-serial", "none",
        "-semihosting-config", "enable=on,target=native", "-kernel",
    ),
    needs={"arm-none-eabi-gcc": "gcc-arm-none-eabi", "qemu-system-arm": "qemu-system-arm"},
    run_timeout_s=300.0,
)  # fmt: skip
CHIP, CLOCK_HZ = "atmega1280", 16_000_000
_AVR = (f"-mmcu={CHIP}", f"-DF_CPU={CLOCK_HZ}UL")
AVR = Machine(
    name="AVR",
    compiler="avr-gcc",
    core_flags=(*_AVR, "-std=c99", "-Os"),
    # Without -fno-ivopts GCC 5.4 ends with an internal error where tables lie in program memory.
    check_flags=(*_AVR, "-std=gnu99", "-O2", "-fno-ivopts"),
    main="avr.c",
    start_up="start_avr.h",
    link_flags=(*_AVR, "-Wl,--gc-sections"),
    section='.section .progmem.data, "a", @progbits',
    runner=("simavr", "-m", CHIP, "-f", str(CLOCK_HZ)),
    needs={"avr-gcc": "gcc-avr avr-libc", "simavr": "simavr"},
    small=True,
    run_timeout_s=300.0,
)


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


def bound_files(block: bytes | None) -> dict[str, str]:
    """Return what a program is compiled with beside a core in block form; nothing for a core with its valve's numbers.

    That is a header for the program, which calls the core's functions as those of the fixed form, and the block as C.
    """
    if block is None:
        return {}
    words = [int.from_bytes(block[at : at + 2], "little") for at in range(0, len(block), 2)]
    lines = [words[at : at + WORDS_A_LINE] for at in range(0, len(words), WORDS_A_LINE)]
    numbers = "\n".join("    " + " ".join(f"{word}u," for word in line) for line in lines)
    head = (
        f'#include "{BLOCK_HEADER}"\n\n#include "{BOUND_HEADER}"\n\n#if DZ_CALIBRATION_WORDS != {len(words)}\n'
        f"#error no such calibration block: {len(block)} octets\n#endif\n"
    )
    return {
        BOUND_HEADER: (PROGRAMS / BOUND_HEADER).read_text(encoding="utf-8"),
        BOUND_SOURCE: f"{head}const union dz_bound dz_bound = {{{{\n{numbers}\n}}}};\n",
    }


def core_sources(folder: Path) -> dict[str, str]:
    """Return the C code of a firmware's core, and what binds one in block form to its block."""
    core = {path.name: path.read_text(encoding="utf-8") for path in sorted((folder / "core").glob("*.[ch]"))}
    return {**core, **bound_files(block_of(folder))}
