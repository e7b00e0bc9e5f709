"""The generated core as a black box: compiled by itself for a machine, and every input tried there.

On this machine the check is a library around the core's object, on another one a program.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from dzdesign.core.documents import sha256_of, sha256_of_octets
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.evidence import InputCounts
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import (
    BLOCK_HEADER,
    HOST,
    PROGRAMS,
    VALVE_HEADER,
    Machine,
    block_of,
    bound_files,
)

#: Source of the law, and what the names of its functions end with, by the sign of command; and of the drive around it,
#: which the interrupt calls. An output with the law alone has none.
SOURCE, ENDINGS, DRIVE_SOURCE = "dz_comp.c", {1: "", -1: "_negative"}, "dz_drive.c"
#: What the check in C calls, and the core's functions of a side.
CALLED = {"DZ_CORE": "dz_comp", "DZ_STATUS": "dz_status", "DZ_BETA": "dz_beta"}
#: The check in C, of programs/; its functions.
CHECK = ("every_input.c", "other_codes.c", "called.h", "every_input.h", "march.h")
EVERYTHING = Function("dz_check_everything", ("in", "out", "out", "out"))
SAMPLE = Function("dz_check_sample", ("in", "out"))
#: The layouts of programs/every_input.h.
PARTS, TURNS = 8, 6
SCALARS = (
    "parts", "codes", "first_code", "code_step", "sound_from", "sound_to", "zero_place", "zero_code", "compare_limit",
    "a_low", "a_high", "b_low", "b_high", "reverse", "lowest", "safe_law", "safe_at_zero", "rows", "pairs",
    "places", "stride", "cube", "impatient", "laws_at", "rows_at", "directions_at", "slant_at", "pairs_at",
    "places_at", "betas_at", "tested_to", "dither_counts", "dither_ticks", "both", "leave_zero", "ramp_unit",
    "failed_status", "ahead_input", "behind_input", "other_input", "ahead_bit", "behind_bit", "other_bit",
    "unused",
)  # fmt: skip
PLAN = np.dtype([("denominator", "<i8", PARTS), ("part_end", "<i4", PARTS), *((name, "<i4") for name in SCALARS)])
PART = np.dtype([("remainder", "<i8"), ("carry", "<i8"), ("quotient", "<i4"), ("step", "<i4")])
ROW = np.dtype([("offset", "<i4"), ("b_low", "<u2"), ("pairs", "<u2"), ("first", "<u2"), ("law", "<u2")])
DIRECTION = np.dtype([("until", "<i4", TURNS), ("sign", "<i2", TURNS)])
PAIR = np.dtype([("a", "<u2"), ("b", "<u2"), ("sound", "<u2")])


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings(InputCounts):
    """What a machine found: `struct dz_findings`, and of which object."""

    #: Of the first wrong value.
    first_row: int
    first_place: int
    first_found: int
    first_expected: int
    #: Of all compare values in their order, 64 bits.
    outputs_hash: str
    #: Compare values at zero command, (D,), a difference each; empty of a sample, and where a simulator ran it.
    at_zero: np.ndarray
    object_sha256: str


#: What a program prints of an input check behind the two words of the hash, in this order; and `struct dz_findings`.
COUNTED = [field.name for field in fields(Findings)][:15]
FINDINGS = np.dtype([("hash", "<u8"), *((name, "<u4") for name in COUNTED), ("_", "<u4")])


class CompiledCore:
    """One side of the core."""

    def __init__(self, folder: Path, sign: int = 1, block: bytes | None = None) -> None:
        self.name, self._sign = SOURCE, sign
        #: Octets of the calibration block, by default the folder's own; None of a core with its valve's numbers in it.
        self.block = block_of(folder) if block is None else block
        driven = (folder / "core" / DRIVE_SOURCE).exists()
        self.units = (SOURCE, *([DRIVE_SOURCE] if driven else []))
        self._headers = ["dz_comp.h", BLOCK_HEADER, *(["dz_drive.h"] if driven else [])]
        named = [*self.units, *self._headers, *([VALVE_HEADER] if self.block is None else [])]
        self.sources = {name: _read(folder / "core" / name) for name in named}

    @property
    def sha256(self) -> str:
        """SHA-256 of the core's sources, and of its block."""
        return sha256_of(b"".join([*self.sources.values(), self.block or b""]))

    def edited(self, name: str, text: bytes) -> "CompiledCore":
        """Return the core with another text in one of its files."""
        other = copy.copy(self)
        other.sources = {**self.sources, name: text}
        return other

    def compiled(self, machine: Machine = HOST, name: str = SOURCE) -> Path:
        """Return an object of the core for a machine: compiled alone, so that nothing is inlined into the check."""
        headers = {each: text for each, text in self.sources.items() if each.endswith(".h")}
        return machine.compile(name, {**headers, name: self.sources[name]}, machine.core_flags, f"the core {name}")

    def check(self, prepared: bytes, machine: Machine = HOST, *, sample: bool = False) -> Findings:
        """Try what was prepared on a machine; a core that does not compile, crashes or hangs: `RequirementError`."""
        core, what = [self.compiled(machine, name) for name in self.units], f"the core {self.name}"
        flags = (*machine.check_flags, *(f"-D{name}={called}{ENDINGS[self._sign]}" for name, called in CALLED.items()))
        flags += (f"-DDZ_SIDE={self._sign}",) if DRIVE_SOURCE in self.units else ()
        headers = {name: self.sources[name] for name in self._headers} | machine.headers
        check = {name: _read(PROGRAMS / name) for name in (*CHECK, *filter(None, [machine.main]))}
        bound = {name: text.encode() for name, text in bound_files(self.block).items()}
        headers |= {name: text for name, text in (check | bound).items() if name.endswith(".h")}
        units = {name: text for name, text in (check | bound).items() if name.endswith(".c")}
        compiled = [machine.compile(name, {**headers, name: text}, flags, "the check") for name, text in units.items()]
        objects = [*core, *compiled]
        if not machine.main:
            counts, hashed, at_zero = _tried(objects, machine, prepared, what, sample=sample)
        else:
            objects.append(embedded(machine, "prepared", machine.section, prepared))
            printed = machine.run(machine.link(objects, f"{what} ({machine.name})"), [], what)
            counts, hashed = counts_in(printed, f"{what} on the {machine.name}")
            at_zero = np.zeros(0, dtype=np.int64)
        digest = sha256_of_octets(b"".join(each.read_bytes() for each in core))
        return Findings(outputs_hash=f"{hashed:016x}", at_zero=at_zero, object_sha256=digest, **counts)


def _tried(
    objects: Sequence[Path], machine: Machine, prepared: bytes, what: str, *, sample: bool
) -> tuple[dict[str, int], int, np.ndarray]:
    """Return counts, the hash and the values at zero command that the check finds on this machine."""
    library = CompiledLibrary({}, [EVERYTHING, SAMPLE], what, machine.link_flags, objects)
    plan, found = np.frombuffer(prepared, dtype=PLAN, count=1)[0], np.zeros(1, dtype=FINDINGS)
    at_zero = np.zeros(0 if sample else int(plan["rows"]), dtype="<u2")
    work = np.zeros(3 * int(plan["codes"]), dtype="<u2")
    name, buffers = (SAMPLE.name, (found,)) if sample else (EVERYTHING.name, (work, at_zero, found))
    library.call(name, prepared, *buffers, timeout_s=machine.run_timeout_s)
    return {name: int(found[name][0]) for name in COUNTED}, int(found["hash"][0]), at_zero.astype(np.int64)


def embedded(machine: Machine, name: str, section: str, content: bytes) -> Path:
    """Return an object that holds some octets as the symbol dz_<name>."""
    text = f'{section}\n.balign 8\n.global dz_{name}\ndz_{name}:\n.incbin "{name}.bin"\n'
    files = {f"{name}.S": text.encode(), f"{name}.bin": content}
    return machine.compile(f"{name}.S", files, machine.check_flags, f"the {name}")


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can't be read: {error.strerror}; make it again with `dzdesign codegen`") from error


def counts_in(printed: list[list[int]], what: str) -> tuple[dict[str, int], int]:
    """Return the counts and the hash that a program of the check printed; other numbers are a `RequirementError`."""
    if not printed or len(printed[0]) != 2 + len(COUNTED):
        found = printed[0][:3] if printed else "nothing"
        raise RequirementError(f"{what} reported {found}, expected {2 + len(COUNTED)} numbers")
    high, low, *counts = printed[0]
    return dict(zip(COUNTED, counts, strict=True)), high << 32 | low
