"""The paper prints no offset: the one that its dead zone with compensator asks for, and what follows from it.

Eq. (14) with an offset below the printed dead zone leaves what the paper reads with the compensator. One offset a valve
is taken from that at the reference; the dead zone off the reference, by the printed beta, is then a prediction, and so
is the flow at zero command without beta. All is worked out for the plant at rest.
"""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product as combinations

from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, METER_ACCURACY_L_MIN, U_MAX_V
from dzdesign.reproduce.artefact import Driver, PaperNumber
from dzdesign.reproduce.recovered_valves import RecoveredValve, at_rest, half_digit
from dzdesign.reproduce.rows import OF_THE_LOOP, Reason, Subject, command_around, flow_around, row
from dzdesign.reproduce.valve_runs import PAPER, PRESSURES_MPA, ValveRuns


def offset_percent(dead_zone0: float, residual: float) -> float:
    """Return the offset with which Eq. (14) leaves a dead zone, all in percent of full command."""
    return (dead_zone0 - residual) / (1 - residual / 100)


def of_the_offset(subject: Subject) -> Iterator[PaperNumber]:
    """Yield the dead zones with the recovered offset, and the flow at zero command where one is printed."""
    recovered = subject.runs.valve
    valve = recovered.published
    text = valve.residual_percent
    bare = Subject(runs=subject.runs)
    for dp_MPa in PRESSURES_MPA:
        fitted = dp_MPa == DP0_MPA
        offset_V = U_MAX_V / 100 * offset_percent(float(valve.dead_zone0_percent), float(text))
        yield row(
            bare, dp_MPa, f"dead zone with, offset of {text} %", "%", text, "fitted" if fitted else "predicted",
            partial(_given, _residual_percent(recovered, dp_MPa)), (PAPER,), allowed=command_around(text),
            tolerance="command", reasons={} if fitted else {PAPER: _of_the_digits(recovered)},
            why=f"with an offset of {offset_V:.2f} V, from what is printed at {DP0_MPA} MPa, and the printed beta",
        )  # fmt: skip
    if valve.zero_flow_without_beta:
        allowed, tolerance = flow_around(subject.runs, valve.zero_flow_without_beta)
        yield row(
            bare, PRESSURES_MPA[1], f"zero without beta, offset of {text} %", "L/min", valve.zero_flow_without_beta,
            "predicted", partial(_given, _zero_flow_L_min(recovered)), (PAPER,), allowed=allowed, tolerance=tolerance,
            reasons={PAPER: _contradiction(recovered)},
        )  # fmt: skip


def _of_the_digits(recovered: RecoveredValve) -> Reason:
    """Say what the digits of the dead zones make of the one left off the reference, and what remains as a flow."""
    low, high = _corners(recovered, _residual_at_dP1)
    printed = recovered.published.residual_percent
    half, text = half_digit(printed), f"the printed digits allow {low:.2f} to {high:.2f} %"
    if low <= float(printed) + half and high >= float(printed) - half:
        text = f"within the rounding of what it is predicted from: {text}"
    else:
        beyond = max(float(printed) - half - high, low - float(printed) - half)
        flow = beyond / 100 * float(recovered.published.flow1)
        text += (
            f"; the {beyond:.2f} % between these and {printed} % are {flow:.2f} L/min on the line, of a meter that is "
            f"off by {float(METER_ACCURACY_L_MIN):g}"
        )
    return Reason(text, (low, high))


def _given(value: float, runs: ValveRuns, by: Driver) -> float:
    return value


def _residual_percent(recovered: RecoveredValve, dp_MPa: float) -> float:
    """Return the dead zone that the paper's law leaves with the recovered offset, for the plant at rest."""
    valve, rest = recovered.published, at_rest(recovered.plant, dp_MPa)
    seen_V = float(rest.opens_V) + recovered.level_L_min / float(rest.flow_per_volt)
    offset = offset_percent(float(valve.dead_zone0_percent), float(valve.residual_percent))
    if dp_MPa != DP0_MPA:
        offset *= float(valve.dead_zone1_percent) / float(valve.dead_zone0_percent)  # Eq. (5)
    return (100 * seen_V / U_MAX_V - offset) / (1 - offset / 100)


def _zero_flow_L_min(recovered: RecoveredValve) -> float:
    """Return the flow that the recovered offset passes at zero command and dP1 without beta, for the plant at rest."""
    valve, rest = recovered.published, at_rest(recovered.plant, DP1_MPA)
    offset = offset_percent(float(valve.dead_zone0_percent), float(valve.residual_percent))
    return float(rest.flow_per_volt) * max(0.0, U_MAX_V * offset / 100 - float(rest.opens_V))


def _residual_at_dP1(dead_zone0: float, dead_zone1: float, residual: float) -> float:
    beta_offset = dead_zone1 / dead_zone0 * offset_percent(dead_zone0, residual)
    return (dead_zone1 - beta_offset) / (1 - beta_offset / 100)


def _corners(recovered: RecoveredValve, of: Callable[[float, float, float], float]) -> tuple[float, float]:
    """Return the least and the largest value of a formula of both dead zones and the one left, within their digits."""
    valve = recovered.published
    texts = (valve.dead_zone0_percent, valve.dead_zone1_percent, valve.residual_percent)
    ends = [(float(text) - half_digit(text), float(text) + half_digit(text)) for text in texts]
    values = [of(*corner) for corner in combinations(*ends)]
    return min(values), max(values)


def _contradiction(recovered: RecoveredValve) -> Reason:
    """Say that no offset has both numbers: that of the dead zone with compensator passes less without beta."""
    valve = recovered.published
    dead_zone1, flow1 = float(valve.dead_zone1_percent), float(valve.flow1)
    least, most = _corners(
        recovered, lambda first, second, left: flow1 * (offset_percent(first, left) - second) / (100 - second)
    )
    flow = float(valve.zero_flow_without_beta)
    asked = dead_zone1 + flow / flow1 * (100 - dead_zone1)  # T3b, solved for the offset
    offset = offset_percent(float(valve.dead_zone0_percent), float(valve.residual_percent))
    found = "within the rounding" if least <= flow <= most else "the paper contradicts itself"
    text = (
        f"{found}: {flow:g} L/min ask for an offset of {asked:.1f} %, a dead zone of "
        f"{valve.residual_percent} % for {offset:.1f} %; its digits allow {least:.2f} to {most:.2f} L/min"
    )
    return Reason(text, (least * (1 - OF_THE_LOOP), most * (1 + OF_THE_LOOP)))
