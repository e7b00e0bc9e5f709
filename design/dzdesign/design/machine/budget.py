"""`Budget`: what lowers the offset under the identified threshold, in the form of the GUM (JCGM 100), of one side.

Component, origin, half-width, sensitivity, contribution. All of it is systematic and one-sided: nothing averages out,
so nothing is added in squares. The drive, oil and ageing multiply, the pressures' half-widths add before the least
bound over them is taken, and the counts of the drive are subtracted last.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from dzdesign.core.artefact_types import RuleError, quantity

#: How the contributions add, for a person.
ADDED_IN_FULL = (
    "systematic and one-sided, so added in full: half-widths of the pressures add up before the least bound over them "
    "is taken, drive, oil and ageing multiply it, counts and the current's rest are subtracted last"
)
Origin = Literal["measured", "declared", "default"]
#: Components, in the order of the table.
Component = Literal[
    "recording",
    "bench pressure drop",
    "pressure sensor A",
    "pressure sensor B",
    "pressure converter offset",
    "pressure converter gain",
    "pressure converter noise",
    "coil temperature",
    "supply",
    "amplifier",
    "current",
    "current's rest",
    "bench current",
    "oil",
    "ageing",
    "rounding of pressures",
    "rounding of the drive",
    "dither",
]
#: Of a number in mV: below every error here.
DIGITS_mV = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetLine:
    """One component of an uncertainty budget."""

    component: Component
    """Source of the uncertainty."""
    origin: Origin
    """Whether the half-width was measured from the recordings, declared, or set by default."""
    source: str
    """Option or default from which the half-width was taken."""
    half_width: float
    """Half-width of the uncertainty, in `unit`. For a range, the end that lowers the offset."""
    unit: str
    """Unit of the half-width: mV, MPa, codes, counts, K, V or %."""
    sensitivity_mV: Annotated[tuple[float, ...], quantity("mV")]
    """Contribution per unit of the half-width, at each tested pressure drop."""
    contribution_mV: Annotated[tuple[float, ...], quantity("mV")]
    """Amount by which this component alone lowers the certified threshold where the sensors read a tested pressure
    drop."""
    price: Annotated[float, quantity("1")]
    """Price of this component in dead zone, over full command. It is the rise of the offset if this component alone
    were zero, at the tested pressure drop where the rise is largest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Uncertainty budget of one side, at its tested pressure drops."""

    dp_MPa: Annotated[tuple[float, ...], quantity("MPa")]
    """Tested pressure drops."""
    threshold_V: Annotated[tuple[float, ...], quantity("V")]
    """Guarded threshold at each tested pressure drop, as recorded."""
    ceiling_V: Annotated[tuple[float, ...], quantity("V")]
    """Largest offset at each that the certificate allows: the threshold minus the whole budget."""
    lines: tuple[BudgetLine, ...]
    """Components of the budget."""

    def __post_init__(self) -> None:
        tables: list[Sequence[float]] = [self.threshold_V, self.ceiling_V]
        tables += [each for line in self.lines for each in (line.sensitivity_mV, line.contribution_mV)]
        if any(len(each) != len(self.dp_MPa) for each in tables):
            raise RuleError(f"the budget's columns are not of its {len(self.dp_MPa)} pressure drops")

    @property
    def combined_mV(self) -> tuple[float, ...]:
        """What all components together take from the threshold at each tested pressure drop."""
        pairs = zip(self.threshold_V, self.ceiling_V, strict=True)
        return tuple(round(1e3 * (threshold - ceiling), DIGITS_mV) for threshold, ceiling in pairs)

    def line(self, component: Component) -> BudgetLine | None:
        """Return a component's line; None where it does not count."""
        return next((line for line in self.lines if line.component == component), None)

    @property
    def largest(self) -> BudgetLine:
        """The component that costs most."""
        return max(self.lines, key=lambda line: line.price)
