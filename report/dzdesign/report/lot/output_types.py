"""Outputs of a lot beside its C firmware, as types: of one valve in its manifest, of all valves in batch.json."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from msgspec import Meta

Count = Annotated[int, Meta(ge=0, le=10**15)]
Names = tuple[str, ...]
#: What came of an output of a valve.
OutputVerdict = Literal["holds", "does not hold", "not verified", "not made"]
HOLDS: Final = "holds"
DOES_NOT_HOLD: Final = "does not hold"
NOT_VERIFIED: Final = "not verified"
NOT_MADE: Final = "not made"
#: A folder stands beside what it belongs to: no path.
FolderName = Annotated[
    str, Meta(description="Folder of the output, within the folder of a valve.", pattern=r"^\w{1,40}$")
]


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveOutput:
    """Result of one output of one valve."""

    target: Annotated[str, Meta(description="Kind of output, as listed by `codegen --list-targets`.", max_length=100)]
    folder: FolderName
    verdict: Annotated[OutputVerdict, Meta(description="Result of the verification. not made: the output was refused.")]
    reason: Annotated[str, Meta(description="Reason why it was not made or does not hold, in one sentence.")] = ""
    inputs: Annotated[Count, Meta(description="Number of inputs that were compared with the exact law.")] = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LotOutput:
    """One kind of output that was requested for each valve of a lot."""

    folder: FolderName
    settings: Annotated[
        Mapping[str, str],
        Meta(description="Values of the `codegen` options that only this kind of output has, by name without hyphens."),
    ]
    holds: Annotated[Names, Meta(description="Valves whose output was verified, with every requirement met.")]
    does_not_hold: Annotated[Names, Meta(description="Valves whose output was verified, with a requirement not met.")]
    not_verified: Annotated[Names, Meta(description="Valves whose output was made but not verified.")]
    not_made: Annotated[Names, Meta(description="Valves whose output could not be made.")]

    @property
    def made(self) -> int:
        """Of how many valves it was made."""
        return len(self.holds) + len(self.does_not_hold) + len(self.not_verified)

