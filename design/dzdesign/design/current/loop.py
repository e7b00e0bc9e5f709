"""`CurrentLoop`: the current controller of the drive as the integers that the firmware uses."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError

#: Largest gain: with an error of `LARGEST_ERROR` counts, full command and the integral the sum stays within 31 bits.
LARGEST_GAIN = 8191
LARGEST_ERROR = 90_000
#: The correction of a supply's voltage has this many binary places.
CORRECTION_SHIFT = 14

Count = Annotated[int, Meta(ge=0, le=65535)]
Gain = Annotated[int, Meta(ge=0, le=LARGEST_GAIN)]


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
    current_gain: Annotated[int, Meta(ge=1)]
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
    supply: SupplyCorrection | None = None
    """Correction for the supply voltage, if it is measured."""

    def __post_init__(self) -> None:
        for name in ("proportional", "integral", "feed_forward"):
            if not 0 <= getattr(self, name) <= LARGEST_GAIN:
                raise RuleError(f"{name} is {getattr(self, name)}, expected 0 to {LARGEST_GAIN}")
        if self.samples & (self.samples - 1) or not 1 <= self.samples <= 16:
            raise RuleError(f"samples is {self.samples}, expected a power of two up to 16: the sum has 16 bits")
        if self.largest_current > LARGEST_ERROR:
            raise RuleError(
                f"the sensor's range is {self.largest_current} counts of current, expected at most {LARGEST_ERROR}: "
                "one and a half times the rated current of 60000 counts"
            )
        if not 1 <= self.current_gain <= 65535 or not 1 <= self.current_shift <= 15:
            raise RuleError(f"the gain of the current is {self.current_gain} over 2^{self.current_shift}")
        if self.integral_limit << self.gain_shift > 65535 * 8192:
            raise RuleError("the integral's limit and the gains' binary places need more than 31 bits")
        if self.release > self.integral_limit:
            raise RuleError(f"release is {self.release}, expected at most the integral's limit {self.integral_limit}")
        if self.offset_nominal + self.offset_tolerance > 65535:
            raise RuleError("the offset's tolerance reaches past the end of the sum")
        if not 0 < self.open_sum < self.over_sum < self.short_sum <= 65535:
            raise RuleError("the sums of open load, over-current and short must rise in this order")
        for name in ("over_ticks", "open_ticks", "rate"):
            if not 1 <= getattr(self, name) <= 65535:
                raise RuleError(f"{name} is {getattr(self, name)}, expected 1 to 65535")

    @property
    def largest_current(self) -> int:
        """Counts of current of the largest sum that is no short, without an offset: beyond it the output is off."""
        return (self.short_sum * self.current_gain + (1 << (self.current_shift - 1))) >> self.current_shift
