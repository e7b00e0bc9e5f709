"""`identify` for synthetic valves, which repeat exactly, on meters whose lag is as declared.

Their bounds are then tested for the noise alone: what is allowed for scatter and lag would hide one that is too high.
"""

from collections.abc import Sequence
from dataclasses import replace

from dzdesign.identify import identification
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.side import Identification
from dzdesign.identify.valve.model import ValveModel

REPEATABLE = IdentifyOptions(repeatability=0.0)


def identify(tests: Sequence[RampTest], options: IdentifyOptions | None = None) -> ValveModel:
    """Identify a valve that repeats exactly."""
    return identification.identify(tests, _exact(options or REPEATABLE))


def identify_sides(tests: Sequence[RampTest], options: IdentifyOptions | None = None) -> Identification:
    """Identify both sides of a valve that repeats exactly."""
    return identification.identify_sides(tests, _exact(options or REPEATABLE))


def _exact(options: IdentifyOptions) -> IdentifyOptions:
    options = replace(options, repeatability=0.0)
    undeclared = options.meter_lag is None or options.meter_lag_tolerance is not None
    return options if undeclared else replace(options, meter_lag_tolerance=0.0)
