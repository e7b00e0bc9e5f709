"""Eqs. (3), (8)-(10) and (12)-(18), transcribed once, each with the premises from which it is to follow.

`EQUATIONS` is the whole argument in an order in which each statement stands after those it rests on.
"""

from collections.abc import Sequence

import sympy

from dzdesign.derivation.premises import PREMISES
from dzdesign.derivation.proof import Equation, Ground, Kind, Verdict, prove
from dzdesign.derivation.symbols import (
    K_0,
    K_1,
    Q_O,
    C_d,
    K_e,
    Q,
    Q_max,
    Q_O_prime,
    W,
    beta,
    dP,
    dP0,
    dP1,
    gamma_0,
    gamma_1,
    headroom,
    k,
    rho,
    u_0,
    u_i,
    u_i_prime,
    u_max,
    u_min,
    u_min0,
    u_no,
    u_O,
    x,
    x_max,
)
from dzdesign.derivation.theorems import THEOREMS

_AT_REFERENCE = (
    Equation(
        number="Q_max",
        title="maximum flow (text below Eq. 2)",
        kind=Kind.PAPER,
        symbol=Q_max,
        members=(C_d * W * x_max * sympy.sqrt(2 * dP / rho),),
        grounds=(
            Ground(
                number="(1)",
                at=((Q, Q_max), (x, x_max), (u_max, u_min + headroom), (u_i, u_min + headroom)),
                where="at full command, x = x_max",
            ),
        ),
    ),
    Equation(
        number="(3)",
        title="flow gain by the orifice equation",
        kind=Kind.PAPER,
        symbol=K_e,
        members=(C_d * W * x_max * sympy.sqrt(2 * dP / rho) / u_max,),
        grounds=(Ground(number="(2)"), Ground(number="Q_max")),
        eliminate=(Q_max,),
    ),
    Equation(
        number="(8)",
        title="flow gain at the reference",
        kind=Kind.PAPER,
        symbol=K_0,
        members=(C_d * W * x_max * sympy.sqrt(2 * dP0 / rho) / u_max, gamma_0 * x_max / u_max),
        grounds=(
            Ground(number="(3)", at=((K_e, K_0), (dP, dP0)), where="at dP = dP0"),
            Ground(number="gamma_0"),
        ),
        eliminate=(gamma_0,),
    ),
    Equation(
        number="(9)",
        title="wanted flow at the reference",
        kind=Kind.PAPER,
        symbol=Q_O,
        members=(K_0 * u_i,),
        grounds=(Ground(number="Fig. 3, line"), Ground(number="(2)", at=((K_e, K_0),), where="at dP = dP0")),
        eliminate=(Q_max,),
    ),
    Equation(
        number="(10)",
        title="opening that passes the wanted flow",
        kind=Kind.PAPER,
        symbol=x,
        members=(Q_O / (C_d * W * sympy.sqrt(2 * dP0 / rho)),),
        grounds=(
            Ground(
                number="(1)",
                at=(
                    (Q, Q_O),
                    (dP, dP0),
                    (u_i, u_min0 + u_i_prime),
                    (u_min, u_min0),
                    (u_max, u_min0 + u_i_prime + headroom),
                ),
                where="at dP = dP0, beyond the threshold",
            ),
        ),
    ),
    Equation(
        number="(12)",
        title="compensation signal in Fig. 3",
        kind=Kind.PAPER,
        symbol=u_0,
        members=(u_i_prime + u_min0 - u_i,),
        grounds=(Ground(number="Fig. 3, command"), Ground(number="u_O")),
        eliminate=(u_O,),
    ),
    Equation(
        number="(13)",
        title="compensation signal at the reference",
        kind=Kind.PAPER,
        symbol=u_0,
        members=((k * x_max / u_max - 1) * u_i + u_min0,),
        grounds=tuple(Ground(number=number) for number in ("(8)", "gamma_0", "(9)", "(10)", "(11)", "(12)")),
        eliminate=(K_0, gamma_0, Q_O, x, u_i_prime),
    ),
    Equation(
        number="(14)",
        title="law at the reference",
        kind=Kind.PAPER,
        symbol=u_O,
        members=(u_0 + u_i, k * x_max / u_max * u_i + u_min0),
        grounds=(Ground(number="u_O"), Ground(number="(13)")),
        eliminate=(u_0,),
        note="Printed with u_0 on the left, which is the output u_O.",
    ),
)

_OFF_REFERENCE = (
    Equation(
        number="(15)",
        title="flow gain off the reference",
        kind=Kind.PAPER,
        symbol=K_1,
        members=(C_d * W * x_max * sympy.sqrt(2 * dP1 / rho) / u_max, gamma_1 * x_max / u_max),
        grounds=(
            Ground(number="(3)", at=((K_e, K_1), (dP, dP1)), where="at dP = dP1"),
            Ground(number="gamma_1"),
        ),
        eliminate=(gamma_1,),
    ),
    Equation(
        number="(16)",
        title="wanted flow off the reference",
        kind=Kind.PAPER,
        symbol=Q_O_prime,
        members=(K_1 * u_i,),
        grounds=(
            Ground(number="Fig. 3, line", at=((Q_O, Q_O_prime),), where="at dP = dP1"),
            Ground(number="(2)", at=((K_e, K_1),), where="at dP = dP1"),
        ),
        eliminate=(Q_max,),
        note="Fig. 3 draws the line at the reference; (16) takes it to hold at dP1 too, as the target. "
        "The flow that Eq. (18) gives there is another: see B5.",
    ),
    Equation(
        number="(17)",
        title="compensation signal off the reference",
        kind=Kind.PAPER,
        symbol=u_no,
        members=(beta * u_0, beta * (k * x_max / u_max - 1) * u_i + beta * u_min0),
        grounds=(Ground(number="(6)"), Ground(number="(13)")),
        eliminate=(u_0,),
    ),
    Equation(
        number="(18)",
        title="law off the reference",
        kind=Kind.PAPER,
        symbol=u_O,
        members=(u_no + u_i, (beta * k * x_max / u_max - beta + 1) * u_i + beta * u_min0),
        grounds=(Ground(number="u_O", at=((u_0, u_no),), where="with u_no for u_0"), Ground(number="(17)")),
        eliminate=(u_no,),
        note="Printed with u_0 on the left, which is the output u_O.",
    ),
)

EQUATIONS = PREMISES + _AT_REFERENCE + _OFF_REFERENCE + THEOREMS


def verify_equations(equations: Sequence[Equation] = EQUATIONS) -> tuple[Verdict, ...]:
    """Derive each equation from the premises that it names.

    Parameters
    ----------
    equations : sequence of Equation, optional
        Statements, each after those it rests on.

    Returns
    -------
    tuple of Verdict
        One per statement, in order.

    Raises
    ------
    RequirementError
        If the premises of a statement are circular or missing.

    Examples
    --------
    >>> all(verdict.holds for verdict in verify_equations())
    True
    """
    return prove(equations)
