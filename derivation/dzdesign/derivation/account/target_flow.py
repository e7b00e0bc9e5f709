"""What ties the laws to the paper's equations, and theorem 1: which flow they give."""

import sympy

from dzdesign.derivation.account.published import FIRST, SECOND, VALVES
from dzdesign.derivation.account.scope import (
    AT_FULL_COMMAND,
    BEFORE_STOP,
    FIXED_OPENING,
    LAW_AT_REFERENCE,
    LAW_OFF_REFERENCE,
    TARGET_OFF_REFERENCE,
    scope,
)
from dzdesign.derivation.account.statement import Condition, Ground, Kind, Outcome, Value
from dzdesign.derivation.law import law
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.derivation.symbols import *

_DRIVE_LEFT_OVER = "with $k x_max = u_max - u_min0$, the command left above the threshold"

#: What the laws are in the paper's terms.
TIES = tuple(statement for name in LAW_NAMES for statement in law(name).statements)


def flow_under(law_number: str, threshold: sympy.Symbol, pressure: sympy.Symbol) -> tuple[Ground, ...]:
    """What gives the valve's flow under a law, beyond the threshold at one pressure drop."""
    return (
        Ground(
            "(1)",
            (
                (dP, pressure),
                (u_i, threshold + u_i_prime),
                (u_min, threshold),
                (u_max, threshold + u_i_prime + headroom),
            ),
        ),
        Ground("(11)"),
        Ground("Fig. 3, command", ((u_min0, threshold),)),
        Ground(law_number),
    )


_PAPER_LAW = LAW_OFF_REFERENCE & scope(FIXED_OPENING) & BEFORE_STOP
_TARGET_LAW = TARGET_OFF_REFERENCE & scope(FIXED_OPENING)
_AT_DP1 = (Ground("(5)"), Ground("gamma_1"), Ground("(15)"), Ground("(16)"))
_UNKNOWN_AT_DP1 = (x, u_i_prime, u_O, u_min1, gamma_1, K_1, Q_O_prime)

#: Theorem 1: which flow the laws give.
TARGET = (
    Kind.THEOREM(
        "T1a",
        "at the reference the law (14) gives the wanted flow (9)",
        Q,
        Q_O,
        scope=LAW_AT_REFERENCE,
        grounds=(*flow_under("(14)", u_min0, dP0), *(Ground(number) for number in ("(9)", "(8)", "gamma_0"))),
        eliminate=(x, u_i_prime, u_O, Q_O, K_0, gamma_0),
    ),
    Kind.THEOREM(
        "T1b",
        "flow that the law (18) gives off the reference",
        Q,
        Q_O_prime + gamma_1 * (1 - beta) * (1 - k * x_max / u_max) * u_i / k,
        Q_O_prime * (beta + (1 - beta) * u_max / (k * x_max)),
        scope=_PAPER_LAW,
        grounds=(*flow_under("(18)", u_min1, dP1), *_AT_DP1),
        eliminate=_UNKNOWN_AT_DP1,
        values=tuple(
            Value(
                f"flow over the target, {valve.name}",
                of=beta + (1 - beta) * u_max / (k * x_max),
                at=valve.at(),
                unit="1",
            )
            for valve in VALVES
        ),
        note=f"Above the target wherever $beta < 1$ and $k x_max < u_max$. The numbers: {_DRIVE_LEFT_OVER}.",
    ),
    Kind.THEOREM(
        "T1c",
        "the law (18) meets the target (16)",
        Q,
        Q_O_prime,
        scope=_PAPER_LAW,
        grounds=(*flow_under("(18)", u_min1, dP1), *_AT_DP1),
        eliminate=_UNKNOWN_AT_DP1,
        condition=Condition(
            any_of=((sympy.Eq(beta, 1),), (sympy.Eq(k * x_max, u_max),)),
            for_all=(u_i,),
            ruled_out_by=tuple((name, value) for name, value in FIRST.at() if name in (u_max, beta, k)),
            discrepancy=C_d * W * sympy.sqrt(2 * dP1 / rho) * (1 - beta) * (1 - k * x_max / u_max) * u_i / k,
        ),
        expected=Outcome.DOES_NOT_FOLLOW,
        corrected_by="T1d",
        see=("T2d",),
        note="Where a stop fixes $x_max$. Where full command is the limit it follows, for then the target ends at "
        "the largest flow that full command gives: T2d.",
    ),
    Kind.THEOREM(
        "T1d",
        "the law `target` meets the target (16)",
        Q,
        Q_O_prime,
        scope=_TARGET_LAW,
        grounds=(*flow_under("L3", u_min1, dP1), *_AT_DP1),
        eliminate=_UNKNOWN_AT_DP1,
    ),
    Kind.DEFINITION("drive left", "drive that is not used", drive_left, u_max - u_O),
    Kind.THEOREM(
        "T1e",
        "drive that the law `target` leaves unused at full command",
        drive_left,
        u_max - k * x_max - beta * u_min0,
        scope=TARGET_OFF_REFERENCE & AT_FULL_COMMAND,
        rearranges=True,
        grounds=("drive left", Ground("L3", ((u_i, u_max),))),
        eliminate=(u_O,),
        values=tuple(Value(f"at 5 MPa, {valve.name}", valve.at(), "V") for valve in (FIRST, SECOND)),
        note="(1 - $beta$) $u_min0$ where $k x_max = u_max - u_min0$: the target asks for $x_max$ and not for more, "
        "though at a lower threshold the same command could open further. In flow it is what T1b gives above the "
        "target.",
    ),
    Kind.CORRECTED(
        "(6c)",
        "compensation signal that meets the target (16) where a stop fixes $x_max$, what (6) should read",
        u_no,
        u_0 - (1 - beta) * u_min0,
        scope=_TARGET_LAW,
        grounds=(
            Ground("u_O", ((u_0, u_no),)),
            Ground("Fig. 3, command", ((u_min0, u_min1),)),
            "(11)",
            Ground("(10)", ((Q_O, Q_O_prime), (dP0, dP1))),
            "(16)",
            "(15)",
            "gamma_1",
            "(5)",
            "(13)",
        ),
        eliminate=(u_O, u_i_prime, x, Q_O_prime, K_1, gamma_1, u_min1, u_0),
        see=("T2d", "T2e"),
        note="Only the threshold is corrected, not the gain: this is the law `target`. One of two readings: where full "
        "command is the limit, (6) itself meets the target (T2d) and this one loses flow (T2e).",
    ),
)
