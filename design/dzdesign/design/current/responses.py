"""The current loop's margins at every corner, and what a set point makes of the current, the PWM resolved.

The controller stands here in the loop's integers as doubles: they hold every number that occurs, so the compare values
are those of the firmware (a test holds it to that).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import ceil

import numpy as np

from dzdesign.design.current.circuit import (
    CORRECTION_SHIFT,
    CoilCircuit,
    Corner,
    CurrentLoop,
    CurrentSampling,
    CurrentSensor,
)
from dzdesign.design.target_inputs import Converter

#: Frequencies that are looked at, up to half the PWM's.
GRID, SEARCH_GRID = 4_000, 600
LOWEST_RAD_S = 0.1
#: Currents at which margins are taken, over the rated one: the pulse's edge lies elsewhere at each.
OPERATING_CURRENTS = (0.1, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentRequest:
    """What an engineer declares for current control, and the converter that samples it."""

    circuit: CoilCircuit
    sensor: CurrentSensor
    sampling: CurrentSampling
    converter: Converter
    #: Solenoids, of which one is driven at a time, and the shunts for them.
    solenoids: int = 1
    shunts: int = 1

    @property
    def codes_per_V(self) -> float:
        """Codes for a volt at the pin, before they are rounded down."""
        return self.converter.levels / float(self.converter.full_V)

    def codes(self, volts: np.ndarray) -> np.ndarray:
        """Return the codes of voltages at the pin."""
        rounded: np.ndarray = np.clip(np.floor(volts * self.codes_per_V), 0, self.converter.code_max)
        return rounded


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

    A change of the compare value moves one edge of the pulse, so the current gets an impulse at that instant, which
    each sample sees at its own age, those of the same period too: exact for small changes, while the coil conducts.
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


#: The step, as shares of the rated current, and where its rise is read.
STEP = (0.1, 0.9)
SETTLE_S, STEP_S = 0.25, 0.06
#: Set points of a release from zero, of the rated current, and for how long the current is watched.
RELEASED, RELEASED_S = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0), 0.12


@dataclass(frozen=True, slots=True, kw_only=True)
class StepResponse:
    """A step up at one corner, read on the mean current of each period."""

    corner: Corner
    #: From the step to the end of the period in which 90 % of it are reached, s.
    rise_s: float
    #: Beyond the step's end, over its height.
    overshoot: float
    #: The same rise at full duty: no controller is faster.
    least_s: float


class Coils:
    """Coils at several corners side by side, each with its current."""

    def __init__(self, circuit: CoilCircuit, corners: Sequence[Corner], sampling: CurrentSampling) -> None:
        columns = np.array(corners).T
        resistance, inductance, self.supply = columns
        #: Of the current, 1/s, and where it settles with the switch on and with the diode conducting, A.
        self._rate, self._full, self._freewheels = (
            resistance / inductance, self.supply / resistance, -circuit.freewheel_V / resistance
        )  # fmt: skip
        self._period = sampling.period_s
        self._instants = (np.arange(sampling.samples)[:, np.newaxis] + 0.5) / sampling.samples * sampling.period_s
        self.current = np.zeros(len(corners))

    def period(self, duty: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Go on by a period of the PWM; return the current at each instant, (N, corners), and its mean."""
        begin, rate, on_s = self.current, self._rate, np.clip(duty, 0, 1) * self._period
        opens = self._full + (begin - self._full) * np.exp(-rate * on_s)
        blocks_s = np.log1p(opens / -self._freewheels) / rate
        since_s = np.vstack([self._instants - on_s, self._period - on_s])
        falling = self._freewheels + (opens - self._freewheels) * np.exp(-rate * np.maximum(since_s, 0))
        falling = np.where(since_s < blocks_s, np.maximum(falling, 0.0), 0.0)
        rising = self._full + (begin - self._full) * np.exp(-rate * np.minimum(self._instants, on_s))
        end = self.current = np.where(since_s[-1] > 0, falling[-1], opens)
        conducts_s = np.minimum(since_s[-1], blocks_s)
        charge = self._full * on_s + (begin - opens) / rate + self._freewheels * conducts_s + (opens - end) / rate
        return np.where(since_s[:-1] <= 0, rising, falling[:-1]), charge / self._period


def run_loop(
    loop: CurrentLoop,
    asked: CurrentRequest,
    corners: Sequence[Corner],
    set_points: Sequence[int | np.ndarray] | np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return mean current in A and compare value, (periods, corners), over a set point above zero for each period.

    A set point may be one for each corner, (corners,).
    """
    sampling, sensor = asked.sampling, asked.sensor
    coils, unit = Coils(asked.circuit, corners, sampling), float(1 << loop.gain_shift)
    count, before = len(corners), sampling.before
    integral, compare, ramped = np.zeros(count), np.zeros(count), np.zeros(count)
    factor = _correction(loop, asked.codes(coils.supply * sensor.supply_divider))
    last = np.full((sampling.samples, count), asked.codes(np.array(sensor.offset_V)))
    means, compares = [], []
    for set_point in set_points:
        currents, mean = coils.period(compare / loop.full_counts)
        codes = asked.codes(sensor.offset_V + currents * sensor.V_per_A)
        means.append(mean)
        compares.append(compare)
        total = codes[:before].sum(axis=0) + last[before:].sum(axis=0)
        last = codes
        ramped = ramped + np.clip(set_point - ramped, -loop.rate, loop.rate)
        above = np.maximum(total - loop.offset_nominal, 0)
        error = ramped - np.floor(above * loop.current_gain / (1 << loop.current_shift) + 0.5)
        wanted = integral - loop.release * unit + loop.proportional * error + loop.feed_forward * ramped
        counts = np.floor(np.maximum(wanted, 0) / unit + 0.5)
        if loop.supply is not None:
            counts = np.floor(np.minimum(counts, 65535) * factor / (1 << CORRECTION_SHIFT) + 0.5)
        held = ((counts > loop.compare_limit) & (error > 0)) | ((wanted < 0) & (error < 0))
        end = loop.integral_limit * unit
        integral = np.where(held, integral, np.clip(integral + loop.integral * error, -end, end))
        compare = np.minimum(counts, loop.compare_limit)
    return np.array(means), np.array(compares)


def _correction(loop: CurrentLoop, codes: np.ndarray) -> np.ndarray:
    if loop.supply is None:
        return np.ones_like(codes)
    low, high = loop.supply.valid_codes
    node, past = np.divmod(np.clip(codes, low, high) - low, loop.supply.step_codes)
    nodes, places = np.array(loop.supply.nodes, dtype=float), node.astype(int)
    between = nodes[places] * (loop.supply.step_codes - past) + nodes[places + 1] * past
    factor: np.ndarray = np.floor(between / loop.supply.step_codes)
    return factor


def step_responses(loop: CurrentLoop, asked: CurrentRequest, *, ends_only: bool = False) -> list[StepResponse]:
    """Return the step up at every corner that can carry the rated current."""
    circuit, sampling = asked.circuit, asked.sampling
    corners = circuit.end_corners() if ends_only else circuit.corners()
    able = [corner for corner in corners if circuit.duty(corner, circuit.rated_A) < 1]
    low, high = (share * circuit.rated_A for share in STEP)
    settle, step = (round(seconds * sampling.tick_Hz) for seconds in (SETTLE_S, STEP_S))
    counts = [round(share * loop.full_counts) for share in STEP]
    means, _ = run_loop(loop, asked, able, [counts[0]] * settle + [counts[1]] * step)
    after = means[settle:]
    found = []
    for place, corner in enumerate(able):
        reached = np.flatnonzero(after[:, place] >= low + 0.9 * (high - low))
        found.append(
            StepResponse(
                corner=corner,
                rise_s=(int(reached[0]) + 1) * sampling.period_s if len(reached) else float("inf"),
                overshoot=max(0.0, float(after[:, place].max() - high) / (high - low)),
                least_s=circuit.fastest_rise_s(corner, low, low + 0.9 * (high - low)),
            )
        )
    return found


def released_overshoot_A(loop: CurrentLoop, asked: CurrentRequest) -> float:
    """Return how far the mean current of a period gets past the set point it is released to, at most; all corners."""
    circuit = asked.circuit
    tried = [
        (corner, share)
        for corner, share in product(circuit.corners(), RELEASED)
        if circuit.duty(corner, share * circuit.rated_A) < 1
    ]
    counts = np.round(np.array([share for _, share in tried]) * loop.full_counts)
    periods = round(RELEASED_S * asked.sampling.tick_Hz)
    means, _ = run_loop(loop, asked, [corner for corner, _ in tried], [counts] * periods)
    return float((means - counts / loop.full_counts * circuit.rated_A).max())


#: Set points about which the wave is tried, of the rated current; for how long, until it has settled and after.
SHARES = (0.25, 0.5, 0.75)
SETTLED_S, SEEN_S = 0.2, 0.1


def dither_departure(loop: CurrentLoop, asked: CurrentRequest, *, counts: int, ticks: int) -> tuple[int, int]:
    """Return by how many counts the current's peak lies above the set point's at most, and below it at most.

    The certificate keeps the dither's peak free under the threshold: of a controlled current its own, which overshoots
    the wave's steps or does not reach their top, the largest mean of a PWM period at the worst corner. Both are 0 or
    more; `counts` is the wave's peak, `ticks` the PWM periods of half of it.
    """
    circuit, above, below = asked.circuit, [0.0], [0.0]
    for share in SHARES if counts else ():
        set_point, tops = round(share * loop.full_counts), (share + counts / loop.full_counts) * circuit.rated_A
        able = [corner for corner in circuit.corners() if circuit.duty(corner, tops) < 1]
        if not able or not counts < set_point <= loop.full_counts - counts:
            continue
        settled, seen = (round(seconds * asked.sampling.tick_Hz) for seconds in (SETTLED_S, SEEN_S))
        wave = _wave(set_point, counts, ticks, settled + seen)
        means, _ = run_loop(loop, asked, able, wave)
        peaks = means[settled:].max(axis=0) * loop.full_counts / circuit.rated_A - set_point - counts
        above.append(float(peaks.max()))
        below.append(float(-peaks.min()))
    return ceil(max(above)), ceil(max(below))


def _wave(set_point: int, counts: int, ticks: int, periods: int) -> np.ndarray:
    up: np.ndarray = np.arange(periods) % (2 * ticks) < ticks
    wave: np.ndarray = set_point + np.where(up, counts, -counts)
    return wave
