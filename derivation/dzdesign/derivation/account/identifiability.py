"""Theorem 8: what a measurement of the flow can tell about a valve, and what it cannot."""

from sympy import Ne, Piecewise

from dzdesign.derivation.account.equations import ORIFICE
from dzdesign.derivation.account.scope import BEYOND_THRESHOLD, FIXED_OPENING, FULL_STROKE
from dzdesign.derivation.account.statement import Case, Ground, Kind
from dzdesign.derivation.symbols import *

_REGIMES = (
    Case(((u_O, u_min - guard),), "closed"),
    Case(((u_O, u_min + y), (x_max, (y + rest) / k)), "opening"),
    Case(((u_O, u_min + k * x_max + headroom),), "at the stop"),
)
#: Theorem 8: what can be identified from flow.
IDENTIFIABILITY = (
    Kind.ASSUMPTION("valve", "flow of a valve with a threshold and a stop")
    .says(
        Q,
        Piecewise(
            (0, u_O < u_min),
            (ORIFICE * (u_O - u_min) / k, u_O < u_min + k * x_max),
            (ORIFICE * x_max, u_min + k * x_max <= u_O),
        ),
    )
    .within(FULL_STROKE)
    .remark("Eqs. (1) and (11) up to the stop, for positive commands."),
    Kind.THEOREM("T8a", "the flow is the same for $C_d lambda$, $k lambda$ and $x_max / lambda$")
    .says(Q_scaled, Q)
    .by("valve", Ground("valve", ((Q, Q_scaled), (C_d, scale * C_d), (k, scale * k), (x_max, x_max / scale))))
    .within(FULL_STROKE)
    .in_cases(*_REGIMES)
    .remark(
        "At every command and pressure drop, so no set of flow measurements tells these valves apart; nor "
        "$C_d$, $W$ and $rho$, which enter as one product."
    ),
    Kind.THEOREM("T8b", "the sensitivity to $C_d$ is a combination of those to $k$ and $x_max$")
    .says(dQ_dC_d, (x_max * dQ_dx_max - k * dQ_dk) / C_d)
    .by(
        Ground("valve", derivative=(C_d, dQ_dC_d)),
        Ground("valve", derivative=(k, dQ_dk)),
        Ground("valve", derivative=(x_max, dQ_dx_max)),
    )
    .within(FULL_STROKE, Ne(u_O, u_min + k * x_max))
    .in_cases(*_REGIMES)
    .remark(
        "So ($C_d$, $k$, -$x_max$) is a null direction of the sensitivity matrix: its product with every row is "
        "zero, however many commands and pressure drops are measured."
    ),
    Kind.DEFINITION("S", "flow per command beyond the threshold").says(s_flow, ORIFICE / k),
    Kind.DEFINITION("travel", "command that full opening takes").says(q_x, k * x_max),
    Kind.THEOREM("T8c", "the flow depends on $S$, $u_min$ and $k x_max$ only")
    .says(
        Q,
        Piecewise((0, u_O < u_min), (s_flow * (u_O - u_min), u_O < u_min + q_x), (s_flow * q_x, u_min + q_x <= u_O)),
    )
    .by("valve", "S", "travel")
    .within(FULL_STROKE)
    .in_cases(*_REGIMES),
    Kind.THEOREM("straight part", "flow beyond the threshold")
    .says(Q, s_flow * (u_O - u_min))
    .by(Ground("(1)", ((u_i, u_min + y), (u_max, u_min + y + headroom))), "opening", "S")
    .within(BEYOND_THRESHOLD)
    .in_cases(Case(((u_O, u_min + y),), "beyond the threshold, before the stop")),
    Kind.THEOREM("T8d", "$S$ from two samples on the straight part")
    .says(s_flow, (Q_2 - Q_1) / (u_2 - u_1))
    .by(
        Ground("straight part", ((Q, Q_2), (u_O, u_2))),
        Ground("straight part", ((Q, Q_1), (u_O, u_1))),
        eliminate=(u_min,),
        provided=(Ne(u_1, u_2),),
    )
    .remark("With T8e and T8f: these three are determined, and by T8b nothing else is."),
    Kind.THEOREM("T8e", "$u_min$ from the same two samples")
    .says(u_min, u_1 - Q_1 / s_flow, u_1 - Q_1 * (u_2 - u_1) / (Q_2 - Q_1))
    .by(Ground("straight part", ((Q, Q_1), (u_O, u_1))), "T8d", eliminate=(s_flow,)),
    Kind.THEOREM("T8f", "$k x_max$ from a sample at the stop")
    .says(q_x, Q_max / s_flow)
    .by(Ground("T8c", ((Q, Q_max), (u_O, u_min + q_x + headroom))))
    .within(FIXED_OPENING)
    .remark(
        "Without such a sample $k x_max$ is only known to be larger than the largest command beyond the "
        "threshold. Where $x_max$ is known otherwise, $k$ = ($k x_max$) / $x_max$."
    ),
)
