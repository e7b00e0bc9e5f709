"""What ties the law of `law.py` to the paper's equations, and what the paper does not say."""

import sympy

from dzdesign.derivation.law import law
from dzdesign.derivation.proof import Equation, Ground, Kind
from dzdesign.derivation.symbols import (
    K_1,
    Q,
    Q_neg,
    Q_O_prime,
    above,
    below,
    beta,
    dP,
    dP0,
    dP1,
    f,
    gamma_1,
    guard,
    headroom,
    k,
    u_0,
    u_i,
    u_i_prime,
    u_max,
    u_min,
    u_min0,
    u_min1,
    u_no,
    u_O,
    x,
    x_max,
)

_PAPER_LAW = law("paper")
_TARGET_LAW = law("target")

_TIES = (
    Equation(
        number="L1",
        title="the law `paper` is Eq. (18)",
        kind=Kind.LAW,
        symbol=u_O,
        members=(_PAPER_LAW.output,),
        grounds=(Ground(number="(18)"),),
    ),
    Equation(
        number="L2",
        title="the law `paper` at beta = 1 is Eq. (14)",
        kind=Kind.LAW,
        symbol=u_O,
        members=(_PAPER_LAW.output.subs(beta, 1),),
        grounds=(Ground(number="(14)"),),
    ),
    Equation(
        number="L3",
        title="the selector gives the law `paper` at beta = 1 up to dP0",
        kind=Kind.LAW,
        symbol=u_O,
        members=(_PAPER_LAW.output.subs(beta, 1),),
        grounds=(
            Ground(number="u_O", at=((u_0, u_no),), where="with u_no for u_0"),
            Ground(number="(7)", at=((dP1, dP0 - below),), where="at dP1 <= dP0"),
            Ground(number="(13)"),
        ),
        eliminate=(u_no, u_0),
    ),
    Equation(
        number="L4",
        title="the selector gives the law `paper` above dP0",
        kind=Kind.LAW,
        symbol=u_O,
        members=(_PAPER_LAW.output,),
        grounds=(
            Ground(number="u_O", at=((u_0, u_no),), where="with u_no for u_0"),
            Ground(number="(7)", at=((dP1, dP0 + above),), where="at dP1 > dP0"),
            Ground(number="(13)"),
        ),
        eliminate=(u_no, u_0),
    ),
    Equation(
        number="L5",
        title="the law `target`",
        kind=Kind.CHOICE,
        symbol=u_O,
        members=(_TARGET_LAW.output,),
        note=_TARGET_LAW.note,
    ),
)


def _flow_at_dP1(law_number: str) -> tuple[Ground, ...]:
    """What gives the valve's flow at dP1 under a law, and the target (16) in the same symbols."""
    return (
        Ground(number=law_number),
        Ground(number="(5)"),
        Ground(number="Fig. 3, command", at=((u_min0, u_min1),), where="at dP = dP1"),
        Ground(number="(11)"),
        Ground(
            number="(1)",
            at=(
                (dP, dP1),
                (u_i, u_min1 + u_i_prime),
                (u_min, u_min1),
                (u_max, u_min1 + u_i_prime + headroom),
            ),
            where="at dP = dP1, beyond the threshold",
        ),
        Ground(number="gamma_1"),
        Ground(number="(15)"),
        Ground(number="(16)"),
    )


_FLOW_UNKNOWNS = (u_O, u_min1, u_i_prime, x, gamma_1, K_1, Q_O_prime)

_BEYOND = (
    Equation(
        number="B1",
        title="at zero command the output stands at the threshold of the present pressure drop",
        kind=Kind.BEYOND,
        symbol=u_O,
        members=(f(dP1),),
        grounds=(
            Ground(number="(18)", at=((u_i, sympy.S.Zero),), where="at u_i = 0"),
            Ground(number="(5)"),
            Ground(number="(4)", at=((u_min, u_min0), (dP, dP0)), where="at dP = dP0"),
            Ground(number="(4)", at=((u_min, u_min1), (dP, dP1)), where="at dP = dP1"),
        ),
        eliminate=(beta, u_min0, u_min1),
        note="Nothing is left for an error of the threshold: a design needs a guard.",
    ),
    Equation(
        number="B2",
        title="with a guard below the threshold, zero command passes no flow",
        kind=Kind.BEYOND,
        symbol=Q,
        members=(sympy.S.Zero,),
        grounds=(
            Ground(
                number="(1)",
                at=(
                    (u_i, _PAPER_LAW.offset),
                    (u_min, _PAPER_LAW.offset + guard),
                    (u_max, _PAPER_LAW.offset + guard + headroom),
                ),
                where="at the law's output for u_i = 0, the threshold above it by the guard",
            ),
        ),
        note="Both laws have this offset.",
    ),
    Equation(
        number="B3",
        title="the opposite command gives the opposite flow",
        kind=Kind.BEYOND,
        symbol=Q_neg,
        members=(-Q,),
        grounds=(
            Ground(
                number="(1)",
                at=((u_i, u_min + u_i_prime), (u_max, u_min + u_i_prime + headroom)),
                where="at u_min + u_i'",
            ),
            Ground(
                number="(1)",
                at=((Q, Q_neg), (u_i, -u_min - u_i_prime), (u_max, u_min + u_i_prime + headroom)),
                where="at -(u_min + u_i')",
            ),
        ),
        eliminate=(Q,),
        note="So the law for negative commands is the mirror image, with its own parameters.",
    ),
    Equation(
        number="B4",
        title="the law `target` meets the target (16)",
        kind=Kind.BEYOND,
        symbol=Q,
        members=(Q_O_prime,),
        grounds=_flow_at_dP1("L5"),
        eliminate=_FLOW_UNKNOWNS,
    ),
    Equation(
        number="B5",
        title="Eq. (18) does not meet the target (16): its flow is",
        kind=Kind.BEYOND,
        symbol=Q,
        members=(
            Q_O_prime + gamma_1 * (1 - beta) * (1 - k * x_max / u_max) * u_i / k,
            Q_O_prime * (beta + (1 - beta) * u_max / (k * x_max)),
        ),
        grounds=_flow_at_dP1("(18)"),
        eliminate=_FLOW_UNKNOWNS,
        note="Above the target for beta < 1 and k x_max < u_max; on it only if beta = 1 or k x_max = u_max.",
    ),
)

THEOREMS = _TIES + _BEYOND
