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
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.units import parse_quantity
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


#: Quantities for which there is a largest value; a gain and a flow at full command have none.
LIMITED: dict[str, Quantity] = {
    **{key: quantity for key, quantity in QUANTITIES.items() if key not in ("gain", "largest_flow", "ideal_line")},
    LOSS: LOSS_OF_FLOW,
}
#: Unit of a quantity -> what `parse_quantity` calls the quantity of its limit.
KINDS = {"%": "ratio", "L/min": "flow"}
#: Of these a limit may also be a command in volts.
OF_COMMAND = (
    "dead_zone_opening", "dead_zone_closing", "onset_opening", "onset_closing", "knee_opening", "knee_closing",
    "hysteresis",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitResult:
    """Whether the recordings at one pressure drop meet one limit."""

    quantity: Annotated[str, Meta(description="Key of the quantity.")]
    place: Annotated[str, Meta(description="Side and pressure drop, as text.")]
    limit: Annotated[Value, Meta(description="Largest permitted value, in `unit`.")]
    unit: Annotated[str, Meta(description="Unit of the limit.")]
    holds: Annotated[bool | None, Meta(description="Whether the limit holds; null if it could not be checked.")]
    text: Annotated[str, Meta(description="Value that was found and, if the limit is exceeded, by how much.")]


def parse_limits(text: str | Mapping[str, str], u_max: float) -> dict[str, float]:
    """Read what ``--limits`` or the table ``[limits]`` says: quantity -> largest value, a share or SI.

    A limit in volts is a share of full command `u_max` (V).

    Raises
    ------
    InputError
        If a quantity is unknown (the nearest is named) or named twice, or a value can't be read.

    Examples
    --------
    >>> parse_limits("dead_zone_opening = 5 %, hysteresis = 0.2 V", 10.0)
    {'dead_zone_opening': 0.05, 'hysteresis': 0.02}
    """
    if isinstance(text, str):
        entries = [entry.partition("=")[::2] for entry in text.split(",") if entry.strip()]
    else:
        entries = list(text.items())
    limits: dict[str, float] = {}
    for name, value in entries:
        key = name.strip().replace("-", "_").replace(" ", "_")
        if key not in LIMITED:
            raise InputError(
                f"--limits names '{name.strip()}'{nearest(key, LIMITED)}, expected one of {', '.join(LIMITED)}"
            )
        if key in limits:
            raise InputError(f"--limits names {key} twice; keep one")
        limits[key] = _limit(key, value.strip(), u_max)
    if not limits:
        raise InputError("--limits is empty, expected for example 'dead_zone_opening = 5 %'; or leave it out")
    return limits


def _limit(key: str, text: str, u_max: float) -> float:
    option = f"the limit {key}"
    kind = KINDS[LIMITED[key].unit]
    in_volts = key in OF_COMMAND and text.rstrip().endswith("V")
    value = parse_quantity(text, "voltage", option) / u_max if in_volts else parse_quantity(text, kind, option)
    if value < 0:
        raise InputError(f"{option} is '{text}', expected zero or more: a limit is a largest value")
    return value


def check_limits(
    limits: Mapping[str, float],
    place: str,
    before: Mapping[str, Reading] | None,
    after: Mapping[str, Reading],
    units: RecordedUnits,
) -> list[LimitResult]:
    """Check the recordings with the compensator at one pressure drop against every limit of `parse_limits`.

    `before` is None where there is no recording without the compensator.
    """
    results = []
    for key, limit in limits.items():
        reading = _loss(before, after) if key == LOSS else after.get(key)
        if reading is not None:
            results.append(_check(key, place, IN_UNIT[LIMITED[key].unit] * limit, reading, units))
    return results


def _loss(before: Mapping[str, Reading] | None, after: Mapping[str, Reading]) -> Reading:
    if before is None:
        return hidden("there is no recording without the compensator at this pressure drop")
    largest, largest_before = after["largest_flow"].value, before["largest_flow"].value
    if largest is None or not largest_before:
        return hidden("there is no largest flow at this pressure drop")
    return observed(100 * (1 - largest / largest_before))


def _check(key: str, place: str, limit: float, reading: Reading, units: RecordedUnits) -> LimitResult:
    """Compare a reading with its limit; what is not observable holds only where a bound of it does."""
    unit = LIMITED[key].unit

    def number(value: float) -> str:
        return f"{value:.3g} %" if unit == "%" else units.text(value, f".3g {unit}")

    value, bound = reading.value, reading.at_most
    holds: bool | None
    if value is not None:
        # A symmetry has a sign, and a meter's zero error gives one to the flow at zero command.
        size = abs(value) if key in ("symmetry", "flow_at_zero") else value
        holds = size <= limit
        error = f" (standard error {number(reading.se)})" if reading.se is not None else ""
        missed = f", {number(size - limit)} more than the limit of {number(limit)}"
        text = f"{number(value)}{error}" + (f", limit {number(limit)}" if holds else missed)
    elif bound is not None:
        holds = True if bound <= limit else None
        hope = "" if holds else f"; only a limit of {number(bound)} or more could be checked"
        text = f"at most {number(bound)}; not observable, because {reading.not_observable}{hope}"
    else:
        holds, text = None, f"not observable, because {reading.not_observable}"
    return LimitResult(quantity=key, place=place, limit=limit, unit=unit, holds=holds, text=text)
