"""A recording that is a copy of another, found by its samples: saved again, in other units, decimated, shifted or cut.

The rule. The samples of both are laid over each other, where the command comes through the same point of a ramp, and
compared where the flow is large. A copy has the same command, flow and pressure drop in all but `SPOILT` of these
samples, within the rounding of the coarser one: to the digit where both are written in the same steps. In a true repeat
the valve opens elsewhere. If it did so by `LEAST_SHIFT` of full command only, the flow gain and the steps of the flow
tell how many samples would differ. Where that many could be missed by a chance of more than `CHANCE`, as in a table of
ten coarse readings, nothing is said. A copy whose samples are others, such as means of ten, is not found here: see
`knees.scatter_checks`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dzdesign.identify.reading.ramp_test import RampTest

#: The flow is large above this share of the largest one.
LARGE_FLOW = 0.05
#: Share of the samples that a copy may have lost or changed: a spike that was taken out.
SPOILT = 1e-3
#: Shift of the thresholds, over the largest command, that two repeats of a valve show at least.
LEAST_SHIFT = 1e-4
#: Probability that a repeat with this shift is taken for a copy.
CHANCE = 1e-3
#: What is in both has so many samples at least, whose commands differ by this share of the largest one.
FEWEST, SAME_RANGE = 20, 0.25
#: Samples whose flow is compared first, how many of them must be in both, and the share that must agree.
FIRST_LOOK, FIRST_FEWEST, FIRST_AGREE = 256, 5, 0.9
#: Differences below this share of a step, or below this share of the largest number, are none.
SAME_STEP, ROUNDING = 1e-3, 1e-7
#: Share of a step that what agrees may lie off it.
MARGIN = 1e-3
#: Share by which two level channels of one recording differ at most.
LEVEL = 0.01
#: Shares of the largest command between which it goes on a ramp.
LOW, HIGH = 0.25, 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """Two recordings, by number, the later one a copy of the earlier one or of a part of it."""

    one: int
    other: int
    #: Samples that were compared, and those of them that agree.
    compared: int
    agree: int
    #: First and last time that is in both, on the clock of the later one, s.
    from_s: float
    to_s: float


def find_copy(tests: Sequence[RampTest]) -> Copy | None:
    """Return the first recording that is a copy of an earlier one, or of a part of it; None where none is."""
    traces = [_Trace(test) for test in tests]
    for other, late in enumerate(traces):
        for one, early in enumerate(traces[:other]):
            for known, compared in _both_ways(early, late):
                for shift in _likely_shifts(known, compared):
                    rows = _in_both(known, compared, shift)
                    agree = int(np.count_nonzero(_agrees(known, compared, shift, rows, channels=3)))
                    if _is_copy(known, compared, rows, agree):
                        ahead = shift if late is known else 0.0
                        return Copy(
                            one=one, other=other, compared=rows.size, agree=agree,
                            from_s=float(max(compared.time[0], known.time[0] - shift) + ahead),
                            to_s=float(min(compared.time[-1], known.time[-1] - shift) + ahead),
                        )  # fmt: skip
    return None


class _Trace:
    """A recording as it is compared: flow, command and, if it was recorded, pressure drop over time."""

    def __init__(self, test: RampTest) -> None:
        self.time = test.time
        self.channels = [test.q, test.u, *([] if test.dp is None or test.dp_is_declared else [test.dp])]
        self.top = float(np.abs(test.u).max(initial=0.0))

    @cached_property
    def dt(self) -> float:
        """Time between two samples, s; 0 if the clock stands still."""
        steps = np.diff(self.time)
        steps = steps[steps > 0]
        return float(np.median(steps)) if steps.size else 0.0

    @cached_property
    def steps(self) -> list[float]:
        """Step of each channel, as it was written."""
        return [_step(channel) for channel in self.channels]

    @cached_property
    def flowing(self) -> np.ndarray:
        """Numbers of the samples whose flow is large."""
        size = np.abs(self.channels[0])
        found: np.ndarray = np.flatnonzero(size > LARGE_FLOW * float(size.max(initial=0.0)))
        return found

    def crossings(self, top: float) -> np.ndarray:
        """Return times at which the command, from below a quarter of that, reaches three quarters, or the reverse."""
        size = np.abs(self.channels[1])
        level = np.where(size > HIGH * top, 1, np.where(size < LOW * top, -1, 0))
        known = np.flatnonzero(level)
        found: np.ndarray = self.time[known[1:][np.diff(level[known]) != 0]]
        return found


def _step(channel: np.ndarray) -> float:
    """Return the largest step of which all differences of a channel's numbers are multiples (Euclid); 0 if it is level.

    Numbers without a step have one that is rounding.
    """
    least = ROUNDING * float(np.abs(channel).max(initial=0.0))
    gaps = np.diff(np.unique(channel))
    gaps = gaps[gaps > least]
    step = 0.0
    while gaps.size:
        step = float(gaps.min())
        rest = np.abs(gaps - step * np.round(gaps / step))
        gaps = rest[rest > max(SAME_STEP * step, least)]
    return step


def _both_ways(early: _Trace, late: _Trace) -> list[tuple[_Trace, _Trace]]:
    """Return which of two recordings is compared with the other, interpolated at its times: the shorter one first."""
    if not (early.dt > 0 and late.dt > 0) or len(early.channels) != len(late.channels):
        return []
    ways = [(early, late), (late, early)]
    if late.time.size > early.time.size:
        ways.reverse()
    return ways if abs(early.dt - late.dt) > MARGIN * early.dt else ways[:1]


def _likely_shifts(known: _Trace, compared: _Trace) -> Iterator[float]:
    """Yield by how much the clock of the first may be ahead, s, where the flows agree at the first look."""
    shifts = np.array(list(_shifts(known, compared)))
    rows = compared.flowing
    if rows.size < FEWEST:
        return
    rows = rows[np.linspace(0, rows.size - 1, min(FIRST_LOOK, rows.size)).astype(int)]
    in_both = _lies_within(known, compared.time[rows] + shifts[:, None])
    agree = in_both & _agrees(known, compared, shifts[:, None], rows, channels=1)
    looked = in_both.sum(axis=1)
    yield from shifts[(looked >= FIRST_FEWEST) & (agree.sum(axis=1) >= FIRST_AGREE * looked)].tolist()


def _shifts(known: _Trace, compared: _Trace) -> Iterator[float]:
    """Yield by how much the clock of the first may be ahead, s: as they are, and from ramp to ramp.

    A part of a recording begins with one of its ramps. Noise moves a crossing by samples of the coarser one.
    """
    yield 0.0
    top = min(known.top, compared.top)
    one, other = known.crossings(top), compared.crossings(top)
    if not (one.size and other.size):
        return
    ahead = np.concatenate([one[0] - other, one[1:] - other[0]])
    finer, coarser = sorted((known.dt, compared.dt))
    reach = math.ceil(coarser / finer) + 1
    for near in sorted(range(-reach, reach + 1), key=abs):
        yield from ahead + near * finer


def _lies_within(known: _Trace, time: np.ndarray) -> np.ndarray:
    slack = MARGIN * known.dt
    found: np.ndarray = (time >= known.time[0] - slack) & (time <= known.time[-1] + slack)
    return found


def _in_both(known: _Trace, compared: _Trace, shift: float) -> np.ndarray:
    """Return the numbers of the samples with a large flow whose times the other one has too."""
    rows = compared.flowing
    found: np.ndarray = rows[_lies_within(known, compared.time[rows] + shift)]
    return found


def _agrees(known: _Trace, compared: _Trace, shift: float | np.ndarray, rows: np.ndarray, channels: int) -> np.ndarray:
    """Tell of each of these samples whether it is the same in both: at the nearest time, or between two.

    So many of the channels are compared: flow, command, pressure drop.
    """
    time = compared.time[rows] + shift
    after = np.clip(np.searchsorted(known.time, time), 1, known.time.size - 1)
    nearest = after - (time - known.time[after - 1] < known.time[after] - time)
    same = np.ones(time.shape, dtype=bool)
    for number, one in enumerate(known.channels[:channels]):
        other = compared.channels[number]
        step = max(known.steps[number], compared.steps[number])
        # What was rounded lies within half a step; a pressure drop is the difference of two such columns. Of two level
        # ones it is not known how they were rounded.
        tolerance = (0.5 + MARGIN) * step * (2 if number == 2 else 1) if step else LEVEL * float(np.abs(other).max())
        between = np.interp(time, known.time, one)
        same &= np.minimum(np.abs(one[nearest] - other[rows]), np.abs(between - other[rows])) <= tolerance
    return same


def _is_copy(known: _Trace, compared: _Trace, rows: np.ndarray, agree: int) -> bool:
    """Tell whether so many samples agree that no repeat of a valve would have them."""
    from scipy.special import pdtr

    spoilt = int(SPOILT * rows.size)
    if rows.size < FEWEST or agree < rows.size - spoilt:
        return False
    q, u = (np.abs(channel[rows]) for channel in compared.channels[:2])
    if np.ptp(u) < SAME_RANGE * compared.top:
        return False
    # So many samples would differ, each by itself, if the thresholds were shifted by the least that repeats show.
    step = max(known.steps[0], compared.steps[0])
    by_shift = float(np.ptp(q) / np.ptp(u)) * LEAST_SHIFT * compared.top
    differing = rows.size * min(by_shift / step, 1.0) if step > 0 else 0.0
    return bool(pdtr(spoilt, differing) < CHANCE)
