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
    """What is proved about the offset of one side, on the integers, at every pressure code of the interval."""

    confidence: Annotated[
        float, quantity("1", "Confidence with which the threshold's lower bounds hold together.", ge=0.5, le=1)
    ]
    guard: Annotated[Guard, Meta(description="The threshold that they bound.")]
    level_L_min: Annotated[
        float,
        quantity(
            "L/min",
            "Flow from which on a flow at the bounds would have been seen: by the meter, or by readings by hand.",
            ge=0,
            le=1e6,
        ),
    ]
    zero_flow_L_min: Annotated[
        float,
        quantity(
            "L/min",
            "Flow at zero command, a leak included, that the bounds allow: the declared zero flow, or what leak and "
            "noise level come to. Null: none was declared, and no flow above `level_L_min` is allowed.",
            ge=0,
            le=1e6,
        ),
    ] | None
    dp_MPa: Annotated[tuple[Fraction, Fraction], quantity("MPa", "Interval of the pressure drop on which it holds.")]
    holds_to_MPa: Annotated[
        Fraction,
        quantity(
            "MPa",
            "Pressure drop up to which it holds if the curve's premise holds above the tests too; the end of `dp_MPa` "
            "where nothing is certified above.",
        ),
    ]
    released_from_MPa: Annotated[
        Fraction | None,
        quantity(
            "MPa",
            "Pressure drop from which on the offset is let go: beta is one unit of the table, and the dead zone is "
            "back. Null: nowhere in the sensors' range.",
        ),
    ]
    smallest_margin_V: Annotated[
        Fraction, quantity("V", "Smallest distance from the offset to the lower bound, over all those codes.")
    ]
    mean_loss_V: Annotated[
        float,
        quantity(
            "V",
            "By how much the table's offset stays under the certified curve on average: the price of few nodes, "
            "rounding of pressures to codes and of the drive to counts, and the dither.",
            ge=-1e6,
            le=1e6,
        ),
    ]
    largest_loss_V: Annotated[float, quantity("V", "The same at most.", ge=-1e6, le=1e6)]


@dataclass(frozen=True, slots=True, kw_only=True)
class SideLaw:
    """The law of one sign of command."""

    drive_range_over_u_max: Annotated[
        Fraction,
        quantity(
            "1",
            "k x_max / u_max of the law: command from its u_min0 to full flow, over full command. In valve.json it "
            "counts from the knee.",
        ),
    ]
    u_min0_over_u_max: Annotated[
        Fraction,
        quantity(
            "1",
            "u_min0 of the law at dP0 over full command: the offset; with a transition the opening threshold and its "
            "error, from which the law's line behind the transition starts.",
        ),
    ]
    beta: Annotated[
        tuple[Node, ...],
        Meta(
            description="Nodes of beta at zero command, certified, over `beta_denominator`: at pressure codes 0, "
            "`beta_step_codes`, twice that, ...; straight between them."
        ),
    ]
    transition_beta: Annotated[
        tuple[Node, ...] | None,
        Meta(
            description="With a transition: nodes of the opening threshold's beta, that the law follows beyond it; "
            "none below the certified."
        ),
    ] = None
    certificate: Annotated[Certificate, Meta(description="What is proved.")]
    budget: Annotated[
        Budget | None,
        Meta(description="What keeps the offset under the identified threshold, component by component."),
    ] = None

    @property
    def start(self) -> str:
        """What `u_min0` is, in words; with a transition the certified offset lies lower."""
        return "the certified offset" if self.transition_beta is None else "the opening threshold"

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
        """Nodes of the beta that the law follows beyond the transition; without one the certified beta itself."""
        return self.beta if self.transition_beta is None else self.transition_beta


@dataclass(frozen=True, slots=True, kw_only=True)
class Sides:
    """The law of each sign of command."""

    positive: Annotated[SideLaw, Meta(description="Of positive commands.")]
    negative: Annotated[
        SideLaw | None, Meta(description="Of negative commands, of a valve with two solenoids; null: none.")
    ] = None
