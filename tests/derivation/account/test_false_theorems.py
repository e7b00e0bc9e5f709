"""False theorems, built on grounds as the account writes them: each used to follow, none does."""

from dataclasses import replace

import pytest
import sympy

from dzdesign.derivation import symbols as s
from dzdesign.derivation.account import proof
from dzdesign.derivation.account.account import STATEMENTS, verify_statements
from dzdesign.derivation.account.proof import judge, overrule, prove
from dzdesign.derivation.account.referee.referee import hear
from dzdesign.derivation.account.scope import (
    AT_ZERO_COMMAND,
    FREE_BETA,
    LAW_AT_REFERENCE,
    LAW_OFF_REFERENCE,
    PLANT,
    TARGET_OFF_REFERENCE,
    scope,
)
from dzdesign.derivation.account.statement import Ground, Kind, Outcome

ONE, ZERO = sympy.S.One, sympy.S.Zero
BY_NUMBER = {statement.number: statement for statement in STATEMENTS}


def theorem(symbol, member, *grounds, **more):
    return Kind.THEOREM("false", "", symbol, member, grounds=grounds, **more)


def at(number, *pairs):
    return Ground(number, pairs)


SAME_GAIN = theorem(
    s.K_1,
    s.K_0,
    at("(2)", (s.K_e, s.K_1), (s.Q_max, s.Q_max1)),
    at("(2)", (s.K_e, s.K_0), (s.Q_max, s.Q_max1)),
    eliminate=(s.Q_max1,),
)
SAME_DROP = theorem(
    s.dP1, s.dP0, "(8)", "(15)", "gamma_0", "gamma_1", at("(2)", (s.K_e, s.K_1)), at("(2)", (s.K_e, s.K_0)),
    eliminate=(s.K_1, s.K_0, s.gamma_0, s.gamma_1, s.Q_max),
)  # fmt: skip

#: Claim, and what the verdict must name. What is not in a scope is claimed of every valve in every situation.
FALSE = {
    "K_1 is K_0": (
        theorem(s.K_1, s.K_0, at("(2)", (s.K_e, s.K_1)), at("(2)", (s.K_e, s.K_0)), eliminate=(s.Q_max,)),
        "(2) is taken at dP1, but not its Q_max",
    ),
    "K_1 is K_0, all of both grounds renamed": (SAME_GAIN, "(2) is taken"),
    "dP1 is dP0": (SAME_DROP, "but not its Q_max"),
    "beta is 1, where dP1 is dP0": (
        theorem(s.beta, ONE, at("beta(dP)", (s.dP1, s.dP0)), scope=scope(sympy.Eq(s.dP0, s.dP1))),
        "no valve is ever in its scope",
    ),
    "one threshold": (
        theorem(s.u_min1, s.u_min0, at("(4)", (s.u_min, s.u_min1)), at("(4)", (s.u_min, s.u_min0)),
                eliminate=(s.f(s.dP),)),
        "but not its dP",
    ),
    "one largest flow": (
        theorem(s.Q_max1, s.Q_max0, at("Q_max", (s.Q_max, s.Q_max1)), at("Q_max", (s.Q_max, s.Q_max0)),
                eliminate=(s.dP,)),
        "but not its dP",
    ),
    "one largest flow, by a premise of another name": (
        theorem(s.Q_max, s.Q_max0, "(2)", at("(2)", (s.K_e, s.K_0), (s.Q_max, s.Q_max0)), "K_e",
                at("K_e", (s.K_e, s.K_0)), eliminate=(s.K_e, s.K_0, s.Q_w), provided=()),
        "K_e is taken at dP0, but not its Q_w",
    ),
    "the paper's law is the law `target`": (
        theorem(s.beta, ONE, "(18)", "L3", eliminate=(s.u_O,),
                provided=(sympy.Ne(s.k * s.x_max, s.u_max), sympy.Ne(s.u_i, 0))),
        "its ground (18) does not hold in its scope",
    ),
    "the same, off the reference": (
        theorem(s.beta, ONE, "(18)", "L3", eliminate=(s.u_O,), scope=LAW_OFF_REFERENCE,
                provided=(sympy.Ne(s.k * s.x_max, s.u_max), sympy.Ne(s.u_i, 0))),
        "its ground L3 does not hold in its scope",
    ),
    "(14) is (18)": (
        theorem(s.beta, ONE, "(18)", "(14)", eliminate=(s.u_O,), scope=LAW_OFF_REFERENCE,
                provided=(sympy.Ne((s.k * s.x_max / s.u_max - 1) * s.u_i + s.u_min0, 0),)),
        "its ground (14) does not hold in its scope",
    ),
    "the offset at every command": (
        theorem(s.u_O, s.beta * s.u_min0, at("(18)", (s.u_i, ZERO)), scope=LAW_OFF_REFERENCE),
        "(18) is taken at u_i = 0, which the scope does not say",
    ),
    "full drive at every command": (
        theorem(s.u_O, s.u_max + s.beta * (s.k * s.x_max + s.u_min0 - s.u_max), at("(18)", (s.u_i, s.u_max)),
                scope=LAW_OFF_REFERENCE),
        "does not hold in its scope",
    ),
    "k x_max is always what is left above the threshold": (
        theorem(s.k, (s.u_max - s.u_min0) / s.x_max, at("(14)", (s.u_O, s.u_max), (s.u_i, s.u_max)),
                scope=LAW_AT_REFERENCE),
        "does not hold in its scope",
    ),
    "nothing is left below the reference": (
        theorem(s.u_dz, ZERO, "T4c", at("(4)", (s.dP, s.dP0)), at("(4)", (s.u_min, s.u_min0), (s.dP, s.dP0)),
                eliminate=(s.u_min, s.u_min0)),
        "(4) is taken at dP0, but not its u_min",
    ),
    "one slope": (
        theorem(s.s_flow1, s.s_flow0, at("S", (s.s_flow, s.s_flow1)), at("S", (s.s_flow, s.s_flow0)),
                eliminate=(s.C_d,)),
        "but not its dP",
    ),
    "one wanted flow, by the opening": (
        theorem(s.Q_O_prime, s.Q_O, at("(10)", (s.Q_O, s.Q_O_prime)), "(10)", eliminate=(s.x,),
                scope=LAW_AT_REFERENCE),
        "but not its dP0",
    ),
    "one wanted flow, by T1d and T1a": (
        theorem(s.Q_O_prime, s.Q_O, "T1d", "T1a", eliminate=(s.Q,)),
        "its ground T1d does not hold in its scope",
    ),
    "every pressure drop is dP0": (
        theorem(s.dP, s.dP0, "(3)", "(2)", at("(2)", (s.K_e, s.K_0)), "(8)", "gamma_0",
                eliminate=(s.K_e, s.Q_max, s.K_0, s.gamma_0)),
        "but not its Q_max",
    ),
    "the meter starts at one command": (
        theorem(s.u_seen1, s.u_seen0, at("T9a", (s.u_seen, s.u_seen1)), at("T9a", (s.u_seen, s.u_seen0)),
                eliminate=(s.u_min,)),
        "but not its dP",
    ),
    "volts at the pin are volts of command": (
        theorem(s.n_V, s.n_adc / s.u_max, "code of u_0", "scale of u_0", eliminate=(s.n_0,),
                provided=(sympy.Ne(s.u_0, 0),)),
        "its ground code of u_0 does not hold in its scope",
    ),
    "(6c) is (6)": (
        theorem(s.beta, ONE, "(6)", "(6c)", eliminate=(s.u_no,), provided=(sympy.Ne(s.u_0 - s.u_min0, 0),),
                scope=TARGET_OFF_REFERENCE),
        "its ground (6) does not hold in its scope",
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
    "beta is 1, by a constant threshold": (
        theorem(s.beta, ONE, "(5)", "constant threshold", eliminate=(s.u_min1,)),
        "its ground constant threshold does not hold in its scope",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def account():
    return {verdict.number: verdict for verdict in verify_statements()}


@pytest.mark.parametrize("name", FALSE)
def test_a_false_theorem_does_not_follow(name, account, monkeypatch):
    claim, named = FALSE[name]
    statements = {**BY_NUMBER, "false": claim}
    judged = judge(claim, statements, account)
    verdict = overrule(judged, hear(judged, statements)) if judged.as_expected else judged
    assert not verdict.holds
    assert not verdict.as_expected
    assert named in verdict.words
    # By algebra alone it follows: that is what makes it a trap.
    monkeypatch.setattr(proof, "find_renaming_fault", lambda *_: "")
    assert judge(claim, statements, account).as_expected


def test_the_three_false_theorems_fall_one_after_another():
    """K_1 = K_0, then dP1 = dP0, then beta = 1 always, each from the one before."""
    gains = replace(FALSE["K_1 is K_0"][0], number="K")
    drops = replace(
        theorem(s.dP1, s.dP0, "K", "(8)", "(15)", "gamma_0", "gamma_1"),
        number="D",
        eliminate=(s.K_1, s.K_0, s.gamma_0, s.gamma_1),
    )
    always = theorem(s.beta, ONE, "beta(dP)", "D", eliminate=(s.dP1,))
    *_, first, second, third = prove([*STATEMENTS, gains, drops, always], hear)
    assert [one.holds or one.as_expected for one in (first, second, third)] == [False] * 3
    assert "(2) is taken at dP1, but not its Q_max" in first.words
    # The numbers speak for themselves: not only because the one before fell.
    for one in (second, third):
        believed = replace(one, outcome=Outcome.FOLLOWS, objection="")
        book = {**BY_NUMBER, "K": gains, "D": drops, "false": always}
        assert "does not hold in its scope" in hear(believed, book)
