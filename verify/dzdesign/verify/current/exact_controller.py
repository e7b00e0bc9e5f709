"""What the current controller must do, in rational numbers: no code of the generated C.

Written from what a PI controller with feed-forward, limit and anti-windup is, not from the template: the integral is a
number of PWM counts of either sign, and a fault is a set of conditions.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import floor

import numpy as np

from dzdesign.design.current.circuit import CORRECTION_SHIFT, CurrentLoop

HALF = Fraction(1, 2)
#: Bits of the faults.
NO_OFFSET, SENSOR, OPEN, SHORT, OVER = (1 << place for place in range(5))
#: State and inputs of a period as columns of whole numbers; the integral is over 2^gain_shift and has a sign.
Columns = Mapping[str, np.ndarray]


@dataclass
class ExactController:
    """One controller: its state, and what it puts out after each period of the PWM."""

    loop: CurrentLoop
    #: PWM counts; from where the output stands when it is released.
    integral: Fraction = field(default_factory=Fraction)
    compare: int = 0
    faults: int = NO_OFFSET
    over_ticks: int = 0
    open_ticks: int = 0
    #: The set point that it follows.
    ramped: int = 0
    offset: int = -1
    sums: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.offset < 0:
            self.offset = self.loop.offset_nominal

    def calibrate(self, total: int) -> None:
        """Take one of the sums without current."""
        if len(self.sums) == 1 << self.loop.offset_shift:
            return
        self.sums.append(total)
        if len(self.sums) == 1 << self.loop.offset_shift:
            self.offset = floor(Fraction(sum(self.sums), len(self.sums)) + HALF)
            self.faults &= ~NO_OFFSET
            if abs(self.offset - self.loop.offset_nominal) > self.loop.offset_tolerance:
                self.faults |= SENSOR

    def tick(self, set_point: int, total: int, supply_code: int = 0) -> None:
        """Go on by a period of the PWM."""
        loop = self.loop
        above = max(total - self.offset, 0)
        self.ramped += min(max(set_point - self.ramped, -loop.rate), loop.rate)
        error = self.ramped - floor(Fraction(loop.current_gain * above, 1 << loop.current_shift) + HALF)
        self._detect(total, above)
        gain = {name: Fraction(getattr(loop, name), 1 << loop.gain_shift) for name in ("proportional", "integral")}
        feed_forward = Fraction(loop.feed_forward, 1 << loop.gain_shift) * self.ramped
        asked = self.integral - loop.release + gain["proportional"] * error + feed_forward
        counts = self._corrected(floor(max(asked, Fraction(0)) + HALF), supply_code)
        winds_up = (counts > loop.compare_limit and error > 0) or (asked < 0 and error < 0)
        if not winds_up:
            moved = self.integral + gain["integral"] * error
            self.integral = min(max(moved, Fraction(-loop.integral_limit)), Fraction(loop.integral_limit))
        self.compare = min(counts, loop.compare_limit)
        if set_point == 0 or self.faults:
            self.compare, self.integral, self.ramped = 0, Fraction(0), 0

    def _detect(self, total: int, above: int) -> None:
        loop = self.loop
        if total >= loop.short_sum:
            self.faults |= SHORT
        self.over_ticks = self.over_ticks + 1 if above >= loop.over_sum else 0
        dead = above < loop.open_sum and self.compare >= loop.open_compare
        self.open_ticks = self.open_ticks + 1 if dead else 0
        if self.over_ticks >= loop.over_ticks:
            self.faults |= OVER
        if self.open_ticks >= loop.open_ticks:
            self.faults |= OPEN

    def _corrected(self, counts: int, supply_code: int) -> int:
        supply = self.loop.supply
        if supply is None:
            return counts
        low, high = supply.valid_codes
        node, past = divmod(min(max(supply_code, low), high) - low, supply.step_codes)
        left, right = supply.nodes[node], supply.nodes[node + 1]
        factor = floor(left + Fraction(past, supply.step_codes) * (right - left))
        return floor(Fraction(min(counts, 65535) * factor, 1 << CORRECTION_SHIFT) + HALF)


def exact_ticks(loop: CurrentLoop, given: Columns) -> dict[str, np.ndarray]:
    """Return what a period makes of many states at once, in whole numbers over the gains' denominator.

    `given` and what is returned have the names of `ExactController`'s state, and `given` those of `tick`'s arguments.
    """
    unit = 1 << loop.gain_shift
    above = np.maximum(given["total"] - given["offset"], 0)
    aim = given["ramped"] + np.clip(given["set_point"] - given["ramped"], -loop.rate, loop.rate)
    error = aim - _rounded(loop.current_gain * above, 1 << loop.current_shift)
    too_high, dead = above >= loop.over_sum, (above < loop.open_sum) & (given["compare"] >= loop.open_compare)
    over_ticks = np.where(too_high, given["over_ticks"] + 1, 0)
    open_ticks = np.where(dead, given["open_ticks"] + 1, 0)
    faults = given["faults"].copy()
    for bit, stands in (
        (SHORT, given["total"] >= loop.short_sum),
        (OVER, over_ticks >= loop.over_ticks),
        (OPEN, open_ticks >= loop.open_ticks),
    ):
        faults |= np.where(stands, bit, 0)
    asked = given["integral"] - loop.release * unit + loop.proportional * error + loop.feed_forward * aim
    counts = _corrected(loop, _rounded(np.maximum(asked, 0), unit), given["supply_code"])
    winds_up = ((counts > loop.compare_limit) & (error > 0)) | ((asked < 0) & (error < 0))
    end = loop.integral_limit * unit
    moved = np.clip(given["integral"] + loop.integral * error, -end, end)
    off = (given["set_point"] == 0) | (faults != 0)
    return {
        "integral": np.where(off, 0, np.where(winds_up, given["integral"], moved)),
        "compare": np.where(off, 0, np.minimum(counts, loop.compare_limit)),
        "faults": faults,
        "over_ticks": over_ticks,
        "open_ticks": open_ticks,
        "ramped": np.where(off, 0, aim),
    }


def _rounded(numerator: np.ndarray, denominator: int) -> np.ndarray:
    return (2 * numerator + denominator) // (2 * denominator)


def _corrected(loop: CurrentLoop, counts: np.ndarray, supply_code: np.ndarray) -> np.ndarray:
    supply = loop.supply
    if supply is None:
        return counts
    node, past = np.divmod(np.clip(supply_code, *supply.valid_codes) - supply.valid_codes[0], supply.step_codes)
    nodes = np.array(supply.nodes, dtype=np.int64)
    factor = (nodes[node] * (supply.step_codes - past) + nodes[node + 1] * past) // supply.step_codes
    return _rounded(np.minimum(counts, 65535) * factor, 1 << CORRECTION_SHIFT)
