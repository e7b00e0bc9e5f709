"""What a valve amplifier does around the law: side by side, ramps, dither, a largest output. All off by default."""

from dataclasses import dataclass

from dzdesign.core.errors import InputError

#: Ramps count in codes of command over this, a sample.
RAMP_UNIT = 1 << 16
#: Codes of command from zero on that a ramp counts in 32 bits.
RAMPED_CODES = (1 << 31) // RAMP_UNIT - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Amplifier:
    """Options of the amplifier, as the integers that the firmware uses.

    Attributes
    ----------
    window_codes : int
        Of a command of both signs: codes by which it must pass zero before the other solenoid is driven. Until then
        the one that was driven stays at its offset: noise about zero does not throw the spool from side to side.
    ramp_up, ramp_down : tuple of int
        Largest change of the command a sample, away from zero and back to it, in codes over `RAMP_UNIT`: of positive,
        then of negative command. 0: none.
    dither_counts : int
        Half the height of a square wave on the compare value; the certificate counts it as offset. 0: none.
    dither_ticks : int
        PWM periods of half a wave.
    compare_limit : int
        Largest compare value.
    """

    window_codes: int = 0
    ramp_up: tuple[int, int] = (0, 0)
    ramp_down: tuple[int, int] = (0, 0)
    dither_counts: int = 0
    dither_ticks: int = 1
    compare_limit: int = 60000

    def __post_init__(self) -> None:
        for name, value, limit in (
            ("window_codes", self.window_codes, 4095),
            ("dither_counts", self.dither_counts, 65535),
            ("compare_limit", self.compare_limit, 65535),
            *(("ramp_up", value, 2**30) for value in self.ramp_up),
            *(("ramp_down", value, 2**30) for value in self.ramp_down),
        ):
            if not 0 <= value <= limit:
                raise InputError(f"{name} is {value}, expected 0 to {limit}")
        if not 1 <= self.dither_ticks <= 32767:
            raise InputError(
                f"dither_ticks is {self.dither_ticks}, expected 1 to 32767 PWM periods: a wave is twice that"
            )

    @property
    def has_ramp(self) -> bool:
        """True if any of the ramps limits the command."""
        return any(self.ramp_up + self.ramp_down)
