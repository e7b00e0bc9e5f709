"""The loop of one side at one pressure drop; how a scenario is run and judged there, and to which digits it is kept."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from dzdesign.core.artefact_reading import rounded
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.verify.closed_loop.loop import NO_ERRORS, NO_FLOW_L_MIN, ClosedLoop, LoopRun, ReadingErrors
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.stand_in import stand_in_of
from dzdesign.verify.loop_results import PressureResult, ScenarioResult, Side

#: Two periods a record: as often as the core samples, 1.25 kHz.
PERIODS = 2
STEP_S = PERIODS * PWM_PERIOD_S
#: Time in which a spool has come to rest; and of a command's ramp, quick but far slower than the spool.
SETTLE_S, RAMP_S = 0.4, 2.0
#: Lowest and highest tested pressure drop, MPa.
Ends = tuple[float, float]
NO_FIGURES: Mapping[str, float] = MappingProxyType({})
#: Why a scenario is not required, in words of the report.
NO_CORE_CAN_KNOW = "the firmware cannot detect it"
#: Pressures downstream of the edge where none were given, MPa: a port open to the tank, and a pipe's back pressure.
BACKS_MPA = (0.0, 1.0)
#: Digits that mean something, of a flow in L/min, a share, a time in s: the last ones depend on the processor, by whose
#: instructions the linear algebra adds up, 1e-14 L/min from one to another. Evidence is compared by its hash.
DECIMALS = 9

Judged = TypeVar("Judged", PressureResult, ScenarioResult)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """The loop of one side at one pressure drop."""

    #: With the compensator.
    loop: ClosedLoop
    compensator: Compensator
    side: Side
    #: At no flow.
    dp_MPa: float
    #: Of the tests; None where the plant holds at `dp_MPa` only.
    tested_MPa: Ends | None
    #: Pressures downstream of the edge, rising; what has nothing to do with them runs at the highest.
    backs_MPa: tuple[float, ...]

    @property
    def sign(self) -> int:
        """Sign of the commands that drive the side."""
        return self.compensator.valve.sign_of(self.side)

    @property
    def identified(self) -> SideModel:
        """The side as it was identified."""
        return self.compensator.valve.sides[self.side]

    @property
    def units(self) -> RecordedUnits:
        """Units in which a scenario's name has its pressures."""
        return self.compensator.valve.recorded_units

    @property
    def back_MPa(self) -> float:
        """The highest pressure downstream of the edge that is within the sensors' spans at this pressure drop."""
        return self.back_within_span(self.backs_MPa[-1])

    def back_within_span(self, back_MPa: float) -> float:
        """Return a pressure behind the edge, or the highest that the sensors span at every tested pressure drop."""
        return self.loop.back_within_span(back_MPa, self.dp_MPa if self.tested_MPa is None else self.tested_MPa[1])

    @property
    def settle_s(self) -> float:
        """Time in which the valve has come to rest, the firmware's own ramps included."""
        return SETTLE_S + self.loop.slowest_ramp_s

    def held(self, level: float, times: float = 1) -> np.ndarray:
        """Return a command held for so many times the time to come to rest."""
        return np.full(round(times * self.settle_s / STEP_S), level)

    def waited(self, ramp_s: float = RAMP_S) -> np.ndarray:
        """Return the zero command that an interlock must see before a ramp up, beyond what the ramp begins with."""
        functions = self.compensator.drive_functions
        if functions.interlock_codes is None:
            return np.zeros(0)
        span = self.compensator.signals.command.span(self.sign)
        of_ramp = int(functions.interlock_codes / span * ramp_s / STEP_S) - 1
        return np.zeros(max(functions.fault_samples - of_ramp, 0))

    def opened_and_closed(self, ramp_s: float = RAMP_S) -> np.ndarray:
        """Return the command that leaves the spool as its hysteresis leaves it after use."""
        return np.concatenate([self.waited(ramp_s), ramp(0, 1, ramp_s), self.held(1), ramp(1, 0), self.held(0, 2)])

    def run(
        self,
        command: np.ndarray,
        *,
        supply_MPa: float | np.ndarray | None = None,
        back_MPa: float | np.ndarray | None = None,
        mode: str = "compensated",
        shown: np.ndarray | None = None,
        errors: ReadingErrors = NO_ERRORS,
    ) -> LoopRun:
        """Run the compensated loop at this pressure drop unless told otherwise."""
        return self.loop.run(
            command,
            self.dp_MPa if supply_MPa is None else supply_MPa,
            mode,
            back_MPa=self.back_MPa if back_MPa is None else back_MPa,
            shown=shown,
            errors=errors,
            periods_per_record=PERIODS,
        )

    def result(
        self,
        name: str,
        run: LoopRun,
        *,
        not_required: str = "",
        figures: Mapping[str, float] = NO_FIGURES,
        end_MPa: float | None = None,
        back_MPa: float | None = None,
        judged: slice | None = None,
    ) -> ScenarioResult:
        """Return the result, judged at its end, or by its largest flow where it is judged throughout.

        Zero command counts once the valve has had the time to come to rest. It ended at this pressure drop and at this
        pressure downstream of the edge unless told otherwise. `not_required` is the reason, if no flow is not required.
        """
        ended_MPa = self.dp_MPa if end_MPa is None else end_MPa
        shut = judged or np.flatnonzero(held_for(run.command <= 0, round(self.settle_s / STEP_S)))
        q_peak = float(run.q_largest_L_min[shut].max(initial=0.0))
        found = ScenarioResult(
            name=name,
            side=self.side,
            dp_MPa=self.dp_MPa,
            back_MPa=self.back_MPa if back_MPa is None else back_MPa,
            leak_L_min=self.loop.leak_L_min(ended_MPa),
            allowed_at_zero_L_min=self.loop.allowed_at_zero_L_min(ended_MPa),
            q_zero_L_min=q_peak if judged else float(run.q_largest_L_min[-1]),
            q_peak_at_zero_L_min=q_peak,
            unseen_below_L_min=self.loop.unseen_below_L_min(self.dp_MPa),
            must_shut=not not_required,
            not_required=not_required,
            figures={key: float(value) for key, value in figures.items()},
        )
        return stored(found)


def scenes_of(
    folder: Path, compensator: Compensator, plant: Plant | None, backs_MPa: Sequence[float] | None = None
) -> tuple[Scene, ...]:
    """Return the compensated loop of each side at every tested pressure drop.

    Without a plant the recorded characteristic stands in for the valve. Pressures behind the edge that were given must
    be within the sensors' spans; usual ones are lowered until they are.
    """
    valve = compensator.valve
    scenes: list[Scene] = []
    for sign in compensator.signals.signs:
        name, side = valve.side_name(sign), valve.side(sign)
        pressures = side.beta.dp_MPa or tuple(test.dp_MPa for test in side.tests if test.dp_MPa is not None)
        loop = ClosedLoop(plant or stand_in_of(side, valve.u_max_V), folder, compensator, sign)
        for back_MPa in backs_MPa or ():
            if loop.back_within_span(back_MPa, max(pressures)) < back_MPa:
                first, second = (valve.recorded_units.text(each, ".3g MPa") for each in (back_MPa, max(pressures)))
                raise InputError(
                    f"a back pressure of {first} and the tested {second} together exceed the sensors' span; give a "
                    "lower --back-pressure, or design with larger sensors"
                )
        # A recording at one pressure drop says nothing of another.
        tested = (min(pressures), max(pressures)) if plant or len(pressures) > 1 else None
        backs = tuple(sorted(BACKS_MPA if backs_MPa is None else backs_MPa))
        scenes += [
            Scene(loop=loop, compensator=compensator, side=name, dp_MPa=each, tested_MPa=tested, backs_MPa=backs)
            for each in pressures
        ]
    return tuple(scenes)


def ramp(start: float, end: float, seconds: float = RAMP_S) -> np.ndarray:
    """Return a ramp of the command."""
    return np.linspace(start, end, round(seconds / STEP_S))


def held_for(condition: np.ndarray, count: int) -> np.ndarray:
    """Return where a condition has held for so many records, this one included."""
    since = np.arange(condition.size) - np.maximum.accumulate(np.where(condition, -1, np.arange(condition.size)))
    return condition & (since > count)


def stored(result: Judged) -> Judged:
    """Return a result with its digits cut; a flow at zero command that is the leak stays one."""
    if abs(result.q_zero_L_min - result.leak_L_min) <= NO_FLOW_L_MIN:
        result = replace(result, q_zero_L_min=result.leak_L_min)
    return rounded(result, DECIMALS)


def rounded_up(difference: float) -> float:
    """Return a difference with its digits cut, an upper limit."""
    # So little above a step, as a rounding of doubles, is no reason for the next.
    return round(max(ceil(difference * 10.0**DECIMALS - 1e-3), difference > 0) / 10.0**DECIMALS, DECIMALS)
