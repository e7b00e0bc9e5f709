"""The laws' ties to the paper's equations, and the theorems about the laws.

Theorems 1 and 2: which flow they give, and what full command does. Theorems 3, 4 and 10: zero command, whether a law
rises, what it leaves below the reference, the transition.
"""

import sympy
from sympy import Eq, Ne, Piecewise, sqrt

from dzdesign.derivation.account.equations import beyond
from dzdesign.derivation.account.published import FIRST, SECOND, SIMULATION, VALVES
from dzdesign.derivation.account.scope import *
from dzdesign.derivation.account.statement import Case, Ground, Kind
from dzdesign.derivation.law import law
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.derivation.scaling import LAW_COMMAND, LOWERED_BY, SHARE
from dzdesign.derivation.symbols import *

_DRIVE_LEFT_OVER = "with $k x_max = u_max - u_min0$, the command left above the threshold"

#: What the laws are in the paper's terms.
TIES = tuple(statement for name in LAW_NAMES for statement in law(name).statements)


def flow_under(law_number: str, threshold: sympy.Symbol, pressure: sympy.Symbol) -> tuple[Ground, ...]:
    """What gives the valve's flow under a law, beyond the threshold at one pressure drop."""
    return (
        Ground("(1)", ((dP, pressure), *beyond(threshold))),
        Ground("(11)"),
        Ground("Fig. 3, command", ((u_min0, threshold),)),
        Ground(law_number),
    )


_PAPER_LAW = LAW_OFF_REFERENCE & scope(FIXED_OPENING) & BEFORE_STOP
_TARGET_LAW = TARGET_OFF_REFERENCE & scope(FIXED_OPENING)
_AT_DP1 = ("(5)", "gamma_1", "(15)", "(16)")
_UNKNOWN_AT_DP1 = (x, u_i_prime, u_O, u_min1, gamma_1, K_1, Q_O_prime)

#: Theorem 1: which flow the laws give.
TARGET = (
    Kind.THEOREM("T1a", "at the reference the law (14) gives the wanted flow (9)")
    .says(Q, Q_O)
    .by(
        *flow_under("(14)", u_min0, dP0),
        *("(9)", "(8)", "gamma_0"),
        eliminate=(x, u_i_prime, u_O, Q_O, K_0, gamma_0),
    )
    .within(LAW_AT_REFERENCE),
    Kind.THEOREM("T1b", "flow that the law (18) gives off the reference")
    .says(
        Q,
        Q_O_prime + gamma_1 * (1 - beta) * (1 - k * x_max / u_max) * u_i / k,
        Q_O_prime * (beta + (1 - beta) * u_max / (k * x_max)),
    )
    .by(*flow_under("(18)", u_min1, dP1), *_AT_DP1, eliminate=_UNKNOWN_AT_DP1)
    .within(_PAPER_LAW)
    .numbers(
        *(valve.value("flow over the target", "1", of=beta + (1 - beta) * u_max / (k * x_max)) for valve in VALVES)
    )
    .remark(f"Above the target wherever $beta < 1$ and $k x_max < u_max$. The numbers: {_DRIVE_LEFT_OVER}."),
    Kind.THEOREM("T1c", "the law (18) meets the target (16)")
    .says(Q, Q_O_prime)
    .by(*flow_under("(18)", u_min1, dP1), *_AT_DP1, eliminate=_UNKNOWN_AT_DP1)
    .within(_PAPER_LAW)
    .if_(
        Eq(beta, 1),
        Eq(k * x_max, u_max),
        for_all=(u_i,),
        ruled_out_by=tuple((name, value) for name, value in FIRST.at() if name in (u_max, beta, k)),
        discrepancy=C_d * W * sqrt(2 * dP1 / rho) * (1 - beta) * (1 - k * x_max / u_max) * u_i / k,
    )
    .corrected("T1d")
    .qualified_by("T2d")
    .remark(
        "Where a stop fixes $x_max$. Where full command is the limit it follows, for then the target ends at "
        "the largest flow that full command gives: T2d."
    ),
    Kind.THEOREM("T1d", "the law `target` meets the target (16)")
    .says(Q, Q_O_prime)
    .by(*flow_under("L3", u_min1, dP1), *_AT_DP1, eliminate=_UNKNOWN_AT_DP1)
    .within(_TARGET_LAW),
    Kind.DEFINITION("drive left", "drive that is not used").says(drive_left, u_max - u_O),
    Kind.THEOREM("T1e", "drive that the law `target` leaves unused at full command")
    .says(drive_left, u_max - k * x_max - beta * u_min0)
    .rearranging("drive left", Ground("L3", ((u_i, u_max),)))
    .within(TARGET_OFF_REFERENCE, AT_FULL_COMMAND)
    .numbers(FIRST.value("at 5 MPa", "V"), SECOND.value("at 5 MPa", "V"))
    .remark(
        "(1 - $beta$) $u_min0$ where $k x_max = u_max - u_min0$: the target asks for $x_max$ and not for more, "
        "though at a lower threshold the same command could open further. In flow it is what T1b gives above the "
        "target."
    ),
    Kind.CORRECTED(
        "(6c)", "compensation signal that meets the target (16) where a stop fixes $x_max$, what (6) should read"
    )
    .says(u_no, u_0 - (1 - beta) * u_min0)
    .by(
        Ground("u_O", ((u_0, u_no),)),
        Ground("Fig. 3, command", ((u_min0, u_min1),)),
        "(11)",
        Ground("(10)", ((Q_O, Q_O_prime), (dP0, dP1))),
        "(16)",
        "(15)",
        "gamma_1",
        "(5)",
        "(13)",
        eliminate=(u_O, u_i_prime, x, Q_O_prime, K_1, gamma_1, u_min1, u_0),
    )
    .within(_TARGET_LAW)
    .qualified_by("T2d", "T2e")
    .remark(
        "Only the threshold is corrected, not the gain: this is the law `target`. One of two readings: where full "
        "command is the limit, (6) itself meets the target (T2d) and this one loses flow (T2e)."
    ),
)

_AT_FULL_COMMAND = (
    *("(5)", "gamma_1", "T2c", "full command", "(16)"),
    Ground("(2)", ((K_e, K_1), (Q_max, Q_max1))),
)
_FULL_COMMAND_IS_THE_LIMIT = scope(FREE_OPENING)

#: Theorem 2: full command.
FULL_COMMAND = (
    Kind.THEOREM("T2a", "output of the law (18) at full command")
    .says(u_O, u_max + beta * (k * x_max + u_min0 - u_max))
    .by(Ground("(18)", ((u_i, u_max),)))
    .within(LAW_OFF_REFERENCE, AT_FULL_COMMAND),
    Kind.THEOREM("T2b", "full command gives full drive at every pressure drop")
    .says(u_O, u_max)
    .by("T2a")
    .within(LAW_OFF_REFERENCE, AT_FULL_COMMAND)
    .if_(Eq(k * x_max, u_max - u_min0), for_all=(beta,), discrepancy=beta * (k * x_max + u_min0 - u_max))
    .remark(
        "With less travel, as where the spool meets its stop at 8-8.5 V (section 4.2), full command asks for less "
        "than full drive; with more, for drive that is not there."
    ),
    Kind.ASSUMPTION("opening", "opening on both sides of the threshold")
    .says(x, Piecewise(((u_O - u_min) / k, u_min <= u_O), (0, u_O < u_min)))
    .within(EDGE)
    .remark("Eq. (11) with Fig. 3 beyond the threshold; closed before it, as Eq. (1) says."),
    Kind.THEOREM("largest flow", "largest flow at $dP1$ without compensator")
    .says(Q_max1, gamma_1 * (u_max - u_min1) / k)
    .by(
        Ground("(1)", ((Q, Q_max1), (dP, dP1), (u_min, u_min1), (u_i, u_max))),
        Ground("opening", ((u_O, u_max), (u_min, u_min1))),
        "gamma_1",
    )
    .within(BARE, FREE_OPENING, Eq(dP, dP1), u_min1 <= u_max, AT_FULL_COMMAND)
    .in_cases(Case(((u_max, u_min1 + headroom),), ""))
    .remark("As long as the spool has not met its stop."),
    Kind.ASSUMPTION("full command", "$x_max$ is the opening that full command gives at $dP0$")
    .says(x_max, (u_max - u_min0) / k)
    .within(_FULL_COMMAND_IS_THE_LIMIT)
    .qualified_by("T2b")
    .remark(
        "The condition under which 1.048 and 1.018 (T1b) are computed. Without a stop, full command then opens "
        "the valve further at $dP1$, where its threshold is lower."
    ),
    Kind.THEOREM("T2c", "largest flow off the reference where full command is the limit")
    .says(Q_max1, gamma_1 * (u_max - beta * u_min0) / k)
    .by("largest flow", "(5)", eliminate=(u_min1,))
    .within(_FULL_COMMAND_IS_THE_LIMIT)
    .remark("More than $gamma_1 x_max$, the flow of Assumption 3, wherever $beta < 1$."),
    Kind.THEOREM(
        "T2d",
        "where full command is the limit, the law (18) gives the line to the largest flow, and so the target (16)",
    )
    .says(Q, Q_max1 * u_i / u_max, Q_O_prime)
    .by(
        *flow_under("(18)", u_min1, dP1),
        *_AT_FULL_COMMAND,
        eliminate=(*_UNKNOWN_AT_DP1, Q_max1, x_max),
    )
    .within(LAW_OFF_REFERENCE, _FULL_COMMAND_IS_THE_LIMIT)
    .qualified_by("T1c", "T2e")
    .remark(
        "The other reading of (6): Eq. (18) is the right law of Fig. 3 as long as full command is the limit. "
        "With a stop that fixes $x_max$ it overshoots: T1b, T1c."
    ),
    Kind.THEOREM("T2e", "where full command is the limit, the law `target` falls short of the target (16)")
    .says(Q, Q_O_prime * (u_max - u_min0) / (u_max - beta * u_min0))
    .by(
        *flow_under("L3", u_min1, dP1),
        *_AT_FULL_COMMAND,
        eliminate=(*_UNKNOWN_AT_DP1, Q_max1, x_max),
    )
    .within(TARGET_OFF_REFERENCE, _FULL_COMMAND_IS_THE_LIMIT)
    .qualified_by("T1d", "T1e")
    .numbers(
        *(
            valve.value("flow lost", "%", of=1 - (u_max - u_min0) / (u_max - beta * u_min0))
            for valve in (FIRST, SIMULATION, SECOND)
        )
    )
    .remark(
        "At every command, full command included. The correction (6c) is right only where a stop fixes $x_max$ (T1d)."
    ),
)

_LAW_18 = law("paper")
_OFFSET = _LAW_18.offset
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

_OPENING_LAW = _LAW_18.output.subs(beta, beta_o)
_RISE = _OPENING_LAW.subs(u_i, u_t) - _OFFSET
_DRIVEN = scope(WITH_TRANSITION, Eq(dP, dP1))
_BAND = _DRIVEN & scope(u_i <= u_z)
_IN_TRANSITION = _DRIVEN & scope(u_z <= u_i, u_i <= u_t)

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
    .within(_IN_TRANSITION)
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
