"""Why our numbers miss the paper's: each reason with its own figures, and the range of values that it can explain."""

import math
from collections.abc import Callable
from itertools import product as combinations
from typing import NamedTuple

from dzdesign.derivation.account import published as paper
from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, FIRST, SIMULATION, U_MAX_V
from dzdesign.reproduce.recovered_valves import AtRest, half_digit, printed_at
from dzdesign.reproduce.runs import ValveRuns
from dzdesign.verify.closed_loop.loop import RECORD_S
from dzdesign.verify.closed_loop.ramps import FLOW_SHARE

Range = tuple[float, float]
#: By how much the closed loop may differ from the plant at rest, as a share.
OF_THE_LOOP = 0.01
#: A command is read between two records of a ramp, as in the paper (section 4.1), percent of full command.
ONE_RECORD_PERCENT = RECORD_S
#: A flow that prints as none, L/min.
PRINTED_NONE_L_MIN = 0.005
#: By how much the end of the product's transition may lie off the opening threshold: four codes of the command, in per
#: cent of full command.
OF_TRANSITION_PERCENT = 400 / int(paper.LARGEST_CODE)
#: Where a flow that grows up to full command comes within 0.1 % of its largest, V.
AT_THE_END_V = (0.99 * U_MAX_V, float(U_MAX_V))
DISPLACEMENT, DISPLACEMENT_DEAD_ZONE = "largest displacement", "spool's dead zone"
METER_L_MIN = float(paper.METER_ACCURACY_L_MIN)
DROP = f"taken {paper.DROP_ASSUMED}"
LAW_AT_FULL_COMMAND = "Eq. (18) gives full command at full command, so the valve has the flow that it has without it"
DUTY_OF_ONE = "Fig. 13 does not name its valve: of the two rows one at most can agree"


class Oil(NamedTuple):
    """Oil of Fig. 22: its temperature in °C, viscosity and density over those at the middle one."""

    temperature_C: float
    viscosity: float
    density: float


#: A mineral oil of 46 mm²/s at 40 °C, as ISO 3448 grades it: viscosity by its usual index of 100, density falling by
#: 0.65 kg/m³ per K.
OILS = (Oil(30, 1.59, 1.0076), Oil(40, 1.0, 1.0), Oil(50, 0.66, 0.9924))


class Reason(NamedTuple):
    """Why ours misses a printed number, and the range of values that this can explain."""

    text: str
    reach: Range


def around(published: str, room: float = 0.0) -> Range:
    """Return the range about a printed number: its rounding, and a measurement error."""
    reach = half_digit(published) + room
    return float(published) - reach, float(published) + reach


def of_the_digits(formula: Callable[..., float], *published: str) -> Range:
    """Return the least and the largest value of a formula of printed numbers, within their digits."""
    values = [formula(*corner) for corner in combinations(*map(around, published))]
    return min(values), max(values)


def displacement(quantity: str, dp_MPa: float) -> Reason:
    """Say what Eq. (24) makes of Fig. 6 in both readings of the displacement's dead zone, within the printed digits.

    With preload, as of the valves that are run, it is a share of the command, that of the flow; with overlap it is the
    travel that opens nothing, as a share of the largest displacement (T6e of the derivation).
    """
    printed, dead = printed_at(SIMULATION, dp_MPa), SIMULATION.displacement_dead_zone0_percent
    text, unit = (
        (printed.stroke_mm, "mm") if quantity == DISPLACEMENT else (printed.displacement_dead_zone_percent, "%")
    )
    digits = (SIMULATION.stroke0_mm, dead, printed.dead_zone_percent, SIMULATION.flow0, SIMULATION.flow1)

    def opening_left(flow0: float, flow1: float) -> float:
        """Return the share of the opening at the reference that the largest flows leave, Eq. (24)."""
        return 1.0 if dp_MPa == DP0_MPA else flow1 / flow0 / math.sqrt(DP1_MPA / DP0_MPA)

    def with_preload(stroke: float, share: float, dead_zone: float, flow0: float, flow1: float) -> float:
        return stroke * opening_left(flow0, flow1) if quantity == DISPLACEMENT else dead_zone

    def with_overlap(stroke: float, share: float, dead_zone: float, flow0: float, flow1: float) -> float:
        travel = share / 100 + (1 - share / 100) * opening_left(flow0, flow1)
        return stroke * travel if quantity == DISPLACEMENT else share / travel

    low, high = around(text)
    formulas = {"preload": with_preload, "overlap": with_overlap}
    readings = {name: of_the_digits(formula, *digits) for name, formula in formulas.items()}
    reach = {name: f"{least:.2f} to {most:.2f} {unit} with {name}" for name, (least, most) in readings.items()}
    possible = [name for name, (least, most) in readings.items() if least <= high and most >= low]
    found = "the paper contradicts itself in both readings"
    if possible:
        found = "within the rounding" if "preload" in possible else "only with overlap, which the valves here lack"
    middle = with_preload(*map(float, digits))
    return Reason(
        f"{found}: by Eq. (24) its other digits allow {reach['preload']}, {reach['overlap']}",
        (middle * (1 - OF_THE_LOOP), middle * (1 + OF_THE_LOOP)),
    )


def offset_percent(dead_zone0: float, residual: float) -> float:
    """Return the offset with which Eq. (14) leaves a dead zone, all in percent of full command."""
    return (dead_zone0 - residual) / (1 - residual / 100)


def residual(runs: ValveRuns, dp_MPa: float) -> Reason:
    """Say where the product's flow begins, and which offset the printed dead zone asks for.

    With a meter, the product's dead zone is where a straight line from zero reaches what the meter shows.
    """
    valve, line = runs.valve.published, ideal_line_percent(runs, dp_MPa)
    if line is None:
        low, high = runs.zero_band_percent, runs.zero_band_percent + runs.transition_percent + 100 * FLOW_SHARE
        text = (
            f"nothing passes at zero command: behind the zero band of {low:.2f} % the product's flow begins in its "
            f"transition of {runs.transition_percent:.2f} % to the opening threshold"
        )
    else:
        low, high = line - OF_TRANSITION_PERCENT, line + OF_TRANSITION_PERCENT
        text = (
            f"nothing passes at zero command: a straight line from there to the largest flow reads {line:.2f} % where "
            f"the meter starts, the product to {OF_TRANSITION_PERCENT:.2f} % the same"
        )
    printed, rest = printed_at(valve, dp_MPa).dead_zone_percent, AtRest(runs.valve.plant, dp_MPa)
    asked_V = U_MAX_V / 100 * offset_percent(float(printed), float(valve.residual_percent))
    passes = rest.flow_per_volt * (asked_V - rest.opens_V)
    text += f"; by Eq. (14) {valve.residual_percent} % ask for an offset of {asked_V:.2f} V" + (
        f", which pass {passes:.2f} L/min at zero command" if passes > 0 else f" (it opens at {rest.opens_V:.2f} V)"
    )
    return Reason(text, (low, high))


def ideal_line_percent(runs: ValveRuns, dp_MPa: float) -> float | None:
    """Return what a straight line from zero command to the printed largest flow reads; None without a meter."""
    largest = float(printed_at(runs.valve.published, dp_MPa).flow)
    return 100 * runs.valve.level_L_min / largest if runs.valve.level_L_min else None


def flow_with(runs: ValveRuns, dp_MPa: float) -> Reason:
    """Say why the law can't make the largest flow larger, and which pressure drop would."""
    valve, printed = runs.valve.published, printed_at(runs.valve.published, dp_MPa)
    change, room = float(printed.flow_with) - float(printed.flow), METER_L_MIN
    exponent = math.log(float(valve.flow1) / float(valve.flow0)) / math.log(DP1_MPA / DP0_MPA)
    needed = dp_MPa * (float(printed.flow_with) / float(printed.flow)) ** (1 / exponent)
    text = (
        f"{LAW_AT_FULL_COMMAND}; the paper prints {change:.1f} L/min more, beyond its meter's accuracy of {room:g} "
        f"L/min: as flows grow between its two pressure drops (T7a), {needed:.1f} MPa in place of {dp_MPa:g} would "
        "pass that much"
    )
    return Reason(text, around(printed.flow))  # whoever drives the valve, at full command it is that without


def about_largest() -> Reason:
    """Say that the paper has three numbers for one flow."""
    apart, room = float(paper.ABOUT_LARGEST_L_MIN) - float(FIRST.flow1), METER_L_MIN
    text = (
        f"the paper prints {FIRST.flow1} L/min without and {FIRST.flow1_with} with compensator for the same valve and "
        f"pressure drop, and about {paper.ABOUT_LARGEST_L_MIN}, {apart:.1f} apart where its meter is off by {room:g}; "
        "the fit follows the first"
    )
    return Reason(text, around(FIRST.flow1))


def zero_without_beta(runs: ValveRuns) -> Reason:
    """Say what the printed dead zones make of it, and by what the product's offset is lower.

    T3b of the derivation; where a meter shows the dead zones, its floor passes at them.
    """
    valve, floor = runs.valve.published, runs.valve.level_L_min
    low, high = of_the_digits(
        lambda first, second, flow: floor + (flow - floor) * (first - second) / (100 - second),
        valve.dead_zone0_percent, valve.dead_zone1_percent, valve.flow1,
    )  # fmt: skip
    opens0, opens1 = (AtRest(runs.valve.plant, each).opens_V for each in (DP0_MPA, DP1_MPA))
    text = (
        f"the paper's law with the printed dead zones passes {low:.2f} to {high:.2f} L/min (T3b); the product's offset "
        f"is no higher than {opens1:.2f} V, where the valve opens at {DP1_MPA} MPa, though at {DP0_MPA} MPa at "
        f"{opens0:.2f} V: none passes without beta either"
    )
    return Reason(text, (0.0, PRINTED_NONE_L_MIN))


def no_saturation() -> Reason:
    """Say why the recovered valve has no stop."""
    stopped, printed = (DP1_MPA / DP0_MPA) ** 0.5, float(FIRST.flow1) / float(FIRST.flow0)
    text = (
        f"the recovered valve has no stop: one that is met at both pressure drops would by Eq. (24) pass {stopped:.2f} "
        f"times the flow at {DP1_MPA} MPa, the paper prints {printed:.2f} times; the fit follows the flows"
    )
    return Reason(text, AT_THE_END_V)


def temperature(runs: ValveRuns) -> Reason:
    """Say what of the plant depends on the oil's temperature, and how much that moves what the meter shows."""
    per_volt = AtRest(runs.valve.plant, paper.LOAD_DP_MPA).flow_per_volt
    densities = [oil.density for oil in OILS]
    roots = math.sqrt(max(densities)) - math.sqrt(min(densities))
    moves = 1e3 * float(paper.METER_FLOOR_L_MIN) / per_volt * roots / U_MAX_V
    printed = paper.TEMPERATURE_CHANGE_PER_MILLE
    text = (
        "in Eqs. (19)-(24) no threshold depends on the temperature, as Assumption 1 says: only the density moves the "
        f"command at which the meter starts, by {moves:.2f} of 1000 over the assumed oils; {printed} of 1000 would be "
        f"{float(printed) * U_MAX_V:g} mV"
    )
    return Reason(text, (0.0, moves * (1 + OF_THE_LOOP)))


def duty(runs: ValveRuns) -> Reason:
    """Say which offsets a duty cycle tells of."""
    valve, share = runs.valve.published, paper.DUTY_COMMAND_V / U_MAX_V
    seen, half = float(valve.dead_zone0_percent), half_digit(valve.dead_zone0_percent)
    opens1 = 100 / U_MAX_V * AtRest(runs.valve.plant, DP1_MPA).opens_V
    # Eq. (14) by hand
    low, middle, high = (100 * share + (1 - share) * offset for offset in (opens1, seen, seen + half))
    asked = (float(paper.DUTY_WITH_PERCENT) / 100 - share) / (1 - share) * U_MAX_V
    text = (
        f"by Eq. (14) an offset of {seen:g} %, where the paper's meter shows the first flow, makes {middle:.1f} %; the "
        f"product's lies where the valve opens, at {opens1 * U_MAX_V / 100:.2f} V or above: {low:.1f} to {high:.1f} %; "
        f"{paper.DUTY_WITH_PERCENT} % ask for {asked:.2f} V"
    )
    return Reason(text, (low, high))
