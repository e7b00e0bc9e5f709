"""Programs around the compiled core, on the host, on a Cortex-M4 in QEMU and on an AVR in simavr.

The core's C is compiled by itself, with nothing of the check in sight, and only linked with it: a black box.
"""

import logging
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from threading import Lock

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain.host_compiler import build, build_folder, host_compiler, words_of

logger = logging.getLogger(__name__)

#: Of the core where its target's makefile says nothing else.
HOST_FLAGS = ("-std=c99", "-O2")
#: With which simavr marks what the UART sends.
ESCAPES = re.compile(r"\x1b\[[0-9]*m")


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """What a core is compiled for and run on.

    Attributes
    ----------
    name : str
        For people.
    compiler : str
        Program; empty: the host's C compiler.
    core_flags : tuple of str
        For the core: those of its target's makefile.
    check_flags : tuple of str
        For the check around it.
    main : str
        The program's file in programs/.
    link_flags : tuple of str
        For the link; ``{programs}`` is the folder of that name.
    section : str
        Of the prepared inputs in the program; empty: they are a file that it reads.
    runner : tuple of str
        What runs the program: its path is added.
    needs : mapping
        Program to the Debian package that has it.
    small : bool
        True if a sample is all there is time and memory for.
    run_timeout_s : float
        A run that takes longer hangs.
    """

    name: str
    compiler: str = ""
    core_flags: tuple[str, ...]
    check_flags: tuple[str, ...]
    main: str
    link_flags: tuple[str, ...] = ()
    section: str = ""
    runner: tuple[str, ...] = ()
    needs: Mapping[str, str] = field(default_factory=dict)
    small: bool = False
    run_timeout_s: float = 60.0

    def missing(self) -> str:
        """Return what was not found, with what to install, or an empty text."""
        absent = [program for program in self.needs if not shutil.which(program)]
        packages = sorted({self.needs[program] for program in absent})
        return f"{' and '.join(absent)} not found; apt install {' '.join(packages)}" if absent else ""


HOST = Machine(name="host", core_flags=HOST_FLAGS, check_flags=("-std=c99", "-O3"), main="host.c")
_M4 = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=soft")
CORTEX_M4 = Machine(
    name="Cortex-M4",
    compiler="arm-none-eabi-gcc",
    core_flags=(*_M4, "-std=c99", "-ffreestanding", "-ffunction-sections", "-fdata-sections", "-O2"),
    check_flags=(*_M4, "-std=gnu99", "-ffreestanding", "-ffunction-sections", "-O2", "-funroll-loops"),
    main="cortex_m4.c",
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
    link_flags=(*_AVR, "-Wl,--gc-sections"),
    section='.section .progmem.data, "a", @progbits',
    runner=("simavr", "-m", CHIP, "-f", str(CLOCK_HZ)),
    needs={"avr-gcc": "gcc-avr avr-libc", "simavr": "simavr"},
    small=True,
    run_timeout_s=300.0,
)


def programs_folder() -> Path:
    """Return the folder of the checks' C."""
    return Path(str(files("dzdesign.verify.toolchain"))) / "programs"


def compile_object(
    machine: Machine, name: str, sources: Mapping[str, bytes], flags: tuple[str, ...], what: str
) -> Path:
    """Return the object of one file of `sources` for a machine, compiled once, in a folder named by all of it.

    Raises
    ------
    RequirementError
        With the compiler's first complaint.
    """
    compiler = machine.compiler or host_compiler()
    key = (
        b"\0".join(part for name, text in sorted(sources.items()) for part in (name.encode(), text))
        + "\0".join([compiler, *flags, name]).encode()
    )
    folder = build_folder() / sha256_of(key)[:32]
    target = folder / f"{name}.o"
    with _alone(target):
        if target.exists():
            return target
        folder.mkdir(exist_ok=True)
        for each, text in sources.items():
            (folder / each).write_bytes(text)
        command = [*words_of(compiler), *flags, "-c", name, "-o", f"{name}.new"]
        build(command, f"{what} ({Path(compiler).name})", folder)
        (folder / f"{name}.new").replace(target)
    return target


def link_program(machine: Machine, objects: list[Path], what: str) -> Path:
    """Link objects to a program, once.

    Raises
    ------
    RequirementError
        If they do not link.
    """
    key = sha256_of("\0".join(map(str, objects)).encode())[:32]
    program = build_folder() / f"{key}{'.exe' if sys.platform == 'win32' and machine is HOST else ''}"
    with _alone(program):
        if program.exists():
            return program
        flags = [flag.replace("{programs}", str(programs_folder())) for flag in machine.link_flags]
        compiler = machine.compiler or host_compiler()
        build([*words_of(compiler), *map(str, objects), *flags, "-o", str(program)], what, build_folder())
    return program


def stored(content: bytes) -> Path:
    """Return a file of that content, written once."""
    file = build_folder() / f"{sha256_of(content)[:32]}.bin"
    with _alone(file):
        if not file.exists():
            file.write_bytes(content)
    return file


_guard = Lock()
_locks: dict[Path, Lock] = {}


def _alone(file: Path) -> Lock:
    """Return the lock of a file: mutants are built side by side, and share what is the same."""
    with _guard:
        return _locks.setdefault(file, Lock())


def run_program(machine: Machine, program: Path, arguments: list[str], what: str) -> list[list[int]]:
    """Run a program and return the lines of numbers that it printed.

    Raises
    ------
    RequirementError
        If it fails, hangs, or prints something else.
    """
    command = [*machine.runner, str(program), *arguments]
    begin = time.perf_counter()
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL,
            timeout=machine.run_timeout_s, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RequirementError(f"{what} on the {machine.name} did not end: {error}") from error
    logger.debug("%s (%.3f s)", shlex.join(command), time.perf_counter() - begin)
    if done.returncode:
        reason = f"signal {-done.returncode}" if done.returncode < 0 else f"exit status {done.returncode}"
        raise RequirementError(f"{what} on the {machine.name} ended with {reason}: {done.stderr.strip()[:200]}")
    # QEMU's semihosting writes to stderr where stdout is no terminal of its own.
    printed = ESCAPES.sub("", done.stdout + "\n" + done.stderr).replace(" .", " ")
    return [list(map(int, line.split())) for line in printed.splitlines() if re.fullmatch(r"\s*\d[\d\s]*", line)]
