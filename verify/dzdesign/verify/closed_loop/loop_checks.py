"""What the closed loop must show: the plant opens where the valve does, and at zero command nothing flows, or no more
than was declared."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED, RELEASED
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.closed_loop.ramps import BIN
from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW
from dzdesign.verify.loop_results import PressureResult, ScenarioResult
from dzdesign.verify.requirements import (
    CURRENT_VALVE,
    PLANT_IS_THE_VALVE,
    PLANT_OPENS,
    ZERO_FLOW,
    ZERO_FLOW_AFTER_SCENARIOS,
    Check,
    Requirement,
)

#: How the names of a sensor's failures begin that signals with a live zero would show.
OPEN_CIRCUITS = tuple(f"sensor {name} {fails}" for name in "AB" for fails in ("breaks", "is shorted"))
#: What was tried, by the reason why it is not required.
TRIED = {
    NO_CORE_CAN_KNOW: "disturbances that the firmware cannot detect",
    NOT_DECLARED: "coil and supply of an undeclared machine",
}
#: Share of full command by which the opening of a plant may differ from the identified valve's: rounding, a quick ramp.
SAME_THRESHOLD = 0.03
#: The same of a stand-in's thresholds, and so many standard errors of the knee more.
SAME_CURVE, KNEE_ERRORS = 0.01, 5.0
#: Share of a test's largest flow by which a stand-in's mean flow in a bin of command may differ from the recorded one.
SAME_FLOW = 0.03
#: By how much the dead zone on opening may move with coil and supply, of full command, where the current is controlled.
MOST_MOVED = 0.003
#: Runs of a scenario pass the same flow within this share of it: the scenario itself sets their pressure drop.
ALIKE = 1e-3
Result = PressureResult | ScenarioResult


def loop_checks(
    ramps: Sequence[PressureResult], scenarios: Sequence[ScenarioResult], compensator: Compensator, *, plant_given: bool
) -> tuple[Check, ...]:
    """Return all of them, in the order of the report."""
    zero_flow, valve = no_flow_at_zero(ramps, compensator, plant_given=plant_given), compensator.valve
    units = valve.recorded_units
    return (
        plant_opens(ramps, units),
        plant_is_the_valve(ramps, valve) if plant_given else stand_in_is_the_recording(ramps, valve),
        zero_flow,
        shut_after_scenarios(scenarios, zero_flow, units, plant_given=plant_given),
        *([opens_with_any_coil(scenarios, units)] if compensator.current_drive else []),
    )


def plant_opens(ramps: Sequence[PressureResult], units: RecordedUnits) -> Check:
    """Tell whether flow passes at full command: of a plant that stays shut, or whose motion is not finite, the other
    figures of the closed loop say nothing."""
    least = min(ramps, key=lambda ramp: ramp.q_max_L_min)
    return PLANT_OPENS.check(
        holds=least.q_max_L_min > NO_FLOW_L_MIN,
        text=f"least flow at full command {units.text(least.q_max_L_min, '.4g L/min')} (at {_at(least, units)})",
    )


def plant_is_the_valve(ramps: Sequence[PressureResult], valve: ValveModel) -> Check:
    """Tell whether the plant opens, and closes, where the ramp tests say that the valve does."""

    def later_V(ramp: PressureResult, share: float, knee_V: float | None) -> float:
        return share * valve.u_max_V - (nearest_test(ramp, valve).u_guard_V if knee_V is None else knee_V)

    def opens_V(ramp: PressureResult) -> float:
        return later_V(ramp, ramp.dead_zone_opening, nearest_test(ramp, valve).u_knee_rising_V)

    def closes_V(ramp: PressureResult) -> float:
        return later_V(ramp, ramp.dead_zone_closing, nearest_test(ramp, valve).u_knee_falling_V)

    worst = max(ramps, key=lambda ramp: abs(opens_V(ramp)))
    early = max(ramps, key=closes_V)  # shut where the valve still passes flow
    plant_V, units = worst.dead_zone_opening * valve.u_max_V, valve.recorded_units
    holds = max(abs(opens_V(worst)), closes_V(early)) <= SAME_THRESHOLD * valve.u_max_V
    plant_at, valve_at = (units.of_side(worst.side).text(at, ".2f V") for at in (plant_V, plant_V - opens_V(worst)))
    text = f"at {plant_at}, the ramp tests at {valve_at} (worst case, at {_at(worst, units)}); "
    if closes_V(early) > SAME_THRESHOLD * valve.u_max_V:
        above = units.of_side(early.side).text(closes_V(early), ".2f dV")
        text += f"it closes {above} above the ramp tests (at {_at(early, units)}); "
    text += _miss(max(ramps, key=lambda ramp: ramp.flow_miss), valve)
    if not holds:
        text += "; the closed loop is of another valve: correct preload, spring or force in --plant"
    return PLANT_IS_THE_VALVE.check(holds=holds, text=text)


def stand_in_is_the_recording(ramps: Sequence[PressureResult], valve: ValveModel) -> Check:
    """Tell whether a stand-in is the identified valve: it opens and closes at the thresholds, its flow is recorded."""
    worst = max(ramps, key=lambda ramp: ramp.flow_miss)
    moved_V, what, moved = max((each for ramp in ramps for each in _moved(ramp, valve)), key=lambda each: each[0])
    if moved_V > 0.0:
        units = valve.recorded_units
        volts = units.of_side(moved.side).text(moved_V, ".2f dV")
        text = (
            f"the recorded flow of '{nearest_test(moved, valve).source}' {what} {volts} further from its threshold (at "
            f"{_at(moved, units)}) than {SAME_CURVE:.0%} of full command and {KNEE_ERRORS:g} standard errors. So this "
            "plant does not represent the valve, perhaps because of many outliers: record it again, or give a plant "
            "(--plant)"
        )
        return PLANT_IS_THE_VALVE.check(holds=False, text=text)
    holds = worst.flow_miss <= SAME_FLOW
    text = f"{_miss(worst, valve)}; expected {SAME_FLOW:.0%} at most"
    if not holds:
        text += (
            f". Look at '{nearest_test(worst, valve).source}' there (identify --plots) for a drop-out or spikes of the "
            "flow. Leave those rows out, or record the ramp again, and identify again"
        )
    return PLANT_IS_THE_VALVE.check(holds=holds, text=text)


def _moved(ramp: PressureResult, valve: ValveModel) -> Iterator[tuple[float, str, PressureResult]]:
    """Give by how much a stand-in opens and closes beyond what it may beside its test's onset and knee, V."""
    test = nearest_test(ramp, valve)
    for what, share, onset_V, knee_V, se_V in (
        ("opens", ramp.dead_zone_opening, test.u_onset_rising_V, test.u_knee_rising_V, test.u_knee_rising_se_V),
        ("closes", ramp.dead_zone_closing, test.u_onset_falling_V, test.u_knee_falling_V, test.u_knee_falling_se_V),
    ):
        ends_V, at_V = [each for each in (onset_V, knee_V) if each is not None], share * valve.u_max_V
        allowed_V = SAME_CURVE * valve.u_max_V + KNEE_ERRORS * (se_V or 0.0)
        yield (max(min(ends_V) - at_V, at_V - max(ends_V)) - allowed_V if ends_V else 0.0), what, ramp


def nearest_test(ramp: PressureResult, valve: ValveModel) -> TestResult:
    """Return the ramp test nearest to that pressure drop."""
    return min(valve.sides[ramp.side].tests, key=lambda test: abs((test.dp_MPa or 0.0) - ramp.dp_MPa))


def _at(where: Result, units: RecordedUnits) -> str:
    return units.text(where.dp_MPa, ".2f MPa")


def _miss(worst: PressureResult, valve: ValveModel) -> str:
    """Say how near the plant's flow is to the recorded one, and where it is furthest from it."""
    units = valve.recorded_units
    command = units.of_side(worst.side).text(worst.flow_miss_at * valve.u_max_V, ".2f V")
    side = f", {worst.side} side" if len(valve.sides) > 1 else ""
    return (
        f"averaged over {BIN:.0%} of command, its flow deviates from the recorded one by at most "
        f"{worst.flow_miss:.1%} of the largest flow (at {command} and {_at(worst, units)}{side})"
    )


def no_flow_at_zero(ramps: Sequence[PressureResult], compensator: Compensator, *, plant_given: bool) -> Check:
    """Tell whether the valve is shut at zero command, after closing.

    A stand-in closes where the recorded flow, continued below the noise level, comes to none.
    """
    worst, units = max(ramps, key=_zero_flow), compensator.valve.recorded_units
    leakiest = max(ramps, key=lambda ramp: ramp.q_zero_without_beta_L_min)
    guards = {sign: compensator.side(sign).certificate.guard for sign in compensator.signals.signs}
    chosen = [guard for sign, guard in guards.items() if compensator.valve.side(sign).certificate.guard != guard]
    if chosen:
        return ZERO_FLOW.check(
            holds=None,
            text=f"the guard is the {chosen[0]} threshold, which lies above the closing threshold: "
            f"{_flow(worst, worst.q_zero_L_min, units)} after closing (at {_at(worst, units)}) is the price of that "
            "choice. Design with --guard closing to avoid it",
        )
    if not plant_given and "opening" in guards.values():
        return ZERO_FLOW.check(
            holds=None,
            text="no falling branch was recorded, so the closing threshold is unknown; it lies below the opening "
            "threshold, and flow at zero command after closing is to be expected. Record the falling branch",
        )
    after_closing = f"{_flow(worst, worst.q_zero_L_min, units)} after closing (at {_at(worst, units)})"
    if _all_shut(ramps):
        after_closing = f"{units.text(0.0, '.4g L/min')} after closing, at every pressure drop tried"
    return ZERO_FLOW.check(
        holds=worst.q_beyond_L_min <= NO_FLOW_L_MIN,
        text=f"{after_closing}{_allowed(worst, units)}{_leak(ramps, units)}; for comparison, a constant offset passes "
        f"{_flow(leakiest, leakiest.q_zero_without_beta_L_min, units)}",
        name=_name(ZERO_FLOW, worst),
    )


def _all_shut(results: Sequence[PressureResult] | Sequence[ScenarioResult]) -> bool:
    """Tell whether nothing at all passes at zero in any of them, so that none is the worst."""
    return not any(each.q_zero_L_min or each.unseen_below_L_min for each in results)


def _zero_flow(result: Result) -> tuple[float, float]:
    """Return what passes at zero beyond what is allowed, and below what it is not known: the worst is the largest."""
    return result.q_beyond_L_min, result.unseen_below_L_min or 0.0


def _name(requirement: Requirement, worst: Result) -> str:
    """Return what is required: no flow, or no more than the declared one."""
    if worst.allowed_at_zero_L_min is None:
        return requirement.title
    return requirement.title.replace("no flow", "no more than the declared zero flow", 1)


def _allowed(worst: Result, units: RecordedUnits) -> str:
    """Say which flow is allowed at zero command, where one was declared."""
    allowed = worst.allowed_at_zero_L_min
    if not allowed:
        return ""
    at_most = units.text(allowed, ".3g L/min")
    return f"; {at_most} are allowed, leak included: the declared zero flow, or leak plus noise level"


def _leak(ramps: Sequence[PressureResult], units: RecordedUnits) -> str:
    """Say what leaks without any drive: it is in every flow at zero command, and no failure of the compensator."""
    worst = max(ramps, key=lambda ramp: ramp.leak_L_min)
    if worst.leak_L_min <= NO_FLOW_L_MIN:
        return ""
    return (
        f"; {units.text(worst.leak_L_min, '.2g L/min')} of it (at {_at(worst, units)}) leak through the closed valve, "
        "which no compensator can stop"
    )


def _flow(where: Result, flow_L_min: float, units: RecordedUnits) -> str:
    """Return a flow; where the recordings can't show it, below what, and what their first flows, continued, say."""
    unseen = where.unseen_below_L_min
    if unseen is None or flow_L_min >= unseen:
        return f"at most {units.text(flow_L_min, '.4g L/min')}"
    opened = flow_L_min - where.leak_L_min
    more = ""
    if opened > NO_FLOW_L_MIN:
        more = f": {units.text(opened, '.2g L/min')} by extrapolation of the first flow seen"
    return f"below {units.text(unseen, '.2f L/min')} (less than the recordings show{more})"


def shut_after_scenarios(
    scenarios: Sequence[ScenarioResult], zero_flow: Check, units: RecordedUnits, *, plant_given: bool
) -> Check:
    """Tell whether the valve is shut at zero command after everything that a core can know of, and what it can't.

    Where the flow at zero command could not be checked, this can't be; a plant that is given sees all scenarios.
    """
    required = [each for each in scenarios if each.must_shut]
    worst = max(required, key=_zero_flow)
    text = f"{len(required)} runs of {len({each.name for each in required})} scenarios, "
    if _all_shut(required):
        text += f"{units.text(0.0, '.4g L/min')} in each"
    else:
        text += f"{_flow(worst, worst.q_zero_L_min, units)} (worst: {worst.name}"
        text += f"{in_which_runs(worst, required, units)})"
    text += _allowed(worst, units)
    if not plant_given and not any(each.is_load_step for each in scenarios):
        text += "; load steps, and readings stuck during one, were not tried: they need ramps at two pressure drops, "
        text += "or --plant"
    requirement, beside = ZERO_FLOW_AFTER_SCENARIOS, _not_required(scenarios, units)
    if zero_flow.holds is None:
        return requirement.check(holds=None, text=f"{text}; see the ramps", not_required=beside)
    return requirement.check(
        holds=worst.q_beyond_L_min <= NO_FLOW_L_MIN, text=text, name=_name(requirement, worst), not_required=beside
    )


def in_which_runs(worst: ScenarioResult, among: Sequence[ScenarioResult], units: RecordedUnits) -> str:
    """Say at which pressure drop the worst run of a scenario was; nothing where all its runs pass the same flow."""
    flows = [each.q_zero_L_min for each in among if each.name == worst.name]
    if len(flows) > 1 and max(flows) - min(flows) <= ALIKE * max(flows):
        return ""
    return f"; in the runs for {_at(worst, units)}"


def _not_required(scenarios: Sequence[ScenarioResult], units: RecordedUnits) -> tuple[str, ...]:
    """Say what passes at zero command after scenarios in which no flow is not required: a sentence for each reason."""
    found = []
    for reason in dict.fromkeys(each.not_required for each in scenarios if not each.must_shut):
        others = [each for each in scenarios if each.not_required == reason]
        most, count = max(others, key=_zero_flow), len({each.name for each in others})
        text = f"{TRIED.get(reason, reason)}: {count} scenario{'' if count == 1 else 's'}, "
        text += f"{_flow(most, most.q_zero_L_min, units)} at zero command (worst: {most.name}"
        text += f"{in_which_runs(most, others, units)})"
        if reason == NO_CORE_CAN_KNOW and any(each.name.startswith(OPEN_CIRCUITS) for each in others):
            text += "; signals with a live zero and headroom above the span would reveal the failed sensor"
        found.append(text)
    return tuple(found)


def opens_with_any_coil(scenarios: Sequence[ScenarioResult], units: RecordedUnits) -> Check:
    """Tell whether coil and supply leave the valve's opening where it is, and none of them opens it at zero command."""
    found = [each for each in scenarios if RELEASED in each.figures]
    openings: dict[tuple[str, float], list[float]] = {}
    for each in found:
        openings.setdefault((each.side, each.dp_MPa), []).append(each.figures["dead_zone_on_opening_percent"] / 100)
    moved, (_, dp_MPa) = max((max(shares) - min(shares), at) for at, shares in openings.items())
    on_release = [replace(each, q_zero_L_min=_released(each)) for each in found]
    beyond = max(each.q_beyond_L_min for each in (*found, *on_release))
    closed, released = max(found, key=_zero_flow), max(found, key=_released)
    text = (
        f"{len(found)} ramps, with the declared coil and at the limits of coil and supply: the dead zone on opening "
        f"moves by {moved:.2%} of full command (at {units.text(dp_MPa, '.2f MPa')}; allowed: {MOST_MOVED:.1%}); the "
        f"flow at zero command after closing is {_flow(closed, closed.q_zero_L_min, units)}; on release, as the set "
        f"point steps to the offset, it is {_flow(released, _released(released), units)}"
    )
    return CURRENT_VALVE.check(holds=moved <= MOST_MOVED and beyond <= NO_FLOW_L_MIN, text=text)


def _released(result: ScenarioResult) -> float:
    return result.figures[RELEASED]
