"""The coil, its supply and how its current is sampled: what a current loop is designed for."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import log, sqrt
from typing import Annotated, NamedTuple

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity

Factors = Annotated[tuple[float, float], Meta(description="Least and largest factor.")]


class Corner(NamedTuple):
    """One coil at one supply: resistance of the whole circuit, inductance, voltage."""

    resistance_ohm: float
    inductance_H: float
    supply_V: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CoilCircuit:
    """A solenoid's coil, switched by a PWM from a supply, with a freewheeling diode."""

    resistance_ohm: Annotated[float, quantity("ohm", gt=0)]
    """Resistance of the coil at its nominal temperature."""
    inductance_H: Annotated[float, quantity("H", gt=0)]
    """Inductance of the coil."""
    rated_A: Annotated[float, quantity("A", gt=0)]
    """Rated current, which is the current at full command."""
    supply_V: Annotated[tuple[float, float], quantity("V")]
    """Lowest and highest supply voltage; the nominal one is their geometric mean."""
    series_ohm: Annotated[float, quantity("ohm", ge=0)] = 0.5
    """Resistance of the switch, shunt and wires."""
    freewheel_V: Annotated[float, quantity("V", gt=0)] = 0.7
    """Voltage of the freewheeling diode."""
    resistance_factors: Factors = (0.75, 1.35)
    """Least and largest factor of the coil's resistance, by temperature and manufacture."""
    inductance_factors: Factors = (0.5, 1.5)
    """Least and largest factor of the inductance, by air gap and saturation."""

    def __post_init__(self) -> None:
        for name in ("resistance_ohm", "inductance_H", "rated_A", "freewheel_V"):
            if not 0 < getattr(self, name) < 1e6:
                raise RuleError(f"{name} is {getattr(self, name):g}, expected more than zero")
        if not 0 <= self.series_ohm < 1e6:
            raise RuleError(f"series_ohm is {self.series_ohm:g}, expected zero or more")
        for name in ("resistance_factors", "inductance_factors", "supply_V"):
            low, high = getattr(self, name)
            if not 0 < low <= high < 1e6:
                raise RuleError(f"{name} is {low:g} to {high:g}, expected positive numbers that rise")

    @property
    def nominal_V(self) -> float:
        """The supply that the gains are stated at: as far from the lowest as from the highest, in ratio."""
        return sqrt(self.supply_V[0] * self.supply_V[1])

    @property
    def nominal(self) -> Corner:
        """The coil as declared at the nominal supply."""
        return Corner(self.resistance_ohm + self.series_ohm, self.inductance_H, self.nominal_V)

    def corners(self) -> Iterator[Corner]:
        """Yield every combination of the least, declared and largest resistance, inductance and supply."""
        resistances = (factor * self.resistance_ohm for factor in _with_middle(self.resistance_factors))
        inductances = (factor * self.inductance_H for factor in _with_middle(self.inductance_factors))
        supplies = (self.supply_V[0], self.nominal_V, self.supply_V[1])
        for ohm, henry, volts in product(resistances, inductances, supplies):
            yield Corner(ohm + self.series_ohm, henry, volts)

    def end_corners(self) -> Iterator[Corner]:
        """Yield the combinations of the least and largest alone."""
        resistances = [factor * self.resistance_ohm + self.series_ohm for factor in self.resistance_factors]
        inductances = [factor * self.inductance_H for factor in self.inductance_factors]
        yield from (Corner(*each) for each in product(resistances, inductances, self.supply_V))

    def duty(self, corner: Corner, current_A: float) -> float:
        """Return the duty that holds a current, the coil conducting all the time."""
        return (corner.resistance_ohm * current_A + self.freewheel_V) / (corner.supply_V + self.freewheel_V)

    def fastest_rise_s(self, corner: Corner, start_A: float, end_A: float) -> float:
        """Return the time from one current up to another at full duty: no controller is faster."""
        settled = corner.supply_V / corner.resistance_ohm
        if settled <= end_A:
            return float("inf")
        return corner.inductance_H / corner.resistance_ohm * log((settled - start_A) / (settled - end_A))

    def fastest_fall_s(self, corner: Corner, start_A: float, end_A: float) -> float:
        """Return the time from one current down to another with the switch off: the diode's voltage alone acts."""
        settled = -self.freewheel_V / corner.resistance_ohm
        return corner.inductance_H / corner.resistance_ohm * log((start_A - settled) / (end_A - settled))


def _with_middle(ends: tuple[float, float]) -> tuple[float, ...]:
    return (ends[0], 1.0, ends[1]) if ends[0] < 1.0 < ends[1] else ends


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentSampling:
    """Times of the current samples and the interrupt within a PWM period, which begins with the pulse.

    The codes are taken at the middles of `samples` equal parts of the period; the interrupt comes after `before` of
    them, and what it computes acts from the next period on.
    """

    tick_Hz: Annotated[int, quantity("Hz", ge=1)] = 2500
    """PWM frequency."""
    samples: Annotated[int, Meta(ge=1, le=16)] = 16
    """Current samples in a PWM period, a power of two."""
    before: Annotated[int, Meta(ge=1, le=16)] = 14
    """Number of these samples that precede the interrupt."""

    def __post_init__(self) -> None:
        if self.samples not in (1, 2, 4, 8, 16) or not 1 <= self.before <= self.samples:
            raise RuleError(f"{self.before} of {self.samples} samples before the interrupt: expected a power of two")

    @property
    def period_s(self) -> float:
        """Length of a PWM period."""
        return 1 / self.tick_Hz

    @property
    def delay_s(self) -> float:
        """From the middle of the samples to the middle of the period in which the output acts."""
        return (1.5 - (self.before / self.samples - 0.5)) * self.period_s
