"""The zero band: which codes of command count as zero, because a zero command may read so."""

import re
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError
from dzdesign.core.errors import InputError
from dzdesign.core.units import parse_quantity
from dzdesign.design.signals import CommandSignal
from dzdesign.design.target_inputs import Converter

#: Largest error of the command that is believed, codes of any converter.
LARGEST_ERROR = 4095
#: A narrower transition makes volts of a code's noise, codes; and in peaks of the declared noise.
LEAST_TRANSITION, LEAST_TRANSITION_NOISE = 16, 4
EXPECTED = "expected the offset and the noise's peak, such as '15 + 4 codes' or '0.4 % + 0.1 %'"


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


def command_error_of(text: str, converter: Converter, command: CommandSignal) -> CommandError:
    """Read the declared error, or take the converter's where the text is empty.

    Of the gain error what it makes at the code of zero command counts: nothing of a signal that begins at code 0, half
    of it of one that has zero in the middle.
    """
    if not text:
        at_zero = Fraction(command.zero_code, converter.code_max)
        offset, noise = converter.offset_codes + round(converter.gain_codes * at_zero), max(converter.noise_codes, 1)
        return CommandError(offset_codes=offset, noise_codes=noise)
    parts = [part.strip() for part in text.split("+")]
    if len(parts) != 2:
        raise InputError(f"--command-error is '{text}', {EXPECTED}")
    if re.search(r"codes?$", parts[1]) and re.fullmatch(r"\d+(\.\d+)?", parts[0]):
        parts[0] += " codes"
    try:
        offset, noise = (_codes(part, command) for part in parts)
        return CommandError(offset_codes=offset, noise_codes=noise)
    except (ValueError, ZeroDivisionError, RuleError) as error:
        raise InputError(f"--command-error is '{text}', {EXPECTED} ({error})") from error


def _codes(part: str, command: CommandSignal) -> int:
    """Return codes of command, a fraction of one as a whole."""
    if re.search(r"codes?$", part):
        return ceil(Fraction(re.sub(r"\s*codes?$", "", part)))
    return ceil(Fraction(repr(parse_quantity(part, "ratio", "--command-error"))) * command.span(1))
