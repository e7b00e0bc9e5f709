"""What `design` was asked for, in the engineer's words: kept in compensator.json, so that it can be designed again.

Light on imports: the command line reads the options here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.options import CONNECTIONS, DRIVE, LAW, Option, Text, arguments_of
from dzdesign.derivation.laws import LAW_NAMES

if TYPE_CHECKING:
    from dzdesign.design.target_inputs import TargetInputs

POLARITIES, NEGATIVE_DP = ("normal", "inverted"), ("same", "swapped")


@dataclass(frozen=True, kw_only=True)
class DesignChoices:
    """Options of `design`, as written; None takes the default, so that `codegen` can tell what was given."""

    # fmt: off
    law: Annotated[Text, Option(
        f"Law: {' or '.join(LAW_NAMES)}; `dzdesign derive` states what each one does.",
        "LAW", LAW, "paper", choices=LAW_NAMES)] = None
    guard: Annotated[Text, Option(
        "Threshold to protect: closing, mean or opening.",
        "G", LAW, "closing", choices="dzdesign.design.options:GUARDS")] = None
    transition: Annotated[Text, Option(
        "First share of the command, over which the drive runs from the closing threshold to the opening one.",
        "C", LAW, "0 %", "1 %")] = None
    below_dp0: Annotated[Text, Option(
        "Below dP0: hold beta = 1 as the paper does, or extend it to the tests there.",
        "B", LAW, "hold", choices="dzdesign.design.compensator:BELOW_DP0")] = None
    output_max: Annotated[Text, Option("Largest drive, in percent of full drive.", "C", LAW, "100 %", "95 %")] = None
    accept: Annotated[Text, Option(
        "Design in spite of this warning: branch-order (default: refuse).",
        "CODE", LAW, choices="dzdesign.design.options:ACCEPTABLE")] = None
    command_signal: Annotated[Text, Option(
        'Command at the converter: range, attenuator, offset, such as "-10..10 V x 0.15 + 1.5 V", which has both signs '
        "(default: 0 to 10 V over the converter's whole range).",
        "S", CONNECTIONS, example="0..10 V x 0.3")] = None
    polarity: Annotated[Text, Option(
        "Polarity of the command: normal, or inverted, which counts the other way.",
        "P", CONNECTIONS, "normal", choices=POLARITIES)] = None
    pressure_span: Annotated[Text, Option(
        "Span of both pressure sensors.", "P", CONNECTIONS, "20 MPa", "20 MPa")] = None
    pressure_a: Annotated[Text, Option(
        'Sensor ahead of the metering edge, such as "4..20 mA on 150 ohm = 25 MPa" (default: the whole range of the '
        "converter).",
        "S", CONNECTIONS, example="4..20 mA on 150 ohm")] = None
    pressure_b: Annotated[Text, Option(
        "Sensor behind the metering edge (default: the whole range of the converter).",
        "S", CONNECTIONS, example="4..20 mA on 150 ohm")] = None
    negative_dp: Annotated[Text, Option(
        "Pressure drop of negative commands: same, or swapped, which is B less A.",
        "D", CONNECTIONS, "same", choices=NEGATIVE_DP)] = None
    zero_window: Annotated[Text, Option(
        "Command of both signs: share by which it must pass zero before the other solenoid is driven.",
        "C", DRIVE, "1 %", "1 %")] = None
    ramp_up: Annotated[Text, Option(
        'Time from zero to full command, such as "0.5 s", or "0.5 s / 0.8 s" for positive and negative commands.',
        "T", DRIVE, "0 s", "0.5 s")] = None
    ramp_down: Annotated[Text, Option("Time from full command to zero.", "T", DRIVE, "0 s", "0.5 s")] = None
    dither: Annotated[Text, Option(
        'Square wave on the output, such as "150 Hz 1 %", plus and minus 1 % of full drive.',
        "D", DRIVE, "off", "150 Hz 1 %")] = None
    # fmt: on


#: Text of each option where it is not given. Of signals none: they span the target's whole converter.
DEFAULTS = {argument.name: argument.option.default for argument in arguments_of(DesignChoices)}


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignRequest:
    """The target that was designed for, and name and text of every option, a default where none was given."""

    target: "TargetInputs"
    options: Mapping[str, str]
