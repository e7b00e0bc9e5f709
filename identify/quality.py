"""The quality gate that speaks: what is weak in the data, with the numbers and what to do."""

from collections.abc import Collection, Iterator, Mapping

from dzdesign.identify.model import SideModel, Warning_
from dzdesign.identify.ramp_files import RampTest

#: A softer edge than this share of u_max between knee and onset is said.
SOFT_EDGE = 5e-3


def find_warnings(
    side: SideModel,
    *,
    floor_L_min: float,
    u_max: float,
    sag: Mapping[str, float],
    u_top: Mapping[str, float],
    u_bottom: Mapping[str, float],
    zero_L_min: Mapping[str, float],
    departure_V: Mapping[str, float],
    declared: Collection[str] = (),
    thinned: Collection[RampTest] = (),
) -> tuple[Warning_, ...]:
    """Return the warnings about one side.

    Parameters
    ----------
    side : SideModel
        What was identified.
    floor_L_min : float
        Meter floor.
    u_max : float
        Full command, V.
    sag : mapping
        Source -> share of the pressure drop lost at full command.
    u_top, u_bottom : mapping
        Source -> largest and smallest command, V.
    zero_L_min : mapping
        Source -> flow read at zero command, where it is not zero.
    departure_V : mapping
        Source -> departure of the knees from one direction with the pressure drop, where it is beyond their error.
    declared : collection of str
        Sources whose pressure drop is the engineer's word.
    thinned : collection of RampTest
        Recordings that were too long to be kept row by row.
    """
    return (
        *_about_length(thinned),
        *_about_the_meter(zero_L_min),
        *_about_order(departure_V),
        *_about_pressure(side, sag),
        *_about_declarations(declared),
        *_about_branches(side, u_max, u_top, u_bottom),
        *_about_the_edge(side, floor_L_min, u_max),
    )


def _about_length(thinned: Collection[RampTest]) -> Iterator[Warning_]:
    for test in thinned:
        yield Warning_(
            code="thinned",
            text=(
                f"of {test.rows_read} rows every {test.run} in a row were averaged, without their spikes, to "
                f"{test.time.size} samples, to which noise and outliers refer. The next one may be recorded at a lower "
                "rate"
            ),
            source=test.source,
        )


def _about_the_meter(zero_L_min: Mapping[str, float]) -> Iterator[Warning_]:
    for source, zero in zero_L_min.items():
        yield Warning_(
            code="meter-zero",
            text=(
                f"the flow reads {zero:+.3f} L/min at zero command: taken as the meter's zero error and subtracted"
                + ("; if it is a leak, the valve passes it whatever the compensator does" if zero > 0 else "")
                + ". Set the meter to zero and record again"
            ),
            source=source,
        )


def _about_order(departure_V: Mapping[str, float]) -> Iterator[Warning_]:
    for source, gap in departure_V.items():
        yield Warning_(
            code="not-monotone",
            text=(
                f"its knee departs by {1e3 * gap:.0f} mV from a threshold that runs one way with the pressure drop, on "
                "which the certificate rests; all bounds are lowered by the departure. Repeat this test and its "
                "neighbours"
            ),
            source=source,
        )


def _about_pressure(side: SideModel, sag: Mapping[str, float]) -> Iterator[Warning_]:
    if side.reference_dp_MPa is None:
        yield Warning_(
            code="no-pressure",
            text=(
                "the ramp test has no pressure drop: the knee holds for the pressure of that test only; beta(dP), the "
                "trend, k at another pressure and a certified interval can't be said. Record dP (or pA and pB), at two "
                "or more pressure drops"
            ),
            source=side.tests[0].source,
        )
    elif len(side.tests) == 1:
        yield Warning_(
            code="one-pressure",
            text=(
                f"only {side.reference_dp_MPa:.3g} MPa was tested: whether the threshold moves with the pressure drop "
                "can't be said, beta is 1 and nothing is certified at other pressure drops. Record two or more"
            ),
            source=side.tests[0].source,
        )
    elif side.trend == "flat":
        yield Warning_(
            code="flat-trend",
            text=(
                f"the threshold changes by {1e3 * side.trend_change_V:.1f} mV over the tested range (standard error "
                f"{1e3 * side.trend_change_se_V:.1f} mV): too little to be called a trend, so beta is 1"
            ),
            source=None,
        )
    for source, share in sag.items():
        if share > 1 / 3:
            yield Warning_(
                code="pressure-sag",
                text=f"the pressure drop sags by {share:.0%} at full command; a larger pump or accumulator would help",
                source=source,
            )


def _about_declarations(declared: Collection[str]) -> Iterator[Warning_]:
    for source in declared:
        yield Warning_(
            code="declared-pressure",
            text=(
                "the pressure drop is declared, not recorded: if it sags under flow, the knee is found too low (21 mV "
                "for 5 % on a 10 V valve like the example's). Record dP (or pA and pB)"
            ),
            source=source,
        )


def _about_branches(
    side: SideModel, u_max: float, u_top: Mapping[str, float], u_bottom: Mapping[str, float]
) -> Iterator[Warning_]:
    for test in side.tests:
        if test.u_knee_falling_V is None:
            yield Warning_(
                code="one-branch",
                text=(
                    "no falling branch: valves close at a lower command than they open, so the certificate guards the "
                    "opening threshold only and flow at zero command after closing is possible. Ramp down as well"
                ),
                source=test.source,
            )
        if test.u_knee_rising_V is None:
            yield Warning_(
                code="one-branch",
                text="no rising branch: the residual dead zone on opening can't be said. Ramp up as well",
                source=test.source,
            )
        if test.u_knee_rising_V and test.u_knee_falling_V and test.u_knee_rising_V < test.u_knee_falling_V:
            yield Warning_(
                code="branch-order",
                text=(
                    f"the valve closes ({test.u_knee_falling_V:.3f} V) above where it opens "
                    f"({test.u_knee_rising_V:.3f} V): is the meter's lag over-corrected, or the time column wrong?"
                ),
                source=test.source,
            )
        if u_top[test.source] < 0.97 * u_max:
            yield Warning_(
                code="not-full-command",
                text=f"the command reaches {u_top[test.source]:.2f} V of {u_max:g} V, so k x_max is too small",
                source=test.source,
            )
        if u_bottom[test.source] < -0.05 * u_max:
            yield Warning_(
                code="negative-side",
                text=(
                    f"the command goes down to {u_bottom[test.source]:.2f} V; this version identifies the positive "
                    "side only, the negative side is missing from the result"
                ),
                source=test.source,
            )
    if not any(test.saturates for test in side.tests):
        yield Warning_(
            code="no-saturation",
            text=(
                f"no test saturates: k x_max/u_max = {side.k_x_max_over_u_max:.4f} comes from the flow at full command "
                "and is a lower bound of the stroke's"
            ),
            source=None,
        )


def _about_the_edge(side: SideModel, floor_L_min: float, u_max: float) -> Iterator[Warning_]:
    if floor_L_min > 0:
        yield Warning_(
            code="onset-hidden",
            text=(
                f"the flow meter starts at {floor_L_min:.2f} L/min: a leak or a soft edge below that flow can't be "
                "observed, and the certificate says nothing about it"
            ),
            source=None,
        )
    for test in side.tests:
        knee = test.u_knee_falling_V if test.u_knee_falling_V is not None else test.u_knee_rising_V
        if knee - test.u_guard_V > SOFT_EDGE * u_max:
            yield Warning_(
                code="soft-edge",
                text=(
                    f"flow is seen {1e3 * (knee - test.u_guard_V):.0f} mV below the knee: the edge is soft, and the "
                    "onset is guarded instead of the knee, at the price of that much residual dead zone"
                ),
                source=test.source,
            )
