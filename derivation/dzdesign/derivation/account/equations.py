"""Eqs. (1)-(18), transcribed once: what the paper starts from, and what it derives from that."""

import sympy

from dzdesign.derivation.account.scope import (
    BARE,
    BEFORE_STOP,
    FIXED_OPENING,
    LAW_AT_REFERENCE,
    LAW_OFF_REFERENCE,
    UP_TO_REFERENCE,
    scope,
    under_law,
)
from dzdesign.derivation.account.statement import Ground, Kind
from dzdesign.derivation.symbols import *

#: The numbers of the paper's equations; the later ones stand in other modules.
PAPER_NUMBERS = tuple(f"({number})" for number in range(1, 33))

#: Flow per opening.
ORIFICE = C_d * W * sympy.sqrt(2 * dP / rho)

#: Section 1 up to Eq. (7), with the readings of its figures that the rest needs.
APPROACH = (
    Kind.PREMISE(
        "(1)",
        "dead-zone model",
        Q,
        sympy.Piecewise(
            (-ORIFICE * x, sympy.And(-u_max <= u_i, u_i <= -u_min)),
            (0, sympy.And(-u_min < u_i, u_i < u_min)),
            (ORIFICE * x, sympy.And(u_min <= u_i, u_i <= u_max)),
        ),
        scope=scope(BARE),
        see=("T6d",),
        note="$x$ is the opening of the edge, not the travel of the spool: $x = 0$ at the threshold. $u_i$ is the "
        "valve's input; behind a compensator that is its output $u_O$.",
    ),
    Kind.ASSUMPTION(
        "Fig. 3, line",
        "target line through (0, 0) and ($u_max$, $Q_max$)",
        Q_w,
        Q_max / u_max * u_i,
        see=("T7d",),
        note="Read off the figure and the text below Eq. (1); the abstract ends the line elsewhere.",
    ),
    Kind.DEFINITION("K_e", "output flow gain: flow per command", K_e, Q_w / u_i, note="The words below Eq. (2)."),
    Kind.PAPER(
        "(2)",
        "flow gain of the target line",
        K_e,
        Q_max / u_max,
        rearranges=True,
        grounds=("K_e", "Fig. 3, line"),
        eliminate=(Q_w,),
    ),
    Kind.PAPER(
        "Q_max",
        "maximum flow (text below Eq. 2)",
        Q_max,
        ORIFICE * x_max,
        scope=scope(FIXED_OPENING),
        grounds=(Ground("(1)", ((Q, Q_max), (x, x_max), (u_max, u_min + headroom), (u_i, u_min + headroom))),),
    ),
    Kind.PAPER(
        "(3)",
        "flow gain by the orifice equation",
        K_e,
        ORIFICE * x_max / u_max,
        scope=scope(FIXED_OPENING),
        grounds=("(2)", "Q_max"),
        eliminate=(Q_max,),
        see=("T7b",),
        note="With $C_d$ constant (Assumption 2).",
    ),
    Kind.PREMISE(
        "(4)",
        "threshold over pressure drop",
        u_min,
        f(dP),
        see=("T9b", "T9c"),
        note="$f$ is fitted to the ramp tests by least squares. The temperature does not enter (Assumption 1).",
    ),
    Kind.PREMISE("(5)", "correction coefficient at $dP1$", beta, u_min1 / u_min0, see=("T3b", "T9c")),
    Kind.PREMISE(
        "(6)",
        "compensation above the reference",
        u_no,
        beta * u_0,
        scope=LAW_OFF_REFERENCE,
        see=("T1c", "(6c)", "T2d"),
        corrected_by="(6c)",
        corrected_for="a stop at every pressure drop",
        note="The paper's choice. It scales the whole compensation signal. Where a stop fixes $x_max$ the target "
        "(16) asks for less: (6c). Where full command is the limit it is exact: T2d.",
    ),
    Kind.PREMISE(
        "(7)",
        "selector",
        u_no,
        sympy.Piecewise((beta * u_0, dP1 > dP0), (u_0, dP1 <= dP0)),
        scope=scope(under_law("paper"), sympy.Eq(dP, dP1)),
        see=("T4b", "T4c"),
        note="Contains (6).",
    ),
)

#: Section 1.1.
AT_REFERENCE = (
    Kind.DEFINITION(
        "gamma_0", "flow per opening at $dP0$ (text below Eq. 8)", gamma_0, C_d * W * sympy.sqrt(2 * dP0 / rho)
    ),
    Kind.PAPER(
        "(8)",
        "flow gain at the reference",
        K_0,
        C_d * W * x_max * sympy.sqrt(2 * dP0 / rho) / u_max,
        gamma_0 * x_max / u_max,
        grounds=(Ground("(3)", ((K_e, K_0), (dP, dP0))), "gamma_0"),
        eliminate=(gamma_0,),
        note="$x_max$ does not depend on $dP$ (Assumption 3).",
    ),
    Kind.PAPER(
        "(9)",
        "wanted flow at the reference",
        Q_O,
        K_0 * u_i,
        rearranges=True,
        grounds=(Ground("Fig. 3, line", ((Q_w, Q_O), (Q_max, Q_max0))), Ground("(2)", ((K_e, K_0), (Q_max, Q_max0)))),
        eliminate=(Q_max0,),
        see=("T1a",),
    ),
    Kind.PAPER(
        "(10)",
        "opening that passes the wanted flow",
        x,
        Q_O / (C_d * W * sympy.sqrt(2 * dP0 / rho)),
        scope=LAW_AT_REFERENCE,
        grounds=(
            Ground(
                "(1)",
                (
                    (Q, Q_O),
                    (dP, dP0),
                    (u_i, u_min0 + u_i_prime),
                    (u_min, u_min0),
                    (u_max, u_min0 + u_i_prime + headroom),
                ),
            ),
        ),
    ),
    Kind.ASSUMPTION(
        "(11)",
        "opening in proportion to the command beyond the threshold",
        u_i_prime,
        k * x,
        scope=BEFORE_STOP & scope(-u_min - k * x_max <= u_O),
        see=("T2b", "T8a"),
        note="The paper calls it approximately linear; it holds up to the spool's stop.",
    ),
    Kind.DEFINITION(
        "u_O",
        "output of the compensator: compensation signal plus input",
        u_O,
        u_0 + u_i,
        scope=UP_TO_REFERENCE,
        note="Eqs. (14) and (18) print $u_0$ on both sides; the left one is the output $u_O$.",
    ),
    Kind.ASSUMPTION(
        "Fig. 3, command",
        "command at which the valve passes the wanted flow",
        u_O,
        u_i_prime + u_min0,
        scope=scope(sympy.Eq(dP, dP0), u_min0 <= u_O),
        note="Read off the figure: $u_i'$ is the part of the command that opens the edge.",
    ),
    Kind.PAPER(
        "(12)",
        "compensation signal in Fig. 3",
        u_0,
        u_i_prime + u_min0 - u_i,
        scope=LAW_AT_REFERENCE,
        rearranges=True,
        grounds=("Fig. 3, command", "u_O"),
        eliminate=(u_O,),
    ),
    Kind.PAPER(
        "(13)",
        "compensation signal at the reference",
        u_0,
        (k * x_max / u_max - 1) * u_i + u_min0,
        scope=LAW_AT_REFERENCE,
        grounds=("(12)", "(11)", "(10)", "(9)", "(8)", "gamma_0"),
        eliminate=(u_i_prime, x, Q_O, K_0, gamma_0),
    ),
    Kind.PAPER(
        "(14)",
        "law at the reference",
        u_O,
        u_0 + u_i,
        k * x_max / u_max * u_i + u_min0,
        scope=UP_TO_REFERENCE,
        grounds=("u_O", "(13)"),
        eliminate=(u_0,),
        see=("T1a", "T2b"),
        note="Printed with $u_0$ on the left, which is the output $u_O$.",
    ),
)

#: Section 1.2.
OFF_REFERENCE = (
    Kind.DEFINITION(
        "gamma_1", "flow per opening at $dP1$ (text below Eq. 15)", gamma_1, C_d * W * sympy.sqrt(2 * dP1 / rho)
    ),
    Kind.PAPER(
        "(15)",
        "flow gain off the reference",
        K_1,
        C_d * W * x_max * sympy.sqrt(2 * dP1 / rho) / u_max,
        gamma_1 * x_max / u_max,
        scope=scope(FIXED_OPENING),
        grounds=(Ground("(3)", ((K_e, K_1), (dP, dP1))), "gamma_1"),
        eliminate=(gamma_1,),
        see=("T7a", "T7c"),
        note="The published largest flows grow far more slowly with $dP$: T7a.",
    ),
    Kind.PAPER(
        "(16)",
        "wanted flow off the reference",
        Q_O_prime,
        K_1 * u_i,
        rearranges=True,
        grounds=(
            Ground("Fig. 3, line", ((Q_w, Q_O_prime), (Q_max, Q_max1))),
            Ground("(2)", ((K_e, K_1), (Q_max, Q_max1))),
        ),
        eliminate=(Q_max1,),
        see=("T1c", "T1d"),
        note="As a target. Fig. 3 draws the line at the reference; (16) takes it to hold at $dP1$ too. As a claim "
        "about the valve under Eq. (18) it does not follow: T1c.",
    ),
    Kind.PAPER(
        "(17)",
        "compensation signal off the reference",
        u_no,
        beta * u_0,
        beta * (k * x_max / u_max - 1) * u_i + beta * u_min0,
        scope=LAW_OFF_REFERENCE,
        grounds=("(6)", "(13)"),
        eliminate=(u_0,),
    ),
    Kind.PAPER(
        "(18)",
        "law off the reference",
        u_O,
        u_no + u_i,
        (beta * k * x_max / u_max - beta + 1) * u_i + beta * u_min0,
        scope=LAW_OFF_REFERENCE,
        grounds=(Ground("u_O", ((u_0, u_no),)), "(17)"),
        eliminate=(u_no,),
        see=("T1b", "T1c", "T3a", "T4a"),
        note="Printed with $u_0$ on the left, which is the output $u_O$.",
    ),
)
