"""`assess`: ramps recorded without and with the compensator, side by side, and whether the latter meet their limits."""

from collections.abc import Iterator, Sequence

from dzdesign.assess.assessment import (
    Assessment,
    BeforeAfter,
    MeterTaken,
    PressureAssessment,
    RampSet,
    Recording,
    Request,
)
from dzdesign.assess.curve_pairs import Comparison, CurvePair, compare_curves, relative_distance
from dzdesign.assess.flow_curves import measured_curve
from dzdesign.assess.options import BOTH_SIDES, SETS, AssessOptions, Set
from dzdesign.assess.quantities import LOSS, LOSS_OF_FLOW, QUANTITIES, Reading, change, check_limits, symmetry
from dzdesign.assess.readings import read_quantities
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.recorded_units import RecordedUnits, shown_in
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.data_quality.flow_meter import LIKELY_LAG
from dzdesign.identify.data_quality.recordings import about_recordings
from dzdesign.identify.ramps.pooling import SAME_PRESSURE
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import Warning_

#: Set -> key of a quantity -> reading, of one side at one pressure drop.
Readings = dict[Set, dict[str, Reading]]


def assess(before: Sequence[RampTest], after: Sequence[RampTest], options: AssessOptions | None = None) -> Assessment:
    """Compare ramps recorded without and with the compensator.

    The recordings come in any order, as `identify` takes them: several ramps in one, both sides of a bipolar valve. The
    command of `after` is what enters the compensator.

    Raises
    ------
    InputError
        For recordings that can't be read, and for sets that share no pressure drop.
    """
    comparison = compare_curves(before, after, options or AssessOptions())
    options, units = comparison.options, comparison.units
    flows = [_reading_flow(pair, options) for pair in comparison.pairs]
    readings = [_read(pair, flow, comparison) for pair, flow in zip(comparison.pairs, flows, strict=True)]
    _add_symmetry(comparison.pairs, readings)
    pressures = tuple(
        _pressure(pair, flow, found, options)
        for pair, flow, found in zip(comparison.pairs, flows, readings, strict=True)
    )
    return Assessment(
        tool=THIS_TOOL,
        made_from=tuple(
            Recording(set=name, source=test.source, sha256=test.sha256)
            for name, tests in comparison.tests.items()
            for test in tests
        ),
        options=_request(options),
        meter=MeterTaken(
            floor_L_min=comparison.floor / L_MIN, lag_s=comparison.lag.seconds, lag_is=comparison.lag.origin
        ),
        quantities={**QUANTITIES, LOSS: LOSS_OF_FLOW},
        pressures=pressures,
        limits=tuple(
            result
            for item, found in zip(pressures, readings, strict=True)
            if "after" in found
            for result in check_limits(options.limits, item.place(units), found.get("before"), found["after"], units)
        ),
        notes=find_notes(comparison, pressures),
        recorded_units=units,
    )


def _request(options: AssessOptions) -> Request:
    return Request(
        u_max_V=options.reading.u_max,
        after_u_max_V=options.of_set("after").u_max,
        knee_window=options.reading.knee_window,
        linearity_window=options.window,
        reading_flow_L_min=None if options.reading_flow is None else options.reading_flow / L_MIN,
        reading_share=options.reading_share,
        same_pressure_within=SAME_PRESSURE,
    )


def _reading_flow(pair: CurvePair, options: AssessOptions) -> float:
    """Return the flow at which the dead zones of both sets are read, m³/s."""
    if options.reading_flow is not None:
        return options.reading_flow
    return pair.first.counts if options.reading_share is None else options.reading_share * pair.first.y_max


def _read(pair: CurvePair, reading_flow: float, comparison: Comparison) -> Readings:
    """Read all quantities at one pressure drop, of both sets at one reading flow and over one rated flow."""
    options = comparison.options
    return {
        name: read_quantities(
            curves, u_max=options.of_set(name).u_max, reading_flow=reading_flow, rated=pair.first.y_max,
            window=options.window, units=comparison.of_set(name, pair.side),
        )
        for name, curves in pair.sets.items()
    }  # fmt: skip


def _add_symmetry(pairs: Sequence[CurvePair], readings: Sequence[Readings]) -> None:
    """Add the symmetry of both sides' gains, once a pressure drop: to the positive side where there is one."""
    for pair, found in zip(pairs, readings, strict=True):
        for name, curves in pair.sets.items():
            gains = {
                other.side: of_other[name]["gain"]
                for other, of_other in zip(pairs, readings, strict=True)
                if name in other.sets and relative_distance(other.sets[name].dp, curves.dp) <= SAME_PRESSURE
            }
            if pair.side == "positive" or "positive" not in gains:
                found[name]["symmetry"] = symmetry(*(gains.get(side) for side in BOTH_SIDES))


def _pressure(
    pair: CurvePair, reading_flow: float, readings: Readings, options: AssessOptions
) -> PressureAssessment:
    old, new = (readings.get(name, {}) for name in SETS)
    keys = next(iter(readings.values()))
    return PressureAssessment(
        side=pair.side,
        dp_MPa=_in_MPa(pair.first.dp),
        reading_flow_L_min=reading_flow / L_MIN,
        rated_flow_L_min=pair.first.y_max / L_MIN,
        before=_ramp_set(pair, "before", options),
        after=_ramp_set(pair, "after", options),
        quantities={
            key: BeforeAfter(before=old.get(key), after=new.get(key), change=change(old.get(key), new.get(key)))
            for key in keys
        },
    )


def _ramp_set(pair: CurvePair, name: Set, options: AssessOptions) -> RampSet | None:
    if (curves := pair.sets.get(name)) is None:
        return None
    return RampSet(
        source=curves.source, ramps=curves.ramps, dp_MPa=_in_MPa(curves.dp),
        curve=measured_curve(curves, options.of_set(name).u_max),
    )  # fmt: skip


def _in_MPa(dp: float | None) -> float | None:
    return None if dp is None else dp / MPA


#: A command that ends below this share of u_max, and a dead zone that keeps this share of itself, are worth a word.
FULL_COMMAND, UNCHANGED = 0.98, 0.9
#: Without the compensator, a flow at zero of so many standard errors, and of this share of the largest, is one.
ZERO_SIGNIFICANCE, ZERO_SHARE = 5.0, 2e-3
ALONE: tuple[tuple[Set, str], ...] = (
    ("before", "without the compensator only: nothing is compared there, and no limit is checked"),
    ("after", "with the compensator only: nothing is compared there; limits are checked all the same"),
)


def find_notes(comparison: Comparison, pressures: Sequence[PressureAssessment]) -> tuple[Warning_, ...]:
    """Return the notes of an assessment; `pressures` is what was read of each pair of the comparison."""
    pairs = comparison.pairs
    tests = [test for tests in comparison.tests.values() for test in tests]
    with shown_in(comparison.units):
        found = about_recordings(tests)
    notes = [*found, *_about_partners(comparison), *_about_the_meter(comparison)]
    both = list(zip(pairs, pressures, strict=True))
    notes += [note for pair, item in both for note in _about_zero(pair, item, comparison.units)]
    notes += [note for pair, item in both for note in _about_the_command(pair, item, comparison)]
    notes += [
        Warning_(
            code="declared-pressure",
            text="the pressure drop is declared, not recorded: its sag under flow counts as the valve's own",
            source=test.source,
        )
        for test in tests
        if test.dp_is_declared
    ]
    return tuple(notes)


def _about_partners(comparison: Comparison) -> Iterator[Warning_]:
    pairs, units = comparison.pairs, comparison.units
    for side in dict.fromkeys(pair.side for pair in pairs):
        for name, words in ALONE:
            alone = [pair.first for pair in pairs if pair.side == side and list(pair.sets) == [name]]
            if alone:
                known = ("unknown" if one.dp is None else units.number(one.dp / MPA, ".2f MPa") for one in alone)
                listed = ", ".join(known)
                yield Warning_(
                    code="no-partner",
                    text=f"{side} commands at {listed} {units.label('MPa')} were recorded {words}",
                    source=", ".join(one.source for one in alone),
                )


def _about_the_meter(comparison: Comparison) -> Iterator[Warning_]:
    if comparison.lag.origin == "unknown":
        widening = ", ".join(
            f"{2 * _fastest(name, comparison) * LIKELY_LAG:.2%} of command {name.upper()}" for name in SETS
        )
        yield Warning_(
            code="lag-unknown",
            text=(
                f"the flow meter's lag is not declared and not taken out: {LIKELY_LAG:g} s of it feigns {widening} of "
                "hysteresis, and half of that on each dead zone and knee. Give --meter-lag"
            ),
            source=None,
        )
    if comparison.floor > 0:
        floor = comparison.units.text(comparison.floor / L_MIN, ".2f L/min")
        yield Warning_(
            code="floor",
            text=f"the flow meter shows nothing below {floor}: what flows less is not observable",
            source=None,
        )


def _fastest(name: Set, comparison: Comparison) -> float:
    """Return the fastest ramp of a set, in shares of full command per second."""
    rates = [
        curve.read.branch.rate
        for pair in comparison.pairs
        if name in pair.sets
        for curve in pair.sets[name].curves
        if curve.read.branch.rate > 0
    ]
    return max(rates, default=0.0) / comparison.options.of_set(name).u_max


def _about_zero(pair: CurvePair, item: PressureAssessment, units: RecordedUnits) -> Iterator[Warning_]:
    before, reading = pair.sets.get("before"), item.readings("before").get("flow_at_zero")
    if before is None or reading is None or reading.value is None:
        return
    if abs(reading.value) > max(ZERO_SIGNIFICANCE * (reading.se or 0.0), ZERO_SHARE * before.q_max / L_MIN):
        yield Warning_(
            code="meter-zero",
            text=(
                f"{item.place(units)}: at zero command {units.text(reading.value, '+.3g L/min')} flow without the "
                "compensator too: the meter's zero error, or a leak. Nothing is subtracted from any flow"
            ),
            source=before.source,
        )


def _about_the_command(pair: CurvePair, item: PressureAssessment, comparison: Comparison) -> Iterator[Warning_]:
    place = item.place(comparison.units)
    for name, curves in pair.sets.items():
        u_max, units = comparison.options.of_set(name).u_max, comparison.of_set(name, pair.side)
        if curves.u_top < FULL_COMMAND * u_max:
            yield Warning_(
                code="short-ramp",
                text=(
                    f"{place}: the command ends at {units.text(curves.u_top, '.2f V')} of {units.text(u_max, 'g V')}, "
                    "and the largest flow is the one there"
                ),
                source=curves.source,
            )
    old, new = (item.readings(name).get("dead_zone_opening") for name in SETS)
    if "after" in pair.sets and old and new and old.value and new.value and new.value > UNCHANGED * old.value:
        yield Warning_(
            code="unchanged",
            text=(
                f"{place}: the dead zone is {old.value:.1f} % without the compensator and {new.value:.1f} % with "
                "it; are the sets the wrong way round, or is the command AFTER the compensator's output and not its "
                "input? --after-columns says which column"
            ),
            source=pair.sets["after"].source,
        )
