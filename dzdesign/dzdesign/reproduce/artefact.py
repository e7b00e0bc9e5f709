"""`Reproduction`: the paper's numbers against its law, and the product on its valves: reproduction.json."""

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
Range = tuple[Number, Number]


@dataclass(frozen=True, slots=True, kw_only=True)
class LawNumber:
    """One number of the paper that the paper's law predicts from the paper's other numbers."""

    valve: str
    """Valve of the paper to which the number belongs."""
    quantity: str
    """Quantity; "without" and "with" refer to the compensator."""
    unit: str
    """Unit of all values of this number."""
    dp_MPa: Annotated[float, quantity("MPa")]
    """Pressure drop of the number."""
    published: str
    """Number as printed."""
    value: Number
    """Value that the law states."""
    range: Range
    """Range of that value over the rounding of all printed numbers that it follows from."""
    allowed: Range
    """Range that the printed digits and a stated measurement error allow."""
    tolerance: str
    """Components of the allowed range."""
    agrees: bool
    """Whether the two ranges meet."""
    reason: str
    """Reason for a miss; empty if it agrees."""
    contradiction: bool
    """Whether the miss shows that the paper contradicts itself."""
    holds: bool = field(init=False)
    """Whether the number agrees or its miss has a reason."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", self.agrees or bool(self.reason))


@dataclass(frozen=True, slots=True, kw_only=True)
class ProductResult:
    """The product on a recovered valve of the paper at one pressure drop, dead zones in percent of full command."""

    valve: str
    """Valve of the paper."""
    dp_MPa: Annotated[float, quantity("MPa")]
    """Pressure drop."""
    published_without: str
    """Dead zone without compensator, as printed; the valve was recovered from it."""
    without: Number
    """Dead zone without compensator in the closed loop."""
    published: str
    """Dead zone that the paper prints with its compensator."""
    dead_zone: Number
    """Dead zone with the product."""
    ideal_line: Number
    """Dead zone of a straight line from zero command to the largest flow."""
    published_zero: str
    """Flow at zero command that the paper prints without beta, L/min; empty if it prints none."""
    zero_L_min: Annotated[float, quantity("L/min", ge=-LARGEST, le=LARGEST)]
    """Flow at zero command with the product, L/min."""
    zero_without_beta_L_min: Annotated[float, quantity("L/min", ge=-LARGEST, le=LARGEST)]
    """Flow at zero command with the product if beta is ignored, L/min."""
    published_largest: str
    """Largest flow without compensator, as printed, L/min."""
    largest_L_min: Annotated[float, quantity("L/min", ge=-LARGEST, le=LARGEST)]
    """Largest flow with the product, L/min."""
    faults: tuple[str, ...]
    """What is not as it must be; empty if all is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RejectedReading:
    """A reading of the paper that was tried, and the printed number that rules it out."""

    reading: str
    """Reading of the paper."""
    valve: str
    """Valve of the number."""
    quantity: str
    """Quantity of the number."""
    unit: str
    """Unit of all values of this number."""
    published: str
    """Number as printed."""
    value: Number
    """Value that the reading gives."""
    range: Range
    """Range of that value over the rounding of what it follows from."""
    allowed: Range
    """Range that the printed digits and a stated measurement error allow."""
    holds: bool = field(init=False)
    """Whether the two ranges are apart, so that the reading is ruled out."""

    def __post_init__(self) -> None:
        apart = self.range[0] > self.allowed[1] or self.range[1] < self.allowed[0]
        object.__setattr__(self, "holds", apart)


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
    bench: Bench
    """Simulated bench."""
    sha256: Hashes
    """Hashes of the files made from this valve."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction(Artefact):
    """The paper's numbers in three tables, as `dzdesign reproduce` writes them."""

    FILE_NAME: ClassVar[str] = "reproduction.json"
    schema: Literal["dzdesign.reproduction/1"] = "dzdesign.reproduction/1"
    """Name and version of this schema."""
    paper: Annotated[str, Meta(pattern="^10[.]")]
    """DOI of the paper."""
    holds: bool = field(init=False)
    """Whether every number of the law agrees or has its reason, the product has no fault, and every rejected reading is
    ruled out."""
    given: str
    """Printed numbers that the others are predicted from."""
    hypotheses: tuple[str, ...]
    """What is assumed where the paper leaves it open, one each."""
    law: Annotated[tuple[LawNumber, ...], Meta(min_length=1)]
    """(A): the paper's numbers against the paper's law."""
    product: Annotated[tuple[ProductResult, ...], Meta(min_length=1)]
    """(B): the product on the same valves."""
    rejected: tuple[RejectedReading, ...]
    """(C): readings that were tried and rejected."""
    valves: tuple[ReproducedValve, ...]
    """Valves in the order of the paper."""

    def __post_init__(self) -> None:
        argued = all(each.holds for each in self.law) and all(each.holds for each in self.rejected)
        object.__setattr__(self, "holds", argued and not any(each.faults for each in self.product))
