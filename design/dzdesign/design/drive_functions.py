"""What the drive does around the law: zero band, sides, ramps, dither, play, a largest output."""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError
from dzdesign.core.dither import Dither
from dzdesign.core.errors import InputError
from dzdesign.design.signals import Signals

#: Ramps count in codes of command over this, a sample.
RAMP_UNIT = 1 << 16
#: Codes of command from zero that a ramp counts in 32 bits.
RAMPED_CODES = (1 << 31) // RAMP_UNIT - 1
#: Samples that the firmware counts up to.
MOST_FAULT_SAMPLES = 10_000

#: Share of a recorded frequency by which that of the drive may differ: half a wave is a whole number of PWM periods.
SAME_FREQUENCY = Fraction(5, 100)
LARGEST_STEP = 2**30
Step = Annotated[int, Meta(ge=0, le=LARGEST_STEP)]
Counts = Annotated[int, Meta(ge=0, le=65535)]


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenDither:
    """The dither that a drive makes, in the firmware's integers; 0 counts: none."""

    counts: int
    compare_max: int
    frequency_Hz: Fraction

    def check(self, recorded: Dither | None) -> None:
        """Refuse one that is not that of the recordings, where they had one: of any other valve.json knows nothing.

        With a smaller one the hysteresis is wider, so that the valve closes lower, and with a larger one the knee is
        softer.
        """
        if recorded is None:
            return
        asked = f"the ramps were recorded with a dither of {recorded.in_words()}"
        remedy = f'give --dither "{recorded.in_words()}", or record ramps with the one that is wanted'
        if not self.counts:
            raise InputError(f"{asked}, without which the valve closes lower, but --dither is off; {remedy}")
        if abs(self.counts - Fraction(repr(recorded.peak)) * self.compare_max) > Fraction(1, 2):
            raise InputError(f"{asked}, but --dither has a peak of {self.counts / self.compare_max:.4%}; {remedy}")
        if abs(self.frequency_Hz / Fraction(repr(recorded.frequency_Hz)) - 1) > SAME_FREQUENCY:
            made = f"{float(self.frequency_Hz):.6g} Hz"
            raise InputError(
                f"{asked}, but --dither makes {made}, half a wave being whole PWM periods; expected the recorded "
                f"frequency within {float(SAME_FREQUENCY):.0%}; give that to --dither, or record ramps with one that "
                f"the PWM makes, such as {made}"
            )

    def reserve(self, recorded: Dither | None) -> int:
        """Return by how many counts the offset stays lower for the dither.

        By the whole peak where the ramps had none: at the wave's top zero command must be shut. Recorded with it they
        count it already, and what is left is that the drive's wave is not quite theirs. The motion that a dither makes
        falls with the square of its frequency at most (a mass on a spring, above its resonance), and a valve whose
        force and flow only rise with its drive passes no more at a command than with the recorded wave at one higher
        by the difference of the peaks.
        """
        if recorded is None:
            return self.counts
        peak = Fraction(repr(recorded.peak)) * self.compare_max
        moved = self.counts * abs(1 - (Fraction(repr(recorded.frequency_Hz)) / self.frequency_Hz) ** 2)
        return ceil(abs(self.counts - peak) + moved)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveFunctions:
    """Functions of the drive around the law, as the integers of the firmware."""

    leave_zero_codes: Annotated[int, Meta(ge=0, le=32767)] = 0
    """Command codes that the command must exceed to leave zero, if the law has a zero band. It must also pass zero by
    as much before the drive switches to the other solenoid. Until then the last solenoid stays at its offset, so that
    noise around zero does not move the spool. 0: no such threshold."""
    ramp_up: tuple[Step, Step] = (0, 0)
    """Largest change of the command per sample away from zero, for positive and negative commands. In 1/65536 of a
    code; 0 for no limit."""
    ramp_down: tuple[Step, Step] = (0, 0)
    """Largest change of the command per sample towards zero, for positive and negative commands. In 1/65536 of a code;
    0 for no limit."""
    dither_counts: Annotated[int, Meta(ge=0, le=65535)] = 0
    """Amplitude of the square wave on the compare value, which the certificate counts as offset. 0: no dither."""
    dither_ticks: Annotated[int, Meta(ge=1, le=32767)] = 1
    """PWM periods in half a period of the dither."""
    play_counts: tuple[tuple[Counts, ...], tuple[Counts, ...]] = ((), ())
    """Compensation of hysteresis: counts by which the drive is lower at a falling than at a rising command. For
    positive and negative commands, with linear interpolation between nodes at every `play_step_codes` codes of command
    from zero. Empty: no compensation."""
    play_step_codes: Annotated[int, Meta(ge=1, le=4096)] = 256
    """Command codes between two nodes of play_counts, a power of two."""
    play_codes: Annotated[int, Meta(ge=1, le=32)] = 8
    """Command travel over which the drive changes from one branch to the other, in codes. A power of two."""
    play_noise_codes: Annotated[int, Meta(ge=0, le=4095)] = 0
    """Largest fluctuation of the command, in codes, that does not count as a reversal."""
    compare_limit: Annotated[int, Meta(ge=0, le=65535)] = 60000
    """Largest compare value."""
    fault_samples: Annotated[int, Meta(ge=1, le=MOST_FAULT_SAMPLES)] = 1
    """Consecutive valid samples that end a fault. From the first faulty sample until then, an invalid command
    de-energises the valve, and an invalid pressure selects the smallest beta."""
    fault_latch: bool = False
    """Whether a fault is latched until the drive is initialised again. The latch sets after `fault_samples` faulty
    samples, if fewer consecutive valid samples lie between them."""
    interlock_codes: Annotated[int, Meta(ge=0, le=32767)] | None = None
    """Largest command code that counts as zero for the interlock. After a reset or an invalid command the drive must
    see zero for `fault_samples` consecutive samples before it follows. Null: no interlock."""

    def __post_init__(self) -> None:
        for name, value in (("play_codes", self.play_codes), ("play_step_codes", self.play_step_codes)):
            if value & (value - 1):
                raise RuleError(f"{name} is {value}, expected a power of two")

    def dither(self, signals: Signals) -> DrivenDither:
        """Return the dither that the drive makes with a PWM."""
        return DrivenDither(
            counts=self.dither_counts,
            compare_max=signals.compare_max,
            frequency_Hz=Fraction(signals.tick_Hz, 2 * self.dither_ticks),
        )

    @property
    def has_play(self) -> bool:
        """True if a falling command is driven lower than a rising one."""
        return any(self.play_counts)

    @property
    def has_ramp(self) -> bool:
        """True if any of the ramps limits the command."""
        return any(self.ramp_up + self.ramp_down)
