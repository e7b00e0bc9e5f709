"""What readings by hand below the meter's floor changed, and what they lack."""

from collections.abc import Iterator, Mapping

from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.fitting.low_flow import Lowered, unseen_of_curve
from dzdesign.identify.valve.guard_curve import Guard
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.side_model import SideModel

#: Times the level, the flow of the reading that a message asks for.
ASKED = 2.0


def about_low_flow(side: SideModel, lowered: Mapping[Guard, Lowered]) -> Iterator[Warning_]:
    """Yield the warnings about the readings of one side: thresholds that were lowered, and tests without a reading."""
    for guard, each in lowered.items():
        yield warn(
            "low-flow", each.by.source, "lowered",
            guard=guard, depth_mV=1e3 * each.depth, flow_L_min=each.by.at_least_L_min, u_V=each.by.u_V,
            dp_MPa=each.by.dp_MPa,
        )  # fmt: skip
    if not side.low_flow:
        return
    guard, level = side.certificate.guard, side.certificate.level_L_min
    unseen = unseen_of_curve(side.low_flow, guard, side.curve, level)
    if unseen.unconfirmed:
        middle = len(side.tests) // 2
        recorded = side.tests[middle].recorded
        shown = recorded.closing if guard == "closing" else recorded.opening
        yield warn(
            "low-flow", None, "unconfirmed",
            branch=guard, level_L_min=level, flow_L_min=ASKED * level, dp_MPa=side.curve.dp_MPa[middle],
            u_V=shown.command_at(ASKED * level) or shown.u_V[-1],
        )  # fmt: skip
    if unseen.missing and not unseen.unconfirmed:
        first = unseen.missing[0]
        yield warn(
            "low-flow", None, "short",
            count=len(unseen.missing), tests=len(side.tests), branch=guard, dp_MPa=side.curve.dp_MPa[first],
            u_V=side.curve.u_threshold_V[first], level_L_min=level,
        )  # fmt: skip
