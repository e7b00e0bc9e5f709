"""Evidence: what was found of one firmware, declared once; ``verification.json`` is how it is stored.

The checks, the exhaustive comparison and the closed loop fill these classes; the report and the terminal read them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact, Sha256, quantity
from dzdesign.core.verdicts import DOES_NOT_HOLD, NOT_CHECKED
from dzdesign.design.design_choices import Above
from dzdesign.verify.current.results import CurrentLoopResult
from dzdesign.verify.loop_results import ClosedLoopResult, Count, MonteCarlo, Population, ScenarioResult, Side, about
from dzdesign.verify.requirements import ALWAYS, AS_STATED, OF_CURRENT, RAMPS, Check

Sign = Literal[1, -1]
Names = tuple[str, ...]
#: Voltages are bounded so that no arithmetic on them overflows.
MOST_V = 1e4


@dataclass(frozen=True, slots=True, kw_only=True)
class LotCheck:
    """What one sign of command of a lot setting leaves to the bounds of every valve of its lot."""

    valves: Annotated[Count, about("How many were compared.")]
    over_compensated: Annotated[
        Names, about("Names of those driven above their bound at zero command, the worst first.")
    ]
    worst: Annotated[str, about("Name of the valve with the smallest margin.")]
    worst_dp_MPa: Annotated[float, quantity("MPa", "Pressure drop where it has it.", ge=-1000, le=1000)]
    smallest_margin_V: Annotated[
        float, quantity("V", "That margin; negative if the bound is exceeded.", ge=-MOST_V, le=MOST_V)
    ]
    confidence: Annotated[tuple[float, float], about("The least and the largest with which a valve's bounds hold.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class AboveCheck:
    """What one sign of command drives at zero command above the tested pressure drops; every count must be zero."""

    choice: Annotated[Above, about("What `design --above` chose.")]
    certified_to_MPa: Annotated[
        float, quantity("MPa", "Up to where it is certified; null: nothing is.", ge=0, le=1000)
    ] | None
    released_from_MPa: Annotated[
        float, quantity("MPa", "From where on the offset is let go; null: nowhere.", ge=0, le=1000)
    ] | None
    codes: Annotated[Count, about("Differences of pressure codes above the tests.")]
    over_compensated: Annotated[Count, about("Those of the certified ones whose drive lies above the continued bound.")]
    smallest_margin_V: Annotated[
        float, quantity("V", "Smallest distance from a drive above zero to that bound.", ge=-MOST_V, le=MOST_V)
    ] | None
    rising: Annotated[Count, about("Those with more drive than the certified offset of the last test.")]
    not_released: Annotated[Count, about("Those with more than one unit of beta where the offset is let go.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCounts:
    """What a machine counts that is given every input of one side, or a sample of them."""

    inputs: Annotated[
        Count, about("Pairs of command code and difference of pressure codes, each compared with the exact law.")
    ]
    wrong: Annotated[Count, about("Pairs whose compare value is not the exactly rounded law.")]
    largest_error: Annotated[int, quantity("compare counts", "Largest difference.", ge=0, le=2**32)]
    out_of_range: Annotated[Count, about("Compare values above the limit.")]
    not_monotone_in_u: Annotated[Count, about("Falls with rising command.")]
    not_monotone_in_dp: Annotated[Count, about("Steps over the pressure difference against the law's direction.")]
    odd_pairs: Annotated[Count, about("Pairs of pressure codes that give another value than their difference does.")]
    bad_fallbacks: Annotated[
        Count, about("Codes outside their signal's valid range that do not fall back to the safe value.")
    ]
    bad_status: Annotated[Count, about("Status words that say something else.")]
    bad_betas: Annotated[Count, about("Pairs of pressure codes at which dz_beta() is not the law's.")]
    calls: Annotated[Count, about("Calls of the core in all.")]

    @property
    def faults(self) -> int:
        """All that must be none, together."""
        counts = (self.wrong, self.out_of_range, self.not_monotone_in_u, self.not_monotone_in_dp, self.odd_pairs)
        return sum(counts) + self.bad_fallbacks + self.bad_status + self.bad_betas


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCheck(InputCounts):
    """The check of every input of one side; every count that ends in a fault must be zero."""

    sign: Annotated[Sign, about("Sign of the commands.")]
    over_compensated: Annotated[
        Count, about("Pressure codes of the certified interval whose drive at zero command lies above the bound.")
    ]
    smallest_margin_V: Annotated[
        float, quantity("V", "Smallest distance from the drive at zero command to the bound.", ge=-MOST_V, le=MOST_V)
    ]
    core_sha256: Annotated[Sha256, about("Hash of the C that was compiled.")]
    object_sha256: Annotated[Sha256, about("Hash of the object that was tried.")]
    outputs_hash: Annotated[
        str,
        Meta(
            description="Hash of all compare values, in order: the same on every processor.",
            pattern="^[0-9a-f]{16}$", max_length=16,
        ),
    ]  # fmt: skip
    pressure_pairs: Annotated[Count, about("Pairs of valid pressure codes, each of which was tried.")]
    first_wrong: Annotated[str | None, about("The first fault, in words.")]
    above: Annotated[AboveCheck, about("The same above the tests.")]
    lot: Annotated[
        LotCheck | None,
        about("Of a lot setting: every valve of its lot against its own bounds; null of a valve's own."),
    ]

    @property
    def side(self) -> Side:
        """Side of the valve that these commands are for."""
        return "positive" if self.sign > 0 else "negative"

    @property
    def holds(self) -> bool:
        """True if nothing was found."""
        above = self.above.over_compensated + self.above.rising + self.above.not_released
        return self.faults + self.over_compensated + above == 0 and not (self.lot and self.lot.over_compensated)


@dataclass(frozen=True, slots=True, kw_only=True)
class MutantOutcome:
    """What became of one mutant."""

    file: Annotated[str, about("File.")]
    line: Annotated[int, Meta(description="Line.", ge=1, le=10**6)]
    change: Annotated[str, about("What was changed.")]
    verdict: Annotated[str, about("Killed, refused by the compiler, equivalent or survived.")]
    killer: Annotated[str, about("What caught it; empty if nothing did.")] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class MutationScore:
    """Wrong versions of the C, and how many of them the checks caught."""

    mutants: Annotated[Count, about("How many.")]
    killed: Annotated[Count, about("Caught by a check.")]
    refused: Annotated[Count, about("Refused by the compiler.")]
    same_object: Annotated[Count, about("Equivalent: the same object code.")]
    same_outputs: Annotated[Count, about("Equivalent: the same outputs.")]
    survived: Annotated[Count, about("Neither: must be 0.")]
    killers: Annotated[Mapping[str, Count], about("Check to how many it caught.")]
    equivalent_means: Annotated[str, about("What equivalence rests on.")]
    not_killed: Annotated[tuple[MutantOutcome, ...], about("Those that no check caught, with the reason.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence(Artefact):
    """The evidence about one firmware, as `dzdesign verify` writes it."""

    FILE_NAME: ClassVar[str] = "verification.json"
    schema: Annotated[Literal["dzdesign.evidence/1"], about("Name and version of this schema.")] = "dzdesign.evidence/1"
    target: Annotated[str, about("Microcontroller of the firmware.")]
    changed_board_files: Annotated[
        Names, about("Board files that were filled in since they were generated: not checked.")
    ]
    user_files: Annotated[Names, about("Source and project files of the user's in the folder board/: not checked.")]
    differing_files: Annotated[
        Mapping[str, Sha256],
        about("SHA-256, as verified, of every file of the firmware that its manifest has otherwise, or has not."),
    ]
    board_not_compiled: Annotated[
        str, about("Why the changed board files were not compiled; empty if they were, or none was changed.")
    ]
    holds: Annotated[
        bool, about("Whether every requirement holds; one that could not be checked, or has no check here, does not.")
    ] = field(init=False)
    checks: Annotated[tuple[Check, ...], Meta(description="Every requirement that was tried.", min_length=1)]
    inputs: Annotated[
        tuple[InputCheck, ...], about("One entry a side; empty if the core did not compile or its check could not run.")
    ]
    closed_loop: Annotated[ClosedLoopResult, about("Ramps in closed loop with the generated C.")]
    scenarios: Annotated[tuple[ScenarioResult, ...], about("What happens beside ramps.")]
    population: Annotated[
        Population | None, about("Machines drawn from the declared budget, where --tolerances asked for them.")
    ]
    monte_carlo: Annotated[MonteCarlo | None, about("The series of plants, where --tolerances was given.")]
    current_loop: Annotated[
        CurrentLoopResult | None, about("Of a drive by current its loop; null of one by duty, or if it did not run.")
    ]
    mutants: Annotated[MutationScore | None, about("Wrong versions of the C, where --mutate was given.")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(check.holds for check in self.all_checks))

    @property
    def all_checks(self) -> tuple[Check, ...]:
        """The checks, and as not checked what every `verify` checks and is not here, unless a failure is the reason."""
        if any(check.holds is False for check in self.checks):
            return self.checks
        tried = {check.id for check in self.checks}
        text = "the evidence has no check of it; make it again with `dzdesign verify`"
        required = ALWAYS if self.current_loop is None else ALWAYS + OF_CURRENT
        return (*self.checks, *(each.check(holds=None, text=text) for each in required if each.id not in tried))

    @property
    def verdict(self) -> str:
        """One sentence: what does not hold stands before what could not be checked."""
        missed = [check.name for check in self.checks if check.holds is False]
        unknown = [check.name for check in self.all_checks if check.holds is None]
        parts = [f"{DOES_NOT_HOLD}: {', '.join(missed)}"] if missed else []
        parts += [f"{NOT_CHECKED}: {', '.join(unknown)}"] if unknown else []
        return "; ".join(parts) or "Every requirement holds."

    @property
    def reservation(self) -> str:
        """What a good verdict is not about: thresholds that no ramp test was compared with; empty where all were.

        Of a lot setting the recordings are those of one of its valves.
        """
        if not any(check.id == RAMPS.id and check.holds for check in self.checks):
            return AS_STATED
        others = max((each.lot.valves for each in self.inputs if each.lot), default=1) - 1
        return f"of the lot's other {others} valves {AS_STATED}" if others else ""

    def with_checks(self, *checks: Check) -> "Evidence":
        """Return the evidence with further requirements."""
        return replace(self, checks=(*self.checks, *checks))
