"""False theorems, built on grounds as the account writes them: each used to follow, none does."""

from dataclasses import replace

import pytest
import sympy

from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.machines import drawn_plants, drawn_valves
from dzdesign.derivation.account.proof import judge, overrule
from dzdesign.derivation.account.referee import hear
from dzdesign.derivation.account.scope import (
    AT_ZERO_COMMAND,
    FIXED_OPENING,
    FREE_BETA,
    LAW_OFF_REFERENCE,
    PLANT,
    TARGET_OFF_REFERENCE,
    scope,
    under_law,
)
from dzdesign.derivation.account.statement import Condition, Ground, Kind, Outcome
from tests.derivation.account.claims import BY_NUMBER

ONE, ZERO = sympy.S.One, sympy.S.Zero


def theorem(symbol, member, *grounds, eliminate=None, provided=(), **more):
    stated = Kind.THEOREM("false", "").says(symbol, member)
    return replace(stated.by(*grounds, eliminate=eliminate, provided=provided), **more)


def at(number, *pairs):
    return Ground(number, pairs)


STEP = (s.beta - 1) * (s.u_min0 - (1 - s.k * s.x_max / s.u_max) * s.u_i)
STEPS = ("jump", at("L2", (s.u_O, s.u_above), (s.dP1, s.dP0 + s.above)), at("(14)", (s.u_O, s.u_below)))
#: Claim, and what the verdict must name. What is not in a scope is claimed of every valve in every situation.
FALSE = {
    "K_1 is K_0": (
        theorem(s.K_1, s.K_0, at("(2)", (s.K_e, s.K_1)), at("(2)", (s.K_e, s.K_0)), eliminate=(s.Q_max,)),
        "does not hold in its scope",
    ),
    "beta is 1, where dP1 is dP0": (
        theorem(s.beta, ONE, at("beta(dP)", (s.dP1, s.dP0)), scope=scope(sympy.Eq(s.dP0, s.dP1))),
        "no valve is ever in its scope",
    ),
    "one largest flow, by a premise of another name": (
        theorem(s.Q_max, s.Q_max0, "(2)", at("(2)", (s.K_e, s.K_0), (s.Q_max, s.Q_max0)), "K_e",
                at("K_e", (s.K_e, s.K_0)), eliminate=(s.K_e, s.K_0, s.Q_w), provided=()),
        "Q_max is ",
    ),
    "the paper's law is the law `target`": (
        theorem(s.beta, ONE, "(18)", "L3", eliminate=(s.u_O,),
                provided=(sympy.Ne(s.k * s.x_max, s.u_max), sympy.Ne(s.u_i, 0))),
        "its ground (18) does not hold in its scope",
    ),
    "the offset at every command": (
        theorem(s.u_O, s.beta * s.u_min0, at("(18)", (s.u_i, ZERO)), scope=LAW_OFF_REFERENCE),
        "does not hold in its scope",
    ),
    "nothing is left below the reference": (
        theorem(s.u_dz, ZERO, "T4c", at("(4)", (s.dP, s.dP0)), at("(4)", (s.u_min, s.u_min0), (s.dP, s.dP0)),
                eliminate=(s.u_min, s.u_min0)),
        "does not hold in its scope",
    ),
    "one slope": (
        theorem(s.s_flow1, s.s_flow0, at("S", (s.s_flow, s.s_flow1)), at("S", (s.s_flow, s.s_flow0)),
                eliminate=(s.C_d,)),
        "does not hold in its scope",
    ),
    "every pressure drop is dP0": (
        theorem(s.dP, s.dP0, "(3)", "(2)", at("(2)", (s.K_e, s.K_0)), "(8)", "gamma_0",
                eliminate=(s.K_e, s.Q_max, s.K_0, s.gamma_0)),
        "does not hold in its scope",
    ),
    "the meter starts at one command": (
        theorem(s.u_seen1, s.u_seen0, at("T9a", (s.u_seen, s.u_seen1)), at("T9a", (s.u_seen, s.u_seen0)),
                eliminate=(s.u_min,)),
        "does not hold in its scope",
    ),
    "the transfer function is its static gain": (
        theorem(s.G_0, s.G, at("T6b", (s.G, s.G_0)), "T6b", eliminate=(s.K_i,), scope=scope(PLANT),
                expected=Outcome.FOLLOWS_IF),
        "does not hold in its scope",
    ),
    "no flow at zero command, whatever beta": (
        theorem(s.Q, ZERO, at("T3a", (s.beta, s.u_min1 / s.u_min0)), scope=scope(FREE_BETA) & AT_ZERO_COMMAND),
        "does not hold in its scope",
    ),
    # Scopes that admitted nothing but zero, full command, or dP1, of all the situations that there were.
    "the paper's law meets the target at small commands": (
        replace(BY_NUMBER["T1d"], number="false", scope=scope(
            under_law("paper"), FIXED_OPENING, sympy.Eq(s.dP, s.dP1), s.dP0 < s.dP1, s.u_i < s.u_min / 50)),
        "does not hold in its scope",
    ),
    "the same, where zero only was tried": (
        replace(BY_NUMBER["T1d"], number="false", scope=scope(
            under_law("paper"), FIXED_OPENING, sympy.Eq(s.dP, s.dP1), s.dP0 < s.dP1, 10**9 * s.u_i < s.u_min)),
        "leaves only special values of u_i",
    ),
    # The dead zone that is left was that of the paper's law, whoever drove.
    "the law `target` leaves what the paper's leaves": (
        theorem(s.u_dz, s.u_max * (s.u_min - s.u_min0) / (s.k * s.x_max),
                at("(14)", (s.u_O, s.u_min), (s.u_i, s.u_dz)), scope=scope(under_law("target"), s.dP <= s.dP0)),
        "does not hold in its scope",
    ),
    "beta is 2, if one threshold is twice the other": (
        theorem(s.beta, 2 * ONE, "(5)", expected=Outcome.FOLLOWS_IF,
                condition=Condition(any_of=((sympy.Eq(s.u_min1, 2 * s.u_min0),),),
                                    discrepancy=s.u_min1 / s.u_min0 - 2)),
        "no valve in its scope meets its condition",
    ),
    "by grounds that no number can try": (
        theorem(s.K_1, s.K_0 * s.Q_max1 / s.Q_max0,
                at("(2)", (s.K_e, s.K_1), (s.Q_max, s.Q_max1), (s.u_max, s.t)),
                at("(2)", (s.K_e, s.K_0), (s.Q_max, s.Q_max0), (s.u_max, s.t)), eliminate=(s.t,)),
        "no situation of its scope has numbers for its ground",
    ),
    # Slope and step were those of the paper's law, whoever drove.
    "the law `target` has the slope of the paper's": (
        theorem(s.slope, 1 - s.beta * (1 - s.k * s.x_max / s.u_max), Ground("(18)", derivative=(s.u_i, s.slope)),
                scope=TARGET_OFF_REFERENCE),
        "does not hold in its scope",
    ),
    "the law `target` steps where dP passes dP0": (
        theorem(s.jump, STEP, *STEPS, scope=TARGET_OFF_REFERENCE & scope(s.dP0 < s.dP1),
                eliminate=(s.u_above, s.u_below)),
        "does not hold in its scope",
    ),
    # What is to hold for every command was proved by powers of it, and the scope left one command.
    "at zero command the reference offset needs beta = 1 and no overlap": (
        theorem(s.u_O, BY_NUMBER["(18)"].members[-1] + (1 - s.beta) * s.u_min0 + s.k * s.x_ov / s.u_max * s.u_i,
                "(18)", scope=LAW_OFF_REFERENCE & AT_ZERO_COMMAND, expected=Outcome.FOLLOWS_IF,
                condition=Condition(
                    any_of=((sympy.Eq(s.beta, 1), sympy.Eq(s.x_ov, 0)),), for_all=(s.u_i,),
                    discrepancy=(s.beta - 1) * s.u_min0 - s.k * s.x_ov / s.u_max * s.u_i)),
        "it is to hold for every u_i, and its scope",
    ),
    "full drive only without overlap, where beta is 1": (
        replace(BY_NUMBER["T2b"], number="false", members=(s.u_max + (s.beta - 1) * s.k * s.x_ov,),
                scope=BY_NUMBER["T2b"].scope & scope(sympy.Eq(s.beta, 1)),
                condition=Condition(
                    any_of=((sympy.Eq(s.k * s.x_max, s.u_max - s.u_min0), sympy.Eq(s.x_ov, 0)),), for_all=(s.beta,),
                    discrepancy=s.beta * (s.k * s.x_max + s.u_min0 - s.u_max) - (s.beta - 1) * s.k * s.x_ov)),
        "it is to hold for every beta, and its scope",
    ),
    # "Only if" was never tried on numbers: the case by which it is necessary lies outside the scope.
    "the law is (14) only if beta = 1, also up to the reference": (
        replace(BY_NUMBER["L2"], number="false", kind=Kind.THEOREM, members=(BY_NUMBER["(14)"].members[-1],),
                expected=Outcome.FOLLOWS_IF,
                condition=Condition(
                    any_of=((sympy.Eq(s.beta, 1),),), for_all=(s.u_i,),
                    discrepancy=(s.beta - 1) * (s.u_min0 - (1 - s.k * s.x_max / s.u_max) * s.u_i))),
        "it is true without its condition",
    ),
}  # fmt: skip
#: These were refused for the same reason.
TRUE = {
    "slope of the law `target`": theorem(
        s.slope, s.k * s.x_max / s.u_max, Ground("L3", derivative=(s.u_i, s.slope)), scope=TARGET_OFF_REFERENCE),
    "the law `target` is continuous at dP0": theorem(
        s.jump, ZERO, "jump", at("L3", (s.u_O, s.u_above), (s.beta, ONE)), at("L3", (s.u_O, s.u_below), (s.beta, ONE)),
        eliminate=(s.u_above, s.u_below), scope=scope(under_law("target"), sympy.Eq(s.dP, s.dP1))),
    "the paper's law is continuous at dP0, by beta of the pressure drop": theorem(
        s.jump, ZERO, "jump", at("L2", (s.u_O, s.u_above), (s.beta, ONE), (s.dP1, s.dP0 + s.above)),
        at("(14)", (s.u_O, s.u_below)), eliminate=(s.u_above, s.u_below), scope=LAW_OFF_REFERENCE),
}  # fmt: skip


@pytest.mark.parametrize("name", FALSE)
def test_a_false_theorem_does_not_follow(name, verdicts):
    claim, named = FALSE[name]
    statements = {**BY_NUMBER, "false": claim}
    judged = judge(claim, statements, verdicts)
    # By algebra alone it follows: that is what makes it a trap.
    assert judged.as_expected
    verdict = overrule(judged, hear(judged, statements))
    assert not verdict.holds
    assert not verdict.as_expected
    assert named in verdict.words


@pytest.mark.parametrize("name", TRUE)
def test_a_true_theorem_follows(name, verdicts):
    statements = {**BY_NUMBER, "false": TRUE[name]}
    judged = judge(TRUE[name], statements, verdicts)
    assert judged.as_expected, judged.words
    assert hear(judged, statements) == ""


def test_a_scope_has_no_alternatives():
    """Of two, one could leave general values and the other those that matter."""
    with pytest.raises(ValueError, match="single comparisons"):
        scope(sympy.Or(sympy.Eq(s.dP, s.dP1), 10**9 * s.u_i < s.u_min))


def test_the_referee_draws_numbers_that_no_statement_was_fitted_to():
    """No two constants of the drawn valves and plants are equal, and no command or drop of a valve is another's."""
    numbers = [
        value
        for drawn in (*drawn_valves(), *(plant for plant, _ in drawn_plants()))
        for name in drawn.__slots__
        if isinstance(value := getattr(drawn, name), float) and value not in (0.0, 1.0)
    ]
    assert len(numbers) > 150 and len(set(numbers)) == len(numbers)
