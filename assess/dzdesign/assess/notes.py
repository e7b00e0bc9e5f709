"""What must be known to read an assessment: the meter, pressures without a partner, recordings that fall short."""

from collections.abc import Iterator, Sequence

from dzdesign.assess.assessment import PressureAssessment
from dzdesign.assess.curve_pairs import Comparison, CurvePair
from dzdesign.assess.options import SETS, Set
from dzdesign.core.recorded_units import RecordedUnits, shown_in
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.data_quality.flow_meter import LIKELY_LAG
from dzdesign.identify.data_quality.recordings import about_recordings
from dzdesign.identify.valve.model import Warning_

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
