"""The C code with the coil at every declared corner: set points held, a step, faults of the circuit."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from math import ceil, inf
from typing import NamedTuple

import numpy as np

from dzdesign.design.current.circuit import Corner
from dzdesign.design.drive_functions import DriveFunctions
from dzdesign.verify.current.coil_simulation import Change, CoilLoop, CoilSimulation
from dzdesign.verify.current.declared_circuit import (
    conducting_duty,
    declared_corners,
    least_rise_s,
    nominal_corner,
)
from dzdesign.verify.current.exact_controller import OPEN, OVER, SENSOR, SHORT
from dzdesign.verify.current.results import CurrentCorner, FaultName, FaultRun
from dzdesign.verify.current.stability import stability_margins

#: Set points that are held, of the rated current, and for how long: the first is to settle in.
SHARES = (0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
SETTLE_S, HELD_S = 1.0, 10.0
#: The step, of the rated current, and for how long before and after it the set point stands.
DITHERED_S = (0.3, 0.1)
STEP, BEFORE_S, AFTER_S = (0.1, 0.9), 0.15, 0.06
RISEN = 0.9
#: Of the offset's tolerance: a sensor's zero that is calibrated away, and one that is not.
OFFSET_SHARES, OFFSET_BEYOND = (0.9, -0.9), 1.5
#: A fault of the circuit comes in the middle of that set point, and goes after a while.
FAULT_SHARE, FAULT_S = 0.5, 0.2
OPEN_OHM, SHORTED = 1e7, 0.02
BITS: dict[FaultName, int] = {"OPEN": OPEN, "SHORT": SHORT, "OVER": OVER, "SENSOR": SENSOR}
#: Periods of the PWM that a fault may take beyond those that it must last.
REACTION_PERIODS = 25


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldCurrent:
    """A set point held at one corner, in codes of the converter."""

    mean_swing: float
    reading_swing: float
    reading_error: float
    current_error: float
    #: Beyond the set point, before it has settled.
    release_overshoot: float
    faults: int


def held_current(simulation: CoilSimulation, corner: Corner, share: float, offset_codes: float = 0.0) -> HeldCurrent:
    """Hold a set point; with a sensor whose zero is off, the offset is what the C code calibrated."""
    around = simulation.around
    loop, sampling = around.loop, around.sampling
    settle, held = (round(seconds * sampling.tick_Hz) for seconds in (SETTLE_S, HELD_S))
    set_point = round(share * loop.full_counts)
    found = simulation.run(corner, np.full(settle + held, set_point), around=around.with_offset(offset_codes))
    codes_per_A = around.codes_per_A
    asked = set_point / loop.full_counts * around.circuit.rated_A * codes_per_A
    # As the converter gives it without current: rounded down.
    zero = np.floor((around.sensor.offset_V * _codes_per_V(around)) + offset_codes)
    readings = found.total[settle:].astype(float) / sampling.samples - zero
    released, mean = np.split(found.mean_A * codes_per_A, [settle])
    return HeldCurrent(
        mean_swing=float(np.ptp(mean)),
        reading_swing=float(np.ptp(readings)),
        reading_error=float(abs(readings.mean() - asked)),
        current_error=float(abs(mean.mean() - asked)),
        release_overshoot=max(float(released.max() - asked), 0.0),
        faults=int(found.faults[-1]),
    )


def _codes_per_V(around: CoilLoop) -> float:
    return around.converter.levels / float(around.converter.full_V)


def offset_errors(around: CoilLoop) -> tuple[float, ...]:
    """Return the errors of the sensor's zero, in codes, that must be calibrated away and that a converter can show."""
    per_sample = around.loop.offset_tolerance / around.sampling.samples
    zero = around.sensor.offset_V * _codes_per_V(around)
    return tuple(share * per_sample for share in OFFSET_SHARES if zero + share * per_sample >= 0)


def dithered_current(
    simulation: CoilSimulation, functions: DriveFunctions, set_points: Collection[int]
) -> tuple[float, float]:
    """Return by how many counts the current's peak lies above and below the set point's, at most of all corners.

    The set points are those of zero command, about which the wave runs until it has settled.
    """
    around, counts = simulation.around, functions.dither_counts
    unit_A, above, below = around.circuit.rated_A / around.loop.full_counts, 0.0, 0.0
    settle, seen = (round(seconds * around.sampling.tick_Hz) for seconds in DITHERED_S)
    up = np.arange(settle + seen) // functions.dither_ticks % 2 == 0
    for set_point in set_points if counts else ():
        wave = np.where(up, set_point + counts, max(set_point - counts, 0))
        for corner in declared_corners(around.circuit):
            if carries(around, corner, (set_point + counts) / around.loop.full_counts):
                mean_A = simulation.run(corner, wave).mean_A[settle:]
                peak = float(mean_A.max()) / unit_A - set_point - counts
                above, below = max(above, peak), max(below, -peak)
    return above, below


def carries(around: CoilLoop, corner: Corner, share: float) -> bool:
    """Tell whether a supply can hold so much of the rated current."""
    circuit = around.circuit
    limit = around.loop.compare_limit / around.loop.full_counts
    return conducting_duty(circuit, corner, share * circuit.rated_A) < limit


@dataclass(frozen=True, slots=True, kw_only=True)
class CornerRun:
    """What was found at a corner."""

    found: CurrentCorner
    #: Set points that its supply can't carry.
    not_carried: int


def run_corner(simulation: CoilSimulation, corner: Corner) -> CornerRun:
    """Run the C code with one coil at one supply."""
    around = simulation.around
    tried = [share for share in SHARES if carries(around, corner, share)]
    held = [held_current(simulation, corner, share) for share in tried]
    margins = stability_margins(around, corner)
    rise_s, least_s, overshoot, faults = _step(simulation, corner)
    for each in held:
        faults |= each.faults
    found = CurrentCorner(
        resistance_ohm=corner.resistance_ohm,
        inductance_H=corner.inductance_H,
        supply_V=corner.supply_V,
        phase_margin_deg=margins.phase_deg,
        gain_margin=margins.gain,
        limit_cycle_codes=max((max(each.mean_swing, each.reading_swing) for each in held), default=0.0),
        steady_error_codes=max((each.reading_error for each in held), default=0.0),
        current_error_codes=max((each.current_error for each in held), default=0.0),
        release_overshoot_codes=max((each.release_overshoot for each in held), default=0.0),
        rise_s=rise_s,
        least_rise_s=least_s,
        overshoot=overshoot,
        faults=faults,
    )
    return CornerRun(found=found, not_carried=len(SHARES) - len(tried))


def _step(simulation: CoilSimulation, corner: Corner) -> tuple[float | None, float | None, float | None, int]:
    """Return rise, the fastest possible one and overshoot of a step up, read on the mean current, and the faults."""
    around = simulation.around
    if not carries(around, corner, 1.0):
        return None, None, None, 0
    rated_A, tick_Hz = around.circuit.rated_A, around.sampling.tick_Hz
    before, after = (round(seconds * tick_Hz) for seconds in (BEFORE_S, AFTER_S))
    points = [round(share * around.loop.full_counts) for share in STEP]
    found = simulation.run(corner, np.repeat(points, (before, after)))
    low_A, high_A = (share * rated_A for share in STEP)
    risen_A = low_A + RISEN * (high_A - low_A)
    step = found.mean_A[before:]
    reached = np.flatnonzero(step >= risen_A)
    least = least_rise_s(corner, low_A, risen_A)
    return (
        (int(reached[0]) + 1) / tick_Hz if len(reached) else None,
        None if least == inf else least,
        max(float(step.max() - high_A) / (high_A - low_A), 0.0),
        int(found.faults[-1]),
    )


def fault_runs(simulation: CoilSimulation) -> Iterator[FaultRun]:
    """Break the circuit in motion in each way that the controller must see, mend it, and look on."""
    around = simulation.around
    loop, circuit = around.loop, around.circuit
    nominal = nominal_corner(circuit)
    open_s = (loop.open_ticks + REACTION_PERIODS) * around.sampling.period_s
    over_s = (loop.over_ticks + REACTION_PERIODS) * around.sampling.period_s
    shorted = Corner(SHORTED * nominal.resistance_ohm, SHORTED * nominal.inductance_H, nominal.supply_V)
    # A switch that stays on through a coil in which the current ends between the limits of over-current and short.
    sums_per_A = around.codes_per_A * around.sampling.samples
    ends_A = (loop.over_sum + loop.short_sum - loop.offset_nominal) / 2 / sums_per_A
    warm = Corner(nominal.supply_V / ends_A, nominal.inductance_H, nominal.supply_V)
    # The current must get there: some time constants of that coil.
    rise_s = 5 * warm.inductance_H / warm.resistance_ohm
    yield from (
        _fault_run(simulation, fault)
        for fault in (
            _Fault("the coil's wire breaks", "OPEN", nominal._replace(resistance_ohm=OPEN_OHM), False, open_s),
            _Fault("the coil is shorted", "SHORT", shorted, False, REACTION_PERIODS * around.sampling.period_s),
            _Fault("the switch stays on", "OVER", warm, True, over_s + rise_s),
        )
    )
    beyond = OFFSET_BEYOND * loop.offset_tolerance / around.sampling.samples
    found = simulation.run(nominal, np.full(100, loop.full_counts // 2), around=around.with_offset(beyond))
    yield FaultRun(
        name="the sensor's zero is too far off",
        expected="SENSOR",
        seen_after_s=0.0 if found.faults[0] & SENSOR else None,
        limit_s=0.0,
        latched=bool(found.faults[-1] & SENSOR) and not found.compare.any(),
    )


class _Fault(NamedTuple):
    name: str
    expected: FaultName
    corner: Corner
    stuck: bool
    limit_s: float


def _fault_run(simulation: CoilSimulation, fault: _Fault) -> FaultRun:
    around, bit = simulation.around, BITS[fault.expected]
    nominal, period_s = nominal_corner(around.circuit), around.sampling.period_s
    lasts = ceil(max(FAULT_S, fault.limit_s) / period_s)
    set_points = np.full(3 * lasts, round(FAULT_SHARE * around.loop.full_counts))
    changes = [
        Change(period=lasts, corner=fault.corner, stuck=fault.stuck),
        Change(period=2 * lasts, corner=nominal),
    ]
    found = simulation.run(nominal, set_points, changes)
    seen = np.flatnonzero(found.faults & bit)
    in_time = len(seen) > 0 and seen[0] >= lasts
    after = int(seen[0]) + 1 if in_time else lasts
    return FaultRun(
        name=fault.name,
        expected=fault.expected,
        seen_after_s=(after - lasts) * period_s if in_time else None,
        limit_s=fault.limit_s,
        latched=in_time and not found.compare[after:].any() and bool(np.all(found.faults[after:] & bit)),
    )
