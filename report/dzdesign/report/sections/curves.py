"""Flow against command without and with the compensator, of both sides: what the first page draws.

An assessment of recordings leads. Without one, the curves without the compensator are those that valve.json recorded,
and those with it are of the simulated closed loop.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from msgspec import UnsetType

from dzdesign.assess.assessment import Assessment, PressureAssessment
from dzdesign.assess.measured_curves import MeasuredCurve
from dzdesign.assess.options import SETS, Set
from dzdesign.identify.ramps.pooling import SAME_PRESSURE
from dzdesign.identify.valve.model import SIDES, ValveModel
from dzdesign.identify.valve.recorded_curve import RecordedBranch
from dzdesign.verify.closed_loop.ramps import Curves, closed_loop_name

#: Where a curve is from: recordings of a valve, recordings that are simulated themselves, or a simulated closed loop.
Origin = Literal["recorded", "example", "simulated"]
ORIGIN_WORDS: Mapping[Origin, str] = {
    "recorded": "recorded", "example": "simulated recordings", "simulated": "simulated closed loop",
}  # fmt: skip
#: Most points of a simulated branch that are drawn.
MOST_POINTS = 300
BRANCHES = ("opening", "closing")
Numbers = Sequence[float]
#: Command and flow, and those of the samples.
Branch = tuple[Numbers, Numbers, Numbers, Numbers]


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
                branches = [
                    (one.command_percent, one.q_L_min, one.sample_command_percent, one.sample_q_L_min) if one else None
                    for one in (curve.rising, curve.falling)
                ]
                yield _curve(item.side, item.dp_MPa, name, origin_of(assessment), branches, 100.0)


def measured_curve_of(item: PressureAssessment, name: Set) -> MeasuredCurve | None:
    """Return the curve of a set at one pressure drop; None where there is none, or none was kept."""
    ramps = item.before if name == "before" else item.after
    return None if ramps is None or isinstance(ramps.curve, UnsetType) else ramps.curve


def _recorded(valve: ValveModel) -> Iterator[CharacteristicCurve]:
    for name, side in valve.sides.items():
        for test in side.tests:
            both = (test.recorded.rising, test.recorded.falling)
            branches = [(one.u_V, one.q_L_min, *_samples_of(one)) if one else None for one in both]
            yield _curve(name, test.dp_MPa, "before", origin_of(valve), branches, valve.u_max_V)


def _samples_of(branch: RecordedBranch) -> tuple[Numbers, Numbers]:
    samples = branch.samples
    return ((), ()) if isinstance(samples, UnsetType) else (samples.u_V, samples.q_L_min)


def _curve(
    side: str, dp_MPa: float | None, name: Set, origin: Origin, branches: Sequence[Branch | None], full: float
) -> CharacteristicCurve:
    """Return a recorded curve from command, in units of `full` command, flow, and samples of both, of each branch."""
    sign = SIDES[side]
    named = {word: each for word, each in zip(BRANCHES, branches, strict=True) if each}
    return CharacteristicCurve(
        side=side,
        dp_MPa=dp_MPa,
        set=name,
        origin=origin,
        branches={word: _points(each[0], each[1], sign / full, sign) for word, each in named.items()},
        samples=tuple(_points(each[2], each[3], sign / full, sign) for each in named.values() if each[2]),
    )


def _simulated(loops: Mapping[str, Curves]) -> Iterator[CharacteristicCurve]:
    """Return the curves of the closed loop, with the compensator."""
    for side, sign in SIDES.items():
        columns = loops.get(closed_loop_name(side), {})
        for column in columns:
            if column.startswith("q_with_"):
                command, flow = columns["command_percent"] / 100, columns[column]
                top = int(np.argmax(command)) + 1
                yield CharacteristicCurve(
                    side=side,
                    dp_MPa=float(column.removeprefix("q_with_").removesuffix("_MPa_L_min")),
                    set="after",
                    origin="simulated",
                    branches={
                        "opening": _thinned(command[:top], flow[:top], sign),
                        "closing": _thinned(command[top - 1 :][::-1], flow[top - 1 :][::-1], sign),
                    },
                )


def _thinned(command: np.ndarray, flow: np.ndarray, sign: int) -> Points:
    every = max(1, -(-command.size // MOST_POINTS))
    kept = np.unique([*range(0, command.size, every), command.size - 1])
    return _points(command[kept], flow[kept], sign, sign)


def _points(command: object, flow: object, per_command: float, per_flow: float) -> Points:
    return Points(
        command=np.asarray(command, dtype=float) * per_command, q_L_min=np.asarray(flow, dtype=float) * per_flow
    )


def same_pressure(one: float | None, other: float | None) -> bool:
    """Return whether two pressure drops count as one, as recordings are compared."""
    if one is None or other is None:
        return one is other
    return abs(one - other) <= SAME_PRESSURE * max(one, other)
