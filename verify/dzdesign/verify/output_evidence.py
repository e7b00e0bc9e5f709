"""Evidence about an output that is no C firmware, declared once; ``evidence.json`` is how it is stored."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact
from dzdesign.core.verdicts import DOES_NOT_HOLD, NOT_CHECKED
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.verify.loop_results import Count, about
from dzdesign.verify.requirements import AS_STATED, RAMPS, Check


@dataclass(frozen=True, slots=True, kw_only=True)
class TriedInputs:
    """A set of inputs, each of which was given to the output and compared with the exact law."""

    name: Annotated[str, about("Which inputs: their units, and the sign of command.")]
    inputs: Annotated[Count, about("How many.")]
    wrong: Annotated[Count, about("Those whose answer is not the exactly rounded law's; must be 0.")]
    outputs_hash: Annotated[str, about("Hash of all answers, in order; empty if none was made.")] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputChecks:
    """What the room of one kind of output found."""

    checks: tuple[Check, ...]
    inputs: tuple[TriedInputs, ...] = ()
    #: Tool that a check used, to its version.
    versions: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputEvidence(Artefact):
    """The evidence about one output, as `dzdesign verify` writes it."""

    FILE_NAME: ClassVar[str] = "evidence.json"
    schema: Annotated[Literal["dzdesign.output-evidence/1"], about("Name and version of this schema.")] = (
        "dzdesign.output-evidence/1"
    )
    target: Annotated[str, about("Kind of output, as `codegen --list-targets` names it.")]
    settings: Annotated[Mapping[str, str], about("Settings of the output, as its manifest has them.")]
    origin: Annotated[FirmwareOrigin, about("Hashes of everything the output was made from.")]
    holds: Annotated[bool, about("Whether every requirement holds; one that could not be checked does not.")] = field(
        init=False
    )
    checks: Annotated[tuple[Check, ...], Meta(description="Every requirement that was tried.", min_length=1)]
    inputs: Annotated[tuple[TriedInputs, ...], about("The inputs that were tried.")]
    versions: Annotated[Mapping[str, str], about("Tool that a check used, to its version.")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(check.holds for check in self.checks))

    @property
    def verdict(self) -> str:
        """One sentence: what does not hold stands before what could not be checked."""
        missed = [check.name for check in self.checks if check.holds is False]
        unknown = [check.name for check in self.checks if check.holds is None]
        parts = [f"{DOES_NOT_HOLD}: {', '.join(missed)}"] if missed else []
        parts += [f"{NOT_CHECKED}: {', '.join(unknown)}"] if unknown else []
        words = "; ".join(parts) or "Every requirement holds."
        if parts or any(check.id == RAMPS.id for check in self.checks):
            return words
        return f"{words.removesuffix('.')}; {AS_STATED}."

    def with_checks(self, *checks: Check) -> "OutputEvidence":
        """Return the evidence with further requirements."""
        return replace(self, checks=(*self.checks, *checks))
