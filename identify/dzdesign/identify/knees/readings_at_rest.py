"""What flows, or is read, at zero command: the meter's zero error, the same at every pressure, and a leak, which grows.

A leak through the overlap is laminar, so it is proportional to the pressure drop. Whether it goes on beside the main
flow once the valve is open, the recordings can't tell: subtracted though it stops, it puts the knee too high by the
leak over the flow gain. So the leak is subtracted, the knees are those of the flow beyond it, and the bounds are
lowered by what they would be without.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.branches import median
from dzdesign.identify.reading.ramp_test import RampTest, once_a_recording

#: Commands within this share of u_max are at rest; a wider one is taken where so few readings would be left.
AT_REST, FEWEST_AT_REST = (0.01, 0.03, 0.1), 20
#: Share of the largest flow that is a flow for certain, and share of the command there that lies far below it.
FIRST_FLOW, FAR_BELOW = 0.2, 0.5
#: Share of the largest flow, and standard deviations, that a flow at rest exceeds for certain that another cause moves.
MOVED, MOVED_ERRORS = 0.1, 10.0
#: Standard errors by which a reading at rest must differ from zero, and share of the largest flow: below, it is none.
ZERO_ERRORS, ZERO_SHARE = 5.0, 2e-3
#: Pressure drops at rest that differ by more than this factor are two.
TWO_PRESSURES = 1.1
#: Share of the squares of the readings at rest about their mean that a leak must explain, and its standard errors.
EXPLAINED, LEAK_ERRORS = 0.5, 4.0
#: Share of the readings at rest that are one number, from which that hides noise, and from which it hides the zero.
#: Flows over the largest at which the noise is looked at, and its least size over a step of the readings, the largest
#: flow, and that at middle flow: less is a simulation's, or the flow's own.
HIDES_NOISE, HIDES_ALL = 0.6, 0.95
LOW_FLOW, MIDDLE_FLOW, FEWEST_AT_FLOW = (0.02, 0.1), (0.3, 0.6), 40
NOISE_OVER_STEP, NOISE_OVER_FLOW, NOISE_OVER_MIDDLE = 0.5, 5e-5, 0.2
#: Readings below this share of those at rest, of which so many follow each other and differ, are of a flow that was
#: below zero and lost its sign. They are means over the fewest of these numbers of rows whose noise at rest leaves so
#: many standard deviations between the two.
DIP, DIP_SIGMAS, FEWEST_DIPS, ROWS = 0.6, 5.0, 2, (1, 4, 9, 16, 25, 36)
#: One meter has one zero: what more than a third of the recordings show counts. A steep ramp hides a dip.
SHOWN_BY = 2 / 3
#: Share of the readings up to twice a meter's floor that may lie below so much of it: with more it hides none.
BELOW_FLOOR, OF_FLOOR = 0.1, 0.75
#: Zero error of a meter that may stay hidden: 0.5 % of a range of ten times the largest flow, as data sheets have it.
HIDDEN_ZERO = 0.05
#: Blocks of the readings at rest, in the order of time, whose means say how coloured their noise is.
BLOCKS = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class RestFlows:
    """What is to be subtracted from the flow of each recording, m³/s: a number, or one for each sample."""

    flows: tuple[float | np.ndarray, ...]
    #: By source: the meter's zero error in it, 0 if it does not stand out; standard error of what is subtracted; m³/s.
    zero: dict[str, float]
    se: dict[str, float]
    #: Leak over the pressure drop, m³/(s Pa); 0 where there is none.
    leak_per_Pa: float
    #: The same whether or not it stands out, and its standard error; None where one pressure drop can't tell it.
    growth_per_Pa: tuple[float, float] | None
    #: By source: what was subtracted beside the leak, whether or not it stands out; and the least reading at rest of
    #: all recordings, m³/s.
    beside: dict[str, float]
    least: float

    def passed_by_the_valve(self, sources: Sequence[str], dp: float | None) -> tuple[float, float]:
        """Return what the shut valve itself may pass of the flow that was subtracted, and its standard error, m³/s.

        A meter's zero and a leak are told apart by the pressure drop alone: at a single one all that was read is
        counted. One meter has one zero, and no leak flows backwards, so what a recording reads beyond the least of all
        is a leak however it grows: a meter with a floor shows that of high pressure drops only.
        """
        beside = max(self.beside.get(source, 0.0) for source in sources)
        if not self.leak_per_Pa and not any(self.beside.get(source, 0.0) for source in sources):
            return 0.0, 0.0  # nothing was subtracted, so all of it is in the readings
        se = max(self.se.get(source, 0.0) for source in sources)
        if self.growth_per_Pa is None or dp is None:
            return max(0.0, beside), se
        growth, error = self.growth_per_Pa
        return max(growth * dp, beside + self.leak_per_Pa * dp - self.least, 0.0), max(error * dp, se)


@dataclass(frozen=True, slots=True)
class _Rest:
    """Readings at rest of one recording at one pressure drop: its median and that one's standard error, m³/s."""

    recording: int
    dp: float
    flow: float
    se: float
    #: Variance of the means of their blocks over what white noise would give them.
    colour: float


def find_rest_flows(tests: Sequence[RampTest], u_max: float) -> RestFlows:
    """Find what recordings read at zero command, and what of it grows with the pressure drop."""
    at_rest = [readings_at_rest(test, u_max) for test in tests]
    levels = [level for number, test in enumerate(tests) for level in _levels(number, test, at_rest[number])]
    largest = max(float(np.abs(test.q).max()) for test in tests)
    growth = _growth(levels, largest)
    leak = _leak(growth, levels, largest)
    flows: list[float | np.ndarray] = []
    zeros: dict[str, float] = {}
    beside: dict[str, float] = {}
    errors: dict[str, float] = {}
    for number, test in enumerate(tests):
        own = [level for level in levels if level.recording == number]
        zero, se = _zero_beside(leak, test, own, at_rest[number])
        errors[test.source] = se
        # Beside a leak the zero is what a line extrapolates to no pressure, about twice as far off.
        told = abs(zero) > max(2 * ZERO_ERRORS * se, ZERO_SHARE * float(np.abs(test.q).max()))
        zeros[test.source] = zero if told or not leak else 0.0
        beside[test.source] = zero
        flows.append(zero if leak == 0 or test.dp is None else zero + leak * test.dp)
    return RestFlows(
        flows=tuple(flows), zero=zeros, se=errors, leak_per_Pa=leak,
        growth_per_Pa=(growth.per_Pa, growth.error) if growth else None,
        beside=beside, least=min((level.flow for level in levels), default=0.0),
    )  # fmt: skip


def _zero_beside(leak: float, test: RampTest, levels: Sequence[_Rest], at_rest: np.ndarray) -> tuple[float, float]:
    """Return what the meter reads at zero command beside a leak (m³/(s Pa)), and its standard error, m³/s.

    Thousands of readings at rest tell it far better than any declared bound; zeros where it does not stand out.
    """
    if leak > 0 and levels:
        zero = float(np.mean([level.flow - leak * level.dp for level in levels]))
        return zero, max(level.se for level in levels)
    rest = test.q[at_rest]
    if rest.size < FEWEST_AT_REST:
        return 0.0, 0.0
    zero, error = median(rest), _error_of_median(rest)
    stands_out = abs(zero) > max(ZERO_ERRORS * error, ZERO_SHARE * float(np.abs(test.q).max()))
    return (zero, error) if stands_out else (0.0, 0.0)


def _levels(number: int, test: RampTest, at_rest: np.ndarray) -> Iterator[_Rest]:
    """Yield what a recording reads at rest, at each of its pressure drops."""
    if test.dp is None:
        return
    rows = at_rest[test.dp[at_rest] > 0]
    order = rows[np.argsort(test.dp[rows], kind="stable")]
    jumps = np.flatnonzero(test.dp[order][1:] > TWO_PRESSURES * test.dp[order][:-1]) + 1
    for part in np.split(order, jumps):
        if part.size < FEWEST_AT_REST:
            continue
        q = test.q[np.sort(part)]
        blocks = np.array([block.mean() for block in np.array_split(q, BLOCKS)])
        white = robust_sigma(q) ** 2 * BLOCKS / q.size
        colour = float(np.var(blocks, ddof=1) / white) if white > 0 else 1.0
        yield _Rest(number, median(test.dp[part]), median(q), _error_of_median(q), colour)


@dataclass(frozen=True, slots=True)
class _Growth:
    """By how much the readings at rest grow with the pressure drop, m³/(s Pa)."""

    per_Pa: float
    #: Standard error by the readings' noise, and with what they depart from the line.
    noise: float
    error: float
    #: Share of the squares of the readings about their mean that it explains.
    explained: float


def _growth(levels: Sequence[_Rest], largest: float) -> _Growth | None:
    """Return by how much the readings at rest grow with the pressure drop; None where one pressure drop was recorded.

    Weighted least squares of a zero error that is common to all, and a leak proportional to the pressure drop.
    """
    if len(levels) < 2:
        return None
    dp, flow, se = (np.array([getattr(level, name) for level in levels]) for name in ("dp", "flow", "se"))
    if dp.max() <= TWO_PRESSURES * dp.min():
        return None
    # One meter, so one colour; readings without noise are taken to be as fine as no meter is.
    se = np.maximum(se * math.sqrt(max(1.0, float(np.median([level.colour for level in levels])))), 1e-6 * largest)
    weight = se**-2.0
    away, rise = dp - np.average(dp, weights=weight), flow - np.average(flow, weights=weight)
    squares = float(np.sum(weight * away**2))
    growth = float(np.sum(weight * away * rise)) / squares
    every, left = float(np.sum(weight * rise**2)), float(np.sum(weight * (rise - growth * away) ** 2))
    noise = 1 / math.sqrt(squares)
    scatter = math.sqrt(max(1.0, left / (len(levels) - 2))) if len(levels) > 2 else 1.0
    return _Growth(growth, noise, noise * scatter, growth**2 * squares / every if every > 0 else 0.0)


def _leak(growth: _Growth | None, levels: Sequence[_Rest], largest: float) -> float:
    """Return the leak, m³/(s Pa); 0 if the growth does not stand out."""
    if growth is None:
        return 0.0
    dp = [level.dp for level in levels]
    stands_out = growth.per_Pa > LEAK_ERRORS * growth.noise
    worth_it = growth.per_Pa * (max(dp) - min(dp)) > ZERO_SHARE * largest
    return growth.per_Pa if growth.explained >= EXPLAINED and stands_out and worth_it else 0.0


@once_a_recording
def readings_at_rest(test: RampTest, u_max: float) -> np.ndarray:
    """Return which readings are taken where the command rests, in order; fewer than `FEWEST_AT_REST` if nowhere.

    Of the hold before the first ramp only the later half counts, and none of it if it still drifts: hoses and meter may
    be filling. A rest that the command steps to from an open valve does not count: flow and meter are on their way.
    Where the command hardly rests, what the meter reads far below the first flow serves as well.
    """
    flowing = np.abs(test.q) > FIRST_FLOW * np.abs(test.q).max()
    rest = np.empty(0, dtype=int)
    moved = moved_at_rest(test, u_max)
    flowing &= ~moved
    opens = float(np.quantile(np.abs(test.u[flowing]), 0.01)) if flowing.any() else 0.0
    for share in AT_REST:
        at_rest = (np.abs(test.u) <= share * u_max) & ~moved
        if share > AT_REST[0] and share * u_max > FAR_BELOW * opens:
            break  # the valve may be open there
        rest = _without_filling(test, at_rest & ~_after_flow(at_rest, flowing))
        if rest.size >= FEWEST_AT_REST:
            break
    return rest


def _after_flow(at_rest: np.ndarray, flowing: np.ndarray) -> np.ndarray:
    """Return which samples are of a rest whose first sample, or the one before it, still flows (N,)."""
    begins = np.flatnonzero(at_rest & ~np.concatenate([[False], at_rest[:-1]]))
    stretch = np.cumsum(np.bincount(begins, minlength=at_rest.size)[: at_rest.size]) - 1
    after = (flowing[begins] | flowing[np.maximum(begins - 1, 0)]) & (begins > 0)
    return at_rest & after[stretch] if begins.size else at_rest


@once_a_recording
def moved_at_rest(test: RampTest, u_max: float) -> np.ndarray:
    """Return in which samples flow passes while the command rests that it did not leave behind: another solenoid's.

    From the first reading on that side of zero to the last one; a flow that only dies away after the command is none.
    """
    moved = np.zeros(test.q.size, dtype=bool)
    at_rest = np.flatnonzero(np.abs(test.u) <= AT_REST[0] * u_max)
    largest = float(np.abs(test.q).max())
    low = test.q[at_rest][np.abs(test.q[at_rest]) <= FIRST_FLOW * largest]
    if low.size < FEWEST_AT_REST:
        return moved
    away = test.q[at_rest] - median(low)
    certain = np.abs(away) > max(MOVED * largest, MOVED_ERRORS * robust_sigma(low))
    if np.count_nonzero(certain) < FEWEST_AT_REST:
        return moved
    # Pieces of the rest that lie on one side of zero; a piece ends where the command moves.
    ends = np.flatnonzero((np.diff(np.sign(away)) != 0) | (np.diff(at_rest) > 1)) + 1
    for piece in np.split(np.arange(at_rest.size), ends):
        if np.count_nonzero(certain[piece]) < FEWEST_AT_REST:
            continue
        start, flow = at_rest[piece[0]], np.abs(away[piece])
        half = flow.size // 2
        left_behind = (start == 0 or at_rest[piece[0] - 1] != start - 1) and flow[half:].mean() < flow[:half].mean() / 2
        moved[at_rest[piece]] = not left_behind
    return moved


def _without_filling(test: RampTest, at_rest: np.ndarray) -> np.ndarray:
    before = int(np.argmin(at_rest)) if not at_rest.all() else 0
    third, fourth = test.q[before // 2 : 3 * before // 4], test.q[3 * before // 4 : before]
    drifts = third.size >= 5 and abs(median(third) - median(fourth)) > 5 * _error_of_median(fourth)
    return np.flatnonzero(at_rest & (np.arange(at_rest.size) >= (before if drifts else before // 2)))


def hidden_zero(tests: Sequence[RampTest], floor: float, options: IdentifyOptions) -> float:
    """Return the largest zero error, m³/s, that readings at rest hide because the meter writes none below zero.

    At rest they are one number though the meter scatters where oil flows, so an error below zero does not show; it puts
    every knee too high. So does one that lost its sign, whose readings fall before they rise. 0 where they tell the
    zero, where it was declared, and where a floor hides them: the level at which flow counts is above that.
    """
    if options.meter_zero > 0:
        return 0.0
    largest = max(float(np.abs(test.q).max()) for test in tests)
    found = [_hidden_in(test, floor, largest, options.u_max) for test in tests]
    told = [value for value in found if value is not None]
    return float(np.quantile(told, SHOWN_BY, method="higher")) if told else 0.0


def _hidden_in(test: RampTest, floor: float, largest: float, u_max: float) -> float | None:
    """Return the zero error that a recording hides, m³/s; None where it can't tell."""
    rest = test.q[readings_at_rest(test, u_max)]
    if rest.size >= FEWEST_AT_REST and _is_a_magnitude(test.q, rest):
        return 2 * median(rest)
    low = _noise_between(test.q, LOW_FLOW)
    if rest.size < FEWEST_AT_REST or low is None:
        return None
    one = float(np.mean(rest == median(rest)))
    noise, middle = low, _noise_between(test.q, MIDDLE_FLOW) or 0.0
    steps = np.diff(np.unique(test.q))
    # Of fine readings most neighbours are further apart than a step: few samples lie on much flow.
    step = float(np.quantile(steps, 0.05)) if steps.size else 0.0
    scatters = noise > max(NOISE_OVER_STEP * step, NOISE_OVER_FLOW * largest, NOISE_OVER_MIDDLE * middle)
    below = test.q[(test.q > 0) & (test.q < 2 * floor)]
    # The lowest step of the readings is none.
    has_floor = floor > 2 * step and below.size > 0 and np.mean(below < OF_FLOOR * floor) < BELOW_FLOOR
    if one < HIDES_NOISE or not scatters or has_floor:
        return 0.0
    return HIDDEN_ZERO * largest if one >= HIDES_ALL else min(2 * noise, HIDDEN_ZERO * largest)


def _is_a_magnitude(q: np.ndarray, rest: np.ndarray) -> bool:
    """Tell whether no reading is below zero, and those at rest are above others: a zero error below zero, turned up.

    Where the valve opens such readings fall before they rise, through several values, unlike a drop-out.
    """
    if float(q.min()) < 0:
        return False
    for rows in ROWS:
        if min(q.size, rest.size - FEWEST_AT_REST) < rows:
            break
        means, rests = (np.convolve(each, np.full(rows, 1 / rows), "valid") for each in (q, rest))
        whole = np.convolve(q > 0, np.ones(rows), "valid") > rows - 0.5  # a drop-out is no dip, and no part of one
        zero, dips = median(rests), (means < DIP * median(rests)) & whole
        if (1 - DIP) * zero > DIP_SIGMAS * robust_sigma(rests) and float(rests.min()) >= DIP * zero:
            return bool(np.count_nonzero(dips[1:] & dips[:-1] & (np.diff(means) != 0)) >= FEWEST_DIPS)
    return False


def _noise_between(q: np.ndarray, shares: tuple[float, float]) -> float | None:
    """Return the quick noise of the readings between two shares of the largest flow, by their second differences."""
    low, high = (share * float(q.max()) for share in shares)
    inside = (q > low) & (q < high)
    bends = np.abs(np.diff(q, 2))[inside[:-2] & inside[1:-1] & inside[2:]]
    return float(np.quantile(bends, 0.68)) / math.sqrt(6) if bends.size >= FEWEST_AT_FLOW else None


def _error_of_median(values: np.ndarray) -> float:
    return robust_sigma(values) / math.sqrt(values.size)
