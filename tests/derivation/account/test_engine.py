"""The engine on made-up statements: premises that contradict, do not suffice, stand in a circle, would be divided by
zero; conditions that are not needed; cases that leave something out; wrong signs and units."""

from dataclasses import replace

import pytest
import sympy

from dzdesign.core.errors import RequirementError
from dzdesign.derivation import plant
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account import solving
from dzdesign.derivation.account.account import STATEMENTS
from dzdesign.derivation.account.model_and_codes import laplace
from dzdesign.derivation.account.proof import prove
from dzdesign.derivation.account.statement import Case, Condition, Ground, Outcome, Value
from tests.derivation.account.claims import BY_NUMBER, FOREIGN, changed, claim, given, last_words

IF, NOT = Outcome.FOLLOWS_IF, Outcome.DOES_NOT_FOLLOW
CONTRADICTION = "does not follow: the premises contradict each other"
RATIO = s.u_1 / s.u_2
#: At u_1 = 0 both grounds hold, whatever Q and Q_2 are.
EQUAL = (
    given("one", s.Q_1, s.Q * RATIO),
    given("two", s.Q_1, s.Q_2 * RATIO),
    claim(s.Q, s.Q_2, "one", "two", eliminate=(s.Q_1,)),
)
r, q = s.Q_1.func("r", real=True), s.Q_1.func("q", real=True)


@pytest.mark.parametrize(
    ("statements", "words"),
    [
        ((given("one", s.beta, 1), given("two", s.beta, 2), claim(s.beta, FOREIGN, "one", "two")), CONTRADICTION),
        # SymPy's solver passes over a relation that has no unknown in it; the engine may not.
        (
            (
                given("one", s.beta, 1),
                given("slope", s.slope, s.beta),
                given("unused", s.kappa, 3),
                claim(s.slope, 1, "slope", "one", "unused"),
            ),
            CONTRADICTION,
        ),
        # Nor may it be found negative only at the end.
        (
            (
                given("late", s.x, s.x_e),
                given("later", s.x_e, -s.x_max),
                claim(s.x, -s.x_max, "late", "later", eliminate=(s.x_e,)),
            ),
            CONTRADICTION,
        ),
        # An opening is not negative.
        ((given("one", s.x, -s.guard), claim(s.x, FOREIGN, "one")), CONTRADICTION),
        (
            (given("both", s.slope, s.u_O + s.u_0), claim(s.u_O, FOREIGN, "both", eliminate=(s.u_0,))),
            "does not follow: the premises do not determine u_",
        ),
        (EQUAL, "does not follow: u_1, by which the derivation divides, may be zero"),
        ((*EQUAL[:2], replace(EQUAL[2], provided=(sympy.Ne(s.u_1, 0),))), "follows"),
        # Nor inside an equation that is not linear in what is wanted.
        (
            (
                given("root", s.Q_1, r * (sympy.sqrt(s.dP) - 1) + q),
                given("q", s.Q_1, q),
                claim(s.dP, 1, "root", "q", eliminate=(s.Q_1,)),
            ),
            "does not follow: r, by which the derivation divides, may be zero",
        ),
    ],
)
def test_what_the_grounds_do_not_give_is_named(statements, words):
    assert last_words(*statements).startswith(words)


def with_grounds(number, *grounds):
    return changed(number, grounds=tuple(Ground(number=ground) for ground in grounds))


@pytest.mark.parametrize(
    ("named", "statements"),
    [
        # (13) from (14) and (14) from (13): each would give the other.
        ("the account: a circular chain", with_grounds("(13)", "u_O", "(14)")),
        (
            "the account: a copy",
            [given("copy", s.u_0, sympy.expand(BY_NUMBER["(13)"].members[-1])), *with_grounds("(13)", "copy")],
        ),
        ("the account: repeated", [*STATEMENTS[:3], STATEMENTS[0]]),
        ("a statement: without grounds", changed("(18)", grounds=())),
        ("a statement: given, with grounds", changed("(1)", grounds=(Ground(number="(2)"),))),
    ],
)
def test_an_account_that_is_none_is_refused(named, statements, wording):
    with wording.refusal(RequirementError, named):
        prove(statements)


def test_statements_and_values_check_themselves(wording):
    with wording.refusal(ValueError, "a statement: defines itself"):
        replace(BY_NUMBER["(18)"], members=(s.u_O,))
    with wording.refusal(ValueError, "a statement: a value without its figures"):
        Value(label="", at=(), unit="m", of=s.x_max).exact(BY_NUMBER["(18)"])


# --- conditions, cases, signs -------------------------------------------------------------------------------

BETA_IS_ONE = (sympy.Eq(s.beta, 1),)


@pytest.mark.parametrize(
    ("any_of", "words"),
    [
        ((BETA_IS_ONE,), "follows if beta = 1 (sufficient; not proved necessary)"),
        ((BETA_IS_ONE, (sympy.Eq(s.kappa, 1),)), "follows if beta = 1 or kappa = 1 (necessary)"),
        (((*BETA_IS_ONE, sympy.Eq(s.kappa, 1)),), "follows if beta = 1 and kappa = 1 (sufficient; not proved"),
        (((sympy.Eq(s.beta, 2),),), "does not follow, not even if beta = 2"),
    ],
)
def test_a_condition_must_suffice_and_be_needed(any_of, words):
    difference = (s.beta - 1) * (s.kappa - 1)
    condition = Condition(any_of=any_of, discrepancy=difference)
    verdict = prove([given("one", s.slope, difference), claim(s.slope, 0, "one", condition=condition, expected=IF)])[-1]
    assert verdict.words.startswith(words)
    assert verdict.as_expected == ("(necessary)" in words)


@pytest.mark.parametrize(
    ("member", "published", "words"),
    [
        (s.kappa, (), "does not follow, not even if beta = 1"),
        (2 - s.beta, (), "does not follow, and the difference is another one"),
        # What published numbers rule out is no condition.
        (1, ((s.beta, sympy.Rational(9, 10)),), "does not follow (beta = 9/10): it would only if beta = 1"),
        (1, ((s.beta, sympy.S.One),), "follows if beta = 1 (necessary)"),
    ],
)
def test_a_condition_that_is_not_the_right_one_is_seen(member, published, words):
    condition = Condition(any_of=(BETA_IS_ONE,), discrepancy=s.beta - 1, ruled_out_by=published)
    one, two = given("one", s.slope, s.beta), given("two", s.beta, s.kappa)
    assert last_words(one, claim(s.slope, member, "one", condition=condition)) == words
    needless = claim(s.slope, s.kappa, "one", "two", condition=condition, eliminate=(s.beta,))
    assert last_words(one, two, needless) == "follows, also without beta = 1"


def words_of(number, **changes):
    """The words of a changed statement, whose grounds are as they are."""
    needed = {ground.number for ground in BY_NUMBER[number].grounds}
    for statement in reversed(STATEMENTS):
        needed |= {ground.number for ground in statement.grounds} if statement.number in needed else set()
    return prove([one for one in changed(number, **changes) if one.number in {*needed, number}])[-1].words


def test_a_piecewise_claim_needs_a_case_for_every_branch():
    cases = BY_NUMBER["L2"].cases
    assert words_of("L2", cases=cases[:1]) == "does not follow: no case stands for dP0 < dP1"
    undecided = Case(at=((s.dP1, FOREIGN),), where="")
    undecided_words = "does not follow: the case of a piecewise premise is not decided"
    assert words_of("L2", cases=(*cases, undecided)) == undecided_words


@pytest.mark.parametrize("claim", [s.beta < 2, s.beta > s.kappa, s.beta * (1 - s.k * s.x_max / s.u_max) < 2])
def test_a_wrong_sign_claim_is_seen(claim):
    assert words_of("T4a", positive_if=claim).startswith("does not follow: positive not exactly if")


# --- units, identity, transforms ----------------------------------------------------------------------------


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
        ("(17)", sympy.Piecewise((s.u_0, s.dP1 > s.u_min), (s.beta * s.u_0, True)), "dP1 > u_min compares two units"),
    ],
)
def test_wrong_units_are_seen(number, member, error):
    assert replace(BY_NUMBER[number], members=(member,)).unit_error() == error


def test_roots_of_what_may_be_negative_are_not_merged():
    assert not solving.agree(sympy.sqrt(s.u_1) * sympy.sqrt(s.u_2), sympy.sqrt(s.u_1 * s.u_2))
    assert solving.agree(sympy.sqrt(s.dP0) * sympy.sqrt(s.dP1), sympy.sqrt(s.dP0 * s.dP1))


def test_the_laplace_transform_needs_a_linear_equation(monkeypatch, wording):
    square = sympy.Eq(s.f_e, s.K_i * s.i**2)
    monkeypatch.setitem(plant.PLANT_EQUATIONS, "(22)", square)
    with wording.refusal(ValueError, "the account: not linear"):
        laplace("(22)")


@pytest.mark.parametrize("given", [s.k * (s.u_1 - s.u_2), -s.k * (s.u_2 - s.u_1)])
def test_of_a_difference_there_is_one_form(given):
    """SymPy gives one or the other, from run to run."""
    assert str(solving._turned(given)) == "k*(u_1 - u_2)"
