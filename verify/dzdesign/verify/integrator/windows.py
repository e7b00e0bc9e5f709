"""What happens in a window of time: command, pressure drop, and all else that a scenario may give the closed loop."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.verify.closed_loop.loop import PERIODS_PER_RECORD, RECORD_S, ClosedLoop
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.readings import NO_ERRORS, ReadingErrors
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.closed_loop.stand_in import StandIn
from dzdesign.verify.loop_results import WindowKind

#: Of all windows together, s.
WINDOWS_S = 2.0
#: The command over the share of a window that has passed.
COMMANDS: dict[WindowKind, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "ramp": ((0.0, 0.05, 0.5, 0.9, 1.0), (0.0, 0.0, 0.3, 0.0, 0.0)),
    "step": ((0.0, 0.05, 0.05, 0.45, 0.45, 0.65, 0.65, 1.0), (0.0, 0.0, 1.0, 1.0, 0.5, 0.5, 0.0, 0.0)),
    "load step": ((0.0, 0.05, 0.5, 0.9, 1.0), (0.0, 0.0, 0.6, 0.0, 0.0)),
    "disturbances": ((0.0, 0.05, 0.35, 0.5, 0.75, 0.95, 1.0), (0.0, 0.0, 0.5, 0.15, 0.6, 0.0, 0.0)),
}
#: And where in it the pressure drop jumps.
JUMPS_AT = 0.4
#: Zero command before a window, beyond what an interlock waits for, s.
REST_S = 0.01
#: The disturbances. Pressure drops: a share of the way from the lowest test to the highest, over the share that has
#: passed; shares beyond 0 and 1 lie beyond the tests, as far down as a share of the lowest, as far up as sensors span.
LEAST_SUPPLY = 0.8
SUPPLIES = ((0.0, 0.37), (0.25, 1.25), (0.45, -1.0), (0.6, 0.81))
#: Pressure behind the edge, MPa; what is added to the drive, shares of full command; over the share that has passed.
BACKS_MPA = ((0.0, 0.0), (0.3, 0.7))
ADDED = ((0.0, 0.0), (0.15, 0.02), (0.55, -0.01))
#: When sensor A is broken, and what it then reads; sensor B's code is its own.
BROKEN = (0.66, 0.75)
#: Times the drive, the oil's viscosity and its density.
DRIVE, VISCOSITY, DENSITY = 1.03, 0.5, 0.97
#: What converter and sensors read wrong; a command of both signs is read right, for the interlock must see its zero.
ERRORS = ReadingErrors(offset_codes=(0.0, 1.5, -2.25), gain_codes=(3.0, -4.0, 5.0), noise_codes=(0, 2, 1), seed=11)


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """What happens in a window, and where."""

    kind: WindowKind
    scene: Scene
    then_MPa: float
    seconds: float

    @property
    def is_disturbed(self) -> bool:
        """Whether more than command and pressure drop change in it."""
        return self.kind == "disturbances"

    @property
    def plant(self) -> Plant | StandIn:
        """The plant, with its oil."""
        plant = self.scene.plant
        return plant.with_oil(VISCOSITY, DENSITY) if self.is_disturbed else plant

    @property
    def drive(self) -> float:
        """Times the drive at the plant."""
        return DRIVE if self.is_disturbed else 1.0

    @property
    def loop(self) -> ClosedLoop:
        """The native loop, with that plant and that drive."""
        loop = self.scene.loop
        return loop.with_plant(self.plant).with_drive(self.drive) if self.is_disturbed else loop

    @property
    def errors(self) -> ReadingErrors:
        """What is read wrong."""
        if not self.is_disturbed:
            return NO_ERRORS
        at_zero = self.scene.compensator.signals.command.zero_code
        return ERRORS if at_zero == 0 else replace(ERRORS, gain_codes=(0.0, *ERRORS.gain_codes[1:]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """What happens, a value for each record, or for each period of the PWM, (N,); the sensors' codes (N, 2).

    A code below zero is that of the plant's own pressure.
    """

    command: np.ndarray
    supply_MPa: np.ndarray
    back_MPa: np.ndarray
    added_V: np.ndarray
    shown: np.ndarray

    def by_period(self) -> "Course":
        """Return it with a value for each period, each held through its record."""
        names = ("command", "supply_MPa", "back_MPa", "added_V", "shown")
        return Course(**{name: np.repeat(getattr(self, name), PERIODS_PER_RECORD, axis=0) for name in names})


def windows_of(scenes: Sequence[Scene]) -> list[Window]:
    """Return the windows of every side: the ramp at its lowest pressure drop, the step at its highest, and between."""
    chosen: list[tuple[WindowKind, Scene, float]] = []
    for side in dict.fromkeys(scene.side for scene in scenes):
        own = sorted((scene for scene in scenes if scene.side == side), key=lambda scene: scene.dp_MPa)
        chosen += [("ramp", own[0], own[0].dp_MPa), ("step", own[-1], own[-1].dp_MPa)]
        if own[0].tested_MPa:
            chosen.append(("load step", own[0], own[0].tested_MPa[1]))
        chosen.append(("disturbances", own[-1], own[-1].dp_MPa))
    return [
        Window(kind=kind, scene=scene, then_MPa=then_MPa, seconds=WINDOWS_S / len(chosen))
        for kind, scene, then_MPa in chosen
    ]


def course_of(window: Window) -> Course:
    """Return what happens in a window, a value for each record; slower ramps of the drive stretch it."""
    scene = window.scene
    count = round((window.seconds + 2 * scene.loop.slowest_ramp_s) / RECORD_S)
    before = int(np.ceil((scene.loop.waits_s + REST_S) / RECORD_S))
    passed = np.concatenate([np.zeros(before), np.arange(count) / count])
    times, levels = COMMANDS[window.kind]
    command = np.interp(passed, times, levels)
    # A corner that is a jump counts from its record on.
    supply = np.where(passed < JUMPS_AT, scene.dp_MPa, window.then_MPa)
    back, added = np.full(command.size, scene.back_MPa), np.zeros(command.size)
    shown = np.full((command.size, 2), -1, dtype=np.int32)
    if window.is_disturbed:
        span_MPa = scene.loop.span_MPa
        if scene.tested_MPa is not None:
            low, high = scene.tested_MPa
            supply = np.clip(_held(passed, SUPPLIES) * (high - low) + low, LEAST_SUPPLY * low, span_MPa)
        back = np.minimum(_held(passed, BACKS_MPA), span_MPa - supply)
        added = _held(passed, ADDED) * scene.loop.u_max_V
        shown[(passed >= BROKEN[0]) & (passed < BROKEN[1]), 0] = 0
    return Course(command=command, supply_MPa=supply, back_MPa=back, added_V=added, shown=shown)


def _held(passed: np.ndarray, levels: Sequence[tuple[float, float]]) -> np.ndarray:
    """Return the level of each share that has passed, from its own share on."""
    begins, values = np.array(levels).T
    held: np.ndarray = values[np.searchsorted(begins, passed, side="right") - 1]
    return held
