"""The machine as it was declared: pressures that are read wrong, and all of its tolerances at their worst at once.

Nothing of `design`'s budget is used: what a component is at its end acts on the plant, the coil, the supply and the
codes, and the valve closes at the lower bound of its threshold, which is argued from the ramp tests again.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dzdesign.design.target_inputs import Converter
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED, at_corner, drive_corners
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, RECORD_S, ReadingErrors
from dzdesign.verify.closed_loop.scene import STEP_S, Scene
from dzdesign.verify.exhaustive.zero_command import bound_at, guarded_bounds
from dzdesign.verify.loop_results import ScenarioResult

SEED = 1
#: Which way dP is read wrong.
WAYS = {"low": -1, "high": 1}
#: Where the plant's threshold is found, s: it is held open, closed quickly while it still is, then slowly, so that the
#: spool comes to rest as from a slow closing; and judged at the end of the last command. That is halved so often.
OPEN_S, QUICK_S, SLOW_S, HELD_S, JUDGED_S = 0.15, 0.1, 0.6, 0.6, 0.2
SLOW_FROM, HALVINGS = 0.02, 17
#: Zero command before an opening, beyond what an interlock waits for, s.
REST_S = 0.1


def reading_errors(scene: Scene, way: int, *, bench: bool = False) -> ReadingErrors:
    """Return errors of sensors and converter by which dP reads too low or too high, with noise at its peak.

    As declared; of a machine that was not, those of the target's converter alone. With `bench` the gauge of the bench
    was wrong too, which is one of the sensor ahead, and the command reads too far into the side.
    """
    machine, target, command = scene.compensator.machine, scene.compensator.target, scene.compensator.command_error
    converter = target.converter if target else Converter()
    offset, gain, noise = (
        (machine.pressure_offset_codes, machine.pressure_gain_codes, machine.pressure_noise_codes)
        if machine
        else (converter.offset_codes, converter.gain_codes, converter.noise_codes)
    )
    names = scene.loop.channels.names
    ahead_MPa, behind_MPa = (machine.pressure_error_MPa(name) for name in names) if machine else (0.0, 0.0)
    ahead_MPa += machine.bench_pressure_error_MPa if machine and bench else 0.0
    own_ahead, own_behind = np.array([ahead_MPa, behind_MPa]) * scene.loop.channels.per_unit[1:]
    reads_command = bench and scene.compensator.zero_band_codes > 0
    direction = scene.compensator.signals.command.direction(scene.sign)
    return ReadingErrors(
        offset_codes=(
            direction * command.offset_codes * reads_command,
            way * (offset + own_ahead),
            -way * (offset + own_behind),
        ),
        gain_codes=(0.0, way * gain, -way * gain),
        noise_codes=(command.noise_codes * reads_command, noise, noise),
        seed=SEED,
    )


def readings_off(scene: Scene) -> Iterator[ScenarioResult]:
    """Pressures that sensors and converter read wrong; judged while it lasts."""
    machine, command = scene.compensator.machine, scene.opened_and_closed()
    for name, way in WAYS.items():
        errors = reading_errors(scene, way)
        yield scene.result(
            f"dP read too {name}: {'sensors and ' if machine else ''}converter off, ±{errors.noise_codes[1]} codes of "
            "noise",
            scene.run(command, errors=errors),
            judged=slice(command.size - scene.held(0).size, None),
            not_required="" if machine else NOT_DECLARED,
        )


def all_at_the_worst(scene: Scene) -> Iterator[ScenarioResult]:
    """Every tolerance of a declared machine at its end at once, on a valve that closes at its certified bound.

    Coil, supply or current at each of their declared corners, oil and ageing where they take most of the threshold,
    pressures read wrong either way and zero command too far into the side: what passes most of these is kept.
    """
    machine = scene.compensator.machine
    if machine is None:
        return
    aged = (1 - machine.oil_error) * (1 - machine.ageing_error)
    bound_V = float(bound_at(guarded_bounds(scene.compensator, scene.sign), scene.dp_MPa))
    moved_V, found = max(closing_V(scene) - bound_V, 0.0), []
    # A zero command that is read too far into the side counts for less of what an interlock waits for.
    rest = np.zeros(round((REST_S + scene.loop.waits_s) / STEP_S))
    command = np.concatenate([rest, scene.opened_and_closed()])
    for corner in (each for each in drive_corners(scene.compensator) if not each.not_required):
        loop = (at_corner(scene, corner) or scene).loop.with_drive(1 / aged)
        there = replace(scene, loop=loop.with_added_drive(loop.added_V / aged + moved_V))
        for way in WAYS.values():
            run = there.run(command, errors=reading_errors(scene, way, bench=True))
            judged = slice(command.size - scene.held(0).size, None)
            figures = {"largest_flow_L_min": float(run.q_mean_L_min.max())}
            found.append(there.result("all tolerances at their worst at once", run, judged=judged, figures=figures))
    yield max(found, key=lambda each: each.q_beyond_L_min)


def closing_V(scene: Scene) -> float:
    """Return where the plant of a scene closes, without the compensator, V; what is allowed at zero command is none."""
    loop = scene.loop
    none = max(loop.leak_L_min(scene.dp_MPa), loop.allowed_at_zero_L_min(scene.dp_MPa) or 0.0) + NO_FLOW_L_MIN
    opened, quick, slow, held, judged = (round(each / RECORD_S) for each in (OPEN_S, QUICK_S, SLOW_S, HELD_S, JUDGED_S))
    closing = np.concatenate([
        np.ones(opened), np.linspace(1, SLOW_FROM, quick, endpoint=False),
        np.linspace(SLOW_FROM, 0, slow, endpoint=False), np.zeros(held),
    ])  # fmt: skip
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        run = loop.run(middle + closing * (1 - middle), scene.dp_MPa)
        shut = float(run.q_largest_L_min[-judged:].max()) <= none
        low, high = (middle, high) if shut else (low, middle)
    return low * loop.u_max_V
