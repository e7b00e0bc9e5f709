"""`CurrentDrive`: coil, supply, sampling and sensor in; the current loop that meets its margins at every corner out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, floor, isfinite, log
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.current.circuit import (
    CORRECTION_SHIFT,
    LARGEST_ERROR,
    LARGEST_GAIN,
    CoilCircuit,
    CurrentLoop,
    CurrentSampling,
    CurrentSensor,
    SupplyCorrection,
)
from dzdesign.design.current.responses import (
    SEARCH_GRID,
    STEP_S,
    CurrentRequest,
    Gains,
    StepResponse,
    dither_departure,
    released_overshoot_A,
    step_responses,
    worst_margins,
)
from dzdesign.design.target_inputs import Converter

#: Phase margin that the gains are chosen for, and the least that a loop may have.
CHOSEN_PHASE_DEG, LEAST_PHASE_DEG = 55.0, 45.0
#: The integral's time constant over that of the declared coil.
INTEGRAL_TIME = 2.0
#: Overshoot of a step that the set point's rate is chosen for, and the rates that are tried: PWM periods for the rated
#: current.
CHOSEN_OVERSHOOT = 0.08
RATE_PERIODS = (4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 20, 25, 32, 40, 50, 64, 80, 100, 125, 160, 200, 250, 320, 400, 500)
#: How far the output begins below the integral, in 64ths of the largest power of two in the PWM's range (a constant of
#: few bits is one instruction); and the overshoot that a release may have, codes.
RELEASES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64)
RELEASED_CODES = 0.5
#: Share of the rated current above which it is too high, and for how long it may be, s.
OVER_SHARE, OVER_S = 1.2, 2e-3
#: Shares of the converter's range and of the rated current beyond which the load counts as shorted, the lower one.
SHORT_RANGE, SHORT_SHARE = 0.98, 1.45
#: Share of the rated current below which none seems to flow, and how many times that must flow where one is missed.
OPEN_SHARE, OPEN_TIMES, OPEN_PATIENCE = 0.02, 3.0, 4.0
#: PWM periods that a change of side takes beside the decay of the current.
CHANGE_PERIODS = 5
#: Of the converter's range, by which the sensor's zero may be off.
OFFSET_SHARE = 0.02
OFFSET_SHIFT = 6
#: Codes of the supply between two nodes of its correction.
SUPPLY_STEP = 64
#: Of the supply's range, by which a measured one may leave it before it counts as its end.
SUPPLY_BEYOND = 0.1
STEPS_OF_SEARCH = 16


def choose_gains(circuit: CoilCircuit, sampling: CurrentSampling, supply_measured: bool) -> Gains:
    """Return the largest gains with the phase margin that is asked for at every corner.

    The feed-forward is that of the corner that needs least: more would overshoot there. The integral brings the rest.
    """
    nominal = circuit.nominal
    per_period = sampling.period_s * nominal.resistance_ohm / nominal.inductance_H / INTEGRAL_TIME

    def gains(proportional: float) -> Gains:
        return Gains(
            proportional=proportional,
            integral=proportional * per_period,
            feed_forward=min(
                corner.resistance_ohm * (1 if supply_measured else circuit.nominal_V / corner.supply_V)
                for corner in circuit.corners()
            ),
            supply_measured=supply_measured,
        )

    low, high = 1e-3 * nominal.resistance_ohm, 1e4 * nominal.resistance_ohm
    for _ in range(STEPS_OF_SEARCH):
        middle = (low * high) ** 0.5
        if worst_margins(circuit, sampling, gains(middle), SEARCH_GRID)[0].phase_deg >= CHOSEN_PHASE_DEG:
            low = middle
        else:
            high = middle
    return gains(low)


def choose_loop(asked: CurrentRequest, compare_max: int) -> CurrentLoop:
    """Return the current loop in integers; a coil or a sensor that allows none is an `InputError`."""
    circuit, sensor, converter, sampling = asked.circuit, asked.sensor, asked.converter, asked.sampling
    if circuit.duty(circuit.nominal, circuit.rated_A) >= 1:
        raise InputError(
            f"the coil carries at most {circuit.nominal_V / circuit.nominal.resistance_ohm:.3g} A at "
            f"{circuit.nominal_V:.3g} V, expected more than the rated current of {circuit.rated_A:g} A; check --coil, "
            "--rated-current and --supply"
        )
    gains = choose_gains(circuit, sampling, sensor.supply_divider > 0)
    rated_V, full_V, samples = sensor.V_per_A * circuit.rated_A, float(converter.full_V), sampling.samples
    _refuse_sensor(sensor, rated_V, converter, samples)
    counts = circuit.rated_A / circuit.nominal_V  # of the PWM for a count of current, over V/A
    real = {name: getattr(gains, name) * counts for name in ("proportional", "integral", "feed_forward")}
    gain_shift = min(13, floor(log(LARGEST_GAIN / max(real.values()), 2)))
    if gain_shift < 1 or round(real["integral"] * 2**gain_shift) < 8:
        raise InputError(
            f"the current loop needs gains from {min(real.values()):.2g} to {max(real.values()):.2g} counts a count, "
            "which 13 bits do not hold; check the coil's resistance, inductance and rated current"
        )
    # Counts of current for a code of a period's sum; and that sum of a share of the rated current, less the offset.
    exact = compare_max / (samples * rated_V * converter.levels / full_V)
    current_shift = min(15, floor(log(65535 / exact, 2)))
    if current_shift < 1:
        raise InputError("the current's sensor is too weak: raise the shunt or its gain")
    current_gain = round(exact * 2**current_shift)

    def above(share: float) -> int:
        return round(samples * (share * rated_V * converter.levels / full_V))

    offset = samples * converter.code(Fraction(sensor.offset_V))
    # The load is shorted below what the controller's 31 bits hold.
    by_bits = ((LARGEST_ERROR << current_shift) - (1 << current_shift)) // current_gain
    hot = max(circuit.corners(), key=lambda corner: corner.resistance_ohm / corner.supply_V)
    open_duty = circuit.duty(hot, OPEN_TIMES * OPEN_SHARE * circuit.rated_A)
    slowest_s = max(corner.inductance_H / corner.resistance_ohm for corner in circuit.corners())
    loop = CurrentLoop(
        full_counts=compare_max,
        rate=min(compare_max, 65535),
        compare_limit=compare_max,
        samples=samples,
        current_gain=current_gain,
        current_shift=current_shift,
        gain_shift=gain_shift,
        **{name: round(value * 2**gain_shift) for name, value in real.items()},
        integral_limit=3 << (compare_max.bit_length() - 2),  # two bits are one instruction
        release=0,
        offset_nominal=offset,
        offset_tolerance=round(OFFSET_SHARE * converter.levels) * samples,
        offset_shift=OFFSET_SHIFT,
        short_sum=min(floor(SHORT_RANGE * converter.levels) * samples, offset + above(SHORT_SHARE), by_bits),
        over_sum=above(OVER_SHARE),
        over_ticks=ceil(OVER_S * sampling.tick_Hz),
        open_sum=max(1, above(OPEN_SHARE)),
        open_compare=ceil(open_duty * compare_max),
        open_ticks=ceil(OPEN_PATIENCE * slowest_s * log(OPEN_TIMES / (OPEN_TIMES - 1)) * sampling.tick_Hz),
        held_ticks=rest_ticks(circuit, sampling) if asked.solenoids == 2 else 0,
        shunts=asked.shunts,
        supply=_supply_correction(circuit, sensor, converter),
    )
    return _with_release(_with_rate(loop, asked), asked)


def rest_ticks(circuit: CoilCircuit, sampling: CurrentSampling) -> int:
    """Return the PWM periods with the output off in which the largest current decays at the slowest corner."""
    largest_A = SHORT_SHARE * circuit.rated_A
    slowest_s = max(circuit.fastest_fall_s(corner, largest_A, 0.0) for corner in circuit.corners())
    return ceil(slowest_s * sampling.tick_Hz)


def _with_rate(loop: CurrentLoop, asked: CurrentRequest) -> CurrentLoop:
    """Return the loop with the fastest set point whose step does not overshoot too far at any corner."""
    for periods in RATE_PERIODS:
        tried = replace(loop, rate=max(1, loop.full_counts // periods))
        if worst_step(step_responses(tried, asked, ends_only=True))[1].overshoot <= CHOSEN_OVERSHOOT:
            return tried
    raise InputError(
        f"the current overshoots by more than {CHOSEN_OVERSHOOT:.0%} however slowly the set point moves; declare "
        "narrower ranges of resistance, inductance or supply, or measure the supply"
    )


def _with_release(loop: CurrentLoop, asked: CurrentRequest) -> CurrentLoop:
    """Return the loop whose output begins low enough that no current overshoots as the drive is released.

    What the integral takes up on the way would carry the current past the offset, where the valve opens. It comes up
    from below instead, within some time constants of the integral. Where even the lowest beginning is too high it is
    taken, and `CurrentDrive.release_overshoot_A` says what is left.
    """
    unit = max((1 << (loop.full_counts.bit_length() - 1)) // 64, 1)
    allowed_A = allowed_at_release_A(asked)
    low, high = -1, len(RELEASES) - 1
    while high - low > 1:
        middle = (low + high) // 2
        tried = replace(loop, release=RELEASES[middle] * unit)
        if released_overshoot_A(tried, asked) <= allowed_A:
            high = middle
        else:
            low = middle
    return replace(loop, release=RELEASES[high] * unit)


def allowed_at_release_A(asked: CurrentRequest) -> float:
    """Return the overshoot of a release that is none: what the sensor does not show."""
    return RELEASED_CODES / (asked.sensor.V_per_A * asked.codes_per_V)


def worst_step(steps: Sequence[StepResponse]) -> tuple[StepResponse, StepResponse]:
    """Return the slowest step, and the one that overshoots most."""
    return max(steps, key=lambda step: step.rise_s), max(steps, key=lambda step: step.overshoot)


def _refuse_sensor(sensor: CurrentSensor, rated_V: float, converter: Converter, samples: int) -> None:
    """Refuse a sensor that gives the rated current, or none, a voltage that the converter can't tell."""
    top_V, full_V = sensor.offset_V + OVER_SHARE * rated_V, float(converter.full_V)
    if top_V > SHORT_RANGE * full_V:
        raise InputError(
            f"at {OVER_SHARE:.0%} of the rated current its sensor gives {top_V:.4g} V, expected at most "
            f"{SHORT_RANGE * full_V:.4g} V of the converter's {full_V:g} V; lower the shunt or its gain"
        )
    least_V = OFFSET_SHARE * full_V
    if not sensor.offset_V > least_V:
        raise InputError(
            f"without current its sensor gives {sensor.offset_V:g} V, expected more than {least_V:.3g} V: an "
            "offset below the converter's zero is not seen, so that the calibration leaves it in the current; "
            "shift the sensor, such as '0..1.2 A on 2 ohm + 0.15 V'"
        )
    if samples * converter.code_max > 65535:
        raise InputError(f"{samples} samples of the current do not fit a sum of 16 bits")


def _supply_correction(circuit: CoilCircuit, sensor: CurrentSensor, converter: Converter) -> SupplyCorrection | None:
    if not sensor.supply_divider:
        return None
    codes_per_V = sensor.supply_divider * converter.levels / float(converter.full_V)
    low = floor(circuit.supply_V[0] * (1 - SUPPLY_BEYOND) * codes_per_V)
    high = ceil(circuit.supply_V[1] * (1 + SUPPLY_BEYOND) * codes_per_V)
    if high > converter.code_max:
        raise InputError(
            f"a supply of {circuit.supply_V[1] * (1 + SUPPLY_BEYOND):.4g} V is beyond the converter's "
            f"{float(converter.full_V):g} V; lower the divider of {sensor.supply_divider:g}"
        )
    nodes = (high - low) // SUPPLY_STEP + 2
    factors = (
        circuit.nominal_V * codes_per_V / (low + 0.5 + node * SUPPLY_STEP) * (1 << CORRECTION_SHIFT)
        for node in range(nodes)
    )
    return SupplyCorrection(
        valid_codes=(low, high), step_codes=SUPPLY_STEP, nodes=tuple(min(round(factor), 65535) for factor in factors)
    )


def gains_of(loop: CurrentLoop, circuit: CoilCircuit) -> Gains:
    """Return the gains that the integers are, in units of the circuit."""
    unit = circuit.nominal_V / circuit.rated_A / (1 << loop.gain_shift)
    return Gains(
        proportional=loop.proportional * unit,
        integral=loop.integral * unit,
        feed_forward=loop.feed_forward * unit,
        supply_measured=loop.supply is not None,
    )


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
        """PWM periods with the output off after which no current is left."""
        return rest_ticks(self.circuit, self.sampling)

    @property
    def decayed_A(self) -> float:
        """Current of one solenoid below which the other is driven."""
        return OPEN_SHARE * self.circuit.rated_A

    @property
    def change_s(self) -> float:
        """Longest time from a change of side to the first pulse of the other solenoid, at the slowest corner.

        From the largest current that is no fault. A period ends before the output is off, the sum of codes is of two
        periods, and the next two set the compare value and load it.
        """
        circuit = self.circuit
        largest_A = OVER_SHARE * circuit.rated_A
        slowest_s = max(circuit.fastest_fall_s(corner, largest_A, self.decayed_A) for corner in circuit.corners())
        return slowest_s + CHANGE_PERIODS * self.sampling.period_s

    def in_words(self, units: RecordedUnits) -> tuple[str, ...]:
        """Return lines for a person."""
        circuit, loop = self.circuit, self.loop
        low, high = circuit.supply_V
        measured = "measured" if loop.supply else "not measured"
        lines = [
            f"drive: current control, full drive is {units.text(circuit.rated_A, 'g A')}; coil "
            f"{circuit.resistance_ohm:g} + "
            f"{circuit.series_ohm:g} ohm (x {_ends(circuit.resistance_factors)}), {1e3 * circuit.inductance_H:g} mH (x "
            f"{_ends(circuit.inductance_factors)}), supply {low:g}..{high:g} V, {measured}",
            f"current loop: phase margin {self.phase_margin_deg:.0f} degrees, gain margin {self.gain_margin:.1f} at "
            f"the worst corner; 10 to 90 % in {1e3 * self.rise_s:.1f} ms at the slowest ({1e3 * self.least_rise_s:.1f} "
            f"ms with the switch on all the time), overshoot up to {self.overshoot:.1%}; 90 to 10 % takes up to "
            f"{1e3 * self.fall_s:.0f} ms, as the freewheeling diode alone brakes",
        ]
        if loop.two:
            shunts = "each solenoid with a shunt of its own" if loop.shunts == 2 else "one shunt for both solenoids"
            lines.append(
                f"change of side: a solenoid is driven once the current of the other is below "
                f"{units.text(self.decayed_A, '.3g A')}, after {1e3 * self.change_s:.0f} ms at most; {shunts}"
            )
        weakest = min(circuit.corners(), key=lambda corner: corner.supply_V / corner.resistance_ohm)
        if circuit.duty(weakest, circuit.rated_A) >= 1:  # no supply drives the rated current there, so it has no step
            most = units.text(weakest.supply_V / weakest.resistance_ohm, ".3g A")
            lines.append(
                f"at {weakest.supply_V:g} V the hottest coil of {weakest.resistance_ohm:.3g} ohm carries {most} at "
                "most, so that full command has less than the rated current; step and margins are of the others"
            )
        return tuple(lines)

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


def _ends(factors: tuple[float, float]) -> str:
    return f"{factors[0]:g}..{factors[1]:g}"


def design_current_drive(asked: CurrentRequest, compare_max: int, dither: tuple[int, int] = (0, 1)) -> CurrentDrive:
    """Choose the loop of a coil, and compute what it holds; a dither has a peak, counts, and periods of half a wave."""
    circuit, loop = asked.circuit, choose_loop(asked, compare_max)
    phase, gain = worst_margins(circuit, asked.sampling, gains_of(loop, circuit))
    slowest, largest = worst_step(step_responses(loop, asked))
    if not isfinite(slowest.rise_s):
        raise InputError(
            f"with {slowest.corner.resistance_ohm:.3g} ohm and {slowest.corner.inductance_H:.3g} H at "
            f"{slowest.corner.supply_V:.3g} V the current does not reach 90 % of the rated one in {1e3 * STEP_S:g} ms; "
            "declare narrower ranges of coil and supply, or a lower --rated-current"
        )
    released_A = released_overshoot_A(loop, asked)
    above, below = dither_departure(loop, asked, counts=dither[0], ticks=dither[1])
    high, low = 0.9 * circuit.rated_A, 0.1 * circuit.rated_A
    return CurrentDrive(
        circuit=circuit,
        sensor=asked.sensor,
        sampling=asked.sampling,
        loop=loop,
        phase_margin_deg=round(phase.phase_deg, 3),
        gain_margin=round(gain.gain, 4),
        rise_s=round(slowest.rise_s, 9),
        least_rise_s=round(slowest.least_s, 9),
        fall_s=round(max(circuit.fastest_fall_s(corner, high, low) for corner in circuit.corners()), 9),
        overshoot=round(largest.overshoot, 6),
        release_overshoot_A=round(released_A, 9) if released_A > allowed_at_release_A(asked) else 0.0,
        dither_above_counts=above,
        dither_below_counts=below,
    )
