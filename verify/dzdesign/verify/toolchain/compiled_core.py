"""The generated core as a black box: compiled by itself for a machine, and every input tried there."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from dzdesign.core.artefact_files import sha256_of, sha256_of_octets
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.evidence import InputCounts
from dzdesign.verify.toolchain.machines import (
    BLOCK_HEADER,
    HOST,
    PROGRAMS,
    VALVE_HEADER,
    Machine,
    block_of,
    stored,
)

#: Source of the law, and what the names of its functions end with, by the sign of command.
SOURCE, ENDINGS = "dz_comp.c", {1: "", -1: "_negative"}
#: In programs/, what binds a core in block form to a block.
BOUND = "bound_block.c"
#: The core's functions that a check calls, dz_comp() and so on.
CALLED = ("comp", "status", "beta")
#: The check in C, of programs/.
CHECK = ("every_input.c", "other_codes.c", "every_input.h", "march.h")



@dataclass(frozen=True, slots=True, kw_only=True)
class Findings(InputCounts):
    """What a machine found: the counts of programs/every_input.h, in their order, and of which object."""

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


#: What a program prints of an input check behind the two words of the hash, in this order.
COUNTED = [field.name for field in fields(Findings)][:15]


class CompiledCore:
    """One side of the core."""

    def __init__(self, folder: Path, sign: int = 1, block: bytes | None = None) -> None:
        self.name, self._ending = SOURCE, ENDINGS[sign]
        #: Octets of the calibration block, by default the folder's own; None of a core with its valve's numbers in it.
        self.block = block_of(folder) if block is None else block
        headers = ["dz_comp.h", BLOCK_HEADER, *([VALVE_HEADER] if self.block is None else [])]
        self.sources = {name: _read(folder / "core" / name) for name in (self.name, *headers)}

    @property
    def sha256(self) -> str:
        """SHA-256 of the core's sources, and of its block."""
        return sha256_of(b"".join([*self.sources.values(), self.block or b""]))

    def edited(self, name: str, text: bytes) -> "CompiledCore":
        """Return the core with another text in one of its files."""
        other = copy.copy(self)
        other.sources = {**self.sources, name: text}
        return other

    def compiled(self, machine: Machine = HOST) -> Path:
        """Return the core's object for a machine: compiled alone, so that nothing of it is inlined into the check."""
        return machine.compile(self.name, self.sources, machine.core_flags, f"the core {self.name}")

    def check(self, prepared: bytes, machine: Machine = HOST, *, sample: bool = False) -> Findings:
        """Try what was prepared on a machine; a core that does not compile, crashes or hangs: `RequirementError`."""
        core = self.compiled(machine)
        names = [f"dz_{name}{self._ending}" for name in CALLED]
        objects, held = [core], self.block is not None and not machine.section
        if self.block is not None:
            objects.append(self._adapter(machine, names, held))
            names = [f"dz_bound_{name}" for name in CALLED]
        flags = (*machine.check_flags, *_defines(held, ("DZ_CORE", "DZ_STATUS", "DZ_BETA"), names))
        check = {name: _read(PROGRAMS / name) for name in (*CHECK, machine.main)} | machine.headers
        units = [name for name in check if name.endswith(".c")]
        objects += [machine.compile(name, check, flags, "the check") for name in units]
        arguments = []
        if machine.section:
            objects.append(embedded(machine, "prepared", machine.section, prepared))
            if self.block is not None:
                objects.append(embedded(machine, "block", machine.block_section, self.block))
        else:
            blocks = [str(stored(self.block))] if self.block is not None else []
            arguments = [str(stored(prepared)), *(["sample"] if sample else []), *blocks]
        program = machine.link(objects, f"the core {self.name} ({machine.name})")
        printed = machine.run(program, arguments, f"the core {self.name}")
        return findings_of(printed, sha256_of_octets(core.read_bytes()), f"the core {self.name} on the {machine.name}")

    def _adapter(self, machine: Machine, names: Sequence[str], held: bool) -> Path:
        """Return the object that binds the core's functions of a side to a block."""
        sources = {**self.sources, BOUND: _read(PROGRAMS / BOUND)}
        flags = (*machine.check_flags, *_defines(held, ("DZ_COMP", "DZ_STATUS", "DZ_BETA"), names))
        return machine.compile(BOUND, sources, flags, "the adapter of the block")


def _defines(held: bool, macros: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Return the flags that name the functions to call; `held` is a block that comes from a file."""
    called = (f"-D{macro}={name}" for macro, name in zip(macros, names, strict=True))
    return (*called, *(["-DDZ_HELD"] if held else []))


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


def findings_of(printed: list[list[int]], object_sha256: str, what: str) -> Findings:
    """Return the findings that a program of the check printed; other numbers are a `RequirementError`."""
    if not printed or len(printed[0]) != 2 + len(COUNTED):
        found = printed[0][:3] if printed else "nothing"
        raise RequirementError(f"{what} reported {found}, expected {2 + len(COUNTED)} numbers")
    high, low, *counts = printed[0]
    return Findings(
        outputs_hash=f"{high:08x}{low:08x}",
        at_zero=np.array(printed[1] if len(printed) > 1 else [], dtype=np.int64),
        object_sha256=object_sha256,
        **dict(zip(COUNTED, counts, strict=True)),
    )
