"""The paper's law, Eq. (18): the whole compensation signal times beta."""

import sympy

from dzdesign.derivation.account.scope import LAW_OFF_REFERENCE, under_law
from dzdesign.derivation.account.statement import Case, Ground, Kind
from dzdesign.derivation.law import Law
from dzdesign.derivation.symbols import above, below, beta, dP, dP0, dP1, k, u_0, u_i, u_max, u_min0, u_no, u_O, x_max

_OUTPUT = (beta * (k * x_max / u_max - 1) + 1) * u_i + beta * u_min0

LAW = Law(
    name="paper",
    equation="(18)",
    output=_OUTPUT,
    rises_if=beta * (1 - k * x_max / u_max) < 1,
    note="Eq. (18); Eq. (14) is its case $beta = 1$, which the selector (7) holds for $dP <= dP0$. Off the reference "
    "its flow is the target (16) exactly where full command is the limit (T2d). Where a stop fixes $x_max$ it "
    "exceeds the target by $gamma_1$ (1 - $beta$) (1 - $k x_max/u_max$) $u_i / k$ (T1b).",
    stated_as="(18)",
    statements=(
        Kind.LAW("L1", "the law `paper` is Eq. (18)").says(u_O, _OUTPUT).rearranging("(18)").within(LAW_OFF_REFERENCE),
        Kind.LAW("L2", "the selector gives the law `paper`, at $beta = 1$ up to $dP0$: Eq. (14)")
        .says(u_O, sympy.Piecewise((_OUTPUT, dP1 > dP0), (_OUTPUT.subs(beta, 1), dP1 <= dP0)))
        .by(Ground("u_O", ((u_0, u_no),)), "(7)", "(13)")
        .within(under_law("paper"), sympy.Eq(dP, dP1))
        .in_cases(Case(((dP1, dP0 - below),), "$dP <= dP0$"), Case(((dP1, dP0 + above),), "$dP > dP0$")),
    ),
)
