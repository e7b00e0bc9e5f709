"""Conditions are proved needed, cases leave nothing out, signs are claimed right."""

from dataclasses import replace

import pytest
import sympy

from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.proof import prove
from dzdesign.derivation.account.scope import scope
from dzdesign.derivation.account.statement import Case, Condition, Ground, Kind, Outcome
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


def test_cases_must_leave_nothing_out():
    selector = given("selector", s.u_no, sympy.Piecewise((s.u_0, s.dP1 <= s.dP0), (s.beta * s.u_0, True)))
    at, up, down = (Case(at=((s.dP1, value),), where="") for value in (s.dP0, s.dP0 + s.above, s.dP0 - s.below))
    same = claim(s.u_no, s.u_0, "selector")
    assert last_words(selector, replace(same, cases=(at,))) == "does not follow: the cases leave something out"
    assert last_words(selector, replace(same, cases=(down,))) == "does not follow: the cases leave something out"
    limited = replace(same, cases=(down,), scope=scope(s.dP1 <= s.dP0))
    assert last_words(selector, limited) == "follows"
    wider = replace(limited, scope=scope(s.dP1 < 2 * s.dP0))
    assert last_words(selector, wider).endswith("something out")
    # An equation among the limits is no help in the count of cases.
    assert last_words(selector, replace(wider, scope=scope(sympy.Eq(s.beta, 1)))).endswith("something out")
    one_branch = replace(same, grounds=(Ground("selector", ((s.dP1, s.dP0 - s.below),)),))
    assert last_words(selector, one_branch) == "does not follow: it does not say where it is proved"
    assert last_words(selector, replace(one_branch, scope=scope(s.dP1 <= s.dP0))) == "follows"
    branches = sympy.Piecewise((s.u_0, s.dP1 <= s.dP0), (s.beta * s.u_0, True))
    both = replace(same, kind=Kind.LAW, members=(branches,), cases=(down, up))
    assert last_words(selector, both) == "follows"


@pytest.mark.parametrize("claim", [s.beta < 2, s.beta > s.kappa, s.beta * (1 - s.k * s.x_max / s.u_max) < 2])
def test_a_wrong_sign_claim_is_seen(claim):
    verdict = {v.number: v for v in prove(changed("T4a", positive_if=claim))}["T4a"]
    assert verdict.words.startswith("does not follow: positive not exactly if")
    assert not verdict.as_expected
