"""What the current controller makes of its codes, period by period: calibration first, then the exact controller."""

from collections import deque

import numpy as np

from dzdesign.design.current.drive import CurrentDrive
from dzdesign.verify.current.controller_states import (
    B,
    compared,
    exact_calibrations,
    exact_ticks,
    offset_names,
)


class ExactCurrent:
    """One controller with the codes of its current, of one shunt or two."""

    def __init__(self, drive: CurrentDrive, supply_code: int) -> None:
        self._loop, self._rest, self._supply = drive.loop, drive.rest_ticks, supply_code
        samples = drive.sampling.samples
        self._codes: deque[int] = deque([0] * samples, maxlen=samples)
        self._sums: list[int] = []
        self._ticks = 0
        self._state = dict.fromkeys(compared(self._loop), np.zeros(1, dtype=np.int64))

    def take(self, code: int, shunt: int = 0) -> None:
        """Take a code of the current of a shunt; one of the wrong shunt counts as 0."""
        half = len(self._sums) >> self._loop.offset_shift
        calibrated = len(self._sums) == self._loop.offset_ticks
        own = -self._state["on_b"][0] if calibrated and self._loop.two else half if not calibrated else 0
        self._codes.append(code if shunt == own % self._loop.shunts else 0)

    def is_calibrated(self) -> bool:
        """Go a period on without output; tell whether the offset of the current is known, and sound."""
        if len(self._sums) < self._loop.offset_ticks:
            self._ticks += 1
            if self._ticks > self._rest:
                self._sums.append(sum(self._codes))
        if len(self._sums) < self._loop.offset_ticks:
            return False
        found = exact_calibrations(self._loop, np.array([self._sums]), np.zeros(1, dtype=np.int64))
        self._state |= {name: found[name] for name in offset_names(self._loop)}
        return not found["faults"][0]

    def tick(self, *set_points: int) -> tuple[int, int]:
        """Return the compare values of a period whose set points are given; 0 before the offset is known."""
        if offset_names(self._loop)[0] not in self._state:
            return 0, 0
        given = {"set_points": set_points, "total": sum(self._codes), "supply_code": self._supply}
        had = self._state["on_b"][0] if self._loop.two else 0
        self._state |= exact_ticks(self._loop, self._state | {name: np.array([value]) for name, value in given.items()})
        compare = int(self._state["compare"][0])
        return (0, compare) if had == B else (compare, 0)
