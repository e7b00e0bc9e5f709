"""`Series`: pressure drops, ramps and their order, as a bench is to run them."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import MPA
from dzdesign.identify.planning.premises import Bench, ExpectedValve

#: Significant digits of a pressure drop between the ends of the range, and at them: a pilot series measured those.
DIGITS, END_DIGITS = 2, 3
#: Share of the threshold's whole change that is none: then the pressure drops are spread evenly.
EVEN = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """A series of ramps, each from zero to full command and back: T pressure drops, R ramps."""

    #: Pa, rising (T,).
    dp: np.ndarray
    #: Ramps of one direction take so long, and the pause between two ramps, s.
    ramp_time: float
    pause: float
    #: How often all pressure drops are run through.
    rounds: int
    #: Index of the pressure drop of each ramp, in the order of recording (R,).
    order: np.ndarray

    @property
    def duration(self) -> float:
        """Time that all ramps take, with the pauses, s."""
        return self.order.size * (2 * self.ramp_time + self.pause)

    @property
    def when(self) -> np.ndarray:
        """Time of the middle of each ramp, s from the beginning (R,)."""
        middle: np.ndarray = (np.arange(self.order.size) + 0.5) * (2 * self.ramp_time + self.pause)
        return middle

    @property
    def degrees(self) -> int:
        """Degrees of freedom that the repeats leave for the scatter, when thresholds and a drift are fitted."""
        tests = self.dp.size
        return int(self.order.size - tests - (tests > 1))


def lay_out_series(dp: np.ndarray, *, rounds: int, ramp_time: float, pause: float, seed: int) -> Series:
    """Return rounds of all pressure drops, each in a random order of its own, and the first one again at the end.

    Rounds keep the repeats of a pressure drop apart in time, and the closing repeat tells a drift from the pressure
    drop even in a single round. One pressure drop alone has no use for it.
    """
    rng = np.random.default_rng([seed, rounds, dp.size])
    order = np.concatenate([rng.permutation(dp.size) for _ in range(rounds)])
    if dp.size > 1:
        order = np.append(order, order[0])
    return Series(dp=dp, ramp_time=ramp_time, pause=pause, rounds=rounds, order=order)


def most_rounds(tests: int, budget: float, ramp_time: float, pause: float) -> int:
    """Return how many rounds fit in a time, s."""
    return (int(budget / (2 * ramp_time + pause)) - (tests > 1)) // tests


def place_pressures(valve: ExpectedValve, bench: Bench, low: float, high: float, count: int) -> np.ndarray:
    """Return pressure drops, Pa, where the steps of the staircase between them cost least.

    Equal steps of the threshold are best for a threshold that is known; the expected one is not, so half of the weight
    is on equal steps of the pressure drop. Those between the ends are round numbers.
    """
    if count == 1:
        return _rounded([high], END_DIGITS)
    dp = np.linspace(low, high, 1001)
    place = (dp - low) / (high - low)
    threshold = valve.threshold_at(dp)
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(threshold)))])
    if way[-1] > EVEN * bench.u_max:
        place = (place + way / way[-1]) / 2
    inner = np.interp(np.linspace(0, 1, count)[1:-1], place, dp)
    first, last = _rounded([low, high], END_DIGITS)
    return np.array([first, *_rounded(inner, DIGITS), last])


def _rounded(dp: Iterable[float], digits: int) -> np.ndarray:
    return np.array([float(f"{value / MPA:.{digits}g}") * MPA for value in dp])
