"""The law of one sign of command, its certificate and its uncertainty budget: what `Compensator` is made of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.guard_curve import Guard
from dzdesign.identify.valve.model import ValveModel

Node = Annotated[int, Meta(ge=1, le=2**31)]
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
    "pressure sensor C",
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
class Certificate:
    """Proved statements about the offset of one side, on the integers, at every pressure code of the interval."""

    confidence: Annotated[float, quantity("1", ge=0.5, le=1)]
    """Joint confidence level of the threshold's lower bounds."""
    guard: Guard
    """Threshold that the bounds protect."""
    level_L_min: Annotated[float, quantity("L/min", ge=0, le=1000000.0)]
    """Smallest flow at the bounds that the meter, or readings by hand, would have shown."""
    zero_flow_L_min: Annotated[float, quantity("L/min", ge=0, le=1000000.0)] | None
    """Flow at zero command, leak included, that the bounds allow: the declared zero flow, or the sum of leak and noise
    level. Null: none was declared, and no flow above `level_L_min` is allowed."""
    dp_MPa: Annotated[tuple[Fraction, Fraction], quantity("MPa")]
    """Interval of the pressure drop that the certificate covers."""
    holds_to_MPa: Annotated[Fraction, quantity("MPa")]
    """Pressure drop up to which the certificate also holds if the curve's premise holds above the tests. It is the end
    of `dp_MPa` if nothing is certified above."""
    released_from_MPa: Annotated[Fraction | None, quantity("MPa")]
    """Pressure drop from which the offset is released. Beta is one unit of the table there, so the dead zone returns.
    Null: nowhere in the sensors' range."""
    smallest_margin_V: Annotated[Fraction, quantity("V")]
    """Smallest margin of the offset below the lower bound, over all codes of the interval."""
    mean_loss_V: Annotated[float, quantity("V", ge=-1000000.0, le=1000000.0)]
    """Mean distance of the table's offset below the certified curve. It comes from the few nodes, the rounding of
    pressures and drive, and the dither."""
    largest_loss_V: Annotated[float, quantity("V", ge=-1000000.0, le=1000000.0)]
    """Largest distance of the table's offset below the certified curve."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class SideLaw:
    """The law for one sign of the command."""

    drive_range_over_u_max: Annotated[Fraction, quantity("1")]
    """Ratio k x_max / u_max of the law: command range from its u_min0 to full output, over full command. In valve.json
    the range starts at the knee."""
    u_min0_over_u_max: Annotated[Fraction, quantity("1")]
    """Threshold u_min0 of the law at dP0, over full command. It is the offset. With a transition it is the opening
    threshold plus three standard errors: the law's line, extended to zero command."""
    beta: tuple[Node, ...]
    """Certified nodes of beta at zero command, as numerators over `beta_denominator`. They lie at pressure codes 0,
    `beta_step_codes`, 2 `beta_step_codes` and so on, with linear interpolation between them."""
    transition_beta: tuple[Node, ...] | None = None
    """Nodes of the opening threshold's beta, which the law follows after the transition. None lies below the certified
    node. Empty without a transition."""
    certificate: Certificate
    """Certificate of the offset."""
    budget: Budget | None = None
    """Uncertainty budget: the components that keep the offset below the identified threshold."""

    @property
    def start(self) -> str:
        """Meaning of `u_min0` in words; with a transition the certified offset lies below it."""
        if self.transition_beta is None:
            return "the certified offset"
        return "the opening threshold plus three standard errors"

    def __post_init__(self) -> None:
        if not 0 < self.u_min0_over_u_max < 1:
            raise RuleError(f"u_min0 is {float(self.u_min0_over_u_max):.3f} of u_max, expected between 0 and 1")
        if not 0 < self.drive_range_over_u_max <= 10**3:
            raise RuleError("k x_max/u_max must be positive")
        if self.transition_beta is not None:
            if len(self.transition_beta) != len(self.beta):
                raise RuleError("the transition's beta must have as many nodes as the certified one")
            if any(upper < lower for upper, lower in zip(self.transition_beta, self.beta, strict=True)):
                raise RuleError(
                    "the transition's beta lies below the certified one, expected the opening threshold above"
                )

    @property
    def law_beta(self) -> tuple[int, ...]:
        """Nodes of the beta that the law follows after the transition; without a transition, the certified beta."""
        return self.beta if self.transition_beta is None else self.transition_beta


@dataclass(frozen=True, slots=True, kw_only=True)
class Sides:
    """The law of each side of the valve that is driven."""

    positive: SideLaw | None = None
    """Law of the positive side; null for a valve tested with negative commands alone."""
    negative: SideLaw | None = None
    """Law of the negative side; null where only the positive one is driven. Where it stands alone, commands from zero
    to full drive it."""

    @classmethod
    def of(cls, valve: ValveModel, laws: Mapping[int, SideLaw]) -> "Sides":
        """Return the laws of a valve's sides, given by the sign of the commands that drive them."""
        return cls(**{valve.side_name(sign): side for sign, side in laws.items()})
