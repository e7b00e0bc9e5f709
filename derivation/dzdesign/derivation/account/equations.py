"""Eqs. (1)-(18), transcribed once: what the paper starts from, and what it derives from that."""

import sympy
from sympy import And, Eq, Piecewise, sqrt

from dzdesign.derivation.account.scope import *
from dzdesign.derivation.account.statement import Ground, Kind, Replacements
from dzdesign.derivation.symbols import *

#: The numbers of the paper's equations; the later ones stand in other modules.
PAPER_NUMBERS = tuple(f"({number})" for number in range(1, 33))

#: Flow per opening.
ORIFICE = C_d * W * sqrt(2 * dP / rho)


def beyond(threshold: sympy.Symbol, distance: sympy.Symbol = u_i_prime) -> Replacements:
    """Take Eq. (1) at a command beyond a threshold and up to full command."""
    return (u_i, threshold + distance), (u_min, threshold), (u_max, threshold + distance + headroom)


#: Section 1 up to Eq. (7), with the readings of its figures that the rest needs.
APPROACH = (
    Kind.PREMISE("(1)", "dead-zone model")
    .says(
        Q,
        Piecewise(
            (-ORIFICE * x, And(-u_max <= u_i, u_i <= -u_min)),
            (0, And(-u_min < u_i, u_i < u_min)),
            (ORIFICE * x, And(u_min <= u_i, u_i <= u_max)),
        ),
    )
    .within(BARE)
    .qualified_by("T6d")
    .remark(
        "$x$ is the opening of the edge, not the travel of the spool: $x = 0$ at the threshold. $u_i$ is the "
        "valve's input; behind a compensator that is its output $u_O$."
    ),
    Kind.ASSUMPTION("Fig. 3, line", "target line through (0, 0) and ($u_max$, $Q_max$)")
    .says(Q_w, Q_max / u_max * u_i)
    .qualified_by("T7d")
    .remark("Read off the figure and the text below Eq. (1); the abstract ends the line elsewhere."),
    Kind.DEFINITION("K_e", "output flow gain: flow per command")
    .says(K_e, Q_w / u_i)
    .remark("The words below Eq. (2)."),
    Kind.PAPER("(2)", "flow gain of the target line").says(K_e, Q_max / u_max).rearranging("K_e", "Fig. 3, line"),
    Kind.PAPER("Q_max", "maximum flow (text below Eq. 2)")
    .says(Q_max, ORIFICE * x_max)
    .by(Ground("(1)", ((Q, Q_max), (x, x_max), (u_max, u_min + headroom), (u_i, u_min + headroom))))
    .within(FIXED_OPENING),
    Kind.PAPER("(3)", "flow gain by the orifice equation")
    .says(K_e, ORIFICE * x_max / u_max)
    .by("(2)", "Q_max")
    .within(FIXED_OPENING)
    .qualified_by("T7b")
    .remark("With $C_d$ constant (Assumption 2)."),
    Kind.PREMISE("(4)", "threshold over pressure drop")
    .says(u_min, f(dP))
    .qualified_by("T9b", "T9c")
    .remark("$f$ is fitted to the ramp tests by least squares. The temperature does not enter (Assumption 1)."),
    Kind.PREMISE("(5)", "correction coefficient at $dP1$").says(beta, u_min1 / u_min0).qualified_by("T3b", "T9c"),
    Kind.PREMISE("(6)", "compensation above the reference")
    .says(u_no, beta * u_0)
    .within(LAW_OFF_REFERENCE)
    .corrected("(6c)", "a stop at every pressure drop")
    .qualified_by("T1c", "(6c)", "T2d")
    .remark(
        "The paper's choice. It scales the whole compensation signal. Where a stop fixes $x_max$ the target "
        "(16) asks for less: (6c). Where full command is the limit it is exact: T2d."
    ),
    Kind.PREMISE("(7)", "selector")
    .says(u_no, Piecewise((beta * u_0, dP1 > dP0), (u_0, dP1 <= dP0)))
    .within(under_law("paper"), Eq(dP, dP1))
    .qualified_by("T4b", "T4c")
    .remark("Contains (6)."),
)

#: Section 1.1.
AT_REFERENCE = (
    Kind.DEFINITION("gamma_0", "flow per opening at $dP0$ (text below Eq. 8)").says(
        gamma_0, C_d * W * sqrt(2 * dP0 / rho)
    ),
    Kind.PAPER("(8)", "flow gain at the reference")
    .says(K_0, C_d * W * x_max * sqrt(2 * dP0 / rho) / u_max, gamma_0 * x_max / u_max)
    .by(Ground("(3)", ((K_e, K_0), (dP, dP0))), "gamma_0")
    .remark("$x_max$ does not depend on $dP$ (Assumption 3)."),
    Kind.PAPER("(9)", "wanted flow at the reference")
    .says(Q_O, K_0 * u_i)
    .rearranging(
        Ground("Fig. 3, line", ((Q_w, Q_O), (Q_max, Q_max0))),
        Ground("(2)", ((K_e, K_0), (Q_max, Q_max0))),
        eliminate=(Q_max0,),
    )
    .qualified_by("T1a"),
    Kind.PAPER("(10)", "opening that passes the wanted flow")
    .says(x, Q_O / (C_d * W * sqrt(2 * dP0 / rho)))
    .by(Ground("(1)", ((Q, Q_O), (dP, dP0), *beyond(u_min0))))
    .within(LAW_AT_REFERENCE),
    Kind.ASSUMPTION("(11)", "opening in proportion to the command beyond the threshold")
    .says(u_i_prime, k * x)
    .within(BEFORE_STOP, -u_min - k * x_max <= u_O)
    .qualified_by("T2b", "T8a")
    .remark("The paper calls it approximately linear; it holds up to the spool's stop."),
    Kind.DEFINITION("u_O", "output of the compensator: compensation signal plus input")
    .says(u_O, u_0 + u_i)
    .within(UP_TO_REFERENCE)
    .remark("Eqs. (14) and (18) print $u_0$ on both sides; the left one is the output $u_O$."),
    Kind.ASSUMPTION("Fig. 3, command", "command at which the valve passes the wanted flow")
    .says(u_O, u_i_prime + u_min0)
    .within(Eq(dP, dP0), u_min0 <= u_O)
    .remark("Read off the figure: $u_i'$ is the part of the command that opens the edge."),
    Kind.PAPER("(12)", "compensation signal in Fig. 3")
    .says(u_0, u_i_prime + u_min0 - u_i)
    .rearranging("Fig. 3, command", "u_O")
    .within(LAW_AT_REFERENCE),
    Kind.PAPER("(13)", "compensation signal at the reference")
    .says(u_0, (k * x_max / u_max - 1) * u_i + u_min0)
    .by("(12)", "(11)", "(10)", "(9)", "(8)", "gamma_0")
    .within(LAW_AT_REFERENCE),
    Kind.PAPER("(14)", "law at the reference")
    .says(u_O, u_0 + u_i, k * x_max / u_max * u_i + u_min0)
    .by("u_O", "(13)")
    .within(UP_TO_REFERENCE)
    .qualified_by("T1a", "T2b")
    .remark("Printed with $u_0$ on the left, which is the output $u_O$."),
)

#: Section 1.2.
OFF_REFERENCE = (
    Kind.DEFINITION("gamma_1", "flow per opening at $dP1$ (text below Eq. 15)").says(
        gamma_1, C_d * W * sqrt(2 * dP1 / rho)
    ),
    Kind.PAPER("(15)", "flow gain off the reference")
    .says(K_1, C_d * W * x_max * sqrt(2 * dP1 / rho) / u_max, gamma_1 * x_max / u_max)
    .by(Ground("(3)", ((K_e, K_1), (dP, dP1))), "gamma_1")
    .within(FIXED_OPENING)
    .qualified_by("T7a", "T7c")
    .remark("The published largest flows grow far more slowly with $dP$: T7a."),
    Kind.PAPER("(16)", "wanted flow off the reference")
    .says(Q_O_prime, K_1 * u_i)
    .rearranging(
        Ground("Fig. 3, line", ((Q_w, Q_O_prime), (Q_max, Q_max1))),
        Ground("(2)", ((K_e, K_1), (Q_max, Q_max1))),
        eliminate=(Q_max1,),
    )
    .qualified_by("T1c", "T1d")
    .remark(
        "As a target. Fig. 3 draws the line at the reference; (16) takes it to hold at $dP1$ too. As a claim "
        "about the valve under Eq. (18) it does not follow: T1c."
    ),
    Kind.PAPER("(17)", "compensation signal off the reference")
    .says(u_no, beta * u_0, beta * (k * x_max / u_max - 1) * u_i + beta * u_min0)
    .by("(6)", "(13)")
    .within(LAW_OFF_REFERENCE),
    Kind.PAPER("(18)", "law off the reference")
    .says(u_O, u_no + u_i, (beta * k * x_max / u_max - beta + 1) * u_i + beta * u_min0)
    .by(Ground("u_O", ((u_0, u_no),)), "(17)")
    .within(LAW_OFF_REFERENCE)
    .qualified_by("T1b", "T1c", "T3a", "T4a")
    .remark("Printed with $u_0$ on the left, which is the output $u_O$."),
)
