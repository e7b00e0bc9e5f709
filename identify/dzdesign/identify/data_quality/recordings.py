"""What is weak in the recordings themselves, before anything is found in them: made up, averaged, without values."""

from collections.abc import Iterator, Sequence

import numpy as np

from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import most_serious_first, warn
from dzdesign.identify.data_quality.lost_rows import about_lost_rows
from dzdesign.identify.data_quality.recording_order import about_order
from dzdesign.identify.knees.readings_at_rest import moved_at_rest
from dzdesign.identify.reading.clock import ASSUMED_MS
from dzdesign.identify.reading.metering_edge import EDGES
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.recorded_drop import drop_in_words

#: Files that a text lists.
NAMED_FILES = 3


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
