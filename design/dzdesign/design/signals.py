"""The signals at the compensator's ends: what one code of command, pressure and compare value stands for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, floor
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.errors import InputError
from dzdesign.derivation.scaling import pressure_drop, pressure_drop_code
from dzdesign.design.target_inputs import Count

#: Side of the valve that each sign of command drives.
SIDE_NAMES: Mapping[int, Literal["positive", "negative"]] = {1: "positive", -1: "negative"}
CODE_LIMIT = 65535
#: Sensors of unlike scaling are brought to sensor A's counts by an integer weight over this power of two.
WEIGHT_SHIFT = 12
WEIGHT_UNIT = 1 << WEIGHT_SHIFT
#: Differences of pressure codes fit 16 bits of the firmware, sign apart.
LARGEST_DIFFERENCE = 32767
#: A pressure sensor where nothing is said: 4 to 20 mA on 140 ohm at the F28335's 3 V, no wiring fault of which reads as
#: a pressure: codes of its ends, of a sound signal, and the error of a code of one that spans 20 MPa.
LIVE_ZERO_CODES, LIVE_ZERO_VALID = (764, 3822), (688, 4014)
LIVE_ZERO_ERROR_MPA = (Fraction(-25, 4096), Fraction(155, 57344))

Code = Annotated[int, Meta(ge=0, le=CODE_LIMIT)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandSignal:
    """Converter codes of the command (Eq. (29) with its 0-3 V taken as the attenuated 0-10 V)."""

    zero_code: Code = 0
    """Code at zero command."""
    full_code: Code = 4095
    """Code at full positive command; below zero_code if the signal is reversed."""
    negative_full_code: Code | None = None
    """Code at full negative command, on the other side of zero_code; null for a command of one sign."""
    valid_codes: tuple[Code, Code] = (0, 4095)
    """First and last code of a valid signal. A code outside de-energises the valve."""

    def __post_init__(self) -> None:
        if self.full_code == self.zero_code:
            raise RuleError(f"zero and full command have the same code, {self.zero_code}")
        low, high = self.valid_codes
        for name in ("zero_code", "full_code", "negative_full_code"):
            code = getattr(self, name)
            if code is not None and not low <= code <= high:
                raise RuleError(f"the command's {name} is {code}, outside the valid codes {low} to {high}")
        if self.negative_full_code is not None and self.direction(-1) != -self.direction(1):
            raise RuleError(
                f"full negative command has code {self.negative_full_code}, expected the other side of zero "
                f"({self.zero_code}) than full positive command ({self.full_code})"
            )

    def direction(self, sign: int) -> int:
        """Return 1 if codes rise from zero to full command of that sign, -1 if they fall."""
        return 1 if self._full(sign) > self.zero_code else -1

    def span(self, sign: int) -> int:
        """Return the codes between zero and full command of that sign."""
        return abs(self._full(sign) - self.zero_code)

    def from_zero(self, code: int, sign: int) -> int:
        """Return how many codes of command a code is, counted towards that sign and limited to zero and full."""
        return min(max(self.direction(sign) * (code - self.zero_code), 0), self.span(sign))

    def _full(self, sign: int) -> int:
        if sign > 0:
            return self.full_code
        if self.negative_full_code is None:
            raise InputError("the command has one sign only; give a signal of both, such as -10..10 V")
        return self.negative_full_code


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureSignal:
    """Converter codes of one pressure sensor."""

    span_MPa: Annotated[Fraction, quantity("MPa")] = field(default_factory=lambda: Fraction(20))
    """Pressure at full_code; zero_code stands for zero pressure."""
    zero_code: Code = LIVE_ZERO_CODES[0]
    """Code at zero pressure."""
    full_code: Code = LIVE_ZERO_CODES[1]
    """Code at full pressure."""
    valid_codes: tuple[Code, Code] = LIVE_ZERO_VALID
    """First and last code of a valid signal. A code outside selects the smallest beta."""
    error_MPa: Annotated[tuple[Fraction, Fraction], quantity("MPa")] = field(
        default_factory=lambda: LIVE_ZERO_ERROR_MPA
    )
    """Least and largest difference between the pressure that a code stands for and the actual pressure."""

    def __post_init__(self) -> None:
        if self.span_MPa <= 0:
            raise RuleError(f"the sensor's span is {float(self.span_MPa):g} MPa, expected more than zero")
        low, high = self.valid_codes
        if not low <= self.zero_code < self.full_code <= high:
            raise RuleError(
                f"a pressure sensor has codes {self.zero_code} to {self.full_code}, expected them to rise inside the "
                f"valid codes {low} to {high}"
            )
        if not self.error_MPa[0] <= 0 <= self.error_MPa[1]:
            raise RuleError("the error of a pressure's code must span zero")

    @property
    def per_code_MPa(self) -> Fraction:
        """Pressure that one code stands for."""
        return self.span_MPa / (self.full_code - self.zero_code)


@dataclass(frozen=True, slots=True, kw_only=True)
class Signals:
    """Exact scalings of a compensator's inputs and output."""

    code_max: Count = 4095
    """Largest code of the converter."""
    compare_max: Count = 60000
    """PWM compare value at full drive, u_O = u_max."""
    sample_Hz: Annotated[Count, quantity("Hz")] = 1250
    """Sampling rate."""
    tick_Hz: Annotated[Count, quantity("Hz")] = 2500
    """PWM frequency."""
    command: CommandSignal = field(default_factory=CommandSignal)
    """Scaling of the command."""
    pressure_a: PressureSignal = field(default_factory=PressureSignal)
    """Scaling of the sensor upstream of the metering edge, for positive command."""
    pressure_b: PressureSignal = field(default_factory=PressureSignal)
    """Scaling of the sensor downstream of the metering edge, for positive command."""
    swapped: bool = False
    """Whether the pressure drop at negative commands is B minus A."""

    def __post_init__(self) -> None:
        if self.tick_Hz % self.sample_Hz:
            raise RuleError(
                f"tick_Hz is {self.tick_Hz} and sample_Hz {self.sample_Hz}, "
                "expected a whole number of PWM periods a sample"
            )
        for name in ("command", "pressure_a", "pressure_b"):
            low, high = getattr(self, name).valid_codes
            if not 0 <= low < high <= self.code_max:
                raise RuleError(f"{name}: valid codes {low} to {high} are outside the converter's 0 to {self.code_max}")
        # Either way round: a failed sensor makes any difference of sound codes.
        a, b = self.pressure_a.valid_codes, self.pressure_b.valid_codes
        if max(self.difference(a[1], b[0]), -self.difference(a[0], b[1])) > LARGEST_DIFFERENCE:
            raise RuleError(
                f"the sensors' spans of {float(self.pressure_a.span_MPa):g} and {float(self.pressure_b.span_MPa):g} "
                "MPa are too unlike; choose sensors within a factor of seven"
            )

    @property
    def signs(self) -> tuple[int, ...]:
        """1 for positive command and, where the signal has both, -1."""
        return (1,) if self.command.negative_full_code is None else (1, -1)

    @property
    def weight_b(self) -> int:
        """Weight of sensor B's codes over 2^`WEIGHT_SHIFT`, in codes of sensor A; exactly one for like sensors."""
        return max(1, round(self.pressure_b.per_code_MPa / self.pressure_a.per_code_MPa * WEIGHT_UNIT))

    @property
    def like_sensors(self) -> bool:
        """True if both sensors count alike, so that the firmware needs no weight."""
        return self.weight_b == WEIGHT_UNIT

    def difference(self, p_a_code: int, p_b_code: int, sign: int = 1) -> int:
        """Return the difference of two pressure codes, in codes of sensor A, as the firmware counts it."""
        a, b = p_a_code - self.pressure_a.zero_code, p_b_code - self.pressure_b.zero_code
        turn = -1 if sign < 0 and self.swapped else 1
        return turn * (a * WEIGHT_UNIT - b * self.weight_b) >> WEIGHT_SHIFT

    def hidden_failures(self, sign: int, broken_code: int = 0, *, reads_high: bool) -> tuple[str, ...]:
        """Return the failures of a sensor that make the pressure difference read too high, or too low, by valid codes.

        A broken wire reads up to `broken_code`: what the converter makes of no voltage. Of the sensor ahead that is a
        drop of nothing while the pressure behind is next to none: a valve that is open to tank. A sensor behind that
        reads its converter's top makes a negative difference, which is a failure by itself, unless the one ahead spans
        more.
        """
        sensors = {"A": self.pressure_a, "B": self.pressure_b}
        ahead, behind = ("B", "A") if sign < 0 and self.swapped else ("A", "B")
        broken, above = (behind, ahead) if reads_high else (ahead, behind)
        full = {ahead: sensors[ahead].full_code, behind: self.code_max}
        found = []
        if sensors[broken].valid_codes[0] <= broken_code:
            found.append(f"a broken wire of sensor {broken}")
        positive = reads_high or self.difference(full["A"], full["B"], sign) > 0
        if positive and sensors[above].valid_codes[1] == self.code_max:
            found.append(f"a reading of sensor {above} above its span")
        return tuple(found)

    def largest_difference(self, sign: int) -> int:
        """Return the largest difference that sound codes make."""
        a, b = self.pressure_a.valid_codes, self.pressure_b.valid_codes
        reversed_ = sign < 0 and self.swapped
        return max(self.difference(a[0], b[1], sign) if reversed_ else self.difference(a[1], b[0], sign), 1)

    def difference_error(self, sign: int, half_width_MPa: Fraction = Fraction(0)) -> tuple[int, int]:
        """Return how many codes a difference may read too high (as a negative number) and too low, rounded outwards.

        That is rounding to codes, and a half-width of the pressure drop beside it: what the sensors and their
        converters, and those of the bench, may be off.
        """
        a, b = self.pressure_a, self.pressure_b
        low, high = a.error_MPa[0] - b.error_MPa[1], a.error_MPa[1] - b.error_MPa[0]
        # What the weight is off, at the sensor's largest code, and the shift that rounds down.
        unlike = abs(b.per_code_MPa - a.per_code_MPa * self.weight_b / WEIGHT_UNIT) * self.code_max
        if sign < 0 and self.swapped:
            low, high = -high, -low
        shift = 0 if self.like_sensors else a.per_code_MPa
        unlike += half_width_MPa
        return floor((low - unlike) / a.per_code_MPa), ceil((high + unlike + shift) / a.per_code_MPa)

    def dp_MPa(self, dp_code: int) -> Fraction:
        """Return the pressure drop that a difference of pressure codes stands for, exactly."""
        dp_MPa: Fraction = pressure_drop(dp_code, span=self.pressure_a.span_MPa, code_max=self._span_codes)
        return dp_MPa

    def dp_code(self, dp_MPa: Fraction) -> Fraction:
        """Return the difference of pressure codes that a pressure drop makes, exactly (not rounded)."""
        code: Fraction = pressure_drop_code(dp_MPa, span=self.pressure_a.span_MPa, code_max=self._span_codes)
        return code

    def code_at(self, dp_MPa: float | None) -> int:
        """Return the difference of pressure codes that is nearest to a pressure drop of valve.json."""
        return round(self.dp_code(Fraction(repr(dp_MPa))))

    @property
    def _span_codes(self) -> int:
        return self.pressure_a.full_code - self.pressure_a.zero_code
