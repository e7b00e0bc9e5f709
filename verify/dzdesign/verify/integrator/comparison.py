"""The native plant beside CasADi's integrator, over a window of each kind of scenario.

Ramp, step and load step; and all that scenarios, machines and sensors that fail may give the loop beside them.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, PERIODS_PER_RECORD, LoopRun
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.closed_loop.stored_digits import stored_comparison
from dzdesign.verify.integrator.compiled_calls import compiled_core
from dzdesign.verify.integrator.direct_drive import unlike_direct_values
from dzdesign.verify.integrator.reference_loop import ReferenceLoop, ReferenceRun
from dzdesign.verify.integrator.windows import Window, course_of, windows_of
from dzdesign.verify.loop_results import PlantComparison
from dzdesign.verify.requirements import NATIVE_PLANT, Check
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary

#: Largest differences: of the position over the stroke, and of the flow over the largest one of the window.
MOST_APART = 1e-5
#: What is stored of a difference that is no number.
NO_NUMBER = 1e6
#: Time constants after which no more than 1e-13 is left of what was before.
SETTLED = 30


def compare_with_integrator(
    firmware: Path, scenes: Sequence[Scene], say: Callable[[str], None]
) -> tuple[tuple[PlantComparison, ...], Check]:
    """Run every window in both loops; return what is between them, and whether it is little enough."""
    say("comparing the plant with CasADi's integrator")
    try:
        found = tuple(map(stored_comparison, _compared(firmware, windows_of(scenes))))
    except RuntimeError as error:  # of CasADi, of an integrator that gives up
        reason = next((line for line in reversed(str(error).splitlines()) if line.strip()), "no reason given")
        text = f"CVODES gave up ({reason.strip()[:100]}): correct mass, spring, damping or coil in --plant"
        return (), NATIVE_PLANT.check(holds=None, text=text)
    first = scenes[0]
    return found, native_plant_check(
        found, first.units, is_stand_in=first.loop.is_stand_in, by_current=first.loop.controls_current
    )


def _compared(firmware: Path, windows: Sequence[Window]) -> Iterator[PlantComparison]:
    library: CompiledLibrary | None = None
    for window in windows:
        library = library or compiled_core(firmware, window.scene.loop.coil)
        yield compare(window, library)


def compare(window: Window, library: CompiledLibrary) -> PlantComparison:
    """Run one window in both loops, from rest, and return what is between them.

    The native loop runs twice: with a record for each period, and as the ramps of the closed loop have it; and in the
    step with a direct command once more, where that has a wave about it.
    """
    scene, loop, records = window.scene, window.loop, course_of(window)
    course = records.by_period()
    native, coarse = (
        loop.run(
            each.command, each.supply_MPa, "compensated", back_MPa=each.back_MPa, added_V=each.added_V,
            shown=each.shown, errors=window.errors, periods_per_record=periods,
        )
        for each, periods in ((course, 1), (records, PERIODS_PER_RECORD))
    )  # fmt: skip
    begin, first, end = (each // PERIODS_PER_RECORD * PERIODS_PER_RECORD for each in _span(window, native))
    end = min(end, course.command.size)
    reference = ReferenceLoop(
        window.plant, library, scene.compensator.signals, scene.sign, loop.coil,
        without_dither=loop.wave()[2], drive=window.drive,
    ).run(course, window.errors, np.stack([native.code_a, native.code_b], axis=1).astype(int), begin, end)  # fmt: skip
    unlike = unlike_direct_values(window, library, course, native) if window.kind == "step" else 0
    return _result(window, native, coarse, reference, begin, slice(first, end), unlike)


def _span(window: Window, native: LoopRun) -> tuple[int, int, int]:
    """Return the periods in which the reference begins, from which on it is compared, and with which it ends.

    It begins before the first pulse: the play remembers a current that does not move the spool yet. Behind a slow ramp
    of the drive, which opens the valve long after that, it begins later, from rest all the same, and is compared once
    coil and spool have forgotten where they were; by then a rising command has brought the play to its end. A coil's
    controller remembers, so there it begins with the run.
    """
    count, plant = round(window.seconds / PWM_PERIOD_S), window.plant.parameters
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
    window: Window, native: LoopRun, coarse: LoopRun, reference: ReferenceRun, begin: int, part: slice, direct: int
) -> PlantComparison:
    stroke_mm, since = window.plant.parameters.stroke_mm, slice(part.start - begin, None)
    flows = reference.q_L_min[since]
    largest = float(flows.max())
    position = float(np.abs(native.position_mm[part] - reference.position_mm[since]).max()) / stroke_mm
    records = slice(part.start // PERIODS_PER_RECORD, part.stop // PERIODS_PER_RECORD)
    of_record = flows.reshape(-1, PERIODS_PER_RECORD)
    apart = (
        native.q_L_min[part] - flows,
        coarse.q_L_min[records] - of_record[:, -1],
        coarse.q_mean_L_min[records] - of_record.mean(axis=1),
        coarse.q_largest_L_min[records] - of_record.max(axis=1),
    )
    flow = max(float(np.abs(each).max()) for each in apart)
    unlike = direct + int(np.count_nonzero(native.compare[part] != reference.compare[since]))
    return PlantComparison(
        kind=window.kind,
        side=window.scene.side,
        dp_MPa=window.scene.dp_MPa,
        then_MPa=window.then_MPa,
        seconds=(part.stop - part.start) * PWM_PERIOD_S,
        position_difference=_number(position),
        flow_difference=_number(flow / largest if largest > 0 else flow),
        q_largest_L_min=largest,
        unlike_compare_values=unlike + reference.unlike_codes,
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
        f"over {sum(each.seconds for each in found):.2g} s with the same compiled core, spool and flow differ from "
        f"CasADi's CVODES by at most {position.position_difference:.1e} of the stroke ({_where(position, units)}) and "
        f"{flow.flow_difference:.1e} of the largest flow ({_where(flow, units)}); allowed: {MOST_APART:.0e}; the spool "
        f"met its stops {sum(each.impacts for each in found)} times in both"
    )
    if unlike:
        text += f"; {unlike} compare values or codes differ"
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
    if found.kind == "disturbances":
        return "with disturbances"
    return f"{found.kind} at {units.text(found.dp_MPa, '.3g MPa')}"
