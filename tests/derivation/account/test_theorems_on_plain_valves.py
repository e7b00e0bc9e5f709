"""The theorems in numbers: the paper's, and those of valves in plain floating point."""

import math
import random

import pytest
import sympy

from dzdesign.derivation import plant
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.published import FIRST
from tests.support.account_claims import BY_NUMBER

SEED = 20261121


def figure(number, label):
    statement = BY_NUMBER[number]
    value = next(value for value in statement.values if label in value.label)
    return float(value.exact(statement))


@pytest.mark.parametrize(
    ("number", "label", "expected", "digits"),
    [
        ("T1b", "first valve", 1.048, 3),
        ("T1b", "second valve", 1.018, 3),
        ("T2e", "first valve", 4.55, 2),
        ("T2e", "simulation", 3.7, 1),
        ("T2e", "second valve", 1.7, 1),
        ("T3b", "simulation", 0.94, 2),
        ("T3b", "first valve", 1.12, 2),
        ("T5c", "without", 20, 1),
        ("T5c", "second valve", 54.6, 1),
        ("T5c", "first valve", 63.1, 1),
        ("T7a", "first valve", 0.30, 2),
    ],
)
def test_the_papers_numbers(number, label, expected, digits):
    assert round(figure(number, label), digits) == expected


class Valve:
    """A valve in plain floating point, with nothing of the account: the dead zone, a straight part, a stop."""

    def __init__(self, draw):
        self.u_max, self.k, self.x_max = 10.0, draw.uniform(2e3, 6e3), draw.uniform(0.6e-3, 1.2e-3)
        self.conductance = draw.uniform(0.5, 2) * 1e-6  # m^3/s per m and Pa^0.5
        self.u_min0 = draw.uniform(3, 5)
        self.beta = draw.uniform(0.8, 0.99)
        self.dP0, self.dP1 = 1e6, draw.uniform(2e6, 6e6)

    def flow(self, u, u_min, dP):
        return self.conductance * math.sqrt(dP) * max(0.0, u - u_min) / self.k

    def symbols(self):
        return {
            s.u_max: self.u_max, s.k: self.k, s.x_max: self.x_max, s.u_min0: self.u_min0, s.beta: self.beta,
            s.u_min1: self.beta * self.u_min0, s.dP0: self.dP0, s.dP1: self.dP1,
            s.C_d: self.conductance, s.W: 1.0, s.rho: 2.0,
        }  # fmt: skip


@pytest.fixture(params=range(5), ids=lambda n: f"seed{SEED + n}")
def valve(request):
    return Valve(random.Random(SEED + request.param))


def evaluated(expression, values):
    result = expression.subs(values)
    assert result.is_number, result
    return float(result)


def test_theorem_1_on_a_plain_valve(valve):
    kappa, u_min1 = valve.k * valve.x_max / valve.u_max, valve.beta * valve.u_min0
    factor = BY_NUMBER["T1b"].members[1] / s.Q_O_prime
    for u_i in (0.1, 3.0, 10.0):
        target = valve.conductance * math.sqrt(valve.dP1) * valve.x_max / valve.u_max * u_i
        by_paper = (valve.beta * kappa - valve.beta + 1) * u_i + valve.beta * valve.u_min0
        by_target = kappa * u_i + valve.beta * valve.u_min0
        ratio = valve.flow(by_paper, u_min1, valve.dP1) / target
        assert ratio == pytest.approx(evaluated(factor, valve.symbols()), rel=1e-12)
        assert valve.flow(by_target, u_min1, valve.dP1) == pytest.approx(target, rel=1e-12)


def test_theorem_2_on_a_plain_valve(valve):
    """Full command is the limit: the paper's law is exact, the law `target` falls short, at every command."""
    valve.x_max = (valve.u_max - valve.u_min0) / valve.k
    kappa, u_min1 = valve.k * valve.x_max / valve.u_max, valve.beta * valve.u_min0
    largest = valve.flow(valve.u_max, u_min1, valve.dP1)
    loss = BY_NUMBER["T2e"].values[0].of
    for u_i in (0.1, 3.0, 10.0):
        by_paper = (valve.beta * kappa - valve.beta + 1) * u_i + valve.beta * valve.u_min0
        by_target = kappa * u_i + valve.beta * valve.u_min0
        line = largest * u_i / valve.u_max
        assert valve.flow(by_paper, u_min1, valve.dP1) == pytest.approx(line, rel=1e-12)
        lost = 1 - valve.flow(by_target, u_min1, valve.dP1) / line
        assert lost == pytest.approx(evaluated(loss, valve.symbols()), rel=1e-9)


def test_theorem_3_on_a_plain_valve(valve):
    u_min1, flow = valve.beta * valve.u_min0, BY_NUMBER["T3a"].members[0]
    for beta in (0.7 * valve.beta, valve.beta, 1.0):
        values = {**valve.symbols(), s.beta: beta, s.gamma_1: valve.conductance * math.sqrt(valve.dP1)}
        expected = valve.flow(beta * valve.u_min0, u_min1, valve.dP1)
        assert evaluated(flow, values) == pytest.approx(expected, rel=1e-9, abs=1e-18)


def test_theorem_9_on_a_plain_valve(valve):
    floor = 1e-8

    def first_seen(dP):
        low, high = valve.u_min0, 10.0
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (low, middle) if valve.flow(middle, valve.u_min0, dP) >= floor else (middle, high)
        return high

    values = {**valve.symbols(), s.Q_floor: floor, s.gamma_0: valve.conductance * math.sqrt(valve.dP0)}
    fall = first_seen(valve.dP0) - first_seen(valve.dP1)
    assert evaluated(BY_NUMBER["T9b"].members[-1], values) == pytest.approx(fall, rel=1e-6)


def test_the_meter_explains_the_flow_at_zero_command_better():
    measured, without, with_floor = 1.6, figure("T3b", "first valve"), figure("T9d", "first valve")
    assert abs(with_floor - measured) < abs(without - measured) / 4
    assert FIRST.at()


def test_the_current_by_its_transfer_function_is_the_current_in_time():
    numbers = {s.K_a: 2, s.K_fi: 3, s.R_c: 5, s.r_p: 1, s.L_c: 4}
    step = BY_NUMBER["T6a"].members[0].subs({s.U_i: 1 / s.s}).subs(numbers)
    current = sympy.inverse_laplace_transform(step, s.s, s.t)
    slope = plant.state_derivatives().di_dt.subs({s.u_i: 1}).subs(numbers).subs(s.i, current)
    assert sympy.simplify(sympy.diff(current, s.t) - slope) == 0
