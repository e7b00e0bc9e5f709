"""The generated core as a black box: compiled by itself for a machine, and every input tried there."""

import copy
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.evidence import InputCounts
from dzdesign.verify.toolchain.machines import HOST, PROGRAMS, Machine, stored

#: Source of each sign of command, and what its functions' names end with.
SOURCES = {1: ("dz_comp.c", ""), -1: ("dz_comp_negative.c", "_negative")}

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

    def __init__(self, folder: Path, sign: int = 1) -> None:
        self._name, self._ending = SOURCES[sign]
        self.sources = {name: _read(folder / "core" / name) for name in (self._name, "dz_comp.h")}
        self.sha256 = sha256_of(b"".join(self.sources.values()))

    def edited(self, name: str, text: bytes) -> "CompiledCore":
        """Return the core with another text in one of its files."""
        other = copy.copy(self)
        other.sources = {**self.sources, name: text}
        return other

    def compiled(self, machine: Machine = HOST) -> Path:
        """Return the core's object for a machine: compiled alone, so that nothing of it is inlined into the check."""
        return machine.compile(self._name, self.sources, machine.core_flags, f"the core {self._name}")

    def check(self, prepared: bytes, machine: Machine = HOST, *, sample: bool = False) -> Findings:
        """Try what was prepared on a machine; a core that does not compile, crashes or hangs: `RequirementError`."""
        core = self.compiled(machine)
        called = (f"-DDZ_{name.upper()}=dz_{name}{self._ending}" for name in ("status", "beta"))
        flags = (*machine.check_flags, f"-DDZ_CORE=dz_comp{self._ending}", *called)
        check = {name: _read(PROGRAMS / name) for name in (*CHECK, machine.main)} | machine.headers
        units = [name for name in check if name.endswith(".c")]
        objects = [core, *(machine.compile(name, check, flags, "the check") for name in units)]
        arguments = []
        if machine.section:
            text = f'{machine.section}\n.balign 8\n.global dz_prepared\ndz_prepared:\n.incbin "prepared.bin"\n'
            tables = {"prepared.S": text.encode(), "prepared.bin": prepared}
            objects.append(machine.compile("prepared.S", tables, machine.check_flags, "the prepared inputs"))
        else:
            file = stored(prepared)
            arguments = [str(file), *(["sample"] if sample else [])]
        program = machine.link(objects, f"the core {self._name} ({machine.name})")
        printed = machine.run(program, arguments, f"the core {self._name}")
        return _findings(printed, sha256_of(core.read_bytes()), f"the core {self._name} on the {machine.name}")


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can't be read: {error.strerror}; make it again with `dzdesign codegen`") from error


def _findings(printed: list[list[int]], object_sha256: str, what: str) -> Findings:
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
