"""`ValveModel`: what identification found, the artefact valve.json."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, ClassVar, Literal

from msgspec import UNSET, Meta, UnsetType

from dzdesign.core.artefact_types import Artefact, RuleError, as_document, quantity, schema_of
from dzdesign.core.display import ShownInNotebooks
from dzdesign.core.dither import Dither
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.identify.valve.quantity_types import Flow, Probability
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.identify.valve.test_record import LONGEST_NAME, LONGEST_TEXT, MOST_ENTRIES, checked_record

#: Of texts of an option, and of names of files in a table or a list.
LONGEST = 4096
Name = Annotated[str, Meta(min_length=1, max_length=LONGEST)]
Words = Annotated[str, Meta(max_length=LONGEST)]
Side = Literal["positive", "negative"]
#: Both sides, and the sign of the command that opens each.
SIDES = {"positive": 1, "negative": -1}
#: How the lag of a flow meter is known, for people.
KNOWN_BY = {"declared": "declared", "identified": "from ramps of two rates", "unknown": "none declared"}
LagOrigin = Literal["declared", "identified", "unknown"]
#: Decimals of every number in valve.json: below every error here, and the same bytes on every machine.
DECIMALS = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedOptions:
    """Options of `identify` as entered, defaults included; an option without a value is omitted."""

    texts: Annotated[Mapping[Name, Words], Meta(description="Options with one text value, such as meter_lag.")] = field(
        default_factory=dict
    )
    tables: Mapping[Name, Mapping[Name, Words]] = field(default_factory=dict)
    """Options given as a table, such as columns, or dp by the recording's name."""
    lists: Mapping[Name, tuple[Words, ...]] = field(default_factory=dict)
    """Options with several text values. The list of `order` holds the recordings in the order in which they were
    taken."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Meter:
    """Properties of the flow meter as assumed."""

    floor_L_min: Flow
    """Flow below which the meter reads zero, declared or found."""
    lag_s: Annotated[float, quantity("s", ge=-1e6, le=1e6)]
    """Lag of the meter; below zero if the command comes late."""
    lag_is: LagOrigin
    """Whether the lag was declared or identified. If it is unknown, it was taken as zero."""
    lag_longer_s: Annotated[float, quantity("s", ge=0, le=1e6)]
    """Largest amount by which the true lag may be longer; it lowers the bounds on opening."""
    lag_shorter_s: Annotated[float, quantity("s", ge=0, le=1e6)]
    """Largest amount by which the true lag may be shorter; it lowers the bounds on closing."""
    zero_L_min: Flow
    """Bound of the meter's zero error, by which all bounds are lowered."""
    left_by_rates_s: Annotated[float, quantity("s", ge=-1e6, le=1e6)] | UnsetType = UNSET
    """Lag that ramps of two rates show beside the declared one: half the change of the hysteresis' width with the
    rate, which the valve may cause as well. Omitted if the ramps have one rate or if the lag was identified from
    them."""
    left_by_rates_se_s: Annotated[float, quantity("s", ge=0, le=1e6)] | UnsetType = UNSET
    """Standard error of left_by_rates_s; omitted with it."""

    def lag_in_words(self) -> str:
        """Return the lag with its tolerance and how it is known."""
        return lag_in_words(self.lag_s, self.lag_is, longer=self.lag_longer_s, shorter=self.lag_shorter_s)


def lag_in_words(seconds: float, origin: LagOrigin, *, longer: float = 0.0, shorter: float = 0.0) -> str:
    """Return the lag of a flow meter that was taken out, by how much it may be wrong, and how it is known.

    Examples
    --------
    >>> lag_in_words(0.1, "declared", longer=0.05, shorter=0.05), lag_in_words(0.0, "unknown", longer=0.2)
    ('lag 0.1 s (declared), uncertain by ± 0.05 s', 'lag 0 s (none declared), uncertain by 0.2 s longer')
    """
    ways = {"longer": longer, "shorter": shorter}
    alike = f"{longer:.2g}" == f"{shorter:.2g}"
    each = [f"{value:.2g} s {way}" for way, value in ways.items() if value > 0]
    wrong_by = f"± {longer:.2g} s" if alike and longer > 0 else " or ".join(each)
    return f"lag {seconds:.3g} s ({KNOWN_BY[origin]})" + (f", uncertain by {wrong_by}" if wrong_by else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Warning_:
    """A warning about the data or the result."""

    code: Annotated[str, Meta(description="Machine-readable code; the documentation explains each.")]
    text: Annotated[str, Meta(description="Warning with its figures and what to do.")]
    source: Annotated[str | None, Meta(description="Recording that the warning is about; null if it is about all.")]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ValveModel(ShownInNotebooks, Artefact):
    """An identified valve, as `dzdesign identify` writes it."""

    FILE_NAME: ClassVar[str] = "valve.json"
    schema: Literal["dzdesign.valve/1"] = "dzdesign.valve/1"
    """Name and version of this schema."""
    record: Annotated[
        Mapping[
            Annotated[str, Meta(min_length=1, max_length=LONGEST_NAME)],
            Annotated[str, Meta(min_length=1, max_length=LONGEST_TEXT)],
        ],
        Meta(
            description="Details given by --record or [record], such as serial number or oil. They are not used in any "
            "computation.",
            max_length=MOST_ENTRIES,
        ),
    ]
    options: StatedOptions | None = None
    """Options of `identify` that reproduce this file from the files in made_from; null if they were not recorded."""
    simulated: bool
    """Whether a recording is simulated. A simulation is no measurement, so its firmware must not be used on a
    machine."""
    u_max_V: Annotated[float, quantity("V", ge=1e-3, le=1e4)]
    """Full command."""
    meter: Meter
    """Properties of the flow meter as assumed."""
    knee_window: Annotated[tuple[Probability, Probability], quantity("1")]
    """Initial range in which the characteristic was taken as straight, as shares of the largest flow."""
    sides: Annotated[
        Mapping[str, SideModel], Meta(min_length=1, extra_json_schema={"propertyNames": {"enum": list(SIDES)}})
    ]
    """Tested sides of the valve: one or both."""
    untested_sides: tuple[Side, ...] = field(init=False)
    """Sides without a usable recording."""
    warnings: tuple[Warning_, ...]
    """Warnings in descending order of importance."""
    recorded_units: RecordedUnits = AS_COMPUTED
    """Units of the recordings, in which values are displayed; the file itself uses V, MPa and L/min. For a quantity
    recorded in several units the displayed units are V, MPa and L/min, too."""
    dithered: Dither | UnsetType = UNSET
    """Dither that the drive superimposed on the command during the ramps. Thresholds and characteristics are those of
    the dithered valve. Omitted if there was none."""
    content_sha256: str = field(init=False)
    """SHA-256 of all other keys, which reveals an accidental edit."""

    def __post_init__(self) -> None:
        if not self.sides or not set(self.sides) <= set(SIDES):
            raise RuleError(f"the sides are {', '.join(self.sides) or 'none'}, expected {' or '.join(SIDES)}")
        if self.simulated != any(warning.code == "simulated" for warning in self.warnings):
            stated, there = ("true", "lacks the") if self.simulated else ("false", "has a")
            raise RuleError(f"'simulated' is {stated}, but 'warnings' {there} warning of that code")
        object.__setattr__(self, "record", checked_record(self.record.items(), "the record"))
        object.__setattr__(self, "untested_sides", tuple(name for name in SIDES if name not in self.sides))
        names = (each.name for each in fields(self) if each.name != "content_sha256")
        content = {name: value for name in names if (value := getattr(self, name)) is not UNSET}
        object.__setattr__(self, "content_sha256", sha256_of(to_json(as_document(content)).encode(errors="replace")))

    @property
    def dither(self) -> Dither | None:
        """The dither under which the valve was recorded; None: without one."""
        return None if isinstance(self.dithered, UnsetType) else self.dithered

    @property
    def dither_in_words(self) -> str:
        """The dither with its peak in the command's unit; empty without one."""
        if self.dither is None:
            return ""
        peak = self.recorded_units.text(self.dither.peak * self.u_max_V, ".3g dV")
        return f"a dither of {self.dither.in_words()} (±{peak})"

    def side_name(self, sign: int) -> Side:
        """Return the name of the side that commands of a sign drive.

        Commands from zero to full have the sign 1. They drive the positive side, or the negative one of a valve that
        was tested with negative commands alone.
        """
        return "negative" if sign < 0 or "positive" not in self.sides else "positive"

    def sign_of(self, side: str) -> int:
        """Return the sign of the commands that drive a side."""
        return 1 if self.side_name(1) == side else -1

    def side(self, sign: int = 1) -> SideModel:
        """Return the side that commands of a sign drive; see `side_name`."""
        return self.sides[self.side_name(sign)]

    @property
    def positive(self) -> SideModel:
        """The side of positive commands.

        Raises
        ------
        InputError
            If it was not tested.
        """
        if "positive" not in self.sides:
            raise InputError("the valve was tested with negative commands only; record ramp tests with positive ones")
        return self.sides["positive"]


SCHEMA = schema_of(ValveModel)
