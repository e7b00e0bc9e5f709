"""Ramps in the closed loop, without and with the compensator: dead zone and flows, and the curves that are kept.

A curve of the evidence is arrays, stored as a CSV file, one set a side of the valve.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.design.costs_at_tests import LEVELS
from dzdesign.identify.valve.reading_flow import dead_zone_at, ideal_line
from dzdesign.identify.valve.recorded_curve import RecordedCurve
from dzdesign.verify.closed_loop.loop import LoopRun, RampSequence
from dzdesign.verify.closed_loop.scene import Scene, stored
from dzdesign.verify.loop_results import PressureResult

#: The onset: flow counts as flow from this share of the largest flow on, as no meter stands between.
FLOW_SHARE = 1e-3
#: Bins of command over which a plant's flow is compared with the recorded one, over full command.
BIN = 0.01
#: Columns of one figure, (N,) each and rounded as they are stored, so that they are the same read back.
Curves = Mapping[str, np.ndarray]
#: Every so many records are kept, 0.2 s of the paper's ramp, 0.2 % of the command: finer than a printed line is wide.
KEPT_RECORD = 20
#: Decimals of a flow, L/min: the plant is no better known.
FLOW_DIGITS = 3
#: Names of the files of a side, ``positive`` or ``negative``: ramps, drive at zero command.
closed_loop_name, zero_command_name = "closed_loop_{}.csv".format, "zero_command_{}.csv".format


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopComparison:
    """Result at one pressure drop, and the two runs it was read from."""

    result: PressureResult
    direct: LoopRun
    compensated: LoopRun


def compare_at_pressure(scene: Scene, sequence: RampSequence) -> LoopComparison:
    """Run the ramp without and with the compensator at one pressure drop, and read dead zones and flows.

    Dead zones are read at the onset and at the reading flow; the flow is compared with what was recorded there.

    Where the firmware has ramps of its own, the command goes no faster than they: then they hold nothing back, and
    what is read over the command is of the valve and the law, not of the ramps' lag.
    """
    loop, dp_MPa, back_MPa = scene.loop, scene.dp_MPa, scene.back_MPa
    command = sequence.for_drive(loop).command()
    direct = loop.run(command, dp_MPa)
    with_core = loop.run(command, dp_MPa, "compensated", back_MPa=back_MPa)
    # Only the flow at zero command is asked of this one, so it may open and close the valve quickly.
    quick = RampSequence(rest=sequence.rest, ramp=5.0, top=0.5).for_drive(loop).command()
    dp0_MPa = scene.identified.reference.dp_MPa
    without_beta = loop.run(
        quick, dp_MPa, "without beta", dp_frozen_MPa=dp_MPa if dp0_MPa is None else dp0_MPa, back_MPa=back_MPa
    )
    leak, reading = loop.leak_L_min(dp_MPa), scene.compensator.reading_flow_L_min
    level = leak + FLOW_SHARE * float(direct.q_L_min.max())
    largest = float(with_core.q_mean_L_min.max())
    recorded = min(scene.identified.tests, key=lambda test: abs((test.dp_MPa or 0.0) - dp_MPa)).recorded
    miss, miss_at = largest_miss(direct, loop.u_max_V, recorded)
    read = {
        name.format(branch): dead_zone(run, flow, rising=branch == "opening")
        for name, run, flow in (
            ("dead_zone_{}", direct, level), ("residual_{}", with_core, level),
            ("reading_{}_without", direct, reading), ("reading_{}", with_core, reading),
        )
        for branch in ("opening", "closing")
    }  # fmt: skip
    result = PressureResult(
        side=scene.side,
        dp_MPa=dp_MPa,
        reading_flow_L_min=reading,
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
        full_from=float(command[np.argmax(with_core.compare)]),
        hysteresis=hysteresis_of(with_core),
        **read,
    )
    return LoopComparison(result=stored(result), direct=direct, compensated=with_core)


def dead_zone(run: LoopRun, level: float, *, rising: bool) -> float:
    """Return the command share at which flow first reaches `level` going up, or last holds it going down."""
    return dead_zone_at(level, run.command, run.q_mean_L_min, rising=rising)


def hysteresis_of(run: LoopRun) -> float:
    """Return the mean distance of the branches over the command, a share, at flows from 5 to 99 % of the largest."""
    levels = np.array(LEVELS) * run.q_mean_L_min.max()
    return float(np.mean([dead_zone(run, each, rising=True) - dead_zone(run, each, rising=False) for each in levels]))


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


def loop_curves(loops: Sequence[LoopComparison]) -> dict[str, Curves]:
    """Return the ramps of each side by the file's name: a record a row, two columns of flow a pressure drop."""
    files: dict[str, Curves] = {}
    for side in dict.fromkeys(loop.result.side for loop in loops):
        of_side = [loop for loop in loops if loop.result.side == side]
        kept, first = slice(None, None, KEPT_RECORD), of_side[0].direct
        columns = {"time_s": first.time[kept].round(2), "command_percent": (100 * first.command[kept]).round(3)}
        for loop in of_side:
            for which, run in (("without", loop.direct), ("with", loop.compensated)):
                name = f"q_{which}_{loop.result.dp_MPa:.4f}_MPa_L_min"
                columns[name] = np.maximum(run.q_mean_L_min[kept].round(FLOW_DIGITS), 0.0)
        files[closed_loop_name(side)] = columns
    return files


def csv_of(curves: Curves) -> str:
    """Return columns as CSV; what is rounded to a few decimals needs no more digits to be the same read back."""
    rows = np.column_stack([*curves.values()]).tolist()
    return "\n".join([",".join(curves), *(",".join(f"{cell:.12g}" for cell in row) for row in rows)]) + "\n"


def read_curves(text: str) -> Curves:
    """Read one of these files back; what is not a table of numbers is a `ValueError`."""
    lines = text.splitlines()
    header = lines[0].split(",") if lines else []
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    if table.ndim != 2 or table.shape[1] != len(header) or not np.isfinite(table).all():
        raise ValueError(f"expected rows of {len(header)} numbers")
    return dict(zip(header, table.T, strict=True))
