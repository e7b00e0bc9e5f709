"""Premises that contradict, do not suffice, stand in a circle, or would be divided by zero are seen."""

from dataclasses import replace

import pytest
import sympy

from dzdesign.core.errors import RequirementError
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account import solving
from dzdesign.derivation.account.account import STATEMENTS
from dzdesign.derivation.account.proof import prove
from dzdesign.derivation.account.statement import Condition, Ground, Value
from tests.support.account_claims import BY_NUMBER, FOREIGN, changed, claim, given, last_words


@pytest.mark.slow
def test_what_rests_on_a_failed_statement_does_not_hold():
    members = BY_NUMBER["(8)"].members
    outcome = {v.number: v for v in prove(changed("(8)", members=(2 * members[0], members[1])))}
    assert outcome["(8)"].words == "does not follow"
    assert solving.agree(outcome["(8)"].discrepancy, -members[0])
    assert outcome["(13)"].words == "rests on (8), which does not follow"
    assert not outcome["(18)"].holds
    assert outcome["(15)"].holds
    assert not outcome["(30)"].as_expected  # not even the claim that it does not follow may rest on it


def test_contradicting_premises_are_named():
    contradiction = "does not follow: the premises contradict each other"
    one, two = given("one", s.beta, 1), given("two", s.beta, 2)
    assert last_words(one, two, claim(s.beta, FOREIGN, "one", "two")) == contradiction
    # SymPy's solver passes over a relation that has no unknown in it; the engine may not.
    slope = given("slope", s.slope, s.beta)
    unused = given("unused", s.kappa, 3)
    assert last_words(one, slope, unused, claim(s.slope, 1, "slope", "one", "unused")) == contradiction
    # Nor may it be found negative only at the end.
    late = given("late", s.x, s.x_e), given("later", s.x_e, -s.x_max)
    assert last_words(*late, claim(s.x, -s.x_max, "late", "later", eliminate=(s.x_e,))) == contradiction
    # An opening is not negative.
    assert last_words(given("one", s.x, -s.guard), claim(s.x, FOREIGN, "one")) == contradiction


def test_what_is_not_determined_is_named():
    both = given("both", s.slope, s.u_O + s.u_0)
    words = last_words(both, claim(s.u_O, FOREIGN, "both", eliminate=(s.u_0,)))
    assert words in (
        "does not follow: the premises do not determine u_O",
        "does not follow: the premises do not determine u_0",
        "does not follow: the premises do not determine u_O, u_0",
    )


def test_nothing_is_divided_by_what_may_be_zero():
    ratio = s.u_1 / s.u_2
    one, two = given("one", s.Q_1, s.Q * ratio), given("two", s.Q_1, s.Q_2 * ratio)
    # At u_1 = 0 both hold, whatever Q and Q_2 are.
    equal = claim(s.Q, s.Q_2, "one", "two", eliminate=(s.Q_1,))
    assert last_words(one, two, equal) == "does not follow: u_1, by which the derivation divides, may be zero"
    assert last_words(one, two, replace(equal, provided=(sympy.Ne(s.u_1, 0),))) == "follows"
    idle = replace(equal, provided=(sympy.Ne(s.u_1, 0), sympy.Ne(s.Q_2, 0)))
    assert last_words(one, two, idle) == "does not follow: the derivation does not need Ne(Q_2, 0)"
    # Nor inside an equation that is not linear in what is wanted.
    root = given("root", s.Q_1, s.Q_1.func("r", real=True) * (sympy.sqrt(s.dP) - 1) + s.Q_1.func("q", real=True))
    words = last_words(
        root, given("q", s.Q_1, s.Q_1.func("q", real=True)), claim(s.dP, 1, "root", "q", eliminate=(s.Q_1,))
    )
    assert words == "does not follow: r, by which the derivation divides, may be zero"


def with_grounds(number, *grounds):
    return changed(number, grounds=tuple(Ground(number=ground) for ground in grounds))


def test_a_statement_is_not_its_own_premise(wording):
    with pytest.raises(RequirementError) as caught:
        prove(with_grounds("(13)", "(12)", "(13)"))
    wording("the account: its own premise", str(caught.value))


def test_a_circular_chain_is_rejected(wording):
    # (13) from (14) and (14) from (13): each would give the other.
    with pytest.raises(RequirementError) as caught:
        prove(with_grounds("(13)", "u_O", "(14)"))
    wording("the account: a circular chain", str(caught.value))


def test_a_copy_is_not_a_premise(wording):
    copy = given("copy", s.u_0, sympy.expand(BY_NUMBER["(13)"].members[-1]))
    with pytest.raises(RequirementError) as caught:
        prove([copy, *with_grounds("(13)", "copy")])
    wording("the account: a copy", str(caught.value))


@pytest.mark.slow
def test_unknown_and_repeated_statements_are_rejected(wording):
    with pytest.raises(RequirementError) as caught:
        prove(with_grounds("(13)", "(99)"))
    wording("the account: unknown", str(caught.value))
    with pytest.raises(RequirementError) as caught:
        prove([*STATEMENTS, STATEMENTS[0]])
    wording("the account: repeated", str(caught.value))


def test_statements_check_themselves(wording):
    with pytest.raises(ValueError) as caught:
        replace(BY_NUMBER["(18)"], members=(s.u_O,))
    wording("a statement: defines itself", str(caught.value))
    with pytest.raises(RequirementError) as caught:
        prove(changed("(18)", grounds=()))
    wording("a statement: without grounds", str(caught.value))
    with pytest.raises(RequirementError) as caught:
        prove(changed("(1)", grounds=(Ground(number="(2)"),)))
    wording("a statement: given, with grounds", str(caught.value))
    with pytest.raises(ValueError, match="could not convert"):
        Value(label="", at=(), unit="V", published="about 2")
    with pytest.raises(ValueError) as caught:
        Condition(any_of=((sympy.true,),))
    wording("a statement: a condition without an equation", str(caught.value))
    with pytest.raises(ValueError) as caught:
        Condition(any_of=((sympy.Eq(s.beta, 1),),), for_all=(s.beta, s.u_i))
    wording("a statement: a condition on all values", str(caught.value))
    with pytest.raises(ValueError) as caught:
        Value(label="", at=(), unit="m", of=s.x_max).exact(BY_NUMBER["(18)"])
    wording("a statement: a value without its figures", str(caught.value))
