"""`Machine`: by how much a machine may differ from the bench on which the valve was recorded, as declared; `Allowance`.

The valve's threshold is a current. What the firmware puts out for it differs from machine to machine with the coil's
resistance, the supply and the sensors; oil and ageing move the threshold itself. The offset's ceiling keeps that free
under the certified curve, and what rounding and dither take: pressures that it may be, factors, counts. Each is kept by
its component, so that the budget can leave one out and see what it costs.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, prod
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.dither import Dither
from dzdesign.core.errors import InputError
from dzdesign.core.units import measures, si_factor
from dzdesign.design.current.drive import CurrentDrive
from dzdesign.design.drive_functions import DrivenDither
from dzdesign.design.side_law import Component
from dzdesign.design.signals import PressurePair, Signals
from dzdesign.identify.valve.model import ValveModel

#: Temperature coefficient of copper about 20 degC, 1/K (IEC 60028): R = R20 (1 + alpha (T - 20)).
COPPER_PER_K = Fraction("0.00393")
REFERENCE_C = 20
#: Temperatures that a solenoid's coil survives, and supplies, V.
COIL_C, SUPPLY_V = (-60.0, 250.0), (1.0, 1000.0)
#: Larger relative errors are no tolerance.
LARGEST_SHARE = 0.5
LARGEST_MPa = 100.0

#: What stands between the law's output and the coil.
DriveKind = Literal["duty", "amplifier", "current"]
Share = Annotated[float, Meta(ge=0, le=LARGEST_SHARE)]
Pressure = Annotated[float, Meta(ge=0, le=LARGEST_MPa)]
Error = Annotated[int, Meta(ge=0, le=4095)]
Temperature = Annotated[float, Meta(ge=COIL_C[0], le=COIL_C[1])]
Supply = Annotated[float, Meta(ge=SUPPLY_V[0], le=SUPPLY_V[1])]


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """Declared differences between the machine and the bench; every error is a systematic half-width."""

    drive: DriveKind
    """How the coil is driven. duty: the PWM switches the coil itself, so that the threshold in duty depends on
    resistance and supply. amplifier: a current-controlled amplifier drives it. current: the firmware controls the
    current."""
    coil_temperature_C: Annotated[tuple[Temperature, Temperature], quantity("degC")] | None = None
    """Lowest and highest coil temperature; null if the current is controlled and no range was declared."""
    bench_coil_C: Annotated[Temperature, quantity("degC")] | None = None
    """Coil temperature during the ramp tests; null if no range was declared."""
    supply_V: Annotated[tuple[Supply, Supply], quantity("V")] | None = None
    """Lowest and highest supply voltage; null if an amplifier was declared without a supply."""
    bench_supply_V: Annotated[Supply, quantity("V")] | None = None
    """Supply voltage during the ramp tests; null if no range was declared."""
    amplifier_error: Annotated[Share, quantity("1")] | None = None
    """Relative error of the amplifier's current against that of the bench at the same drive; null without an
    amplifier."""
    current_error: Annotated[Share, quantity("1")] | None = None
    """Relative error of the controlled current, by shunt, amplifier and the converter's gain; null without current
    control."""
    current_rest_error: Annotated[Share, quantity("1")] | None = None
    """Remaining error of the controlled current by rounding and the calibrated offset, as a share of the rated current;
    null without current control."""
    bench_current_error: Annotated[Share, quantity("1")] | None = None
    """Relative error of the bench's current at a recorded command; null without current control."""
    bench_full_A: Annotated[float, quantity("A", gt=0, le=1000)] | None = None
    """Declared coil current at full command on the bench; null if none was declared."""
    pressure_error_a_MPa: Annotated[Pressure, quantity("MPa")]
    """Error of the sensor upstream of the metering edge, offset and gain combined."""
    pressure_error_b_MPa: Annotated[Pressure, quantity("MPa")]
    """Error of the sensor downstream of the metering edge, offset and gain combined."""
    pressure_error_c_MPa: Annotated[Pressure, quantity("MPa")] | None = None
    """Error of the third sensor, offset and gain combined; null without one."""
    bench_pressure_error_MPa: Annotated[Pressure, quantity("MPa")]
    """Error of the recorded pressure drop."""
    pressure_offset_codes: Error
    """Offset error of the converter on each pressure channel."""
    pressure_gain_codes: Error
    """Gain error of the converter on each pressure channel, at the top of its range."""
    pressure_noise_codes: Error
    """Peak noise of the converter on each pressure channel."""
    oil_error: Annotated[Share, quantity("1")]
    """Relative change of the threshold with the oil's temperature."""
    ageing_error: Annotated[Share, quantity("1")]
    """Relative change of the threshold by ageing."""
    defaults: Mapping[str, str]
    """Quantities above that were not declared, with the source of the default value."""

    def __post_init__(self) -> None:
        for what, unit, ends, bench in (
            ("the coil's temperature", "degC", self.coil_temperature_C, self.bench_coil_C),
            ("the supply", "V", self.supply_V, self.bench_supply_V),
        ):
            if (bench is not None and ends is None) or (bench is None and self.drive == "duty"):
                raise RuleError(f"{what} needs both, its range on the machine and its value on the bench")
            low, high = COIL_C if unit == "degC" else SUPPLY_V
            if any(not low <= value <= high for value in (*(ends or ()), *(() if bench is None else (bench,)))):
                raise RuleError(f"{what} is beyond {low:g} to {high:g} {unit}")
            if ends is not None and ends[0] > ends[1]:
                raise RuleError(f"{what} runs from {ends[0]:g} to {ends[1]:g} {unit}, expected the lower end first")
        for name in self.__slots__:
            value = getattr(self, name)
            limit = LARGEST_MPa if name.endswith("_MPa") else LARGEST_SHARE
            if "_error" in name and value is not None and not 0 <= value <= limit:
                raise RuleError(f"{name} is {value:g}, expected 0 to {limit:g}")

    def pressure_error_MPa(self, name: str) -> float:
        """Return the error of the sensor at a pressure input."""
        error: float | None = getattr(self, f"pressure_error_{name.lower()}_MPa")
        return error or 0.0

    @property
    def least_factors(self) -> dict[Component, Fraction]:
        """The least threshold over that on the bench, component by component; the bench itself is a machine too."""
        oil, ageing = 1 - _exact(self.oil_error), 1 - _exact(self.ageing_error)
        return {**self._drive_factors(-1), "oil": oil, "ageing": ageing}

    @property
    def least_factor(self) -> Fraction:
        """The least threshold over that on the bench: drive, oil and ageing all at their worst."""
        return prod(self.least_factors.values(), start=Fraction(1))

    @property
    def largest_factor(self) -> Fraction:
        """The largest threshold over that on the bench: all at their other ends."""
        moved = (1 + _exact(self.oil_error)) * (1 + _exact(self.ageing_error))
        return prod(self._drive_factors(1).values(), start=moved)

    def _drive_factors(self, way: int) -> dict[Component, Fraction]:
        """Return the factors of the drive's components at the end that raises (1) or lowers (-1) the threshold."""
        worst = max if way > 0 else min
        if self.drive == "duty":
            bench_C, bench_V = self.bench_coil_C or 0.0, self.bench_supply_V or 0.0
            coils, supplies = (*(self.coil_temperature_C or ()), bench_C), (*(self.supply_V or ()), bench_V)
            coil = worst(_resistance(_exact(each)) for each in coils) / _resistance(_exact(bench_C))
            return {"coil temperature": coil, "supply": worst(_exact(bench_V) / _exact(each) for each in supplies)}
        if self.drive == "amplifier":
            return {"amplifier": 1 / (1 - way * _exact(self.amplifier_error or 0.0))}
        current = 1 / (1 - way * _exact(self.current_error or 0.0))
        return {"current": current, "bench current": 1 + way * _exact(self.bench_current_error or 0.0)}


def _exact(value: float) -> Fraction:
    """Return the decimal number that stands in the file."""
    return Fraction(repr(value))


def _resistance(temperature_C: Fraction) -> Fraction:
    """Return a copper coil's resistance over that at 20 degC."""
    return 1 + COPPER_PER_K * (temperature_C - REFERENCE_C)


#: Component of the error of each pressure sensor, by the name of its input.
OF_SENSOR: Mapping[str, Component] = {
    "A": "pressure sensor A", "B": "pressure sensor B", "C": "pressure sensor C"
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Allowance:
    """Of one side: what rounding, dither and, where one was declared, the machine take."""

    signals: Signals
    sign: int
    #: Half-widths of the pressure drop, which add up.
    pressures_MPa: Mapping[Component, Fraction]
    #: The threshold on the machine over that on the bench, which multiply.
    factors: Mapping[Component, Fraction]
    #: Shares of full drive that are subtracted.
    shares: Mapping[Component, Fraction]
    #: Whether the rounding of pressures to codes counts, as it always does in a ceiling.
    rounds: bool = True

    @property
    def pair(self) -> PressurePair:
        """The pressure inputs of the side."""
        return self.signals.pair(self.sign)

    @property
    def window(self) -> tuple[int, int]:
        """Differences of codes, from and to, that the pressure drop may be away from the one that is read."""
        half_width_MPa = sum(self.pressures_MPa.values(), start=Fraction(0))
        if self.rounds:
            return self.pair.difference_error(self.signals.code_max, half_width_MPa)
        codes = ceil(half_width_MPa / self.pair.ahead.per_code_MPa)
        return -codes, codes

    @property
    def factor(self) -> Fraction:
        """The least threshold over that on the bench."""
        return prod(self.factors.values(), start=Fraction(1))

    @property
    def kept(self) -> Fraction:
        """Share of full drive that is subtracted."""
        return sum(self.shares.values(), start=Fraction(0))

    def only(self, component: Component) -> "Allowance":
        """Return the allowance of one component alone."""
        return self._with(lambda name: name == component)

    def without(self, component: Component) -> "Allowance":
        """Return the allowance where one component is zero."""
        return self._with(lambda name: name != component)

    def _with(self, counts: Callable[[Component], bool]) -> "Allowance":
        parts = (self.pressures_MPa, self.factors, self.shares)
        pressures, factors, shares = ({name: value for name, value in part.items() if counts(name)} for part in parts)
        return replace(
            self,
            pressures_MPa=pressures,
            factors=factors,
            shares=shares,
            rounds=counts("rounding of pressures"),
        )


def allowance_of(
    signals: Signals, machine: Machine | None = None, *, sign: int = 1, dither_counts: int = 0
) -> Allowance:
    """Return what the offset of a side must leave free; so many counts of the dither are kept."""
    full = signals.compare_max
    # Half a count, because the compare value may be rounded up.
    shares: dict[Component, Fraction] = {"rounding of the drive": Fraction(1, 2 * full)}
    if dither_counts:
        shares["dither"] = Fraction(dither_counts, full)
    if machine is None:
        return Allowance(signals=signals, sign=sign, pressures_MPa={}, factors={}, shares=shares)
    if machine.current_rest_error:
        shares["current's rest"] = Fraction(repr(machine.current_rest_error))
    # An offset of the converter may be of either sign on each channel: they do not cancel.
    pair = signals.pair(sign)
    per_code = pair.ahead.per_code_MPa + pair.behind.per_code_MPa
    pressures: dict[Component, Fraction] = {
        "bench pressure drop": Fraction(repr(machine.bench_pressure_error_MPa)),
        **{OF_SENSOR[name]: Fraction(repr(machine.pressure_error_MPa(name))) for name in sorted(pair.names)},
        "pressure converter offset": machine.pressure_offset_codes * per_code,
        "pressure converter gain": machine.pressure_gain_codes * per_code,
        "pressure converter noise": machine.pressure_noise_codes * per_code,
    }
    return Allowance(signals=signals, sign=sign, pressures_MPa=pressures, factors=machine.least_factors, shares=shares)


def dither_reserve(
    driven: DrivenDither,
    recorded: Dither | None,
    machine: Machine | None = None,
    current_drive: CurrentDrive | None = None,
) -> int:
    """Return by how many counts the offset stays lower for the dither.

    Where the ramps were recorded with it, its peak on a machine that gives more current for a drive is larger than on
    the bench by as much as the threshold is smaller, and by that difference the valve passes flow earlier.

    A controlled current overshoots the set point's wave, or stays short of it: what counts is the current's peak, of
    ramps that were recorded with the wave any other one than theirs.
    """
    reserve = driven.reserve(recorded)
    if current_drive is not None:
        above, below = current_drive.dither_above_counts, current_drive.dither_below_counts
        reserve += above if recorded is None else max(above, below)
    if machine is None or recorded is None:
        return reserve
    return reserve + ceil(driven.counts * (1 - machine.least_factor))


#: Reading of the command that may be a coil's current and no signal of 0..20 mA, A.
LEAST_COIL_A = 0.05
#: Two currents are one to this share: the rounding of units.
SAME_CURRENT = 1e-6


def recorded_full_A(valve: ValveModel) -> float | None:
    """Return the coil's current at full command where the command was recorded as one; else None.

    A command with a live zero, such as 4..20 mA, or of no more than 20 mA is a signal.
    """
    command = valve.recorded_units.command
    if command.at_zero != 0 or not measures(command.unit, "current"):
        return None
    ampere = abs(command.factor) * valve.u_max_V * si_factor(command.unit, "current")
    return ampere if ampere >= LEAST_COIL_A else None


def check_bench_current(valve: ValveModel, rated_A: float, declared_A: float | None) -> None:
    """Refuse a rated current that is not the one of full command on the bench.

    The law's output is a share of the rated current, the recorded thresholds are shares of the bench's full command.
    The budget has that one's error, which is about the rated current: a distance between the two would not be in it.
    """
    recorded_A = recorded_full_A(valve)
    known = {"--bench-current": declared_A, "the recorded command": recorded_A}
    for what, ampere in known.items():
        if ampere is not None and abs(ampere / rated_A - 1) > SAME_CURRENT:
            raise InputError(
                f"--rated-current is {rated_A:g} A, but full command was {ampere:.9g} A on the bench by {what}, so the "
                f"recorded thresholds are not the same shares of it; give --rated-current '{ampere:.9g} A'"
            )


def premise_of_bench_current(valve: ValveModel, rated_A: float, declared_A: float | None) -> str:
    """Return what is taken for granted where nothing tells the bench's current; else nothing."""
    if declared_A is not None or recorded_full_A(valve) is not None:
        return ""
    unit = valve.recorded_units.command.unit
    return (
        f"the command was recorded in {unit}, which does not tell the coil's current: full command is taken as the "
        f"rated current of {rated_A:g} A, as an amplifier that controls the current makes it; of ramps recorded by "
        "duty it is the supply over a resistance that nobody knows while the coil heats up. Declare --bench-current, "
        "or record the current"
    )
