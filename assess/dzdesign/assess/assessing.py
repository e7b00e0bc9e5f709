"""`assess`: ramps recorded without and with the compensator, side by side, and whether the latter meet their limits."""

from collections.abc import Sequence

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
from dzdesign.assess.limits import check_limits
from dzdesign.assess.measured_curves import measured_curve
from dzdesign.assess.notes import find_notes
from dzdesign.assess.options import BOTH_SIDES, SETS, AssessOptions, Set
from dzdesign.assess.quantities import LOSS, LOSS_OF_FLOW, QUANTITIES, Reading, change, symmetry
from dzdesign.assess.readings import read_quantities
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.ramps.pooling import SAME_PRESSURE
from dzdesign.identify.reading.ramp_test import RampTest

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
