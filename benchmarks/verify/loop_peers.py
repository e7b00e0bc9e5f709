"""Other ways to run the same plant with the same compensator: what an engineer would write with CasADi or SciPy.

All of them resolve the pulse: on and off are two phases, and each phase is integrated apart. The spool is kept between
its stops by limiting its position, as such scripts do; the product finds the moment of impact.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant, derivatives, orifice
from tests.support.c_library import load_library

#: PWM periods between two samples of the core.
TICKS = 2
SAMPLE_S = TICKS * PWM_PERIOD_S
SUPPLY_MPA = 1.0
PARAMETERS = [field.name for field in fields(Plant)]
#: What CasADi asks of a function in a library; `core` stands for the generated compensator.
EXTERNAL = """
#include "dz_comp.h"
int core(const double **arg, double **res, long long *iw, double *w, int mem)
{
    (void)iw; (void)w; (void)mem;
    res[0][0] = (double)dz_comp((uint16_t)arg[0][0], (uint16_t)arg[1][0], (uint16_t)arg[2][0]);
    return 0;
}
long long core_n_in(void) { return 3; }
long long core_n_out(void) { return 1; }
"""


@dataclass(frozen=True, slots=True)
class Core:
    """The generated compensator as a Python function of three codes, and as a CasADi function."""

    call: Callable[[int, int, int], int]
    external: ca.Function
    codes: Callable
    compare_max: int


def core_of(firmware: Path) -> Core:
    """Return the core of a firmware folder."""
    sources = {path.name: path.read_text() for path in sorted((firmware / "core").glob("dz_comp*.[ch]"))}
    library = load_library({**sources, "core.c": EXTERNAL}, "the core")
    library.dz_comp.restype = ctypes.c_uint16
    signals = read_artefact((firmware / "compensator.json").read_bytes(), Compensator, "compensator.json").signals
    ends = [(each.zero_code, each.full_code) for each in (signals.command, signals.pressure_a, signals.pressure_b)]

    def codes(command, dp_MPa, round_down):
        span = float(signals.pressure_a.span_MPa)
        shares = (command, (dp_MPa + 1.0) / span, 1.0 / span)
        return tuple(round_down(low + share * (high - low)) for share, (low, high) in zip(shares, ends, strict=True))

    return Core(
        lambda *codes: library.dz_comp(*map(ctypes.c_uint16, codes)),
        ca.external("core", library._name),
        codes,
        signals.compare_max,
    )


def motion_of(parameters: ca.SX) -> tuple[ca.Function, ca.Function]:
    """Return d state/dt of (state, volts, supply), and (dP, Q) of (position, supply), with parameters as symbols."""
    plant = SimpleNamespace(**dict(zip(PARAMETERS, ca.vertsplit(parameters), strict=True)))
    state, inputs, rates = derivatives(plant)
    x, supply = ca.SX.sym("x"), ca.SX.sym("supply")
    opening = ca.fmax(x - plant.overlap_mm * 1e-3, 0)
    return (
        ca.Function("rates", [state, inputs, parameters], [rates]),
        ca.Function("orifice", [x, supply, parameters], list(orifice(plant, opening, supply))),
    )


def numbers(plant: Plant) -> np.ndarray:
    """Return the parameters of a plant in the order of `PARAMETERS`."""
    return np.array([getattr(plant, name) for name in PARAMETERS], dtype=float)


def sample_function(core: Core) -> ca.Function:
    """Return (state and compare, command, parameters) -> (state and compare, flow): two PWM periods, RK4 a phase."""
    parameters = ca.SX.sym("parameters", len(PARAMETERS))
    rates, flow = motion_of(parameters)
    state, duty, p = ca.SX.sym("state", 3), ca.SX.sym("duty"), parameters
    now = state
    for _ in range(TICKS):
        for volts, h in ((p[PARAMETERS.index("u_max_V")], duty * PWM_PERIOD_S), (0, (1 - duty) * PWM_PERIOD_S)):
            u = ca.vertcat(volts, 0, SUPPLY_MPA)
            k1 = rates(now, u, p)
            k2 = rates(now + h / 2 * k1, u, p)
            k3 = rates(now + h / 2 * k2, u, p)
            k4 = rates(now + h * k3, u, p)
            now += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            stroke = p[PARAMETERS.index("stroke_mm")] * 1e-3
            held = ca.fmin(ca.fmax(now[1], 0), stroke)
            now = ca.vertcat(now[0], held, ca.if_else(now[1] == held, now[2], 0))
    moved = ca.Function("moved", [state, duty, p], [now])
    before, command, given = ca.MX.sym("before", 4), ca.MX.sym("command"), ca.MX.sym("p", len(PARAMETERS))
    dp_MPa, _ = flow(before[1], SUPPLY_MPA, given)
    compare = core.external(*core.codes(command, dp_MPa, ca.floor))
    after = moved(before[:3], before[3] / core.compare_max, given)
    q_L_min = flow(after[1], SUPPLY_MPA, given)[1]
    return ca.Function("sample", [before, command, given], [ca.vertcat(after, compare), q_L_min])


def python_loop(plant: Plant, core: Core, command: np.ndarray, tolerance: float = 1e-6) -> np.ndarray:
    """Return the position, mm, after each sample: a Python loop over CasADi's CVODES, one call a phase."""
    stepper = phase_integrator(plant, tolerance)
    _, flow = motion_of(ca.SX.sym("parameters", len(PARAMETERS)))
    state, compare, found = np.zeros(3), 0, []
    for share in command:
        dp_MPa = float(flow(state[1], SUPPLY_MPA, numbers(plant))[0])
        duty, compare = compare / core.compare_max, core.call(*core.codes(share, dp_MPa, int))
        for _ in range(TICKS):
            for volts, h in ((plant.u_max_V, duty * PWM_PERIOD_S), (0.0, (1 - duty) * PWM_PERIOD_S)):
                state = _between_stops(stepper(state, volts, h, 0.0, SUPPLY_MPA), plant)
        found.append(1e3 * state[1])
    return np.array(found)


def phase_integrator(plant: Plant, tolerance: float) -> Callable:
    """Return (state, volts, seconds, play in N, supply in MPa) -> state, by CVODES, free of the stops."""
    state, inputs, rates = derivatives(plant)
    h = ca.SX.sym("h")
    scale = ca.vertcat(1.0, 1e-3, 1.0)  # A, mm and m/s: CVODES has one absolute tolerance
    problem = {"x": state, "p": ca.vertcat(inputs, h), "ode": h * ca.substitute(rates, state, state * scale) / scale}
    solver = ca.integrator("phase", "cvodes", problem, 0, 1, {"reltol": tolerance, "abstol": tolerance * 1e-2,
                                                              "max_num_steps": 100000})  # fmt: skip
    factors = np.array([1.0, 1e-3, 1.0])

    def step(state, volts, seconds, play_N, supply_MPa):
        if seconds <= 0:
            return state
        return np.array(solver(x0=state / factors, p=[volts, play_N, supply_MPa, seconds])["xf"]).ravel() * factors

    return step


def _between_stops(state: np.ndarray, plant: Plant) -> np.ndarray:
    held = min(max(state[1], 0.0), plant.stroke_mm * 1e-3)
    return np.array([state[0], held, state[2] if held == state[1] else 0.0])


def scipy_loop(plant: Plant, core: Core, command: np.ndarray) -> np.ndarray:
    """Return the position, mm, after each sample: SciPy's solve_ivp with its own default method, one call a phase."""
    from scipy.integrate import solve_ivp

    rates, flow = motion_of(ca.SX.sym("parameters", len(PARAMETERS)))
    given, state, compare, found = numbers(plant), np.zeros(3), 0, []
    for share in command:
        dp_MPa = float(flow(state[1], SUPPLY_MPA, given)[0])
        duty, compare = compare / core.compare_max, core.call(*core.codes(share, dp_MPa, int))
        for _ in range(TICKS):
            for volts, h in ((plant.u_max_V, duty * PWM_PERIOD_S), (0.0, (1 - duty) * PWM_PERIOD_S)):
                if h > 0:
                    u = [volts, 0.0, SUPPLY_MPA]
                    run = solve_ivp(
                        lambda _time, now, u=u: np.array(rates(now, u, given)).ravel(), (0, h), state,
                        rtol=1e-6, atol=1e-9,
                    )  # fmt: skip
                    state = _between_stops(run.y[:, -1], plant)
        found.append(1e3 * state[1])
    return np.array(found)
