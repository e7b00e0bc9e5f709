"""Flow against command without and with the compensator, and what it comes to: dead zones, hysteresis, gain and flow.

Measured ones lead: an assessment of recordings. Without one, those without the compensator are the valve's, as recorded
and identified, and those with it are the simulated closed loop's.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from msgspec import UnsetType

from dzdesign.assess.assessment import Assessment, MeasuredCurve, PressureAssessment
from dzdesign.assess.options import SETS, Set
from dzdesign.assess.quantities import LOSS, LimitResult
from dzdesign.assess.readings import Line, gain_of, hysteresis_of, linearity_of
from dzdesign.identify.ramps.pooling import SAME_PRESSURE
from dzdesign.identify.valve.model import SIDES, ValveModel
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.recorded_curve import RecordedBranch
from dzdesign.report.figure import PressureHues
from dzdesign.verify.closed_loop.ramps import Curves, closed_loop_name
from dzdesign.verify.loop_results import PressureResult

#: Where a curve is from: recordings of a valve, recordings that are simulated themselves, or a simulated closed loop.
Origin = Literal["recorded", "example", "simulated"]
ORIGIN_WORDS: Mapping[Origin, str] = {
    "recorded": "recorded", "example": "simulated recordings", "simulated": "simulated closed loop",
}  # fmt: skip
BRANCHES = ("opening", "closing")
#: Command and flow, and those of the samples.
Branch = tuple[Sequence[float], Sequence[float], Sequence[float], Sequence[float]]
#: What a straight line from zero command to the largest flow would read at the reading flow.
IDEAL = "ideal_line"
#: Keys in the order of a test report.
KEYS = (
    "onset_opening", "onset_closing", "dead_zone_opening", "dead_zone_closing", IDEAL, "hysteresis", "linearity",
    "symmetry", "gain", "largest_flow", "flow_at_zero",
)  # fmt: skip


#: Share of full command below which a ramp has come to zero command.
NEAR_ZERO = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Flow (N,) in L/min over command (N,) as a share of full command, both with the sign of their side."""

    command: np.ndarray
    q_L_min: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class CharacteristicCurve:
    """The curve of one side at one pressure drop, before or after the compensator was put in.

    `branches` by their names, opening and closing, as far as there are any; `samples` are single readings.
    """

    side: str
    dp_MPa: float | None
    set: Set
    origin: Origin
    branches: Mapping[str, Points]
    samples: tuple[Points, ...] = ()

    @property
    def end(self) -> tuple[float, float]:
        """Command and flow at its far end."""
        ends = [
            (float(each.command[at]), float(each.q_L_min[at]))
            for each in self.branches.values()
            for at in [int(np.argmax(np.abs(each.command)))]
        ]
        return max(ends, key=lambda end: abs(end[1]))


def characteristic_curves(
    valve: ValveModel | None, assessment: Assessment | None, loops: Mapping[str, Curves]
) -> tuple[CharacteristicCurve, ...]:
    """Return the curves of all sides and pressure drops; `loops` are the evidence's, by the names of their files."""
    if assessment and (measured := tuple(_measured(assessment))):
        return measured
    return (*(_recorded(valve) if valve else ()), *_simulated(loops))


def origin_of(recordings: ValveModel | Assessment) -> Origin:
    """Return what the recordings of a valve or of an assessment are."""
    warnings = recordings.warnings if isinstance(recordings, ValveModel) else recordings.notes
    return "example" if any(warning.code == "simulated" for warning in warnings) else "recorded"


def _measured(assessment: Assessment) -> Iterator[CharacteristicCurve]:
    for item in assessment.pressures:
        for name in SETS:
            if curve := measured_curve_of(item, name):
                found = [
                    (one.command_percent, one.q_L_min, one.sample_command_percent, one.sample_q_L_min) if one else None
                    for one in (curve.rising, curve.falling)
                ]
                yield _curve(item.side, item.dp_MPa, name, origin_of(assessment), found, 100.0)


def measured_curve_of(item: PressureAssessment, name: Set) -> MeasuredCurve | None:
    """Return the curve of a set at one pressure drop; None where there is none, or none was kept."""
    ramps = item.before if name == "before" else item.after
    return None if ramps is None or isinstance(ramps.curve, UnsetType) else ramps.curve


def _recorded(valve: ValveModel) -> Iterator[CharacteristicCurve]:
    def branch(one: RecordedBranch | None) -> Branch | None:
        if one is None:
            return None
        samples = one.samples
        return (one.u_V, one.q_L_min, *(((), ()) if isinstance(samples, UnsetType) else (samples.u_V, samples.q_L_min)))

    for name, test in ((name, test) for name, side in valve.sides.items() for test in side.tests):
        found = [branch(test.recorded.rising), branch(test.recorded.falling)]
        yield _curve(name, test.dp_MPa, "before", origin_of(valve), found, valve.u_max_V)


def _curve(
    side: str, dp_MPa: float | None, name: Set, origin: Origin, found: Sequence[Branch | None], full: float
) -> CharacteristicCurve:
    """Return a recorded curve from command, in units of `full` command, flow, and samples of both, of each branch."""
    sign = SIDES[side]
    branches = {word: each for word, each in zip(BRANCHES, found, strict=True) if each}
    return CharacteristicCurve(
        side=side,
        dp_MPa=dp_MPa,
        set=name,
        origin=origin,
        branches={word: _points(each[0], each[1], sign / full, sign) for word, each in branches.items()},
        samples=tuple(_points(each[2], each[3], sign / full, sign) for each in branches.values() if each[2]),
    )


def _simulated(loops: Mapping[str, Curves]) -> Iterator[CharacteristicCurve]:
    """Return the curves of the closed loop, with the compensator."""
    for side, sign in SIDES.items():
        columns = loops.get(closed_loop_name(side), {})
        for column in columns:
            if column.startswith("q_with_"):
                command, flow = columns["command_percent"] / 100, columns[column]
                top = int(np.argmax(command))
                yield CharacteristicCurve(
                    side=side,
                    dp_MPa=float(column.removeprefix("q_with_").removesuffix("_MPa_L_min")),
                    set="after",
                    origin="simulated",
                    branches={
                        "opening": _points(command[: top + 1], flow[: top + 1], sign, sign),
                        "closing": _points(command[top:][::-1], flow[top:][::-1], sign, sign),
                    },
                )


def _points(command: object, flow: object, per_command: float, per_flow: float) -> Points:
    return Points(
        command=np.asarray(command, dtype=float) * per_command, q_L_min=np.asarray(flow, dtype=float) * per_flow
    )


def same_pressure(one: float | None, other: float | None) -> bool:
    """Return whether two pressure drops count as one, as recordings are compared."""
    if one is None or other is None:
        return one is other
    return abs(one - other) <= SAME_PRESSURE * max(one, other)


def pressure_hues(pressures_MPa: Iterable[float | None]) -> PressureHues:
    """Return the shades of pressure drops, of which those that count as one have one."""
    known: list[float] = []
    for dp_MPa in sorted(each for each in pressures_MPa if each is not None):
        if not known or not same_pressure(known[-1], dp_MPa):
            known.append(dp_MPa)
    return PressureHues(tuple(known))


# --- what they come to -----------------------------------------------------------------------------------------


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
            {key: Found(reading.value, reading.at_most) for key, reading in item.readings(name).items()}
            for name in SETS
        )
        old, new = (each.get("largest_flow", Found(None)).value for each in (before, after))
        if old and new is not None:
            after[LOSS] = Found(100 * (1 - new / old))
        yield PressureQuantities(
            side=item.side,
            dp_MPa=item.dp_MPa,
            reading_flow_L_min=item.reading_flow_L_min,
            before=before,
            after=after,
            limits={limit.quantity: limit for limit in assessment.limits if limit.place == place},
        )


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
        IDEAL: Found(100 * loop.ideal_line),
        "flow_at_zero": Found(loop.q_zero_L_min) if seen else Found(None, unseen),
    }


def _with_symmetry(found: Sequence[PressureQuantities]) -> tuple[PressureQuantities, ...]:
    """Add the symmetry of both sides' gains to the positive side."""

    def symmetric(one: Mapping[str, Found], other: Mapping[str, Found]) -> dict[str, Found]:
        over, under = (each.get("gain", Found(None)).value for each in (one, other))
        return {**one, "symmetry": Found(100 * (over / under - 1))} if over and under else {**one}

    made = []
    for one in found:
        other = next(
            (each for each in found if each.side != one.side and same_pressure(each.dp_MPa, one.dp_MPa)), None
        )
        if one.side == "positive" and other:
            one = replace(
                one, before=symmetric(one.before, other.before), after=symmetric(one.after, other.after)
            )
        made.append(one)
    return tuple(made)


def entry_of(record: Mapping[str, str], names: Sequence[str]) -> str:
    """Return the first entry of a record that has one of these names; case, dashes and blanks do not count."""
    known = {" ".join(name.lower().replace("-", " ").replace("_", " ").split()): text for name, text in record.items()}
    return next((known[name] for name in names if name in known), "")
