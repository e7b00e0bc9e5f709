"""Whether a compensator compensates: with half of the offset, or half of the flow, it is shut at zero command as well.

The offset is held to what is certified, argued from the bound in valve.json again; what the closed loop leaves of the
dead zone and of the hysteresis, to what `design` states; flow and output, to what the valve has without a compensator.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import corners_of, remaining_dead_zone
from dzdesign.design.redesign import hysteresis_left
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.closed_loop.loop_checks import nearest_test
from dzdesign.verify.closed_loop.ramps import Curves, zero_command_name
from dzdesign.verify.loop_results import PressureResult
from dzdesign.verify.requirements import COMPENSATES, Check

#: Of full command: by how much the offset may lie below what is certified, and the dead zone and the hysteresis of the
#: closed loop above what is stated.
LOWER_OFFSET, LONGER, WIDER = 0.005, 0.003, 0.003
#: Share of the largest flow without the compensator that must remain, and of the command from which the output is full.
KEPT_FLOW, FULL_FROM = 0.97, 0.97


def compensates(
    ramps: Sequence[PressureResult], curves: Mapping[str, Curves], compensator: Compensator, *, plant_given: bool
) -> Check:
    """Tell whether the offset is as large as it may be, the dead zone as short as stated, and all of the flow there.

    `curves` are those of the check of every input, with the drive at zero command.
    """
    if not all(ramp.q_max_direct_L_min > NO_FLOW_L_MIN for ramp in ramps):
        return COMPENSATES.check(holds=None, text="the plant stays shut, with full drive as well")
    found = [
        *(_offset(curves, compensator, sign) for sign in compensator.signals.signs),
        *_dead_zone(ramps, compensator),
        *([] if plant_given else _hysteresis(ramps, compensator)),
        *_full(ramps, curves, compensator),
    ]
    text = "; ".join(text for _, text in sorted(found, key=lambda each: each[0]))
    return COMPENSATES.check(holds=all(holds for holds, _ in found), text=text)


def _offset(curves: Mapping[str, Curves], compensator: Compensator, sign: int) -> tuple[bool, str]:
    """Say by how much the drive at zero command lies below what is certified, less what the machine takes."""
    law, side = compensator.side(sign), compensator.valve.side(sign)
    name = compensator.valve.side_name(sign)
    at_zero, units = curves[zero_command_name(name)], compensator.valve.recorded_units.of_side(name)
    dp_MPa = at_zero["dp_MPa"]
    certified_V = _one_way(at_zero["bound_V"], side)
    if compensator.below_dp0 == "hold" and side.reference.dp_MPa is not None:
        certified_V = np.interp(np.maximum(dp_MPa, side.reference.dp_MPa), dp_MPa, certified_V)
    taken_V = np.zeros(dp_MPa.size)
    if law.budget is not None:  # the bound has the recording's part in it, and the drive a dither's peak
        counted = [line for line in (law.budget.line("recording"), law.budget.line("dither")) if line]
        others_mV = np.array(law.budget.combined_mV) - np.sum([line.contribution_mV for line in counted], axis=0)
        # Between two tests that of either: a reading that is off reaches the one that takes more.
        right = np.clip(np.searchsorted(law.budget.dp_MPa, dp_MPa), 1, max(len(others_mV) - 1, 1)) % len(others_mV)
        taken_V = 1e-3 * np.maximum(others_mV[right - 1], others_mV[right])
    below_V = certified_V - taken_V - at_zero["drive_V"]
    worst, allowed_V = int(np.argmax(below_V)), LOWER_OFFSET * float(compensator.u_max_V)
    text = (
        f"the offset lies at most {units.text(1e3 * float(below_V[worst]), '.1f mV')} below what is certified "
        f"(allowed: {units.text(1e3 * allowed_V, '.0f mV')})"
    )
    return bool(compensator.lot) or bool(below_V[worst] <= allowed_V), text


def _one_way(bound_V: np.ndarray, side: SideModel) -> np.ndarray:
    """Return the largest offset under a bound that runs as the threshold does, as the law's beta must."""
    if side.trend == "decreasing":
        return np.minimum.accumulate(bound_V)
    if side.trend == "increasing":
        return np.minimum.accumulate(bound_V[::-1])[::-1]
    return np.full(bound_V.size, bound_V.min())


def _dead_zone(ramps: Sequence[PressureResult], compensator: Compensator) -> Iterator[tuple[bool, str]]:
    """Say by how much the dead zone on opening is longer than stated, or than the law makes it with this plant."""
    found = []
    for ramp in ramps:
        sign, test = compensator.valve.sign_of(ramp.side), nearest_test(ramp, compensator.valve)
        corners = corners_of(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign)
        own = max(corners.command_at(ramp.dead_zone_opening), corners.leaves)
        stated = max(remaining_dead_zone(compensator, test, sign).get("opening", 0.0), own)
        found.append((ramp.residual_opening - stated, ramp))
    longer, worst = max(found, key=lambda each: each[0])
    yield longer <= LONGER, (
        f"the dead zone on opening is {worst.residual_opening:.2%}, {longer:+.2%} beside the stated one (allowed: "
        f"{LONGER:+.1%})"
    )


def _hysteresis(ramps: Sequence[PressureResult], compensator: Compensator) -> Iterator[tuple[bool, str]]:
    """Say by how much the compensated branches lie further apart than stated, where both were recorded."""
    found = []
    for ramp in ramps:
        sign, test = compensator.valve.sign_of(ramp.side), nearest_test(ramp, compensator.valve)
        stated = hysteresis_left(compensator, test, sign)
        if stated.size:
            found.append((abs(ramp.hysteresis) - float(np.mean(np.abs(stated))), ramp))
    if found:
        wider, worst = max(found, key=lambda each: each[0])
        yield wider <= WIDER, (
            f"the hysteresis is {abs(worst.hysteresis):.2%}, {wider:+.2%} beside the stated one (allowed: {WIDER:+.1%})"
        )


def _full(
    ramps: Sequence[PressureResult], curves: Mapping[str, Curves], compensator: Compensator
) -> Iterator[tuple[bool, str]]:
    """Say what remains of the largest flow, and from which command the output is full; not of a limited output."""
    functions, full = compensator.drive_functions, compensator.signals.compare_max
    if functions.compare_limit < full:
        return

    def kept(ramp: PressureResult) -> float:
        flow_share = ramp.q_max_L_min / ramp.q_max_direct_L_min
        return flow_share / _promised(ramp, curves, compensator)

    least = min(ramps, key=kept)
    beside = "" if compensator.law == "paper" else f" less what the law '{compensator.law}' gives up"
    yield kept(least) >= KEPT_FLOW, (
        f"the largest flow is {kept(least):.1%} of that without{beside} (least: {KEPT_FLOW:.0%})"
    )
    early = min(ramps, key=lambda ramp: ramp.full_from)
    # The top of a dither's wave is cut off sooner, by its peak over the slope of the law's line.
    slope = float(compensator.side(compensator.valve.sign_of(early.side)).drive_range_over_u_max)
    from_command = FULL_FROM - functions.dither_counts / full / slope
    yield early.full_from >= from_command, (
        f"the output rises up to {early.full_from:.1%} of command (least: {from_command:.1%})"
    )


def _promised(ramp: PressureResult, curves: Mapping[str, Curves], compensator: Compensator) -> float:
    """Return the share of the largest flow that the law leaves: of `paper` all of it.

    `target`, which corrects no gain, loses (1 - beta) u_min0 / (u_max - beta u_min0), statement T2e; the drives at zero
    command stand for both. Of a law of the user's it is what was recorded at its own output at full command.
    """
    u_max_V = float(compensator.u_max_V)
    if compensator.law == "paper":
        return 1.0
    if compensator.law == "target":
        at_zero = curves[zero_command_name(ramp.side)]
        drive = at_zero["drive_V"] / u_max_V
        here = float(np.interp(ramp.dp_MPa, at_zero["dp_MPa"], drive))
        return 1 - (float(drive.max()) - here) / (1 - here)
    test = nearest_test(ramp, compensator.valve)
    sign = compensator.valve.sign_of(ramp.side)
    full = corners_of(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign).full
    flow: float = test.recorded.opening.flow_at(np.array([full * u_max_V]))[0] / test.recorded.q_max_L_min
    return flow
