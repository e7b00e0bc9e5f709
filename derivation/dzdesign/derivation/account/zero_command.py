"""Theorems 3 and 4: what the law does at zero command, whether it rises, and what is left below the reference."""

import sympy

from dzdesign.derivation.account.published import FIRST, SECOND, SIMULATION
from dzdesign.derivation.account.scope import (
    AT_ZERO_COMMAND,
    BARE,
    FREE_BETA,
    FREE_OPENING,
    LAW_OFF_REFERENCE,
    UP_TO_REFERENCE,
    scope,
)
from dzdesign.derivation.account.statement import Case, Condition, Ground, Kind, Outcome, Value
from dzdesign.derivation.law import law
from dzdesign.derivation.symbols import *

_PAPER_LAW = law("paper")
_OFFSET = _PAPER_LAW.offset
_THREE_CASES = (
    Case(((u_min1, _OFFSET + guard),), "beta u_min0 below the threshold"),
    Case(((u_min1, _OFFSET),), "beta u_min0 at the threshold"),
    Case(((u_min1, _OFFSET - excess),), "beta u_min0 above the threshold"),
)

#: Theorem 3: zero command.
ZERO_COMMAND = (
    Kind.THEOREM(
        "T3a",
        "flow at zero command",
        Q,
        sympy.Piecewise((0, u_min1 > _OFFSET), (gamma_1 * (_OFFSET - u_min1) / k, u_min1 <= _OFFSET)),
        scope=scope(FREE_BETA, sympy.Eq(dP, dP1), beta * u_min0 <= u_max) & AT_ZERO_COMMAND,
        grounds=(
            Ground(
                "(1)",
                ((dP, dP1), (u_i, _OFFSET), (u_min, u_min1), (u_max, _OFFSET + headroom)),
            ),
            Ground("opening", ((u_O, _OFFSET), (u_min, u_min1))),
            "gamma_1",
        ),
        eliminate=(x, gamma_1),
        cases=_THREE_CASES,
        positive_if=u_min1 < _OFFSET,
        note="So zero command passes no flow exactly if beta u_min0 <= u_min(dP). Both laws have this offset.",
    ),
    Kind.THEOREM(
        "T3b",
        "flow at zero command without beta, for a threshold lower than at the reference",
        Q,
        gamma_1 * (u_min0 - u_min1) / k,
        Q_max1 * (u_min0 - u_min1) / (u_max - u_min1),
        provided=(sympy.Ne(u_max, u_min1),),
        scope=scope(FREE_BETA, FREE_OPENING, sympy.Eq(dP, dP1), sympy.Eq(beta, 1), u_min1 < u_min0) & AT_ZERO_COMMAND,
        grounds=(Ground("T3a", ((beta, sympy.S.One),)), "largest flow"),
        eliminate=(gamma_1,),
        cases=(Case(((u_min1, u_min0 - excess),), "threshold lower than at the reference"),),
        see=("T9d",),
        values=(
            Value(
                "simulation",
                SIMULATION.at(),
                "L/min",
                published=SIMULATION.zero_flow_without_beta,
                remark="read off a figure; 0.01 L/min is 0.002 V of threshold",
            ),
            Value(
                "first valve",
                FIRST.at(),
                "L/min",
                published=FIRST.zero_flow_without_beta,
                remark="If the paper's thresholds are the first flow that its meter shows (it starts at 0.6 L/min), "
                "T9d gives 1.69.",
            ),
            Value("second valve", SECOND.at(), "L/min"),
        ),
    ),
    Kind.THEOREM(
        "beta(dP)",
        "correction coefficient from the fitted thresholds",
        beta,
        f(dP1) / f(dP0),
        grounds=(
            "(5)",
            Ground("(4)", ((u_min, u_min0), (dP, dP0))),
            Ground("(4)", ((u_min, u_min1), (dP, dP1))),
        ),
        eliminate=(u_min0, u_min1),
    ),
    Kind.THEOREM(
        "T3c",
        "with beta by Eq. (5), zero command stands at the threshold of the present pressure drop",
        u_O,
        f(dP1),
        scope=LAW_OFF_REFERENCE & AT_ZERO_COMMAND,
        grounds=(
            Ground("(18)", ((u_i, sympy.S.Zero),)),
            "beta(dP)",
            Ground("(4)", ((u_min, u_min0), (dP, dP0))),
        ),
        eliminate=(beta, u_min0),
        note="Nothing is left for an error of the threshold: a design needs a guard.",
    ),
)

#: Theorem 4: monotone, continuous, and what is left below the reference.
SHAPE = (
    Kind.THEOREM(
        "T4a",
        "slope of the law (18)",
        slope,
        1 - beta * (1 - k * x_max / u_max),
        scope=LAW_OFF_REFERENCE,
        grounds=(Ground("(18)", derivative=(u_i, slope)),),
        positive_if=beta * (1 - k * x_max / u_max) < 1,
        note="Holds for every beta <= 1. The law `target` always rises.",
    ),
    Kind.DEFINITION("jump", "step of the output where dP passes dP0", jump, u_above - u_below),
    Kind.THEOREM(
        "T4b",
        "the selector (7) is continuous at dP0",
        jump,
        sympy.S.Zero,
        scope=scope(FREE_BETA, sympy.Eq(dP, dP1), dP0 < dP1),
        grounds=(
            "jump",
            Ground("L2", ((u_O, u_above), (dP1, dP0 + above))),
            Ground("(14)", ((u_O, u_below),)),
        ),
        eliminate=(u_above, u_below),
        condition=Condition(
            any_of=((sympy.Eq(beta, 1),),),
            for_all=(u_i,),
            discrepancy=(beta - 1) * (u_min0 - (1 - k * x_max / u_max) * u_i),
            words="(at dP0)",
        ),
        expected=Outcome.FOLLOWS_IF,
        note="beta is its limit from above. A beta fitted freely to tests need not be 1 there; ours is by constraint.",
    ),
    Kind.THEOREM(
        "T4c",
        "dead zone that is left below the reference",
        u_dz,
        (u_min - u_min0) * u_max / (k * x_max),
        scope=UP_TO_REFERENCE,
        grounds=(Ground("(14)", ((u_O, u_min), (u_i, u_dz))),),
        values=(
            Value(
                "for a threshold 1 % of u_max above u_min0, first valve",
                of=(u_min - u_min0) / (k * x_max),
                at=(*FIRST.at(), (u_min, sympy.Rational("5.49"))),
                unit="%",
            ),
        ),
        note="The threshold is higher at a lower pressure drop, and the paper holds u_0 there.",
    ),
    Kind.THEOREM(
        "T4d",
        "the opposite command gives the opposite flow",
        Q_neg,
        -Q,
        scope=scope(BARE, u_min <= u_i),
        grounds=(
            Ground("(1)", ((u_i, u_min + u_i_prime), (u_max, u_min + u_i_prime + headroom))),
            Ground(
                "(1)",
                ((Q, Q_neg), (u_i, -u_min - u_i_prime), (u_max, u_min + u_i_prime + headroom)),
            ),
        ),
        eliminate=(Q,),
        note="So the law for negative commands is the mirror image, with its own parameters.",
    ),
    Kind.THEOREM(
        "T4e",
        "no flow inside the dead zone, on either side",
        Q,
        sympy.S.Zero,
        scope=scope(BARE, -u_min < u_i, u_i < u_min),
        grounds=("(1)",),
        cases=(
            Case(((u_i, y), (u_min, y + guard)), "0 <= u_i < u_min"),
            Case(((u_i, -y), (u_min, y + guard)), "-u_min < u_i <= 0"),
        ),
    ),
)
