"""A side of the law behind the getters of an FMU's binary, called as the check of every input calls a compiled core."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

from dzdesign.core.artefact_files import sha256_of
from dzdesign.verify.fmu.fmu_file import FmuFile
from dzdesign.verify.fmu.results import results_of
from dzdesign.verify.toolchain.compiled_core import CHECK, Findings, findings_of
from dzdesign.verify.toolchain.host_compiler import find_zig
from dzdesign.verify.toolchain.machines import HOST, PROGRAMS, Machine, stored

#: This room's C: headers, and their folder.
OWN_HEADERS = ("fmi_calls.h", "results.h")
OWN_PROGRAMS = Path(str(files("dzdesign.verify.fmu"))) / "programs"
ENDINGS = {1: "", -1: "_negative"}
#: Loads a binary by itself: of Windows without flags.
LOADER: tuple[str, ...] = ("-ldl",) if sys.platform.startswith("linux") else ()
FMU_HOST = replace(HOST, link_flags=LOADER, run_timeout_s=300.0)
#: Longest that a simulator takes, s.
SLOW_S = 900.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """Another platform than this machine's: its binaries' folder and ending, and what runs a program."""

    name: str
    folder: str
    ending: str
    target: str
    runner: tuple[str, ...]
    #: What stands before the path of a file there.
    drive: str = ""
    #: Program or file to the Debian package that has it.
    needs: Mapping[str, str]
    link_flags: tuple[str, ...] = ()

    @property
    def machine(self) -> Machine:
        """The machine that a check is compiled for and run on."""
        return Machine(
            name=self.name,
            compiler=f"{find_zig()} cc -target {self.target}",
            core_flags=(),
            check_flags=("-std=c99", "-O2", "-g0", "-fno-sanitize=undefined"),
            main="host.c",
            start_up="start_host.h",
            link_flags=self.link_flags,
            runner=self.runner,
            run_timeout_s=SLOW_S,
        )


#: Wine stands beside the path on Debian, where only its 64-bit half is installed.
WINE = next((str(path) for path in map(Path, ("/usr/bin/wine64", "/usr/lib/wine/wine64")) if path.exists()), "wine64")
ARM_ROOT = "/usr/aarch64-linux-gnu"
SIMULATED = (
    Simulated(name="x86_64 Windows in Wine", folder="win64", ending="dll",
              target="x86_64-windows-gnu", runner=(WINE,), drive="Z:", needs={WINE: "wine64"}),
    Simulated(name="aarch64 Linux in QEMU", folder="aarch64-linux", ending="so", target="aarch64-linux-gnu.2.36",
              runner=("qemu-aarch64", "-L", ARM_ROOT), link_flags=("-ldl",),
              needs={"qemu-aarch64": "qemu-user", f"{ARM_ROOT}/lib/ld-linux-aarch64.so.1": "libc6-arm64-cross"}),
)  # fmt: skip


def text_flag(macro: str, text: str) -> str:
    """Return the flag that defines a string of C."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'-D{macro}="{escaped}"'


def fmu_flags(fmu: FmuFile, binary: bytes, drive: str = "", prefix: str = "FMU") -> tuple[str, ...]:
    """Return the flags that say which binary to load, and how."""
    return (
        text_flag(f"{prefix}_PATH", f"{drive}{stored(binary)}"),
        text_flag(f"{prefix}_TOKEN", fmu.token),
    )


def reference_flags(fmu: FmuFile, names: Mapping[str, str]) -> tuple[str, ...]:
    """Return the flags that define value references: end of a macro to the variable's name."""
    return tuple(f"-DREF_{macro}={fmu.reference(name)}" for macro, name in names.items())


def fmu_program(name: str, flags: Sequence[str], machine: Machine, what: str) -> Path:
    """Return a program of this room, compiled with the macros given."""
    sources = {each: (OWN_PROGRAMS / each).read_bytes() for each in (name, *OWN_HEADERS)}
    return machine.link([machine.compile(name, sources, (*machine.check_flags, *flags), what)], what)


class FmuCore:
    """One side of the law of a compensator's FMU."""

    def __init__(self, fmu: FmuFile, sign: int, binary: bytes, machine: Machine = FMU_HOST, drive: str = "") -> None:
        self._fmu, self._sign, self._binary, self._machine, self._drive = fmu, sign, binary, machine, drive

    @property
    def sha256(self) -> str:
        """SHA-256 of the binary."""
        return sha256_of(self._binary)

    def check(self, prepared: bytes, *, sample: bool = False) -> Findings:
        """Try what was prepared; a binary that refuses a call, crashes or hangs is a `RequirementError`."""
        ending, machine, what = ENDINGS[self._sign], self._machine, f"{self._fmu.name}"
        called = {"DZ_CORE": "comp", "DZ_STATUS": "status", "DZ_BETA": "beta"}
        names = tuple(f"-D{macro}=dz_{name}{ending}" for macro, name in called.items())
        flags = (*machine.check_flags, *names)
        own = {each: (OWN_PROGRAMS / each).read_bytes() for each in ("core_of_fmu.c", *OWN_HEADERS)}
        own["every_input.h"] = (PROGRAMS / "every_input.h").read_bytes()
        references = {
            "U_I_CODE": "u_i_code", "P_A_CODE": "p_A_code", "P_B_CODE": "p_B_code", "CODES": "codes",
            "COMPARE": f"compare{ending}", "STATUS": f"status{ending}", "BETA": f"beta{ending}",
        }  # fmt: skip
        of_fmu = (*fmu_flags(self._fmu, self._binary, self._drive), *reference_flags(self._fmu, references))
        check = {name: (PROGRAMS / name).read_bytes() for name in CHECK}
        objects = [machine.compile("core_of_fmu.c", own, (*flags, *of_fmu), f"the check of {what}")]
        objects += [
            machine.compile(name, check, flags, f"the check of {what}") for name in check if name.endswith(".c")
        ]
        program = machine.link(objects, f"the check of {what}")
        arguments = [f"{self._drive}{stored(prepared)}", *(["sample"] if sample else [])]
        found = results_of(machine, program, arguments, what, self._drive)
        return findings_of(found, self.sha256, f"{what} on the {machine.name}")
