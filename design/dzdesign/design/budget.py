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
#: Where what nobody declares is from.
SOURCES: Mapping[Component, tuple[Origin, str]] = {
    RECORDING: ("measured", "noise, meter zero, repeatability and the premise between the tests"),
    "rounding of pressures": ("declared", "the converter's codes"),
    "rounding of the drive": ("declared", "half a count of the PWM"),
    "dither": ("declared", "--dither"),
}


class _Declared(NamedTuple):
    """Key of `Machine` that a component is from, the option that declares it, and the unit of its half-width."""

    field: str
    option: str
    unit: str = "%"


DECLARED: Mapping[Component, _Declared] = {
    "bench pressure drop": _Declared("bench_pressure_error_MPa", "--bench-pressure-error", "MPa"),
    "pressure sensor A": _Declared("pressure_error_a_MPa", "--pressure-error", "MPa"),
    "pressure sensor B": _Declared("pressure_error_b_MPa", "--pressure-error", "MPa"),
    "pressure converter offset": _Declared("pressure_offset_codes", "--pressure-converter", "codes"),
    "pressure converter gain": _Declared("pressure_gain_codes", "--pressure-converter", "codes"),
    "pressure converter noise": _Declared("pressure_noise_codes", "--pressure-converter", "codes"),
    "coil temperature": _Declared("bench_coil_C", "--coil-temperature, --bench-coil", "K"),
    "supply": _Declared("bench_supply_V", "--supply, --bench-supply", "V"),
    "amplifier": _Declared("amplifier_error", "--amplifier"),
    "current": _Declared("current_error", "--current-error"),
    "current's rest": _Declared("current_rest_error", "--current-signal"),
    "bench current": _Declared("bench_current_error", "--bench-current"),
    "oil": _Declared("oil_error", "--oil"),
    "ageing": _Declared("ageing_error", "--ageing"),
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
    stated, signals = side.certified[guard], allowance.signals
    # The guarded threshold as the recordings have it, which no bound holds.
    recorded = replace(
        curve,
        dp_MPa=tuple(Fraction(repr(dp)) for dp in stated.dp_MPa),
        offset_V=tuple(Fraction(repr(value)) for value in stated.u_threshold_V),
        certified=None,
    )
    # At the tests, none beyond the last of them: there another rule begins.
    exact = [signals.dp_code(dp) for dp in recorded.dp_MPa]
    codes = [min(round(code), floor(exact[-1])) for code in exact]

    @cache
    def value_V(of_recording: bool, code: int) -> Fraction:
        return certified_V(recorded if of_recording else curve, signals.dp_MPa(code))

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
        half_width, unit = _half_width(component, allowance, machine, contributions)
        origin, source = SOURCES[component] if component in SOURCES else _declared(component, machine)
        sensitivities = [value / half_width if half_width else Fraction(0) for value in contributions]
        return BudgetLine(
            component=component,
            origin=origin,
            source=source,
            half_width=round(float(half_width), DIGITS),
            unit=unit,
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
) -> tuple[Fraction, str]:
    """Return a component's half-width and its unit; of a range its end that lowers the threshold."""
    if component == RECORDING:
        return max(contributions_mV), "mV"
    if component == "rounding of pressures":
        low, high = allowance.signals.difference_error(allowance.sign)
        return Fraction(max(-low, high)), "codes"
    if component in ("rounding of the drive", "dither"):
        return allowance.shares[component] * allowance.signals.compare_max, "counts"
    field, _, unit = DECLARED[component]
    declared = Fraction(repr(getattr(machine, field) or 0.0))
    if machine is not None and component == "coil temperature":
        return declared - min(declared, *map(Fraction, map(repr, machine.coil_temperature_C or ()))), unit
    if machine is not None and component == "supply":
        return max(declared, *map(Fraction, map(repr, machine.supply_V or ()))) - declared, unit
    return 100 * declared if unit == "%" else declared, unit


def _declared(component: Component, machine: Machine | None) -> tuple[Origin, str]:
    """Return whether a component of the machine was declared, and by which option, or whose default it took."""
    field, option, _ = DECLARED[component]
    if machine is None or field not in machine.defaults:
        return "declared", option
    if component in RANGES:  # the range was declared, but what it is counted from was not
        return "default", f"{machine.defaults[field]}; the range by {option.partition(',')[0]}"
    return "default", machine.defaults[field]
