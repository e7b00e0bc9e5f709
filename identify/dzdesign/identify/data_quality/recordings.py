"""What is weak in the recordings themselves, before anything is found in them: made up, averaged, without values."""

from collections.abc import Iterator, Sequence

from dzdesign.identify.reading.clock import ASSUMED_MS
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import Warning_

#: Files that a text lists.
NAMED_FILES = 3


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
                    f"of {test.rows_read} rows the medians of every {test.run} in a row were taken, {test.time.size} "
                    "samples, to which noise and outliers refer. The next one may be recorded at a lower rate"
                ),
                source=test.source,
            )
