"""`dzdesign doctor`: which compilers and simulators are there, what each is for, and how to get the rest."""

import platform
import re
import subprocess
import sys
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

from dzdesign.core.errors import DzdesignError
from dzdesign.core.processes import find_program, run_program
from dzdesign.core.version import __version__
from dzdesign.terminal.page import Column, new_console, print_json, put_line, put_rows

TINY = "#include <stdint.h>\nint32_t dz_tiny(int32_t a);\nint32_t dz_tiny(int32_t a) { return 3 * a; }\n"
#: A program that says nothing of its version within this time is taken as it is, s.
PATIENCE_S = 20
#: Where a system's programs come from; of any other than these, from Debian's packages.
SYSTEMS = {"win32": ("Windows", "windows"), "darwin": ("macOS", "macos")}


class Tool(NamedTuple):
    """A program that dzdesign can use: what it is for, where it comes from, and how it says its version."""

    name: str
    purpose: str
    debian: str
    macos: str
    windows: str
    ask: tuple[str, ...] = ("--version",)


XCODE, PIP, TI = "xcode-select --install", "pip install ziglang", "https://www.ti.com/tool/C2000-CGT"
#: One of these is the main job: without it nothing can be verified.
COMPILERS = (
    Tool("gcc", "verify", "apt install gcc libc6-dev", XCODE, "winget install BrechtSanders.WinLibs.POSIX.UCRT"),
    Tool("clang", "verify", "apt install clang", XCODE, "winget install LLVM.LLVM"),
    Tool("zig", "verify, where there is no other compiler", PIP, PIP, PIP, ask=("version",)),
)
OPTIONAL = (
    Tool("arm-none-eabi-gcc", "verify --machine-code: Cortex-M4",
         "apt install gcc-arm-none-eabi libnewlib-arm-none-eabi", "brew install --cask gcc-arm-embedded",
         "winget install Arm.GnuArmEmbeddedToolchain"),
    Tool("qemu-system-arm", "verify --machine-code: Cortex-M4", "apt install qemu-system-arm", "brew install qemu",
         "winget install SoftwareFreedomConservancy.QEMU"),
    Tool("avr-gcc", "verify --machine-code: AVR", "apt install gcc-avr avr-libc", "brew install osx-cross/avr/avr-gcc",
         "winget install ZakKemble.avr-gcc"),
    Tool("simavr", "verify --machine-code: AVR", "apt install simavr", "brew install osx-cross/avr/simavr",
         "only in WSL: apt install simavr", ask=("--help",)),
    Tool("octave-cli", "verify of --target matlab", "apt install octave", "brew install octave",
         "winget install GNU.Octave"),
    Tool("cl2000", "to build for f28335 and f280049c; dzdesign does not call it", TI, TI, TI, ask=("-version",)),
    Tool("make", "make demo, make test", "apt install make", XCODE, "winget install ezwinports.make"),
)  # fmt: skip
EXAMPLES = ("dzdesign doctor", "dzdesign doctor --json")


@dataclass(frozen=True)
class Arguments:
    """Arguments of `doctor`: none."""


def run(arguments: Arguments, json: bool) -> int:
    """Print what is there; 1 if no C compiler works, for then nothing can be verified."""
    programs = {tool.name: _found(tool) for tool in (*COMPILERS, *OPTIONAL)}
    compiles, compiler = _compiles()
    one_is_there = any(programs[tool.name] for tool in COMPILERS)  # which is enough
    to_get = [tool for tool in (OPTIONAL if one_is_there else (*COMPILERS, *OPTIONAL)) if not programs[tool.name]]
    about = {"dzdesign": __version__, "python": platform.python_version(), "system": platform.platform()}
    if json:
        print_json({
            **about, "compiles": compiles, "compiler": compiler, "programs": programs,
            "to_get": [tool._asdict() for tool in to_get],
        })  # fmt: skip
        return 0 if compiles else 1
    console = new_console()
    put_line(console, "dzdesign {dzdesign}, Python {python}, {system}".format_map(about))
    versions = {name: (found or {"version": "not found"})["version"] or "found" for name, found in programs.items()}
    shown: dict[str, Column[Tool]] = {
        "program": lambda tool: tool.name, "version": lambda tool: versions[tool.name], "for": lambda tool: tool.purpose
    }  # fmt: skip
    put_rows(console, "Programs", (*COMPILERS, *OPTIONAL), shown, words=(0, 1, 2))
    if to_get:
        system, source = SYSTEMS.get(sys.platform, ("Debian, Ubuntu", "debian"))
        columns = {"program": attrgetter("name"), system: attrgetter(source)}
        put_rows(console, "How to get the rest (--json: on every system)", to_get, columns, words=(0, 1))
    works = f"A library was compiled, loaded and called with {compiler}: verify can run."
    put_line(console, works if compiles else f"NO C COMPILER WORKS: {compiler}")
    return 0 if compiles else 1


def _found(tool: Tool) -> dict[str, str] | None:
    """Return path and version of a program, or None."""
    from dzdesign.verify.toolchain.host_compiler import find_zig

    path = find_zig() if tool.name == "zig" else find_program(tool.name)
    if path is None:
        return None
    try:
        done = run_program([path, *tool.ask], timeout=PATIENCE_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        return {"path": path, "version": f"does not run: {error}"}
    number = re.search(r"\d+\.\d+(?:\.\d+)?\S*", done.stdout + done.stderr) if tool.ask != ("--help",) else None
    return {"path": path, "version": number.group().rstrip(",)") if number else ""}


def _compiles() -> tuple[bool, str]:
    """Compile a tiny program and have it answer; return whether that works, and with what or why not."""
    from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
    from dzdesign.verify.toolchain.host_compiler import host_compiler

    tripled = Function("dz_tiny", ("int32_t",), "int32_t")
    try:
        compiler = host_compiler()
        answer = CompiledLibrary({"tiny.c": TINY}, [tripled], "a tiny program").call(tripled.name, 14)
    except (DzdesignError, OSError) as error:
        return False, str(error)
    return (True, compiler) if answer == 42 else (False, f"{compiler}: its program counts 3 * 14 = {answer}")
