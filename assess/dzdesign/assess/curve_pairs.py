"""Recordings without and with the compensator, paired: the curves of both at each pressure drop of each side."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from dzdesign.assess.flow_curves import PressureCurves, read_curves
from dzdesign.assess.options import BOTH_SIDES, SETS, AssessOptions, Set, Side
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits, shown_in, worded
from dzdesign.identify.constants import MPA
from dzdesign.identify.knees.meter import MeterLag, find_lag
from dzdesign.identify.knees.prepared_tests import found_floor, split_recordings
from dzdesign.identify.ramps.pooling import SAME_PRESSURE, pool_ramps
from dzdesign.identify.ramps.sides import tests_of_side
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.scaling import units_of
from dzdesign.identify.valve.model import SIDES


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePair:
    """The curves of one side at one pressure drop, by the name of their set; one of them may be missing."""

    side: Side
    sets: Mapping[Set, PressureCurves]

    @property
    def first(self) -> PressureCurves:
        """The curves BEFORE where there are some, else those AFTER."""
        return next(iter(self.sets.values()))


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Both sets of recordings, read: the meter's floor (m³/s), its lag, and the pairs, side by side."""

    options: AssessOptions
    tests: Mapping[Set, Sequence[RampTest]]
    floor: float
    lag: MeterLag
    pairs: tuple[CurvePair, ...]

    @property
    def units(self) -> RecordedUnits:
        """The units in which results are shown."""
        return units_of([test for tests in self.tests.values() for test in tests])

    def of_set(self, name: Set, side: Side) -> RecordedUnits:
        """Return the units in which what was found in one set is shown, of a side."""
        return units_of(self.tests[name]).of_side(side)


def compare_curves(before: Sequence[RampTest], after: Sequence[RampTest], options: AssessOptions) -> Comparison:
    """Read the curves of both sets, and pair those of one side and pressure drop.

    Raises
    ------
    InputError
        For recordings that can't be read, and for sets that share no pressure drop.
    """
    sets: dict[Set, Sequence[RampTest]] = {"before": before, "after": after}
    for name, tests in sets.items():
        if not tests:
            which = "without" if name == "before" else "with"
            raise InputError(f"no recordings {which} the compensator were given; expected at least one file")
    with shown_in(units_of([*before, *after])):
        of_sides = {
            (side, name): tests_of_side(tests, SIDES[side], options.of_set(name).u_max)
            for side in BOTH_SIDES
            for name, tests in sets.items()
        }
        floor, lag = _meter(of_sides, options)
        curves = {
            (side, name): read_curves(tests, options.of_set(name), floor=floor, lag=lag.seconds) if tests else []
            for (side, name), tests in of_sides.items()
        }
        pairs = tuple(
            CurvePair(side=side, sets=found)
            for side in BOTH_SIDES
            for found in _paired(curves[side, "before"], curves[side, "after"])
        )
        if not any(len(pair.sets) == len(SETS) for pair in pairs):
            raise InputError(_no_pressure_in_common(pairs))
    return Comparison(options=options, tests=sets, floor=floor, lag=lag, pairs=pairs)


def _meter(of_sides: Mapping[tuple[Side, Set], Sequence[RampTest]], options: AssessOptions) -> tuple[float, MeterLag]:
    """Return the meter's floor (m³/s) and its lag: declared, or found. One meter has read both sets.

    The floor is read BEFORE only: a compensated valve may open with a jump of its own, which looks like a floor.
    """
    floors, lags = [], []
    for (_, name), tests in sorted(of_sides.items(), key=lambda item: item[0][1], reverse=True):  # BEFORE first
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


def _paired(before: Sequence[PressureCurves], after: Sequence[PressureCurves]) -> list[dict[Set, PressureCurves]]:
    """Pair curves whose pressure drops agree within `SAME_PRESSURE`, the nearest first; by rising pressure drop."""
    distances = sorted(
        (relative_distance(one.dp, other.dp), row, column)
        for row, one in enumerate(before)
        for column, other in enumerate(after)
    )
    partner: dict[int, int] = {}
    for distance, row, column in distances:
        if distance <= SAME_PRESSURE and row not in partner and column not in partner.values():
            partner[row] = column
    pairs: list[dict[Set, PressureCurves]] = [
        {"before": one, "after": after[partner[row]]} if row in partner else {"before": one}
        for row, one in enumerate(before)
    ]
    pairs += [{"after": one} for column, one in enumerate(after) if column not in partner.values()]
    return sorted(pairs, key=lambda sets: next(iter(sets.values())).dp or 0.0)


def relative_distance(one: float | None, other: float | None) -> float:
    """Return the difference of two pressure drops over the larger; none if both are unknown.

    Examples
    --------
    >>> relative_distance(4e6, 5e6), relative_distance(None, None), relative_distance(None, 1e6)
    (0.2, 0.0, 1.0)
    """
    if one is None or other is None:
        return 0.0 if one is other else 1.0
    return abs(one - other) / max(one, other)


def _no_pressure_in_common(pairs: Sequence[CurvePair]) -> str:
    def listed(name: Set) -> str:
        found = [(pair.side, pair.sets[name].dp) for pair in pairs if name in pair.sets]
        places = [
            worded("{side} unknown" if dp is None else "{side} {dp:.2f MPa}", side=side, dp=(dp or 0.0) / MPA)
            for side, dp in found
        ]
        return ", ".join(places) or "none"

    return worded(
        "the recordings without the compensator ({before}) and with it ({after}) have no pressure drop in common "
        "within {within:.0%}, expected one at least; record both sets at the same pressure drops, or declare them by "
        "--dp or [dp]",
        before=listed("before"),
        after=listed("after"),
        within=SAME_PRESSURE,
    )
