"""A law checks what it states, the plant is what the paper prints, and what the rooms compute from them is the same."""

import random
from fractions import Fraction

import casadi as ca
import numpy as np
import pytest
import sympy

from dzdesign.core.errors import InputError
from dzdesign.derivation import plant, scaling
from dzdesign.derivation import symbols as s
from dzdesign.derivation.law import LAW_NAMES, Law, law
from dzdesign.derivation.lowering import lower

FOREIGN = sympy.Symbol("foreign", positive=True)

# --- the law ------------------------------------------------------------------------------------------------

KAPPAS = [Fraction(n, 7) for n in (1, 3, 7, 9)]


def test_the_laws_agree_at_the_reference_and_differ_beside_it():
    for kappa in KAPPAS:
        assert law("paper").evaluate_gain(1, kappa) == law("target").evaluate_gain(1, kappa) == kappa
    assert law("paper").evaluate_gain(Fraction(9, 10), Fraction(1, 2)) > Fraction(1, 2)
    assert law("paper").offset == law("target").offset


def test_unknown_law_names_the_nearest(wording):
    with wording.refusal(InputError, "a law: unknown"):
        law("papper")


GAIN, OFFSET = s.k * s.x_max / s.u_max, s.beta * s.u_min0


@pytest.mark.parametrize(
    ("fault", "output", "rises_if"),
    [
        ("a square of the command", s.u_i**2, sympy.true),
        ("a square of beta", s.beta**2 * s.u_i + OFFSET, sympy.true),
        ("another symbol", s.u_i * FOREIGN, sympy.true),
        ("no offset", GAIN * s.u_i, sympy.true),
        ("may fall", (s.beta * (GAIN - 1) + 1) * s.u_i + OFFSET, sympy.true),
        ("rises always", GAIN * s.u_i + OFFSET, s.beta < 1),
    ],
)
def test_a_law_checks_what_it_states(fault, output, rises_if, wording):
    with wording.refusal(ValueError, f"a law: {fault}"):
        Law(name="wrong", equation="", output=output, rises_if=rises_if, note="")


def test_a_law_of_its_own_is_a_choice_of_the_account():
    stated = Law(name="plain", equation="", output=s.u_i + OFFSET, note="No gain.")
    assert [one.number for one in stated.statements] == [stated.stated_as] == ["plain"]
    assert stated.statements[0].kind.is_given and stated.statements[0].members == (stated.output,)


# --- the plant ----------------------------------------------------------------------------------------------


def test_plant_satisfies_the_published_equations():
    derivatives = plant.state_derivatives()
    feedback = s.K_fi * s.i
    solution = {
        s.di_dt: derivatives.di_dt,
        s.dx_e_dt: derivatives.dx_e_dt,
        s.dv_dt: derivatives.dv_dt,
        s.u_if: feedback,
        s.u_e: s.K_a * (s.u_i - feedback),
        s.f_e: s.K_i * s.i,
        s.Q: plant.flow(),
    }
    for number, equation in plant.PLANT_EQUATIONS.items():
        assert sympy.simplify((equation.lhs - equation.rhs).subs(solution)) == 0, number


def test_plant_is_in_its_state_inputs_and_parameters():
    names = {*plant.STATE, *plant.INPUTS, *plant.PARAMETERS}
    assert set().union(*(row.free_symbols for row in plant.state_derivatives())) == names
    assert plant.flow().free_symbols == {s.x_e, *plant.FLOW_PARAMETERS}


def test_current_settles_with_its_time_constant():
    t = sympy.Symbol("t", positive=True)
    current = plant.steady_state_current() * (1 - sympy.exp(-t / plant.current_time_constant()))
    slope = plant.state_derivatives().di_dt.subs(s.i, current)
    assert sympy.simplify(sympy.diff(current, t) - slope) == 0
    expected = s.L_c / (s.R_c + s.r_p + s.K_a * s.K_fi)
    assert sympy.simplify(plant.current_time_constant() - expected) == 0


SEED = 20261121
DIGITS = 50
#: Doubles carry 53 bits; no expression here has more than 60 roundings, and none cancels more than it adds.
DOUBLE = 60 * 2.0**-53


@pytest.fixture(params=range(SEED, SEED + 20))
def draw(request):
    """Random numbers by the seed that stands in the test's name."""
    return random.Random(request.param)


def precisely(expression, values):
    """Evaluate with SymPy at 50 digits: slow, and with nothing of the lowered functions."""
    return sympy.N(expression.subs({name: sympy.Rational(value) for name, value in values.items()}), DIGITS)


@pytest.mark.parametrize("name", LAW_NAMES)
def test_the_law_in_volts(name, draw):
    kappa, beta, u_i = (Fraction(draw.randint(1, 10**6), 10**6) for _ in range(3))
    values = {s.k: kappa, s.x_max: 1, s.u_max: 1, s.beta: beta, s.u_i: u_i, s.u_min0: Fraction(54, 100)}
    expected = precisely(law(name).output, values)
    exact = law(name).evaluate_gain(beta, kappa) * u_i + law(name).evaluate_offset(beta, Fraction(54, 100))
    assert type(exact) is Fraction
    assert sympy.Rational(exact) == law(name).output.subs({k: sympy.Rational(v) for k, v in values.items()})
    gain = law(name).evaluate_gain(float(beta), float(kappa))
    rounded = gain * float(u_i) + law(name).evaluate_offset(float(beta), 0.54)
    assert abs(sympy.Float(rounded, DIGITS) - expected) <= DOUBLE * abs(expected)


@pytest.mark.parametrize("name", LAW_NAMES)
def test_the_law_in_counts(name, draw):
    """In counts the law is n_full/u_max u_O at u_i = u_max n_i/n_adc, whatever way the rooms take to it."""
    code, n_adc, n_full = draw.randint(0, 4095), 4095, draw.randint(2, 65535)
    kappa, beta, start = (Fraction(draw.randint(1, 10**6), 10**6) for _ in range(3))
    line = scaling.evaluate_line(law(name), beta=beta, kappa=kappa, u_min0_over_u_max=start, n_adc=n_adc, n_full=n_full)
    exact = line.slope * code + line.start
    assert type(exact) is Fraction
    values = {s.k: kappa, s.x_max: 1, s.u_max: 1, s.beta: beta, s.u_min0: start, s.u_i: Fraction(code, n_adc)}
    in_volts = law(name).output.subs({symbol: sympy.Rational(value) for symbol, value in values.items()})
    assert sympy.Rational(exact) == n_full * in_volts
    assert sympy.Rational(scaling.drive(exact, n_full)) == in_volts


def test_the_pressures(draw):
    span, code_max = Fraction(draw.randint(1, 400), 10), draw.randint(1, 65535)
    code = draw.randint(-code_max, code_max)
    exact = scaling.pressure_drop(code, span=span, code_max=code_max)
    assert sympy.Rational(exact) == sympy.Rational(span) * code / code_max
    assert scaling.pressure_drop_code(exact, span=span, code_max=code_max) == code


def test_the_plant_in_casadi(draw):
    names = (*plant.STATE, *plant.INPUTS, *plant.PARAMETERS)
    values = {name: draw.randint(1, 2**20) / 2**16 for name in names}  # exact in binary
    lowered = lower(list(plant.state_derivatives()), names)
    arguments = [ca.SX.sym(str(name)) for name in names]
    function = ca.Function("rates", arguments, lowered(*arguments))
    found = function(*values.values())
    for derivative, rate in zip(plant.state_derivatives(), found, strict=True):
        expected = precisely(derivative, values)
        # The sums of Eqs. (20) and (23) cancel, so the error is measured against the sum of their terms.
        scale = sum(abs(precisely(term, values)) for term in sympy.expand(derivative).args or (derivative,))
        assert abs(sympy.Float(float(rate), DIGITS) - expected) <= DOUBLE * scale


@pytest.mark.parametrize("sqrt", [ca.sqrt, np.sqrt], ids=["casadi", "numpy"])
def test_the_flow(sqrt, draw):
    names = (plant.STATE[1], *plant.FLOW_PARAMETERS)
    values = {name: draw.randint(1, 2**20) / 2**16 for name in names}
    found = lower(plant.flow(), names, {"sqrt": sqrt})(*(np.float64(value) for value in values.values()))
    expected = precisely(plant.flow(), values)
    assert abs(sympy.Float(float(found), DIGITS) - expected) <= DOUBLE * abs(expected)


@pytest.mark.parametrize(
    "expression",
    [
        s.u_i * sympy.Float(0.1),
        s.u_i + s.u_max,
        sympy.sqrt(s.u_i**2 + 1),
        s.u_i ** sympy.Rational(1, 3),
        sympy.sin(s.u_i),
        sympy.Piecewise((s.u_i, s.u_i > 0), (0, True)),
    ],
    ids=str,
)
def test_what_would_lose_digits_is_not_lowered(expression, wording):
    with wording.refusal(ValueError, f"lowering: {expression}"):
        lower(expression, (s.u_i,))


def test_ints_are_not_divided_to_floats():
    assert lower(s.u_i / 2 + s.u_max / 3, (s.u_i, s.u_max))(1, 1) == Fraction(5, 6)
    assert lower(s.u_i / (s.u_max / 2 + 1), (s.u_i, s.u_max))(1, 1) == Fraction(2, 3)
    np.testing.assert_allclose(lower(s.u_i / 2, (s.u_i,))(np.array([1.0, 3.0])), [0.5, 1.5])
    assert lower(s.u_i / s.u_max, (s.u_i, s.u_max))(1, 3) == Fraction(1, 3)
    assert lower(sympy.sqrt(s.u_max), (s.u_max,), {"sqrt": np.sqrt})(4.0) == 2.0
