"""Each pressure sensor by itself: its wire breaks, it is shorted, it is stuck; at each pressure behind the edge."""

from collections.abc import Iterator

import numpy as np

from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW, Ends, Scene, ramp
from dzdesign.verify.loop_results import ScenarioResult

SENSORS = ("A", "B")


def sensor_failures(scene: Scene) -> Iterator[ScenarioResult]:
    """Run every failure in the middle of a ramp of the command, at each pressure downstream of the edge."""
    code_max = scene.compensator.signals.code_max
    ends = sorted({scene.back_within_span(back) for back in scene.backs_MPa})
    for back_MPa in ends:
        for sensor, name in enumerate(SENSORS):
            yield _failed(scene, sensor, 0, f"sensor {name} breaks: its code is 0", back_MPa)
            yield _failed(scene, sensor, code_max, f"sensor {name} is shorted: its code is {code_max}", back_MPa)
            yield from _stuck(scene, sensor, back_MPa, (ends[0], ends[-1]))


def _failed(scene: Scene, sensor: int, code: int, name: str, back_MPa: float) -> ScenarioResult:
    """The sensor's code is one end of the converter."""
    command, change = _mid_ramp(scene)
    shown = np.full((command.size, 2), -1)
    shown[change:, sensor] = code
    codes = scene.loop.channels.pressure_codes(scene.dp_MPa, back_MPa)
    run = scene.run(command, back_MPa=back_MPa, shown=shown)
    return scene.result(name, run, back_MPa=back_MPa, not_required=_unknowable(scene, codes, sensor, code))


def _stuck(scene: Scene, sensor: int, back_MPa: float, ends_MPa: Ends) -> Iterator[ScenarioResult]:
    """The sensor goes on showing what it shows, and the pressure at it goes from one end to the other."""
    behind = (sensor == 1) != scene.loop.channels.swapped
    if behind:
        changes = [(scene.dp_MPa, back_MPa, then) for then in ends_MPa if then != back_MPa]
    elif scene.tested_MPa:
        low, high = scene.tested_MPa
        changes = [(first, then, back_MPa) for first, then in ((low, high), (high, low))]
    else:
        changes = []
    for first, second, third in changes:
        supply, back = ((first, first), (second, third)) if behind else ((first, second), (third, third))
        yield _stuck_over(scene, sensor, supply, back)


def _stuck_over(scene: Scene, sensor: int, supply_MPa: Ends, back_MPa: Ends) -> ScenarioResult:
    command, change = _mid_ramp(scene)
    before, after = (
        scene.loop.channels.pressure_codes(dp, back) for dp, back in zip(supply_MPa, back_MPa, strict=True)
    )
    supply, back = (np.where(np.arange(command.size) < change, *pair) for pair in (supply_MPa, back_MPa))
    shown = np.full((command.size, 2), -1)
    shown[change:, sensor] = before[sensor]
    run = scene.run(command, supply_MPa=supply, back_MPa=back, shown=shown)
    what, pair = ("dP", supply_MPa) if supply_MPa[0] != supply_MPa[1] else ("the pressure behind the edge", back_MPa)
    first, then = (scene.units.text(value, ".2f MPa") for value in pair)
    return scene.result(
        f"sensor {SENSORS[sensor]} is stuck while {what} goes from {first} to {then}",
        run,
        back_MPa=back_MPa[1],
        end_MPa=supply_MPa[1],
        not_required=_unknowable(scene, after, sensor, int(before[sensor])),
    )


def _mid_ramp(scene: Scene) -> tuple[np.ndarray, int]:
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
    signals = compensator.signals
    first, last = (signals.pressure_a, signals.pressure_b)[sensor].valid_codes
    seen = codes.copy()
    seen[sensor] = code
    true, wrong = (signals.difference(int(a), int(b), sign) for a, b in (codes, seen))
    if not first <= code <= last or wrong < -compensator.reverse_codes:
        return ""
    # Of a law with a transition the drive at zero command is the certified one.
    return NO_CORE_CAN_KNOW if compensator.beta(wrong, sign) > compensator.beta(true, sign) else ""
