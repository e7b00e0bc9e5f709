"""batch.json as types: what a lot of valves came to, as `dzdesign batch` writes it and the lot's report reads it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Final, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Artefact, RuleError, quantity
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.report.lot.budget import LotBudget
from dzdesign.report.lot.output_types import LotOutput

#: File of either type below.
SUMMARY_NAME = "batch.json"
#: Instead of a valve's name: one setting that is safe for all.
LOT_SETTING = "the lot setting"
#: What to do about a file of a lot that is not as it was written.
AGAIN = "run the batch again, which continues from the finished valves"
#: No number of a lot is larger: volts, MPa, percent, shares.
LARGEST = 1e6

Number = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]
Pressure = Annotated[float, Meta(ge=0, le=LARGEST)]
Distance = Annotated[float, Meta(ge=0, le=LARGEST)]
Pressures = tuple[Pressure, Pressure]
Count = Annotated[int, Meta(ge=0, le=10**9)]
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$", max_length=64)]
Names = tuple[str, ...]
#: What came of a valve; "does not hold": a requirement of its verification.
Status = Literal["ok", "failed", "does not hold"]
OK: Final = "ok"
FAILED: Final = "failed"
DOES_NOT_HOLD: Final = "does not hold"


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantiles:
    """Quantiles over the valves, linear between the two nearest: the median of an even number is the mean of two."""

    least: Annotated[Number, Meta(description="The least.")]
    q05: Annotated[Number, Meta(description="One valve in twenty is below.")]
    q25: Annotated[Number, Meta(description="One valve in four is below.")]
    median: Annotated[Number, Meta(description="The median.")]
    q75: Annotated[Number, Meta(description="One valve in four is above.")]
    q95: Annotated[Number, Meta(description="One valve in twenty is above.")]
    largest: Annotated[Number, Meta(description="The largest.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedValve:
    """A valve that is not calibrated."""

    name: Annotated[str, Meta(description="Its name.")]
    status: Annotated[
        Literal["failed", "does not hold"],
        Meta(description="Not made, or a requirement of its verification is not met."),
    ]
    reason: Annotated[str, Meta(description="Why, in one sentence.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class UntestedPressures:
    """Pressure drops at which half of the lot or more was tested, and one side of one valve was not."""

    name: Annotated[str, Meta(description="Name of the valve.")]
    side: Annotated[Literal["positive", "negative"], Meta(description="Sign of command.")]
    dp_MPa: Annotated[tuple[Pressure, ...], quantity("MPa", "Pressure drops that it lacks.")]
    narrows: Annotated[bool, Meta(description="Whether that makes the interval of the lot setting narrower.")]
    coarser_V: Annotated[
        Distance,
        quantity(
            "V",
            "How far its bound there lies under the straight line between its bounds at the tests beside: about what a "
            "test would gain; 0 outside its tests or without a trend.",
        ),
    ]
    cost_percent: Annotated[
        Distance, quantity("%", "The same in percent of command if it holds the lot setting down, else 0.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallestMargin:
    """That the lot setting lies under the bounds of every valve: proved at every code of its own tested interval."""

    valves: Annotated[int, Meta(description="For how many valves.", ge=2, le=10**9)]
    worst: Annotated[str, Meta(description="Name of the valve with the smallest margin.")]
    dp_MPa: Annotated[Pressure, quantity("MPa", "Pressure drop where it has it.")]
    smallest_margin_V: Annotated[
        Number,
        quantity(
            "V",
            "That margin of the exact law under its bound, with half a count of rounding kept; what `verify` states is "
            "of the whole numbers of the C, rounded as they are.",
        ),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingOfOthers:
    """The lot setting of the others, if the valves that hold it down kept settings of their own."""

    left_out: Annotated[Names, Meta(description="Valves that keep settings of their own.")]
    quantiles: Annotated[
        Mapping[str, Quantiles],
        Meta(description="Dead zone that it leaves beyond each valve's own, in percent of command; empty of none."),
    ]
    why_not: Annotated[str | None, Meta(description="Why there is no such setting; null if there is one.")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSettingSummary:
    """One setting that is safe for each calibrated valve."""

    file: Annotated[str, Meta(description="Its compensator.", pattern=r"^\w[\w.-]{0,99}$", max_length=100)]
    sha256: Annotated[Sha256, Meta(description="SHA-256 of that file.")]
    dp_MPa: Annotated[Pressures, quantity("MPa", "Interval in which it is certified for each valve.")]
    untested: Annotated[
        tuple[UntestedPressures, ...],
        Meta(description="Valves that were not tested at a pressure drop at which half of the lot was."),
    ]
    dp_without_MPa: Annotated[
        Pressures | None,
        quantity("MPa", "What `dp_MPa` would be without those that make it narrower; null without any or of none."),
    ]
    carrier: Annotated[str, Meta(description="Valve that the compensator holds: the nearest to the least.")]
    binding: Annotated[Names, Meta(description="Valves that hold its offset down.")]
    smallest_margin_V: Annotated[
        Mapping[str, tuple[Number, ...]],
        quantity(
            "V",
            "Of these valves: smallest margin of the offset under the valve's own ceiling, on each side: what its own "
            "offset may not exceed, straight between the tests and nowhere above the bounds, with half a count of "
            "rounding kept.",
        ),
    ]
    checked: Annotated[SmallestMargin, Meta(description="The smallest margin under the bounds of all valves.")]
    without_binding: Annotated[
        SettingOfOthers | None,
        Meta(
            description="What it would cost if the valves that hold it down kept settings of their own; null where "
            "fewer than two valves would be left."
        ),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class LotFirmware:
    """The one firmware of a lot whose valves have calibration blocks."""

    folder: Annotated[str, Meta(description="Its folder, beside this file.", pattern=r"^\w+/\w+$", max_length=100)]
    target: Annotated[str, Meta(description="Its microcontroller.", max_length=100)]
    manifest_sha256: Annotated[Sha256, Meta(description="SHA-256 of the manifest.json in it.")]
    block_of: Annotated[
        str,
        Meta(description="Whose block it has until another is loaded: the lot setting, or the valve of this name."),
    ]
    blocks: Annotated[Names, Meta(description="Files of a valve's folder that hold its own block.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSummary(Artefact):
    """What a lot of valves came to, as `dzdesign batch` writes it."""

    FILE_NAME: ClassVar[str] = SUMMARY_NAME
    schema: Annotated[Literal["dzdesign.batch/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.batch/1"
    )
    valves: Annotated[int, Meta(description="How many there are.", ge=1, le=10**9)]
    calibrated: Annotated[Count, Meta(description="How many have a firmware, verified if asked for.")] = field(
        init=False
    )
    failed: Annotated[tuple[FailedValve, ...], Meta(description="The others.")]
    verified: Annotated[bool, Meta(description="Whether each firmware was verified too.")]
    warnings: Annotated[Mapping[str, Names], Meta(description="Code of each warning to the valves that have it.")]
    anomalies: Annotated[
        Names, Meta(description="What is odd though each valve is in order, such as a recording that two share.")
    ]
    files: Annotated[Mapping[str, Sha256], Meta(description="SHA-256 of the table, by the name of its file.")]
    quantiles: Annotated[
        Mapping[str, Quantiles],
        Meta(description="Spread of the calibrated valves: column of the table to quantiles, where any valve has it."),
    ]
    lot_setting: Annotated[
        LotSettingSummary | None, Meta(description="One setting that is safe for each calibrated valve; null of none.")
    ]
    why_no_lot_setting: Annotated[str | None, Meta(description="Why there is none; null if there is one.")]
    budget: Annotated[
        LotBudget | None, Meta(description="Uncertainty budgets of the calibrated valves; null without such a valve.")
    ] = None
    firmware: Annotated[
        LotFirmware | None,
        Meta(description="The one firmware, of valves with calibration blocks; null where each has a firmware."),
    ] = None
    outputs: Annotated[
        Mapping[str, LotOutput],
        Meta(description="Outputs of each valve beside its firmware, by target as `codegen --list-targets` names it."),
    ] = field(default_factory=dict)
    recorded_units: Annotated[
        RecordedUnits, Meta(description="Units of the valves' recordings; the numbers here are in V and MPa.")
    ] = AS_COMPUTED

    def __post_init__(self) -> None:
        object.__setattr__(self, "calibrated", self.valves - len(self.failed))
        if self.calibrated < 0:
            raise RuleError(f"'failed' names {len(self.failed)} valves, expected at most {self.valves}, its 'valves'")
        if (self.lot_setting is None) is (self.why_no_lot_setting is None):
            raise RuleError("'lot_setting' and 'why_no_lot_setting' are both given or both null, expected one of them")


@dataclass(frozen=True, slots=True, kw_only=True)
class UnfinishedLot(Artefact):
    """A lot whose batch runs, or was stopped: the same command takes it up."""

    FILE_NAME: ClassVar[str] = SUMMARY_NAME
    schema: Annotated[
        Literal["dzdesign.batch-unfinished/1"], Meta(description="Name and version of this schema.")
    ] = "dzdesign.batch-unfinished/1"
    names: Annotated[Names, Meta(description="The valves, in the order of the table.")]
