"""A dither: the square wave about the drive, declared of recordings (`identify --dithered`) and of a design."""

import re
from dataclasses import dataclass
from typing import Annotated

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.units import measures, parse_quantity, si_factor

#: Frequencies that a proportional valve's dither has, Hz; and its largest peak, over full drive.
LOWEST_HZ, HIGHEST_HZ = 100.0, 300.0
LARGEST_PEAK = 0.1
EXAMPLE = "150 Hz 1 %"


@dataclass(frozen=True, slots=True, kw_only=True)
class Dither:
    """A square wave around the drive."""

    frequency_Hz: Annotated[float, quantity("Hz", ge=LOWEST_HZ, le=HIGHEST_HZ)]
    """Frequency of the square wave."""
    peak: Annotated[float, quantity("1", gt=0, le=LARGEST_PEAK)]
    """Amplitude: half the peak-to-peak height, as a share of full command."""

    def __post_init__(self) -> None:
        if not LOWEST_HZ <= self.frequency_Hz <= HIGHEST_HZ:
            raise RuleError(
                f"the dither's frequency is {self.frequency_Hz:g} Hz, expected {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz"
            )
        if not 0 < self.peak <= LARGEST_PEAK:
            raise RuleError(
                f"the dither is {self.peak:.3%}, expected more than 0 to {LARGEST_PEAK:.0%} of full command, which is "
                "half the wave's height"
            )

    def in_words(self) -> str:
        """Return it as an option takes it.

        Examples
        --------
        >>> Dither(frequency_Hz=150.0, peak=0.01).in_words()
        '150 Hz 1 %'
        """
        return f"{self.frequency_Hz:.6g} Hz {100 * self.peak:.6g} %"


def parted(text: str, option: str, expected: str = "") -> tuple[float, str]:
    """Return frequency, Hz, and the text of the peak; `expected` is what may stand there besides."""
    parts = re.fullmatch(r"(.{1,30}?hz)\b(.{1,60})", text.strip(), re.IGNORECASE) if isinstance(text, str) else None
    if parts is None:
        raise InputError(
            f"{option} is {quoted(text)}, expected {expected}a frequency in Hz and the wave's peak over full drive, "
            f"such as '{EXAMPLE}'"
        )
    return parse_quantity(parts[1], "frequency", option), parts[2].strip()


@dataclass(frozen=True, slots=True, kw_only=True)
class DeclaredDither:
    """A dither as it was declared of recordings, whose unit of the command is not known before they are read."""

    frequency_Hz: float
    #: Half the wave's height, in the unit; 1: a share of full command.
    peak: float
    unit: str

    def of(self, units: RecordedUnits, u_max_V: float) -> Dither:
        """Return the dither, its peak over full command.

        Examples
        --------
        >>> read_dithered("150 Hz 100 mV", "--dithered").of(RecordedUnits(), 10.0).in_words()
        '150 Hz 1 %'
        """
        if self.unit == "1":
            peak = self.peak
        elif measures(self.unit, "voltage"):
            peak = self.peak * si_factor(self.unit, "voltage") / u_max_V
        elif self.unit == units.command.unit:
            peak = self.peak / abs(units.command.factor) / u_max_V
        else:
            raise InputError(
                f"--dithered gives the peak in {self.unit}, but the command was recorded in {units.command.unit}; "
                f"give it in that, or in percent of full command, such as '{EXAMPLE}'"
            )
        return Dither(frequency_Hz=self.frequency_Hz, peak=peak)


def read_dithered(text: str, option: str) -> DeclaredDither:
    """Read a frequency and a peak, in percent of full command, or a number with a unit of the command."""
    frequency, peak = parted(text, option)
    found = re.fullmatch(r"(\d{1,9}(?:\.\d{0,15})?)\s?([^\d\s.,][^\d.,]{0,39})", peak)
    if found is None:
        raise InputError(
            f"{option} is {quoted(text)}: its peak {quoted(peak)} is not a number with a unit, expected one such as in "
            f"'{EXAMPLE}'"
        )
    number, unit = float(found[1]), found[2].strip()
    percent = unit == "%"
    declared = DeclaredDither(
        frequency_Hz=frequency, peak=number / 100 if percent else number, unit="1" if percent else unit
    )
    if percent:
        declared.of(RecordedUnits(), 1.0)  # refused before the recordings are read
    return declared
