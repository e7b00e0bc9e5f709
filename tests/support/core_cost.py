"""What the core takes on another processor: memory, stack, instructions or cycles a call, measured in a simulator."""

import re
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes import run_program
from dzdesign.verify.toolchain.compiled_core import embedded
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, Machine, block_of

PROGRAM = "core_cost.c"
#: Sources of law and drive, and of the check of a block.
FILES = ("dz_comp.[ch]", "dz_drive.[ch]", "dz_calibration.[ch]", "dz_valve.h")
CHECK = "dz_calibration.c"
#: What is called, in the order of the program's numbers.
CALLS = ("dz_comp", "dz_drive_sample", "dz_drive_tick")
#: Sections of an object that stay in flash; on the AVR data and constants are copied to RAM as well.
IN_FLASH = re.compile(r"\.(?:text|rodata|data)\b")
IN_RAM = {CORTEX_M4.name: re.compile(r"\.(?:data|bss)\b"), AVR.name: re.compile(r"\.(?:rodata|data|bss)\b")}
#: Where a block lies that the program writes to; on the AVR with what copies it from flash to RAM at the start, which
#: the compiler asks for and the assembler does not.
BLOCK_SECTION = {
    CORTEX_M4.name: '.section .rodata, "a", %progbits',
    AVR.name: '.global __do_copy_data\n.section .data, "aw", @progbits',
}
VERSION = re.compile(r"\b\d+\.\d+\.\d+\b")


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockCost:
    """What only block form has: the check, the block itself, and what a call takes of other blocks than this one."""

    check_flash_bytes: int
    check_ram_bytes: int
    check_stack_bytes: int
    #: The most of dz_calibration_check() with the blocks of `hardest`; on the AVR to 256 cycles.
    check_count: int
    block_bytes: int
    #: Of each of `CALLS` the most that was counted with this block, then with every drive function on, then with the
    #: longest shifts of its divisions too, as far as the firmware's check takes such a block.
    hardest: tuple[int, int, int]


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
    #: Of a core in block form; the counts are those with the firmware's own block.
    block: BlockCost | None = None


def core_cost(folder: Path, machine: Machine) -> CoreCost:
    """Measure the core of a firmware folder on a machine; what does not compile or run is a `RequirementError`."""
    block = block_of(folder)
    files = [path for name in FILES for path in sorted((folder / "core").glob(name))]
    core = {path.name: path.read_bytes() for path in files}
    objects = {
        name: machine.compile(name, core, machine.core_flags, f"the core {name}") for name in core if name[-1] == "c"
    }
    printed = _counted(machine, core, objects, block)
    numbers, valve_bytes, more = printed[:9], printed[9], printed[10:]
    check = [_sections(machine, objects.pop(CHECK))] if block is not None else []
    sections = [_sections(machine, each) for each in objects.values()]
    cost = CoreCost(
        machine=machine.name,
        compiler=f"{machine.compiler} {_version(machine)} {machine.core_flags[-1]}",
        flash_bytes=_total(sections, IN_FLASH),
        ram_bytes=_total(sections, IN_RAM[machine.name]),
        valve_bytes=valve_bytes,
        stack_bytes=max(numbers[2::3]),
        counts=tuple(zip(numbers[0::3], numbers[1::3], strict=True)),
    )
    if block is None:
        return cost
    refused, count, stack_bytes, *other = more
    if refused:
        raise RequirementError(f"the check of the block on the {machine.name} gave {refused}, expected 0: not accepted")
    comp, sample, tick = (max(pair) for pair in zip(numbers[1::3], other[1::3], strict=True))
    of_block = BlockCost(
        check_flash_bytes=_total(check, IN_FLASH),
        check_ram_bytes=_total(check, IN_RAM[machine.name]),
        check_stack_bytes=stack_bytes,
        check_count=count,
        block_bytes=len(block),
        hardest=(comp, sample, tick),
    )
    return replace(cost, block=of_block, stack_bytes=max(numbers[2::3] + other[2::3]))


def _counted(machine: Machine, core: dict[str, bytes], objects: dict[str, Path], block: bytes | None) -> list[int]:
    """Return the numbers that the measuring program prints."""
    what = "the measuring program"
    both = any(b"dz_comp_negative" in text for text in core.values())
    sources = core | {PROGRAM: Path(__file__).with_name(PROGRAM).read_bytes()} | machine.headers
    flags = (*machine.check_flags, f"-DBOTH={int(both)}", *(["-DDZ_BLOCK"] if block else []))
    linked = [*objects.values(), machine.compile(PROGRAM, sources, flags, what)]
    if block is not None:
        linked.append(embedded(machine, "block", BLOCK_SECTION[machine.name], block))
    printed = _counting(machine).run(machine.link(linked, what), [], what)
    expected = 10 if block is None else 22
    if len(printed) != 1 or len(printed[0]) != expected:
        raise RequirementError(f"{what} on the {machine.name} reported {printed[:1]}, expected {expected} numbers")
    return printed[0]


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
        done = run_program(command, timeout=60)
        done.check_returncode()
    except (OSError, subprocess.SubprocessError) as error:
        raise RequirementError(f"{command[0]} failed: {error}") from error
    return done.stdout
