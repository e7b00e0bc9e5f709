"""Dead zone and flows read from the closed loop's ramps, without and with the compensator."""

from dataclasses import dataclass

import numpy as np

from dzdesign.identify.valve.reading_flow import dead_zone_at, ideal_line
from dzdesign.identify.valve.recorded_curve import RecordedCurve
from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.stored_digits import stored
from dzdesign.verify.loop_results import PressureResult, Side

#: The onset: flow counts as flow from this share of the largest flow on, as no meter stands between.
FLOW_SHARE = 1e-3
#: Bins of command over which a plant's flow is compared with the recorded one, over full command.
BIN = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopComparison:
    """Result at one pressure drop, and the two runs it was read from."""

    result: PressureResult
    direct: LoopRun
    compensated: LoopRun


def compare_at_pressure(
    loop: ClosedLoop,
    dp_MPa: float,
    dp0_MPa: float,
    sequence: RampSequence,
    side: Side = "positive",
    *,
    reading_flow_L_min: float,
    recorded: RecordedCurve,
    back_MPa: float | None = None,
) -> LoopComparison:
    """Run the ramp without and with the compensator at one pressure drop, and read dead zones and flows.

    Without a pressure behind the edge it is that of a bench. Dead zones are read at the onset and at the reading flow;
    the flow is compared with what was recorded there.

    Where the firmware has ramps of its own, the command goes no faster than they: then they hold nothing back, and
    what is read over the command is of the valve and the law, not of the ramps' lag.
    """
    command = sequence.for_drive(loop).command()
    direct = loop.run(command, dp_MPa)
    with_core = loop.run(command, dp_MPa, "compensated", back_MPa=back_MPa)
    # Only the flow at zero command is asked of this one, so it may open and close the valve quickly.
    quick = RampSequence(rest=sequence.rest, ramp=5.0, top=0.5).for_drive(loop).command()
    without_beta = loop.run(quick, dp_MPa, "without beta", dp_frozen_MPa=dp0_MPa, back_MPa=back_MPa)
    leak, reading = loop.leak_L_min(dp_MPa), reading_flow_L_min
    level = leak + FLOW_SHARE * float(direct.q_L_min.max())
    largest = float(with_core.q_mean_L_min.max())
    miss, miss_at = largest_miss(direct, loop.u_max_V, recorded)
    result = PressureResult(
        side=side,
        dp_MPa=dp_MPa,
        dead_zone_opening=dead_zone(direct, level, rising=True),
        dead_zone_closing=dead_zone(direct, level, rising=False),
        residual_opening=dead_zone(with_core, level, rising=True),
        residual_closing=dead_zone(with_core, level, rising=False),
        reading_flow_L_min=reading,
        reading_opening_without=dead_zone(direct, reading, rising=True),
        reading_closing_without=dead_zone(direct, reading, rising=False),
        reading_opening=dead_zone(with_core, reading, rising=True),
        reading_closing=dead_zone(with_core, reading, rising=False),
        ideal_line=ideal_line(reading, largest),
        unseen_below_L_min=loop.unseen_below_L_min(dp_MPa),
        leak_L_min=leak,
        allowed_at_zero_L_min=loop.allowed_at_zero_L_min(dp_MPa),
        q_zero_L_min=float(with_core.q_largest_L_min[-1]),
        q_zero_without_beta_L_min=float(without_beta.q_largest_L_min[-1]),
        flow_miss=miss,
        flow_miss_at=miss_at,
        q_max_direct_L_min=float(direct.q_L_min.max()),
        q_max_L_min=largest,
    )
    return LoopComparison(result=stored(result), direct=direct, compensated=with_core)


def dead_zone(run: LoopRun, level: float, *, rising: bool) -> float:
    """Return the command share at which flow first reaches `level` going up, or last holds it going down."""
    return dead_zone_at(level, run.command, run.q_mean_L_min, rising=rising)


def largest_miss(run: LoopRun, u_max_V: float, recorded: RecordedCurve) -> tuple[float, float]:
    """Return by how much the mean flow per bin of command departs from the recorded one, and at which command share.

    It is over the largest recorded flow; the command is the middle of the bin.
    """
    bins = np.minimum((run.command / BIN).astype(int), round(1 / BIN) - 1)
    top = int(np.argmax(run.command))
    worst, place = 0.0, 0
    for branch, part in ((recorded.opening, slice(0, top + 1)), (recorded.closing, slice(top + 1, None))):
        miss = run.q_mean_L_min[part] - branch.flow_at(u_max_V * run.command[part])
        means = np.abs(np.bincount(bins[part], weights=miss)) / np.maximum(np.bincount(bins[part]), 1)
        if means.size and means.max() > worst:
            worst, place = float(means.max()), int(np.argmax(means))
    return worst / recorded.q_max_L_min, (place + 0.5) * BIN
