"""Limits for a compensated valve: largest values that its recordings may show, and whether they do."""

from collections.abc import Mapping
from dataclasses import dataclass

from dzdesign.assess.valve_quantities import IN_UNIT, QUANTITIES, Quantity, Reading
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.units import parse_quantity

#: A limit that compares both sets, beside those of `QUANTITIES`.
LOSS = "largest_flow_loss"
LIMITED: dict[str, Quantity] = {key: quantity for key, quantity in QUANTITIES.items() if quantity.limit} | {
    LOSS: Quantity(
        name="loss of largest flow",
        unit="%",
        formula="1 - largest flow AFTER / largest flow BEFORE",
        limit="ratio",
    )
}
#: Of these a limit may also be a command in volts.
OF_COMMAND = ("dead_zone_opening", "dead_zone_closing", "knee_opening", "knee_closing", "hysteresis")


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitResult:
    """Whether one recording meets one limit.

    Attributes
    ----------
    key : str
        Of `LIMITED`.
    place : str
        Side and pressure drop, in words.
    limit : float
        Share or SI.
    holds : bool or None
        None: it could not be checked.
    text : str
        What was found, and by how much a limit is missed.
    """

    key: str
    place: str
    limit: float
    holds: bool | None
    text: str


def parse_limits(text: str | Mapping[str, str], u_max: float) -> dict[str, float]:
    """Read what ``--limits`` or the table ``[limits]`` says: quantity -> largest value, a share or SI.

    Parameters
    ----------
    text : str or mapping
        ``"dead_zone_opening = 5 %, flow_at_zero = 0.1 L/min"``, or the same as a mapping.
    u_max : float
        Full command in V, of which a limit in volts is a share.

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
    kind = LIMITED[key].limit
    in_volts = key in OF_COMMAND and text.rstrip().endswith("V")
    value = parse_quantity(text, "voltage", option) / u_max if in_volts else parse_quantity(text, kind, option)
    if value < 0:
        raise InputError(f"{option} is '{text}', expected zero or more: a limit is a largest value")
    return value


def check_limits(
    limits: Mapping[str, float], place: str, before: Mapping[str, Reading] | None, after: Mapping[str, Reading]
) -> list[LimitResult]:
    """Check the recordings with the compensator at one pressure drop against every limit.

    Parameters
    ----------
    limits : mapping
        Of `parse_limits`.
    place : str
        Side and pressure drop, in words.
    before, after : mapping
        Readings of `QUANTITIES`; None where there is no recording without the compensator.
    """
    results = []
    for key, limit in limits.items():
        reading = _loss(before, after) if key == LOSS else after.get(key)
        if reading is not None:
            results.append(_check(key, place, limit, reading))
    return results


def _loss(before: Mapping[str, Reading] | None, after: Mapping[str, Reading]) -> Reading:
    if before is None:
        return Reading(not_observable="there is no recording without the compensator at this pressure drop")
    return Reading(value=1 - after["largest_flow"].value / before["largest_flow"].value)


def _check(key: str, place: str, limit: float, reading: Reading) -> LimitResult:
    """Compare a reading with its limit; what is not observable holds only where a bound of it does."""
    quantity = LIMITED[key]

    def said(value: float) -> str:
        return f"{IN_UNIT[quantity.unit] * value:.3g} {quantity.unit}"

    value = reading.value
    if value is None:
        known = reading.at_most is not None
        holds = True if known and reading.at_most <= limit else None
        bound = f"at most {said(reading.at_most)}; " if known else ""
        hope = f"; only a limit of {said(reading.at_most)} or more could be checked" if known and not holds else ""
        text = f"{bound}not observable, because {reading.not_observable}{hope}"
    else:
        # A symmetry has a sign, and a meter's zero error gives one to the flow at zero command.
        size = abs(value) if key in ("symmetry", "flow_at_zero") else value
        holds = size <= limit
        error = f" ± {said(reading.se)}" if reading.se is not None else ""
        missed = f", {said(size - limit)} more than the limit of {said(limit)}"
        text = f"{said(value)}{error}" + ("" if holds else missed)
    return LimitResult(key=key, place=place, limit=limit, holds=holds, text=text)
