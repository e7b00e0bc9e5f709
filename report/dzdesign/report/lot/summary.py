"""What a batch leaves, as types: batch.json, which its report reads, and the manifest of each valve's folder."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Final, Literal

from msgspec import Meta

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import Artefact, RuleError, quantity
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits

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

    least: Number
    """Minimum."""
    q05: Number
    """5 % quantile."""
    median: Number
    """Median."""
    q95: Number
    """95 % quantile."""
    largest: Number
    """Maximum."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedValve:
    """A valve that is not calibrated."""

    name: str
    """Name of the valve."""
    status: Literal["failed", "does not hold"]
    """Whether the valve was not made, or a requirement of its verification does not hold."""
    reason: str
    """Reason, in one sentence."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UntestedPressures:
    """Pressure drops at which at least half of the lot was tested, but one side of this valve was not."""

    name: str
    """Name of the valve."""
    side: Literal["positive", "negative"]
    """Sign of the command."""
    dp_MPa: Annotated[tuple[Pressure, ...], quantity("MPa")]
    """Pressure drops at which the valve was not tested."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallestMargin:
    """Proof that the lot setting lies below the bounds of every valve, at every code of the valve's tested interval."""

    valves: Annotated[int, Meta(ge=2, le=10**9)]
    """Number of valves compared."""
    worst: str
    """Name of the valve with the smallest margin."""
    dp_MPa: Annotated[Pressure, quantity("MPa")]
    """Pressure drop at which that valve has the smallest margin."""
    smallest_margin_V: Annotated[Number, quantity("V")]
    """Smallest margin of the exact law below the valve's bound, with half a count reserved for rounding. The margin
    in `verify` refers to the rounded integers of the C code."""


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

    folder: Annotated[str, Meta(pattern=r"^\w+/\w+$", max_length=100)]
    """Folder of the firmware, beside this file."""
    target: Annotated[str, Meta(max_length=100)]
    """Microcontroller of the firmware."""
    manifest_sha256: Sha256
    """SHA-256 of the firmware's manifest.json."""
    block_of: str
    """Source of the calibration block until another is loaded: the lot setting, or the valve of this name."""
    blocks: Names
    """Files with a valve's own block, in the valve's folder."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LotOutput:
    """One kind of output that was requested for each valve of a lot."""

    folder: FolderName
    settings: Mapping[str, str]
    """Values of the `codegen` options that only this kind of output has, by name without hyphens."""
    holds: Names
    """Valves whose output was verified, with every requirement met."""
    does_not_hold: Names
    """Valves whose output was verified, with a requirement not met."""
    not_verified: Names
    """Valves whose output was made but not verified."""
    not_made: Names
    """Valves whose output could not be made."""

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
    calibrated: Count = field(
        init=False
    )
    """Number of valves with a firmware, verified if that was requested."""
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
    schema: Literal["dzdesign.batch-unfinished/1"] = "dzdesign.batch-unfinished/1"
    """Name and version of this schema."""
    names: Names
    """Names of the valves, in the order of the table."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveOutput:
    """Result of one output of one valve."""

    target: Annotated[str, Meta(max_length=100)]
    """Kind of output, as listed by `codegen --list-targets`."""
    folder: FolderName
    verdict: OutputVerdict
    """Result of the verification. not made: the output was refused."""
    reason: str = ""
    """Reason why it was not made or does not hold, in one sentence."""
    inputs: Annotated[int, Meta(ge=0, le=10**15)] = 0
    """Number of inputs that were compared with the exact law."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveManifest(Artefact):
    """Result of one valve of a lot."""

    FILE_NAME: ClassVar[str] = MANIFEST_NAME
    schema: Literal["dzdesign.batch-valve/1"] = "dzdesign.batch-valve/1"
    """Name and version of this schema."""
    name: str
    """Name of the valve."""
    status: Status
    """Whether the valve is calibrated. does not hold: a requirement is not met."""
    reason: str = ""
    """Reason why it is not calibrated, in one sentence."""
    inputs_sha256: Sha256 | None = None
    """SHA-256 of the recordings, options and version; null if the next run must try again."""
    board: Names = ()
    """Files of the firmware for the user to complete."""
    outputs: tuple[ValveOutput, ...] = ()
    """Results of the other outputs; empty if there are none."""
    files: Mapping[str, Sha256]
    """SHA-256 of each file in the same folder."""
