"""`LeftOut`: a stretch of a recording that no threshold was found from, an entry of a test's ``left_out``."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from dzdesign.core.artefact_types import quantity
from dzdesign.core.recorded_units import RecordedUnits

#: Why, for people.
REASONS = {
    "option": "--from and --to leave it out",
    "pressure": "the pressure drop is not the ramp's",
    "no-pressure": "the command moves without pressure",
    "partial": "the command stays below half of its largest",
    "no-ramp": "a fragment without a ramp",
}
#: Parts of one recording and reason that have a line each; more share one, as noise about a limit makes hundreds.
MOST_LINES = 5
Time = Annotated[float, quantity("s", ge=-1e12, le=1e12)]
AnyPressure = Annotated[float, quantity("MPa", ge=-1e3, le=1e3)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """A part of a recording that belongs to no ramp."""

    recording: str
    """Name of the recording."""
    from_s: Time
    """Time of the first sample left out, on the recording's own clock."""
    to_s: Time
    """Time of the last sample left out."""
    reason: Literal["option", "pressure", "no-pressure", "partial", "no-ramp"]
    """Reason why it was left out. option: --from or --to. pressure: a rest or part of a ramp at another pressure drop,
    such as before the pump started. no-pressure: a sweep without pressure or flow. partial: a sweep that stays below
    half of the largest command. no-ramp: a fragment without a ramp."""
    dp_MPa: Annotated[tuple[AnyPressure, AnyPressure] | None, quantity("MPa")]
    """Lowest and highest pressure drop in the part left out; null if unknown."""


def left_out_in_words(parts: Iterable[LeftOut], units: RecordedUnits) -> Iterator[str]:
    """Yield the lines of `-v`: one for each part, or for all parts of one reason where a recording has many."""
    alike: dict[tuple[str, str], list[LeftOut]] = {}
    for part in parts:
        alike.setdefault((part.recording, part.reason), []).append(part)
    for (recording, reason), found in alike.items():
        for together in [found] if len(found) > MOST_LINES else [[part] for part in found]:
            span = f"{min(part.from_s for part in together):.1f} to {max(part.to_s for part in together):.1f} s"
            many = "" if len(together) == 1 else f"{len(together)} parts of "
            known = [part.dp_MPa for part in together if part.dp_MPa is not None]
            low, high = min((low for low, _ in known), default=0.0), max((high for _, high in known), default=0.0)
            dp = f" ({units.number(low, '.3g MPa')} to {units.text(high, '.3g MPa')})" if known else ""
            yield f"'{recording}', {many}{span} left out: {REASONS[reason]}{dp}"
