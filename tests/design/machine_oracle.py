"""The certificate of a declared machine, argued again: every corner of sensors, coil, supply and oil by brute force.

Own formulas from the declared numbers and the bounds of valve.json: of `dzdesign.design` nothing but the law's table
and the scaling of codes, which `verify` checks against the firmware.
"""

from functools import cache
from itertools import product
from math import floor

COPPER = 0.00393
#: Of the pressures that are tried, MPa.
STEP_MPa = 0.02
SIGNS = (-1, 1)


def bound_V(side, guard: str, dp_MPa: float) -> float:
    """Return the certified bound by the rule that valve.json states, V; infinite outside the tests."""
    curve = side.certified[guard]
    nodes, bounds = curve.bound_dp_MPa, curve.bound_V
    for low, high, one, other in zip(nodes, nodes[1:], bounds, bounds[1:], strict=False):
        if low <= dp_MPa <= high:
            return one + (other - one) * (dp_MPa - low) / (high - low)
    return float("inf")


def read_codes(compensator, machine, dp_MPa: float, back_MPa: float, converter) -> set[int]:
    """Return every difference of codes that the firmware may read at a pressure drop, sensor by sensor at its ends."""
    signals = compensator.signals

    def codes(sensor, pressure_MPa, error_MPa):
        found = set()
        per_MPa = (sensor.full_code - sensor.zero_code) / float(sensor.span_MPa)
        for error, offset, gain, noise in product(SIGNS, repeat=4):
            exact = sensor.zero_code + per_MPa * (pressure_MPa + error * error_MPa)
            exact += offset * machine.pressure_offset_codes + noise * machine.pressure_noise_codes
            exact += gain * machine.pressure_gain_codes * exact / converter.code_max
            found |= {floor(exact), floor(exact) + 1}  # where in a code zero pressure lies, nobody knows
        return found

    ahead = codes(signals.pressure_a, dp_MPa + back_MPa, machine.pressure_error_a_MPa)
    behind = codes(signals.pressure_b, back_MPa, machine.pressure_error_b_MPa)
    return {signals.pair(1).difference(*pair) for pair in product((min(ahead), max(ahead)), (min(behind), max(behind)))}


def threshold_factors(machine) -> tuple[list[float], float]:
    """Return the thresholds over the bench's that the machine may have, as a drive, and the current's rest."""
    if machine.drive == "duty":
        bench = 1 + COPPER * (machine.bench_coil_C - 20)
        drives = [
            (1 + COPPER * (coil - 20)) / bench * machine.bench_supply_V / supply
            for coil, supply in product(machine.coil_temperature_C, machine.supply_V)
        ]
    elif machine.drive == "amplifier":
        drives = [1 / (1 + sign * machine.amplifier_error) for sign in SIGNS]
    else:
        drives = [
            (1 + bench * machine.bench_current_error) / (1 + sign * machine.current_error)
            for sign, bench in product(SIGNS, repeat=2)
        ]
    moved = product(drives, SIGNS, SIGNS)
    factors = [drive * (1 + oil * machine.oil_error) * (1 + age * machine.ageing_error) for drive, oil, age in moved]
    return factors, (machine.current_rest_error or 0.0)


def worst_margin_mV(compensator, machine, converter, guard: str = "closing") -> float:
    """Return the least distance from the offset to the bound over all corners of a machine, mV; negative: flow."""
    side, u_max_V = compensator.valve.positive, float(compensator.u_max_V)
    factors, rest = threshold_factors(machine)
    low, high = side.certified[guard].dp_MPa[0], side.certified[guard].dp_MPa[-1]

    @cache
    def offset_V(code: int) -> float:
        command = compensator.signals.command.zero_code
        return compensator.compare(command, code) / compensator.signals.compare_max * u_max_V

    span = float(min(compensator.signals.pressure_a.span_MPa, compensator.signals.pressure_b.span_MPa))
    worst = float("inf")
    for step in range(round((high - low) / STEP_MPa) + 1):
        dp = min(low + step * STEP_MPa, high)
        error = machine.bench_pressure_error_MPa
        bound = min(bound_V(side, guard, dp + shift * error / 4) for shift in range(-4, 5))
        codes = set().union(*(read_codes(compensator, machine, dp, back, converter) for back in (0.0, span - dp)))
        offset = max(offset_V(code) for code in codes)
        # The current is higher by its rest: as if the offset were.
        worst = min(worst, *(bound * factor - offset - rest * u_max_V * max(1.0, factor) for factor in factors))
    return 1e3 * worst
