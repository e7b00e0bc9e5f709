"""The report's tables on a drive by current."""

from dataclasses import replace

from dzdesign.report.sections.closed_loop import current_tables
from dzdesign.verify.current.results import (
    ControllerStates,
    CurrentCorner,
    CurrentLoopResult,
    FaultRun,
)

CORNER = CurrentCorner(
    resistance_ohm=4.0, inductance_H=0.04, supply_V=24.0, phase_margin_deg=55.0, gain_margin=2.8, limit_cycle_codes=0.3,
    steady_error_codes=0.02, current_error_codes=0.6, release_overshoot_codes=0.2,
    rise_s=0.006, least_rise_s=0.0028, overshoot=0.05, faults=0,
)  # fmt: skip
RESULT = CurrentLoopResult(
    states=ControllerStates(states=1000, seed=1, wrong=0, first_wrong=None),
    seconds=10.0, shares=(0.5, 1.0), not_carried=1,
    corners=(CORNER, replace(CORNER, rise_s=None, least_rise_s=None, overshoot=None)),
    offset_codes=(), offset_error_codes=0.0, dither_above_counts=0.0, dither_below_counts=0.0,
    faults=(FaultRun(name="the wire breaks", expected="OPEN", seen_after_s=None, limit_s=0.04, latched=False),),
)  # fmt: skip


def texts(table) -> list[list[str]]:
    return [[getattr(cell, "text", cell) for cell in row] for row in table.rows]


def test_every_corner_and_fault_has_a_row_and_by_duty_there_is_nothing():
    corners, faults = current_tables(RESULT)
    assert [row[-3:] for row in texts(corners)] == [["6.0", "2.8", "5.0"], ["not carried"] * 3]
    assert texts(faults)[0][1:3] == ["DZ_CURRENT_OPEN", "not seen"] and texts(faults)[0][-1] == "no"
    assert current_tables(None) == ()
