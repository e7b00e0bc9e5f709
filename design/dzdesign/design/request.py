"""What `design` was asked for, in the engineer's words: kept in compensator.json, so that it can be designed again.

Light on imports: the command line reads the names and defaults of the options here.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dzdesign.design.signal_text import Converter

#: What stands where an option is not given. They have no argparse default, so that `codegen` can tell.
DEFAULTS = {
    "law": "paper",
    "pressure_span": "20 MPa",
    "guard": "closing",
    "below_dp0": "hold",
    "command_signal": "",  # 0..10 V and 0 to full pressure over the target's whole converter
    "pressure_a": "",
    "pressure_b": "",
    "negative_dp": "same",
    "polarity": "normal",
    "edge": "0 %",
    "zero_window": "1 %",
    "ramp_up": "0 s",
    "ramp_down": "0 s",
    "dither": "off",
    "output_max": "100 %",
    "accept": "",
}
CHOICES = {"negative_dp": ("same", "swapped"), "polarity": ("normal", "inverted")}


def option_name(name: str) -> str:
    """Return an option as it is written on the command line.

    Examples
    --------
    >>> option_name("below_dp0")
    '--below-dp0'
    """
    return f"--{name.replace('_', '-')}"


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetInputs:
    """What `design` needs to know of a target: its converter, its timer's counts, samples and PWM periods a second."""

    name: str
    converter: "Converter"
    compare_max: int
    sample_Hz: int
    tick_Hz: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignRequest:
    """The target that was designed for, and name and text of every option, a default where none was given."""

    target: TargetInputs
    options: tuple[tuple[str, str], ...]
