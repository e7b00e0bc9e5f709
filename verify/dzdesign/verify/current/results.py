"""Evidence of a current loop, as ``verification.json`` holds it."""

from dataclasses import dataclass
from typing import Annotated, Literal

from dzdesign.core.artefact_types import quantity
from dzdesign.verify.loop_results import Count, about

Share = Annotated[float, quantity("1", "Share of the rated current.", ge=0, le=1)]
Codes = Annotated[float, quantity("codes", "Codes of the converter.", ge=-65536, le=65536)]
#: Names of the bits of dz_current.h.
FaultName = Literal["NO_OFFSET", "SENSOR", "OPEN", "SHORT", "OVER", "HELD"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerStates:
    """Comparison of the controller's C with its exact model."""

    states: Annotated[Count, about("Number of states and calibrations that were compared.")]
    seed: Annotated[Count, about("Random seed of the first block of states; each further block uses the next seed.")]
    wrong: Annotated[Count, about("Number of states in which any value differs.")]
    first_wrong: Annotated[str | None, about("First difference, in words.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentCorner:
    """One coil at one supply: margins of the loop by its equations, and the behaviour of the C code."""

    resistance_ohm: Annotated[float, quantity("ohm", ge=0, le=1e6)]
    """Resistance of the whole circuit."""
    inductance_H: Annotated[float, quantity("H", ge=0, le=1e6)]
    """Inductance of the coil."""
    supply_V: Annotated[float, quantity("V", ge=0, le=1e6)]
    """Supply voltage."""
    phase_margin_deg: Annotated[float, quantity("deg", ge=0, le=180)]
    """Least phase margin over all currents."""
    gain_margin: Annotated[float, quantity("1", ge=0, le=1e6)]
    """Least gain margin over all currents."""
    limit_cycle_codes: Annotated[float, quantity("codes", ge=0, le=1e6)]
    """Largest peak-to-peak swing of the settled mean current or its reading."""
    steady_error_codes: Annotated[float, quantity("codes", ge=0, le=1e6)]
    """Largest deviation of the mean reading from the set point."""
    current_error_codes: Annotated[float, quantity("codes", ge=0, le=1e6)]
    """Largest deviation of the mean current from the set point. It includes the rounding of codes without noise and the
    ripple between samples."""
    release_overshoot_codes: Annotated[float, quantity("codes", ge=0, le=1e6)]
    """Largest overshoot of the mean current beyond the set point on release from zero."""
    rise_s: Annotated[float | None, quantity("s")]
    """Rise time from 10 to 90 % of the rated current; null if the supply can't carry it or it is not reached."""
    least_rise_s: Annotated[float | None, quantity("s")]
    """Rise time with the switch always on."""
    overshoot: Annotated[float | None, quantity("1")]
    """Overshoot of that step, relative to its height."""
    faults: Count
    """Fault bits DZ_CURRENT_... that the C code set; must be 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRun:
    """One fault injected into the running circuit and removed again."""

    name: Annotated[str, about("Fault that is injected.")]
    expected: Annotated[FaultName, about("Fault bit that must be set.")]
    seen_after_s: Annotated[float | None, quantity("s", "Time from the fault to its bit; null if the bit was not set.")]
    limit_s: Annotated[float, quantity("s", "Longest permitted time.", ge=0, le=1e6)]
    latched: Annotated[bool, about("Whether the output stays off and the bit stays set after the fault is removed.")]

    @property
    def holds(self) -> bool:
        """True if it was seen in time, and the output stayed off."""
        return self.seen_after_s is not None and self.seen_after_s <= self.limit_s and self.latched


@dataclass(frozen=True, slots=True, kw_only=True)
class SolenoidChanges:
    """Changes from one solenoid to the other and back, at every phase of the decay and at every corner."""

    corners: Annotated[Count, about("Number of coils at a supply.")]
    phases: Annotated[Count, about("Number of PWM periods after which the side was changed back, from 1 on.")]
    both_A: Annotated[float, quantity("A", "Largest current that both solenoids had at once.", ge=0, le=1e6)]
    slowest_s: Annotated[
        float, quantity("s", "Longest time from a change of side to the current of the other solenoid.", ge=0, le=1e6)
    ]
    faults: Annotated[Count, about("Fault bits DZ_CURRENT_... that the C code set; must be 0.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentLoopResult:
    """Result of the current loop: the C code alone, and with the coil at every corner of the declared ranges."""

    states: Annotated[ControllerStates, about("Comparison of the controller with its exact model, state by state.")]
    seconds: Annotated[float, quantity("s", "Time for which each set point was held after settling.", ge=0, le=1e6)]
    shares: Annotated[tuple[Share, ...], about("Set points, as shares of the rated current.")]
    not_carried: Annotated[
        Count, about("Combinations of corner and set point that the supply can't carry. They were not tried.")
    ]
    corners: Annotated[tuple[CurrentCorner, ...], about("Result of each corner.")]
    offset_codes: Annotated[
        tuple[Codes, ...], about("Zero errors of the sensor that were calibrated away at the nominal corner.")
    ]
    offset_error_codes: Annotated[
        float,
        quantity("codes", "Largest deviation of the mean reading from the set point with these errors.", ge=0, le=1e6),
    ]
    dither_above_counts: Annotated[
        float, quantity("counts", "Excess of the current's peak over that of the set point under dither.", ge=0)
    ]
    dither_below_counts: Annotated[
        float, quantity("counts", "Deficit of the current's peak against that of the set point under dither.", ge=0)
    ]
    faults: Annotated[tuple[FaultRun, ...], about("Result of each injected fault.")]
    changes: Annotated[
        SolenoidChanges | None, about("Changes from one solenoid to the other; null of one solenoid.")
    ] = None
