"""What a machine does to a valve beside ramps: steps, load steps, noise, wrong readings, a reset, cold and hot oil.

Each pressure sensor fails by itself: its wire breaks, it is shorted, it is stuck; at each pressure behind the edge.
Coil and supply stand in drive_corners.py, wrong readings and the declared machine in declared_machine.py.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dzdesign.verify.closed_loop.declared_machine import all_at_the_worst, readings_off
from dzdesign.verify.closed_loop.drive_corners import coil_and_supply
from dzdesign.verify.closed_loop.loop import LoopRun
from dzdesign.verify.closed_loop.ramps import hysteresis_of
from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW, SETTLE_S, STEP_S, Ends, Scene, ramp
from dzdesign.verify.loop_results import ScenarioResult

#: Of the final flow: where a rise begins and ends, and how near it is settled.
RISE, SETTLED = (0.1, 0.9), 0.05
#: Standard deviation of the noise on the command, share of full.
NOISE = 0.002
SEED = 1
#: Viscosity (damping goes with it) and density of a mineral oil of class VG 46 against 40 °C: about 0 °C and 80 °C.
OILS = {"cold oil, 8 times the viscosity": (8.0, 1.03), "hot oil, a quarter of the viscosity": (0.25, 0.97)}
#: Hysteresis of a valve at a slower ramp than the bench's, over the recorded one.
SLOWER = 0.5
#: Time of its ramp, slow against coil and spool, s.
SLOW_S = 20.0
#: Pressure drops above the tested ones, over the highest of these.
ABOVE = (1.25, 1.6, 2.0)


def run_scenarios(scene: Scene) -> Iterator[ScenarioResult]:
    """Run every scenario of one side at one pressure drop."""
    yield _steps(scene)
    if scene.tested_MPa:
        yield _load_step_at_zero(scene, scene.tested_MPa)
        yield _load_step_in_motion(scene, scene.tested_MPa)
        yield _stuck_readings(scene, scene.tested_MPa)
        yield _above_the_tests(scene, scene.tested_MPa)
    yield from sensor_failures(scene)
    yield _noise_at_zero(scene)
    yield from converter_off_at_zero(scene)
    yield from readings_off(scene)
    yield _restart(scene)
    yield from coil_and_supply(scene)
    yield from all_at_the_worst(scene)
    yield from _oils(scene)
    if scene.compensator.drive_functions.has_play:
        yield _slower_ramp(scene)


def _steps(scene: Scene) -> ScenarioResult:
    """Steps of the command, zero to half and back, with and without compensator (the paper's Fig. 8)."""
    half = scene.held(0.5, 2)
    command = np.concatenate([scene.opened_and_closed(), half, scene.held(0, 2)])
    start, stop = command.size - 2 * half.size, command.size - half.size
    runs = {mode: scene.run(command, mode=mode) for mode in ("compensated", "direct")}
    figures = {}
    for name, run in runs.items():
        step = run.q_L_min[start:stop]
        final = float(step[-1])
        figures[f"{name}_flow_L_min"] = final
        if final > 0:
            begins, ends = (int(np.argmax(step / final >= level)) for level in RISE)
            unsettled = np.flatnonzero(np.abs(step / final - 1) > SETTLED)
            figures[f"{name}_rise_ms"] = 1e3 * STEP_S * (ends - begins)
            figures[f"{name}_settling_ms"] = 1e3 * STEP_S * (int(unsettled[-1]) + 1 if unsettled.size else 0)
            figures[f"{name}_overshoot_percent"] = max(100 * float(step.max() / final - 1), 0.0)
    return scene.result("step to half command and back", runs["compensated"], figures=figures)


def _load_step_at_zero(scene: Scene, tested_MPa: Ends) -> ScenarioResult:
    """The pressure drop jumps to both ends of what was tested while the command is zero, and back."""
    before, quiet = scene.opened_and_closed(), scene.held(0, 8)
    quarter = quiet.size // 4
    lasts = [before.size + quarter, quarter, quarter, quiet.size - 3 * quarter]
    supply = np.repeat([scene.dp_MPa, *tested_MPa[::-1], scene.dp_MPa], lasts)
    run = scene.run(np.concatenate([before, quiet]), supply_MPa=supply)
    flow, unseen = run.q_mean_L_min[before.size :], scene.loop.unseen_below_L_min(scene.dp_MPa) or 0.0
    # Of a stand-in's flow that no recording shows there is no volume to be told.
    volume = {} if float(flow.max()) < unseen else {"volume_mL": flow.sum() * STEP_S / 60 * 1e3}
    return scene.result("load steps at zero command", run, figures=volume)


def _load_step_in_motion(scene: Scene, tested_MPa: Ends) -> ScenarioResult:
    """The pressure drop jumps in the middle of a ramp of the command."""
    then_MPa = tested_MPa[1] if scene.dp_MPa < sum(tested_MPa) / 2 else tested_MPa[0]
    run, jump = _changed_in_mid_ramp(scene, None, then_MPa)
    change = run.q_L_min[jump + round(SETTLE_S / STEP_S)] - run.q_L_min[jump - 1]
    figures = {"pressure_drop_then_MPa": then_MPa, "flow_change_L_min": change}
    return scene.result("load step in the middle of a ramp", run, figures=figures, end_MPa=then_MPa)


def _stuck_readings(scene: Scene, tested_MPa: Ends) -> ScenarioResult:
    """Both sensors freeze, then the pressure drop rises. The codes are sound: what it costs is shown, not required."""
    low, high = tested_MPa
    first, then = (scene.units.text(dp_MPa, ".2f MPa") for dp_MPa in tested_MPa)
    name = f"pressure readings stuck at {first} while the pressure drop is {then}"
    run, _ = _changed_in_mid_ramp(scene, scene.loop.channels.pressure_codes(low, scene.back_MPa), high)
    return scene.result(name, run, not_required=NO_CORE_CAN_KNOW, end_MPa=high)


def _changed_in_mid_ramp(scene: Scene, codes: np.ndarray | None, supply_MPa: float) -> tuple[LoopRun, int]:
    """Run a ramp up and down, and tell at which record, in mid-ramp, what the sensors show and the supply change.

    Without codes the sensors show the plant's own pressures.
    """
    command, change = _through_mid_ramp(scene)
    shown, supply = np.full((command.size, 2), -1), np.full(command.size, scene.dp_MPa)
    supply[change:] = supply_MPa
    if codes is not None:
        shown[change:] = codes
    return scene.run(command, supply_MPa=supply, shown=shown), change


def _above_the_tests(scene: Scene, tested_MPa: Ends) -> ScenarioResult:
    """The pressure drop rises to twice the highest that was tested, while the command is zero: judged at every rest.

    It stays within the sensors' spans: what they can't show, no core can know.
    """
    before, highest = scene.opened_and_closed(), tested_MPa[1]
    pressures = tuple(dict.fromkeys(min(factor * highest, scene.loop.span_MPa) for factor in ABOVE))
    each = scene.held(0, 2)
    steps = np.repeat(pressures, each.size)
    # In between the valve opens and closes there, as hysteresis may hold what a step alone does not move.
    ends = scene.opened_and_closed()
    command = np.concatenate([before, np.zeros(steps.size), ends])
    supply = np.concatenate([np.full(before.size, scene.dp_MPa), steps, np.full(ends.size, pressures[-1])])
    run = scene.run(command, supply_MPa=supply)
    last, first = (scene.units.text(dp_MPa, ".2f MPa") for dp_MPa in (pressures[-1], highest))
    choice, certificate = scene.compensator.above, scene.compensator.side(scene.sign).certificate
    reason = f"held above {first}, not certified" if choice == "hold" else f"not certified above {first}"
    # Required where the certificate goes on, or no offset is left.
    if choice == "release" or (choice != "hold" and certificate.holds_to_MPa > certificate.dp_MPa[1]):
        reason = ""
    found = scene.result(f"dP above the tests, up to {last}", run, not_required=reason, end_MPa=pressures[-1])
    rests = before.size + each.size * np.arange(1, len(pressures) + 1) - 1
    return replace(found, q_zero_L_min=max(found.q_zero_L_min, float(run.q_largest_L_min[rests].max())))


def _noise_at_zero(scene: Scene) -> ScenarioResult:
    """White noise across zero, as long as the spool needs to feel its mean; then none.

    Judged after it, as it is beyond what was declared; what passes meanwhile is shown.
    """
    before = scene.opened_and_closed()
    noise = NOISE * np.random.default_rng(SEED).standard_normal(round(2.0 / STEP_S))
    run = scene.run(np.concatenate([before, noise, scene.held(0)]))
    noisy = slice(before.size, before.size + noise.size)
    return scene.result(
        f"noise of {100 * NOISE:g} % across zero command",
        run,
        figures={
            "mean_flow_L_min": run.q_mean_L_min[noisy].mean(),
            "peak_flow_L_min": run.q_largest_L_min[noisy].max(),
        },
    )


def converter_off_at_zero(scene: Scene) -> Iterator[ScenarioResult]:
    """A zero command that the converter reads with its declared error: off for long, either way, and noisy on top.

    Judged while it lasts, once the spool has had the time to follow. Without a zero band flow is to be expected.
    """
    error, count = scene.compensator.command_error, scene.held(0, 2).size
    noise = np.random.default_rng(SEED).integers(-error.noise_codes, error.noise_codes, count, endpoint=True)
    reason = "" if scene.compensator.zero_band_codes else "without a transition there is no zero band"
    off = f"{error.offset_codes} codes too"
    for name, offset in (
        (f"zero command read {off} high", error.offset_codes),
        (f"zero command read {off} low", -error.offset_codes),
        ("noise across zero command", 0),
    ):
        wrong = scene.loop.channels.command_of_codes(offset + noise)
        # The valve closes onto the wrong zero: from a true one the spool would have to open first.
        before = np.concatenate([scene.waited(), ramp(0, 1), scene.held(1), ramp(1, float(np.mean(wrong)))])
        run = scene.run(np.concatenate([before, wrong]))
        yield scene.result(
            f"{name}, with ±{error.noise_codes} codes of noise",
            run,
            judged=slice(before.size + round(scene.settle_s / STEP_S), None),
            figures={"mean_flow_L_min": run.q_mean_L_min[before.size :].mean()},
            not_required=reason,
        )


def _restart(scene: Scene) -> ScenarioResult:
    """The processor is reset while full command is there; judged until the command has been at zero."""
    full, has_interlock = scene.held(1, 2), scene.compensator.drive_functions.interlock_codes is not None
    run = scene.run(np.concatenate([full, scene.held(0), scene.opened_and_closed()]))
    # Then it must follow: a drive that never opens would pass.
    figures = {"flow_after_zero_command_L_min": run.q_mean_L_min[full.size :].max()}
    return scene.result(
        "restart with full command present",
        run,
        judged=slice(full.size),
        figures=figures,
        not_required="" if has_interlock else "there is no interlock",
    )


def _oils(scene: Scene) -> Iterator[ScenarioResult]:
    """The same ramp with oil far from the temperature of the bench."""
    for name, (viscosity, density) in OILS.items():
        warm = replace(scene, loop=scene.loop.with_plant(scene.loop.plant.with_oil(viscosity, density)))
        run = warm.run(warm.opened_and_closed())
        yield warm.result(name, run, figures={"largest_flow_L_min": run.q_mean_L_min.max()})


def _slower_ramp(scene: Scene) -> ScenarioResult:
    """A ramp at which the valve has half its hysteresis, as one may whose hysteresis grows with the rate.

    The play takes out the recorded one: below zero the branches lie the other way round.
    """
    loop = scene.loop.with_plant(scene.loop.plant.with_hysteresis(SLOWER))
    slow_s = max(SLOW_S, loop.slowest_ramp_s)
    command = np.concatenate(
        [scene.waited(slow_s), ramp(0, 1, slow_s), scene.held(1), ramp(1, 0, slow_s), scene.held(0)]
    )
    run = replace(scene, loop=loop).run(command)
    width = {"hysteresis_percent": 100 * hysteresis_of(run)}
    return scene.result("half the hysteresis, of which the play takes out all", run, figures=width)


def sensor_failures(scene: Scene) -> Iterator[ScenarioResult]:
    """Run every failure in the middle of a ramp of the command, at each pressure downstream of the edge."""
    code_max = scene.compensator.signals.code_max
    ends = sorted({scene.back_within_span(back) for back in scene.backs_MPa})
    for back_MPa in ends:
        for sensor, name in enumerate(scene.loop.channels.names):
            yield _failed(scene, sensor, 0, f"sensor {name} breaks: its code is 0", back_MPa)
            yield _failed(scene, sensor, code_max, f"sensor {name} is shorted: its code is {code_max}", back_MPa)
            yield from _stuck(scene, sensor, back_MPa, (ends[0], ends[-1]))


def _failed(scene: Scene, sensor: int, code: int, name: str, back_MPa: float) -> ScenarioResult:
    """The sensor's code is one end of the converter."""
    command, change = _through_mid_ramp(scene)
    shown = np.full((command.size, 2), -1)
    shown[change:, sensor] = code
    codes = scene.loop.channels.pressure_codes(scene.dp_MPa, back_MPa)
    run = scene.run(command, back_MPa=back_MPa, shown=shown)
    return scene.result(name, run, back_MPa=back_MPa, not_required=_unknowable(scene, codes, sensor, code))


def _stuck(scene: Scene, sensor: int, back_MPa: float, ends_MPa: Ends) -> Iterator[ScenarioResult]:
    """The sensor goes on showing what it shows, and the pressure at it goes from one end to the other."""
    behind = sensor == 1
    # Pressure drop and pressure behind the edge, before and after.
    changes: list[tuple[Ends, Ends]] = []
    if behind:
        changes = [((scene.dp_MPa, scene.dp_MPa), (back_MPa, then)) for then in ends_MPa if then != back_MPa]
    elif scene.tested_MPa:
        changes = [(ends, (back_MPa, back_MPa)) for ends in (scene.tested_MPa, scene.tested_MPa[::-1])]
    command, change = _through_mid_ramp(scene)
    for supply_MPa, backs_MPa in changes:
        before, after = map(scene.loop.channels.pressure_codes, supply_MPa, backs_MPa)
        supply, back = (np.where(np.arange(command.size) < change, *pair) for pair in (supply_MPa, backs_MPa))
        shown = np.full((command.size, 2), -1)
        shown[change:, sensor] = before[sensor]
        what, pair = ("the pressure behind the edge", backs_MPa) if behind else ("dP", supply_MPa)
        first, then = (scene.units.text(value, ".2f MPa") for value in pair)
        yield scene.result(
            f"sensor {scene.loop.channels.names[sensor]} is stuck while {what} goes from {first} to {then}",
            scene.run(command, supply_MPa=supply, back_MPa=back, shown=shown),
            back_MPa=backs_MPa[1],
            end_MPa=supply_MPa[1],
            not_required=_unknowable(scene, after, sensor, int(before[sensor])),
        )


def _through_mid_ramp(scene: Scene) -> tuple[np.ndarray, int]:
    """Return a command that opens and closes, ramps up and down, and rests; and the record in mid-ramp."""
    before = scene.opened_and_closed()
    command = np.concatenate([before, ramp(0, 0.6), ramp(0.6, 0), scene.held(0, 2)])
    return command, before.size + ramp(0, 1).size // 2


def _unknowable(scene: Scene, codes: np.ndarray, sensor: int, code: int) -> str:
    """Say why a failed sensor's code can't be required to leave the valve shut; empty where it can.

    It can't if the code is one that a sound sensor gives, the difference too, and it asks for more drive than the true
    one.
    """
    compensator, sign = scene.compensator, scene.sign
    pair = compensator.signals.pair(sign)
    first, last = (pair.ahead, pair.behind)[sensor].valid_codes
    seen = codes.copy()
    seen[sensor] = code
    true, wrong = (pair.difference(int(a), int(b)) for a, b in (codes, seen))
    if not first <= code <= last or wrong < -compensator.reverse_codes:
        return ""
    # Of a law with a transition the drive at zero command is the certified one.
    return NO_CORE_CAN_KNOW if compensator.beta(wrong, sign) > compensator.beta(true, sign) else ""
