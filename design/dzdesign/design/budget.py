"""The uncertainty budget of a side, in the form of the GUM (JCGM 100): what lowers the offset under the threshold.

Component, origin, half-width, sensitivity, contribution. All of it is systematic and one-sided: nothing averages out,
so nothing is added in squares. The drive, oil and ageing multiply, the pressures' half-widths add before the least
bound over them is taken, and the counts of the drive are subtracted last.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import floor
from typing import NamedTuple

from dzdesign.design.ceiling import OffsetCurve, certified_V
from dzdesign.design.machine import Allowance, Machine
from dzdesign.design.side_law import Budget, BudgetLine, Component, DIGITS_mV, Origin
from dzdesign.identify.valve.side_model import SideModel

DIGITS_V = 7
#: Of a half-width and a price: finer than any error here.
DIGITS = 9
RECORDING: Component = "recording"


class _Stated(NamedTuple):
    """What states a component: an option or what was measured, the unit of its half-width, and its key of `Machine`."""

    source: str
    unit: str = "%"
    field: str = ""


STATED: Mapping[Component, _Stated] = {
    RECORDING: _Stated("noise, meter zero, repeatability and the premise between the tests", "mV"),
    "rounding of pressures": _Stated("the converter's codes", "codes"),
    "rounding of the drive": _Stated("half a count of the PWM", "counts"),
    "dither": _Stated("--dither", "counts"),
    "bench pressure drop": _Stated("--bench-pressure-error", "MPa", "bench_pressure_error_MPa"),
    "pressure sensor A": _Stated("--pressure-error", "MPa", "pressure_error_a_MPa"),
    "pressure sensor B": _Stated("--pressure-error", "MPa", "pressure_error_b_MPa"),
    "pressure sensor C": _Stated("--pressure-error", "MPa", "pressure_error_c_MPa"),
    "pressure converter offset": _Stated("--pressure-converter", "codes", "pressure_offset_codes"),
    "pressure converter gain": _Stated("--pressure-converter", "codes", "pressure_gain_codes"),
    "pressure converter noise": _Stated("--pressure-converter", "codes", "pressure_noise_codes"),
    "coil temperature": _Stated("--coil-temperature, --bench-coil", "K", "bench_coil_C"),
    "supply": _Stated("--supply, --bench-supply", "V", "bench_supply_V"),
    "amplifier": _Stated("--amplifier", field="amplifier_error"),
    "current": _Stated("--current-error", field="current_error"),
    "current's rest": _Stated("--current-signal", field="current_rest_error"),
    "bench current": _Stated("--bench-current", field="bench_current_error"),
    "oil": _Stated("--oil", field="oil_error"),
    "ageing": _Stated("--ageing", field="ageing_error"),
}
#: Components whose range is declared against a value on the bench.
RANGES = ("coil temperature", "supply")


def budget_of(
    side: SideModel,
    curve: OffsetCurve,
    u_max_V: Fraction,
    allowance: Allowance,
    guard: str,
    machine: Machine | None,
) -> Budget:
    """Return the budget of a side at its tested pressure drops, from the curve that its certificate is of."""
    stated, pair = side.certified[guard], allowance.pair
    # The guarded threshold as the recordings have it, which no bound holds.
    recorded = replace(
        curve,
        dp_MPa=tuple(Fraction(repr(dp)) for dp in stated.dp_MPa),
        offset_V=tuple(Fraction(repr(value)) for value in stated.u_threshold_V),
        certified=None,
    )
    # At the tests, none beyond the last of them: there another rule begins.
    exact = [pair.dp_code(dp) for dp in recorded.dp_MPa]
    codes = [min(round(code), floor(exact[-1])) for code in exact]

    @cache
    def value_V(of_recording: bool, code: int) -> Fraction:
        return certified_V(recorded if of_recording else curve, pair.dp_MPa(code))

    def limits_V(allowed: Allowance, *, of_recording: bool = False) -> list[Fraction]:
        """Return the largest offset that an allowance leaves at the tests' codes."""
        low, high = allowed.window
        least = (min(value_V(of_recording, code + each) for each in range(low, high + 1)) for code in codes)
        return [value * allowed.factor - allowed.kept * u_max_V for value in least]

    threshold_V, certified = ([value_V(of_recording, code) for code in codes] for of_recording in (True, False))
    full_V = limits_V(allowance)

    def line(component: Component) -> BudgetLine:
        if component == RECORDING:
            alone, without = _less(threshold_V, certified), limits_V(allowance, of_recording=True)
        else:
            alone = _less(certified, limits_V(allowance.only(component)))
            without = limits_V(allowance.without(component))
        contributions = [1000 * value for value in alone]
        half_width = _half_width(component, allowance, machine, contributions)
        origin, source = _of(component, machine)
        sensitivities = [value / half_width if half_width else Fraction(0) for value in contributions]
        return BudgetLine(
            component=component,
            origin=origin,
            source=source,
            half_width=round(float(half_width), DIGITS),
            unit=STATED[component].unit,
            sensitivity_mV=tuple(round(float(value), DIGITS_mV) for value in sensitivities),
            contribution_mV=tuple(round(float(value), DIGITS_mV) for value in contributions),
            price=round(float(max(_less(without, full_V)) / u_max_V), DIGITS),
        )

    components: list[Component] = [RECORDING, *allowance.pressures_MPa, *allowance.factors]
    components += ["rounding of pressures", *allowance.shares]
    return Budget(
        dp_MPa=stated.dp_MPa,
        threshold_V=tuple(round(float(value), DIGITS_V) for value in threshold_V),
        ceiling_V=tuple(round(float(value), DIGITS_V) for value in full_V),
        lines=tuple(map(line, components)),
    )


def _less(values: Sequence[Fraction], others: Sequence[Fraction]) -> list[Fraction]:
    return [value - other for value, other in zip(values, others, strict=True)]


def _half_width(
    component: Component, allowance: Allowance, machine: Machine | None, contributions_mV: Sequence[Fraction]
) -> Fraction:
    """Return a component's half-width in its unit; of a range its end that lowers the threshold."""
    if component == RECORDING:
        return max(contributions_mV)
    if component == "rounding of pressures":
        low, high = allowance.pair.difference_error(allowance.signals.code_max)
        return Fraction(max(-low, high))
    if component in ("rounding of the drive", "dither"):
        return allowance.shares[component] * allowance.signals.compare_max
    declared = Fraction(repr(getattr(machine, STATED[component].field) or 0.0))
    if machine is not None and component == "coil temperature":
        return declared - min(declared, *map(Fraction, map(repr, machine.coil_temperature_C or ())))
    if machine is not None and component == "supply":
        return max(declared, *map(Fraction, map(repr, machine.supply_V or ()))) - declared
    return 100 * declared if STATED[component].unit == "%" else declared


def _of(component: Component, machine: Machine | None) -> tuple[Origin, str]:
    """Return whether a component was measured or declared, and by what, or whose default it took."""
    source, _, field = STATED[component]
    if machine is None or field not in machine.defaults:
        return "measured" if component == RECORDING else "declared", source
    if component in RANGES:  # the range was declared, but what it is counted from was not
        return "default", f"{machine.defaults[field]}; the range by {source.partition(',')[0]}"
    return "default", machine.defaults[field]
