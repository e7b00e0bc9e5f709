"""Theorems 3, 4 and 10: the law at zero command, whether it rises, what it leaves below the reference; transition."""

import sympy
from sympy import Eq, Ne, Piecewise

from dzdesign.derivation.account.published import FIRST, SECOND, SIMULATION
from dzdesign.derivation.account.scope import *
from dzdesign.derivation.account.statement import Case, Ground, Kind
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
    Kind.THEOREM("T3a", "flow at zero command")
    .says(Q, Piecewise((0, u_min1 > _OFFSET), (gamma_1 * (_OFFSET - u_min1) / k, u_min1 <= _OFFSET)))
    .by(
        Ground("(1)", ((dP, dP1), (u_i, _OFFSET), (u_min, u_min1), (u_max, _OFFSET + headroom))),
        Ground("opening", ((u_O, _OFFSET), (u_min, u_min1))),
        "gamma_1",
    )
    .within(FREE_BETA, Eq(dP, dP1), beta * u_min0 <= u_max, AT_ZERO_COMMAND)
    .in_cases(*_THREE_CASES)
    .positive_exactly_if(u_min1 < _OFFSET)
    .remark("So zero command passes no flow exactly if $beta u_min0 <= u_min$($dP$). Both laws have this offset."),
    Kind.THEOREM("T3b", "flow at zero command without $beta$, for a threshold lower than at the reference")
    .says(Q, gamma_1 * (u_min0 - u_min1) / k, Q_max1 * (u_min0 - u_min1) / (u_max - u_min1))
    .by(Ground("T3a", ((beta, sympy.S.One),)), "largest flow", eliminate=(gamma_1,), provided=(Ne(u_max, u_min1),))
    .within(FREE_BETA, FREE_OPENING, Eq(dP, dP1), Eq(beta, 1), u_min1 < u_min0, AT_ZERO_COMMAND)
    .in_cases(Case(((u_min1, u_min0 - excess),), "threshold lower than at the reference"))
    .qualified_by("T9d")
    .numbers(
        SIMULATION.value(
            "",
            "L/min",
            published=SIMULATION.zero_flow_without_beta,
            remark="read off a figure; 0.01 L/min is 0.002 V of threshold",
        ),
        FIRST.value(
            "",
            "L/min",
            published=FIRST.zero_flow_without_beta,
            remark="If the paper's thresholds are the first flow that its meter shows (it starts at 0.6 L/min), "
            "T9d gives 1.69.",
        ),
        SECOND.value("", "L/min"),
    ),
    Kind.THEOREM("beta(dP)", "correction coefficient from the fitted thresholds")
    .says(beta, f(dP1) / f(dP0))
    .by("(5)", Ground("(4)", ((u_min, u_min0), (dP, dP0))), Ground("(4)", ((u_min, u_min1), (dP, dP1)))),
    Kind.THEOREM("T3c", "with $beta$ by Eq. (5), zero command stands at the threshold of the present pressure drop")
    .says(u_O, f(dP1))
    .by(Ground("(18)", ((u_i, sympy.S.Zero),)), "beta(dP)", Ground("(4)", ((u_min, u_min0), (dP, dP0))))
    .within(LAW_OFF_REFERENCE, AT_ZERO_COMMAND)
    .remark("Nothing is left for an error of the threshold: a design needs a guard."),
)

#: Theorem 4: monotone, continuous, and what is left below the reference.
SHAPE = (
    Kind.THEOREM("T4a", "slope of the law (18)")
    .says(slope, 1 - beta * (1 - k * x_max / u_max))
    .by(Ground("(18)", derivative=(u_i, slope)))
    .within(LAW_OFF_REFERENCE)
    .positive_exactly_if(beta * (1 - k * x_max / u_max) < 1)
    .remark("Holds for every $beta <= 1$. The law `target` always rises."),
    Kind.DEFINITION("jump", "step of the output where $dP$ passes $dP0$").says(jump, u_above - u_below),
    Kind.THEOREM("T4b", "the selector (7) is continuous at $dP0$")
    .says(jump, sympy.S.Zero)
    .by("jump", Ground("L2", ((u_O, u_above), (dP1, dP0 + above))), Ground("(14)", ((u_O, u_below),)))
    .within(FREE_BETA, Eq(dP, dP1), dP0 < dP1)
    .if_(
        Eq(beta, 1),
        for_all=(u_i,),
        discrepancy=(beta - 1) * (u_min0 - (1 - k * x_max / u_max) * u_i),
        words="(at $dP0$)",
    )
    .remark(
        "$beta$ is its limit from above. A $beta$ fitted freely to tests need not be 1 there; ours is by constraint."
    ),
    Kind.THEOREM("T4c", "dead zone that is left below the reference")
    .says(u_dz, (u_min - u_min0) * u_max / (k * x_max))
    .by(Ground("(14)", ((u_O, u_min), (u_i, u_dz))))
    .within(UP_TO_REFERENCE)
    .numbers(
        FIRST.value(
            "for a threshold 1 % of $u_max$ above $u_min0$",
            "%",
            of=(u_min - u_min0) / (k * x_max),
            also=((u_min, sympy.Rational("5.49")),),
        )
    )
    .remark("The threshold is higher at a lower pressure drop, and the paper holds $u_0$ there."),
    Kind.THEOREM("T4d", "the opposite command gives the opposite flow")
    .says(Q_neg, -Q)
    .by(
        Ground("(1)", ((u_i, u_min + u_i_prime), (u_max, u_min + u_i_prime + headroom))),
        Ground("(1)", ((Q, Q_neg), (u_i, -u_min - u_i_prime), (u_max, u_min + u_i_prime + headroom))),
    )
    .within(BARE, u_min <= u_i)
    .remark("So the law for negative commands is the mirror image, with its own parameters."),
    Kind.THEOREM("T4e", "no flow inside the dead zone, on either side")
    .says(Q, sympy.S.Zero)
    .by("(1)")
    .within(BARE, -u_min < u_i, u_i < u_min)
    .in_cases(
        Case(((u_i, y), (u_min, y + guard)), "0 <= $u_i < u_min$"),
        Case(((u_i, -y), (u_min, y + guard)), "-$u_min < u_i <= 0$"),
    ),
)

_OPENING_LAW = _PAPER_LAW.output.subs(beta, beta_o)
_RISE = _OPENING_LAW.subs(u_i, u_t) - _OFFSET
_DRIVEN = scope(WITH_TRANSITION, Eq(dP, dP1))
_BAND = _DRIVEN & scope(u_i <= u_z)
_TRANSITION = _DRIVEN & scope(u_z <= u_i, u_i <= u_t)

#: Theorem 10: the law that the firmware runs by default.
TRANSITION = (
    Kind.DEFINITION("share", "share of the transition that the command has passed")
    .says(share, Piecewise((0, u_i <= u_z), (SHARE, u_i <= u_t), (1, u_t < u_i)))
    .within(_DRIVEN),
    Kind.CHOICE("transition", "the law `paper` with zero band and transition, up to the end of the transition")
    .says(u_O, _OPENING_LAW.subs(u_i, LAW_COMMAND) - LOWERED_BY)
    .within(_DRIVEN, u_i <= u_t)
    .remark("The law of the opening threshold, lowered to the certified offset $beta u_min0$ of the closing one."),
    Kind.CHOICE("beyond", "the law `paper` of the opening threshold, beyond the transition")
    .says(u_O, _OPENING_LAW)
    .within(_DRIVEN, u_t <= u_i),
    Kind.THEOREM("T10a", "within the zero band the output is the certified offset, and never above it")
    .says(u_O, _OFFSET)
    .by("transition", "share")
    .within(_BAND)
    .in_cases(Case(((u_z, u_i + y),), "within the zero band")),
    Kind.THEOREM("T10b", "the transition runs straight from the certified offset to the law of the opening threshold")
    .says(u_O, _OFFSET + _RISE * (u_i - u_z) / (u_t - u_z))
    .by("transition", "share")
    .within(_TRANSITION)
    .in_cases(Case(((u_i, u_z + excess), (u_t, u_z + excess + headroom)), "within the transition"))
    .remark("At $u_z$ it is the output of the zero band (T10a), at $u_t$ that of the law beyond (T10c): continuous."),
    Kind.THEOREM("T10c", "at the end of the transition the output is that of the law beyond it")
    .says(u_O, _OPENING_LAW)
    .by("transition", "share")
    .within(_DRIVEN, Eq(u_i, u_t))
    .in_cases(Case(((u_i, u_z + width), (u_t, u_z + width)), "at the end")),
    Kind.THEOREM("T10d", "slope within the transition")
    .says(slope, _RISE / (u_t - u_z))
    .by(Ground("T10b", derivative=(u_i, slope)))
    .within(_DRIVEN, u_z <= u_i, u_i < u_t)
    .in_cases(Case(((u_t, u_z + width),), ""))
    .positive_exactly_if(_OPENING_LAW.subs(u_i, u_t) > _OFFSET)
    .remark(
        "It rises if the law of the opening threshold stands above the certified offset at $u_t$: always where "
        "it rises itself (T10e), for $beta <= beta_o$."
    ),
    Kind.THEOREM("T10e", "slope beyond the transition")
    .says(slope, 1 - beta_o * (1 - k * x_max / u_max))
    .by(Ground("beyond", derivative=(u_i, slope)))
    .within(_DRIVEN, u_t <= u_i)
    .positive_exactly_if(beta_o * (1 - k * x_max / u_max) < 1),
    Kind.THEOREM("T10f", "no flow within the zero band, with a certified offset that is not above the threshold")
    .says(Q, sympy.S.Zero)
    .by("T3a")
    .within(_BAND, beta * u_min0 <= u_min1, beta * u_min0 <= u_max)
    .in_cases(*_THREE_CASES[:2])
    .qualified_by("T10a")
    .remark("The drive is that of zero command (T10a), and so is the flow."),
)
