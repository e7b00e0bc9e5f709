"""The signals at the compensator's ends: what one code of command, pressure and compare value stands for."""

from dataclasses import dataclass
from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.derivation.scaling import pressure_drop, pressure_drop_code


@dataclass(frozen=True, slots=True, kw_only=True)
class Signals:
    """Exact scalings of a compensator's inputs and output.

    Attributes
    ----------
    command_code_max : int
        Converter code of full command; code 0 is zero command (Eq. (29) with its 0-3 V taken as the attenuated 0-10 V).
    pressure_code_max : int
        Converter code of a sensor's full span; code 0 is no pressure.
    pressure_span_MPa : Fraction
        Sensor span, the same for both sensors.
    compare_max : int
        PWM compare value of full drive, u_O = u_max.
    """

    command_code_max: int = 4095
    pressure_code_max: int = 4095
    pressure_span_MPa: Fraction = Fraction(20)
    compare_max: int = 60000

    def __post_init__(self) -> None:
        for name in ("command_code_max", "pressure_code_max", "compare_max"):
            if not 1 <= getattr(self, name) <= 65535:
                raise InputError(f"{name} is {getattr(self, name)}, expected 1 to 65535 (16 bits)")
        if self.pressure_span_MPa <= 0:
            raise InputError(f"the sensor's span is {float(self.pressure_span_MPa):g} MPa, expected more than zero")

    def dp_MPa(self, dp_code: int) -> Fraction:
        """Return the pressure drop that a difference of pressure codes stands for, exactly."""
        return pressure_drop(dp_code, span=self.pressure_span_MPa, code_max=self.pressure_code_max)

    def dp_code(self, dp_MPa: Fraction) -> Fraction:
        """Return the difference of pressure codes that a pressure drop makes, exactly (not rounded)."""
        return pressure_drop_code(dp_MPa, span=self.pressure_span_MPa, code_max=self.pressure_code_max)
