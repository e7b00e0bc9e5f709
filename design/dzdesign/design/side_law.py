"""The law of one sign of command, and what is proved about its offset: what `Compensator` is made of."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.design.machine.budget import Budget
from dzdesign.identify.valve.guard_curve import Guard

Node = Annotated[int, Meta(ge=1, le=2**31)]


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
    """The law of each sign of command."""

    positive: SideLaw
    """Law for positive commands."""
    negative: SideLaw | None = None
    """Law for negative commands; null for a valve with one solenoid."""
