"""Why our numbers miss the paper's: each reason with its own figures, and the range of values that it can explain."""

import math
from collections.abc import Mapping
from itertools import product as combinations

from dzdesign.derivation.account.published import (
    ABOUT_LARGEST_L_MIN,
    DP0_MPA,
    DP1_MPA,
    DROP_ASSUMED,
    DUTY_COMMAND_V,
    DUTY_WITH_PERCENT,
    FIRST,
    LARGEST_CODE,
    LOAD_DP_MPA,
    METER_ACCURACY_L_MIN,
    METER_FLOOR_L_MIN,
    SIMULATION,
    TEMPERATURE_CHANGE_PER_MILLE,
    U_MAX_V,
    PublishedValve,
)
from dzdesign.reproduce.artefact import Driver
from dzdesign.reproduce.assumptions import OILS
from dzdesign.reproduce.displacement_readings import DISPLACEMENT, half_digits_off
from dzdesign.reproduce.offset_reading import offset_percent
from dzdesign.reproduce.recovered_valves import Reading, at_rest, half_digit, printed_at
from dzdesign.reproduce.rows import OF_THE_LOOP, ONE_RECORD_PERCENT, PRINTED_NONE_L_MIN, Reason
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRODUCT, Drive, ValveRuns
from dzdesign.verify.closed_loop.ramps import FLOW_SHARE

DROP = f"taken {DROP_ASSUMED}"
#: By how much the end of the product's transition may lie off the opening threshold: four codes of the command, in per
#: cent of full command.
OF_TRANSITION_PERCENT = 400 / int(LARGEST_CODE)
LAW_AT_FULL_COMMAND = "Eq. (18) gives full command at full command, so the valve has the flow that it has without it"
#: Where a flow that grows up to full command comes within 0.1 % of its largest, V.
AT_THE_END_V = (0.99 * U_MAX_V, float(U_MAX_V))
#: What the displacement's dead zone is a share of.
READINGS: Mapping[Reading, str] = {
    "overlap": "read as a share of the largest displacement, the travel that opens nothing: T6e of `dzdesign derive`",
    "preload": "read as a share of full command, that which moves nothing",
}
AMPLITUDE = "the level of an output pin, which no design sets: Figs. 12 and 13 are drawn with it"
DUTY_OF_ONE = "Fig. 13 does not name its valve: of the two rows one at most can agree"
LOAD = (
    "the paper gives neither the loads nor a number; ours is the largest change of the flow over the load at a "
    "constant pressure drop: only the rounding of the two sensors' codes is left"
)
OIL_FLOW = "the paper says that it rises with the oil's temperature; ours is the rise in per cent over the assumed oils"
NO_SATURATION = "the paper sees none: ours is the command at which the flow comes within 0.1 % of its largest"


def displacement(quantity: str, reading: Reading, dp_MPa: float) -> Reason:
    """Say whether the paper contradicts itself, or only this reading of Fig. 6 fails, or the rounding explains it."""
    off = {name: half_digits_off(name, quantity, dp_MPa) for name in ("overlap", "preload")}
    best = " and ".join(f"{number:.2f} with {name}" for name, number in off.items())
    found = f"beside the flow's numbers and the displacement at {DP0_MPA} MPa a valve of Eqs. (19)-(24) has it to "
    if min(off.values()) > 1:
        text = (
            f"the paper contradicts itself in both readings: {found}{best} half digits at best; by Eq. (24) "
            f"the opening has to fall to {100 * _opening_left():.1f} %"
        )
    elif off[reading] > 1:
        other = "overlap" if reading == "preload" else "preload"
        text = f"this reading can't have it, the one with {other} can: {found}{best} half digits at best"
    else:
        text = f"within the rounding of what it is predicted from: {found}{off[reading]:.2f} half digits at best"
    by_hand = _displacement_by_hand(quantity, reading, dp_MPa)
    return Reason(text, (by_hand * (1 - OF_THE_LOOP), by_hand * (1 + OF_THE_LOOP)))


def _opening_left() -> float:
    """Return the share of the opening at the reference that the largest flows leave beside it, Eq. (24)."""
    return float(SIMULATION.flow1) / float(SIMULATION.flow0) / math.sqrt(DP1_MPA / DP0_MPA)


def _displacement_by_hand(quantity: str, reading: Reading, dp_MPa: float) -> float:
    """Return what Eq. (24) makes of the printed flows: another way than the fit's."""
    if reading == "preload" and quantity != DISPLACEMENT:
        return float(printed_at(SIMULATION, dp_MPa).dead_zone_percent)  # the spool moves when the flow begins
    largest, share = float(SIMULATION.stroke0_mm), float(SIMULATION.displacement_dead_zone0_percent) / 100
    dead = largest * share if reading == "overlap" else 0.0
    travel = dead + (largest - dead) * (1.0 if dp_MPa == DP0_MPA else _opening_left())
    return travel if quantity == DISPLACEMENT else 100 * dead / travel


def residual(runs: ValveRuns, dp_MPa: float, by: Driver) -> Reason:
    """Say which offset the printed dead zone with compensator asks for, and what ours leaves instead."""
    recovered, valve = runs.valve, runs.valve.published
    if by == PRODUCT:
        return _residual_of_product(runs, dp_MPa)
    printed = printed_at(valve, dp_MPa).dead_zone_percent
    offset_V = float(printed) / 100 * U_MAX_V
    asked = U_MAX_V / 100 * offset_percent(float(printed), float(valve.residual_percent))
    rest = at_rest(recovered.plant, dp_MPa)
    passes = float(rest.flow_per_volt) * (asked - float(rest.opens_V))
    leaves = 100 * FLOW_SHARE if not recovered.level_L_min else 0.0
    text = (
        f"the offset is taken to be the dead zone that is printed, {offset_V:.2f} V at {dp_MPa:g} MPa, which leaves "
        f"none; {valve.residual_percent} % ask for {asked:.2f} V"
        + (f", which pass {passes:.2f} L/min at zero command" if passes > 0 else ", below where the valve opens")
        + f": see \"dead zone with, offset of {valve.residual_percent} %\""
    )
    # One digit of the printed dead zone, in the command before the compensator.
    rounding = (half_digit(printed) + ONE_RECORD_PERCENT) / (1 - offset_V / U_MAX_V)
    return Reason(text, (0.0, leaves + rounding))


def _residual_of_product(runs: ValveRuns, dp_MPa: float) -> Reason:
    """Say where the product's flow begins; with a meter, where a straight line from zero reaches what it shows."""
    band, transition = runs.product_zero_band_percent, runs.product_transition_percent
    if not runs.valve.level_L_min:
        text = (
            f"the product's zero band is {band:.2f} % and its transition to the opening threshold {transition:.2f} %: "
            f"flow begins in it, and nothing passes at zero command"
        )
        return Reason(text, (band, band + transition + 100 * FLOW_SHARE))
    level, largest = runs.valve.level_L_min, float(printed_at(runs.valve.published, dp_MPa).flow)
    line = 100 * level / largest
    more = level - float(runs.valve.published.residual_percent) / 100 * largest
    text = (
        f"nothing passes at zero command: a straight line from there to {largest:g} L/min reads {line:.2f} % where the "
        f"meter starts, the product to {OF_TRANSITION_PERCENT:.2f} % the same; on it the paper's valve has "
        f"{abs(more):.2f} L/min {'more' if more > 0 else 'less'} there"
    )
    return Reason(text, (line - OF_TRANSITION_PERCENT, line + OF_TRANSITION_PERCENT))


def flow_with(runs: ValveRuns, dp_MPa: float) -> Reason:
    """Say why the law can't make the largest flow larger, and which pressure drop would."""
    valve, printed = runs.valve.published, printed_at(runs.valve.published, dp_MPa)
    change, room = float(printed.flow_with) - float(printed.flow), float(METER_ACCURACY_L_MIN)
    exponent = math.log(float(valve.flow1) / float(valve.flow0)) / math.log(DP1_MPA / DP0_MPA)
    needed = dp_MPa * (float(printed.flow_with) / float(printed.flow)) ** (1 / exponent)
    text = (
        f"{LAW_AT_FULL_COMMAND}; the paper prints {change:.1f} L/min more, beyond its meter's accuracy of {room:g} "
        f"L/min: as flows grow between its two pressure drops (T7a), {needed:.1f} MPa in place of {dp_MPa:g} would "
        "pass that much"
    )
    return Reason(text, _as_without(printed.flow))


def _as_without(printed: str) -> tuple[float, float]:
    """Return what the flow at full command must be, whoever gives it: the printed one without compensator."""
    return float(printed) - half_digit(printed), float(printed) + half_digit(printed)


def flow_with_stop(runs: ValveRuns) -> Reason:
    """Say what the product's stop at the reference costs beside it."""
    opens0, opens1, stops = (
        float(each)
        for each in (
            at_rest(runs.valve.plant, DP0_MPA).opens_V,
            at_rest(runs.valve.plant, DP1_MPA).opens_V,
            at_rest(runs.valve.plant, DP0_MPA).stops_V,
        )
    )
    least = float(at_rest(runs.valve.plant, DP1_MPA).flow_per_volt) * (stops - opens0)
    text = (
        f"the product takes k x_max up to the stop, {stops - opens0:.2f} V at {DP0_MPA} MPa, and full command for no "
        f"more; at {DP1_MPA} MPa the flow force keeps the spool off its stop, and {U_MAX_V - opens1:.2f} V were left"
    )
    return Reason(text, (least * (1 - OF_THE_LOOP), float(FIRST.flow1)))


def about_largest() -> Reason:
    """Say that the paper has three numbers for one flow."""
    apart, room = float(ABOUT_LARGEST_L_MIN) - float(FIRST.flow1), float(METER_ACCURACY_L_MIN)
    text = (
        f"the paper prints {FIRST.flow1} L/min without and {FIRST.flow1_with} with compensator for the same valve and "
        f"pressure drop, and about {ABOUT_LARGEST_L_MIN}, {apart:.1f} apart where its meter is off by {room:g}; the "
        "fit follows the first"
    )
    return Reason(text, _as_without(FIRST.flow1))


def zero_without_beta(runs: ValveRuns, by: Driver) -> Reason:
    """Say what the rounding of the dead zones makes of it; of the product by what its offset lies below the paper's."""
    valve = runs.valve.published
    if by == PAPER:
        low, high = _rounding_of_zero_flow(valve)
        text = (
            f"within the rounding of the dead zones and the flow that it is predicted from: they allow {low:.3f} to "
            f"{high:.3f} L/min"
        )
        return Reason(text, (low, high))
    opens0, opens1 = (float(at_rest(runs.valve.plant, each).opens_V) for each in (DP0_MPA, DP1_MPA))
    text = (
        f"the product's offset is none of the paper's: two tests allow it no higher than {opens1:.2f} V, where the "
        f"valve opens at {DP1_MPA} MPa, though at {DP0_MPA} MPa at {opens0:.2f} V; so none passes without beta either"
    )
    return Reason(text, (0.0, PRINTED_NONE_L_MIN))


def _rounding_of_zero_flow(valve: PublishedValve) -> tuple[float, float]:
    """Return the least and the largest flow that T3b of the derivation gives within the printed digits."""
    texts = (valve.dead_zone0_percent, valve.dead_zone1_percent, valve.flow1)
    ends = [(float(text) - half_digit(text), float(text) + half_digit(text)) for text in texts]
    flows = [flow * (first - second) / (100 - second) for first, second, flow in combinations(*ends)]
    return min(flows), max(flows)


def step(runs: ValveRuns) -> str:
    """Give the times."""
    times = ", ".join(
        f"{name} {runs.rise_ms(Drive(by)):.1f} ms"
        for by, name in ((DIRECT, "without"), (PAPER, "the paper's law"), (PRODUCT, "the product"))
        if Drive(by) in runs.steps
    )
    return f"the text gives no time and no parameters of the motion; those of the default plant: {times}"


def no_stop_beside() -> Reason:
    """Say why the stop isn't met at the other pressure drop."""
    stopped, printed = (DP1_MPA / DP0_MPA) ** 0.5, float(FIRST.flow1) / float(FIRST.flow0)
    text = (
        f"a spool at its stop at both pressure drops would by Eq. (24) pass {stopped:.2f} times the flow at {DP1_MPA} "
        f"MPa, the paper prints {printed:.2f} times; the fit follows the flows, with a flow force that keeps the spool "
        "off its stop there"
    )
    return Reason(text, AT_THE_END_V)


def no_saturation_of_product() -> Reason:
    """Say why the product's curve isn't flat below full command."""
    text = "the product takes k x_max up to the stop, so that full command just meets it"
    return Reason(text, AT_THE_END_V)


def temperature(runs: ValveRuns) -> Reason:
    """Say what of the plant depends on the oil's temperature, and how much that moves what the meter shows."""
    per_volt = float(at_rest(runs.valve.plant, LOAD_DP_MPA).flow_per_volt)
    densities = [oil.density for oil in OILS]
    roots = math.sqrt(max(densities)) - math.sqrt(min(densities))
    moves = 1e3 * float(METER_FLOOR_L_MIN) / per_volt * roots / U_MAX_V
    text = (
        "in Eqs. (19)-(24) no threshold depends on the temperature, as Assumption 1 says: only the density moves the "
        f"command at which the meter starts, by {moves:.2f} of 1000 over the assumed oils; "
        f"{TEMPERATURE_CHANGE_PER_MILLE} of 1000 would be {float(TEMPERATURE_CHANGE_PER_MILLE) * U_MAX_V:g} mV"
    )
    return Reason(text, (0.0, moves + 10 * ONE_RECORD_PERCENT))


def duty(runs: ValveRuns, by: Driver) -> Reason:
    """Say which offsets a duty cycle tells of."""
    valve, share = runs.valve.published, DUTY_COMMAND_V / U_MAX_V
    seen, half = float(valve.dead_zone0_percent), half_digit(valve.dead_zone0_percent)
    opens1 = 100 / U_MAX_V * float(at_rest(runs.valve.plant, DP1_MPA).opens_V)
    low, high = (100 * share + (1 - share) * offset for offset in (opens1, seen + half))  # Eq. (14) by hand
    asked = (float(DUTY_WITH_PERCENT) / 100 - share) / (1 - share) * U_MAX_V
    if by == PRODUCT:
        text = (
            f"the product's offset is where the valve opens, at {opens1 * U_MAX_V / 100:.2f} V or above, the paper's "
            f"{seen * U_MAX_V / 100:g} V where its meter shows the first flow: by Eq. (14) {low:.1f} to {high:.1f} %; "
            f"{DUTY_WITH_PERCENT} % ask for {asked:.2f} V"
        )
        return Reason(text, (low, high))
    text = f"{DUTY_OF_ONE}; of an offset of {seen:g} % Eq. (14) makes {high - (1 - share) * half:.1f} %"
    return Reason(text, (high - 2 * (1 - share) * half, high))
