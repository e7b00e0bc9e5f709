"""A step of the set point at every corner at once, the PWM resolved: what the rate is chosen by and `design` prints.

The controller stands here a third time, in the loop's integers as doubles: they hold every number that occurs, so the
compare values are those of the firmware (a test holds it to that).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from dzdesign.design.current.circuit import CoilCircuit, Corner, CurrentSampling
from dzdesign.design.current.loop import CORRECTION_SHIFT, CurrentLoop

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


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLine:
    """The straight lines from a current, and from the supply's voltage, to a code before it is rounded down."""

    V_per_A: float
    offset_V: float
    codes_per_V: float
    code_max: int
    supply_divider: float

    def codes(self, volts: np.ndarray) -> np.ndarray:
        """Return the codes of voltages at the pin."""
        rounded: np.ndarray = np.clip(np.floor(volts * self.codes_per_V), 0, self.code_max)
        return rounded


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
    circuit: CoilCircuit,
    corners: Sequence[Corner],
    sampling: CurrentSampling,
    sensor: SensorLine,
    set_points: Sequence[int | np.ndarray] | np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return mean current in A and compare value, (periods, corners), over a set point above zero for each period.

    A set point may be one for each corner, (corners,).
    """
    coils, unit = Coils(circuit, corners, sampling), float(1 << loop.gain_shift)
    count, before = len(corners), sampling.before
    integral, compare, ramped = np.zeros(count), np.zeros(count), np.zeros(count)
    factor = _correction(loop, sensor.codes(coils.supply * sensor.supply_divider))
    last = np.full((sampling.samples, count), sensor.codes(np.array(sensor.offset_V)))
    means, compares = [], []
    for set_point in set_points:
        currents, mean = coils.period(compare / loop.full_counts)
        codes = sensor.codes(sensor.offset_V + currents * sensor.V_per_A)
        means.append(mean)
        compares.append(compare)
        total = codes[:before].sum(axis=0) + last[before:].sum(axis=0)
        last = codes
        ramped = ramped + np.clip(set_point - ramped, -loop.rate, loop.rate)
        above = np.maximum(total - loop.offset_nominal, 0)
        error = ramped - np.floor(above * loop.current_gain / (1 << loop.current_shift) + 0.5)
        asked = integral - loop.release * unit + loop.proportional * error + loop.feed_forward * ramped
        counts = np.floor(np.maximum(asked, 0) / unit + 0.5)
        if loop.supply is not None:
            counts = np.floor(np.minimum(counts, 65535) * factor / (1 << CORRECTION_SHIFT) + 0.5)
        held = ((counts > loop.compare_limit) & (error > 0)) | ((asked < 0) & (error < 0))
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


def step_responses(
    loop: CurrentLoop, circuit: CoilCircuit, sampling: CurrentSampling, sensor: SensorLine, *, ends_only: bool = False
) -> list[StepResponse]:
    """Return the step up at every corner that can carry the rated current."""
    corners = circuit.end_corners() if ends_only else circuit.corners()
    able = [corner for corner in corners if circuit.duty(corner, circuit.rated_A) < 1]
    low, high = (share * circuit.rated_A for share in STEP)
    settle, step = (round(seconds * sampling.tick_Hz) for seconds in (SETTLE_S, STEP_S))
    counts = [round(share * loop.full_counts) for share in STEP]
    means, _ = run_loop(loop, circuit, able, sampling, sensor, [counts[0]] * settle + [counts[1]] * step)
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


def released_overshoot_A(
    loop: CurrentLoop, circuit: CoilCircuit, sampling: CurrentSampling, sensor: SensorLine
) -> float:
    """Return how far the mean current of a period gets past the set point it is released to, at most; all corners."""
    tried = [
        (corner, share)
        for corner, share in product(circuit.corners(), RELEASED)
        if circuit.duty(corner, share * circuit.rated_A) < 1
    ]
    counts = np.round(np.array([share for _, share in tried]) * loop.full_counts)
    periods = round(RELEASED_S * sampling.tick_Hz)
    means, _ = run_loop(loop, circuit, [corner for corner, _ in tried], sampling, sensor, [counts] * periods)
    return float((means - counts / loop.full_counts * circuit.rated_A).max())
