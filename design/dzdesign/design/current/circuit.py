"""The coil, its supply, its sensor and their sampling: what a current loop is designed for; and the loop's integers."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import log, sqrt
from typing import Annotated, NamedTuple

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity

#: Largest gain: with an error of `LARGEST_ERROR` counts, full command and the integral the sum stays within 31 bits.
LARGEST_GAIN = 8191
LARGEST_ERROR = 90_000
#: The correction of a supply's voltage has this many binary places.
CORRECTION_SHIFT = 14

Count = Annotated[int, Meta(ge=0, le=65535)]
Gain = Annotated[int, Meta(ge=0, le=LARGEST_GAIN)]
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


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentSensor:
    """Voltage at the converter's pin for a current, and for the supply where that is measured."""

    V_per_A: Annotated[float, quantity("V/A", gt=0)]
    """Shunt resistance times amplifier gain."""
    offset_V: Annotated[float, quantity("V", ge=0)] = 0.0
    """Voltage at the pin at zero current."""
    supply_divider: Annotated[float, quantity("1", ge=0)] = 0.0
    """Ratio of the supply's voltage divider; 0 if the supply is not measured."""

    def __post_init__(self) -> None:
        if not self.V_per_A > 0 or self.offset_V < 0 or not 0 <= self.supply_divider < 1:
            raise RuleError(
                "the current's sensor needs a positive gain, an offset of zero or more, a divider below one"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class SupplyCorrection:
    """Nominal supply voltage over the measured one, linear between nodes over the converter's codes."""

    valid_codes: tuple[Count, Count]
    """Range of the supply's codes; a code outside is replaced with the nearest one inside."""
    step_codes: Annotated[int, Meta(ge=1, le=4096)]
    """Codes between two nodes, a power of two."""
    nodes: tuple[Count, ...]
    """Nominal over measured voltage times 16384, at valid_codes[0] and at each further step."""

    def __post_init__(self) -> None:
        low, high = self.valid_codes
        if not 0 <= low < high:
            raise RuleError(f"the supply's codes {low} to {high} do not rise")
        if self.step_codes < 1 or self.step_codes & (self.step_codes - 1):
            raise RuleError(f"step_codes is {self.step_codes}, expected a power of two")
        needed = (high - low) // self.step_codes + 2
        if len(self.nodes) != needed:
            raise RuleError(f"the supply's correction has {len(self.nodes)} nodes, expected {needed}")
        if max(self.nodes) * self.step_codes >= 2**31 or max(self.nodes) > 65535 or min(self.nodes) < 1:
            raise RuleError("a node of the supply's correction is outside 1 to 65535, or too far from the next")


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentLoop:
    """An integer PI controller with feed-forward, limit, anti-windup and detection of faults.

    Set points are counts: `full_counts` stands for the rated current. The converter's codes come as the sum of those
    taken in a PWM period.
    """

    full_counts: Annotated[int, Meta(ge=1, le=65535)]
    """Set point of the rated current, in counts."""
    compare_limit: Count
    """Largest compare value of the PWM."""
    rate: Annotated[int, Meta(ge=1, le=65535)]
    """Largest change of the set point in a PWM period, in counts."""
    samples: Annotated[int, Meta(ge=1, le=16)]
    """Current samples in a PWM period, a power of two."""
    current_gain: Annotated[int, Meta(ge=1, le=65535)]
    """Counts of current per unit of the code sum after offset correction, times 2^current_shift."""
    current_shift: Annotated[int, Meta(ge=1, le=15)]
    """Fractional bits of current_gain."""
    gain_shift: Annotated[int, Meta(ge=1, le=13)]
    """Fractional bits of the three controller gains."""
    proportional: Gain
    """PWM counts per count of error, times 2^gain_shift."""
    integral: Gain
    """PWM counts per count of error that are added in every PWM period, times 2^gain_shift."""
    feed_forward: Gain
    """PWM counts per count of set point, times 2^gain_shift."""
    integral_limit: Count
    """Largest magnitude of the integral, in PWM counts."""
    release: Count
    """PWM counts by which the output stays below the integral, which starts at 0 on release."""
    offset_nominal: Count
    """Designed code sum at zero current."""
    offset_tolerance: Count
    """Largest deviation from offset_nominal that calibration removes."""
    offset_shift: Annotated[int, Meta(ge=0, le=12)]
    """The offset is averaged over 2^offset_shift PWM periods."""
    short_sum: Count
    """Code sum from which a short circuit is detected at once."""
    over_sum: Count
    """Code sum after offset correction from which the current is too high."""
    over_ticks: Annotated[int, Meta(ge=1, le=65535)]
    """Consecutive PWM periods with too high a current that make a fault."""
    open_sum: Count
    """Code sum after offset correction below which the current counts as absent."""
    open_compare: Count
    """Compare value from which a current is expected."""
    open_ticks: Annotated[int, Meta(ge=1, le=65535)]
    """Consecutive PWM periods without an expected current that make a fault."""
    held_ticks: Count = 0
    """Consecutive PWM periods with a current after the other solenoid was asked for that make a fault; 0 with one
    solenoid."""
    shunts: Annotated[int, Meta(ge=1, le=2)] = 1
    """Number of shunts: 1 if the current of either solenoid passes the same one. Of two that of the solenoid in use is
    sampled."""
    supply: SupplyCorrection | None = None
    """Correction for the supply voltage, if it is measured."""

    def __post_init__(self) -> None:
        if self.samples & (self.samples - 1) or not 1 <= self.samples <= 16:
            raise RuleError(f"samples is {self.samples}, expected a power of two up to 16: the sum has 16 bits")
        if self.largest_current > LARGEST_ERROR:
            raise RuleError(
                f"the sensor's range is {self.largest_current} counts of current, expected at most {LARGEST_ERROR}: "
                "one and a half times the rated current of 60000 counts"
            )
        if self.shunts not in (1, 2):
            raise RuleError(f"shunts is {self.shunts}, expected 1 or 2")
        if self.integral_limit << self.gain_shift > 65535 * 8192:
            raise RuleError("the integral's limit and the gains' binary places need more than 31 bits")
        if self.release > self.integral_limit:
            raise RuleError(f"release is {self.release}, expected at most the integral's limit {self.integral_limit}")
        if self.offset_nominal + self.offset_tolerance > 65535:
            raise RuleError("the offset's tolerance reaches past the end of the sum")
        if not 0 < self.open_sum < self.over_sum < self.short_sum <= 65535:
            raise RuleError("the sums of open load, over-current and short must rise in this order")
        for name in ("over_ticks", "open_ticks", "rate", *(["held_ticks"] if self.two else [])):
            if not 1 <= getattr(self, name) <= 65535:
                raise RuleError(f"{name} is {getattr(self, name)}, expected 1 to 65535")

    @property
    def two(self) -> bool:
        """Whether it has two solenoids, of which it drives one at a time."""
        return self.held_ticks > 0 or self.shunts == 2

    @property
    def offset_ticks(self) -> int:
        """PWM periods in which the offset of each shunt is calibrated."""
        return self.shunts << self.offset_shift

    @property
    def largest_current(self) -> int:
        """Counts of current of the largest sum that is no short, without an offset: beyond it the output is off."""
        return (self.short_sum * self.current_gain + (1 << (self.current_shift - 1))) >> self.current_shift
