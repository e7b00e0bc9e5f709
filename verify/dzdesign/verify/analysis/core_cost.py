"""What the core takes on another processor: memory, stack, instructions or cycles a call, measured in a simulator."""

import re
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, PROGRAMS, Machine

PROGRAM = "core_cost.c"
#: What is called, in the order of the program's numbers.
CALLS = ("dz_comp", "dz_drive_sample", "dz_drive_tick")
#: What a machine's program counts.
UNITS = {CORTEX_M4.name: "instructions", AVR.name: "cycles"}
#: Sections of an object that stay in flash; on the AVR data and constants are copied to RAM as well.
IN_FLASH = re.compile(r"\.(?:text|rodata|data)\b")
IN_RAM = {CORTEX_M4.name: re.compile(r"\.(?:data|bss)\b"), AVR.name: re.compile(r"\.(?:rodata|data|bss)\b")}
VERSION = re.compile(r"\b\d+\.\d+\.\d+\b")


@dataclass(frozen=True, slots=True, kw_only=True)
class CoreCost:
    """What law and drive take on one machine."""

    machine: str
    #: Name, version and options.
    compiler: str
    #: Of the objects of law and drive; functions of the compiler's library are not in it.
    flash_bytes: int
    ram_bytes: int
    #: Of `struct dz_drive`, one a valve.
    valve_bytes: int
    #: The deepest below any of the calls.
    stack_bytes: int
    #: Of each of `CALLS` the fewest and the most, from its first instruction to its return.
    counts: tuple[tuple[int, int], ...]

    @property
    def words(self) -> str:
        """The figures as a sentence has them."""
        calls = (
            f"{name} {least if least == most else f'{least} to {most}'}"
            for name, (least, most) in zip(CALLS, self.counts, strict=True)
        )
        return (
            f"law and drive take {self.flash_bytes} bytes of flash, {self.ram_bytes} of RAM and {self.valve_bytes} a "
            f"valve, {self.stack_bytes} of stack; {UNITS[self.machine]} a call: {', '.join(calls)} ({self.compiler})"
        )


def core_cost(folder: Path, machine: Machine) -> CoreCost:
    """Measure the core of a firmware folder on a machine; what does not compile or run is a `RequirementError`."""
    files = [path for name in ("dz_comp*.[ch]", "dz_drive.[ch]") for path in sorted((folder / "core").glob(name))]
    core = {path.name: path.read_bytes() for path in files}
    sources = core | {PROGRAM: (PROGRAMS / PROGRAM).read_bytes()} | machine.headers
    objects = [machine.compile(name, core, machine.core_flags, f"the core {name}") for name in core if name[-1] == "c"]
    flags = (*machine.check_flags, f"-DBOTH={int('dz_comp_negative.c' in core)}")
    what = "the measuring program"
    program = machine.link([*objects, machine.compile(PROGRAM, sources, flags, what)], what)
    printed = _counting(machine).run(program, [], what)
    if len(printed) != 1 or len(printed[0]) != 10:
        raise RequirementError(f"{what} on the {machine.name} reported {printed[:1]}, expected 10 numbers")
    *numbers, valve_bytes = printed[0]
    sections = [_sections(machine, each) for each in objects]
    return CoreCost(
        machine=machine.name,
        compiler=f"{machine.compiler} {_version(machine)} {machine.core_flags[-1]}",
        flash_bytes=_total(sections, IN_FLASH),
        ram_bytes=_total(sections, IN_RAM[machine.name]),
        valve_bytes=valve_bytes,
        stack_bytes=max(numbers[2::3]),
        counts=tuple(zip(numbers[0::3], numbers[1::3], strict=True)),
    )


def _counting(machine: Machine) -> Machine:
    """Return a machine whose clock goes by instructions; the AVR's simulator counts cycles by itself."""
    if machine.small:
        return machine
    *runner, kernel = machine.runner
    return replace(machine, runner=(*runner, "-icount", "shift=10", kernel))


def _sections(machine: Machine, compiled: Path) -> dict[str, int]:
    """Return the sections of an object and their bytes."""
    printed = _printed(machine.compiler.replace("gcc", "size"), "-A", str(compiled))
    rows = (line.split() for line in printed.splitlines() if line.startswith("."))
    return {row[0]: int(row[1]) for row in rows}


def _total(sections: list[dict[str, int]], kept: re.Pattern[str]) -> int:
    return sum(size for each in sections for name, size in each.items() if kept.match(name))


def _version(machine: Machine) -> str:
    found = VERSION.search(_printed(machine.compiler, "--version"))
    return found[0] if found else ""


def _printed(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=True, timeout=60)
    except (OSError, subprocess.SubprocessError) as error:
        raise RequirementError(f"{command[0]} failed: {error}") from error
    return done.stdout
