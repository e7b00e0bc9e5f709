"""The constants of dz_comp.m: those of the C, each with the same comment, as integers of MATLAB."""

from collections.abc import Iterator, Sequence
from textwrap import wrap

from dzdesign.codegen.core.integer_form import IntegerForm
from dzdesign.codegen.matlab.law_constants import LawConstants, Named
from dzdesign.codegen.matlab.signal_constants import SignalConstants
from dzdesign.core.errors import DzdesignError
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import SIDE_NAMES

#: Longest line of a comment, without the template's indent.
COLUMNS = 112
#: Nodes of a table in a line.
TABLE_COLUMNS = 8
#: Whole numbers beyond this are not exact where MATLAB reads them, as doubles.
EXACT_DOUBLE = 2**53
#: Second operands of a shift: doubles.
SHIFTS = ("STEP_SHIFT", "WEIGHT_SHIFT", "SUM_SHIFT", "RECIPROCAL_SHIFT", "BETA_SHIFT")


def signal_constants(compensator: Compensator, sign: int) -> list[Named]:
    """Return what a code of command and pressures stands for."""
    return SignalConstants(compensator=compensator, sign=sign).signals()


def step_constants(compensator: Compensator, sign: int) -> list[Named]:
    """Return what finds a node, and the transition's length."""
    return SignalConstants(compensator=compensator, sign=sign).steps()


def law_constants(compensator: Compensator, form: IntegerForm, sign: int) -> list[Named]:
    """Return the law's integers."""
    return LawConstants(compensator=compensator, form=form, sign=sign).arithmetic()


def constant_lines(constants: Sequence[Named], kind: str) -> list[str]:
    """Return constants with their comments; `kind` is the class of those that shift nothing."""
    return [line for each in constants for line in (*_comment(each), _assignment(each, kind))]


def table_lines(compensator: Compensator, form: IntegerForm, sign: int) -> list[str]:
    """Return the tables of beta at its nodes, and the smallest beta."""
    lines = list(_table(compensator, form, sign, form.table, "LAW", "law"))
    if form.zero_table:
        guard = compensator.side(sign).certificate.guard
        lines += _table(compensator, form, sign, form.zero_table, "ZERO", f"{guard} threshold, certified")
    return lines


def matlab_integer(value: int, kind: str) -> str:
    """Return a number as an integer of a class, exact where it is read: one of 64 bits as odd part and power of two.

    Examples
    --------
    >>> matlab_integer(-12, "int32")
    'int32(-12)'
    >>> matlab_integer(3 * 2**60, "int64")
    'int64(3) * int64(2^60)'
    """
    if abs(value) < EXACT_DOUBLE:
        return f"{kind}({value})"
    shift = (value & -value).bit_length() - 1
    odd = value >> shift
    if abs(odd) >= EXACT_DOUBLE or kind != "int64":
        raise DzdesignError(f"constant {value} is not exact where MATLAB reads it as a {kind}")
    return f"{kind}({odd}) * {kind}(2^{shift})"


def _comment(each: Named) -> list[str]:
    text = f"{each.equation}: {each.engineering} ({each.rounding})."
    lines = wrap(text[0].upper() + text[1:], COLUMNS - 2, break_long_words=False, break_on_hyphens=False)
    return [f"% {line}" for line in lines]


def _assignment(each: Named, kind: str) -> str:
    number = str(each.value) if each.symbol in SHIFTS else matlab_integer(each.value, kind)
    return f"{each.symbol} = {number};"


def _table(
    compensator: Compensator, form: IntegerForm, sign: int, table: tuple[int, ...], name: str, what: str
) -> Iterator[str]:
    """Yield a table: its nodes stand before twice the smallest of them."""
    nodes, least, step = table[:-2], table[-1], compensator.beta_step_codes
    unit = form.scale_beta * compensator.beta_denominator
    units = compensator.valve.recorded_units.of_side(SIDE_NAMES[sign])
    rounding = f"rounded down to 1/{compensator.beta_denominator}"
    yield f"% Eq. (7), beta of the {what}, times {unit}, at its nodes ({rounding})."
    yield f"{name}_NODES = int32([ ..."
    for first in range(0, len(nodes), TABLE_COLUMNS):
        begins = units.text(float(compensator.signals.dp_MPa(first * step)), ".3f MPa")
        numbers = "; ".join(map(str, nodes[first : first + TABLE_COLUMNS]))
        yield f"    {numbers}; ... from {begins}: beta {nodes[first] / unit:.6f}"
    yield "    ]);"
    yield f"% The smallest, times {step}, for pressures that can't be right: beta {least / unit:.6f}."
    yield f"{name}_LEAST = int32({least * step});"
