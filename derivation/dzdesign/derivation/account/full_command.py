"""Theorem 2: full command, as far as a stop lets it, and where it is the limit itself."""

import sympy

from dzdesign.derivation.account.published import FIRST, SECOND, SIMULATION
from dzdesign.derivation.account.scope import (
    AT_FULL_COMMAND,
    BARE,
    EDGE,
    FREE_OPENING,
    LAW_OFF_REFERENCE,
    TARGET_OFF_REFERENCE,
    scope,
)
from dzdesign.derivation.account.statement import Case, Condition, Ground, Kind, Outcome, Value
from dzdesign.derivation.account.target_flow import flow_under
from dzdesign.derivation.symbols import *

_FULL_COMMAND_IS_THE_LIMIT = scope(FREE_OPENING)

#: Theorem 2: full command.
FULL_COMMAND = (
    Kind.THEOREM(
        "T2a",
        "output of the law (18) at full command",
        u_O,
        u_max + beta * (k * x_max + u_min0 - u_max),
        scope=LAW_OFF_REFERENCE & AT_FULL_COMMAND,
        grounds=(Ground("(18)", ((u_i, u_max),)),),
    ),
    Kind.THEOREM(
        "T2b",
        "full command gives full drive at every pressure drop",
        u_O,
        u_max,
        scope=LAW_OFF_REFERENCE & AT_FULL_COMMAND,
        grounds=("T2a",),
        condition=Condition(
            any_of=((sympy.Eq(k * x_max, u_max - u_min0),),),
            for_all=(beta,),
            discrepancy=beta * (k * x_max + u_min0 - u_max),
        ),
        expected=Outcome.FOLLOWS_IF,
        note="With less travel, as where the spool meets its stop at 8-8.5 V (section 4.2), full command asks for less "
        "than full drive; with more, for drive that is not there.",
    ),
    Kind.ASSUMPTION(
        "opening",
        "opening on both sides of the threshold",
        x,
        sympy.Piecewise(((u_O - u_min) / k, u_min <= u_O), (0, u_O < u_min)),
        scope=EDGE,
        note="Eq. (11) with Fig. 3 beyond the threshold; closed before it, as Eq. (1) says.",
    ),
    Kind.THEOREM(
        "largest flow",
        "largest flow at $dP1$ without compensator",
        Q_max1,
        gamma_1 * (u_max - u_min1) / k,
        scope=scope(BARE, FREE_OPENING, sympy.Eq(dP, dP1), u_min1 <= u_max) & AT_FULL_COMMAND,
        grounds=(
            Ground("(1)", ((Q, Q_max1), (dP, dP1), (u_min, u_min1), (u_i, u_max))),
            Ground("opening", ((u_O, u_max), (u_min, u_min1))),
            "gamma_1",
        ),
        eliminate=(x, gamma_1),
        cases=(Case(((u_max, u_min1 + headroom),), ""),),
        note="As long as the spool has not met its stop.",
    ),
    Kind.ASSUMPTION(
        "full command",
        "$x_max$ is the opening that full command gives at $dP0$",
        x_max,
        (u_max - u_min0) / k,
        scope=_FULL_COMMAND_IS_THE_LIMIT,
        see=("T2b",),
        note="The condition under which 1.048 and 1.018 (T1b) are computed. Without a stop, full command then opens "
        "the valve further at $dP1$, where its threshold is lower.",
    ),
    Kind.THEOREM(
        "T2c",
        "largest flow off the reference where full command is the limit",
        Q_max1,
        gamma_1 * (u_max - beta * u_min0) / k,
        scope=_FULL_COMMAND_IS_THE_LIMIT,
        grounds=("largest flow", "(5)"),
        eliminate=(u_min1,),
        note="More than $gamma_1 x_max$, the flow of Assumption 3, wherever $beta < 1$.",
    ),
    Kind.THEOREM(
        "T2d",
        "where full command is the limit, the law (18) gives the line to the largest flow, and so the target (16)",
        Q,
        Q_max1 * u_i / u_max,
        Q_O_prime,
        scope=LAW_OFF_REFERENCE & _FULL_COMMAND_IS_THE_LIMIT,
        grounds=(
            *flow_under("(18)", u_min1, dP1),
            *("(5)", "gamma_1", "T2c", "full command", "(16)"),
            Ground("(2)", ((K_e, K_1), (Q_max, Q_max1))),
        ),
        eliminate=(x, u_i_prime, u_O, u_min1, gamma_1, Q_max1, x_max, K_1, Q_O_prime),
        see=("T1c", "T2e"),
        note="The other reading of (6): Eq. (18) is the right law of Fig. 3 as long as full command is the limit. "
        "With a stop that fixes $x_max$ it overshoots: T1b, T1c.",
    ),
    Kind.THEOREM(
        "T2e",
        "where full command is the limit, the law `target` falls short of the target (16)",
        Q,
        Q_O_prime * (u_max - u_min0) / (u_max - beta * u_min0),
        scope=TARGET_OFF_REFERENCE & _FULL_COMMAND_IS_THE_LIMIT,
        grounds=(
            *flow_under("L3", u_min1, dP1),
            *("(5)", "gamma_1", "T2c", "full command", "(16)"),
            Ground("(2)", ((K_e, K_1), (Q_max, Q_max1))),
        ),
        eliminate=(x, u_i_prime, u_O, u_min1, gamma_1, Q_max1, x_max, K_1, Q_O_prime),
        see=("T1d", "T1e"),
        values=tuple(
            Value(
                f"flow lost, {valve.name}",
                of=1 - (u_max - u_min0) / (u_max - beta * u_min0),
                at=valve.at(),
                unit="%",
            )
            for valve in (FIRST, SIMULATION, SECOND)
        ),
        note="At every command, full command included. The correction (6c) is right only where a stop fixes $x_max$ "
        "(T1d).",
    ),
)
