"""Evidence about an output other than a C firmware, declared once; ``evidence.json`` is how it is stored."""

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
    """A set of inputs, each given to the output and compared with the exact law."""

    name: Annotated[str, about("Units of the inputs and sign of the command.")]
    inputs: Annotated[Count, about("Number of inputs.")]
    wrong: Annotated[Count, about("Number of answers that are not the exactly rounded law; must be 0.")]
    outputs_hash: Annotated[str, about("Hash of all answers in order; empty if there were none.")] = ""


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
    target: Annotated[str, about("Kind of output, as listed by `codegen --list-targets`.")]
    settings: Annotated[Mapping[str, str], about("Settings of the output, as in its manifest.")]
    origin: Annotated[FirmwareOrigin, about("Hashes of all files from which the output was made.")]
    holds: Annotated[bool, about("Whether every requirement holds. One that could not be checked does not hold.")] = (
        field(init=False)
    )
    checks: Annotated[
        tuple[Check, ...], Meta(description="Result of every requirement that was checked.", min_length=1)
    ]
    inputs: Annotated[tuple[TriedInputs, ...], about("Inputs that were tried.")]
    versions: Annotated[Mapping[str, str], about("Version of each tool that a check used.")]
    not_covered: Annotated[
        tuple[str, ...],
        about("What the verdict does not cover, such as an identified side that the output does not drive."),
    ] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(check.holds for check in self.checks))

    @property
    def verdict(self) -> str:
        """One sentence: what does not hold stands before what could not be checked."""
        missed = [check.name for check in self.checks if check.holds is False]
        unknown = [check.name for check in self.checks if check.holds is None]
        parts = [f"{DOES_NOT_HOLD}: {', '.join(missed)}"] if missed else []
        parts += [f"{NOT_CHECKED}: {', '.join(unknown)}"] if unknown else []
        if parts:
            return "; ".join(parts)
        stated = [] if any(check.id == RAMPS.id for check in self.checks) else [AS_STATED]
        return "; ".join(["Every requirement holds", *stated, *self.not_covered]) + "."

    def with_checks(self, *checks: Check) -> "OutputEvidence":
        """Return the evidence with further requirements."""
        return replace(self, checks=(*self.checks, *checks))
