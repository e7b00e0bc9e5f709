"""What `design` was asked for, in the engineer's words: kept in compensator.json, so that it can be designed again.

Light on imports: the command line reads the options here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from dzdesign.core.options import CONNECTIONS, DRIVE, LAW, Option, Text, arguments_of
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.design.current.choices import CurrentChoices
from dzdesign.design.machine.choices import MachineChoices

if TYPE_CHECKING:
    from dzdesign.design.target_inputs import TargetInputs

#: What to do below the reference pressure drop: beta = 1 as in Eq. (7), or what the tests there say.
BelowDp0 = Literal["hold", "extend"]
BELOW_DP0: tuple[BelowDp0, ...] = get_args(BelowDp0)
#: What to do above the last tested pressure drop: hold its offset, lower it with the continued bound, or let it go.
Above = Literal["hold", "lower", "release"]
ABOVE: tuple[Above, ...] = get_args(Above)
POLARITIES, NEGATIVE_DP = ("normal", "inverted"), ("same", "swapped")
HYSTERESIS = ("keep", "play")
ON_OFF = ("on", "off")


@dataclass(frozen=True, kw_only=True)
class DesignChoices(MachineChoices, CurrentChoices):
    """Options of `design`, as written; None takes the default, so that `codegen` can tell what was given."""

    law: Annotated[Text, Option("LAW", LAW, "paper", choices=LAW_NAMES)] = None
    """Law; `dzdesign derive` states what each one does."""
    guard: Annotated[Text, Option("G", LAW, "closing", choices="dzdesign.design.options:GUARDS")] = None
    """Threshold to protect: closing, mean or opening."""
    transition: Annotated[Text, Option("C", LAW, "auto", example="1 %")] = None
    """Share of the command behind the zero band over which the drive runs from the closing threshold to the opening
    one; auto: 1 %, or 16 codes where those are more; off: the closing threshold's offset alone, and no zero band."""
    command_error: Annotated[Text, Option("E", CONNECTIONS, example="15 + 4 codes")] = None
    """Error of the code at zero command: offset and peak noise, such as "15 + 4 codes" or "0.4 % + 0.1 %". So many
    codes count as zero, the zero band (default: the target's converter)."""
    below_dp0: Annotated[Text, Option("B", LAW, "hold", choices=BELOW_DP0)] = None
    """Below dP0: hold beta = 1 as the paper does, or extend it to the tests there."""
    above: Annotated[Text, Option("A", LAW, "lower", choices=ABOVE)] = None
    """Above the highest tested pressure drop: hold the offset (not certified there), lower it with the bound that the
    curve's premise continues, or release it: the dead zone comes back."""
    reading_flow: Annotated[Text, Option("Q", LAW, example="0.6 L/min")] = None
    """Flow at which dead zones are read beside the onset (default: the meter's floor, or the noise level of a meter
    without one)."""
    output_max: Annotated[Text, Option("C", LAW, "100 %", example="95 %")] = None
    """Largest drive, in percent of full drive."""
    accept: Annotated[Text, Option("CODE", LAW, choices="dzdesign.design.options:ACCEPTABLE")] = None
    """Design in spite of this: branch-order, a valve that seems to close above where it opens; or broken-sensor,
    pressure signals whose failure raises the offset unseen; or both with a comma (default: refuse)."""
    command_signal: Annotated[Text, Option("S", CONNECTIONS, example="0..10 V x 0.3")] = None
    """Command at the converter: range, shunt, attenuator, offset and what it stands for, such as "-10..10 V x 0.15 +
    1.5 V" or "4..20 mA on 150 ohm = -10..10 V", which have both signs (default: 0 to 10 V over the converter's whole
    range)."""
    polarity: Annotated[Text, Option("P", CONNECTIONS, "normal", choices=POLARITIES)] = None
    """Polarity of the command: normal, or inverted, which counts the other way."""
    pressure_span: Annotated[Text, Option("P", CONNECTIONS, "20 MPa", example="20 MPa")] = None
    """Span of both pressure sensors."""
    pressure_a: Annotated[Text, Option("S", CONNECTIONS, example="4..20 mA on 140 ohm")] = None
    """Sensor ahead of the metering edge, such as "4..20 mA on 140 ohm = 25 MPa" (default: 4..20 mA on a
    shunt with which 21 mA still stand within the converter's range, 140 ohm for 3 V)."""
    pressure_b: Annotated[Text, Option("S", CONNECTIONS, example="4..20 mA on 140 ohm")] = None
    """Sensor behind the metering edge (default: as ahead of it)."""
    negative_dp: Annotated[Text, Option("D", CONNECTIONS, "same", choices=NEGATIVE_DP)] = None
    """Pressure drop of negative commands: same, or swapped, which is B less A."""
    ramp_up: Annotated[Text, Option("T", DRIVE, "0 s", example="0.5 s")] = None
    """Time from zero to full command, such as "0.5 s", or "0.5 s / 0.8 s" for positive and negative commands."""
    ramp_down: Annotated[Text, Option("T", DRIVE, "0 s", example="0.5 s")] = None
    """Time from full command to zero."""
    hysteresis: Annotated[Text, Option("H", DRIVE, "keep", choices=HYSTERESIS)] = None
    """What to do about the valve's hysteresis: keep it, or play, which drives a falling command lower by its width."""
    dither: Annotated[Text, Option("D", DRIVE, "off", example="150 Hz 1 %")] = None
    """Square wave on the output, such as "150 Hz 1 %", plus and minus 1 % of full drive."""
    fault_debounce: Annotated[Text, Option("N", DRIVE, "5 samples", example="5 samples")] = None
    """Valid samples in a row after which a fault is over, such as "5 samples" or "4 ms". It acts at once: an invalid
    command lets the valve go, a failed pressure gives the smallest beta."""
    fault_latch: Annotated[Text, Option("L", DRIVE, "off", choices=ON_OFF)] = None
    """Latch faults: on keeps one that has lasted for the debounce until a reset; off."""
    interlock: Annotated[Text, Option("I", DRIVE, "on", choices=ON_OFF)] = None
    """Interlock: on lets the drive follow, after a reset or an invalid command, only once zero command has been seen
    for the debounce; off."""


#: Text of each option where it is not given. Of signals none: they span the target's whole converter.
DEFAULTS = {argument.name: argument.option.default for argument in arguments_of(DesignChoices)}


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignRequest:
    """The target that was designed for, and name and text of every option, a default where none was given."""

    target: "TargetInputs"
    options: Mapping[str, str]
