"""A meter, or a logger, that never writes less than some flow: what it writes at rest is neither a zero error nor flow.

Subtracted as a zero error it would put every knee above the true one, by that flow over the slope: the wrong way. It is
taken as what it is: no flow was seen below a floor.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import Finding, warn
from dzdesign.identify.knees.readings_at_rest import FEWEST_AT_REST, readings_at_rest
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest

#: Readings within this share of the largest are one reading.
ONE_READING = 1e-6
#: Share of the readings at rest, from below, among which drop-outs and glitches may lie.
GLITCHES = 0.05
#: Fewest of the readings at rest that are the lowest one, and most of all readings that lie between zero and it.
STAYS, BELOW = 0.4, 0.005


def without_clipping(
    tests: Sequence[RampTest], options: IdentifyOptions
) -> tuple[list[RampTest], IdentifyOptions, tuple[Finding, ...]]:
    """Return the recordings with a zero wherever the meter was cut off, the floor that this means, and what to say.

    A floor that is declared stays, unless the meter was cut off above it.
    """
    lowest = [_clipped_at(test, options.u_max) for test in tests]
    if not any(lowest):
        return list(tests), options, ()
    seen = [
        replace(test, q=np.where(test.q <= low + _one_reading(test), 0.0, test.q)) if low else test
        for test, low in zip(tests, lowest, strict=True)
    ]
    floor = max(options.meter_floor or 0.0, *lowest, 0.0)
    warnings = tuple(
        warn("meter-clipped", test.source, flow_L_min=low / L_MIN, rows=int(np.sum(test.q <= low + _one_reading(test))))
        for test, low in zip(tests, lowest, strict=True)
        if low
    )
    return seen, replace(options, meter_floor=floor), warnings


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
