"""The closed loop's speed beside its peers, and its error beside tight CVODES."""

import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from firmware import example_firmware
from loop_peers import (
    SAMPLE_S,
    SUPPLY_MPA,
    Core,
    core_of,
    numbers,
    phase_integrator,
    python_loop,
    sample_function,
    scipy_loop,
)
from scoreboard import Row, print_rows, say

from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.loop import PERIODS_PER_RECORD, RECORD_S, ClosedLoop
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant

NONLINEAR = Plant()
#: Without flow force and droop nothing but the stops is nonlinear.
LINEAR = replace(NONLINEAR, flow_force_N_mm_MPa=0.0, droop_MPa_L_min2=0.0)
RAMP_S, REPEATS = 100.0, 40
PLANTS, SPREAD = 200, 0.1
SPEED_GOALS, FOLD_GOAL, THREAD_GOAL = {"nonlinear": 4000.0, "linear": 40000.0}, 35.0, 1.8
ERROR_GOALS = {"nonlinear": 1e-5, "linear": 1e-10}


def print_plant(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of the closed loop."""
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        firmware = Path(folder) / "firmware"
        compensator = example_firmware(firmware)
        core = core_of(firmware)
        rows = _speed(firmware, compensator, quick)
        rows += _peers(core, rows[0].value, quick)
        rows += _errors(quick, seed)
        rows += _monte_carlo(core, firmware, compensator, quick, seed)
    print_rows(f"The plant in the loop, PWM resolved (seed {seed})", rows)
    return rows


def _ramp(seconds: float, step: float) -> np.ndarray:
    """Return a command from zero to full and back, in `seconds`."""
    time = np.arange(0, seconds, step) / seconds
    return 1 - np.abs(2 * time - 1)


def _least(call, repeats: int) -> float:
    """Return the shortest time of a call: the others held something else too."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        call()
        times.append(perf_counter() - start)
    return min(times)


def _goal(what: str, ratio: float, goal: float, note: str) -> Row:
    """Return a row for a ratio that must reach a goal; a row holds if its value is at most its limit."""
    return Row(what=f"{what}, goal over measured", value=goal / ratio, limit=1.0, note=f"{ratio:.4g}; {note}")


def _speed(firmware: Path, compensator: Compensator, quick: bool) -> list[Row]:
    command = _ramp(RAMP_S, RECORD_S)
    rows = []
    for name, plant in (("nonlinear", NONLINEAR), ("linear", LINEAR)):
        start = perf_counter()
        loop = ClosedLoop(plant, firmware, compensator)
        built = perf_counter() - start
        taken = {mode: _least(lambda m=mode: loop.run(command, SUPPLY_MPA, m, 1.0), 3 if quick else REPEATS)  # noqa: B023
                 for mode in ("compensated", "direct")}  # fmt: skip
        times = {mode: RAMP_S / seconds for mode, seconds in taken.items()}
        rows.append(Row(what=f"{name} plant with the core: times real time", value=times["compensated"],
                        note=f"{1e9 * taken['compensated'] / RAMP_S * PWM_PERIOD_S:.0f} ns a period; without the core "
                        f"{times['direct']:.0f} times; built in {built:.2f} s"))  # fmt: skip
        rows.append(_goal(f"{name} plant with the core", times["compensated"], SPEED_GOALS[name], "times real time"))
    return rows


def _peers(core: Core, ours: float, quick: bool) -> list[Row]:
    rows = []
    sample = sample_function(core)
    for name, seconds, run in (
        ("Python loop over CasADi's CVODES", 0.2, lambda command: python_loop(NONLINEAR, core, command)),
        ("Python loop over SciPy's solve_ivp", 0.05, lambda command: scipy_loop(NONLINEAR, core, command)),
        ("CasADi mapaccum, external core", 2.0, _accumulated(sample, round(2.0 / SAMPLE_S))),
    ):
        say(f"plant: {name}")
        command = 0.9 * np.ones(round(seconds / SAMPLE_S))
        taken = _least(lambda run=run, command=command: run(command), 1 if quick else 3)
        times = command.size * SAMPLE_S / taken
        rows.append(Row(what=f"{name}: times real time", value=times, note=f"ours is {ours / times:.0f} times faster"))
    return rows


def _accumulated(sample, count: int):
    accumulated = sample.mapaccum("accumulated", count)
    given = np.tile(numbers(NONLINEAR)[:, None], count)
    return lambda command: accumulated(np.zeros(4), command[None, :], given)


def _errors(quick: bool, seed: int) -> list[Row]:
    """Compare positions with CVODES at its tightest, clear of the stops, over steps that cross the edge."""
    rows = []
    rng = np.random.default_rng(seed)
    shares = np.concatenate([np.full(4, 0.6), 0.4 + 0.5 * rng.random(4 if quick else 40)])
    duties = np.repeat(np.round(shares * 60000) / 60000, PERIODS_PER_RECORD)
    duties = np.concatenate([[0.0], duties[:-1]])  # a compare value acts a period later
    for name, plant in (("nonlinear", NONLINEAR), ("linear", LINEAR)):
        # The pressure opens it at once, and nothing brings it to a stop.
        plant = replace(plant, preload_N=0.0, stroke_mm=10.0, overlap_mm=2.2)
        exact = _by_cvodes(plant, duties)
        found = ClosedLoop(plant).run(shares, 2.0).position_mm
        error = np.abs(found - exact[PERIODS_PER_RECORD - 1 :: PERIODS_PER_RECORD]) / plant.stroke_mm
        rows.append(Row(what=f"{name} plant: error over the stroke", value=float(error.max()),
                        limit=ERROR_GOALS[name], note=f"CVODES at 1e-14; positions {exact.min():.2f}-"
                        f"{exact.max():.2f} mm, edge at {plant.overlap_mm} mm"))  # fmt: skip
    return rows


def _by_cvodes(plant: Plant, duties: np.ndarray) -> np.ndarray:
    """Return positions, mm, at the end of each period; the play is that of plant_period.h, by its words."""
    step = phase_integrator(plant, 1e-14)
    state, play, mean, found = np.zeros(3), 0.0, 0.0, []
    decay = (plant.K_a * plant.K_fi_V_A + plant.R_c_ohm + plant.r_p_ohm) / plant.L_c_H
    for duty in duties:
        play = min(max(play, mean - plant.hysteresis_V / 2), mean + plant.hysteresis_V / 2)
        push = (play - mean) * plant.force_per_volt
        charge = 0.0
        for volts, h in ((plant.u_max_V, duty * PWM_PERIOD_S), (0.0, (1 - duty) * PWM_PERIOD_S)):
            before = state[0]
            state = step(state, volts, h, push, 2.0)
            # Eqs. (19)-(21) integrated: L di = (K_a u - (K_a K_fi + R) i) dt.
            charge += (plant.K_a * volts / plant.L_c_H * h - (state[0] - before)) / decay
        mean = charge / PWM_PERIOD_S * plant.K_i_N_A / plant.force_per_volt
        found.append(1e3 * state[1])
    return np.array(found)


def _plants(seed: int) -> list[Plant]:
    """Return the plants of the series."""
    rng = np.random.default_rng(seed)
    varied = ("preload_N", "K_et_N_m", "B_e_N_s_m", "C_d_W_mm", "rho_kg_m3")
    return [replace(NONLINEAR, **{name: getattr(NONLINEAR, name) * (1 + SPREAD * (2 * rng.random() - 1))
                                  for name in varied}) for _ in range(PLANTS)]  # fmt: skip


def fold_map_speed(core: Core, quick: bool, seed: int) -> float:
    """Return how many times real time CasADi's fold.map runs a series of plants."""
    say("plant: CasADi fold.map")
    count = 500
    fold = sample_function(core).fold(count).map(PLANTS)
    given = np.repeat(np.stack([numbers(plant) for plant in _plants(seed)], axis=1), count, axis=1)
    commands = np.tile(_ramp(RAMP_S, SAMPLE_S)[None, 50000:50000 + count], PLANTS)
    taken = _least(lambda: fold(np.zeros((4, PLANTS)), commands, given), 1 if quick else 3)
    return PLANTS * count * SAMPLE_S / taken


def _monte_carlo(core: Core, firmware: Path, compensator: Compensator, quick: bool, seed: int) -> list[Row]:
    """Time 200 plants: one after another, two at a time, and as CasADi's fold.map."""
    plants, command = _plants(seed), _ramp(RAMP_S, RECORD_S)
    loop = ClosedLoop(NONLINEAR, firmware, compensator)

    def one(plant: Plant) -> float:
        return float(loop.with_plant(plant).run(command, SUPPLY_MPA, "compensated").q_L_min[-1])

    def both() -> None:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(one, plants))

    repeats = 1 if quick else 3
    single, double = _least(lambda: list(map(one, plants)), repeats), _least(both, repeats)
    ours = PLANTS * RAMP_S / single
    theirs = fold_map_speed(core, quick, seed)
    return [
        Row(what="200 plants: times real time, one core", value=ours, note=f"each {RAMP_S:g} s, built and run"),
        Row(what="200 plants: CasADi fold.map", value=theirs, note="times real time"),
        _goal("200 plants over fold.map", ours / theirs, FOLD_GOAL, "times faster"),
        _goal("200 plants, two cores over one", single / double, THREAD_GOAL, "times faster"),
    ]
