"""What `design` needs to know of a target: its analogue-digital converter, its timer, how often it samples.

And the error that a converter makes of a command: its code at zero says which codes count as zero.
"""

from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, floor, sqrt
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.design.current.circuit import CurrentSampling

Count = Annotated[int, Meta(ge=1, le=65535)]
Error = Annotated[int, Meta(ge=0, le=4095)]
#: Peak of a noise, in standard deviations.
PEAK = 6


def peak_noise_codes(snr_dB: float, levels: int) -> int:
    """Return the peak of a converter's noise, codes, from the signal-to-noise ratio of a sine over its whole range.

    Examples
    --------
    >>> peak_noise_codes(68.0, 4096)
    4
    """
    return ceil(PEAK * levels / (2 * sqrt(2)) / 10 ** (snr_dB / 20))


#: Errors of the F28335's converter, codes of 12 bits: data sheet SPRS439Q, "ADC Electrical Characteristics": largest
#: offset error; largest overall gain error, of internal and external reference alike; SNR 68 dB.
F28335_OFFSET, F28335_GAIN, F28335_NOISE = 15, 30, peak_noise_codes(68.0, 4096)


@dataclass(frozen=True, slots=True, kw_only=True)
class Converter:
    """An analogue-digital converter: code = floor(levels V / full_V), limited to levels - 1."""

    full_V: Annotated[Fraction, quantity("V")] = field(default_factory=lambda: Fraction(3))
    """Voltage at the pin that corresponds to the code `levels`."""
    levels: Annotated[int, Meta(ge=2, le=65536)] = 4096
    """Number of codes."""
    offset_codes: Error = F28335_OFFSET
    """Largest offset error, in codes."""
    gain_codes: Error = F28335_GAIN
    """Largest gain error at the top of the range, in codes."""
    noise_codes: Error = F28335_NOISE
    """Peak noise of a reading, in codes."""

    def __post_init__(self) -> None:
        if self.full_V <= 0:
            raise RuleError(f"the converter's full_V is {float(self.full_V):g} V, expected more than zero")

    @property
    def code_max(self) -> int:
        """Largest code."""
        return self.levels - 1

    def code(self, volts: Fraction) -> int:
        """Return the code of a voltage at the pin."""
        return min(max(floor(self.levels * volts / self.full_V), 0), self.code_max)

    def ends(self, code: int) -> tuple[Fraction, Fraction]:
        """Return the least voltage of a code, and the one that it stays below."""
        step = self.full_V / self.levels
        return code * step, (code + 1) * step


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetInputs:
    """The target's converter and timer, which the law's integers are for."""

    name: Annotated[str, Meta(pattern="^[a-z][a-z0-9]*(-[a-z0-9]+)*$", max_length=60)]
    """Microcontroller, as listed by `codegen --list-targets`."""
    converter: Converter
    """Analogue-to-digital converter of the target."""
    compare_max: Count
    """Compare value at full drive, in counts."""
    sample_Hz: Annotated[Count, quantity("Hz")]
    """Sampling rate."""
    tick_Hz: Annotated[Count, quantity("Hz")]
    """PWM frequency."""
    current_sampling: CurrentSampling | None = None
    """Sampling times of the solenoid's current; null if it is not sampled."""
    crystal_Hz: Annotated[int, quantity("Hz", ge=1, le=10**9)] | None = None
    """Declared frequency of the board's crystal or oscillator; null if none is declared."""
    channels: tuple[str, ...] = ()
    """Declared channels of the converter, such as A0, for command, pressures, current and supply, as far as each is
    there; empty if none are declared."""

    def __post_init__(self) -> None:
        if self.current_sampling and self.current_sampling.tick_Hz != self.tick_Hz:
            raise RuleError(
                f"the current is sampled in {self.current_sampling.tick_Hz} PWM periods a second, expected "
                f"{self.tick_Hz}"
            )


#: Largest error of the command that is believed, codes of any converter.
LARGEST_ERROR = 4095
#: A narrower transition makes volts of a code's noise, codes; and in peaks of the declared noise.
LEAST_TRANSITION, LEAST_TRANSITION_NOISE = 16, 4


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandError:
    """Error of the command's code at zero: a lasting one, and one that changes from sample to sample."""

    offset_codes: Annotated[int, Meta(ge=0, le=LARGEST_ERROR)]
    """Largest static error at zero command."""
    noise_codes: Annotated[int, Meta(ge=1, le=LARGEST_ERROR)]
    """Peak noise on top of the static error."""

    def __post_init__(self) -> None:
        if not 0 <= self.offset_codes <= LARGEST_ERROR or not 1 <= self.noise_codes <= LARGEST_ERROR:
            raise RuleError(
                f"the command's error is {self.offset_codes} + {self.noise_codes} codes, expected an offset of 0 to "
                f"{LARGEST_ERROR} and a noise of 1 to {LARGEST_ERROR}: no converter is without noise"
            )

    @property
    def zero_band_codes(self) -> int:
        """Codes that a zero command may read: within them the drive goes back to rest."""
        return self.offset_codes + self.noise_codes

    @property
    def leave_zero_codes(self) -> int:
        """Codes that a command must exceed for the drive to leave its rest: a spike of twice the noise does not."""
        return self.zero_band_codes + self.noise_codes + 1

    @property
    def least_transition(self) -> int:
        """Fewest codes of a transition."""
        return max(LEAST_TRANSITION, LEAST_TRANSITION_NOISE * self.noise_codes)
