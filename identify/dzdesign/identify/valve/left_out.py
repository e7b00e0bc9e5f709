"""`LeftOut`: a stretch of a recording that no threshold was found from, an entry of a test's ``left_out``."""

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

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
Time = Annotated[float, quantity("s", ge=-1e12, le=1e12)]
AnyPressure = Annotated[float, quantity("MPa", ge=-1e3, le=1e3)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """A part of a recording that belongs to no ramp."""

    recording: Annotated[str, Meta(description="Name of the recording.")]
    from_s: Annotated[Time, Meta(description="Time of the first sample left out, on the recording's own clock.")]
    to_s: Annotated[Time, Meta(description="Time of the last sample left out.")]
    reason: Annotated[
        Literal["option", "pressure", "no-pressure", "partial", "no-ramp"],
        Meta(
            description="Reason why it was left out. option: --from or --to. pressure: a rest or part of a ramp at "
            "another pressure drop, such as before the pump started. no-pressure: a sweep without pressure "
            "or flow. partial: a sweep that stays below half of the largest command. no-ramp: a fragment "
            "without a ramp."
        ),
    ]
    dp_MPa: Annotated[
        tuple[AnyPressure, AnyPressure] | None,
        quantity("MPa", "Lowest and highest pressure drop in the part left out; null if unknown."),
    ]

    def in_words(self, units: RecordedUnits) -> str:
        """Return it as `-v` prints it."""
        low, high = self.dp_MPa or (0.0, 0.0)
        dp = "" if self.dp_MPa is None else f" ({units.number(low, '.3g MPa')} to {units.text(high, '.3g MPa')})"
        return f"'{self.recording}', {self.from_s:.1f} to {self.to_s:.1f} s left out: {REASONS[self.reason]}{dp}"
