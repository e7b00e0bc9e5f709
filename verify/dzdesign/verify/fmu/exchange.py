"""Model Exchange, and what steps do not show: first values, the output in its unit, rates, stops as events, delays."""

from collections.abc import Iterator, Mapping
from math import isclose, sqrt

import numpy as np

from dzdesign.core.errors import RequirementError, and_more
from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.exhaustive.drive_check import drive_samples
from dzdesign.verify.exhaustive.exact_drive import DriveModel
from dzdesign.verify.fmu.binary_core import ENDINGS
from dzdesign.verify.fmu.calls import GETTERS, Call, Calls
from dzdesign.verify.fmu.fmu_file import FmuFile
from dzdesign.verify.requirements import FMU_EXCHANGE, FMU_STARTS, Check

#: Samples of the drive, states of the plant, and their seed.
SAMPLES, STATES, SEED = 600, 200, 26
CLOSE = 1e-9
CODES = ("u_i_code", "p_A_code", "p_B_code")


def starts_check(fmu: FmuFile, binary: bytes) -> Check:
    """Compare the first value of every variable that has one with that of the description, before initialization."""
    names = [name for name, each in fmu.variables.items() if each.start is not None and each.kind in GETTERS]
    calls = Calls(fmu)
    calls.get(*names)
    title = f"{fmu.identifier}: {FMU_STARTS.title}"
    try:
        found = calls.made(binary)
    except RequirementError as error:
        return FMU_STARTS.check(holds=False, text=str(error), name=title)
    others = [
        f"{name} starts at {value:g}, described as {fmu.variables[name].start}"
        for name, (value,) in zip(names, found, strict=True)
        if value != float(fmu.variables[name].start or 0.0)
    ]
    text = and_more(others, 2) if others else f"{len(names)} variables"
    return FMU_STARTS.check(holds=not others, text=text, name=title)


def compensator_exchange_check(fmu: FmuFile, binary: bytes, compensator: Compensator) -> Check:
    """Run the drive by its events, and the law between them, against the exact drive."""
    return _check(fmu, "the drive at its events, the law at once", _compensator_faults(fmu, binary, compensator))


def plant_exchange_check(fmu: FmuFile, binary: bytes, plant: Mapping[str, float], compensator: Compensator) -> Check:
    """Compare rates and outputs with the equations at random states, and what happens at the stops."""
    faults = _plant_faults(fmu, binary, Plant(**plant), compensator.signals.compare_max)
    return _check(fmu, "rates and flow by the equations, stops and edge as events", faults)


def _check(fmu: FmuFile, text: str, faults: Iterator[str]) -> Check:
    name = f"{fmu.identifier}: {FMU_EXCHANGE.title}"
    try:
        found = list(faults)
    except RequirementError as error:
        found = [str(error)]
    return FMU_EXCHANGE.check(holds=not found, text=and_more(found, 2) if found else text, name=name)


def _compensator_faults(fmu: FmuFile, binary: bytes, compensator: Compensator) -> Iterator[str]:
    signals, drive = compensator.signals, compensator.current_drive
    held, full = signals.tick_Hz // signals.sample_Hz, compensator.u_max_V if drive is None else drive.circuit.rated_A
    samples = drive_samples(compensator, SEED, SAMPLES)
    outputs, calls = [f"{name}{ENDINGS[sign]}" for sign in signals.signs for name in ("u_O", "compare")], Calls(fmu)
    drives = ("compare_a", "compare_b", "drive_status")
    calls.set(codes=1)
    calls.add(Call.INITIALIZE)
    for tick in range(len(samples) * held):
        if tick:
            calls.add(Call.CONTINUE)
            calls.add(Call.TIME, value=tick / signals.tick_Hz)
            calls.add(Call.EVENT)
        calls.set(**dict(zip(CODES, samples[tick // held], strict=True)))
        calls.add(Call.DISCRETE)
        calls.get(*drives, *outputs)
    found, model, place = calls.made(binary), DriveModel(compensator), 0
    for tick in range(len(samples) * held):
        if tick % held == 0:
            model.sample(*samples[tick // held])
        model.tick()
        (_, known, time), *values = found[place : place + 1 + len(drives) + len(outputs)]
        place += 1 + len(values)
        numbers = [value for (value,) in values]
        if not known or not isclose(time, (tick + 1) / signals.tick_Hz, rel_tol=CLOSE):
            yield f"after period {tick} the next event is at {time:g} s"
        if tuple(numbers[:3]) != tuple(model.outputs):
            yield f"in period {tick} the drive gives {numbers[:3]}, expected {list(model.outputs)}"
        for index in range(3, len(numbers), 2):
            expected = numbers[index + 1] * float(full) / signals.compare_max
            if not isclose(numbers[index], expected, rel_tol=CLOSE, abs_tol=CLOSE):
                yield f"{outputs[index - 3]} is {numbers[index]:g} at a compare value of {numbers[index + 1]:g}"


def _equations(plant: Plant, state: np.ndarray, given: np.ndarray, played_A: float) -> dict[str, float]:
    """Return rates, flow and pressure drop by Eqs. (19) to (24) at (i, x, v), given volts and supply."""
    (current, x, v), (volts, supply) = state.tolist(), given.tolist()
    loop_ohm = plant.K_a * plant.K_fi_V_A + plant.R_c_ohm + plant.r_p_ohm
    opening_mm = max(1e3 * x - plant.overlap_mm, 0.0)
    conducted = 60.0 * opening_mm * plant.C_d_W_mm * 1e-3 * sqrt(2e6 / plant.rho_kg_m3)  # L/min at 1 MPa
    drop = supply / (1 + plant.droop_MPa_L_min2 * conducted**2)
    load = plant.preload_N - plant.pressure_force_N_MPa * drop + plant.flow_force_N_mm_MPa * opening_mm * drop
    half_A = plant.K_a * plant.hysteresis_V / 2 / loop_ohm
    played_A = min(max(played_A, current - half_A), current + half_A)
    force = plant.K_i_N_A * played_A - plant.K_et_N_m * x - load - plant.B_e_N_s_m * v
    rate = (plant.K_a * volts - loop_ohm * current) / plant.L_c_H
    flow = conducted * sqrt(drop)
    return {"di": rate, "dx": v, "dv": force / plant.m_e_kg, "Q": flow, "dP": drop, "played": played_A}


def _plant_faults(fmu: FmuFile, binary: bytes, plant: Plant, compare_max: int) -> Iterator[str]:
    rng, back = np.random.default_rng(SEED), 0.7
    stroke = 1e-3 * plant.stroke_mm
    states = rng.uniform([0.0, 0.01 * stroke, -0.1], [1.5, 0.99 * stroke, 0.1], (STATES, 3))
    given = rng.uniform([0.0, 0.0, 0.1], [1.0, 2.0, 5.0], (STATES, 3))
    compares = np.floor(given[:, 0] * compare_max)
    calls = Calls(fmu)
    calls.add(Call.INITIALIZE)
    for state, (_, volts, supply), compare in zip(states, given, compares, strict=True):
        calls.set(compare=compare, voltage=volts, supply=supply, back_pressure=back)
        calls.states(*state)
        calls.add(Call.DISCRETE)
        calls.add(Call.CONTINUE)
        calls.add(Call.RATES, 3)
        calls.add(Call.INDICATORS, 3)
        calls.get("Q", "dP", "p_ahead", "p_behind", "at_stop")
        calls.add(Call.COMPLETED)
        calls.add(Call.EVENT)
    found, played = calls.made(binary), 0.0
    for index, state in enumerate(states):
        _, rates, signs, *outputs = found[8 * index : 8 * index + 8]
        volts = plant.u_max_V * compares[index] / compare_max + given[index, 1]
        must = _equations(plant, state, np.array([volts, given[index, 2]]), played)
        played = must["played"]
        expected = [must["di"], must["dx"], must["dv"], must["Q"], must["dP"], back + must["dP"], back, 0.0]
        scales = [1e3, 1.0, 1e3, 10.0, 1.0, 1.0, 1.0, 1.0]
        for each, value, size in zip([*rates, *(one for (one,) in outputs)], expected, scales, strict=True):
            if not isclose(each, value, rel_tol=CLOSE, abs_tol=CLOSE * size):
                yield f"at i, x, v = {state.round(6).tolist()} it gives {each:.9g}, expected {value:.9g}"
        if not (signs[0] > 0 and signs[1] > 0 and (signs[2] > 0) == (1e3 * state[1] > plant.overlap_mm)):
            yield f"at x = {state[1]:.6g} m the event indicators are {signs}"
    yield from _stop_faults(fmu, binary, plant)


def _stop_faults(fmu: FmuFile, binary: bytes, plant: Plant) -> Iterator[str]:
    """Yield what is wrong as the spool meets a stop, is held there, and is released: each an event."""
    stroke, loop_ohm = 1e-3 * plant.stroke_mm, plant.K_a * plant.K_fi_V_A + plant.R_c_ohm + plant.r_p_ohm
    strong = 2 * (plant.K_et_N_m * stroke + plant.preload_N + 1) / plant.K_i_N_A  # A, and half the play
    strong += plant.K_a * plant.hysteresis_V / loop_ohm
    for stop, end, holds_A, frees_A in ((-1, 0.0, 0.0, strong), (1, stroke, strong, 0.0)):
        calls = Calls(fmu)
        calls.add(Call.INITIALIZE)
        calls.set(supply=0.0)
        calls.states(holds_A, 0.5 * stroke, 0.0)
        calls.add(Call.DISCRETE)
        calls.add(Call.CONTINUE)
        for current, x, v in ((holds_A, end + stop * 1e-6, 0.1 * stop), (frees_A, end, 0.0)):
            calls.states(current, x, v)
            calls.add(Call.INDICATORS, 3)
            calls.add(Call.EVENT)
            calls.add(Call.DISCRETE)
            calls.get("x", "v", "at_stop")
            calls.add(Call.CONTINUE)
            calls.add(Call.RATES, 3)
            calls.add(Call.INDICATORS, 3)
        _, *found = calls.made(binary)
        place = 0 if stop < 0 else 1
        before, (changed, *_), (x,), (v,), (at,), rates, held = found[:7]
        crossed, _, _, _, (free,), moved, _ = found[7:]
        if before[place] >= 0 or not changed or (x, v, at) != (end, 0.0, stop) or rates[1:] != [0.0, 0.0]:
            yield f"past the stop at {end:g} m the indicator is {before[place]:g}, then x, v, at_stop = {x, v, at}"
        if held[place] > 0 or crossed[place] <= 0 or free != 0 or moved[2] * stop >= 0:
            yield f"let go of the stop at {end:g} m the indicator goes to {crossed[place]:g}, at_stop to {free:g}"
