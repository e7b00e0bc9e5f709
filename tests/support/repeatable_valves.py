"""`identify` for valves that repeat exactly, as synthetic ones do: their bounds are then tested for the noise alone."""

from collections.abc import Sequence
from dataclasses import replace

from dzdesign.identify import identification
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.results import Identification
from dzdesign.identify.valve.model import ValveModel

#: No scatter from ramp to ramp: any that is assumed would hide a bound that is too high.
REPEATABLE = IdentifyOptions(repeatability=0.0)


def identify(tests: Sequence[RampTest], options: IdentifyOptions | None = None) -> ValveModel:
    """Identify a valve that repeats exactly."""
    return identification.identify(tests, replace(options or REPEATABLE, repeatability=0.0))


def identify_sides(tests: Sequence[RampTest], options: IdentifyOptions | None = None) -> Identification:
    """Identify both sides of a valve that repeats exactly."""
    return identification.identify_sides(tests, replace(options or REPEATABLE, repeatability=0.0))
