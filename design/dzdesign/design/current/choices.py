"""What `design` is told of current control, in the engineer's words. Light on imports: the command line reads it."""

from dataclasses import dataclass
from typing import Annotated

from dzdesign.core.options import DRIVE, Option, Text

DRIVES = ("duty", "current")


@dataclass(frozen=True, kw_only=True)
class CurrentChoices:
    """Options of `design` on how the solenoid is driven."""

    drive: Annotated[Text, Option("D", DRIVE, "duty", choices=DRIVES)] = None
    """Output of the law. duty: the PWM's share of the supply voltage. current: the set point of a current loop in the
    firmware, for one solenoid, with the rated current as full drive."""
    coil: Annotated[Text, Option("C", DRIVE, example="3.5 ohm 40 mH")] = None
    """Coil for --drive current, such as "3.5 ohm 40 mH". The form "3.5 + 0.5 ohm x 0.75..1.35, 40 mH x 0.5..1.5" adds
    the resistance of switch and shunt and the ranges, here with their defaults."""
    rated_current: Annotated[Text, Option("I", DRIVE, example="1 A")] = None
    """Current at full drive, for --drive current."""
    current_signal: Annotated[Text, Option("S", DRIVE, example="0..1.2 A on 2 ohm + 0.15 V")] = None
    """Signal of the current sensor at the converter, for --drive current, such as "0..1.2 A on 2 ohm + 0.15 V". The
    resistance is that of the shunt times its amplifier's gain, and the voltage is the one without current."""
    supply_signal: Annotated[Text, Option("S", DRIVE, example="0..36 V x 0.075")] = None
    """Signal of the supply voltage at the converter, for --drive current, such as "0..36 V x 0.075" (default: not
    measured). Measuring it makes the current loop faster."""


#: Options that only current control has a use for, and those that it needs.
OF_CURRENT = ("coil", "rated_current", "current_signal", "supply_signal")
NEEDED = ("coil", "rated_current", "supply", "current_signal")
