"""What a machine does to a valve beside ramps: steps, load steps, failing sensors, noise, cold and hot oil."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.design.zero_band import CommandError
from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopRun
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.stand_in import StandIn
from dzdesign.verify.loop_results import ScenarioResult, Side

#: Two periods a record: as often as the core samples, 1.25 kHz.
PERIODS = 2
STEP_S = PERIODS * PWM_PERIOD_S
#: Time in which a spool has come to rest; and of a command's ramp, quick but far slower than the spool.
SETTLE_S, RAMP_S = 0.4, 2.0
#: Of the final flow: where a rise begins and ends, and how near it is settled.
RISE, SETTLED = (0.1, 0.9), 0.05
#: Standard deviation of the noise on the command, share of full.
NOISE = 0.002
SEED = 1
#: Viscosity (damping goes with it) and density of a mineral oil of class VG 46 against 40 °C: about 0 °C and 80 °C.
OILS = {"cold oil, 8 times the viscosity": (8.0, 1.03), "hot oil, a quarter of the viscosity": (0.25, 0.97)}


#: Lowest and highest tested pressure drop, MPa.
Ends = tuple[float, float]
#: A failure that reads as a large pressure drop.
EXCESS = "sensor ahead shows full, or the one behind breaks"
NO_FIGURES: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """The loop of one side at one pressure drop."""

    #: With the compensator, and the plant of this pressure drop.
    loop: ClosedLoop
    plant: Plant | StandIn
    side: Side
    #: At no flow.
    dp_MPa: float
    #: The law's dP0.
    reference_MPa: float
    #: Of the tests; None where the plant holds at `dp_MPa` only.
    tested_MPa: Ends | None
    #: Of a zero command's code; and whether the law has a zero band against it.
    command_error: CommandError
    has_zero_band: bool
    #: Whether a sensor may fail so that the core must take a pressure drop for larger than it is, and that opens the
    #: valve: the threshold grows with the pressure drop, and the failed sensor's code is a valid one.
    hides_excess: bool = False
    #: In which a scenario's name has its pressures.
    units: RecordedUnits = AS_COMPUTED

    @property
    def settle_s(self) -> float:
        """Time in which the valve has come to rest, the firmware's own ramps included."""
        return SETTLE_S + self.loop.slowest_ramp_s

    def held(self, level: float, times: float = 1) -> np.ndarray:
        """Return a command held for so many times the time to come to rest."""
        return np.full(round(times * self.settle_s / STEP_S), level)

    def opened_and_closed(self) -> np.ndarray:
        """Return the command that leaves the spool as its hysteresis leaves it after use."""
        return np.concatenate([_ramp(0, 1), self.held(1), _ramp(1, 0), self.held(0, 2)])

    def run(
        self,
        command: np.ndarray,
        *,
        supply_MPa: float | np.ndarray | None = None,
        mode: str = "compensated",
        seen_MPa: np.ndarray | None = None,
    ) -> LoopRun:
        """Run the compensated loop at this pressure drop unless told otherwise."""
        supply = self.dp_MPa if supply_MPa is None else supply_MPa
        return self.loop.run(command, supply, mode, seen_MPa=seen_MPa, periods_per_record=PERIODS)

    def result(
        self,
        name: str,
        run: LoopRun,
        *,
        must_shut: bool = True,
        figures: Mapping[str, float] = NO_FIGURES,
        end_MPa: float | None = None,
    ) -> ScenarioResult:
        """Return the result; zero command counts once the valve has had the time to come to rest.

        It ended at this pressure drop unless told otherwise.
        """
        ended_MPa = self.dp_MPa if end_MPa is None else end_MPa
        shut = np.flatnonzero(_held_for(run.command <= 0, round(self.settle_s / STEP_S)))
        return ScenarioResult(
            name=name,
            side=self.side,
            dp_MPa=self.dp_MPa,
            leak_L_min=self.loop.leak_L_min(ended_MPa),
            allowed_at_zero_L_min=self.loop.allowed_at_zero_L_min(ended_MPa),
            q_zero_L_min=float(run.q_largest_L_min[-1]),
            q_peak_at_zero_L_min=float(run.q_largest_L_min[shut].max(initial=0.0)),
            unseen_below_L_min=self.loop.unseen_below_L_min(self.dp_MPa),
            must_shut=must_shut,
            figures={key: float(value) for key, value in figures.items()},
        )


def run_scenarios(scene: Scene) -> Iterator[ScenarioResult]:
    """Run every scenario of one side at one pressure drop."""
    yield _steps(scene)
    if scene.tested_MPa:
        yield _load_step_at_zero(scene, scene.tested_MPa)
        yield _load_step_in_motion(scene, scene.tested_MPa)
        yield _frozen_sensors(scene, scene.tested_MPa)
    yield from _failing_sensors(scene)
    yield _noise_at_zero(scene)
    yield _converter_off_at_zero(scene)
    yield from _oils(scene)


def _ramp(start: float, end: float) -> np.ndarray:
    return np.linspace(start, end, round(RAMP_S / STEP_S))


def _held_for(condition: np.ndarray, count: int) -> np.ndarray:
    """Return where a condition has held for so many records, this one included."""
    since = np.arange(condition.size) - np.maximum.accumulate(np.where(condition, -1, np.arange(condition.size)))
    return condition & (since > count)


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
            figures[f"{name}_rise_ms"] = 1e3 * STEP_S * _rise(step / final)
            figures[f"{name}_settling_ms"] = 1e3 * STEP_S * _last(np.abs(step / final - 1) > SETTLED)
            figures[f"{name}_overshoot_percent"] = max(100 * float(step.max() / final - 1), 0.0)
    return scene.result("step to half command and back", runs["compensated"], figures=figures)


def _rise(response: np.ndarray) -> int:
    begin, end = (int(np.argmax(response >= level)) for level in RISE)
    return end - begin


def _last(condition: np.ndarray) -> int:
    return int(np.flatnonzero(condition)[-1]) + 1 if condition.any() else 0


def _other_pressures(scene: Scene, tested_MPa: Ends, length: int) -> np.ndarray:
    """Return the supply: as before, then at both ends of the tested interval, then as before."""
    quarter = length // 4
    parts = [scene.dp_MPa, *tested_MPa[::-1], scene.dp_MPa]
    return np.repeat(parts, [quarter, quarter, quarter, length - 3 * quarter])


def _load_step_at_zero(scene: Scene, tested_MPa: Ends) -> ScenarioResult:
    """The pressure drop jumps to both ends of what was tested while the command is zero."""
    before, quiet = scene.opened_and_closed(), scene.held(0, 8)
    supply = np.concatenate([np.full(before.size, scene.dp_MPa), _other_pressures(scene, tested_MPa, quiet.size)])
    run = scene.run(np.concatenate([before, quiet]), supply_MPa=supply)
    flow, unseen = run.q_mean_L_min[before.size :], scene.loop.unseen_below_L_min(scene.dp_MPa) or 0.0
    # Of a stand-in's flow that no recording shows there is no volume to be told.
    volume = {} if float(flow.max()) < unseen else {"volume_mL": flow.sum() * STEP_S / 60 * 1e3}
    return scene.result("load steps at zero command", run, figures=volume)


def _load_step_in_motion(scene: Scene, tested_MPa: Ends) -> ScenarioResult:
    """The pressure drop jumps in the middle of a ramp of the command."""
    then_MPa = tested_MPa[1] if scene.dp_MPa < sum(tested_MPa) / 2 else tested_MPa[0]
    run, jump = _changed_in_mid_ramp(scene, np.nan, then_MPa)
    change = run.q_L_min[jump + round(SETTLE_S / STEP_S)] - run.q_L_min[jump - 1]
    figures = {"pressure_drop_then_MPa": then_MPa, "flow_change_L_min": change}
    return scene.result("load step in the middle of a ramp", run, figures=figures, end_MPa=then_MPa)


def _failing_sensors(scene: Scene) -> Iterator[ScenarioResult]:
    """A sensor fails in mid-ramp: its wire breaks, or it shows full pressure."""
    beyond = 1e3  # MPa: the converter's end
    for name, signal_MPa, must_shut in (
        ("sensor ahead breaks, or the one behind shows full", -beyond, True),
        (EXCESS, beyond, not scene.hides_excess),
    ):
        run, _ = _changed_in_mid_ramp(scene, signal_MPa, scene.dp_MPa)
        yield scene.result(name, run, must_shut=must_shut)


def _frozen_sensors(scene: Scene, tested_MPa: Ends) -> ScenarioResult:
    """The sensors freeze, then the pressure drop rises. The codes are sound: what it costs is stated, not required."""
    low, high = tested_MPa
    first, then = (scene.units.text(dp_MPa, ".2f MPa") for dp_MPa in tested_MPa)
    name = f"sensors frozen at {first}, then {then}"
    return scene.result(name, _changed_in_mid_ramp(scene, low, high)[0], must_shut=False, end_MPa=high)


def _changed_in_mid_ramp(scene: Scene, seen_MPa: float, supply_MPa: float) -> tuple[LoopRun, int]:
    """Run a ramp up and down, and tell at which record, in mid-ramp, what the sensors show and the supply change.

    Sensors that show not a number show the plant's own pressure drop.
    """
    before = scene.opened_and_closed()
    command = np.concatenate([before, _ramp(0, 0.6), _ramp(0.6, 0), scene.held(0, 2)])
    change = before.size + _ramp(0, 1).size // 2
    seen, supply = np.full(command.size, np.nan), np.full(command.size, scene.dp_MPa)
    seen[change:], supply[change:] = seen_MPa, supply_MPa
    return scene.run(command, supply_MPa=supply, seen_MPa=seen), change


def _noise_at_zero(scene: Scene) -> ScenarioResult:
    """White noise on a zero command, as long as the spool needs to feel its mean."""
    before = scene.opened_and_closed()
    noise = NOISE * np.random.default_rng(SEED).standard_normal(round(2.0 / STEP_S))
    command = np.concatenate([before, np.maximum(noise, 0.0), scene.held(0)])
    run = scene.run(command)
    noisy = slice(before.size, before.size + noise.size)
    return scene.result(
        f"noise of {100 * NOISE:g} % on a zero command",
        run,
        figures={
            "mean_flow_L_min": run.q_mean_L_min[noisy].mean(),
            "peak_flow_L_min": run.q_largest_L_min[noisy].max(),
        },
    )


def _converter_off_at_zero(scene: Scene) -> ScenarioResult:
    """A zero command that the converter reads with its declared error: too high for long, and noisy on top.

    Judged while it lasts, once the spool has had the time to follow. Without a zero band flow is to be expected.
    """
    error, count = scene.command_error, scene.held(0, 2).size
    noise = np.random.default_rng(SEED).integers(-error.noise_codes, error.noise_codes, count, endpoint=True)
    wrong = scene.loop.command_of_codes(error.offset_codes + noise)
    # The valve closes onto the wrong zero: from a true one the spool would have to open first.
    before = np.concatenate([_ramp(0, 1), scene.held(1), _ramp(1, float(np.mean(wrong)))])
    run = scene.run(np.concatenate([before, wrong]))
    flow = run.q_largest_L_min[before.size + round(scene.settle_s / STEP_S) :]
    return ScenarioResult(
        name=f"zero command read {error.offset_codes} codes too high, with ±{error.noise_codes} codes of noise",
        side=scene.side,
        dp_MPa=scene.dp_MPa,
        leak_L_min=scene.loop.leak_L_min(scene.dp_MPa),
        allowed_at_zero_L_min=scene.loop.allowed_at_zero_L_min(scene.dp_MPa),
        q_zero_L_min=float(flow.max()),
        q_peak_at_zero_L_min=float(flow.max()),
        unseen_below_L_min=scene.loop.unseen_below_L_min(scene.dp_MPa),
        must_shut=scene.has_zero_band,
        figures={"mean_flow_L_min": float(run.q_mean_L_min[before.size :].mean())},
    )


def _oils(scene: Scene) -> Iterator[ScenarioResult]:
    """The same ramp with oil far from the temperature of the bench."""
    for name, (viscosity, density) in OILS.items():
        plant = scene.plant.with_oil(viscosity, density)
        warm = replace(scene, loop=scene.loop.with_plant(plant), plant=plant)
        run = warm.run(warm.opened_and_closed())
        yield warm.result(name, run, figures={"largest_flow_L_min": run.q_mean_L_min.max()})
