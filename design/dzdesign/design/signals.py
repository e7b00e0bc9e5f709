"""The signals at the compensator's ends: what one code of command, pressure and compare value stands for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
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
#: Pressure inputs, and a pair of them: the one ahead of a side's metering edge, then the one behind it.
INPUT_NAMES = "ABC"
InputPair = Literal["AB", "BA", "AC", "CA", "BC", "CB"]
POSITIVE_PAIR: InputPair = "AB"
#: A sensor behind of another scaling than the one ahead is brought to that one's counts by an integer weight over this
#: power of two.
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


@dataclass(frozen=True, kw_only=True)
class PressurePair:
    """The two pressure inputs of one side; a difference is counted in codes of the sensor ahead."""

    names: InputPair
    ahead: PressureSignal
    behind: PressureSignal

    @cached_property
    def weight(self) -> int:
        """Weight of a code behind over 2^`WEIGHT_SHIFT`, in codes ahead; exactly one for like sensors."""
        return max(1, round(self.behind.per_code_MPa / self.ahead.per_code_MPa * WEIGHT_UNIT))

    @property
    def like_sensors(self) -> bool:
        """True if both sensors count alike, so that the firmware needs no weight."""
        return self.weight == WEIGHT_UNIT

    def difference(self, ahead_code: int, behind_code: int) -> int:
        """Return the difference of two pressure codes, as the firmware counts it."""
        ahead, behind = ahead_code - self.ahead.zero_code, behind_code - self.behind.zero_code
        return ahead * WEIGHT_UNIT - behind * self.weight >> WEIGHT_SHIFT

    def hidden_failures(self, code_max: int, broken_code: int = 0, *, reads_high: bool) -> tuple[str, ...]:
        """Return the failures of a sensor that make the pressure difference read too high, or too low, by valid codes.

        A broken wire reads up to `broken_code`: what the converter makes of no voltage. Of the sensor ahead that is a
        drop of nothing while the pressure behind is next to none: a valve that is open to tank. A sensor behind that
        reads its converter's top makes a negative difference, which is a failure by itself, unless the one ahead spans
        more.
        """
        sensors = dict(zip(self.names, (self.ahead, self.behind), strict=True))
        ahead, behind = self.names
        broken, above = (behind, ahead) if reads_high else (ahead, behind)
        found = []
        if sensors[broken].valid_codes[0] <= broken_code:
            found.append(f"a broken wire of sensor {broken}")
        positive = reads_high or self.difference(self.ahead.full_code, code_max) > 0
        if positive and sensors[above].valid_codes[1] == code_max:
            found.append(f"a reading of sensor {above} above its span")
        return tuple(found)

    @property
    def largest_difference(self) -> int:
        """The largest difference that sound codes make."""
        return max(self.difference(self.ahead.valid_codes[1], self.behind.valid_codes[0]), 1)

    def difference_error(self, code_max: int, half_width_MPa: Fraction = Fraction(0)) -> tuple[int, int]:
        """Return how many codes a difference may read too high (as a negative number) and too low, rounded outwards.

        That is rounding to codes, and a half-width of the pressure drop beside it: what the sensors and their
        converters, and those of the bench, may be off.
        """
        ahead, behind = self.ahead, self.behind
        low, high = ahead.error_MPa[0] - behind.error_MPa[1], ahead.error_MPa[1] - behind.error_MPa[0]
        # What the weight is off, at the sensor's largest code, and the shift that rounds down.
        unlike = abs(behind.per_code_MPa - ahead.per_code_MPa * self.weight / WEIGHT_UNIT) * code_max
        shift = 0 if self.like_sensors else ahead.per_code_MPa
        unlike += half_width_MPa
        return floor((low - unlike) / ahead.per_code_MPa), ceil((high + unlike + shift) / ahead.per_code_MPa)

    def dp_MPa(self, dp_code: int) -> Fraction:
        """Return the pressure drop that a difference of pressure codes stands for, exactly."""
        dp_MPa: Fraction = pressure_drop(dp_code, span=self.ahead.span_MPa, code_max=self._span_codes)
        return dp_MPa

    def dp_code(self, dp_MPa: Fraction) -> Fraction:
        """Return the difference of pressure codes that a pressure drop makes, exactly (not rounded)."""
        code: Fraction = pressure_drop_code(dp_MPa, span=self.ahead.span_MPa, code_max=self._span_codes)
        return code

    def code_at(self, dp_MPa: float | None) -> int:
        """Return the difference of pressure codes that is nearest to a pressure drop of valve.json."""
        return round(self.dp_code(Fraction(repr(dp_MPa))))

    @property
    def _span_codes(self) -> int:
        return self.ahead.full_code - self.ahead.zero_code


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
    pressure_c: PressureSignal | None = None
    """Scaling of the third sensor, which only negative commands use; null without one."""
    negative_pair: InputPair = "AB"
    """Sensors upstream and downstream of the metering edge, in this order, for negative command."""

    def __post_init__(self) -> None:
        if self.tick_Hz % self.sample_Hz:
            raise RuleError(
                f"tick_Hz is {self.tick_Hz} and sample_Hz {self.sample_Hz}, "
                "expected a whole number of PWM periods a sample"
            )
        if (self.pressure_c is not None) != ("C" in self.negative_pair) or (self.pressure_c and len(self.signs) == 1):
            raise RuleError(
                f"the pressure drop at negative commands is that of {' and '.join(self.negative_pair)}, expected a "
                "pressure_c where C is one of them in a command of both signs, and nowhere else"
            )
        valid = {"command": self.command.valid_codes}
        valid |= {f"pressure_{name.lower()}": sensor.valid_codes for name, sensor in self.pressures.items()}
        for name, (low, high) in valid.items():
            if not 0 <= low < high <= self.code_max:
                raise RuleError(f"{name}: valid codes {low} to {high} are outside the converter's 0 to {self.code_max}")
        for sign in self.signs:
            self._check_spans(self.pair(sign))

    def _check_spans(self, pair: PressurePair) -> None:
        """Refuse a pair whose differences leave 16 bits; either way round: a failed sensor makes any of sound codes."""
        ahead, behind = pair.ahead.valid_codes, pair.behind.valid_codes
        if max(pair.difference(ahead[1], behind[0]), -pair.difference(ahead[0], behind[1])) > LARGEST_DIFFERENCE:
            raise RuleError(
                f"the sensors' spans of {float(pair.ahead.span_MPa):g} and {float(pair.behind.span_MPa):g} "
                "MPa are too unlike; choose sensors within a factor of seven"
            )

    @property
    def signs(self) -> tuple[int, ...]:
        """1 for positive command and, where the signal has both, -1."""
        return (1,) if self.command.negative_full_code is None else (1, -1)

    @property
    def pressures(self) -> Mapping[str, PressureSignal]:
        """The sensors that are there, by the names of their inputs, in the order of these."""
        third = {} if self.pressure_c is None else {"C": self.pressure_c}
        return {"A": self.pressure_a, "B": self.pressure_b, **third}

    def pair(self, sign: int) -> PressurePair:
        """Return the pressure inputs of one sign of command."""
        names = POSITIVE_PAIR if sign > 0 else self.negative_pair
        ahead, behind = (self.pressures[name] for name in names)
        return PressurePair(names=names, ahead=ahead, behind=behind)
