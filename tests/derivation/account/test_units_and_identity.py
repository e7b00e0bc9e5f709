"""Units are checked apart from the proofs; expressions are the same only as functions; transforms are linear."""

from dataclasses import replace

import pytest
import sympy

from dzdesign.derivation import plant
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account import solving, units
from dzdesign.derivation.account.transfer import laplace
from tests.support.account_claims import BY_NUMBER, FOREIGN, given


def test_units_find_the_mixed_sums_and_nothing_else(verdicts):
    wrong = {verdict.number: verdict.unit_error for verdict in verdicts.values() if verdict.unit_error}
    counts, volts, gain = (f"the right-hand side is not in {unit}" for unit in ("counts", "V", "m^3/s/V"))
    assert wrong == {"(30)": counts, "(31)": counts, "T5a": volts, "T7d": gain}


@pytest.mark.parametrize(
    ("number", "member", "error"),
    [
        ("(2)", s.Q_max / s.dP0, "the right-hand side is not in m^3/s/V"),
        ("(14)", s.u_O**0 + s.u_i, "the right-hand side is not in V"),
        ("(11)", s.k * s.x + s.dP, "the right-hand side is not in V"),
        ("(5)", sympy.log(s.u_min1) / sympy.log(s.u_min0), "the right-hand side is not in 1"),
        ("(5)", sympy.sqrt(s.u_min1) / s.u_min0, "the right-hand side is not in 1"),
        ("(14)", sympy.Integer(2), "the right-hand side is not in V"),
        ("(5)", FOREIGN, "the unit of foreign is not known"),
    ],
)
def test_wrong_units_are_seen(number, member, error):
    statement = BY_NUMBER[number]
    assert units.find_unit_error(replace(statement, members=(member,))) == error


def test_units_of_a_comparison_are_seen():
    wrong = given("one", s.u_no, sympy.Piecewise((s.u_0, s.dP1 > s.u_min), (s.beta * s.u_0, True)))
    assert units.find_unit_error(wrong) == "dP1 > u_min compares two units"


def test_roots_of_what_may_be_negative_are_not_merged():
    assert not solving.agree(sympy.sqrt(s.u_1) * sympy.sqrt(s.u_2), sympy.sqrt(s.u_1 * s.u_2))
    assert solving.agree(sympy.sqrt(s.dP0) * sympy.sqrt(s.dP1), sympy.sqrt(s.dP0 * s.dP1))


def test_the_laplace_transform_needs_a_linear_equation(monkeypatch, wording):
    square = sympy.Eq(s.f_e, s.K_i * s.i**2)
    monkeypatch.setitem(plant.PLANT_EQUATIONS, "(22)", square)
    with pytest.raises(ValueError) as caught:
        laplace("(22)")
    wording("the account: not linear", str(caught.value))
