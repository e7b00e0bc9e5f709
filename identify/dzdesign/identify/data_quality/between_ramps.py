"""What the recordings leave open from ramp to ramp: no repeats, an order that hides a drift, a drift that is there."""

from collections.abc import Iterator

from dzdesign.identify.knees.between_ramps import ASSUMED_REPEATABILITY, FEWEST_DEGREES
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.repeatability import Repeatability

#: Standard errors from which a drift is said, and share of u_max from which it matters.
DRIFT_SIGNIFICANCE, SMALLEST_DRIFT = 3.0, 1e-3
#: With fewer degrees of freedom the scatter is known so badly that repeats pay twice.
FEW_DEGREES = 4


def about_ramps(found: Repeatability, count: int, options: IdentifyOptions) -> Iterator[Warning_]:
    """Yield the warnings about what differs from ramp to ramp, of the guarded branch of `count` tests."""
    mV, share = 1e3 * found.sd_V, 100 * found.sd_V / options.u_max
    if found.origin == "assumed":
        yield Warning_(
            code="no-repeats",
            text=(
                "no ramp was repeated, so nothing shows by how much the threshold scatters from ramp to ramp: a "
                f"standard deviation of {100 * ASSUMED_REPEATABILITY:g} % of full command, {mV:.3g} mV, is assumed, "
                "and the bounds hold only if the valve repeats as well as that. Record two more ramps at each "
                'pressure drop, or declare it by --repeatability "0.1 %"'
            ),
            source=None,
        )
    elif found.origin == "repeats" and options.repeatability is not None:
        yield Warning_(
            code="repeatability",
            text=(
                f"the repeats scatter by {mV:.3g} mV ({share:.2g} % of full command, one standard deviation), more "
                f"than the declared {100 * options.repeatability:g} %, so the bounds count what was measured. "
                "Correct --repeatability, or look for what differs between the ramps"
            ),
            source=None,
        )
    elif FEWEST_DEGREES <= (found.degrees_of_freedom or FEW_DEGREES) < FEW_DEGREES:
        yield Warning_(
            code="few-repeats",
            text=(
                f"the scatter from ramp to ramp, {mV:.3g} mV, is known from {found.degrees_of_freedom:.0f} differences "
                "only, and the bounds lie several times that lower. Two or three more repeats raise them"
            ),
            source=None,
        )
    if found.no_drift == "order unknown" and count > 1:
        yield Warning_(
            code="order",
            text=(
                "the order of the recordings is not known, so a drift of the valve (oil or coil warming up) can't be "
                "told from the effect of the pressure drop, and the bounds do not count it. Record with date and "
                "time, or give --order"
            ),
            source=None,
        )
    elif found.no_drift == "order of pressure":
        yield Warning_(
            code="order",
            text=(
                "no pressure drop was recorded both early and late in the series, so a drift of the valve (oil or coil "
                "warming up) can't be told from the effect of the pressure drop, and the bounds do not count it. "
                "Repeat the first ramp at the end, or record repeats in random order"
            ),
            source=None,
        )
    elif found.drift_V is not None and found.drift_se_V is not None:
        least = max(DRIFT_SIGNIFICANCE * found.drift_se_V, SMALLEST_DRIFT * options.u_max)
        if abs(found.drift_V) > least:
            yield Warning_(
                code="drift",
                text=(
                    f"the threshold drifts by {1e3 * found.drift_V:+.0f} mV from the first ramp to the last (standard "
                    f"error {1e3 * found.drift_se_V:.1f} mV): the bounds hold in every state that the series has seen, "
                    "and in no other. Warm the valve up before recording, and record the temperature"
                ),
                source=None,
            )
