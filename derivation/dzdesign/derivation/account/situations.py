"""The situations in which statements are tried: a valve, a pressure drop, what drives it, a command; and every symbol's
number there.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import sympy

from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.machines import (
    PlainPlant,
    PlainValve,
    drawn_commands,
    drawn_drops,
    drawn_plants,
    drawn_valves,
)
from dzdesign.derivation.account.scope import (
    BARE,
    CODES_AT_PIN,
    CODES_OF_COMMAND,
    FIXED_OPENING,
    FREE_BETA,
    FREE_OPENING,
    PLANT,
    WITH_TRANSITION,
    Setting,
    under_law,
)
from dzdesign.derivation.law import law
from dzdesign.derivation.laws import LAW_NAMES

_STEP = 1e-5  # of a difference quotient
_JUST_ABOVE = 1 + 1e-12  # times dP0: the limit from above
#: What a pressure drop and a command make of the command.
_Drive = Callable[[float, float], float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """What is set up, and the numbers there."""

    words: str
    settings: frozenset[Setting]
    #: Of command and pressure drop, which are no special ones: zero, full, at a threshold, dP0, dP1.
    general: frozenset[s.Name]
    numbers: Mapping[s.Name, float]
    #: Of functions, such as f(dP) and X_e(s).
    functions: Mapping[sympy.core.function.UndefinedFunction, Callable[[float], float]]


@cache
def situations() -> tuple[Situation, ...]:
    """Return all of them."""
    found = [one for valve in drawn_valves() for one in _of_valve(valve)]
    pairs = zip(drawn_valves(), 2 * drawn_plants(), strict=True)
    return (*found, *(_of_plant(valve, *plant, dP) for valve, plant in pairs for dP in drawn_drops(valve)))


def _of_valve(valve: PlainValve) -> Iterator[Situation]:
    """A bare valve at commands of both signs, and one behind a compensator at those from zero to full."""
    at_dP1 = valve.threshold(valve.dP1) / valve.u_min0
    first_seen = valve.command_for(valve.Q_floor, valve.dP0)
    for dP in drawn_drops(valve):
        small, *others = drawn_commands(valve, dP)
        compensated = (0.0, valve.u_max, small, *others)
        for u_i in (*compensated, first_seen, -valve.u_max, *(-one for one in others)):
            yield _situation(valve, dP, u_i, BARE, at_dP1, lambda _, u_i: u_i)
        for u_i in compensated:
            for name in LAW_NAMES:
                yield _situation(valve, dP, u_i, under_law(name), at_dP1, partial(_drive, valve, name))
            if dP == valve.dP1:
                for beta in (0.5, 1.0, 1.25):
                    yield _situation(valve, dP, u_i, FREE_BETA, beta, partial(_scaled_drive, valve, beta, dP))
    yield from _with_transition(valve)


def _with_transition(valve: PlainValve) -> Iterator[Situation]:
    """Zero band and transition: straight from an offset below the threshold, the closing one, to the opening law."""
    dP, opening = valve.dP1, valve.threshold(valve.dP1) / valve.u_min0
    band, end = valve.u_max * (0.03 + 0.001 * valve.k), valve.u_max * (0.3 + 0.01 * valve.k)

    for closing in (0.875 * opening, opening):

        def drives(at: float, u_i: float, offset: float = closing * valve.u_min0) -> float:
            if u_i <= band:
                return offset
            top = _scaled_drive(valve, opening, dP, dP, max(u_i, end))
            return top if u_i >= end else offset + (top - offset) * (u_i - band) / (end - band)

        for u_i in (0.0, 0.4 * band, band, 0.7 * band + 0.3 * end, end, 0.7 * valve.u_max, valve.u_max):
            place = _situation(valve, dP, u_i, WITH_TRANSITION, closing, drives)
            passed = min(max((u_i - band) / (end - band), 0.0), 1.0)
            own = {s.beta_o: opening, s.u_z: band, s.u_t: end, s.share: passed}
            yield replace(place, numbers={**place.numbers, **own})


def _drive(valve: PlainValve, name: str, dP: float, u_i: float) -> float:
    """What a law gives; of the two that the account is about without its formula."""
    if name == "paper":
        return _scaled_drive(valve, valve.threshold(dP) / valve.u_min0, math.inf, dP, u_i)
    kappa, offset = valve.k * valve.x_max / valve.u_max, valve.threshold(dP)
    if name == "target":
        return kappa * u_i + offset
    ratio = offset / valve.u_min0
    return float(law(name).evaluate_gain(ratio, kappa) * u_i + law(name).evaluate_offset(ratio, valve.u_min0))


@cache
def _reference_drive(valve: PlainValve, u_i: float) -> float:
    """Command at which the valve passes the wanted flow at dP0: the line through the flow at full command."""
    wanted = valve.C_d * valve.W * valve.x_max * math.sqrt(2 * valve.dP0 / valve.rho) * u_i / valve.u_max
    return valve.command_for(wanted, valve.dP0)


def _scaled_drive(valve: PlainValve, share: float, on_at: float, dP: float, u_i: float) -> float:
    """The paper's choice: the compensation signal of dP0, above dP0 a share of it; also at one other pressure drop."""
    scaled = share if dP > valve.dP0 or dP == on_at else 1.0
    return u_i + scaled * (_reference_drive(valve, u_i) - u_i)


def _situation(valve: PlainValve, dP: float, u_i: float, drive: Setting, beta: float, drives: _Drive) -> Situation:
    spool = FIXED_OPENING if valve.has_stop else FREE_OPENING
    codes, u_O = CODES_OF_COMMAND if valve.fall else CODES_AT_PIN, drives(dP, u_i)
    numbers = {
        **_constants(valve),
        **_at_drop(valve, dP),
        **_of_flow(valve, dP, u_i, u_O),
        **_of_command(valve, u_i, u_O, beta, drive, codes),
        **_of_drive(valve, dP, u_i, drives),
        s.u_dz: _left(valve.threshold(dP), partial(drives, dP)),
    }
    return Situation(
        words=f"valve with {valve.name}, {drive.words}, dP = {dP:g}, u_i = {u_i:g}, beta = {beta:g}",
        settings=frozenset((drive, spool, codes)),
        general=_general(valve, dP, u_i),
        numbers=numbers,
        functions={s.f: valve.threshold},
    )


def _general(valve: PlainValve, dP: float, u_i: float) -> frozenset[s.Name]:
    is_general = {s.dP: dP not in (valve.dP0, valve.dP1), s.u_i: abs(u_i) not in (0.0, valve.u_max)}
    return frozenset(name for name, here in is_general.items() if here)


def _left(threshold: float, drives: Callable[[float], float]) -> float:
    """Command at which a drive reaches the threshold: a straight line, from two of its points."""
    low, high = drives(0.25), drives(1.25)
    return 0.25 + (threshold - low) / (high - low)


@cache
def _constants(valve: PlainValve) -> dict[s.Name, float]:
    numbers: dict[s.Name, float] = {}
    for index, dP in ((0, valve.dP0), (1, valve.dP1)):
        numbers |= {names[index]: value for names, value in _of_drop(valve, dP).items()}
    per_opening = valve.C_d * valve.W / math.sqrt(valve.rho / 2)
    return {
        **numbers,
        **{s.u_max: valve.u_max, s.k: valve.k, s.x_max: valve.x_max, s.Q_floor: valve.Q_floor},
        **{s.C_d: valve.C_d, s.W: valve.W, s.rho: valve.rho, s.scale: valve.scale},
        s.gamma_0: per_opening * math.sqrt(valve.dP0),
        s.gamma_1: per_opening * math.sqrt(valve.dP1),
        s.fall: numbers[s.u_seen0] - numbers[s.u_seen1],
        s.n: math.log(numbers[s.Q_max1] / numbers[s.Q_max0]) / math.log(valve.dP1 / valve.dP0),
        s.q_x: valve.k * valve.x_max,
        **{s.headroom: 0.5, s.above: 0.5},  # which only decide between cases
        **{s.n_adc: valve.n_adc, s.V_adc: valve.V_adc, s.n_V: valve.n_adc / valve.V_adc, s.n_full: valve.n_full},
    }


@cache
def _of_drop(valve: PlainValve, dP: float) -> dict[tuple[s.Name, s.Name], float]:
    """What depends on the pressure drop, by its names at dP0 and dP1."""
    threshold, largest = valve.threshold(dP), valve.flow(valve.u_max, dP)
    return {
        (s.dP0, s.dP1): dP,
        (s.u_min0, s.u_min1): threshold,
        (s.u_seen0, s.u_seen1): valve.command_for(valve.Q_floor, dP),
        (s.K_0, s.K_1): largest / valve.u_max,
        (s.Q_max0, s.Q_max1): largest,
        (s.s_flow0, s.s_flow1): (valve.flow(threshold + 0.5, dP) - valve.flow(threshold + 0.25, dP)) / 0.25,
    }


@cache
def _at_drop(valve: PlainValve, dP: float) -> dict[s.Name, float]:
    generic = {names: name for name, names in s.AT_PRESSURE_DROPS.items()}
    threshold = valve.threshold(dP)
    u_1, u_2 = threshold + 0.25, threshold + 1.0
    samples = {s.u_1: u_1, s.u_2: u_2, s.Q_1: valve.flow(u_1, dP), s.Q_2: valve.flow(u_2, dP)}
    return {generic[names]: value for names, value in _of_drop(valve, dP).items()} | samples


def _of_flow(valve: PlainValve, dP: float, u_i: float, u_O: float) -> dict[s.Name, float]:
    def flow(**changes: Any) -> float:
        return replace(valve, **changes).flow(u_O, dP)

    def sensitivity(name: str) -> float:
        value = getattr(valve, name)
        return (flow(**{name: value + _STEP}) - flow(**{name: value - _STEP})) / (2 * _STEP)

    x, overlap = valve.opening(u_O, dP), valve.x_ov
    scaled = flow(C_d=valve.scale * valve.C_d, k=valve.scale * valve.k, x_max=valve.x_max / valve.scale)
    beyond = abs(u_O) - valve.threshold(dP)
    wanted = {
        name: valve.flow(valve.u_max, at) / valve.u_max * u_i
        for name, at in ((s.Q_w, dP), (s.Q_O, valve.dP0), (s.Q_O_prime, valve.dP1))
    }
    return {
        **{s.u_i: u_i, s.u_O: u_O, s.Q: flow(), s.Q_neg: valve.flow(-u_O, dP), s.Q_scaled: scaled, **wanted},
        **{s.x: x, s.x_ov: overlap, s.x_e: x + overlap if beyond >= 0 else overlap + beyond / valve.k},
        **{s.u_i_prime: max(0.0, beyond), s.y: abs(beyond)},
        s.dQ_dC_d: sensitivity("C_d"), s.dQ_dk: sensitivity("k"), s.dQ_dx_max: sensitivity("x_max"),
    }  # fmt: skip


def _of_drive(valve: PlainValve, dP: float, u_i: float, drives: _Drive) -> dict[s.Name, float]:
    """What a drive gives beside this command, and on both sides of dP0."""
    above, below = drives(valve.dP0 * _JUST_ABOVE, u_i), drives(valve.dP0, u_i)
    step = _STEP if u_i < valve.u_max else -_STEP
    slope = (drives(dP, u_i + step) - drives(dP, u_i)) / step
    return {s.slope: slope, s.u_above: above, s.u_below: below, s.jump: above - below}


def _of_command(
    valve: PlainValve, u_i: float, u_O: float, beta: float, drive: Setting, codes: Setting
) -> dict[s.Name, float]:
    pin = valve.V_adc * u_i / valve.u_max
    numbers = {
        **{
            s.beta: beta,
            s.drive_left: valve.u_max - u_O,
            s.duty: u_O / valve.u_max,
            s.n_pwm: valve.n_full * u_O / valve.u_max,
        },
        **{s.V_pin: pin, s.n_i: valve.n_adc * pin / valve.V_adc},
        s.K_c: (valve.V_adc if codes == CODES_AT_PIN else valve.u_max) / valve.n_adc * valve.K_c_share,
    }
    if u_i < 0:
        return numbers
    signal = _reference_drive(valve, u_i) - u_i
    per_volt = valve.n_adc / (valve.V_adc if codes == CODES_AT_PIN else valve.u_max)
    numbers |= {s.u_0: signal, s.n_0: per_volt * signal}
    if drive != BARE:
        numbers[s.u_no] = u_O - u_i
    if drive in (FREE_BETA, under_law("paper")):  # whether or not the selector takes it
        numbers[s.n_no] = per_volt * beta * signal
    return numbers


def _of_plant(valve: PlainValve, plant: PlainPlant, at_s: float, dP: float) -> Situation:
    """The simulation model at one moment, and its transforms at one s."""
    i, x_e, v = 0.5 * at_s, 0.625, -0.25 * at_s
    di_dt, dx_e_dt, dv_dt = plant.rates(i, x_e, v, plant.u_step, plant.load_step)
    feedback = plant.K_fi * i
    names = "K_a K_fi K_i R_c r_p L_c m_e B_e K_et i_init x_init v_init a"
    per_opening = valve.C_d * valve.W * math.sqrt(2 * dP / valve.rho)

    def current(at: float) -> float:
        return plant.transforms(at)[0]

    def travel(at: float) -> float:
        return plant.transforms(at)[1]

    def output(at: float) -> float:
        return plant.K_a * (plant.u_step / at - plant.K_fi * current(at))

    def flow(at: float) -> float:  # of a pressure drop that falls
        return per_opening * travel(at + plant.a)

    still = replace(plant, load_step=0.0, i_init=0.0, x_init=0.0, v_init=0.0)
    numbers = {
        **_constants(valve),
        **_at_drop(valve, dP),
        **{getattr(s, name): getattr(plant, name) for name in names.split()},
        **{s.i: i, s.x_e: x_e, s.v: v, s.di_dt: di_dt, s.dx_e_dt: dx_e_dt, s.dv_dt: dv_dt},
        **{s.u_i: plant.u_step, s.u_if: feedback, s.u_e: plant.K_a * (plant.u_step - feedback)},
        **{s.f_e: plant.K_i * i, s.f_eL: plant.load_step, s.s: at_s, s.x_ov: 0.0, s.x: x_e, s.Q: per_opening * x_e},
        # Long after a step the flow per command.
        s.G_0: per_opening * still.transforms(1e-9)[1] * 1e-9 / plant.u_step,
    }
    functions = {
        s.f: valve.threshold,
        s.U_i.func: lambda at: plant.u_step / at,
        s.U_if.func: lambda at: plant.K_fi * current(at),
        s.U_e.func: output,
        s.I_s.func: current,
        s.F_e.func: lambda at: plant.K_i * current(at),
        s.F_eL.func: lambda at: plant.load_step / at,
        s.X_e.func: travel,
        s.Q_s.func: flow,
        s.G.func: lambda at: flow(at) / (plant.u_step / at),
    }
    spool = FIXED_OPENING if valve.has_stop else FREE_OPENING
    words = (
        f"valve with {valve.name}, {PLANT.words}, dP = {dP:g}, {'' if plant.load_step else 'un'}loaded, a = {plant.a:g}"
    )
    return Situation(
        words=words,
        settings=frozenset((PLANT, spool)),
        general=_general(valve, dP, plant.u_step),
        numbers=numbers,
        functions=functions,
    )
