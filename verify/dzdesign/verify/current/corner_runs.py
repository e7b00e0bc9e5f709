"""The current loop at every declared corner: margins of its equations, set points held, a step, faults of the circuit.

The margins are eigenvalues in discrete time, by no formula of `design`. The circuit is followed through one period of
the PWM for small changes: the current at its start, the share of the readings that the next interrupt takes from this
period, the pulse in force, the integral. The loop is broken where the pulse's length is written, and turned there: the
phase margin is the least turn, the gain margin the least factor, with which some motion no longer dies away.
"""

from collections.abc import Callable, Collection, Iterator
from math import ceil, inf
from typing import NamedTuple

import numpy as np

from dzdesign.design.current.circuit import Corner
from dzdesign.design.drive_functions import DriveFunctions
from dzdesign.verify.current.coil import Change, CoilLoop, CoilSimulation, least_rise_s
from dzdesign.verify.current.controller_states import HELD, OF_B, OPEN, OVER, SENSOR, SHORT
from dzdesign.verify.current.results import CurrentCorner, FaultName, FaultRun, SolenoidChanges

#: Currents at which margins are taken, of the rated one: the pulse's end lies elsewhere at each.
CURRENTS = (0.1, 0.25, 0.5, 0.75, 1.0)
TURNS_DEG, FACTORS, HALVINGS = np.arange(0.0, 180.5, 2.0), np.geomspace(1.0, 100.0, 93), 12
#: Set points that are held, of the rated current, and for how long: the first is to settle in.
SHARES = (0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
SETTLE_S, HELD_S = 1.0, 10.0
#: The same of a dither.
DITHERED_S = (0.3, 0.1)
#: The step, of the rated current, and for how long before and after it the set point stands.
STEP, BEFORE_S, AFTER_S = (0.1, 0.9), 0.15, 0.06
RISEN = 0.9
#: Of the offset's tolerance: a sensor's zero that is calibrated away, and one that is not.
OFFSET_SHARES, OFFSET_BEYOND = (0.9, -0.9), 1.5
#: A fault of the circuit comes in the middle of that set point, and goes after a while.
FAULT_SHARE, FAULT_S = 0.5, 0.2
OPEN_OHM, SHORTED = 1e7, 0.02
BITS: dict[FaultName, int] = {"OPEN": OPEN, "SHORT": SHORT, "OVER": OVER, "SENSOR": SENSOR, "HELD": HELD}
#: Share of the rated current that a switch which does not open keeps: neither over-current nor short.
STUCK_SHARE = 0.6
#: Before a change of side the set point stands so long; the side is changed back after each number of periods up to
#: that in which no current is left, as a share of it.
CHANGE_S, CHANGED_BACK = 0.06, 1.2
#: Periods of the PWM that a fault may take beyond those that it must last.
REACTION_PERIODS = 25


class Margins(NamedTuple):
    """Of one corner, the least of all currents."""

    phase_deg: float
    gain: float


def stability_margins(around: CoilLoop, corner: Corner) -> Margins:
    """Return the margins of one corner at the currents that its supply can carry; none at all: zero."""
    duties = [duty for share in CURRENTS if (duty := around.duty(corner, share)) < 1]
    periods = [_period(around, corner, duty) for duty in duties]
    turns = [_first_that_grows(*each, TURNS_DEG, lambda turns: np.exp(-1j * np.radians(turns))) for each in periods]
    gains = [_first_that_grows(*each, FACTORS, lambda factors: factors) for each in periods]
    return Margins(min(turns, default=0.0), min(gains, default=0.0))


def _period(around: CoilLoop, corner: Corner, duty: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the maps of a period: what does not go through the compare value, and what does.

    The state is (current at the start in A, readings left to the next interrupt, change of duty in force, integral).
    """
    loop, sampling, circuit = around.loop, around.sampling, around.circuit
    count, first = sampling.samples, sampling.before
    periods_of_decay = sampling.period_s * corner.resistance_ohm / corner.inductance_H
    # A longer pulse adds the whole swing of the voltage for that long, at the pulse's end.
    jump_A = (corner.supply_V + circuit.freewheel_V) * sampling.period_s / corner.inductance_H
    at = (np.arange(count) + 0.5) / count
    of_current = np.exp(-periods_of_decay * at)
    of_duty = np.where(at >= duty, jump_A * np.exp(-periods_of_decay * (at - duty)), 0.0)
    # Counts of current that the controller makes of the sum of codes.
    counts_per_A = around.codes_per_A * loop.current_gain / 2.0**loop.current_shift
    reading = np.array([counts_per_A * of_current[:first].sum(), 1.0, counts_per_A * of_duty[:first].sum(), 0.0])
    left = counts_per_A * np.array([of_current[first:].sum(), 0.0, of_duty[first:].sum(), 0.0])
    unit = 2.0**-loop.gain_shift
    to_duty = around.correction(corner.supply_V) / loop.full_counts
    written = -loop.proportional * unit * reading * to_duty
    written[3] += to_duty
    integral = -loop.integral * unit * reading
    integral[3] += 1.0
    current = np.array([np.exp(-periods_of_decay), 0.0, jump_A * np.exp(-periods_of_decay * (1 - duty)), 0.0])
    nothing = np.zeros(4)
    return np.array([current, left, nothing, integral]), np.array([nothing, nothing, written, nothing])


def _first_that_grows(
    kept: np.ndarray, through: np.ndarray, tried: np.ndarray, factor: Callable[[np.ndarray], np.ndarray]
) -> float:
    """Return the first of rising numbers whose factor lets a motion grow, to a 4000th of their step; 0: each does."""

    def dies_away(numbers: np.ndarray) -> np.ndarray:
        matrices = kept + np.multiply.outer(factor(numbers), through)
        found: np.ndarray = np.abs(np.linalg.eigvals(matrices)).max(axis=-1) < 1
        return found

    fails = np.flatnonzero(~dies_away(tried))
    if not len(fails):
        return float(tried[-1])
    if fails[0] == 0:
        return 0.0
    low, high = tried[fails[0] - 1], tried[fails[0]]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if dies_away(np.array([middle]))[0] else (low, middle)
    return float(low)


class HeldCurrent(NamedTuple):
    """A set point held at one corner, in codes of the converter."""

    #: Of the settled mean current, or of its reading.
    swing: float = 0.0
    reading_error: float = 0.0
    current_error: float = 0.0
    #: Beyond the set point, before it has settled.
    release_overshoot: float = 0.0
    faults: int = 0


def held_current(simulation: CoilSimulation, corner: Corner, share: float, offset_codes: float = 0.0) -> HeldCurrent:
    """Hold a set point; with a sensor whose zero is off, the offset is what the C code calibrated."""
    around = simulation.around
    loop, sampling = around.loop, around.sampling
    settle, held = (round(seconds * sampling.tick_Hz) for seconds in (SETTLE_S, HELD_S))
    set_point = round(share * loop.full_counts)
    found = simulation.run(corner, np.full(settle + held, set_point), around=around.with_offset(offset_codes))
    asked = set_point / loop.full_counts * around.circuit.rated_A * around.codes_per_A
    # As the converter gives it without current: rounded down.
    zero = np.floor((around.sensor.offset_V * around.codes_per_V) + offset_codes)
    readings = found["total"][settle:].astype(float) / sampling.samples - zero
    released, mean = np.split(found["means_A"][:, 0] * around.codes_per_A, [settle])
    return HeldCurrent(
        swing=float(max(np.ptp(mean), np.ptp(readings))),
        reading_error=float(abs(readings.mean() - asked)),
        current_error=float(abs(mean.mean() - asked)),
        release_overshoot=max(float(released.max() - asked), 0.0),
        faults=int(found["faults"][-1]),
    )


def offset_errors(around: CoilLoop) -> tuple[float, ...]:
    """Return the errors of the sensor's zero, in codes, that must be calibrated away and that a converter can show."""
    per_sample = around.loop.offset_tolerance / around.sampling.samples
    zero = around.sensor.offset_V * around.codes_per_V
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
        for corner in around.corners():
            if around.carries(corner, (set_point + counts) / around.loop.full_counts):
                mean_A = simulation.run(corner, wave)["means_A"][settle:, 0]
                peak = float(mean_A.max()) / unit_A - set_point - counts
                above, below = max(above, peak), max(below, -peak)
    return above, below


def run_corner(simulation: CoilSimulation, corner: Corner) -> CurrentCorner:
    """Run the C code with one coil at one supply; set points that this can't carry are not tried."""
    around = simulation.around
    held = [held_current(simulation, corner, share) for share in SHARES if around.carries(corner, share)]
    worst = HeldCurrent(*(max(column) for column in zip(*held, strict=True))) if held else HeldCurrent()
    margins = stability_margins(around, corner)
    step = _step(simulation, corner)
    faults = step.faults
    for each in held:
        faults |= each.faults
    return CurrentCorner(
        resistance_ohm=corner.resistance_ohm,
        inductance_H=corner.inductance_H,
        supply_V=corner.supply_V,
        phase_margin_deg=margins.phase_deg,
        gain_margin=margins.gain,
        limit_cycle_codes=worst.swing,
        steady_error_codes=worst.reading_error,
        current_error_codes=worst.current_error,
        release_overshoot_codes=worst.release_overshoot,
        rise_s=step.rise_s,
        least_rise_s=step.least_s,
        overshoot=step.overshoot,
        faults=faults,
    )


class _Step(NamedTuple):
    rise_s: float | None = None
    #: The fastest possible one.
    least_s: float | None = None
    overshoot: float | None = None
    faults: int = 0


def _step(simulation: CoilSimulation, corner: Corner) -> _Step:
    """Step up, read on the mean current."""
    around = simulation.around
    if not around.carries(corner, 1.0):
        return _Step()
    tick_Hz = around.sampling.tick_Hz
    before, after = (round(seconds * tick_Hz) for seconds in (BEFORE_S, AFTER_S))
    points = [round(share * around.loop.full_counts) for share in STEP]
    found = simulation.run(corner, np.repeat(points, (before, after)))
    low_A, high_A = (share * around.circuit.rated_A for share in STEP)
    risen_A = low_A + RISEN * (high_A - low_A)
    step = found["means_A"][before:, 0]
    reached = np.flatnonzero(step >= risen_A)
    least_s = least_rise_s(corner, low_A, risen_A)
    return _Step(
        rise_s=(int(reached[0]) + 1) / tick_Hz if len(reached) else None,
        least_s=None if least_s == inf else least_s,
        overshoot=max(float(step.max() - high_A) / (high_A - low_A), 0.0),
        faults=int(found["faults"][-1]),
    )


def solenoid_changes(simulation: CoilSimulation) -> SolenoidChanges | None:
    """Change from one solenoid to the other and back, at every phase of the decay and at every corner."""
    around = simulation.around
    if not around.loop.two:
        return None
    settle, phases = (
        ceil(count) for count in (CHANGE_S * around.sampling.tick_Hz, CHANGED_BACK * around.loop.held_ticks)
    )
    lengths = np.array([[settle, phase] for phase in range(1, phases + 1)]).ravel()
    both_A, slowest, faults = 0.0, 0, 0
    for corner in around.corners():
        share = max((share for share in SHARES if around.carries(corner, share)), default=0.0)
        asked = np.zeros((lengths.sum(), 2), dtype=np.uint16)
        driven = np.repeat(np.arange(len(lengths)) % 2, lengths)
        asked[np.arange(len(asked)), driven] = round(share * around.loop.full_counts)
        for columns in ([0, 1], [1, 0]):
            found = simulation.run(corner, asked[:, columns])
            both_A, faults = max(both_A, float(found["both_A"].max())), faults | int(found["faults"][-1])
            # The last change is the one that was not taken back before its end.
            began = len(asked) - phases
            pulses = np.flatnonzero(found["means_A"][began:, columns.index(1)] > 0)
            slowest = max(slowest, int(pulses[0]) if len(pulses) else phases)
    return SolenoidChanges(
        corners=len(around.corners()),
        phases=phases,
        both_A=both_A,
        slowest_s=slowest * around.sampling.period_s,
        faults=faults,
    )


def fault_runs(simulation: CoilSimulation) -> Iterator[FaultRun]:
    """Break the circuit in motion in each way that the controller must see, mend it, and look on."""
    for solenoid in range(2 if simulation.around.loop.two else 1):
        yield from _solenoid_faults(simulation, solenoid)
    around = simulation.around
    beyond = OFFSET_BEYOND * around.loop.offset_tolerance / around.sampling.samples
    set_points = np.full(100, around.loop.full_counts // 2)
    found = simulation.run(around.at(), set_points, around=around.with_offset(beyond))
    yield FaultRun(
        name="the sensor's zero is too far off",
        expected="SENSOR",
        seen_after_s=0.0 if found["faults"][0] & SENSOR else None,
        limit_s=0.0,
        latched=bool(found["faults"][-1] & SENSOR) and not found["compare"].any(),
    )


def _solenoid_faults(simulation: CoilSimulation, solenoid: int) -> Iterator[FaultRun]:
    """Yield the faults of one solenoid, A or B."""
    around = simulation.around
    loop, sampling, nominal = around.loop, around.sampling, around.at()
    reaction_s = REACTION_PERIODS * sampling.period_s
    broken = nominal._replace(resistance_ohm=OPEN_OHM)
    open_s = reaction_s + loop.open_ticks * sampling.period_s
    yield _fault_run(simulation, solenoid, "the coil's wire breaks", "OPEN", open_s, broken)
    shorted = Corner(SHORTED * nominal.resistance_ohm, SHORTED * nominal.inductance_H, nominal.supply_V)
    yield _fault_run(simulation, solenoid, "the coil is shorted", "SHORT", reaction_s, shorted)
    # A switch that stays on through a coil in which the current ends between the limits of over-current and short.
    ends_A = (loop.over_sum + loop.short_sum - loop.offset_nominal) / 2 / (around.codes_per_A * sampling.samples)
    warm = nominal._replace(resistance_ohm=nominal.supply_V / ends_A)
    # The current must get there: some time constants of that coil.
    over_s = reaction_s + loop.over_ticks * sampling.period_s + 5 * warm.inductance_H / warm.resistance_ohm
    yield _fault_run(simulation, solenoid, "the switch stays on", "OVER", over_s, warm, stuck=True)
    if loop.two:
        warm = nominal._replace(resistance_ohm=nominal.supply_V / (STUCK_SHARE * around.circuit.rated_A))
        held_s = reaction_s + loop.held_ticks * sampling.period_s
        name = "the switch stays on as the other solenoid is asked for"
        yield _fault_run(simulation, solenoid, name, "HELD", held_s, warm, stuck=True)


def _fault_run(
    simulation: CoilSimulation,
    solenoid: int,
    name: str,
    expected: FaultName,
    limit_s: float,
    corner: Corner,
    *,
    stuck: bool = False,
) -> FaultRun:
    around, bit = simulation.around, BITS[expected] << OF_B * solenoid
    nominal, period_s = around.at(), around.sampling.period_s
    lasts = ceil(max(FAULT_S, limit_s) / period_s)
    set_points = np.zeros((3 * lasts, 2), dtype=np.uint16)
    driven = np.where((np.arange(3 * lasts) >= lasts) & (expected == "HELD"), 1 - solenoid, solenoid)
    set_points[np.arange(3 * lasts), driven] = round(FAULT_SHARE * around.loop.full_counts)
    changes = [Change(lasts, corner, stuck, 1 << solenoid), Change(2 * lasts, nominal, solenoids=1 << solenoid)]
    found = simulation.run(nominal, set_points, changes)
    seen = np.flatnonzero(found["faults"] & bit)
    # Of two solenoids no bit of the other one may stand.
    in_time = len(seen) > 0 and seen[0] >= lasts and not np.any(found["faults"] >> OF_B * (1 - solenoid) & 0xFF)
    after = int(seen[0]) + 1 if in_time else lasts
    return FaultRun(
        name=f"solenoid {'AB'[solenoid]}: {name}" if around.loop.two else name,
        expected=expected,
        seen_after_s=(after - lasts) * period_s if in_time else None,
        limit_s=limit_s,
        latched=in_time and not found["compare"][after:].any() and bool(np.all(found["faults"][after:] & bit)),
    )
