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


#: How a printed number stands to ours: it went into the fit; ours is a prediction; it is taken over as it is; or the
#: paper has words and no digits, and nothing can agree.
Kind = Literal["fitted", "predicted", "given", "in words"]
Range = tuple[Number, Number]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Our number for one of the paper's, one way."""

    by: Annotated[Driver, Meta(description="Bare valve, the paper's law, or the whole product.")]
    hysteresis_V: Annotated[float, quantity("V", "Hysteresis that is assumed of the valve.", ge=0, le=1e6)] = 0.0
    value: Annotated[Number | None, Meta(description="In the number's unit; null: not compared.")]
    difference: Annotated[Number | None, Meta(description="Ours less the printed one; null: no number is printed.")]
    allowed: Annotated[
        Range | None, Meta(description="The printed digits and a measurement error about them; null: no digits.")
    ]
    reason: Annotated[str, Meta(description="Why it misses; empty where it agrees, or where nobody knows.")] = ""
    explained: Annotated[Range | None, Meta(description="How far the reason reaches; null: there is none.")] = None
    agrees: Annotated[bool | None, Meta(description="Whether it lies in the range; null: no digits.")] = field(
        init=False
    )
    accounted: Annotated[bool, Meta(description="Whether it agrees, or misses within what its reason explains.")] = (
        field(init=False)
    )

    def __post_init__(self) -> None:
        agrees = _within(self.value, self.allowed)
        object.__setattr__(self, "agrees", agrees)
        reasoned = bool(self.reason) and _within(self.value, self.explained) is True
        object.__setattr__(self, "accounted", agrees is not False or reasoned)


def _within(value: float | None, limits: Range | None) -> bool | None:
    return None if value is None or limits is None else limits[0] <= value <= limits[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperNumber:
    """One number of the paper, and ours."""

    valve: Annotated[str, Meta(description="Valve of the paper.")]
    quantity: Annotated[str, Meta(description='What it is; "without" and "with" are of the compensator.')]
    unit: Annotated[str, Meta(description="Of all values here.")]
    dp_MPa: Annotated[float | None, quantity("MPa", "Pressure drop.")]
    published: Annotated[str, Meta(description="As printed.")]
    kind: Annotated[
        Kind, Meta(description="Whether it went into a fit, is predicted, is taken over, or has no digits to compare.")
    ]
    outcomes: Annotated[
        tuple[Outcome, ...], Meta(description="Of the bare valve; or of the paper's law and of the product.")
    ]
    tolerance: Annotated[str, Meta(description="What the ranges are made of; empty where there are none.")]
    why: Annotated[str, Meta(description="What is to be known of the number, whether it agrees or not.")]
    agrees: Annotated[
        bool | None,
        Meta(description="Whether every outcome without an assumed hysteresis agrees; null: no digits, or given."),
    ] = field(init=False)
    holds: Annotated[
        bool | None,
        Meta(
            description="Whether each agrees, or misses for a reason that reaches so far; false too where what is "
            "given or said in words is contradicted; null: as in `agrees`."
        ),
    ] = field(init=False)

    def __post_init__(self) -> None:
        compared = [one for one in self.outcomes if one.agrees is not None]
        if self.kind in ("given", "in words"):  # these can't agree, but may contradict
            compared = [one for one in compared if not one.agrees and not one.hysteresis_V]
            object.__setattr__(self, "agrees", None)
            object.__setattr__(self, "holds", False if compared else None)
            return
        plain = [one for one in compared if not one.hysteresis_V]
        object.__setattr__(self, "agrees", all(one.agrees for one in plain) if plain else None)
        object.__setattr__(self, "holds", all(one.accounted for one in compared) if compared else None)


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
    hysteresis_V: Annotated[float, quantity("V", "Hysteresis that is assumed of it.", ge=0, le=1e6)]
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
    holds: Annotated[
        bool, Meta(description="Whether every number agrees, or is missed for a reason that reaches so far.")
    ] = field(init=False)
    assumptions: Annotated[tuple[str, ...], Meta(description="What the paper does not say and this takes for granted.")]
    numbers: Annotated[tuple[PaperNumber, ...], Meta(description="In the order of the paper.", min_length=1)]
    valves: Annotated[tuple[ReproducedValve, ...], Meta(description="In the order of the paper.")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(number.holds is not False for number in self.numbers))
