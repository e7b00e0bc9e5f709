"""Evidence of a current loop, as ``verification.json`` holds it."""

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import quantity

Number = Annotated[int, Meta(ge=0, le=2**60)]
Share = Annotated[float, quantity("1", "Of the rated current.", ge=0, le=1)]
Codes = Annotated[float, quantity("codes", "Of the converter.", ge=-65536, le=65536)]
#: Names of the bits of dz_current.h.
FaultName = Literal["NO_OFFSET", "SENSOR", "OPEN", "SHORT", "OVER"]


def about(description: str) -> Meta:
    """Return what an annotation says of a field."""
    return Meta(description=description)


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerStates:
    """The C of the controller against its exact model."""

    states: Annotated[Number, about("States and calibrations that were compared.")]
    seed: Annotated[Number, about("Of the first block of states; each block has the next one.")]
    wrong: Annotated[Number, about("Those of which any number differs.")]
    first_wrong: Annotated[str | None, about("The first of them, in words.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentCorner:
    """One coil at one supply: margins of its equations, and what the C does with it."""

    resistance_ohm: Annotated[float, quantity("ohm", "Of the whole circuit.", ge=0, le=1e6)]
    inductance_H: Annotated[float, quantity("H", "Inductance.", ge=0, le=1e6)]
    supply_V: Annotated[float, quantity("V", "Supply.", ge=0, le=1e6)]
    phase_margin_deg: Annotated[float, quantity("deg", "Least phase margin of all currents.", ge=0, le=180)]
    gain_margin: Annotated[float, quantity("1", "Least gain margin of all currents.", ge=0, le=1e6)]
    limit_cycle_codes: Annotated[
        float, quantity("codes", "Largest swing of the settled mean current, or of its reading.", ge=0, le=1e6)
    ]
    steady_error_codes: Annotated[
        float, quantity("codes", "Largest departure of the mean reading from the set point.", ge=0, le=1e6)
    ]
    current_error_codes: Annotated[
        float,
        quantity(
            "codes",
            "The same of the current itself: with the rounding of codes without noise, and the ripple between samples.",
            ge=0, le=1e6,
        ),
    ]  # fmt: skip
    release_overshoot_codes: Annotated[
        float, quantity("codes", "Largest mean current beyond the set point, as that comes from zero.", ge=0, le=1e6)
    ]
    rise_s: Annotated[
        float | None,
        quantity("s", "10 to 90 % of the rated current; null where the supply can't carry that, or it is not reached."),
    ]
    least_rise_s: Annotated[float | None, quantity("s", "The same with the switch on all the time.")]
    overshoot: Annotated[float | None, quantity("1", "Of that step, of its height.")]
    faults: Annotated[Number, about("Bits of the faults that the C saw, of DZ_CURRENT_...: must be 0.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRun:
    """One fault of the circuit in motion, taken away again."""

    name: Annotated[str, about("What happens.")]
    expected: Annotated[FaultName, about("Bit of the faults that it must set.")]
    seen_after_s: Annotated[
        float | None, quantity("s", "From the fault to that bit; null: it was not set.")
    ]
    limit_s: Annotated[float, quantity("s", "How long that may take.", ge=0, le=1e6)]
    latched: Annotated[bool, about("Whether the output stays off, and the bit set, once the fault is gone.")]

    @property
    def holds(self) -> bool:
        """True if it was seen in time, and the output stayed off."""
        return self.seen_after_s is not None and self.seen_after_s <= self.limit_s and self.latched


Flow = Annotated[float, quantity("L/min", "Flow.", ge=-1e6, le=1e6)]
OpeningShare = Annotated[float, quantity("1", "Of full command.", ge=0, le=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveAtCorners:
    """The valve in closed loop at one pressure drop, its current made by every coil at every supply."""

    dp_MPa: Annotated[float, quantity("MPa", "Pressure drop at no flow.", ge=0, le=1000)]
    runs: Annotated[Number, about("Coils at a supply: the declared one, and the ends of all ranges.")]
    opening_least: Annotated[OpeningShare, about("Least dead zone on opening that the compensator leaves.")]
    opening_largest: Annotated[OpeningShare, about("The largest.")]
    q_zero_L_min: Annotated[Flow, about("Largest flow at zero command after closing; a leak is in it.")]
    q_released_L_min: Annotated[
        Flow, about("Largest flow before the ramp, as the set point steps to the offset when the drive is released.")
    ]
    unseen_below_L_min: Annotated[
        Flow | None,
        about("Flow below which the recordings show none, so that the plant's is not known; null of a given plant."),
    ]
    leak_L_min: Annotated[Flow, about("Flow without any drive, which no compensator can stop.")]
    allowed_at_zero_L_min: Annotated[
        Flow | None,
        about("Flow allowed at zero command, a leak included, as --zero-flow declares; null: none but the leak."),
    ]

    @property
    def q_beyond_L_min(self) -> float:
        """Flow at zero command beyond what is allowed there, after closing or as the drive is released."""
        return max(self.q_zero_L_min, self.q_released_L_min) - max(self.leak_L_min, self.allowed_at_zero_L_min or 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentLoopResult:
    """What was found of the current loop: the C by itself, and with the coil at every corner of the declared ranges."""

    states: Annotated[ControllerStates, about("State by state.")]
    seconds: Annotated[float, quantity("s", "For which each set point was held, once settled.", ge=0, le=1e6)]
    shares: Annotated[tuple[Share, ...], about("Those set points, of the rated current.")]
    not_carried: Annotated[Number, about("Pairs of corner and set point that the supply can't carry: not tried.")]
    corners: Annotated[tuple[CurrentCorner, ...], about("One entry a corner.")]
    offset_codes: Annotated[
        tuple[Codes, ...], about("Errors of the sensor's zero that were calibrated away at the nominal corner.")
    ]
    offset_error_codes: Annotated[
        float, quantity("codes", "Largest departure of the mean reading from the set point with them.", ge=0, le=1e6)
    ]
    dither_above_counts: Annotated[
        float, quantity("counts", "By how much the current's peak in the dither lies above the set point's.", ge=0)
    ]
    dither_below_counts: Annotated[float, quantity("counts", "The same below it.", ge=0)]
    faults: Annotated[tuple[FaultRun, ...], about("One entry a fault.")]
    valve: Annotated[
        tuple[ValveAtCorners, ...],
        about("The valve behind it, one entry a tested pressure drop; none if the closed loop did not run."),
    ] = ()
