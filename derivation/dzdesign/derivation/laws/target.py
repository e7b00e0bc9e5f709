"""The law that meets the paper's target, Eq. (16): only the threshold is corrected, not the gain."""

from dzdesign.derivation.account.scope import TARGET_OFF_REFERENCE
from dzdesign.derivation.account.statement import Kind
from dzdesign.derivation.law import Law
from dzdesign.derivation.symbols import beta, k, u_i, u_max, u_min0, u_O, x_max

_OUTPUT = k * x_max / u_max * u_i + beta * u_min0
_NOTE = (
    "Gain of Eq. (14), offset of Eq. (18): its flow is the target (16) exactly wherever "
    "beta u_min0 is the threshold. For beta < 1 and k x_max < u_max it gives less flow at full command "
    "than Eq. (18), as long as the spool can open further than x_max."
)

LAW = Law(
    name="target",
    equation="from (16)",
    output=_OUTPUT,
    note=_NOTE,
    stated_as="T1d",
    statements=(
        Kind.CHOICE("L3", "the law `target`", u_O, _OUTPUT, scope=TARGET_OFF_REFERENCE, see=("T1d", "T1e"), note=_NOTE),
    ),
)
