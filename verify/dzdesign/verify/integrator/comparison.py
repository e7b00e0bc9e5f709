"""The native plant beside CasADi's integrator, over a window of each kind of scenario: ramp, step and load step."""

import ctypes
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, LoopRun
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.integrator.compiled_calls import compiled_core
from dzdesign.verify.integrator.reference_loop import Course, ReferenceLoop, ReferenceRun
from dzdesign.verify.loop_results import PlantComparison, WindowKind
from dzdesign.verify.requirements import NATIVE_PLANT, Check

#: Of all windows together, s.
WINDOWS_S = 2.0
#: Largest differences: of the position over the stroke, and of the flow over the largest one of the window.
MOST_APART = 1e-5
#: What is stored of a difference that is no number.
NO_NUMBER = 1e6
#: The command over the share of a window that has passed.
COMMANDS: dict[WindowKind, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "ramp": ((0.0, 0.05, 0.5, 0.9, 1.0), (0.0, 0.0, 0.3, 0.0, 0.0)),
    "step": ((0.0, 0.05, 0.05, 0.45, 0.45, 0.65, 0.65, 1.0), (0.0, 0.0, 1.0, 1.0, 0.5, 0.5, 0.0, 0.0)),
    "load step": ((0.0, 0.05, 0.5, 0.9, 1.0), (0.0, 0.0, 0.6, 0.0, 0.0)),
}
#: And where in it the pressure drop jumps.
JUMPS_AT = 0.4
#: Zero command before a window, beyond what an interlock waits for, s.
REST_S = 0.01
#: Time constants after which no more than 1e-13 is left of what was before.
SETTLED = 30


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """What happens in a window, and where."""

    kind: WindowKind
    scene: Scene
    then_MPa: float
    seconds: float


def windows_of(scenes: Sequence[Scene]) -> list[Window]:
    """Return the windows of every side: the ramp at its lowest pressure drop, the step at its highest, and between."""
    chosen: list[tuple[WindowKind, Scene, float]] = []
    for side in dict.fromkeys(scene.side for scene in scenes):
        own = sorted((scene for scene in scenes if scene.side == side), key=lambda scene: scene.dp_MPa)
        chosen += [("ramp", own[0], own[0].dp_MPa), ("step", own[-1], own[-1].dp_MPa)]
        if own[0].tested_MPa:
            chosen.append(("load step", own[0], own[0].tested_MPa[1]))
    return [
        Window(kind=kind, scene=scene, then_MPa=then_MPa, seconds=WINDOWS_S / len(chosen))
        for kind, scene, then_MPa in chosen
    ]


def compare_with_integrator(
    firmware: Path, scenes: Sequence[Scene], say: Callable[[str], None]
) -> tuple[tuple[PlantComparison, ...], Check]:
    """Run every window in both loops; return what is between them, and whether it is little enough."""
    say("comparing the plant with CasADi's integrator")
    try:
        found = tuple(_compared(firmware, windows_of(scenes)))
    except RuntimeError as error:  # of CasADi, of an integrator that gives up
        reason = next((line for line in reversed(str(error).splitlines()) if line.strip()), "no reason given")
        text = f"CVODES gave up ({reason.strip()[:100]}): correct mass, spring, damping or coil in --plant"
        return (), NATIVE_PLANT.check(holds=None, text=text)
    first = scenes[0]
    return found, native_plant_check(
        found, first.units, is_stand_in=first.loop.is_stand_in, by_current=first.loop.controls_current
    )


def _compared(firmware: Path, windows: Sequence[Window]) -> Iterator[PlantComparison]:
    library: ctypes.CDLL | None = None
    for window in windows:
        library = library or compiled_core(firmware, window.scene.loop.coil)
        yield compare(window, library)


def compare(window: Window, library: ctypes.CDLL) -> PlantComparison:
    """Run one window in both loops, from rest, and return what is between them."""
    scene, loop = window.scene, window.scene.loop
    command, supply = _course(window)
    native = loop.run(command, supply, "compensated", back_MPa=scene.back_MPa, periods_per_record=1)
    begin, first, end = _span(window, native)
    end = min(end, command.size)
    course = Course(
        command=command[:end], supply_MPa=supply[:end], back_MPa=scene.back_MPa,
        native_codes=np.stack([native.code_a, native.code_b], axis=1)[:end].astype(int),
    )  # fmt: skip
    reference = ReferenceLoop(
        scene.plant, library, scene.compensator.signals, scene.sign, loop.coil,
        without_dither=loop.wave()[2],
    ).run(course, begin)  # fmt: skip
    return _result(window, native, reference, begin, slice(first, end))


def _course(window: Window) -> tuple[np.ndarray, np.ndarray]:
    """Return command and pressure drop at no flow, a value for each period; slower ramps of the drive stretch it."""
    loop = window.scene.loop
    count = round((window.seconds + 2 * loop.slowest_ramp_s) / PWM_PERIOD_S)
    passed = np.arange(count) / count
    times, levels = COMMANDS[window.kind]
    before = np.zeros(round((loop.waits_s + REST_S) / PWM_PERIOD_S))
    command = np.concatenate([before, np.interp(passed, times, levels)])
    supply = np.full(command.size, window.scene.dp_MPa)
    supply[before.size + round(JUMPS_AT * count) :] = window.then_MPa
    return command, supply


def _span(window: Window, native: LoopRun) -> tuple[int, int, int]:
    """Return the periods in which the reference begins, from which on it is compared, and with which it ends.

    It begins before the first pulse: the play remembers a current that does not move the spool yet. Behind a slow ramp
    of the drive, which opens the valve long after that, it begins later, from rest all the same, and is compared once
    coil and spool have forgotten where they were; by then a rising command has brought the play to its end. A coil's
    controller remembers, so there it begins with the run.
    """
    count, plant = round(window.seconds / PWM_PERIOD_S), window.scene.plant.parameters
    moved = np.flatnonzero(native.position_mm > 0)
    flows = np.flatnonzero(native.q_L_min > native.q_L_min[0] + NO_FLOW_L_MIN)
    pulses = np.flatnonzero(native.compare > 0)
    leaves, opens, driven = (int(found[0]) if found.size else 0 for found in (moved, flows, pulses))
    begin = min(leaves, driven)
    late = opens - count // 2
    if window.scene.loop.controls_current:
        return 0, 0, max(late, begin) + count
    if late <= begin:
        return begin, begin, begin + count
    return max(late - _forgets(plant), 0), late, late + count


def _forgets(plant: Plant) -> int:
    """Return the periods in which coil and spool forget where they were."""
    half_damping = plant.B_e_N_s_m / (2 * plant.m_e_kg)
    square = half_damping**2 - plant.K_et_N_m / plant.m_e_kg
    slowest = half_damping - math.sqrt(max(square, 0.0))
    return math.ceil(SETTLED / max(min(slowest, plant.coil_rad_s), 1.0) / PWM_PERIOD_S)


def _result(
    window: Window, native: LoopRun, reference: ReferenceRun, begin: int, part: slice
) -> PlantComparison:  # fmt: skip
    stroke_mm, since = window.scene.plant.parameters.stroke_mm, slice(part.start - begin, None)
    largest = float(reference.q_L_min[since].max())
    position = float(np.abs(native.position_mm[part] - reference.position_mm[since]).max()) / stroke_mm
    flow = float(np.abs(native.q_L_min[part] - reference.q_L_min[since]).max())
    return PlantComparison(
        kind=window.kind,
        side=window.scene.side,
        dp_MPa=window.scene.dp_MPa,
        then_MPa=window.then_MPa,
        seconds=(part.stop - part.start) * PWM_PERIOD_S,
        position_difference=_number(position),
        flow_difference=_number(flow / largest if largest > 0 else flow),
        q_largest_L_min=largest,
        unlike_compare_values=int(np.count_nonzero(native.compare[part] != reference.compare[since])),
        codes_at_border=reference.codes_at_border,
        impacts=reference.impacts,
    )


def _number(difference: float) -> float:
    return difference if difference < NO_NUMBER else NO_NUMBER


def native_plant_check(
    found: Sequence[PlantComparison], units: RecordedUnits, *, is_stand_in: bool, by_current: bool
) -> Check:
    """Tell whether the native plant is as near to the integrator as it must be."""
    position = max(found, key=lambda each: each.position_difference)
    flow = max(found, key=lambda each: each.flow_difference)
    unlike = sum(each.unlike_compare_values for each in found)
    text = (
        f"at most {position.position_difference:.1e} of the stroke ({_where(position, units)}) and "
        f"{flow.flow_difference:.1e} of the largest flow ({_where(flow, units)}) from CasADi's CVODES, which "
        f"drives the same compiled core from PWM edge to PWM edge over {sum(each.seconds for each in found):.2g} s; "
        f"allowed: {MOST_APART:.0e}; {sum(each.impacts for each in found)} stops met, as events in both"
    )
    if unlike:
        text += f"; {unlike} compare values differ"
    if by_current:
        text += "; the coil with its controller is in both"
    if is_stand_in:
        text += "; the recorded flow is read a second time by its rules, which CVODES knows nothing of"
    within = position.position_difference <= MOST_APART and flow.flow_difference <= MOST_APART and unlike == 0
    shut = [each for each in found if each.q_largest_L_min <= 0]
    if within and shut:
        text += f"; the valve did not open in {len(shut)} of {len(found)} windows ({_where(shut[0], units)})"
    return NATIVE_PLANT.check(holds=None if within and shut else within, text=text)


def _where(found: PlantComparison, units: RecordedUnits) -> str:
    if found.kind == "load step":
        first, then = (units.text(each, ".3g MPa") for each in (found.dp_MPa, found.then_MPa))
        return f"load step from {first} to {then}"
    return f"{found.kind} at {units.text(found.dp_MPa, '.3g MPa')}"
