"""`assess`: ramps recorded without and with the compensator, side by side, and whether the latter meet their limits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from dzdesign.assess.flow_curves import PressureCurves, read_curves
from dzdesign.assess.limits import LimitResult, check_limits
from dzdesign.assess.notes import find_notes
from dzdesign.assess.quantity_readings import read_quantities
from dzdesign.assess.valve_quantities import Reading, differences, symmetry
from dzdesign.core.errors import InputError
from dzdesign.identify.knees.meter_lag import MeterLag, find_lag
from dzdesign.identify.knees.prepared_tests import found_floor, split_recordings
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.pooling import SAME_PRESSURE, pool_ramps
from dzdesign.identify.ramps.sides import tests_of_side
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import SIDES, Warning_

MPA, L_MIN = 1e6, 1e-3 / 60
SETS = ("before", "after")


@dataclass(frozen=True, slots=True, kw_only=True)
class AssessOptions:
    """Choices of the engineer, SI.

    Attributes
    ----------
    reading : IdentifyOptions
        How recordings are read: full command, meter, knee window.
    after_u_max : float or None
        Full command of the recordings with the compensator, V; None: the same.
    level, level_share : float or None
        Flow that ends the dead zone, m³/s, or as a share of the largest flow BEFORE at that pressure drop; None takes
        what counts as flow BEFORE: the meter's floor, its noise or 0.5 % of the largest flow.
    window : tuple of float
        Commands between which linearity is taken, over u_max.
    limits : mapping
        Of `parse_limits`.
    """

    reading: IdentifyOptions = field(default_factory=IdentifyOptions)
    after_u_max: float | None = None
    level: float | None = None
    level_share: float | None = None
    window: tuple[float, float] = (0.1, 0.9)
    limits: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.level is not None and self.level_share is not None:
            raise InputError("the level is given both as a flow and as a share; keep one")
        if not (self.level or self.level_share or 1.0) > 0 or 0.0 in (self.level, self.level_share):
            raise InputError("the level is zero or negative, expected a flow such as '0.6 L/min', or a share of it")
        if not (self.level_share or 0.0) < 1:
            raise InputError(f"the level is {self.level_share:.0%} of the largest flow, expected less than all of it")
        if not 0 <= self.window[0] < self.window[1] <= 1:
            raise InputError(f"the linearity window is {self.window}, expected two rising shares such as '10-90 %'")

    def of_set(self, name: str) -> IdentifyOptions:
        """Return how the recordings of a set are read."""
        return self.reading if name == "before" else replace(self.reading, u_max=self.after_u_max or self.reading.u_max)


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureAssessment:
    """One side at one pressure drop, without and with the compensator; None where there is no such recording.

    `level` and `rated` are the flows (m³/s) that end the dead zone and of which linearity is a share; `changes` are
    AFTER less BEFORE, and their standard errors.
    """

    side: str
    before: PressureCurves | None
    after: PressureCurves | None
    level: float
    rated: float
    readings: dict[str, dict[str, Reading]]
    changes: dict[str, tuple[float, float | None]]

    @property
    def dp(self) -> float | None:
        """Pressure drop, Pa: of BEFORE where there is one."""
        return (self.before or self.after).dp

    @property
    def place(self) -> str:
        """Side and pressure drop in words."""
        return f"{self.side} commands" + ("" if self.dp is None else f", {self.dp / MPA:.2f} MPa")


@dataclass(frozen=True, slots=True, kw_only=True)
class Assessment:
    """The result: what was found at each pressure drop, the limits, and what must be known to read it."""

    options: AssessOptions
    floor: float
    lag: MeterLag
    pressures: tuple[PressureAssessment, ...]
    limits: tuple[LimitResult, ...]
    notes: tuple[Warning_, ...]
    made_from: tuple[dict[str, Any], ...]

    @property
    def holds(self) -> bool:
        """True if every limit was checked and is met."""
        return all(result.holds for result in self.limits)


def assess(before: Sequence[RampTest], after: Sequence[RampTest], options: AssessOptions | None = None) -> Assessment:
    """Compare ramps recorded without and with the compensator.

    Parameters
    ----------
    before, after : sequence of RampTest
        Recordings in any order, as `identify` takes them: several ramps in one, both sides of a bipolar valve. The
        command of `after` is what enters the compensator.
    options : AssessOptions, optional
        Choices of the engineer.

    Raises
    ------
    InputError
        For recordings that can't be read, and for sets that share no pressure drop.
    """
    options = options or AssessOptions()
    sets = {"before": before, "after": after}
    for name, tests in sets.items():
        if not tests:
            raise InputError(f"no recordings {_WHICH[name]} were given; expected at least one file")
    mine = {
        (side, name): tests_of_side(tests, sign, options.of_set(name).u_max)
        for side, sign in SIDES.items()
        for name, tests in sets.items()
    }
    floor, lag = _meter(mine, options)
    read = {
        key: read_curves(tests, options.of_set(key[1]), floor=floor, lag=lag.seconds) if tests else []
        for key, tests in mine.items()
    }
    pairs = [
        (side, pair) for side in SIDES for pair in pair_by_pressure(read[side, "before"], read[side, "after"])
    ]
    _refuse_what_has_no_partner(pairs)
    pressures = _with_symmetry([_assess_pair(side, *pair, options) for side, pair in pairs])
    limits = [
        result
        for item in pressures
        if item.after
        for result in check_limits(options.limits, item.place, item.readings.get("before"), item.readings["after"])
    ]
    return Assessment(
        options=options,
        floor=floor,
        lag=lag,
        pressures=pressures,
        limits=tuple(limits),
        notes=find_notes(sets, pressures, options, floor, lag),
        made_from=tuple(
            {"set": name, "source": test.source, "sha256": test.sha256}
            for name, tests in sets.items()
            for test in tests
        ),
    )


_WHICH = {"before": "without the compensator", "after": "with the compensator"}


def _meter(mine: Mapping[tuple[str, str], Sequence[RampTest]], options: AssessOptions) -> tuple[float, MeterLag]:
    """Return the meter's floor (m³/s) and its lag: declared, or found. One meter has read both sets.

    The floor is read BEFORE only: a compensated valve may open with a jump of its own, which looks like a floor.
    """
    floors, lags = [], []
    for (_, name), tests in sorted(mine.items(), key=lambda item: item[0][1], reverse=True):  # BEFORE first
        if not tests:
            continue
        reading = options.of_set(name)
        ramps = split_recordings(tests, reading, reading.meter_lag or 0.0)
        lags.append(find_lag(ramps, reading))
        if name == "before":
            floors.append(found_floor(pool_ramps(ramps), reading))
    floor = options.reading.meter_floor
    return (
        max(floors, default=0.0) if floor is None else floor,
        next((lag for lag in lags if lag.origin != "unknown"), lags[0]),
    )


def pair_by_pressure(
    before: Sequence[PressureCurves], after: Sequence[PressureCurves]
) -> list[tuple[PressureCurves | None, PressureCurves | None]]:
    """Pair curves whose pressure drops agree within `SAME_PRESSURE`, the nearest first; the others stay alone.

    Parameters
    ----------
    before, after : sequence of PressureCurves
        Of one side.

    Returns
    -------
    list
        In the order of rising pressure drop; None stands for a missing partner.
    """
    distances = sorted(
        (_distance(one.dp, other.dp), row, column)
        for row, one in enumerate(before)
        for column, other in enumerate(after)
    )
    partner: dict[int, int] = {}
    for distance, row, column in distances:
        if distance <= SAME_PRESSURE and row not in partner and column not in partner.values():
            partner[row] = column
    pairs = [(one, after[partner[row]] if row in partner else None) for row, one in enumerate(before)]
    pairs += [(None, other) for column, other in enumerate(after) if column not in partner.values()]
    return sorted(pairs, key=lambda pair: (pair[0] or pair[1]).dp or 0.0)


def _distance(one: float | None, other: float | None) -> float:
    """Return the difference of two pressure drops over the larger; none if both are unknown."""
    if one is None or other is None:
        return 0.0 if one is other else 1.0
    return abs(one - other) / max(one, other)


def _refuse_what_has_no_partner(
    pairs: Sequence[tuple[str, tuple[PressureCurves | None, PressureCurves | None]]],
) -> None:
    """Refuse sets that have no pressure drop of any side in common."""
    if any(one and other for _, (one, other) in pairs):
        return
    listed = [
        ", ".join(f"{side} {_said(pair[index].dp)}" for side, pair in pairs if pair[index]) or "none"
        for index in range(2)
    ]
    raise InputError(
        f"the recordings without the compensator ({listed[0]}) and with it ({listed[1]}) have no pressure drop in "
        f"common within {SAME_PRESSURE:.0%}, expected one at least; record both sets at the same pressure drops, or "
        "declare them by --dp or [dp]"
    )


def _said(dp: float | None) -> str:
    return "unknown" if dp is None else f"{dp / MPA:.2f} MPa"


def _assess_pair(
    side: str, before: PressureCurves | None, after: PressureCurves | None, options: AssessOptions
) -> PressureAssessment:
    """Read all quantities at one pressure drop, of both sets at one level and over one rated flow."""
    first = before or after
    rated = first.y_max
    share = None if options.level_share is None else options.level_share * rated
    level = options.level or share or first.counts
    readings = {
        name: read_quantities(
            curves, u_max=options.of_set(name).u_max, level=level, rated=rated, window=options.window
        )
        for name, curves in zip(SETS, (before, after), strict=True)
        if curves
    }
    changes = differences(readings["before"], readings["after"]) if before and after else {}
    return PressureAssessment(
        side=side, before=before, after=after, level=level, rated=rated, readings=readings, changes=changes
    )


def _with_symmetry(pressures: Sequence[PressureAssessment]) -> tuple[PressureAssessment, ...]:
    """Add the symmetry of both sides' gains, once a pressure drop: to the positive side where there is one."""
    done = []
    for item in pressures:
        readings = dict(item.readings)
        for name in item.readings:
            both = {one.side: one for one in pressures if _same(one, item, name)}
            if item.side == "negative" and "positive" in both:
                continue
            gains = [both[side].readings[name]["gain"] if side in both else None for side in SIDES]
            readings[name] = readings[name] | {"symmetry": symmetry(*gains)}
        complete = len(readings) == len(SETS)
        changes = differences(readings["before"], readings["after"]) if complete else item.changes
        done.append(replace(item, readings=readings, changes=changes))
    return tuple(done)


def _same(one: PressureAssessment, other: PressureAssessment, name: str) -> bool:
    """Tell whether both hold a set's recordings at one pressure drop."""
    mine, yours = getattr(one, name), getattr(other, name)
    return mine is not None and yours is not None and _distance(mine.dp, yours.dp) <= SAME_PRESSURE
