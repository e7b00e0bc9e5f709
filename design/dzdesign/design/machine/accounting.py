"""The uncertainty budget of a side, from the curve and the allowance of its ceiling; and what it covers, in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import floor
from typing import NamedTuple

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine.allowance import Allowance
from dzdesign.design.machine.budget import Budget, BudgetLine, Component, DIGITS_mV, Origin
from dzdesign.design.machine.machine import Machine
from dzdesign.design.offset.offset_ceiling import OffsetCurve, certified_V
from dzdesign.design.signals import SIDE_NAMES
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


def budget_of(
    side: SideModel,
    curve: OffsetCurve,
    u_max_V: Fraction,
    allowance: Allowance,
    guard: str,
    machine: Machine | None,
) -> Budget:
    """Return the budget of a side at its tested pressure drops, from the curve that its certificate is of."""
    stated = side.certified[guard]
    threshold = replace(
        curve,
        dp_MPa=tuple(Fraction(repr(dp)) for dp in stated.dp_MPa),
        offset_V=tuple(Fraction(repr(value)) for value in stated.u_threshold_V),
        certified=None,
    )
    table = _Table(curve=curve, threshold=threshold, u_max_V=u_max_V, allowance=allowance)
    components: list[Component] = [RECORDING, *allowance.pressures_MPa, *allowance.factors]
    components += ["rounding of pressures", *allowance.shares]
    return Budget(
        dp_MPa=stated.dp_MPa,
        threshold_V=tuple(round(float(value), DIGITS_V) for value in table.at_tests(threshold)),
        ceiling_V=tuple(round(float(value), DIGITS_V) for value in table.limits(curve, allowance)),
        lines=tuple(_line(component, table, machine) for component in components),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Table:
    """Curves and allowance, and what they come to at the tests."""

    curve: OffsetCurve
    #: The guarded threshold as the recordings have it, which no bound holds.
    threshold: OffsetCurve
    u_max_V: Fraction
    allowance: Allowance
    #: Certified values that were computed, of a curve (by its identity) at a code.
    known: dict[tuple[int, int], Fraction] = field(default_factory=dict)

    def value(self, curve: OffsetCurve, code: int) -> Fraction:
        """Return a curve at a difference of pressure codes, V."""
        key = id(curve), code
        if key not in self.known:
            self.known[key] = certified_V(curve, self.allowance.signals.dp_MPa(code))
        return self.known[key]

    @property
    def codes(self) -> tuple[int, ...]:
        """Differences of pressure codes at the tests, none beyond the last of them: there another rule begins."""
        exact = [self.allowance.signals.dp_code(dp) for dp in self.threshold.dp_MPa]
        return tuple(min(round(code), floor(exact[-1])) for code in exact)

    def at_tests(self, curve: OffsetCurve) -> list[Fraction]:
        """Return a curve at the tests' codes, V."""
        return [self.value(curve, code) for code in self.codes]

    def limits(self, curve: OffsetCurve, allowance: Allowance) -> list[Fraction]:
        """Return the largest offset that an allowance leaves of a curve at the tests' codes, V."""
        low, high = allowance.window
        least = (min(self.value(curve, code + each) for each in range(low, high + 1)) for code in self.codes)
        return [value * allowance.factor - allowance.kept * self.u_max_V for value in least]

    def contributions(self, component: Component) -> list[Fraction]:
        """Return by how much a component alone lowers the certified threshold at the tests, V."""
        certified = self.at_tests(self.curve)
        if component == RECORDING:
            return _less(self.at_tests(self.threshold), certified)
        return _less(certified, self.limits(self.curve, self.allowance.only(component)))

    def price(self, component: Component) -> Fraction:
        """Return by how much the offset would rise without a component, V, at most of the tests."""
        full = self.limits(self.curve, self.allowance)
        if component == RECORDING:
            return max(_less(self.limits(self.threshold, self.allowance), full))
        return max(_less(self.limits(self.curve, self.allowance.without(component)), full))


def _less(values: Sequence[Fraction], others: Sequence[Fraction]) -> list[Fraction]:
    return [value - other for value, other in zip(values, others, strict=True)]


def _line(component: Component, table: _Table, machine: Machine | None) -> BudgetLine:
    contributions = [1000 * value for value in table.contributions(component)]
    half_width, unit = _half_width(component, table, machine, contributions)
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
        price=round(float(table.price(component) / table.u_max_V), DIGITS),
    )


def _half_width(
    component: Component, table: _Table, machine: Machine | None, contributions_mV: Sequence[Fraction]
) -> tuple[Fraction, str]:
    """Return a component's half-width and its unit; of a range its end that lowers the threshold."""
    allowance = table.allowance
    if component == RECORDING:
        return max(contributions_mV), "mV"
    if component == "rounding of pressures":
        low, high = allowance.signals.difference_error(allowance.sign)
        return Fraction(max(-low, high)), "codes"
    if component in ("rounding of the drive", "dither"):
        return allowance.shares[component] * allowance.signals.compare_max, "counts"
    if component in allowance.shares:
        return 100 * allowance.shares[component], "%"
    if machine is None:
        raise ValueError(f"{component} without a machine")
    if component == "coil temperature":
        bench = machine.bench_coil_C or 0.0
        return Fraction(repr(bench)) - Fraction(repr(min((*(machine.coil_temperature_C or ()), bench)))), "K"
    if component == "supply":
        bench = machine.bench_supply_V or 0.0
        return Fraction(repr(max((*(machine.supply_V or ()), bench)))) - Fraction(repr(bench)), "V"
    if component in allowance.pressures_MPa and "converter" not in component:
        return allowance.pressures_MPa[component], "MPa"
    declared = Fraction(repr(getattr(machine, DECLARED[component].field)))
    return (declared, "codes") if "converter" in component else (100 * declared, "%")


class _Declared(NamedTuple):
    """Key of `Machine` that a component is from, and the option that declares it."""

    field: str
    option: str


DECLARED: Mapping[Component, _Declared] = {
    "bench pressure drop": _Declared("bench_pressure_error_MPa", "--bench-pressure-error"),
    "pressure sensor A": _Declared("pressure_error_a_MPa", "--pressure-error"),
    "pressure sensor B": _Declared("pressure_error_b_MPa", "--pressure-error"),
    "pressure converter offset": _Declared("pressure_offset_codes", "--pressure-converter"),
    "pressure converter gain": _Declared("pressure_gain_codes", "--pressure-converter"),
    "pressure converter noise": _Declared("pressure_noise_codes", "--pressure-converter"),
    "coil temperature": _Declared("bench_coil_C", "--coil-temperature, --bench-coil"),
    "supply": _Declared("bench_supply_V", "--supply, --bench-supply"),
    "amplifier": _Declared("amplifier_error", "--amplifier"),
    "current": _Declared("current_error", "--current-error"),
    "current's rest": _Declared("current_rest_error", "--current-signal"),
    "bench current": _Declared("bench_current_error", "--bench-current"),
    "oil": _Declared("oil_error", "--oil"),
    "ageing": _Declared("ageing_error", "--ageing"),
}


def _declared(component: Component, machine: Machine | None) -> tuple[Origin, str]:
    """Return whether a component of the machine was declared, and by which option, or whose default it took."""
    known = DECLARED[component]
    if machine is None or known.field not in machine.defaults:
        return "declared", known.option
    if component in RANGES:  # the range was declared, but what it is counted from was not
        return "default", f"{machine.defaults[known.field]}; the range by {known.option.partition(',')[0]}"
    return "default", machine.defaults[known.field]


#: Components whose range is declared against a value on the bench.
RANGES = ("coil temperature", "supply")


def reach_of_certificate(compensator: Compensator) -> str:
    """Return a sentence on what the certificate counts of a machine, or that it counts nothing of one."""
    if compensator.machine is None:
        return (
            "The certificate covers the valve as recorded: no machine was declared, so coil temperature, "
            "supply voltage, pressure sensors, oil and ageing are not counted."
        )
    parts = []
    for sign in compensator.signals.signs:
        budget, name = compensator.side(sign).budget, SIDE_NAMES[sign]
        side = "" if compensator.negative is None else f"{name} commands: "
        if budget is not None:
            parts.append(side + taken_off(budget, compensator.valve.recorded_units.of_side(name)))
    return f"The certificate covers the valve as recorded and the declared machine: {'; '.join(parts)}."


def taken_off(budget: Budget, units: RecordedUnits) -> str:
    """Return by how much the offset's ceiling lies under the recorded threshold at most, and for what mostly."""
    place = max(range(len(budget.dp_MPa)), key=lambda at: budget.combined_mV[at])
    largest = budget.largest
    return (
        f"its budget takes {units.text(budget.combined_mV[place], '.0f mV')} from the recorded threshold at "
        f"{units.text(budget.dp_MPa[place], '.2f MPa')}; its largest component is {largest.component} "
        f"({largest.origin}), {units.text(largest.contribution_mV[place], '.0f mV')}"
    )


def not_counted(compensator: Compensator | None) -> tuple[str, ...]:
    """Return lines on what of a machine the certificate leaves out."""
    if compensator is None or compensator.machine is None:
        return (
            "The machine: another coil temperature or supply than on the bench, errors of its pressure sensors and of "
            "their converters beyond rounding, the oil and ageing. `dzdesign design` counts them where they are "
            "declared.",
            "Failures that the signals hide, and the spread between valves of a type.",
        )
    return (
        "A machine outside what was declared: the budget counts that, and nothing beyond it.",
        "Defaults of the budget that nobody measured on this machine; each is named in its table.",
        "Failures that the signals hide, and the spread between valves of a type.",
    )
