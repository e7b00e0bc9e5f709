"""What is to be said of the flow meter once, for all recordings and both sides: its zero error, a flow without sign."""

from collections.abc import Iterator, Mapping, Sequence

from dzdesign.core.recorded_units import worded
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.ramps.sides import flow_is_negative, tests_of_side
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import SIDES, Warning_


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
