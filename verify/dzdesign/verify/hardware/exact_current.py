"""What the current controller makes of its codes, period by period: calibration first, then the exact controller."""

from collections import deque

import numpy as np

from dzdesign.design.current.drive import CurrentDrive
from dzdesign.verify.current.controller_states import COMPARED, exact_calibrations, exact_ticks


class ExactCurrent:
    """One controller with the codes of its current."""

    def __init__(self, drive: CurrentDrive, supply_code: int) -> None:
        self._loop, self._rest, self._supply = drive.loop, drive.rest_ticks, supply_code
        self._codes: deque[int] = deque([0] * drive.sampling.samples, maxlen=drive.sampling.samples)
        self._sums: list[int] = []
        self._ticks = 0
        self._state = dict.fromkeys(COMPARED, np.zeros(1, dtype=np.int64))

    def take(self, code: int) -> None:
        """Take a code of the current."""
        self._codes.append(code)

    def is_calibrated(self) -> bool:
        """Go a period on without output; tell whether the offset of the current is known, and sound."""
        if len(self._sums) < 2**self._loop.offset_shift:
            self._ticks += 1
            if self._ticks > self._rest:
                self._sums.append(sum(self._codes))
        if len(self._sums) < 2**self._loop.offset_shift:
            return False
        offsets, faults = exact_calibrations(self._loop, np.array([self._sums]), np.zeros(1, dtype=np.int64))
        self._state |= {"offset": offsets}
        return not faults[0]

    def tick(self, set_point: int) -> int:
        """Return the compare value of a period whose set point is given; 0 before the offset is known."""
        if "offset" not in self._state:
            return 0
        given = {"set_point": set_point, "total": sum(self._codes), "supply_code": self._supply}
        self._state |= exact_ticks(self._loop, self._state | {name: np.array([value]) for name, value in given.items()})
        return int(self._state["compare"][0])
