"""`Reproduction`: the paper's numbers beside ours, the artefact reproduction.json. `dzdesign reproduce` fills it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact, quantity
from dzdesign.verify.closed_loop.simulated_recordings import Bench
from dzdesign.verify.loop_results import about

#: Larger than any number here; bounds in a file keep arithmetic from overflowing.
LARGEST = 1e12
Number = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]
Hash = Annotated[str, Meta(pattern="^[0-9a-f]{64}$", max_length=64)]
#: Bare valve, or the whole product on it.
Driver = Literal["valve", "product"]
#: How a printed number stands to ours: it went into the fit; ours is a prediction; it is taken over as it is; or the
#: paper has words and no digits, and nothing can agree.
Kind = Literal["fitted", "predicted", "given", "in words"]
Range = tuple[Number, Number]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperNumber:
    """One number of the paper, beside that of dzdesign."""

    valve: Annotated[str, about("Valve of the paper to which the number belongs.")]
    quantity: Annotated[str, about('Quantity; "without" and "with" refer to the compensator.')]
    unit: Annotated[str, about("Unit of all values of this number.")]
    dp_MPa: Annotated[float | None, quantity("MPa", "Pressure drop of the number.")]
    published: Annotated[str, about("Number as printed.")]
    kind: Annotated[
        Kind, about("Whether the number was used in a fit, is predicted, is taken from the paper, or has no digits.")
    ]
    by: Annotated[Driver, about("Source of the value: the bare valve, or the whole product on it.")]
    value: Annotated[Number, about("Value of dzdesign.")]
    difference: Annotated[
        Number | None, about("Value of dzdesign minus the printed one; null if no number is printed.")
    ]
    ideal_line: Annotated[
        Number | None,
        about("Value of an ideal line from zero command to the largest flow, for a dead zone with compensator."),
    ]
    allowed: Annotated[
        Range | None, about("Range that the printed digits and a measurement error allow; null if there are no digits.")
    ]
    tolerance: Annotated[str, about("Components of the allowed range; empty if there are none.")]
    reason: Annotated[str, about("Reason for a value outside the range; empty if it agrees or the reason is unknown.")]
    explained: Annotated[Range | None, about("Range that the reason explains; null if there is no reason.")]
    why: Annotated[str, about("Background of the number, whether it agrees or not.")]
    agrees: Annotated[
        bool | None, about("Whether the value lies in the allowed range; null if the number has no digits or is given.")
    ] = field(init=False)
    holds: Annotated[
        bool | None,
        about(
            "Whether the value agrees or misses by no more than its reason explains. It is also false if a given "
            "number or a statement in words is contradicted. Null as for `agrees`."
        ),
    ] = field(init=False)

    def __post_init__(self) -> None:
        within = self.allowed is None or self.allowed[0] <= self.value <= self.allowed[1]
        compared = self.kind in ("fitted", "predicted")  # the others can't agree, but may contradict
        low, high = self.explained or (1.0, 0.0)
        holds = within or (bool(self.reason) and low <= self.value <= high)
        object.__setattr__(self, "agrees", within if compared else None)
        object.__setattr__(self, "holds", holds if compared or not holds else None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter of the plant."""

    value: Annotated[Number, about("Value, in the unit at the end of the parameter's name.")]
    origin: Annotated[str, about("Origin of the value.")]
    rounding: Annotated[
        Number | None,
        about("Uncertainty of a recovered value by rounding of the printed figures; null if it is not recovered."),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hashes:
    """SHA-256 of the files made from the valve."""

    ramp_tests: Annotated[Mapping[str, Hash], about("SHA-256 of each simulated ramp test, by file name.")]
    valve_json: Annotated[Hash, about("SHA-256 of valve.json.")]
    compensator_json: Annotated[Hash, about("SHA-256 of compensator.json.")]
    core: Annotated[Mapping[str, Hash], about("SHA-256 of each C file of the core, by file name.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproducedValve:
    """A valve of the paper: its recovered plant, and the files made from it."""

    valve: Annotated[str, about("Name of the valve.")]
    parameters: Annotated[Mapping[str, Parameter], about("Parameters of the plant, by name.")]
    level_L_min: Annotated[float, quantity("L/min", "Smallest flow that counts as flow in the paper.", ge=0, le=1e6)]
    bench: Annotated[Bench, about("Simulated bench.")]
    sha256: Annotated[Hashes, about("Hashes of the files made from this valve.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction(Artefact):
    """Every number of the paper beside that of dzdesign, as `dzdesign reproduce` writes it."""

    FILE_NAME: ClassVar[str] = "reproduction.json"
    schema: Annotated[Literal["dzdesign.reproduction/1"], about("Name and version of this schema.")] = (
        "dzdesign.reproduction/1"
    )
    paper: Annotated[str, Meta(description="DOI of the paper.", pattern="^10[.]")]
    holds: Annotated[bool, about("Whether every number agrees or misses by no more than its reason explains.")] = field(
        init=False
    )
    assumptions: Annotated[tuple[str, ...], about("Assumptions that the paper does not state.")]
    numbers: Annotated[tuple[PaperNumber, ...], Meta(description="Numbers in the order of the paper.", min_length=1)]
    valves: Annotated[tuple[ReproducedValve, ...], about("Valves in the order of the paper.")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(number.holds is not False for number in self.numbers))
