"""`Reproduction`: the paper's numbers beside ours, the artefact reproduction.json. `dzdesign reproduce` fills it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact, quantity
from dzdesign.verify.closed_loop.simulated_recordings import Bench

#: Larger than any number here; bounds in a file keep arithmetic from overflowing.
LARGEST = 1e12
Number = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]
Hash = Annotated[str, Meta(pattern="^[0-9a-f]{64}$", max_length=64)]
#: Bare valve, the paper's law, or the whole product.
Driver = Literal["valve", "paper's law", "product"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Our number for one of the paper's, one way."""

    by: Annotated[Driver, Meta(description="Bare valve, the paper's law, or the whole product.")]
    value: Annotated[Number | None, Meta(description="In the number's unit; null: not compared.")]
    difference: Annotated[Number | None, Meta(description="Ours less the printed one; null: no number is printed.")]
    allowed: Annotated[tuple[Number, Number] | None, Meta(description="Range required of it; null: none.")]
    holds: Annotated[bool | None, Meta(description="Whether it lies in the range; null: nothing is required.")] = field(
        init=False
    )

    def __post_init__(self) -> None:
        holds = None
        if self.allowed is not None and self.value is not None:
            holds = self.allowed[0] <= self.value <= self.allowed[1]
        object.__setattr__(self, "holds", holds)


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperNumber:
    """One number of the paper, and ours."""

    valve: Annotated[str, Meta(description="Valve of the paper.")]
    quantity: Annotated[str, Meta(description='What it is; "without" and "with" are of the compensator.')]
    unit: Annotated[str, Meta(description="Of all values here.")]
    dp_MPa: Annotated[float | None, quantity("MPa", "Pressure drop.")]
    published: Annotated[str, Meta(description="As printed.")]
    in_fit: Annotated[
        bool, Meta(description="Whether it went into the fit of the valve's parameters; else ours is a prediction.")
    ]
    outcomes: Annotated[
        tuple[Outcome, ...], Meta(description="Of the bare valve; or of the paper's law and of the product.")
    ]
    tolerance: Annotated[str, Meta(description="Why the ranges are so wide; empty where nothing is required.")]
    why: Annotated[str, Meta(description="Where ours differs, or need not agree: why.")]
    holds: Annotated[
        bool | None, Meta(description="Whether every requirement of it holds; null: there is none.")
    ] = field(init=False)

    def __post_init__(self) -> None:
        required = [outcome.holds for outcome in self.outcomes if outcome.holds is not None]
        object.__setattr__(self, "holds", all(required) if required else None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter of the plant."""

    value: Annotated[Number, Meta(description="In the unit that its name ends in.")]
    recovered: Annotated[bool, Meta(description="Whether the fit found it.")]
    origin: Annotated[str, Meta(description="Where it is from.")]
    rounding: Annotated[
        Number | None, Meta(description="By how much it may be off for the rounding of the printed figures.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedFigure:
    """A printed figure that went into a fit."""

    name: Annotated[str, Meta(description="What it is.")]
    unit: Annotated[str, Meta(description="Of the figure.")]
    published: Annotated[str, Meta(description="As printed.")]
    fitted: Annotated[Number, Meta(description="What the fit gives.")]
    misfit: Annotated[Number, Meta(description="Distance over half a unit of the last printed digit.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hashes:
    """SHA-256 of what was made of the valve."""

    ramp_tests: Annotated[Mapping[str, Hash], Meta(description="File name -> hash of a simulated ramp test.")]
    valve_json: Annotated[Hash, Meta(description="Of valve.json.")]
    compensator_json: Annotated[Hash, Meta(description="Of compensator.json.")]
    core: Annotated[Mapping[str, Hash], Meta(description="File name -> hash of the core's C.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproducedValve:
    """A valve of the paper: its recovered plant, and what the product made of it."""

    valve: Annotated[str, Meta(description="Its name.")]
    parameters: Annotated[Mapping[str, Parameter], Meta(description="Name of a plant's parameter -> parameter.")]
    fitted_to: Annotated[tuple[FittedFigure, ...], Meta(description="The printed figures that the fit used.")]
    at_bound: Annotated[tuple[str, ...], Meta(description="Parameters that a bound of the fit holds.")]
    level_L_min: Annotated[float, quantity("L/min", "Flow from which on the paper sees flow.", ge=0, le=1e6)]
    bench: Annotated[Bench, Meta(description="The simulated bench.")]
    sha256: Annotated[Hashes, Meta(description="What was made of the valve.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction(Artefact):
    """Every number of the paper beside ours, as `dzdesign reproduce` writes it."""

    FILE_NAME: ClassVar[str] = "reproduction.json"
    schema: Annotated[Literal["dzdesign.reproduction/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.reproduction/1"
    )
    paper: Annotated[str, Meta(description="Its DOI.", pattern="^10[.]")]
    holds: Annotated[bool, Meta(description="Whether every number that must agree does.")] = field(init=False)
    numbers: Annotated[tuple[PaperNumber, ...], Meta(description="In the order of the paper.", min_length=1)]
    valves: Annotated[tuple[ReproducedValve, ...], Meta(description="In the order of the paper.")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(number.holds is not False for number in self.numbers))
