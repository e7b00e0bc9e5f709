"""`CurrentDrive`: current control as `design` chose it, with its margins, its steps, and what it makes of a dither."""

from dataclasses import dataclass
from math import ceil, isfinite
from typing import Annotated

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.current.choosing import (
    LEAST_PHASE_DEG,
    SHORT_SHARE,
    CurrentSensor,
    allowed_at_release_A,
    choose_loop,
    gains_of,
    sensor_line,
    worst_step,
)
from dzdesign.design.current.circuit import CoilCircuit, CurrentSampling
from dzdesign.design.current.loop import CurrentLoop
from dzdesign.design.current.responses import (
    STEP_S,
    SensorLine,
    released_overshoot_A,
    run_loop,
    step_responses,
    worst_margins,
)
from dzdesign.design.target_inputs import Converter

#: Set points about which the wave is tried, of the rated current; for how long, until it has settled and after.
SHARES = (0.25, 0.5, 0.75)
SETTLED_S, SEEN_S = 0.2, 0.1


def dither_departure(
    loop: CurrentLoop,
    circuit: CoilCircuit,
    sampling: CurrentSampling,
    sensor: SensorLine,
    *,
    counts: int,
    ticks: int,
) -> tuple[int, int]:
    """Return by how many counts the current's peak lies above the set point's at most, and below it at most.

    The certificate keeps the dither's peak free under the threshold: of a controlled current its own, which overshoots
    the wave's steps or does not reach their top, the largest mean of a PWM period at the worst corner. Both are 0 or
    more; `counts` is the wave's peak, `ticks` the PWM periods of half of it.
    """
    above, below = [0.0], [0.0]
    for share in SHARES if counts else ():
        set_point, tops = round(share * loop.full_counts), (share + counts / loop.full_counts) * circuit.rated_A
        able = [corner for corner in circuit.corners() if circuit.duty(corner, tops) < 1]
        if not able or not counts < set_point <= loop.full_counts - counts:
            continue
        settled, seen = (round(seconds * sampling.tick_Hz) for seconds in (SETTLED_S, SEEN_S))
        wave = _wave(set_point, counts, ticks, settled + seen)
        means, _ = run_loop(loop, circuit, able, sampling, sensor, wave)
        peaks = means[settled:].max(axis=0) * loop.full_counts / circuit.rated_A - set_point - counts
        above.append(float(peaks.max()))
        below.append(float(-peaks.min()))
    return ceil(max(above)), ceil(max(below))


def _wave(set_point: int, counts: int, ticks: int, periods: int) -> np.ndarray:
    up: np.ndarray = np.arange(periods) % (2 * ticks) < ticks
    wave: np.ndarray = set_point + np.where(up, counts, -counts)
    return wave


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentDrive:
    """Current control of a drive: the law's output is the set point, and full drive is the rated current."""

    circuit: CoilCircuit
    """Declared coil and supply."""
    sensor: CurrentSensor
    """Voltages at the pins of the converter."""
    sampling: CurrentSampling
    """Times at which the current is sampled and the interrupt is triggered."""
    loop: CurrentLoop
    """Controller in the integers of the firmware."""
    phase_margin_deg: Annotated[float, quantity("deg")]
    """Least phase margin over all corners and currents."""
    gain_margin: Annotated[float, quantity("1")]
    """Least gain margin over all corners and currents."""
    rise_s: Annotated[float, quantity("s")]
    """Rise time from 10 to 90 % of the rated current at the slowest corner."""
    least_rise_s: Annotated[float, quantity("s")]
    """Rise time at that corner with the switch always on."""
    fall_s: Annotated[float, quantity("s")]
    """Fall time from 90 to 10 % at the slowest corner, where the freewheeling diode determines it."""
    overshoot: Annotated[float, quantity("1")]
    """Largest overshoot of the step response, relative to the height of the step."""
    release_overshoot_A: Annotated[float, quantity("A", ge=0)]
    """Largest overshoot at any corner when the current is released to a set point; 0 if it is at most half a code of
    the sensor."""
    dither_above_counts: Annotated[int, Meta(ge=0, le=65535)]
    """Largest excess of the current's peak over that of the set point under dither, at any corner."""
    dither_below_counts: Annotated[int, Meta(ge=0, le=65535)]
    """Largest deficit of the current's peak against that of the set point under dither, if the loop can't follow the
    wave."""

    def __post_init__(self) -> None:
        if self.phase_margin_deg < LEAST_PHASE_DEG:
            raise RuleError(
                f"the current loop's phase margin is {self.phase_margin_deg:.1f} degrees, expected {LEAST_PHASE_DEG:g}"
            )

    @property
    def rest_ticks(self) -> int:
        """PWM periods with the output off after which no current is left: of the largest, at the slowest corner."""
        circuit = self.circuit
        largest_A = SHORT_SHARE * circuit.rated_A
        slowest_s = max(circuit.fastest_fall_s(corner, largest_A, 0.0) for corner in circuit.corners())
        return ceil(slowest_s * self.sampling.tick_Hz)

    def in_words(self, units: RecordedUnits) -> tuple[str, ...]:
        """Return lines for a person."""
        circuit, loop = self.circuit, self.loop
        low, high = circuit.supply_V
        measured = "measured" if loop.supply else "not measured"
        return (
            f"drive: current control, full drive is {units.text(circuit.rated_A, 'g A')}; coil "
            f"{circuit.resistance_ohm:g} + "
            f"{circuit.series_ohm:g} ohm (x {_ends(circuit.resistance_factors)}), {1e3 * circuit.inductance_H:g} mH (x "
            f"{_ends(circuit.inductance_factors)}), supply {low:g}..{high:g} V, {measured}",
            f"current loop: phase margin {self.phase_margin_deg:.0f} degrees, gain margin {self.gain_margin:.1f} at "
            f"the worst corner; 10 to 90 % in {1e3 * self.rise_s:.1f} ms at the slowest ({1e3 * self.least_rise_s:.1f} "
            f"ms with the switch on all the time), overshoot up to {self.overshoot:.1%}; 90 to 10 % takes up to "
            f"{1e3 * self.fall_s:.0f} ms, as the freewheeling diode alone brakes",
            *self._weak_in_words(units),
        )

    def release_in_words(self, units: RecordedUnits) -> tuple[str, ...]:
        """Warn of a current that passes the set point that it is released to; of none say nothing."""
        if not self.release_overshoot_A:
            return ()
        share = self.release_overshoot_A / self.circuit.rated_A
        return (
            f"when the drive is released, the current exceeds its set point by up to "
            f"{units.text(self.release_overshoot_A, '.2g A')} ({share:.1%} of the rated current), even from the lowest "
            "initial output. The valve may open briefly at zero command; declare narrower ranges of inductance, "
            "resistance or supply, or measure the supply",
        )

    def _weak_in_words(self, units: RecordedUnits) -> tuple[str, ...]:
        """Say what flows at most where no supply drives the rated current; those corners have no step."""
        circuit = self.circuit
        weakest = min(circuit.corners(), key=lambda corner: corner.supply_V / corner.resistance_ohm)
        if circuit.duty(weakest, circuit.rated_A) < 1:
            return ()
        most_A, at_V = weakest.supply_V / weakest.resistance_ohm, weakest.supply_V
        return (
            f"at {at_V:g} V the hottest coil of {weakest.resistance_ohm:.3g} ohm carries {units.text(most_A, '.3g A')} "
            "at most, so that full command has less than the rated current; step and margins are of the others",
        )


def _ends(factors: tuple[float, float]) -> str:
    return f"{factors[0]:g}..{factors[1]:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentRequest:
    """What an engineer declares for current control."""

    circuit: CoilCircuit
    sensor: CurrentSensor
    sampling: CurrentSampling


def design_current_drive(
    request: CurrentRequest, converter: Converter, compare_max: int, dither: tuple[int, int] = (0, 1)
) -> CurrentDrive:
    """Choose the loop of a coil, and compute what it holds; a dither has a peak, counts, and periods of half a wave."""
    circuit, sensor, sampling = request.circuit, request.sensor, request.sampling
    loop = choose_loop(circuit, sensor, converter, sampling, compare_max=compare_max)
    phase, gain = worst_margins(circuit, sampling, gains_of(loop, circuit))
    line = sensor_line(sensor, converter)
    slowest, largest = worst_step(step_responses(loop, circuit, sampling, line))
    if not isfinite(slowest.rise_s):
        raise InputError(
            f"with {slowest.corner.resistance_ohm:.3g} ohm and {slowest.corner.inductance_H:.3g} H at "
            f"{slowest.corner.supply_V:.3g} V the current does not reach 90 % of the rated one in {1e3 * STEP_S:g} ms; "
            "declare narrower ranges of coil and supply, or a lower --rated-current"
        )
    released_A = released_overshoot_A(loop, circuit, sampling, line)
    above, below = dither_departure(loop, circuit, sampling, line, counts=dither[0], ticks=dither[1])
    high, low = 0.9 * circuit.rated_A, 0.1 * circuit.rated_A
    return CurrentDrive(
        circuit=circuit,
        sensor=sensor,
        sampling=sampling,
        loop=loop,
        phase_margin_deg=round(phase.phase_deg, 3),
        gain_margin=round(gain.gain, 4),
        rise_s=round(slowest.rise_s, 9),
        least_rise_s=round(slowest.least_s, 9),
        fall_s=round(max(circuit.fastest_fall_s(corner, high, low) for corner in circuit.corners()), 9),
        overshoot=round(largest.overshoot, 6),
        release_overshoot_A=round(released_A, 9) if released_A > allowed_at_release_A(line) else 0.0,
        dither_above_counts=above,
        dither_below_counts=below,
    )
