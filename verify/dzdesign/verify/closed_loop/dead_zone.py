"""Dead zone and flows read from the closed loop's ramps, without and with the compensator."""

from dataclasses import dataclass

import numpy as np

from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.evidence import PressureResult, Side

#: Flow counts as flow from this share of the largest flow on: no meter stands between.
FLOW_SHARE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopComparison:
    """Result at one pressure drop, and the two runs it was read from."""

    result: PressureResult
    direct: LoopRun
    compensated: LoopRun


def compare_at_pressure(
    loop: ClosedLoop, dp_MPa: float, dp0_MPa: float, sequence: RampSequence, side: Side = "positive"
) -> LoopComparison:
    """Run the ramp without and with the compensator at one pressure drop, and read dead zones and flows.

    Where the firmware has ramps of its own, the command goes no faster than they: then they hold nothing back, and
    what is read over the command is of the valve and the law, not of the ramps' lag.
    """
    command = sequence.no_faster_than(loop.slowest_ramp_s).command()
    direct = loop.run(command, dp_MPa)
    with_core = loop.run(command, dp_MPa, "compensated")
    # Only the flow at zero command is asked of this one, so it may open and close the valve quickly.
    quick = RampSequence(rest=sequence.rest, ramp=5.0, top=0.5).no_faster_than(loop.slowest_ramp_s).command()
    without_beta = loop.run(quick, dp_MPa, "without beta", dp_frozen_MPa=dp0_MPa)
    level = FLOW_SHARE * direct.q_L_min.max()
    result = PressureResult(
        side=side,
        dp_MPa=dp_MPa,
        dead_zone_opening=dead_zone(direct, level, rising=True),
        dead_zone_closing=dead_zone(direct, level, rising=False),
        residual_opening=dead_zone(with_core, level, rising=True),
        residual_closing=dead_zone(with_core, level, rising=False),
        q_zero_L_min=float(with_core.q_largest_L_min[-1]),
        q_zero_without_beta_L_min=float(without_beta.q_largest_L_min[-1]),
        q_max_direct_L_min=float(direct.q_L_min.max()),
        q_max_L_min=float(with_core.q_mean_L_min.max()),
    )
    return LoopComparison(result=result, direct=direct, compensated=with_core)


def dead_zone(run: LoopRun, level: float, *, rising: bool) -> float:
    """Return the command share at which flow first reaches `level` going up, or last holds it going down."""
    top = int(np.argmax(run.command))
    flows = np.flatnonzero(run.q_mean_L_min > level)
    part = flows[flows <= top] if rising else flows[flows > top]
    if part.size == 0:
        return 1.0
    return float(run.command[part[0] if rising else part[-1]])
