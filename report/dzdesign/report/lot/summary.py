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

    least: Annotated[Number, Meta(description="Minimum.")]
    q05: Annotated[Number, Meta(description="5 % quantile.")]
    q25: Annotated[Number, Meta(description="25 % quantile.")]
    median: Annotated[Number, Meta(description="Median.")]
    q75: Annotated[Number, Meta(description="75 % quantile.")]
    q95: Annotated[Number, Meta(description="95 % quantile.")]
    largest: Annotated[Number, Meta(description="Maximum.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedValve:
    """A valve that is not calibrated."""

    name: Annotated[str, Meta(description="Name of the valve.")]
    status: Annotated[
        Literal["failed", "does not hold"],
        Meta(description="Whether the valve was not made, or a requirement of its verification does not hold."),
    ]
    reason: Annotated[str, Meta(description="Reason, in one sentence.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class UntestedPressures:
    """Pressure drops at which at least half of the lot was tested, but one side of this valve was not."""

    name: Annotated[str, Meta(description="Name of the valve.")]
    side: Annotated[Literal["positive", "negative"], Meta(description="Sign of the command.")]
    dp_MPa: Annotated[tuple[Pressure, ...], quantity("MPa", "Pressure drops at which the valve was not tested.")]
    narrows: Annotated[bool, Meta(description="Whether the missing tests narrow the interval of the lot setting.")]
    coarser_V: Annotated[
        Distance,
        quantity(
            "V",
            "Estimated gain of a test: distance of the valve's bound below the straight line between its "
            "bounds at the neighbouring tests. 0 outside its tests or without a trend.",
        ),
    ]
    cost_percent: Annotated[
        Distance,
        quantity("%", "Estimated gain in percent of command if this valve limits the lot setting; otherwise 0."),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallestMargin:
    """Proof that the lot setting lies below the bounds of every valve, at every code of the valve's tested interval."""

    valves: Annotated[int, Meta(description="Number of valves compared.", ge=2, le=10**9)]
    worst: Annotated[str, Meta(description="Name of the valve with the smallest margin.")]
    dp_MPa: Annotated[Pressure, quantity("MPa", "Pressure drop at which that valve has the smallest margin.")]
    smallest_margin_V: Annotated[
        Number,
        quantity(
            "V",
            "Smallest margin of the exact law below the valve's bound, with half a count reserved for "
            "rounding. The margin in `verify` refers to the rounded integers of the C code.",
        ),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingOfOthers:
    """The lot setting of the remaining valves, if those that limit it kept their own settings."""

    left_out: Annotated[Names, Meta(description="Valves that keep their own settings.")]
    quantiles: Annotated[
        Mapping[str, Quantiles],
        Meta(
            description="Additional dead zone against each valve's own setting, in percent of command; empty if there "
            "is no setting."
        ),
    ]
    why_not: Annotated[str | None, Meta(description="Reason why there is no such setting; null if there is one.")] = (
        None
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSettingSummary:
    """Setting that is safe for each calibrated valve."""

    file: Annotated[
        str, Meta(description="Name of the compensator's file.", pattern=r"^\w[\w.-]{0,99}$", max_length=100)
    ]
    sha256: Annotated[Sha256, Meta(description="SHA-256 of the compensator's file.")]
    dp_MPa: Annotated[
        Pressures, quantity("MPa", "Interval of the pressure drop on which it is certified for each valve.")
    ]
    untested: Annotated[
        tuple[UntestedPressures, ...],
        Meta(description="Valves without a test at a pressure drop at which half of the lot was tested."),
    ]
    dp_without_MPa: Annotated[
        Pressures | None,
        quantity("MPa", "Interval without the valves that narrow it; null if there are none, or no interval remains."),
    ]
    carrier: Annotated[
        str, Meta(description="Valve that the compensator contains: the one nearest to the lot's minimum.")
    ]
    binding: Annotated[Names, Meta(description="Valves that limit the offset.")]
    smallest_margin_V: Annotated[
        Mapping[str, tuple[Number, ...]],
        quantity(
            "V",
            "Smallest margin, over these valves and sides, of the offset below the valve's own ceiling. The "
            "ceiling is the largest piecewise linear offset below the valve's bounds. Half a count is "
            "reserved for rounding.",
        ),
    ]
    checked: Annotated[SmallestMargin, Meta(description="Smallest margin below the bounds of all valves.")]
    without_binding: Annotated[
        SettingOfOthers | None,
        Meta(
            description="Cost if the limiting valves kept their own settings; null if fewer than two valves would "
            "remain."
        ),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class LotFirmware:
    """The common firmware of a lot whose valves have calibration blocks."""

    folder: Annotated[
        str, Meta(description="Folder of the firmware, beside this file.", pattern=r"^\w+/\w+$", max_length=100)
    ]
    target: Annotated[str, Meta(description="Microcontroller of the firmware.", max_length=100)]
    manifest_sha256: Annotated[Sha256, Meta(description="SHA-256 of the firmware's manifest.json.")]
    block_of: Annotated[
        str,
        Meta(
            description="Source of the calibration block until another is loaded: the lot setting, or the valve of "
            "this name."
        ),
    ]
    blocks: Annotated[Names, Meta(description="Files with a valve's own block, in the valve's folder.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSummary(Artefact):
    """The result of a lot of valves, as `dzdesign batch` writes it."""

    FILE_NAME: ClassVar[str] = SUMMARY_NAME
    schema: Annotated[Literal["dzdesign.batch/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.batch/1"
    )
    valves: Annotated[int, Meta(description="Number of valves.", ge=1, le=10**9)]
    calibrated: Annotated[
        Count, Meta(description="Number of valves with a firmware, verified if that was requested.")
    ] = field(init=False)
    failed: Annotated[tuple[FailedValve, ...], Meta(description="Valves that are not calibrated.")]
    verified: Annotated[bool, Meta(description="Whether each firmware was also verified.")]
    warnings: Annotated[Mapping[str, Names], Meta(description="Valves with each warning, by its code.")]
    anomalies: Annotated[
        Names,
        Meta(
            description="Anomalies across valves that are individually in order, such as a recording that two valves "
            "share."
        ),
    ]
    files: Annotated[Mapping[str, Sha256], Meta(description="SHA-256 of the table, by file name.")]
    quantiles: Annotated[
        Mapping[str, Quantiles],
        Meta(
            description="Quantiles over the calibrated valves for each column of the table, if any valve has a value."
        ),
    ]
    lot_setting: Annotated[
        LotSettingSummary | None,
        Meta(description="Setting that is safe for every calibrated valve; null if there is none."),
    ]
    why_no_lot_setting: Annotated[
        str | None, Meta(description="Reason why there is no such setting; null if there is one.")
    ]
    budget: Annotated[
        LotBudget | None,
        Meta(description="Uncertainty budgets of the calibrated valves; null if there is no calibrated valve."),
    ] = None
    firmware: Annotated[
        LotFirmware | None,
        Meta(description="Common firmware of valves with calibration blocks; null if each valve has its own firmware."),
    ] = None
    outputs: Annotated[
        Mapping[str, LotOutput],
        Meta(description="Other outputs of each valve, by target as listed by `codegen --list-targets`."),
    ] = field(default_factory=dict)
    recorded_units: Annotated[
        RecordedUnits, Meta(description="Units of the recordings; the numbers in this file are in V and MPa.")
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
    schema: Annotated[Literal["dzdesign.batch-unfinished/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.batch-unfinished/1"
    )
    names: Annotated[Names, Meta(description="Names of the valves, in the order of the table.")]
