"""What the characteristic comes to: dead zones, hysteresis, linearity, symmetry, gain and flow, per side and pressure.

Measured ones lead. Without an assessment those without the compensator are the valve's, as identified, and those with
it are the simulated closed loop's.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dzdesign.assess.assessment import Assessment, PressureAssessment
from dzdesign.assess.limits import LimitResult
from dzdesign.assess.quantities import LOSS, Reading
from dzdesign.assess.thinned_curves import Line, gain_of, hysteresis_of, linearity_of
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.report.sections.curves import CharacteristicCurve, Origin, origin_of, same_pressure
from dzdesign.verify.loop_results import PressureResult

#: Keys in the order of a test report.
KEYS = (
    "onset_opening", "onset_closing", "dead_zone_opening", "dead_zone_closing", "hysteresis", "linearity", "symmetry",
    "gain", "largest_flow", "flow_at_zero",
)  # fmt: skip


#: Share of full command below which a ramp has come to zero command.
NEAR_ZERO = 0.01


@dataclass(frozen=True, slots=True)
class Found:
    """A value in the unit of its quantity; None: not seen, and at most `at_most` where that is known."""

    value: float | None
    at_most: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureQuantities:
    """The quantities of one side at one pressure drop, before and after, and what limits say of them."""

    side: str
    dp_MPa: float | None
    reading_flow_L_min: float
    before: Mapping[str, Found]
    after: Mapping[str, Found]
    limits: Mapping[str, LimitResult] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class CharacteristicQuantities:
    """All of them, and where those before and after are from; None where there are none."""

    pressures: tuple[PressureQuantities, ...]
    before: Origin | None
    after: Origin | None


def characteristic_quantities(
    valve: ValveModel | None,
    assessment: Assessment | None,
    loops: Sequence[PressureResult],
    curves: Sequence[CharacteristicCurve],
) -> CharacteristicQuantities:
    """Return the quantities of all sides; `curves` are those that the figure shows."""
    if assessment:
        origin = origin_of(assessment)
        return CharacteristicQuantities(pressures=tuple(_of_assessment(assessment)), before=origin, after=origin)
    pressures = _with_symmetry(list(_of_valve_and_loop(valve, loops, curves))) if valve else ()
    return CharacteristicQuantities(
        pressures=pressures, before=origin_of(valve) if valve else None, after="simulated" if loops else None
    )


def _of_assessment(assessment: Assessment) -> Iterator[PressureQuantities]:
    for item in assessment.pressures:
        place = item.place(assessment.recorded_units)
        before, after = (
            {key: _found(reading) for key, reading in item.readings(name).items()} for name in ("before", "after")
        )
        if loss := _loss(item):
            after[LOSS] = loss
        yield PressureQuantities(
            side=item.side,
            dp_MPa=item.dp_MPa,
            reading_flow_L_min=item.reading_flow_L_min,
            before=before,
            after=after,
            limits={limit.quantity: limit for limit in assessment.limits if limit.place == place},
        )


def _found(reading: Reading) -> Found:
    return Found(reading.value, reading.at_most)


def _loss(item: PressureAssessment) -> Found | None:
    """Return by how much the largest flow fell, percent."""
    both = item.quantities.get("largest_flow")
    old, new = (both.before, both.after) if both else (None, None)
    if old is None or new is None or not old.value or new.value is None:
        return None
    return Found(100 * (1 - new.value / old.value))


def _of_valve_and_loop(
    valve: ValveModel, loops: Sequence[PressureResult], curves: Sequence[CharacteristicCurve]
) -> Iterator[PressureQuantities]:
    for side, test in ((name, test) for name, each in valve.sides.items() for test in each.tests):
        dp, u_max = test.dp_MPa, valve.u_max_V
        loop = next((each for each in loops if each.side == side and same_pressure(each.dp_MPa, dp)), None)
        level = loop.reading_flow_L_min if loop else test.noise_level_L_min
        bare, driven = (_lines(curves, side, dp, name) for name in ("before", "after"))
        rated = max((float(line.q.max()) for line in bare.values()), default=0.0)
        before = _shape(bare, rated, u_max, valve.meter.floor_L_min)
        yield PressureQuantities(
            side=side,
            dp_MPa=dp,
            reading_flow_L_min=level,
            before=before | _of_test(test, u_max, level, bare) | _at_zero(test, bare),
            after=_shape(driven, rated, u_max) | (_of_loop(loop) if loop else {}),
        )


def _lines(curves: Sequence[CharacteristicCurve], side: str, dp: float | None, name: str) -> dict[str, Line]:
    """Return the branches of a curve, counted from zero out; none where there is no such curve."""
    for curve in curves:
        if curve.side == side and curve.set == name and same_pressure(curve.dp_MPa, dp):
            sign = -1.0 if side == "negative" else 1.0
            return {word: Line(sign * each.command, sign * each.q_L_min) for word, each in curve.branches.items()}
    return {}


def _shape(lines: Mapping[str, Line], rated: float, u_max: float, floor: float = 0.0) -> dict[str, Found]:
    """Return what the shape of a curve comes to."""
    if not lines:
        return {}
    both = tuple(lines.values())
    widest = hysteresis_of(*both, floor) if len(both) == 2 else None
    departure, gain = linearity_of(both, rated), gain_of(both)
    return {
        "hysteresis": Found(None if widest is None or np.isnan(widest) else 100 * widest),
        "linearity": Found(None if departure is None else 100 * departure),
        "gain": Found(None if gain is None else gain / u_max),
        "largest_flow": Found(max(float(line.q.max()) for line in both)),
    }


def _of_test(test: TestResult, u_max_V: float, level: float, lines: Mapping[str, Line]) -> dict[str, Found]:
    """Return what was identified of a test; a dead zone at a flow is that of its recorded curve."""
    found = {"gain": Found(test.slope_L_min_V)}
    for word, branch in (("opening", "rising"), ("closing", "falling")):
        onset = getattr(test, f"u_onset_{branch}_V")
        found[f"onset_{word}"] = Found(None if onset is None else 100 * onset / u_max_V)
        at = lines[word].command_at(level) if word in lines else float("nan")
        found[f"dead_zone_{word}"] = Found(None if np.isnan(at) else 100 * at)
    return found


def _at_zero(test: TestResult, lines: Mapping[str, Line]) -> dict[str, Found]:
    """Return the leak, or the noise level where none is seen; nothing where no ramp comes from or to zero command."""
    if not any(line.u.size and line.u.min() <= NEAR_ZERO for line in lines.values()):
        return {}
    return {"flow_at_zero": Found(test.leak_L_min) if test.leak_L_min else Found(None, test.noise_level_L_min)}


def _of_loop(loop: PressureResult) -> dict[str, Found]:
    unseen = loop.unseen_below_L_min
    seen = unseen is None or loop.q_zero_L_min > unseen
    return {
        "onset_opening": Found(100 * loop.residual_opening),
        "onset_closing": Found(100 * loop.residual_closing),
        "dead_zone_opening": Found(100 * loop.reading_opening),
        "dead_zone_closing": Found(100 * loop.reading_closing),
        "flow_at_zero": Found(loop.q_zero_L_min) if seen else Found(None, unseen),
    }


def _with_symmetry(found: Sequence[PressureQuantities]) -> tuple[PressureQuantities, ...]:
    """Add the symmetry of both sides' gains to the positive side."""
    def gains(name: str, one: PressureQuantities, other: PressureQuantities | None) -> dict[str, Found]:
        if other is None:
            return {}
        over, under = (getattr(each, name).get("gain", Found(None)).value for each in (one, other))
        return {"symmetry": Found(100 * (over / under - 1))} if over and under else {}

    made = []
    for one in found:
        other = next(
            (each for each in found if each.side != one.side and same_pressure(each.dp_MPa, one.dp_MPa)), None
        )
        if one.side == "positive":
            one = replace(
                one,
                before={**one.before, **gains("before", one, other)},
                after={**one.after, **gains("after", one, other)},
            )
        made.append(one)
    return tuple(made)
