"""What is weak in the recordings themselves, before anything is found in them: made up, averaged, a stuck sensor."""

from collections.abc import Iterator, Sequence

import numpy as np

from dzdesign.identify.clock import ASSUMED_MS
from dzdesign.identify.model import Warning_
from dzdesign.identify.named_pressure import claimed_pressures
from dzdesign.identify.ramp_files import RampTest
from dzdesign.identify.ramp_splitting import despiked

MPA = 1e6
#: Files that a text lists.
NAMED_FILES = 3
#: Pressure drops that differ by less than this share are one number: averaging may round the last digit.
ONE_NUMBER = 1e-12
#: A pressure drop stands still if all but the outermost readings lie within this share of it, or on so few levels of
#: the converter: two a port to either side.
STANDS_STILL, LEVELS, OUTERMOST = 0.05, 9, 0.005
#: Means that differ by more than this factor are of several pressure drops, or of none that stands still.
APART = 1.2
#: Share by which flows at one command may differ where the pressure drop is the same, beyond what the means of the
#: pressure drop say, for flow grows as its root: a repeated ramp, warmer oil. So may those that files' names state.
SAME_FLOW = 0.1
#: Flows are compared within this share of the largest command that all recordings reach.
NEAR_TOP = 0.02
#: A flow below this share of the largest one is none to compare: the command does not open the valve.
SMALL_FLOW = 0.05


def about_recordings(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield what is to be said of the recordings themselves, most important first.

    Parameters
    ----------
    tests : sequence of RampTest
        As read.
    """
    yield from _about_simulation(tests)
    yield from _about_clocks(tests)
    yield from _about_missing_samples(tests)
    yield from _about_thinning(tests)


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
    yield Warning_(
        code="simulated",
        text=(
            f"{which} simulated, as a comment above the columns says: no measurement of a valve, so no firmware for a "
            "machine comes of it. Record ramp tests of the valve itself"
        ),
        source=made_up[0] if len(tests) == 1 else None,
    )


def _about_clocks(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield a warning for each recording whose time is plainly in milliseconds and does not say so."""
    for test in tests:
        if test.clock_doubt:
            took = "was taken as" if test.clock_doubt == ASSUMED_MS else "was not taken as"
            why = "says no unit" if test.clock_doubt == ASSUMED_MS else "says another unit"
            yield Warning_(
                code="time-unit",
                text=(
                    f"the column of time counts like milliseconds, in whole numbers by which a ramp in seconds would "
                    f"take more than an hour, and {why}: it {took} milliseconds. Say its unit in its label, such as "
                    'time_ms, or by --columns "time=LABEL:ms"'
                ),
                source=test.source,
            )


def _about_missing_samples(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    for test in tests:
        if test.no_values:
            yield Warning_(
                code="missing-samples",
                text=(
                    f"{test.no_values}: far beyond all other values there, and what loggers write where they have "
                    "none, so these rows were left out as missing samples. Look at the cable and the range of that "
                    "channel, and let the logger leave such cells blank"
                ),
                source=test.source,
            )


def _about_thinning(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    for test in tests:
        if test.run > 1:
            yield Warning_(
                code="thinned",
                text=(
                    f"of {test.rows_read} rows every {test.run} in a row were averaged, without their spikes, to "
                    f"{test.time.size} samples, to which noise and outliers refer. The next one may be recorded at a "
                    "lower rate"
                ),
                source=test.source,
            )


def about_a_stuck_sensor(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield a warning if the recordings of one side show one pressure drop, noise aside, and must have several.

    Parameters
    ----------
    tests : sequence of RampTest
        Of one side, its commands and flows positive.
    """
    recorded = [test.dp for test in tests if test.dp is not None and not test.dp_is_declared]
    if len(tests) < 2 or len(recorded) < len(tests):
        return
    means = [float(dp.mean()) for dp in recorded]
    if min(means) <= 0 or max(means) > APART * min(means):
        return
    every = np.concatenate(recorded)
    low, middle, high = (float(value) for value in np.quantile(every, [OUTERMOST, 0.5, 1 - OUTERMOST]))
    if not _stands_still(every, low, middle, high):
        return
    explained = max(means) / min(means)
    top, flows = _flows_at_one_command(tests)
    claims = claimed_pressures([test.source for test in tests])
    signs = []
    if min(flows) > 0 and max(flows) > (1 + SAME_FLOW) * explained**0.5 * min(flows):
        signs.append(f"the flows at {top:.3g} V differ by {max(flows) / min(flows) - 1:.0%}")
    if claims and max(claims) > (1 + SAME_FLOW) * explained * min(claims):
        signs.append("the files' names say different ones")
    if signs:
        one = high - low <= ONE_NUMBER * high
        about = f"{high / MPA:.6g} MPa in every row of" if one else f"{low / MPA:.4g} to {high / MPA:.4g} MPa in"
        yield Warning_(
            code="pressure-stuck",
            text=(
                f"the pressure drop is {about} all {len(tests)} recordings, but "
                f"{' and '.join(signs)}: the sensor is stuck, or the column is another's, and ramps of different "
                "pressure drops are taken for one test, whose knees are known badly for that reason (or it is one "
                "pressure drop, and the valve, its supply or oil was not the same). Leave that column out and declare "
                "the pressure drops by [dp], or record again"
            ),
            source=None,
        )


def _stands_still(every: np.ndarray, low: float, middle: float, high: float) -> bool:
    """Tell whether readings are one number and the noise of a converter."""
    if high - low <= STANDS_STILL * middle:
        return True
    inner = every[(every >= low) & (every <= high)]
    # One level computed from two ports, or averaged, differs in its last digits.
    return middle > 0 and np.unique(np.round(inner / middle, 6)).size <= LEVELS


def _flows_at_one_command(tests: Sequence[RampTest]) -> tuple[float, list[float]]:
    """Return the largest command that all recordings reach, V, and each one's flow there; zero where that is small."""
    top = min(float(despiked(test.u).max()) for test in tests)
    flows = []
    for test in tests:
        away = np.abs(test.u - top)
        flows.append(float(np.median(test.q[away <= max(NEAR_TOP * top, away.min())])))
    return top, [flow if flow > SMALL_FLOW * max(flows) else 0.0 for flow in flows]
