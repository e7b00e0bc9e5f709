"""What the recordings leave open from ramp to ramp: no repeats, an order that hides a drift, a drift that is there."""

from collections.abc import Iterator

from dzdesign.identify.data_quality.catalogue import Finding, warn
from dzdesign.identify.knees.between_ramps import ASSUMED_REPEATABILITY, FEW_DEGREES
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.repeatability import Repeatability

#: Standard errors from which a drift is said, and share of u_max from which it matters.
DRIFT_SIGNIFICANCE, SMALLEST_DRIFT = 3.0, 1e-3


def about_ramps(found: Repeatability, count: int, options: IdentifyOptions) -> Iterator[Finding]:
    """Yield the warnings about what differs from ramp to ramp, of the guarded branch of `count` tests."""
    sd_mV, degrees = 1e3 * found.sd_V, found.degrees_of_freedom
    if found.origin == "assumed":
        yield warn("no-repeats", percent=100 * ASSUMED_REPEATABILITY, sd_mV=sd_mV)
    elif degrees is not None and options.repeatability is not None:
        percent = 100 * found.sd_V / options.u_max
        yield warn("repeatability", sd_mV=sd_mV, percent=percent, declared=100 * options.repeatability)
    elif degrees is not None and degrees < FEW_DEGREES:
        yield warn("few-repeats", sd_mV=sd_mV, differences=degrees)
    if found.no_drift == "order of pressure" or (found.no_drift == "order unknown" and count > 1):
        yield warn("order", None, "unknown" if found.no_drift == "order unknown" else "of-pressure")
    if found.drift_V is not None and found.drift_se_V is not None:
        least = max(DRIFT_SIGNIFICANCE * found.drift_se_V, SMALLEST_DRIFT * options.u_max)
        if abs(found.drift_V) > least:
            yield warn("drift", drift_mV=1e3 * found.drift_V, se_mV=1e3 * found.drift_se_V)
