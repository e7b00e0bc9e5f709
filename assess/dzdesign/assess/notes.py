"""What must be known to read an assessment: the meter, pressures without a partner, recordings that fall short."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from dzdesign.identify.data_quality.quality import LIKELY_LAG
from dzdesign.identify.data_quality.recordings import about_recordings
from dzdesign.identify.knees.meter_lag import MeterLag
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import Warning_

if TYPE_CHECKING:
    from dzdesign.assess.assessment import AssessOptions, PressureAssessment

MPA, L_MIN = 1e6, 1e-3 / 60
#: A command that ends below this share of u_max, and a dead zone that keeps this share of itself, are worth a word.
FULL_COMMAND, UNCHANGED = 0.98, 0.9
#: Without the compensator, a flow at zero of so many standard errors, and of this share of the largest, is one.
ZERO_SIGNIFICANCE, ZERO_SHARE = 5.0, 2e-3


def find_notes(
    sets: Mapping[str, Sequence[RampTest]],
    pressures: Sequence["PressureAssessment"],
    options: "AssessOptions",
    floor: float,
    lag: MeterLag,
) -> tuple[Warning_, ...]:
    """Return the notes of an assessment.

    Parameters
    ----------
    sets : mapping
        The recordings without and with the compensator.
    pressures : sequence of PressureAssessment
        What was found.
    options : AssessOptions
        Choices of the engineer.
    floor : float
        Of the meter, m³/s.
    lag : MeterLag
        Of the meter.
    """
    return (
        *about_recordings([test for tests in sets.values() for test in tests]),
        *_about_partners(pressures),
        *_about_the_lag(pressures, options, lag),
        *_about_the_floor(floor),
        *_about_zero(pressures),
        *_about_the_command(pressures, options),
        *_about_declarations(sets),
    )


def _about_partners(pressures: Sequence["PressureAssessment"]) -> Iterator[Warning_]:
    for side in dict.fromkeys(item.side for item in pressures):
        alone = [item for item in pressures if item.side == side and not (item.before and item.after)]
        for name, have, tail in (
            ("before", "without the compensator only", "nothing is compared there, and no limit is checked"),
            ("after", "with the compensator only", "nothing is compared there; limits are checked all the same"),
        ):
            mine = [item for item in alone if getattr(item, name)]
            if mine:
                listed = ", ".join("unknown" if item.dp is None else f"{item.dp / MPA:.2f}" for item in mine)
                yield Warning_(
                    code="no-partner",
                    text=f"{side} commands at {listed} MPa were recorded {have}: {tail}",
                    source=", ".join(getattr(item, name).source for item in mine),
                )


def _about_the_lag(
    pressures: Sequence["PressureAssessment"], options: "AssessOptions", lag: MeterLag
) -> Iterator[Warning_]:
    if lag.origin != "unknown":
        return
    rates = {
        name: max(
            (
                curve.read.branch.rate / options.of_set(name).u_max
                for item in pressures
                if getattr(item, name)
                for curve in getattr(item, name).curves
                if curve.read.branch.rate > 0
            ),
            default=0.0,
        )
        for name in ("before", "after")
    }
    widening = ", ".join(f"{2 * rate * LIKELY_LAG:.2%} of command {name.upper()}" for name, rate in rates.items())
    yield Warning_(
        code="lag-unknown",
        text=(
            f"the flow meter's lag is not declared and not taken out: {LIKELY_LAG:g} s of it feigns {widening} of "
            "hysteresis, and half of that on each dead zone and knee. Give --meter-lag"
        ),
        source=None,
    )


def _about_the_floor(floor: float) -> Iterator[Warning_]:
    if floor > 0:
        yield Warning_(
            code="floor",
            text=f"the flow meter shows nothing below {floor / L_MIN:.2f} L/min: what flows less is not observable",
            source=None,
        )


def _about_zero(pressures: Sequence["PressureAssessment"]) -> Iterator[Warning_]:
    for item in pressures:
        reading = item.readings.get("before", {}).get("flow_at_zero")
        if reading is None or reading.value is None:
            continue
        if abs(reading.value) > max(ZERO_SIGNIFICANCE * (reading.se or 0.0), ZERO_SHARE * item.before.q_max):
            yield Warning_(
                code="meter-zero",
                text=(
                    f"{item.place}: at zero command {reading.value / L_MIN:+.3g} L/min flow without the compensator "
                    "too: the meter's zero error, or a leak. Nothing is subtracted from any flow"
                ),
                source=item.before.source,
            )


def _about_the_command(pressures: Sequence["PressureAssessment"], options: "AssessOptions") -> Iterator[Warning_]:
    for item in pressures:
        for name in item.readings:
            curves, u_max = getattr(item, name), options.of_set(name).u_max
            if curves.u_top < FULL_COMMAND * u_max:
                yield Warning_(
                    code="short-ramp",
                    text=(
                        f"{item.place}: the command ends at {curves.u_top:.2f} V of {u_max:g} V, and the largest flow "
                        "is the one there"
                    ),
                    source=curves.source,
                )
        old, new = (item.readings.get(name, {}).get("dead_zone_opening") for name in ("before", "after"))
        if old and new and old.value and new.value and new.value > UNCHANGED * old.value:
            yield Warning_(
                code="unchanged",
                text=(
                    f"{item.place}: the dead zone is {old.value:.1%} without the compensator and {new.value:.1%} with "
                    "it; are the sets the wrong way round, or is the command AFTER the compensator's output and not "
                    "its input? --after-columns says which column"
                ),
                source=item.after.source,
            )


def _about_declarations(sets: Mapping[str, Sequence[RampTest]]) -> Iterator[Warning_]:
    for tests in sets.values():
        for test in tests:
            if test.dp_is_declared:
                yield Warning_(
                    code="declared-pressure",
                    text="the pressure drop is declared, not recorded: its sag under flow counts as the valve's own",
                    source=test.source,
                )
