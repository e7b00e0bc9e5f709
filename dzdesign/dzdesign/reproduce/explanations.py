"""Why our numbers may differ from the paper's, and by how much: each reason with its own figures."""

from collections.abc import Mapping

from dzdesign.derivation.account.published import (
    DP0_MPA,
    DP1_MPA,
    DROP_ASSUMED,
    FIRST,
    METER_ACCURACY_L_MIN,
    METER_FLOOR_L_MIN,
    SATURATED_FROM_V,
    U_MAX_V,
)
from dzdesign.reproduce.recovered_valves import at_rest, printed_at
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRODUCT, Drive, ValveRuns

#: What reading our own runs may cost: per cent of full command, share of a flow, L/min at zero command; and what
#: "about" is taken to mean, as a share.
READING: Mapping[str, float] = {"%": 0.1, "L/min": 0.005, "L/min at zero": 0.05, "about": 0.1}
#: A flow that prints as none, L/min.
PRINTED_NONE = 0.005
#: Per cent of command that the certified margin may cost: identification's own goal.
MARGIN_PERCENT = 0.8
#: What "little effect" on the step response is taken to mean: a share of its time.
LITTLE = 0.2
TOLERANCES: Mapping[str, str] = {
    "fitted": f"half a unit of the last printed digit, and for reading the closed loop {READING['%']:g} % of full "
    f"command, {100 * READING['L/min']:g} % of a flow",
    "rounding": "half a unit of the last printed digit",
    "flow": f"half a unit of the last printed digit, and {100 * READING['L/min']:g} % for reading the closed loop",
    "metered flow": f"half a unit of the last printed digit, and the meter's accuracy, 0.5 % of its range: "
    f"{float(METER_ACCURACY_L_MIN):g} L/min",
    "residual": "at most what is printed and half a unit of its last digit: a smaller dead zone is no fault",
    "metered residual": "at most what is printed and half a unit of its last digit, or, if that is more, the "
    "command that the meter's floor takes where no flow is hidden at zero command, and "
    f"{MARGIN_PERCENT:g} % for the certified margin",
    "about": f"{100 * READING['about']:g} %: the paper says 'about', and reads it off a figure; required of the "
    "paper's law alone",
    "none": f"of the product none ({PRINTED_NONE:g} L/min prints as 0.00); of the paper's law what its meter does "
    f"not show, and {READING['L/min at zero']:g} L/min for the rounding of the thresholds that it is made of",
    "step": f"'little' is taken as {100 * LITTLE:g} %",
}
DROP = f"taken {DROP_ASSUMED}"
#: Which valve Fig. 13 may be of.
DUTY_OF_SECOND = (
    "Fig. 13 does not name its valve; the product's offset lies below the threshold, the paper's at the first flow seen"
)
DUTY_OF_FIRST = "not required: Fig. 13 does not name its valve, and its 55 % fits the second"
#: The paper has three numbers for one flow.
ABOUT_LARGEST = (
    f"not required: the paper prints {FIRST.flow1} without and {FIRST.flow1_with} L/min with compensator for the same "
    "valve and pressure drop; the fit follows the former"
)
TEMPERATURE = (
    "not compared: the paper gives neither the temperatures nor the oil. In Eqs. (19)-(24) no threshold depends on it"
)


def displacement_beside(runs: ValveRuns) -> str:
    """Say why the displacement at dP1 can't be what is printed."""
    valve = runs.valve.published
    opening = float(valve.flow1) / float(valve.flow0) / (DP1_MPA / DP0_MPA) ** 0.5
    printed = float(valve.stroke1_mm) / float(valve.stroke0_mm)
    return (
        f"the paper contradicts itself: by Eq. (24) its flows of {valve.flow0} and {valve.flow1} L/min need the "
        f"opening to fall to {100 * opening:.1f} %, its displacements fall to {100 * printed:.1f} %; the fit follows "
        "the flows"
    )


def displacement_before_flow(runs: ValveRuns, dp_MPa: float) -> str:
    """Say why the displacement's dead zone can't exceed the flow's."""
    printed = printed_at(runs.valve.published, dp_MPa)
    return (
        "the paper contradicts itself: by Eq. (24) no flow starts before the spool moves, but it reads "
        f"{printed.displacement_dead_zone_percent} % of displacement and {printed.dead_zone_percent} % of flow; the "
        "fit follows the flow"
    )


def residual(runs: ValveRuns, dp_MPa: float) -> str:
    """Say what the printed dead zone with compensator tells of the paper's offset, which it does not print."""
    recovered = runs.valve
    valve = recovered.published
    ours = ""
    if (Drive(PRODUCT), dp_MPa) in runs.ramps:
        ours = f"; the product's is {runs.onset_percent(Drive(PRODUCT), dp_MPa):.2f} % without a meter between"
    if not recovered.level_L_min:
        return "the paper does not say how far below the threshold its offset stays, nor at what flow it reads" + ours
    printed = float(valve.residual_percent) / 100
    u_min0, u_min1 = (float(text) / 100 for text in (valve.dead_zone0_percent, valve.dead_zone1_percent))
    beta, seen = (1.0, u_min0) if dp_MPa == DP0_MPA else (u_min1 / u_min0, u_min1)
    gain = 1 - beta * u_min0  # of Eq. (18) with k x_max = u_max - u_min0
    rest = at_rest(recovered.plant, dp_MPa)
    hidden = float(rest.flow_per_volt) * (U_MAX_V * (seen - gain * printed) - float(rest.opens_V))
    floor = float(METER_FLOOR_L_MIN)
    what = (
        f"its offset lets {hidden:.2f} L/min pass at zero command, below what its meter shows"
        if hidden > 0
        else "its offset stays below the threshold"
    )
    return (
        f"read where the meter starts, {floor:g} L/min: a dead zone of {valve.residual_percent} % there means that "
        f"{what}; the paper prints no offset{ours}"
    )


def flow_with(flow: str, without: str, metered: bool, explained: bool) -> str:
    """Say why the law can't make the largest flow larger."""
    if not metered or flow == without:
        return ""
    law = "Eq. (18) gives full command at full command, so with it the valve has the flow that it has without"
    change = float(flow) - float(without)
    if explained:
        return f"{law}; the {change:.1f} L/min between both printed flows are within the meter's accuracy"
    return (
        f"not required: {law}, but the paper prints {change:.1f} L/min more, beyond its meter's accuracy of "
        f"{float(METER_ACCURACY_L_MIN):g} L/min; the recordings must differ in more than the compensator"
    )


def zero_without_beta(runs: ValveRuns) -> str:
    """Say by what the product's offset lies below the paper's."""
    recovered = runs.valve
    if not recovered.level_L_min:
        return "the product's offset stays below the threshold's certified bound, so without beta less passes too"
    opens = float(at_rest(recovered.plant, DP0_MPA).opens_V)
    seen = float(recovered.published.dead_zone0_percent) / 100 * U_MAX_V
    return (
        f"the paper's offset is the command of the first flow seen, {seen:.2f} V; the valve opens at {opens:.3f} V, "
        "and the product's offset stays below that, so without beta less passes too"
    )


def zero_with_beta(runs: ValveRuns) -> str:
    """Say what the paper's law lets pass under its meter's floor."""
    if not runs.valve.level_L_min:
        return ""
    return (
        f"with an offset at the first flow seen, the paper's law lets the meter's floor of "
        f"{runs.valve.level_L_min:g} L/min pass at zero command, which its meter does not show"
    )


def step(runs: ValveRuns) -> str:
    """Give the times."""
    times = ", ".join(
        f"{name} {runs.rise_ms(Drive(by)):.1f} ms"
        for by, name in ((DIRECT, "without"), (PAPER, "the paper's law"), (PRODUCT, "the product"))
        if Drive(by) in runs.steps
    )
    return f"the text gives no time and no parameters of the motion; those of the default plant: {times}"


def saturation(runs: ValveRuns) -> str:
    """Say why the recovered valve has no stop."""
    valve = runs.valve.published
    stopped = (DP1_MPA / DP0_MPA) ** 0.5
    printed = float(valve.flow1) / float(valve.flow0)
    return (
        f"not required: a spool that meets its stop from {SATURATED_FROM_V[0]} V on at both pressure drops would by "
        f"Eq. (24) pass {stopped:.2f} times the flow at {DP1_MPA} MPa, the paper prints {printed:.2f} times; the fit "
        "follows the flows, by a flow force and without a stop"
    )
