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
    """One value of dzdesign for a number of the paper."""

    by: Driver
    """Source of the value: the bare valve, the paper's law, or the whole product."""
    hysteresis_V: Annotated[float, quantity("V", ge=0, le=1e6)] = 0.0
    """Assumed hysteresis of the valve."""
    value: Number | None
    """Value of dzdesign, in the number's unit; null if it is not compared."""
    difference: Number | None
    """Value of dzdesign minus the printed one; null if no number is printed."""
    allowed: Range | None
    """Range that the printed digits and a measurement error allow; null if there are no digits."""
    reason: str = ""
    """Reason for a value outside the range; empty if it agrees or the reason is unknown."""
    explained: Range | None = None
    """Range that the reason explains; null if there is no reason."""
    agrees: bool | None = field(init=False)
    """Whether the value lies in the allowed range; null if there are no digits."""
    accounted: bool = field(init=False)
    """Whether the value agrees, or misses by no more than its reason explains."""

    def __post_init__(self) -> None:
        agrees = _within(self.value, self.allowed)
        object.__setattr__(self, "agrees", agrees)
        reasoned = bool(self.reason) and _within(self.value, self.explained) is True
        object.__setattr__(self, "accounted", agrees is not False or reasoned)


def _within(value: float | None, limits: Range | None) -> bool | None:
    return None if value is None or limits is None else limits[0] <= value <= limits[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperNumber:
    """One number of the paper, beside the values of dzdesign."""

    valve: str
    """Valve of the paper to which the number belongs."""
    quantity: str
    """Quantity; "without" and "with" refer to the compensator."""
    unit: str
    """Unit of all values of this number."""
    dp_MPa: Annotated[float | None, quantity("MPa")]
    """Pressure drop of the number."""
    published: str
    """Number as printed."""
    kind: Kind
    """Whether the number was used in a fit, is predicted, is taken from the paper, or has no digits to compare."""
    outcomes: tuple[Outcome, ...]
    """Values of the bare valve, or of the paper's law and the product."""
    tolerance: str
    """Components of the allowed ranges; empty if there are none."""
    why: str
    """Background of the number, whether it agrees or not."""
    agrees: bool | None = field(init=False)
    """Whether every outcome without an assumed hysteresis agrees; null if the number has no digits or is given."""
    holds: bool | None = field(init=False)
    """Whether each outcome agrees or misses by no more than its reason explains. It is also false if a given number or
    a statement in words is contradicted. Null as for `agrees`."""

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

    value: Annotated[Number, Meta(description="Value, in the unit at the end of the parameter's name.")]
    recovered: Annotated[bool, Meta(description="Whether the value was found by the fit.")]
    origin: Annotated[str, Meta(description="Origin of the value.")]
    rounding: Annotated[Number | None, Meta(description="Uncertainty of the value by rounding of the printed figures.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedFigure:
    """A printed figure that was used in a fit."""

    name: Annotated[str, Meta(description="Name of the figure.")]
    unit: Annotated[str, Meta(description="Unit of the figure.")]
    published: Annotated[str, Meta(description="Figure as printed.")]
    fitted: Annotated[Number, Meta(description="Figure that the fit gives.")]
    misfit: Annotated[Number, Meta(description="Deviation over half a unit of the last printed digit.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hashes:
    """SHA-256 of the files made from the valve."""

    ramp_tests: Annotated[Mapping[str, Hash], Meta(description="SHA-256 of each simulated ramp test, by file name.")]
    valve_json: Annotated[Hash, Meta(description="SHA-256 of valve.json.")]
    compensator_json: Annotated[Hash, Meta(description="SHA-256 of compensator.json.")]
    core: Annotated[Mapping[str, Hash], Meta(description="SHA-256 of each C file of the core, by file name.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproducedValve:
    """A valve of the paper: its recovered plant, and the files made from it."""

    valve: Annotated[str, Meta(description="Name of the valve.")]
    hysteresis_V: Annotated[float, quantity("V", "Assumed hysteresis of the valve.", ge=0, le=1e6)]
    parameters: Annotated[Mapping[str, Parameter], Meta(description="Parameters of the plant, by name.")]
    fitted_to: Annotated[tuple[FittedFigure, ...], Meta(description="Printed figures that the fit used.")]
    at_bound: Annotated[tuple[str, ...], Meta(description="Parameters that lie at a bound of the fit.")]
    level_L_min: Annotated[float, quantity("L/min", "Smallest flow that counts as flow in the paper.", ge=0, le=1e6)]
    bench: Annotated[Bench, Meta(description="Simulated bench.")]
    sha256: Annotated[Hashes, Meta(description="Hashes of the files made from this valve.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction(Artefact):
    """Every number of the paper beside that of dzdesign, as `dzdesign reproduce` writes it."""

    FILE_NAME: ClassVar[str] = "reproduction.json"
    schema: Annotated[Literal["dzdesign.reproduction/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.reproduction/1"
    )
    paper: Annotated[str, Meta(description="DOI of the paper.", pattern="^10[.]")]
    holds: Annotated[
        bool, Meta(description="Whether every number agrees or misses by no more than its reason explains.")
    ] = field(init=False)
    assumptions: Annotated[tuple[str, ...], Meta(description="Assumptions that the paper does not state.")]
    numbers: Annotated[tuple[PaperNumber, ...], Meta(description="Numbers in the order of the paper.", min_length=1)]
    valves: Annotated[tuple[ReproducedValve, ...], Meta(description="Valves in the order of the paper.")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(number.holds is not False for number in self.numbers))
