"""A meter, or a logger, that never writes less than some flow: what it writes at rest is neither a zero error nor flow.

Subtracted as a zero error it would put every knee above the true one, by that flow over the slope: the wrong way. It is
taken as what it is: no flow was seen below a floor.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dzdesign.identify.described_tests import L_MIN
from dzdesign.identify.model import Warning_
from dzdesign.identify.noise import robust_sigma
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramp_files import RampTest

#: Commands within this share of u_max are at rest, and the fewest readings there that tell.
AT_REST, FEWEST = 0.01, 20
#: A flow above this share of the largest is one in which the meter's noise shows.
FLOWING = 0.3
#: Steps of the last digit beyond which a scatter is the meter's noise, which then is missing at rest.
STEPS = 2.0
#: The declared floor names the flow at which the readings stop, within this share.
DECLARED = 0.05


def without_clipping(
    tests: Sequence[RampTest], options: IdentifyOptions
) -> tuple[list[RampTest], IdentifyOptions, tuple[Warning_, ...]]:
    """Return the recordings with a zero wherever the meter was cut off, the floor that this means, and what to say.

    Parameters
    ----------
    tests : sequence of RampTest
        Of one side, its commands and flows positive.
    options : IdentifyOptions
        Choices of the engineer; a floor that is declared stays, unless the meter was cut off above it.
    """
    lowest = [_clipped_at(test, options) for test in tests]
    if not any(lowest):
        return list(tests), options, ()
    seen = [
        replace(test, q=np.where(test.q <= low, 0.0, test.q)) if low else test
        for test, low in zip(tests, lowest, strict=True)
    ]
    floor = max(options.meter_floor or 0.0, *lowest, 0.0)
    warnings = tuple(_warning(test, low) for test, low in zip(tests, lowest, strict=True) if low)
    return seen, replace(options, meter_floor=floor), warnings


def _clipped_at(test: RampTest, options: IdentifyOptions) -> float:
    """Return the flow below which nothing was written, m³/s; 0 if the readings show no such flow.

    At rest the readings are that flow to the last digit, and none is below it. A zero error of a meter that hardly
    scatters looks the same; it is told by the scatter of the flows, or by the engineer's word.
    """
    rest = test.q[np.abs(test.u) <= AT_REST * options.u_max]
    low = float(test.q.min())
    if rest.size < FEWEST or low <= 0 or rest.max() > low:
        return 0.0
    if options.meter_floor and abs(low - options.meter_floor) <= DECLARED * options.meter_floor:
        return low
    flowing = test.q[test.q > FLOWING * test.q.max()]
    steps = np.diff(np.unique(test.q))
    if flowing.size < FEWEST or not steps.size:
        return 0.0
    scatter = robust_sigma(np.diff(flowing, 2)) / np.sqrt(6)  # of the second differences of white noise
    return low if scatter > STEPS * steps.min() else 0.0


def _warning(test: RampTest, low: float) -> Warning_:
    return Warning_(
        code="meter-clipped",
        text=(
            f"the flow never reads less than {low / L_MIN:.3g} L/min, and reads that to the last digit in "
            f"{int(np.sum(test.q <= low))} rows: the meter or the logger cuts it off there. Those rows are taken as no "
            "flow seen, below a floor of that much. Let the logger write what the meter reads, or zero below its floor"
        ),
        source=test.source,
    )
