"""What is weak in the recordings themselves, before anything is found in them, and in the meter of them all.

Made up, averaged, without values or signs; rows that a logger lost while the command moved; dates that can't all be
right; flow at rest, and the meter's zero error.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import most_serious_first, warn
from dzdesign.identify.knees.readings_at_rest import moved_at_rest
from dzdesign.identify.ramps.sides import flow_is_negative, tests_of_side
from dzdesign.identify.reading.clock import ASSUMED_MS
from dzdesign.identify.reading.metering_edge import EDGES
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.series import began, ended, on_one_clock, order_is_stated, runs_back
from dzdesign.identify.valve.model import SIDES, Warning_
from dzdesign.identify.valve.recorded_drop import drop_in_words

#: Files that a text lists.
NAMED_FILES = 3
#: A gap is that many times as long as nearly all steps of the clock: this quantile of them.
LONGER, NEARLY_ALL = 10.0, 0.99
#: The command rests below the first share of its largest size, and is at its top above the second.
REST, TOP = 0.05, 0.9
#: A command that changes by less than this share of its largest size across a gap is held: at the top, and elsewhere.
HELD_AT_TOP, HELD = 0.01, 0.001
#: A pause within a series of ramps is shorter than this, s: half a year.
LONGEST_PAUSE = 183 * 86_400.0


def about_recordings(tests: Sequence[RampTest]) -> tuple[Warning_, ...]:
    """Return what is to be said of the recordings themselves, the most serious first."""
    by_name = sorted(tests, key=lambda test: test.source)  # `verify` reads the files again, in another order
    of_each = (item for test in by_name for item in _about_one(test))
    return most_serious_first([*_about_simulation(tests), *about_order(tests), *about_lost_rows(by_name), *of_each])


def about_rest(tests: Sequence[RampTest], u_max: float) -> Iterator[Warning_]:
    """Yield a warning where flow passes while the command rests, of the recording where it does the longest."""
    moved = [moved_at_rest(test, u_max) for test in tests]
    lasts = [
        float(np.diff(test.time, append=test.time[-1])[rows].sum()) for test, rows in zip(tests, moved, strict=True)
    ]
    longest = int(np.argmax(lasts))
    if moved[longest].any():
        yield warn(
            "flow-at-rest",
            tests[longest].source,
            lasts_s=lasts[longest],
            largest_L_min=float(np.abs(tests[longest].q[moved[longest]]).max()) / L_MIN,
            count=sum(bool(rows.any()) for rows in moved),
            recordings=len(tests),
        )


def _about_one(test: RampTest) -> Iterator[Warning_]:
    if test.clock_doubt:
        yield warn("time-unit", test.source, "taken" if test.clock_doubt == ASSUMED_MS else "not-taken")
    if test.side_without_dp:
        edges = EDGES[1 if test.side_without_dp == "positive" else -1]
        reason = (
            f"{drop_in_words([*test.dp_from[0], *test.dp_from[1]])} is the pressure drop of the other side's edge; "
            "name columns of "
            f"{' or '.join(' and '.join(edge) for edge in edges)} too, or of dP"
        )
        yield warn("side-refused", test.source, side=test.side_without_dp, reason=reason)
    for kind, samples in test.missing.items():
        yield warn("missing-samples", test.source, kind, samples=samples)
    if test.undeclared_dither:
        yield warn("dither-undeclared", test.source, peak_V=test.undeclared_dither)
    if test.dither_averaged:
        yield warn("dither-in-command", test.source, samples=test.dither_averaged)
    if test.run > 1:
        yield warn("thinned", test.source, rows=test.rows_read, run=test.run, samples=test.time.size)


def _about_simulation(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    made_up = [test.source for test in tests if test.simulated]
    if not made_up:
        return
    more = len(made_up) - NAMED_FILES
    which = (
        "the recording is"
        if len(tests) == 1
        else f"all {len(tests)} recordings are"
        if len(made_up) == len(tests)
        else f"{len(made_up)} of {len(tests)} recordings ({', '.join(made_up[:NAMED_FILES])}"
        + (f" and {more} more" if more > 0 else "")
        + f") {'is' if len(made_up) == 1 else 'are'}"
    )
    yield warn("simulated", made_up[0] if len(tests) == 1 else None, which=which)


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


def about_order(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield what contradicts the order in which the recordings count, or the dates that it rests on."""
    if not on_one_clock(tests):
        return
    if order_is_stated(tests):
        found, case = runs_back(sorted(tests, key=lambda test: test.started or 0.0)), "order"
    else:
        in_time = sorted(tests, key=began)
        found, case = runs_back(in_time), "overlap"
        if found is None:
            found, case = _long_pause(in_time), "pause"
    if found is not None:
        one, other = found
        apart = began(other) - ended(one)
        yield warn(
            "time-stamps", None, case, one=one.source, other=other.source, overlap_s=-apart, days=apart / 86_400
        )


def _long_pause(in_time: Sequence[RampTest]) -> tuple[RampTest, RampTest] | None:
    """Return two recordings that follow each other after longer than any series pauses: a clock lost its date."""
    return next(((one, other) for one, other in pairwise(in_time) if began(other) - ended(one) > LONGEST_PAUSE), None)


def about_whole_meter(
    zeros_of_sides: Mapping[str, Mapping[str, float]], tests: Sequence[RampTest], u_max: float
) -> Iterator[Warning_]:
    """Yield what is to be said; `tests` are all recordings.

    `zeros_of_sides` have for each side that was identified source -> flow at zero command, L/min, where it is not zero.
    """
    negative = [test for test in tests if tests_of_side([test], SIDES["negative"], u_max)]
    unsigned = [test.source for test in negative if not flow_is_negative(test)]
    yield from _about_zeros(zeros_of_sides, unsigned, len(tests))
    if unsigned and "negative" in zeros_of_sides:
        which = "the recording" if len(tests) == 1 else f"{len(unsigned)} of {len(negative)} recordings"
        yield warn("unsigned-flow", None, which=which)


def _about_zeros(
    zeros_of_sides: Mapping[str, Mapping[str, float]], unsigned: Sequence[str], recordings: int
) -> Iterator[Warning_]:
    """Say of all recordings together what the meter reads at zero command, with its own sign."""
    zeros: dict[str, float] = {}
    leaks = False
    for name, of_side in zeros_of_sides.items():
        for source, zero in of_side.items():
            own = zero if source in unsigned else SIDES[name] * zero
            zeros[source] = own if source not in zeros else (zeros[source] + own) / 2
            leaks = leaks or zero > 0
    if not zeros:
        return
    leak = "; if it is a leak, the valve passes it whatever the compensator does" if leaks else ""
    if len(zeros) == 1:
        ((source, zero),) = zeros.items()
        yield warn("meter-zero", source, "one", zero_L_min=zero, leak=leak)
        return
    least, most = min(zeros.values()), max(zeros.values())
    same = f"{least:.2g}" == f"{most:.2g}"
    span = worded("{most:+.3f L/min}" if same else "{least:+.3f #L/min} to {most:+.3f L/min}", least=least, most=most)
    yield warn("meter-zero", None, "several", span=span, count=len(zeros), recordings=recordings, leak=leak)
