"""The current loop's exact transfer function in discrete time, and its margins, with every delay counted.

A change of the compare value moves one edge of the pulse, so the current gets an impulse at that instant, which decays
with the coil's time constant. The samples after it see the impulse: each at its own age, those of the same period too.
So the response of the sum of codes is exact for small changes, while the coil conducts all the time; the zero-order
hold, the mean over the period and the period that the output waits are in it, and no approximation of a dead time is.
"""

from dataclasses import dataclass

import numpy as np

from dzdesign.design.current.circuit import CoilCircuit, Corner, CurrentSampling

#: Frequencies that are looked at, up to half the PWM's.
GRID, SEARCH_GRID = 4_000, 600
LOWEST_RAD_S = 0.1
#: Currents at which margins are taken, over the rated one: the pulse's edge lies elsewhere at each.
OPERATING_CURRENTS = (0.1, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gains:
    """Gains of the controller in units of the circuit."""

    #: V/A at the nominal supply.
    proportional: float
    #: V/A for a period of the PWM.
    integral: float
    #: V/A.
    feed_forward: float
    #: Whether the output is corrected by the supply's voltage.
    supply_measured: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Margins:
    """Stability margins of one corner at one current."""

    phase_deg: float
    gain: float
    crossover_rad_s: float


def impulse_response(circuit: CoilCircuit, corner: Corner, sampling: CurrentSampling, duty: float) -> tuple[float, ...]:
    """Return what an impulse of duty in a period adds to the mean code's current in this period and the next two, A.

    After those it decays by the same factor each period; that factor is the last value.
    """
    rate, period = corner.resistance_ohm / corner.inductance_H, sampling.period_s
    step = (corner.supply_V + circuit.freewheel_V) / corner.inductance_H * period
    ages = (np.arange(3 * sampling.samples) + 0.5) / sampling.samples - duty
    seen = np.where(ages >= 0, step * np.exp(-rate * period * np.maximum(ages, 0)), 0.0) / sampling.samples
    first = sampling.before
    windows = (
        seen[:first],
        seen[first : first + sampling.samples],
        seen[first + sampling.samples :][: sampling.samples],
    )
    now, following, last = (float(window.sum()) for window in windows)
    return now, following, last, float(np.exp(-rate * period))


def loop_transfer(
    circuit: CoilCircuit, corner: Corner, sampling: CurrentSampling, gains: Gains, duty: float, omega_s: np.ndarray
) -> np.ndarray:
    """Return the open loop's transfer function at frequencies in rad per second."""
    now, following, last, decay = impulse_response(circuit, corner, sampling, duty)
    z = np.exp(1j * np.asarray(omega_s) * sampling.period_s)
    plant = now + following / z + last / (z**2 * (1 - decay / z))
    controller = gains.proportional + gains.integral / (z - 1)  # the sum of the errors before
    volts = corner.supply_V if gains.supply_measured else circuit.nominal_V
    result: np.ndarray = controller / volts * plant / z  # the output acts from the next period on
    return result


def margins(
    circuit: CoilCircuit, corner: Corner, sampling: CurrentSampling, gains: Gains, current: float, grid: int = GRID
) -> Margins:
    """Return the least phase margin over all crossovers and the gain margin, at a current over the rated one."""
    duty = circuit.duty(corner, current * circuit.rated_A)
    omega = np.geomspace(LOWEST_RAD_S, np.pi / sampling.period_s, grid)
    loop = loop_transfer(circuit, corner, sampling, gains, min(duty, 1.0), omega)
    size, phase = np.log(np.abs(loop)), np.unwrap(np.angle(loop))
    phase -= 2 * np.pi * np.round((phase[0] + np.pi / 2) / (2 * np.pi))
    crossings = np.flatnonzero(np.diff(np.signbit(size)))
    at = [np.interp(0.0, [-size[k], -size[k + 1]], [0, 1]) if size[k] > size[k + 1] else 0.5 for k in crossings]
    phases = [phase[k] + part * (phase[k + 1] - phase[k]) for k, part in zip(crossings, at, strict=True)]
    turns = np.flatnonzero((phase[:-1] > -np.pi) != (phase[1:] > -np.pi))
    largest = max((float(np.abs(loop[k])) for k in turns), default=float(np.abs(loop[-1])))
    if size[-1] > 0:  # a gain above 1 up to half the PWM's frequency: there is no crossover to read a phase at
        phases.append(-np.pi)
    return Margins(
        phase_deg=float(180 + np.degrees(min(phases))) if phases else 180.0,
        gain=1 / largest,
        crossover_rad_s=float(omega[crossings[-1]]) if len(crossings) else 0.0,
    )


def worst_margins(
    circuit: CoilCircuit, sampling: CurrentSampling, gains: Gains, grid: int = GRID
) -> tuple[Margins, Margins]:
    """Return the margins of the corner and current with the least phase margin, and with the least gain margin."""
    searching = grid == SEARCH_GRID
    found = [
        margins(circuit, corner, sampling, gains, current, grid)
        for corner in (circuit.end_corners() if searching else circuit.corners())
        for current in (OPERATING_CURRENTS[:: len(OPERATING_CURRENTS) - 1] if searching else OPERATING_CURRENTS)
        if circuit.duty(corner, current * circuit.rated_A) < 1
    ]
    return min(found, key=lambda each: each.phase_deg), min(found, key=lambda each: each.gain)
