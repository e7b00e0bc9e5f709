"""Rows in which the flow meter, its cable or the logger did not show the flow: they are marked, or left out.

Drop-outs: the flow reads nothing, or stands still, amid flow. The knees do without them, as outliers. The recorded flow
over the command does not: three ramps of which one reads zero for half a second have two thirds of the flow there. What
may be the valve itself stays: readings at its edge, at rest, about a meter's floor, while the command goes down to a
lower one, or while the supply is away.

Clipping: readings end below or above some flow. Subtracted as a zero error, the lower end would put every knee above
the true one, by that flow over the slope: the wrong way. It is taken as what it is: no flow was seen below a floor.
Taken for the valve's stop, the upper end would leave out a part of the valve's stroke for ever: the flow went beyond.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.knees.gated_line import UNSEEN
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.knees.readings_at_rest import FEWEST_AT_REST, readings_at_rest
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import Warning_

#: Shares of the largest flow: below the one a reading is none, above the other there is flow beside it for certain.
NONE, FLOW = 0.05, 0.2
#: Flow for certain is that many times the least reading of flow, which may be the meter's floor.
ABOVE_FLOOR = 1.5
#: Flow for certain is more than so many standard deviations of its steps from row to row.
NOISES = 4.0
#: Fewest rows of a stretch: shorter ones are spikes, which means over many rows do not show.
FEWEST = 3
#: Rows on either side that tell the flow beside a stretch.
BESIDE = 5
#: The command of a stretch lies above the lower one beside it less this share of the largest.
SAME_COMMAND = 0.02
#: A pressure drop below this share of that beside the stretch: the supply is away, and not the meter.
SUPPLY = 0.5
#: A flow that stands still does so for so many rows, and so many times as long as it usually does; then it jumps by
#: this share of the largest, and by so many of the steps that follow.
STILL, LONGER, JUMP, STEPS = 6, 5.0, 0.02, 5.0
#: Stretches that a text lists.
NAMED = 3
#: Readings within this share of the largest are one reading.
ONE_READING = 1e-6
#: Share of the readings at rest, from below, among which drop-outs and glitches may lie.
GLITCHES = 0.05
#: Fewest of the readings at rest that are the lowest one, and most of all readings that lie between zero and it; most
#: of all readings that lie above the upper end.
STAYS, BELOW, ABOVE = 0.4, 0.005, 0.005
#: Rows in a row that read the largest flow to the last digit; the noise is at least so many steps of the readings, and
#: this share of the flow, so that no flow that stands still would.
REPEATS, NOISE_STEPS, NOISE = 10, 1.0, 1e-4
#: Share of u_max, from the largest command down, and again from as far below, in which the flow stands at an end.
TOP = 0.02
#: So near the end of a declared range, over its width, or one of the other, over the flow, it stands there.
AT_END, STANDS, ALIKE = 0.002, 0.005, 0.01
#: Roots of pressure drops that differ by more than this share; the flow comes near its end by a command that differs by
#: this share of u_max.
ROOTS, SOONER = 0.1, 0.005
#: Flows that grow as the root of the pressure drop do so within this share.
BY_ROOT = 0.05
#: Rows over which the flow is averaged where its noise was added after it was cut off.
AVERAGED = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class _DropOut:
    """Rows in a row, the first and the one after the last; whether the flow stands still; the flow beside it, m³/s."""

    start: int
    stop: int
    still: bool
    beside: float


def without_drop_outs(tests: Sequence[RampTest]) -> tuple[list[RampTest], tuple[Warning_, ...]]:
    """Return the recordings of one side, commands and flows positive, without such rows, and what to say of them."""
    kept, findings = [], []
    for test in tests:
        found = list(_drop_outs(test))
        if found:
            findings.append(_finding(test, found))
            lost = np.zeros(test.q.size, dtype=bool)
            for part in found:
                lost[part.start : part.stop] = True
            test = test.part(~lost)
        kept.append(test)
    return kept, tuple(findings)


def _finding(test: RampTest, found: Sequence[_DropOut]) -> Warning_:
    longest = max(found, key=lambda part: part.stop - part.start)
    spans = [f"{test.time[part.start]:.2f} to {test.time[part.stop - 1]:.2f} s" for part in found[:NAMED]]
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    return warn(
        "flow-drop-out",
        test.source,
        "stuck" if longest.still else "none",
        spans=", ".join(spans) + more,
        u_V=float(np.median(test.u[longest.start : longest.stop])),
        beside_L_min=longest.beside / L_MIN,
        rows=sum(part.stop - part.start for part in found),
    )


def _drop_outs(test: RampTest) -> Iterator[_DropOut]:
    """Yield the stretches of a recording, in the order of time."""
    largest = float(np.quantile(test.q, 0.99)) if test.q.size else 0.0
    if largest <= 0:
        return
    flows = test.q[test.q > NONE * largest]
    least = max(FLOW * largest, ABOVE_FLOOR * float(np.quantile(flows, 0.01)))
    if least <= NOISES * robust_sigma(np.diff(test.q)):
        return  # no flow stands out of the noise
    for start, stop in _runs(test.q <= NONE * largest):
        beside = _beside(test.q, start, stop)
        if stop - start >= FEWEST and min(beside) >= least and _is_the_meters(test, start, stop):
            yield _DropOut(start=start, stop=stop, still=False, beside=min(beside))
    runs = [(start, stop + 1) for start, stop in _runs(np.diff(test.q) == 0) if test.q[start] >= least]
    lengths = np.array([stop - start for start, stop in runs])
    step = float(np.median(np.diff(np.unique(test.q)))) if runs else 0.0
    for number, (start, stop) in enumerate(runs):
        others = np.delete(lengths, number)
        usual = float(np.median(others)) if others.size else 1.0
        if stop - start < max(STILL, LONGER * usual) or stop + BESIDE > test.q.size:
            continue
        # A flow that a supply or a meter holds down goes on from there without a jump; a coarse meter by one step.
        after = test.q[stop : stop + BESIDE]
        least_jump = max(JUMP * largest, STEPS * float(np.median(np.abs(np.diff(after)))), 1.5 * step)
        jumps = abs(float(after[0] - test.q[start])) > least_jump and min(_beside(test.q, start, stop)) >= least
        if jumps and _is_the_meters(test, start, stop):
            yield _DropOut(start=start, stop=stop, still=True, beside=float(np.median(after)))


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return where flags (N,) are set in a row: the first of each and the one after the last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _beside(q: np.ndarray, start: int, stop: int) -> tuple[float, float]:
    """Return the medians of the rows before and after a stretch; 0 at an end of the recording."""
    before, after = q[max(start - BESIDE, 0) : start], q[stop : stop + BESIDE]
    return (
        float(np.median(before)) if before.size == BESIDE else 0.0,
        float(np.median(after)) if after.size == BESIDE else 0.0,
    )


def _is_the_meters(test: RampTest, start: int, stop: int) -> bool:
    """Tell whether command and pressure drop of a stretch are those of the rows beside it, so that flow must pass."""
    sides = slice(max(start - BESIDE, 0), start), slice(stop, stop + BESIDE)
    lowest = min(float(np.median(test.u[side])) for side in sides)
    if float(test.u[start:stop].min()) < lowest - SAME_COMMAND * float(test.u.max()):
        return False
    if test.dp is None:
        return True
    usual = min(float(np.median(test.dp[side])) for side in sides)
    return float(np.median(test.dp[start:stop])) >= SUPPLY * usual


@dataclass(frozen=True, slots=True, kw_only=True)
class _Top:
    """A flow that stands still at the largest commands, m³/s."""

    flow: float
    #: Pressure drop there, Pa, and the command at which the flow comes near, V.
    dp: float
    near: float

    def at_another_pressure(self, other: "_Top") -> bool:
        """Tell whether the roots of the pressure drops differ, by which a stop tells itself from a meter's end."""
        return min(self.dp, other.dp) > 0 and abs(np.log(other.dp / self.dp)) / 2 > ROOTS


def without_clipping(tests: Sequence[RampTest], u_max: float) -> tuple[list[RampTest], tuple[Warning_, ...]]:
    """Return the recordings without what lies beyond the ends of the meter, and what to say.

    Wherever the meter was cut off below, the flow is zero, and it is noted up to which. Rows at its upper end are
    marked as beyond it.
    """
    tests, beyond = _marked_upper_end(tests, u_max)
    lowest = [_clipped_at(test, u_max) for test in tests]
    seen = [
        replace(test, q=np.where(test.q <= low + _one_reading(test), 0.0, test.q), clipped_below=low) if low else test
        for test, low in zip(tests, lowest, strict=True)
    ]
    warnings = tuple(
        warn("meter-clipped", test.source, flow_L_min=low / L_MIN, rows=int(np.sum(test.q <= low + _one_reading(test))))
        for test, low in zip(tests, lowest, strict=True)
        if low
    )
    return seen, (*warnings, *beyond)


def _marked_upper_end(tests: Sequence[RampTest], u_max: float) -> tuple[list[RampTest], tuple[Warning_, ...]]:
    """Return the recordings with the rows at the upper end of the meter's range marked, and what to say of each."""
    tops = [_top(test, u_max) for test in tests]
    left, findings = [], []
    for test, top in zip(tests, tops, strict=True):
        exact = 0.0 if _is_a_stop(top, tops) else _repeated_largest(test)
        end = exact or _same_at_other_pressures(top, tops, u_max) or _declared_end(test, u_max)
        if end:
            at_end = _rows_at(test, end, averaged=not exact)
            unseen = float(test.u[at_end].max(initial=0.0))
            findings.append(warn("flow-clipped", test.source, "end", flow_L_min=end / L_MIN, rows=int(at_end.sum())))
            test = replace(test, beyond=at_end, unseen=(test.unseen[0], max(unseen, test.unseen[1])))
        elif test.unseen_top(UNSEEN * u_max):
            findings.append(warn("flow-clipped", test.source, "missing", from_V=test.u.max(), to_V=test.unseen[1]))
        left.append(test)
    return left, tuple(findings)


def _rows_at(test: RampTest, end: float, *, averaged: bool) -> np.ndarray:
    """Return which rows read the upper end (N,), glitches among them; on average where noise was added to it."""
    near = end - max(2 * _noise(test.q), STANDS * end)
    at_end: np.ndarray = ((_averaged(test.q) if averaged else test.q) >= near) | (test.q >= end - _one_reading(test))
    rows = np.flatnonzero(at_end)
    for row in np.flatnonzero(np.diff(rows) <= AVERAGED).tolist():
        at_end[rows[row] : rows[row + 1]] = True
    return at_end


def _repeated_largest(test: RampTest) -> float:
    """Return the largest flow, m³/s, if it is read to the last digit over many rows while others scatter; else 0."""
    flowing = test.q[test.q > 0.9 * np.quantile(test.q, 1 - ABOVE)] if test.q.size else test.q
    values, counts = np.unique(flowing, return_counts=True)
    if not values.size or counts.max() < REPEATS:
        return 0.0
    end, one = float(values[np.argmax(counts)]), _one_reading(test)
    at_end = np.abs(test.q - end) <= one
    changes = np.flatnonzero(np.diff(at_end, prepend=False, append=False))
    longest = int((changes[1::2] - changes[::2]).max())
    steps = np.diff(np.unique(test.q))
    noise, step = _noise(test.q[test.q < end - one]), float(steps[steps > one].min(initial=np.inf))
    scatters = noise >= max(NOISE_STEPS * step, NOISE * end)
    return end if longest >= REPEATS and scatters and np.mean(test.q > end + one) <= ABOVE else 0.0


def _declared_end(test: RampTest, u_max: float) -> float:
    """Return the upper end of the declared range, m³/s, if the flow at the largest commands stands there; else 0."""
    if test.q_range is None:
        return 0.0
    at_top = test.q[test.u >= test.u.max() - TOP * u_max]
    end, width = max(test.q_range), abs(test.q_range[1] - test.q_range[0])
    return end if end > 0 and abs(float(np.median(at_top)) - end) <= AT_END * width else 0.0


def _top(test: RampTest, u_max: float) -> _Top | None:
    """Return the flow that stands still at the largest commands; None if it still rises there."""
    if test.dp is None:
        return None
    depth = float(test.u.max()) - test.u
    rows, before = depth <= TOP * u_max, (depth > 2 * TOP * u_max) & (depth <= 3 * TOP * u_max)
    if min(np.sum(rows), np.sum(before)) < AVERAGED:
        return None
    flow, earlier = float(np.median(test.q[rows])), float(np.median(test.q[before]))
    near = (test.q > 0.85 * flow) & (test.q < 0.95 * flow)
    if not flow > 0 or abs(flow - earlier) > STANDS * flow or not near.any():
        return None
    return _Top(flow=flow, dp=float(np.median(test.dp[rows])), near=float(np.median(test.u[near])))


def _same_at_other_pressures(top: _Top | None, tops: Sequence[_Top | None], u_max: float) -> float:
    """Return a flow that stands still, m³/s, if it does so at the same value at another pressure drop; else 0.

    A valve's stop lets more pass there, by Eq. (1). So does a supply at its limit, at the pressure drop that is left.
    """
    alike = top is not None and any(
        top.at_another_pressure(other)
        and abs(other.flow - top.flow) <= ALIKE * top.flow
        and abs(other.near - top.near) > SOONER * u_max
        for other in filter(None, tops)
    )
    return top.flow if top and alike else 0.0


def _is_a_stop(top: _Top | None, tops: Sequence[_Top | None]) -> bool:
    """Tell whether a flow stands still at another pressure drop too, larger by the root of it: Eq. (1)."""
    return top is not None and any(
        top.at_another_pressure(other) and abs(np.log(other.flow / top.flow * (top.dp / other.dp) ** 0.5)) <= BY_ROOT
        for other in filter(None, tops)
    )


def _noise(q: np.ndarray) -> float:
    """Return the standard deviation of single readings, of flows that move slowly, m³/s."""
    return 1.4826 * float(np.median(np.abs(np.diff(q, 2)))) / 6**0.5 if q.size > 2 else 0.0


def _averaged(q: np.ndarray) -> np.ndarray:
    padded = np.pad(q, AVERAGED // 2, mode="edge")
    return np.convolve(padded, np.full(AVERAGED, 1 / AVERAGED), mode="valid")


def _clipped_at(test: RampTest, u_max: float) -> float:
    """Return the flow below which nothing was written, m³/s; 0 if the readings show no such flow.

    At rest many readings are that flow to the last digit, and none but glitches and drop-outs is below it anywhere. A
    zero error of a meter that does not scatter looks the same, and is taken for this: to subtract what is a floor would
    be the wrong way, and not to subtract what is an error only lowers the bounds.
    """
    rest = test.q[readings_at_rest(test, u_max)]
    rest = rest[rest > 0]
    if rest.size < FEWEST_AT_REST:
        return 0.0
    one = _one_reading(test)
    low = float(np.quantile(rest, GLITCHES, method="lower"))
    stays = np.mean(np.abs(rest - low) <= one)
    below = np.mean((test.q > 0) & (test.q < low - one))
    return low if stays >= STAYS and below <= BELOW else 0.0


def _one_reading(test: RampTest) -> float:
    return ONE_READING * float(test.q.max())
