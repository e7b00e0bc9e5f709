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
#: Bare valve, or the whole product on it.
Driver = Literal["valve", "product"]
#: How a printed number stands to ours: it went into the fit, or ours is a prediction.
Kind = Literal["fitted", "predicted"]
Range = tuple[Number, Number]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperNumber:
    """One number of the paper, beside that of dzdesign."""

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
    """Whether the number was used in a fit or is predicted."""
    by: Driver
    """Source of the value: the bare valve, or the whole product on it."""
    value: Number
    """Value of dzdesign."""
    difference: Number | None
    """Value of dzdesign minus the printed one; null if no number is printed."""
    ideal_line: Number | None
    """Value of an ideal line from zero command to the largest flow, for a dead zone with compensator."""
    allowed: Range
    """Range that the printed digits and a measurement error allow."""
    tolerance: str
    """Components of the allowed range."""
    reason: str
    """Reason for a value outside the range; empty if it agrees or the reason is unknown."""
    explained: Range | None
    """Range that the reason explains; null if there is no reason."""
    why: str
    """Background of the number, whether it agrees or not."""
    agrees: bool = field(init=False)
    """Whether the value lies in the allowed range."""
    holds: bool = field(init=False)
    """Whether the value agrees or misses by no more than its reason explains."""

    def __post_init__(self) -> None:
        agrees = self.allowed[0] <= self.value <= self.allowed[1]
        low, high = self.explained or (1.0, 0.0)
        object.__setattr__(self, "agrees", agrees)
        object.__setattr__(self, "holds", agrees or (bool(self.reason) and low <= self.value <= high))


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter of the plant."""

    value: Number
    """Value, in the unit at the end of the parameter's name."""
    origin: str
    """Origin of the value."""
    rounding: Number | None
    """Uncertainty of a recovered value by rounding of the printed figures; null if it is not recovered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hashes:
    """SHA-256 of the files made from the valve."""

    ramp_tests: Mapping[str, Hash]
    """SHA-256 of each simulated ramp test, by file name."""
    valve_json: Hash
    """SHA-256 of valve.json."""
    compensator_json: Hash
    """SHA-256 of compensator.json."""
    core: Mapping[str, Hash]
    """SHA-256 of each C file of the core, by file name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproducedValve:
    """A valve of the paper: its recovered plant, and the files made from it."""

    valve: str
    """Name of the valve."""
    parameters: Mapping[str, Parameter]
    """Parameters of the plant, by name."""
    level_L_min: Annotated[float, quantity("L/min", ge=0, le=1e6)]
    """Smallest flow that counts as flow in the paper."""
    bench: Bench
    """Simulated bench."""
    sha256: Hashes
    """Hashes of the files made from this valve."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction(Artefact):
    """Every number of the paper beside that of dzdesign, as `dzdesign reproduce` writes it."""

    FILE_NAME: ClassVar[str] = "reproduction.json"
    schema: Literal["dzdesign.reproduction/1"] = "dzdesign.reproduction/1"
    """Name and version of this schema."""
    paper: Annotated[str, Meta(pattern="^10[.]")]
    """DOI of the paper."""
    holds: bool = field(init=False)
    """Whether every number agrees or misses by no more than its reason explains."""
    assumptions: tuple[str, ...]
    """Assumptions that the paper does not state."""
    numbers: Annotated[tuple[PaperNumber, ...], Meta(min_length=1)]
    """Numbers in the order of the paper."""
    valves: tuple[ReproducedValve, ...]
    """Valves in the order of the paper."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(number.holds for number in self.numbers))
