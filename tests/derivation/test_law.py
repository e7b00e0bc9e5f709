"""The law is the same for every kind of number, and the plant is what the paper prints."""

import itertools
from fractions import Fraction

import casadi
import numpy as np
import pytest
import sympy

from dzdesign.core.errors import InputError
from dzdesign.derivation import plant
from dzdesign.derivation import symbols as s
from dzdesign.derivation.law import LAW_NAMES, Law, law

FOREIGN = sympy.Symbol("foreign", positive=True)

# --- the law ------------------------------------------------------------------------------------------------

BETAS = [Fraction(n, 20) for n in (1, 13, 19, 20, 21)]
KAPPAS = [Fraction(n, 7) for n in (1, 3, 7, 9)]


@pytest.mark.parametrize("name", LAW_NAMES)
def test_law_agrees_on_every_number_type(name):
    beta, kappa, u_min0 = np.array(BETAS, dtype=float)[:, None], np.array(KAPPAS, dtype=float), 5.4
    exact = [[float(law(name).evaluate_gain(b, q)) for q in KAPPAS] for b in BETAS]
    np.testing.assert_allclose(law(name).evaluate_gain(beta, kappa) + 0 * beta, exact, atol=1e-15)

    b, q = casadi.SX.sym("b"), casadi.SX.sym("q")
    outputs = [law(name).evaluate_gain(b, q), law(name).evaluate_offset(b, u_min0)]
    lowered = casadi.Function("law", [b, q], outputs)
    for row, column in np.ndindex(len(BETAS), len(KAPPAS)):
        gain, offset = lowered(float(BETAS[row]), float(KAPPAS[column]))
        assert float(gain) == pytest.approx(exact[row][column], abs=1e-15)
        assert float(offset) == pytest.approx(float(BETAS[row]) * u_min0, rel=1e-15)


def test_the_paper_law_is_monotone_exactly_if_beta_times_one_minus_kappa_is_below_one():
    for beta, kappa in itertools.product([*BETAS, Fraction(7, 6), Fraction(3)], KAPPAS):
        assert (law("paper").evaluate_gain(beta, kappa) > 0) == (beta * (1 - kappa) < 1)
        assert law("target").evaluate_gain(beta, kappa) > 0


def test_the_laws_agree_at_the_reference_and_differ_beside_it():
    for kappa in KAPPAS:
        assert law("paper").evaluate_gain(1, kappa) == law("target").evaluate_gain(1, kappa) == kappa
    assert law("paper").evaluate_gain(Fraction(9, 10), Fraction(1, 2)) > Fraction(1, 2)
    assert law("paper").offset == law("target").offset


def test_unknown_law_names_the_nearest(wording):
    with pytest.raises(InputError) as caught:
        law("papper")
    wording("a law: unknown", str(caught.value))


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
    with pytest.raises(ValueError) as caught:
        Law(name="wrong", equation="", output=output, rises_if=rises_if, note="")
    wording(f"a law: {fault}", str(caught.value))


def test_a_law_of_its_own_is_a_choice_of_the_account():
    stated = Law(name="plain", equation="", output=s.u_i + OFFSET, note="No gain.")
    assert [one.number for one in stated.statements] == [stated.stated_as] == ["plain"]
    assert stated.statements[0].kind.is_given and stated.statements[0].members == (stated.output,)


def test_a_law_with_a_fraction_stays_exact():
    halved = Law(name="halved", equation="", output=GAIN * s.u_i / 2 + OFFSET, note="")
    assert halved.evaluate_gain(1, Fraction(1, 3)) == Fraction(1, 6)
    assert halved.evaluate_gain(1.0, 0.5) == 0.25
    assert Law(name="half", equation="", output=s.u_i / 2 + OFFSET, note="").evaluate_gain(1, 1) == Fraction(1, 2)


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
