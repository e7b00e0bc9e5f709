"""Rows that a logger lost while the command moved: gaps in the time, counted over all recordings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import Warning_

#: A gap is that many times as long as nearly all steps of the clock: this quantile of them.
LONGER, NEARLY_ALL = 10.0, 0.99
#: The command rests below the first share of its largest size, and is at its top above the second.
REST, TOP = 0.05, 0.9
#: A command that changes by less than this share of its largest size across a gap is held: at the top, and elsewhere.
HELD_AT_TOP, HELD = 0.01, 0.001


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """A gap in a recording: its length, s, the rows that it lacks, and the commands before and after it, V."""

    source: str
    seconds: float
    rows: int
    u: tuple[float, float]


def about_lost_rows(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield one warning for all recordings together, if any lacks rows."""
    # Samples that were taken for missing have a warning of their own: no logger lost them.
    gaps = [gap for test in tests if not test.missing for gap in find_gaps(test)]
    if not gaps:
        return
    longest = max(gaps, key=lambda gap: gap.seconds)
    count = len({gap.source for gap in gaps})
    yield warn(
        "lost-rows",
        rows=sum(gap.rows for gap in gaps),
        which="the recording" if len(tests) == 1 else f"{count} of {len(tests)} recordings",
        longest_s=longest.seconds,
        file=longest.source,
        from_V=longest.u[0],
        to_V=longest.u[1],
    )


def find_gaps(test: RampTest) -> Iterator[Gap]:
    """Yield the gaps of a recording in the order of time, but for the pauses between ramps and in a hold."""
    steps = np.diff(test.time)
    moving = steps[steps > 0]
    if moving.size == 0:
        return
    long = steps > LONGER * np.quantile(moving, NEARLY_ALL, method="lower")
    step = float(steps[~long].sum()) / max(int(np.count_nonzero(~long)), 1)  # stamps may repeat
    largest = float(np.abs(test.u).max())
    for row in np.flatnonzero(long):
        before, after = float(test.u[row]), float(test.u[row + 1])
        if not _is_a_pause(before, after, largest):
            rows = round(float(steps[row]) / step) - 1
            yield Gap(source=test.source, seconds=float(steps[row]), rows=rows * test.run, u=(before, after))


def _is_a_pause(before: float, after: float, largest: float) -> bool:
    """Tell whether a logger may have paused there, by the commands before and after and the largest size of any, V."""
    low, high = sorted((abs(before), abs(after)))
    at_rest, at_top = low <= REST * largest, high >= TOP * largest
    if at_rest:
        return at_top or high <= REST * largest
    return abs(after - before) <= (HELD_AT_TOP if at_top else HELD) * largest
