"""Theorems 3, 4 and 10: the law at zero command, whether it rises, what it leaves below the reference; transition."""

import sympy

from dzdesign.derivation.account.published import FIRST, SECOND, SIMULATION
from dzdesign.derivation.account.scope import (
    AT_ZERO_COMMAND,
    BARE,
    FREE_BETA,
    FREE_OPENING,
    LAW_OFF_REFERENCE,
    UP_TO_REFERENCE,
    WITH_TRANSITION,
    scope,
)
from dzdesign.derivation.account.statement import Case, Condition, Ground, Kind, Outcome, Value
from dzdesign.derivation.law import law
from dzdesign.derivation.symbols import *
from dzdesign.derivation.transition import LAW_COMMAND, LOWERED_BY, SHARE

_PAPER_LAW = law("paper")
_OFFSET = _PAPER_LAW.offset
_THREE_CASES = (
    Case(((u_min1, _OFFSET + guard),), "$beta u_min0$ below the threshold"),
    Case(((u_min1, _OFFSET),), "$beta u_min0$ at the threshold"),
    Case(((u_min1, _OFFSET - excess),), "$beta u_min0$ above the threshold"),
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
            Ground("(1)", ((dP, dP1), (u_i, _OFFSET), (u_min, u_min1), (u_max, _OFFSET + headroom))),
            Ground("opening", ((u_O, _OFFSET), (u_min, u_min1))),
            "gamma_1",
        ),
        eliminate=(x, gamma_1),
        cases=_THREE_CASES,
        positive_if=u_min1 < _OFFSET,
        note="So zero command passes no flow exactly if $beta u_min0 <= u_min$($dP$). Both laws have this offset.",
    ),
    Kind.THEOREM(
        "T3b",
        "flow at zero command without $beta$, for a threshold lower than at the reference",
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
        grounds=("(5)", Ground("(4)", ((u_min, u_min0), (dP, dP0))), Ground("(4)", ((u_min, u_min1), (dP, dP1)))),
        eliminate=(u_min0, u_min1),
    ),
    Kind.THEOREM(
        "T3c",
        "with $beta$ by Eq. (5), zero command stands at the threshold of the present pressure drop",
        u_O,
        f(dP1),
        scope=LAW_OFF_REFERENCE & AT_ZERO_COMMAND,
        grounds=(Ground("(18)", ((u_i, sympy.S.Zero),)), "beta(dP)", Ground("(4)", ((u_min, u_min0), (dP, dP0)))),
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
        note="Holds for every $beta <= 1$. The law `target` always rises.",
    ),
    Kind.DEFINITION("jump", "step of the output where $dP$ passes $dP0$", jump, u_above - u_below),
    Kind.THEOREM(
        "T4b",
        "the selector (7) is continuous at $dP0$",
        jump,
        sympy.S.Zero,
        scope=scope(FREE_BETA, sympy.Eq(dP, dP1), dP0 < dP1),
        grounds=("jump", Ground("L2", ((u_O, u_above), (dP1, dP0 + above))), Ground("(14)", ((u_O, u_below),))),
        eliminate=(u_above, u_below),
        condition=Condition(
            any_of=((sympy.Eq(beta, 1),),),
            for_all=(u_i,),
            discrepancy=(beta - 1) * (u_min0 - (1 - k * x_max / u_max) * u_i),
            words="(at $dP0$)",
        ),
        expected=Outcome.FOLLOWS_IF,
        note="$beta$ is its limit from above. A $beta$ fitted freely to tests need not be 1 there; ours is by "
        "constraint.",
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
                "for a threshold 1 % of $u_max$ above $u_min0$, first valve",
                of=(u_min - u_min0) / (k * x_max),
                at=(*FIRST.at(), (u_min, sympy.Rational("5.49"))),
                unit="%",
            ),
        ),
        note="The threshold is higher at a lower pressure drop, and the paper holds $u_0$ there.",
    ),
    Kind.THEOREM(
        "T4d",
        "the opposite command gives the opposite flow",
        Q_neg,
        -Q,
        scope=scope(BARE, u_min <= u_i),
        grounds=(
            Ground("(1)", ((u_i, u_min + u_i_prime), (u_max, u_min + u_i_prime + headroom))),
            Ground("(1)", ((Q, Q_neg), (u_i, -u_min - u_i_prime), (u_max, u_min + u_i_prime + headroom))),
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
            Case(((u_i, y), (u_min, y + guard)), "0 <= $u_i < u_min$"),
            Case(((u_i, -y), (u_min, y + guard)), "-$u_min < u_i <= 0$"),
        ),
    ),
)

_OPENING_LAW = _PAPER_LAW.output.subs(beta, beta_o)
_RISE = _OPENING_LAW.subs(u_i, u_t) - _OFFSET
_DRIVEN = scope(WITH_TRANSITION, sympy.Eq(dP, dP1))
_BAND = _DRIVEN & scope(u_i <= u_z)
_TRANSITION = _DRIVEN & scope(u_z <= u_i, u_i <= u_t)

#: Theorem 10: the law that the firmware runs by default.
TRANSITION = (
    Kind.DEFINITION(
        "share",
        "share of the transition that the command has passed",
        share,
        sympy.Piecewise((0, u_i <= u_z), (SHARE, u_i <= u_t), (1, u_t < u_i)),
        scope=_DRIVEN,
    ),
    Kind.CHOICE(
        "transition",
        "the law `paper` with zero band and transition, up to the end of the transition",
        u_O,
        _OPENING_LAW.subs(u_i, LAW_COMMAND) - LOWERED_BY,
        scope=_DRIVEN & scope(u_i <= u_t),
        note="The law of the opening threshold, lowered to the certified offset $beta u_min0$ of the closing one.",
    ),
    Kind.CHOICE(
        "beyond",
        "the law `paper` of the opening threshold, beyond the transition",
        u_O,
        _OPENING_LAW,
        scope=_DRIVEN & scope(u_t <= u_i),
    ),
    Kind.THEOREM(
        "T10a",
        "within the zero band the output is the certified offset, and never above it",
        u_O,
        _OFFSET,
        scope=_BAND,
        grounds=("transition", "share"),
        eliminate=(share,),
        cases=(Case(((u_z, u_i + y),), "within the zero band"),),
    ),
    Kind.THEOREM(
        "T10b",
        "the transition runs straight from the certified offset to the law of the opening threshold",
        u_O,
        _OFFSET + _RISE * (u_i - u_z) / (u_t - u_z),
        scope=_TRANSITION,
        grounds=("transition", "share"),
        eliminate=(share,),
        cases=(Case(((u_i, u_z + excess), (u_t, u_z + excess + headroom)), "within the transition"),),
        note="At $u_z$ it is the output of the zero band (T10a), at $u_t$ that of the law beyond (T10c): continuous.",
    ),
    Kind.THEOREM(
        "T10c",
        "at the end of the transition the output is that of the law beyond it",
        u_O,
        _OPENING_LAW,
        scope=_DRIVEN & scope(sympy.Eq(u_i, u_t)),
        grounds=("transition", "share"),
        eliminate=(share,),
        cases=(Case(((u_i, u_z + width), (u_t, u_z + width)), "at the end"),),
    ),
    Kind.THEOREM(
        "T10d",
        "slope within the transition",
        slope,
        _RISE / (u_t - u_z),
        scope=_DRIVEN & scope(u_z <= u_i, u_i < u_t),
        grounds=(Ground("T10b", derivative=(u_i, slope)),),
        cases=(Case(((u_t, u_z + width),), ""),),
        positive_if=_OPENING_LAW.subs(u_i, u_t) > _OFFSET,
        note="It rises if the law of the opening threshold stands above the certified offset at $u_t$: always where "
        "it rises itself (T10e), for $beta <= beta_o$.",
    ),
    Kind.THEOREM(
        "T10e",
        "slope beyond the transition",
        slope,
        1 - beta_o * (1 - k * x_max / u_max),
        scope=_DRIVEN & scope(u_t <= u_i),
        grounds=(Ground("beyond", derivative=(u_i, slope)),),
        positive_if=beta_o * (1 - k * x_max / u_max) < 1,
    ),
    Kind.THEOREM(
        "T10f",
        "no flow within the zero band, with a certified offset that is not above the threshold",
        Q,
        sympy.S.Zero,
        scope=_BAND & scope(beta * u_min0 <= u_min1, beta * u_min0 <= u_max),
        grounds=("T3a",),
        cases=(
            Case(((u_min1, _OFFSET + guard),), "$beta u_min0$ below the threshold"),
            Case(((u_min1, _OFFSET),), "$beta u_min0$ at the threshold"),
        ),
        see=("T10a",),
        note="The drive is that of zero command (T10a), and so is the flow.",
    ),
)
