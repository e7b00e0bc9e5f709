"""What a batch leaves, as types: batch.json, which its report reads, and the manifest of each valve's folder."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Final, Literal

from msgspec import Meta

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import Artefact, RuleError, quantity
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.verify.loop_results import about

#: File of a lot, finished or not; folder of a lot in which each valve has its own; a valve's firmware in that.
SUMMARY_NAME, VALVES, FIRMWARE = "batch.json", "valves", "firmware"
#: Instead of a valve's name: one setting that is safe for all.
LOT_SETTING = "the lot setting"
#: What to do about a file of a lot that is not as it was written.
AGAIN = "run the batch again, which continues from the finished valves"
#: No number of a lot is larger: volts, MPa, percent, shares.
LARGEST = 1e6

Number = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]
Pressure = Annotated[float, Meta(ge=0, le=LARGEST)]
Pressures = tuple[Pressure, Pressure]
Count = Annotated[int, Meta(ge=0, le=10**9)]
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$", max_length=64)]
Names = tuple[str, ...]
#: A folder stands beside what it belongs to: no path.
FolderName = Annotated[
    str, Meta(description="Folder of the output, within the folder of a valve.", pattern=r"^\w{1,40}$")
]
#: What came of a valve; "does not hold": a requirement of its verification.
Status = Literal["ok", "failed", "does not hold"]
OK: Final = "ok"
FAILED: Final = "failed"
DOES_NOT_HOLD: Final = "does not hold"
#: What came of an output of a valve.
OutputVerdict = Literal["holds", "does not hold", "not verified", "not made"]
HOLDS: Final = "holds"
NOT_VERIFIED: Final = "not verified"
NOT_MADE: Final = "not made"


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantiles:
    """Quantiles over the valves, linear between the two nearest: the median of an even number is the mean of two."""

    least: Annotated[Number, about("Minimum.")]
    q05: Annotated[Number, about("5 % quantile.")]
    median: Annotated[Number, about("Median.")]
    q95: Annotated[Number, about("95 % quantile.")]
    largest: Annotated[Number, about("Maximum.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedValve:
    """A valve that is not calibrated."""

    name: Annotated[str, about("Name of the valve.")]
    status: Annotated[
        Literal["failed", "does not hold"],
        about("Whether the valve was not made, or a requirement of its verification does not hold."),
    ]
    reason: Annotated[str, about("Reason, in one sentence.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class UntestedPressures:
    """Pressure drops at which at least half of the lot was tested, but one side of this valve was not."""

    name: Annotated[str, about("Name of the valve.")]
    side: Annotated[Literal["positive", "negative"], about("Sign of the command.")]
    dp_MPa: Annotated[tuple[Pressure, ...], quantity("MPa", "Pressure drops at which the valve was not tested.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallestMargin:
    """Proof that the lot setting lies below the bounds of every valve, at every code of the valve's tested interval."""

    valves: Annotated[int, Meta(description="Number of valves compared.", ge=2, le=10**9)]
    worst: Annotated[str, about("Name of the valve with the smallest margin.")]
    dp_MPa: Annotated[Pressure, quantity("MPa", "Pressure drop at which that valve has the smallest margin.")]
    smallest_margin_V: Annotated[
        Number,
        quantity("V", "Smallest margin of the exact law below the valve's bound, with half a count reserved for "
                 "rounding. The margin in `verify` refers to the rounded integers of the C code."),
    ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSettingSummary:
    """Setting that is safe for each calibrated valve."""

    file: Annotated[str, Meta(pattern=r"^\w[\w.-]{0,99}$", max_length=100)]
    """Name of the compensator's file."""
    sha256: Sha256
    """SHA-256 of the compensator's file."""
    dp_MPa: Annotated[Pressures, quantity("MPa")]
    """Interval of the pressure drop on which it is certified for each valve."""
    untested: tuple[UntestedPressures, ...]
    """Valves that narrow the interval: they lack a test at a pressure drop where half of the lot has one."""
    dp_without_MPa: Annotated[Pressures | None, quantity("MPa")]
    """Interval without the valves that narrow it; null if there are none, or no interval remains."""
    carrier: str
    """Valve that the compensator contains: the one nearest to the lot's minimum."""
    binding: Names
    """Valves that limit the offset."""
    checked: SmallestMargin
    """Smallest margin below the bounds of all valves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LotFirmware:
    """The common firmware of a lot whose valves have calibration blocks."""

    folder: Annotated[
        str, Meta(description="Folder of the firmware, beside this file.", pattern=r"^\w+/\w+$", max_length=100)
    ]
    target: Annotated[str, Meta(description="Microcontroller of the firmware.", max_length=100)]
    manifest_sha256: Annotated[Sha256, about("SHA-256 of the firmware's manifest.json.")]
    block_of: Annotated[
        str,
        about("Source of the calibration block until another is loaded: the lot setting, or the valve of this name."),
    ]
    blocks: Annotated[Names, about("Files with a valve's own block, in the valve's folder.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class LotOutput:
    """One kind of output that was requested for each valve of a lot."""

    folder: FolderName
    settings: Annotated[
        Mapping[str, str],
        about("Values of the `codegen` options that only this kind of output has, by name without hyphens."),
    ]
    holds: Annotated[Names, about("Valves whose output was verified, with every requirement met.")]
    does_not_hold: Annotated[Names, about("Valves whose output was verified, with a requirement not met.")]
    not_verified: Annotated[Names, about("Valves whose output was made but not verified.")]
    not_made: Annotated[Names, about("Valves whose output could not be made.")]

    @property
    def made(self) -> int:
        """Of how many valves it was made."""
        return len(self.holds) + len(self.does_not_hold) + len(self.not_verified)


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSummary(Artefact):
    """The result of a lot of valves, as `dzdesign batch` writes it."""

    FILE_NAME: ClassVar[str] = SUMMARY_NAME
    schema: Literal["dzdesign.batch/1"] = "dzdesign.batch/1"
    """Name and version of this schema."""
    valves: Annotated[int, Meta(ge=1, le=10**9)]
    """Number of valves."""
    calibrated: Annotated[Count, about("Number of valves with a firmware, verified if that was requested.")] = field(
        init=False
    )
    failed: tuple[FailedValve, ...]
    """Valves that are not calibrated."""
    verified: bool
    """Whether each firmware was also verified."""
    warnings: Mapping[str, Names]
    """Valves with each warning, by its code."""
    anomalies: Names
    """Anomalies across valves that are individually in order, such as a recording that two valves share."""
    files: Mapping[str, Sha256]
    """SHA-256 of the table, by file name."""
    quantiles: Mapping[str, Quantiles]
    """Quantiles over the calibrated valves for each column of the table, if any valve has a value."""
    lot_setting: LotSettingSummary | None
    """Setting that is safe for every calibrated valve; null if there is none."""
    why_no_lot_setting: str | None
    """Reason why there is no such setting; null if there is one."""
    certified_of: Names = ()
    """What the certificates cover: the valve as recorded, alone or with the declared machine. Each that occurs."""
    firmware: LotFirmware | None = None
    """Common firmware of valves with calibration blocks; null if each valve has its own firmware."""
    outputs: Mapping[str, LotOutput] = field(default_factory=dict)
    """Other outputs of each valve, by target as listed by `codegen --list-targets`."""
    recorded_units: RecordedUnits = AS_COMPUTED
    """Units of the recordings; the numbers in this file are in V and MPa."""

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
    schema: Annotated[Literal["dzdesign.batch-unfinished/1"], about("Name and version of this schema.")] = (
        "dzdesign.batch-unfinished/1"
    )
    names: Annotated[Names, about("Names of the valves, in the order of the table.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveOutput:
    """Result of one output of one valve."""

    target: Annotated[str, Meta(description="Kind of output, as listed by `codegen --list-targets`.", max_length=100)]
    folder: FolderName
    verdict: Annotated[OutputVerdict, about("Result of the verification. not made: the output was refused.")]
    reason: Annotated[str, about("Reason why it was not made or does not hold, in one sentence.")] = ""
    inputs: Annotated[
        Annotated[int, Meta(ge=0, le=10**15)], about("Number of inputs that were compared with the exact law.")
    ] = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveManifest(Artefact):
    """Result of one valve of a lot."""

    FILE_NAME: ClassVar[str] = MANIFEST_NAME
    schema: Annotated[Literal["dzdesign.batch-valve/1"], about("Name and version of this schema.")] = (
        "dzdesign.batch-valve/1"
    )
    name: Annotated[str, about("Name of the valve.")]
    status: Annotated[Status, about("Whether the valve is calibrated. does not hold: a requirement is not met.")]
    reason: Annotated[str, about("Reason why it is not calibrated, in one sentence.")] = ""
    inputs_sha256: Annotated[
        Sha256 | None,
        about("SHA-256 of the recordings, options and version; null if the next run must try again."),
    ] = None
    board: Annotated[Names, about("Files of the firmware for the user to complete.")] = ()
    outputs: Annotated[
        tuple[ValveOutput, ...], about("Results of the other outputs; empty if there are none.")
    ] = ()
    files: Annotated[Mapping[str, Sha256], about("SHA-256 of each file in the same folder.")]
