"""The law that meets the paper's target, Eq. (16): only the threshold is corrected, not the gain."""

from dzdesign.derivation.account.scope import TARGET_OFF_REFERENCE
from dzdesign.derivation.account.statement import Kind
from dzdesign.derivation.law import Law
from dzdesign.derivation.symbols import beta, k, u_i, u_max, u_min0, u_O, x_max

_OUTPUT = k * x_max / u_max * u_i + beta * u_min0
_NOTE = (
    "Gain of Eq. (14), offset of Eq. (18): its flow is the target (16) exactly where a stop fixes $x_max$ and $beta "
    "u_min0$ is the threshold (T1d). Where full command is the limit it loses (1 - $beta$) $u_min0$ / ($u_max - beta "
    "u_min0$) of the flow off the reference (T2e)."
)

LAW = Law(
    name="target",
    equation="from (16)",
    output=_OUTPUT,
    note=_NOTE,
    stated_as="T1d",
    statements=(
        Kind.CHOICE("L3", "the law `target`")
        .says(u_O, _OUTPUT)
        .within(TARGET_OFF_REFERENCE)
        .qualified_by("T1d", "T1e", "T2e")
        .remark(_NOTE),
    ),
)
