"""Calls of an FMU one after the other, as data for a program of this room, and what each gave."""

import struct
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.verify.fmu.binary_core import FMU_HOST, fmu_flags, fmu_program
from dzdesign.verify.fmu.fmu_file import FmuFile
from dzdesign.verify.fmu.results import results_of
from dzdesign.verify.toolchain.machines import stored


class Call(IntEnum):
    """Kinds of calls, in the order of programs/calls.c."""

    SET_REAL = 0
    SET_INTEGER = 1
    SET_BOOLEAN = 2
    GET_REAL = 3
    GET_INTEGER = 4
    INITIALIZE = 5
    STEP = 6
    CONTINUE = 7
    EVENT = 8
    DISCRETE = 9
    STATE = 10
    STATES = 11
    RATES = 12
    INDICATORS = 13
    COMPLETED = 14
    TIME = 15


SETTERS = {"real": Call.SET_REAL, "integer": Call.SET_INTEGER, "boolean": Call.SET_BOOLEAN}
GETTERS = {"real": Call.GET_REAL, "integer": Call.GET_INTEGER}
#: Calls that give numbers.
GIVING = {Call.GET_REAL, Call.GET_INTEGER, Call.DISCRETE, Call.RATES, Call.INDICATORS}


@dataclass(slots=True)
class Calls:
    """Calls to be made of one instance."""

    fmu: FmuFile
    co_simulation: bool = False
    records: list[tuple[float, float, float, float]] = field(default_factory=list)

    def add(self, call: Call, reference: int = 0, value: float = 0.0, second: float = 0.0) -> None:
        """Add a call."""
        self.records.append((call, reference, value, second))

    def set(self, **values: float) -> None:
        """Set variables of any kind."""
        for name, value in values.items():
            self.add(SETTERS[self.fmu.variables[name].kind], self.fmu.reference(name), value)

    def get(self, *names: str) -> None:
        """Get variables of any kind but conditions."""
        for name in names:
            self.add(GETTERS[self.fmu.variables[name].kind], self.fmu.reference(name))

    def states(self, *values: float) -> None:
        """Set the continuous states."""
        for place, value in enumerate(values):
            self.add(Call.STATE, place, value)
        self.add(Call.STATES, len(values))

    def made(self, binary: bytes) -> list[list[float]]:
        """Make the calls and return the numbers that each gave which gives some, in order.

        Of an event: whether states changed, whether the next event is known, and its time. A call that fails is a
        `RequirementError`.
        """
        head = (float(len(self.records)), float(self.co_simulation), 0.0, 0.0)
        given = b"".join(struct.pack("<4d", *record) for record in (head, *self.records))
        what = f"the calls of {self.fmu.name}"
        program = fmu_program("calls.c", fmu_flags(self.fmu, binary), FMU_HOST, what)
        found = results_of(FMU_HOST, program, [str(stored(given))], what)
        kinds = [Call(int(record[0])) for record in self.records if int(record[0]) in GIVING]
        if len(found) != len(kinds):
            raise RequirementError(f"{what} gave {len(found)} results, expected {len(kinds)}")
        return [_numbers(kind, row) for kind, row in zip(kinds, found, strict=True)]


def _numbers(kind: Call, row: list[int]) -> list[float]:
    if kind is Call.GET_INTEGER:
        return [float(np.uint32(row[0]).view(np.int32))]
    if kind is Call.DISCRETE:
        return [float(row[0]), float(row[1]), *_reals(row[2:])]
    return _reals(row)


def _reals(bits: list[int]) -> list[float]:
    return np.array(bits, dtype=np.uint64).view(np.float64).tolist()  # type: ignore[no-any-return]
