"""Units are checked apart from the proofs; expressions are the same only as functions; transforms are linear."""

from dataclasses import replace

import pytest
import sympy

from dzdesign.derivation import plant
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account import identity
from dzdesign.derivation.account import symbol_units as units
from dzdesign.derivation.account.transfer import laplace
from tests.support.account_claims import BY_NUMBER, FOREIGN, given


def test_units_find_the_mixed_sums_and_nothing_else(verdicts):
    wrong = {verdict.number: verdict.unit_error for verdict in verdicts.values() if verdict.unit_error}
    mixed = "a sum of counts and V"
    assert {number: wrong[number] for number in ("(30)", "(31)", "T5a")} == dict.fromkeys(
        ("(30)", "(31)", "T5a"), mixed
    )
    assert set(wrong) == {"(30)", "(31)", "T5a", "T7d"}


@pytest.mark.parametrize(
    ("number", "member", "error"),
    [
        ("(2)", s.Q_max / s.dP0, "m^3/s/V on the left"),
        ("(14)", s.u_O**0 + s.u_i, "dimensionless"),
        ("(11)", s.k * s.x + s.dP, "a sum of"),
        ("(5)", FOREIGN, "the unit of foreign is not known"),
    ],
)
def test_wrong_units_are_seen(number, member, error):
    statement = BY_NUMBER[number]
    wrong = replace(statement, symbol=sympy.Symbol("u_O_") if statement.symbol == s.u_O else statement.symbol)
    wrong = replace(statement, members=(member,))
    assert units.find_unit_error(wrong).replace("a number", "dimensionless").find(error) >= 0


def test_units_of_a_comparison_are_seen():
    wrong = given("one", s.u_no, sympy.Piecewise((s.u_0, s.dP1 > s.u_min), (s.beta * s.u_0, True)))
    assert units.find_unit_error(wrong).startswith("a comparison of ")


def test_roots_of_what_may_be_negative_are_not_merged():
    assert not identity.agree(sympy.sqrt(s.u_1) * sympy.sqrt(s.u_2), sympy.sqrt(s.u_1 * s.u_2))
    assert identity.agree(sympy.sqrt(s.dP0) * sympy.sqrt(s.dP1), sympy.sqrt(s.dP0 * s.dP1))


def test_the_laplace_transform_needs_a_linear_equation(monkeypatch, wording):
    square = sympy.Eq(s.f_e, s.K_i * s.i**2)
    monkeypatch.setitem(plant.PLANT_EQUATIONS, "(22)", square)
    with pytest.raises(ValueError) as caught:
        laplace("(22)")
    wording("the account: not linear", str(caught.value))
