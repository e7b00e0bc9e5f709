"""The tables of beta as rows of C: start and change of each segment, and the types that hold them."""

from dataclasses import dataclass
from itertools import pairwise

from dzdesign.codegen.core.integer_form import IntegerForm


@dataclass(frozen=True, slots=True, kw_only=True)
class TableForm:
    """How the rows of a table stand in C: the changes' sign, and their type."""

    change_sign: str
    change_type: str

    @property
    def falls(self) -> bool:
        """True if the C subtracts the changes."""
        return self.change_sign == "-"

    @property
    def short(self) -> bool:
        """True if a product with a change is one of 16 by 16 bits."""
        return self.change_type == "uint16_t"


def table_form(form: IntegerForm, step: int, arithmetic: str) -> TableForm:
    """Choose the rows: signed where products of 32 bits are cheap, of one direction in 16 bits else."""
    changes = [change for table in (form.table, form.zero_table) for _, change in segments_of(table, step)]
    falls = max(changes) <= 0
    short = (falls or min(changes) >= 0) and max(map(abs, changes)) < 1 << 16
    if arithmetic == "narrow" and short:
        return TableForm(change_sign="-" if falls else "+", change_type="uint16_t")
    return TableForm(change_sign="+", change_type="int32_t")


def segments_of(table: tuple[int, ...], step: int) -> list[tuple[int, int]]:
    """Return (start, slope) of each segment, ``start + slope * dp``: the fallback first, then one a node.

    Between nodes n and n + 1 the table times `step` is ``T[n] step + (T[n+1] - T[n]) (dp - n step)``.
    """
    if not table:
        return []
    pairs = pairwise(table[:-2])
    return [
        (table[-1] * step, 0),
        *((left * step - (right - left) * node * step, right - left) for node, (left, right) in enumerate(pairs)),
    ]
