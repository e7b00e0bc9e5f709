"""What a hydraulic valve test states of a flow curve: dead zone, knee, hysteresis, linearity, gain, flow at zero.

The words are those of such tests (as in ISO 10770-1); the formulas are ours, stand in `QUANTITIES`, and are printed
with every result. No conformity with a standard is claimed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError
from dzdesign.identify.constants import L_MIN

#: Larger than any value that a recording may show, in any unit here; bounds in a file keep arithmetic from overflowing.
LARGEST = 1e12


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """One quantity: its name, unit and formula."""

    name: Annotated[str, Meta(description="Display name.")]
    unit: Annotated[str, Meta(description="Unit of the values.")]
    formula: Annotated[str, Meta(description="Formula of the quantity.")]


QUANTITIES: dict[str, Quantity] = {
    key: Quantity(name=name, unit=unit, formula=formula)
    for key, name, unit, formula in (
        ("dead_zone_opening", "dead zone, opening", "%",
         "u_r(Q_L) / u_max: command at which the rising branch passes the reading flow Q_L"),
        ("dead_zone_closing", "dead zone, closing", "%",
         "u_f(Q_L) / u_max: command at which the falling branch passes the reading flow Q_L"),
        ("ideal_line", "ideal line at the reading flow", "%",
         "Q_L / largest flow: what a straight line from zero command to the largest flow would read"),
        ("onset_opening", "onset, opening", "%",
         "command at which the rising branch's first flow stands out of the meter's noise, over u_max"),
        ("onset_closing", "onset, closing", "%", "the same for the falling branch's last flow"),
        ("knee_opening", "knee, opening", "%",
         "zero of the line through the straight part of Q/sqrt(dP) on the rising branch, over u_max"),
        ("knee_closing", "knee, closing", "%", "the same on the falling branch"),
        ("hysteresis", "hysteresis", "%",
         "largest |u_r(Q) - u_f(Q)| / u_max at Q = 5, 10, ... 90 % of the largest flow"),
        ("linearity", "linearity", "%",
         "largest |m(u) - (a + b u)| / Q_rated in the window of u; m is the mean of both branches, each averaged over "
         "cells of 1 % of u_max (the noise of single readings would add to the largest), a + b u its least-squares "
         "line there, Q_rated the largest flow BEFORE at this pressure drop"),
        ("gain", "gain", "L/min/V", "slope of the lines through the straight part, mean of both branches"),
        ("flow_at_zero", "flow at zero", "L/min",
         "mean of Q over the later half of the hold at zero command after closing"),
        ("largest_flow", "largest flow", "L/min",
         "Q at the largest command, as recorded (its pressure drop may sag)"),
        ("symmetry", "symmetry", "%", "gain of the positive side over that of the negative side, less 1"),
    )
}  # fmt: skip
#: A quantity that compares both sets: it can be limited, and is read from no recording alone.
LOSS = "largest_flow_loss"
LOSS_OF_FLOW = Quantity(
    name="loss of largest flow", unit="%", formula="1 - largest flow AFTER / largest flow BEFORE"
)
#: SI, or a share, to the unit of a quantity.
IN_UNIT = {"%": 100.0, "L/min": 1 / L_MIN, "L/min/V": 1 / L_MIN}

Value = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]
StandardError = Annotated[float, Meta(ge=0, le=LARGEST)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A quantity as read from a recording, in the unit of the quantity."""

    value: Annotated[Value | None, Meta(description="Value of the quantity; null if it can't be observed.")]
    se: Annotated[StandardError | None, Meta(description="Standard error of the value, if it can be estimated.")]
    at_most: Annotated[Value | None, Meta(description="Upper bound, if no value but only a bound is known.")]
    not_observable: Annotated[str | None, Meta(description="Reason why there is no value.")]
    note: Annotated[str | None, Meta(description="Remark that is needed to interpret the value.")]
    where: Annotated[
        str | None, Meta(description="Flow or command at which the value was found, relative to the largest one.")
    ]

    def __post_init__(self) -> None:
        if (self.value is None) == (self.not_observable is None):
            raise RuleError("a reading has a value and a reason why it has none, or neither; expected one of them")


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Change of a quantity from without to with the compensator, in its unit."""

    value: Annotated[Value, Meta(description="Change, in the unit of the quantity.")]
    se: Annotated[StandardError | None, Meta(description="Standard error of the change.")]


def observed(value: float, se: float | None = None, note: str | None = None, where: str | None = None) -> Reading:
    """Return the reading of a quantity that is observable."""
    return Reading(value=value, se=se, at_most=None, not_observable=None, note=note, where=where)


def hidden(reason: str, at_most: float | None = None) -> Reading:
    """Return the reading of a quantity that is not observable."""
    return Reading(value=None, se=None, at_most=at_most, not_observable=reason, note=None, where=None)


def in_units(readings: Mapping[str, Reading]) -> dict[str, Reading]:
    """Return readings in SI, or as shares, in the units of their quantities."""

    def scaled(reading: Reading, factor: float) -> Reading:
        value, se, at_most = (
            None if each is None else factor * each for each in (reading.value, reading.se, reading.at_most)
        )
        return replace(reading, value=value, se=se, at_most=at_most)

    return {key: scaled(reading, IN_UNIT[QUANTITIES[key].unit]) for key, reading in readings.items()}


def symmetry(positive: Reading | None, negative: Reading | None) -> Reading:
    """Return by how much one side is steeper than the other, in percent, from the gains of both."""
    known: list[tuple[float, float]] = []
    for gain, side in ((positive, "positive"), (negative, "negative")):
        if gain is None:
            return hidden(f"the {side} side was not recorded at this pressure drop")
        if gain.value is None:
            return hidden(f"the {side} side's gain is not observable: {gain.not_observable}")
        known.append((gain.value, gain.se or 0.0))
    (over, over_se), (under, under_se) = known
    ratio = over / under
    return observed(100 * (ratio - 1), 100 * abs(ratio) * math.hypot(over_se / over, under_se / under))


def change(before: Reading | None, after: Reading | None) -> Change | None:
    """Return AFTER minus BEFORE and its standard error; None where one of them shows no value."""
    if before is None or after is None or before.value is None or after.value is None:
        return None
    se = None if before.se is None or after.se is None else math.hypot(before.se, after.se)
    return Change(value=after.value - before.value, se=se)
