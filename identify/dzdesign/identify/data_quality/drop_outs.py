"""Stretches in which the flow meter, or its cable, was away: the flow reads nothing, or stands still, amid flow.

The knees do without them, as outliers. The recorded flow over the command does not: three ramps of which one reads zero
for half a second have two thirds of the flow there. So these rows are left out. What may be the valve itself stays:
readings at its edge, at rest, about a meter's floor, while the command goes down to a lower one, or while the supply is
away.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.knees.noise import robust_sigma
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
