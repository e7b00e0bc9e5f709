"""Margins of the current loop by the eigenvalues of its equations in discrete time, from the declared circuit.

No formula of `design` is used. The circuit is followed through one period of the PWM for small changes: the current at
its start, the share of the readings that the next interrupt takes from this period, the pulse in force, the integral.
The loop is broken where the pulse's length is written, and turned there: the phase margin is the least turn, the gain
margin the least factor, with which some motion no longer dies away.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dzdesign.design.current.circuit import Corner
from dzdesign.verify.current.coil_simulation import CoilLoop
from dzdesign.verify.current.declared_circuit import conducting_duty, correction_factor

#: Currents at which margins are taken, of the rated one: the pulse's end lies elsewhere at each.
CURRENTS = (0.1, 0.25, 0.5, 0.75, 1.0)
TURNS_DEG = np.arange(0.0, 180.5, 2.0)
FACTORS = np.geomspace(1.0, 100.0, 93)
HALVINGS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class StabilityMargins:
    """Of one corner, the least of all currents."""

    phase_deg: float
    gain: float


def stability_margins(around: CoilLoop, corner: Corner) -> StabilityMargins:
    """Return the margins of one corner at the currents that its supply can carry."""
    found = []
    for share in CURRENTS:
        duty = conducting_duty(around.circuit, corner, share * around.circuit.rated_A)
        if duty < 1:
            period = _period(around, corner, duty)
            found.append((_phase_deg(*period), _gain(*period)))
    if not found:
        return StabilityMargins(phase_deg=0.0, gain=0.0)
    phases, gains = zip(*found, strict=True)
    return StabilityMargins(phase_deg=min(phases), gain=min(gains))


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
    reading = counts_per_A * np.array([of_current[:first].sum(), 1.0, of_duty[:first].sum(), 0.0])
    reading[1] = 1.0
    left = counts_per_A * np.array([of_current[first:].sum(), 0.0, of_duty[first:].sum(), 0.0])
    unit = 2.0**-loop.gain_shift
    to_duty = correction_factor(around, corner.supply_V) / loop.full_counts
    written = -loop.proportional * unit * reading * to_duty
    written[3] += to_duty
    integral = -loop.integral * unit * reading
    integral[3] += 1.0
    current = np.array(
        [np.exp(-periods_of_decay), 0.0, jump_A * np.exp(-periods_of_decay * (1 - duty)), 0.0]
    )
    kept = np.array([current, left, np.zeros(4), integral])
    through = np.array([np.zeros(4), np.zeros(4), written, np.zeros(4)])
    return kept, through


def _dies_away(kept: np.ndarray, through: np.ndarray, factors: np.ndarray) -> np.ndarray:
    matrices = kept + np.multiply.outer(factors, through)
    found: np.ndarray = np.abs(np.linalg.eigvals(matrices)).max(axis=-1) < 1
    return found


def _phase_deg(kept: np.ndarray, through: np.ndarray) -> float:
    return _first_that_does_not(TURNS_DEG, lambda turns: _dies_away(kept, through, np.exp(-1j * np.radians(turns))))


def _gain(kept: np.ndarray, through: np.ndarray) -> float:
    return _first_that_does_not(FACTORS, lambda factors: _dies_away(kept, through, factors))


def _first_that_does_not(tried: np.ndarray, holds: Callable[[np.ndarray], np.ndarray]) -> float:
    """Return where a condition ceases to hold over rising numbers, to a 4000th of their step; 0: it never holds."""
    fails = np.flatnonzero(~holds(tried))
    if not len(fails):
        return float(tried[-1])
    if fails[0] == 0:
        return 0.0
    low, high = tried[fails[0] - 1], tried[fails[0]]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(np.array([middle]))[0] else (low, middle)
    return float(low)
