"""Limits for a compensated valve: largest values that its recordings may show, and whether they do."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from dzdesign.assess.quantities import (
    IN_UNIT,
    LOSS,
    LOSS_OF_FLOW,
    QUANTITIES,
    Quantity,
    Reading,
    Value,
    hidden,
    observed,
)
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.units import parse_quantity

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
