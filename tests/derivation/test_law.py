"""A law checks what it states, and the plant is what the paper prints."""

from fractions import Fraction

import pytest
import sympy

from dzdesign.core.errors import InputError
from dzdesign.derivation import plant
from dzdesign.derivation import symbols as s
from dzdesign.derivation.law import Law, law

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
