"""What the closed loop must show: the plant opens where the valve does, and nothing flows at zero command."""

from collections.abc import Sequence

from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.evidence import PressureResult, ScenarioResult
from dzdesign.verify.requirements import PLANT_IS_THE_VALVE, PLANT_OPENS, ZERO_FLOW, ZERO_FLOW_AFTER_SCENARIOS, Check

#: Share of full command by which the opening of a plant may differ from the identified valve's: rounding, a quick ramp.
SAME_THRESHOLD = 0.03


def loop_checks(
    ramps: Sequence[PressureResult], scenarios: Sequence[ScenarioResult], compensator: Compensator, *, plant_given: bool
) -> tuple[Check, ...]:
    """Return all of them, in the order of the report."""
    zero_flow = no_flow_at_zero(ramps, compensator, plant_given=plant_given)
    return (
        plant_opens(ramps),
        plant_is_the_valve(ramps, compensator.valve),
        zero_flow,
        shut_after_scenarios(scenarios, zero_flow, plant_given=plant_given),
    )


def plant_opens(ramps: Sequence[PressureResult]) -> Check:
    """Tell whether flow passes at full command: of a plant that stays shut, or whose motion is not finite, the other
    figures of the closed loop say nothing."""
    least = min(ramps, key=lambda ramp: ramp.q_max_L_min)
    return PLANT_OPENS.check(
        holds=least.q_max_L_min > NO_FLOW_L_MIN,
        text=f"{least.q_max_L_min:.4g} L/min at full command and {least.dp_MPa:.2f} MPa, where it is least",
    )


def plant_is_the_valve(ramps: Sequence[PressureResult], valve: ValveModel) -> Check:
    """Tell whether the plant opens where the ramp tests say that the valve does."""

    def opens_V(ramp: PressureResult) -> tuple[float, float]:
        test = min(valve.sides[ramp.side].tests, key=lambda test: abs((test.dp_MPa or 0.0) - ramp.dp_MPa))
        known = test.u_guard_V if test.u_knee_rising_V is None else test.u_knee_rising_V
        return ramp.dead_zone_opening * valve.u_max_V, known

    worst = max(ramps, key=lambda ramp: abs(float.__sub__(*opens_V(ramp))))
    plant_V, valve_V = opens_V(worst)
    holds = abs(plant_V - valve_V) <= SAME_THRESHOLD * valve.u_max_V
    text = f"at {plant_V:.2f} V, the ramp tests at {valve_V:.2f} V (at {worst.dp_MPa:.2f} MPa, the worst)"
    if not holds:
        text += "; the closed loop is of another valve: correct preload, spring or force in --plant"
    return PLANT_IS_THE_VALVE.check(holds=holds, text=text)


def no_flow_at_zero(ramps: Sequence[PressureResult], compensator: Compensator, *, plant_given: bool) -> Check:
    """Tell whether the valve is shut at zero command, after closing.

    A plant that is made from the thresholds, and not given, closes where they say.
    """
    worst = max(ramps, key=lambda ramp: ramp.q_zero_L_min)
    guards = {sign: compensator.side(sign).certificate.guard for sign in compensator.signals.signs}
    sides = compensator.valve.sides
    identified = {1: sides.get("positive"), -1: sides.get("negative")}
    chosen = [guard for sign, guard in guards.items() if (side := identified[sign]) and side.certificate.guard != guard]
    if chosen:
        return ZERO_FLOW.check(
            holds=None,
            text=f"the {chosen[0]} threshold was chosen to be guarded, above the one at which the valve closes: "
            f"{worst.q_zero_L_min:.4g} L/min after closing (at {worst.dp_MPa:.2f} MPa) is the price of that choice. "
            "Design with --guard closing to have none",
        )
    if not plant_given and "opening" in guards.values():
        return ZERO_FLOW.check(
            holds=None,
            text="no falling branch was recorded, so where the valve closes is not known; valves close below where "
            "they open, and flow at zero command after closing is to be expected. Record the falling branch",
        )
    return ZERO_FLOW.check(
        holds=worst.q_zero_L_min <= NO_FLOW_L_MIN,
        text=f"at most {worst.q_zero_L_min:.4g} L/min after closing (at {worst.dp_MPa:.2f} MPa), "
        f"{max(ramp.q_zero_without_beta_L_min for ramp in ramps):.3g} L/min without beta",
    )


def shut_after_scenarios(scenarios: Sequence[ScenarioResult], zero_flow: Check, *, plant_given: bool) -> Check:
    """Tell whether the valve is shut at zero command after everything that a core can know of, and what it can't.

    Where the flow at zero command could not be checked, this can't be; a plant that is given sees all scenarios.
    """
    required = [each for each in scenarios if each.must_shut]
    worst = max(required, key=lambda each: each.q_zero_L_min)
    text = f"{len(required)} runs of {len({each.name for each in required})} scenarios: at most "
    text += f"{worst.q_zero_L_min:.4g} L/min ({worst.name}, at {worst.dp_MPa:.2f} MPa)"
    if hidden := [each for each in scenarios if not each.must_shut]:
        leak = max(hidden, key=lambda each: each.q_zero_L_min)
        text += f"; not required, as no core can know of it or it has no zero band: {leak.name}, {leak.q_zero_L_min:.2g} L/min"
    if not plant_given:
        text += "; load steps and frozen sensors were not tried, which needs a plant (--plant)"
    if zero_flow.holds is None:
        return ZERO_FLOW_AFTER_SCENARIOS.check(holds=None, text=f"{text}; see the ramps")
    return ZERO_FLOW_AFTER_SCENARIOS.check(holds=worst.q_zero_L_min <= NO_FLOW_L_MIN, text=text)
