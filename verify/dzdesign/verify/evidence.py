"""Evidence about a firmware and about another output, declared once; stored as verification.json and evidence.json.

The checks, the exhaustive comparison and the closed loop fill these classes; the report and the terminal read them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact, Sha256, quantity
from dzdesign.core.display import DOES_NOT_HOLD, NOT_CHECKED
from dzdesign.design.design_choices import Above
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.verify.current.results import CurrentLoopResult
from dzdesign.verify.loop_results import ClosedLoopResult, Count, ScenarioResult, Side, about
from dzdesign.verify.requirements import ALWAYS, AS_STATED, CURRENT_VALVE, OF_CURRENT, RAMPS, Check

Sign = Literal[1, -1]
Names = tuple[str, ...]
#: Voltages are bounded so that no arithmetic on them overflows.
MOST_V = 1e4


def missed_in(checks: tuple[Check, ...]) -> str:
    """Return what does not hold, then what could not be checked; an empty text where everything holds."""
    missed = [check.name for check in checks if check.holds is False]
    unknown = [check.name for check in checks if check.holds is None]
    parts = [f"{DOES_NOT_HOLD}: {', '.join(missed)}"] if missed else []
    return "; ".join([*parts, *([f"{NOT_CHECKED}: {', '.join(unknown)}"] if unknown else [])])


@dataclass(frozen=True, slots=True, kw_only=True)
class LotCheck:
    """Check of a lot setting, for one sign of the command, against the bounds of every valve of its lot."""

    valves: Annotated[Count, about("Number of valves that were compared.")]
    over_compensated: Annotated[
        Names, about("Names of the valves whose drive at zero command exceeds their bound, the worst first.")
    ]
    worst: Annotated[str, about("Name of the valve with the smallest margin.")]
    worst_dp_MPa: Annotated[
        float, quantity("MPa", "Pressure drop at which that valve has the smallest margin.", ge=-1000, le=1000)
    ]
    smallest_margin_V: Annotated[
        float, quantity("V", "Smallest margin; negative if the bound is exceeded.", ge=-MOST_V, le=MOST_V)
    ]
    confidence: Annotated[tuple[float, float], about("Lowest and highest joint confidence level of a valve's bounds.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class AboveCheck:
    """Check of the drive at zero command above the tested pressure drops; every count must be zero."""

    choice: Above
    """Choice of `design --above`."""
    certified_to_MPa: Annotated[float, quantity("MPa", ge=0, le=1000)] | None
    """Pressure drop up to which the drive is certified; null if nothing is certified above the tests."""
    released_from_MPa: Annotated[float, quantity("MPa", ge=0, le=1000)] | None
    """Pressure drop from which the offset is released; null if it is not released."""
    codes: Count
    """Number of pressure-difference codes above the tests."""
    over_compensated: Count
    """Number of certified codes whose drive lies above the continued bound."""
    smallest_margin_V: Annotated[float, quantity("V", ge=-MOST_V, le=MOST_V)] | None
    """Smallest margin of a drive above zero below that bound."""
    rising: Count
    """Number of codes with more drive than the certified offset of the last test."""
    not_released: Count
    """Number of codes with more than one unit of beta where the offset is released."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCounts:
    """Counts of a machine that tries every input of one side, or a sample of them."""

    inputs: Annotated[
        Count, about("Number of pairs of command code and pressure-difference code, each compared with the exact law.")
    ]
    wrong: Annotated[
        Count, about("Number of pairs at which dz_comp() or the drive does not give the exactly rounded law.")
    ]
    largest_error: Annotated[
        int, quantity("compare counts", "Largest difference from the exactly rounded law.", ge=0, le=2**32)
    ]
    out_of_range: Annotated[Count, about("Number of compare values above the limit.")]
    not_monotone_in_u: Annotated[Count, about("Number of decreases with rising command.")]
    not_monotone_in_dp: Annotated[
        Count, about("Number of steps over the pressure difference against the direction of the law.")
    ]
    odd_pairs: Annotated[
        Count, about("Number of pairs of pressure codes whose result differs from that of their difference.")
    ]
    bad_fallbacks: Annotated[
        Count, about("Number of codes outside their signal's valid range that do not give the safe value.")
    ]
    bad_status: Annotated[Count, about("Number of wrong status words.")]
    bad_betas: Annotated[Count, about("Number of pairs of pressure codes at which dz_beta() differs from the law.")]
    calls: Annotated[Count, about("Total number of calls of the core.")]

    @property
    def faults(self) -> int:
        """All that must be none, together."""
        counts = (self.wrong, self.out_of_range, self.not_monotone_in_u, self.not_monotone_in_dp, self.odd_pairs)
        return sum(counts) + self.bad_fallbacks + self.bad_status + self.bad_betas


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCheck(InputCounts):
    """Check of every input of one side; every count of faults must be zero."""

    sign: Sign
    """Sign of the command."""
    side: Side
    """Side of the valve that these commands drive."""
    over_compensated: Count
    """Number of pressure codes in the certified interval whose drive at zero command lies above the bound."""
    smallest_margin_V: Annotated[float, quantity("V", ge=-MOST_V, le=MOST_V)]
    """Smallest margin of the drive at zero command below the bound."""
    core_sha256: Sha256
    """SHA-256 of the compiled C source."""
    object_sha256: Sha256
    """SHA-256 of the object code that was tried."""
    outputs_hash: Annotated[str, Meta(pattern="^[0-9a-f]{16}$", max_length=16)]
    """Hash of all compare values in order; it is the same on every processor."""
    pressure_pairs: Count
    """Number of pairs of valid pressure codes, all of which were tried."""
    first_wrong: str | None
    """First fault, in words."""
    above: AboveCheck
    """Check above the tested pressure drops."""
    lot: LotCheck | None
    """For a lot setting, the check of every valve against its own bounds; null for a single valve."""

    @property
    def holds(self) -> bool:
        """True if nothing was found."""
        above = self.above.over_compensated + self.above.rising + self.above.not_released
        return self.faults + self.over_compensated + above == 0 and not (self.lot and self.lot.over_compensated)


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence(Artefact):
    """The evidence about one firmware, as `dzdesign verify` writes it."""

    FILE_NAME: ClassVar[str] = "verification.json"
    schema: Literal["dzdesign.evidence/1"] = "dzdesign.evidence/1"
    """Name and version of this schema."""
    target: str
    """Microcontroller of the firmware."""
    changed_board_files: Names
    """Board files that were changed since generation and that did not run on the model of the device."""
    user_files: Names
    """Source and project files in the user's folder board/ that did not run on the model of the device."""
    differing_files: Mapping[str, Sha256]
    """SHA-256, as verified, of every file that differs from the firmware's manifest or is missing from it."""
    board_not_compiled: str
    """Reason why the changed board files were not compiled; empty if they were, or none was changed."""
    holds: bool = field(init=False)
    """Whether every requirement holds. One that could not be checked does not hold."""
    checks: Annotated[tuple[Check, ...], Meta(min_length=1)]
    """Result of every requirement that was checked."""
    inputs: tuple[InputCheck, ...]
    """Check of all inputs of each side; empty if the core did not compile or the check could not run."""
    closed_loop: ClosedLoopResult
    """Result of the ramps in closed loop with the generated C."""
    scenarios: tuple[ScenarioResult, ...]
    """Results of the scenarios in closed loop, other than ramps."""
    current_loop: CurrentLoopResult | None
    """Current loop of a current-controlled drive; null for a duty-controlled one, or if it did not run."""
    not_covered: Names = ()
    """What the verdict does not cover, such as an identified side that the output does not drive."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(check.holds for check in self.all_checks))

    @property
    def all_checks(self) -> tuple[Check, ...]:
        """All checks. What every run tries and is absent here counts as not checked, unless a failure explains it."""
        if any(check.holds is False for check in self.checks):
            return self.checks
        tried = {check.id for check in self.checks}
        text = "the evidence has no check of it; run `dzdesign verify` again"
        needed = ALWAYS if self.current_loop is None else (*ALWAYS, *OF_CURRENT, CURRENT_VALVE)
        return (*self.checks, *(each.check(holds=None, text=text) for each in needed if each.id not in tried))

    @property
    def verdict(self) -> str:
        """The verdict in one sentence: what does not hold, then what could not be checked."""
        return missed_in(self.all_checks) or "Every requirement holds."

    @property
    def reservation(self) -> str:
        """What a good verdict does not cover, as part of its sentence: a side, or thresholds without ramp tests.

        For a lot setting, the recordings belong to one of its valves.
        """
        others = max((each.lot.valves for each in self.inputs if each.lot), default=1) - 1
        compared = any(check.id == RAMPS.id and check.holds for check in self.checks)
        stated = AS_STATED if not compared else f"of the lot's other {others} valves {AS_STATED}" if others else ""
        return "; ".join(filter(None, [stated, *self.not_covered]))


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
        if missed := missed_in(self.checks):
            return missed
        stated = [] if any(check.id == RAMPS.id for check in self.checks) else [AS_STATED]
        return "; ".join(["Every requirement holds", *stated, *self.not_covered]) + "."
