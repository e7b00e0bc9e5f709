"""Conditions are proved needed, cases leave nothing out, signs are claimed right."""

import pytest
import sympy

from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.proof import prove
from dzdesign.derivation.account.statement import Case, Condition, Outcome
from tests.support.account_claims import BY_NUMBER, FOREIGN, changed, claim, given, last_words

IF, NOT = Outcome.FOLLOWS_IF, Outcome.DOES_NOT_FOLLOW


@pytest.mark.parametrize(
    ("any_of", "words"),
    [
        (((sympy.Eq(s.beta, 1),),), "follows if beta = 1 (sufficient; not proved necessary)"),
        (((sympy.Eq(s.beta, 1),), (sympy.Eq(s.kappa, 1),)), "follows if beta = 1 or kappa = 1 (necessary)"),
        (((sympy.Eq(s.beta, 1), sympy.Eq(s.kappa, 1)),), "follows if beta = 1 and kappa = 1 (sufficient; not proved"),
        (((sympy.Eq(s.beta, 2),),), "does not follow, not even if beta = 2"),
    ],
)
def test_a_condition_must_suffice_and_be_needed(any_of, words):
    difference = (s.beta - 1) * (s.kappa - 1)
    condition = Condition(any_of=any_of, discrepancy=difference)
    verdict = prove([given("one", s.slope, difference), claim(s.slope, 0, "one", condition=condition, expected=IF)])[-1]
    assert verdict.words.startswith(words)
    assert verdict.as_expected == ("(necessary)" in words)


def test_a_condition_that_is_not_needed_or_hides_another_difference_is_seen():
    condition = Condition(any_of=((sympy.Eq(s.beta, 1),),), discrepancy=s.beta - 1)
    one, two = given("one", s.slope, s.beta), given("two", s.beta, s.kappa)
    words = last_words(one, two, claim(s.slope, s.kappa, "one", "two", condition=condition, eliminate=(s.beta,)))
    assert words == "follows, also without beta = 1"
    words = last_words(one, claim(s.slope, 2 - s.beta, "one", condition=condition, expected=IF))
    assert words == "does not follow, and the difference is another one"


def test_a_condition_ruled_out_by_published_numbers_is_no_condition():
    def words(published):
        condition = Condition(
            any_of=((sympy.Eq(s.beta, 1),),), discrepancy=s.beta - 1, ruled_out_by=((s.beta, sympy.sympify(published)),)
        )
        return last_words(given("one", s.slope, s.beta), claim(s.slope, 1, "one", condition=condition, expected=NOT))

    assert words("9/10") == "does not follow (beta = 9/10): it would only if beta = 1"
    assert words(1) == "follows if beta = 1 (necessary)"


@pytest.mark.slow
def test_a_piecewise_claim_needs_a_case_for_every_branch():
    selector = BY_NUMBER["L2"]
    verdict = {v.number: v for v in prove(changed("L2", cases=selector.cases[:1]))}["L2"]
    assert verdict.words == "does not follow: no case stands for dP0 < dP1"
    undecided = Case(at=((s.dP1, FOREIGN),), where="")
    verdict = {v.number: v for v in prove(changed("L2", cases=(*selector.cases, undecided)))}["L2"]
    assert verdict.words == "does not follow: the case of a piecewise premise is not decided"


@pytest.mark.parametrize("claim", [s.beta < 2, s.beta > s.kappa, s.beta * (1 - s.k * s.x_max / s.u_max) < 2])
def test_a_wrong_sign_claim_is_seen(claim):
    verdict = {v.number: v for v in prove(changed("T4a", positive_if=claim))}["T4a"]
    assert verdict.words.startswith("does not follow: positive not exactly if")
    assert not verdict.as_expected
