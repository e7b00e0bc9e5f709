"""Integer operations printed as assignments of IEC 61131-3 and of MATLAB, each with its meaning and range behind it."""

from collections.abc import Iterable, Mapping
from textwrap import wrap

from dzdesign.codegen.banner import banner_of
from dzdesign.codegen.core.certificate_text import equation_of
from dzdesign.codegen.integers.form import Form, Node
from dzdesign.core.display import strict_templates
from dzdesign.core.errors import DzdesignError
from dzdesign.derivation.law import law
from dzdesign.design.compensator import Compensator

PACKAGE = "dzdesign.codegen.integers"
#: Columns of a line, and of a comment's text.
COLUMNS = 116
#: Whole numbers beyond this are not exact where MATLAB reads them, as doubles.
EXACT_DOUBLE = 2**53
#: How tightly an operation binds; names, numbers and calls bind tightest. Alike in both languages.
BINDS = {"or": 1, "and": 2, "<": 3, ">": 3, "<=": 3, "+": 5, "-": 5, "*": 6, "/": 6, "mod": 6, "neg": 7, "not": 7}
TIGHTEST = 8
BOTH = {"<": "{} < {}", ">": "{} > {}", "<=": "{} <= {}", "+": "{} + {}", "-": "{} - {}", "neg": "-{}"}
STRUCTURED_TEXT = BOTH | {
    "or": "{} OR {}", "and": "{} AND {}", "not": "NOT {}", "*": "{} * {}", "/": "{} / {}", "mod": "{} MOD {}",
    "min": "MIN({}, {})", "max": "MAX({}, {})", "int": "BOOL_TO_DINT({})", "choose": "SEL({0}, {2}, {1})",
    "of": "{}[{}]",
}  # fmt: skip
MATLAB = BOTH | {
    "or": "{} | {}", "and": "{} & {}", "not": "~{}", "*": "{} .* {}", "min": "min({}, {})", "max": "max({}, {})",
    "int": "int64({})", "of": "{}({})", ">>": "bitshift({}, -{})",
}  # fmt: skip


def rendered(template: str, compensator: Compensator, digest: str, **values: object) -> str:
    """Return the text of a template with its banner and the law, of a compensator whose file has this SHA-256."""
    chosen = law(compensator.law)
    templates = strict_templates(PACKAGE, autoescape=False, lstrip_blocks=True)
    text = templates.get_template(template).render(
        banner=banner_of(compensator, digest).lines(template),
        law_equation=equation_of(chosen),
        law_text=str(chosen.output).replace("**", "^"),
        **values,
    )
    return str(text).replace("²", "^2").encode("ascii", "replace").decode()  # units of recordings stand in comments


def expression(node: Node, spelled: Mapping[str, str]) -> str:
    """Return the text of an operation, down to what has a name."""
    return _expression(node, spelled)[0]


def _expression(node: Node, spelled: Mapping[str, str]) -> tuple[str, int]:
    if node.operation == "number":
        return str(node.low), TIGHTEST if node.low >= 0 else BINDS["neg"]
    if node.name:
        return node.name, TIGHTEST
    binds = BINDS.get(node.operation, 0)
    parts, operands = [], node.operands
    if node.operation == "of" and spelled is MATLAB:
        operands = (operands[0], _one_more(operands[1]))
    for place, operand in enumerate(operands):
        text, inside = _expression(operand, spelled)
        # The order of operations is that of the ranges: a second operand as loose as this one keeps its brackets.
        loose = inside < binds or (inside == binds and (place > 0 or binds in (BINDS["<"], BINDS["neg"])))
        parts.append(f"({text})" if loose else text)
    return spelled[node.operation].format(*parts), binds or TIGHTEST


def _one_more(index: Node) -> Node:
    """Return an index of MATLAB, where the first element is the one with number 1."""
    if index.operation == "+" and index.operands[1].operation == "number":
        return index.operands[0] + (index.operands[1].low + 1)
    return index + 1


def said(node: Node) -> str:
    """Return what a comment says of a line: its meaning, and the range of a number."""
    span = "" if node.boolean else f"{node.low} to {node.high}"
    return ": ".join(filter(None, [node.meaning, span]))


def st_constants(form: Form) -> list[str]:
    """Return the declarations of all constants."""
    lines: list[str] = []
    for each in form.constants:
        numbers = ", ".join(map(str, each.values))
        many = len(each.values) > 1
        kind, value = (f"ARRAY[0..{len(each.values) - 1}] OF DINT", f"[{numbers}]") if many else ("DINT", numbers)
        lines += _with_comment(f"{each.name} : {kind} := {value};", each.meaning)
    return lines


def st_remembered(form: Form) -> list[str]:
    """Return the declarations of what is remembered, each with its first value."""
    lines: list[str] = []
    for each in form.remembered:
        kind = "BOOL" if each.boolean else "DINT"
        lines += _with_comment(f"{each.name} : {kind} := {first_value(each)};", each.meaning)
    return lines


def first_value(node: Node) -> str:
    """Return the first value of what is remembered."""
    (value,) = node.values
    return str(bool(value)).upper() if node.boolean else str(value)


def st_variables(form: Form) -> list[str]:
    """Return the declarations of what the lines assign, beside outputs and what is remembered."""
    lines: list[str] = []
    for kind, boolean in (("DINT", False), ("BOOL", True)):
        names = ", ".join(each.name for each in form.own if each.boolean is boolean)
        lines += _wrapped(f"{names} : {kind};")
    return lines


def st_body(form: Form) -> list[str]:
    """Return the assignments."""
    lines: list[str] = []
    for place, each in enumerate(form.lines):
        if place in form.headings:
            lines += _wrapped(f"(* {form.headings[place]} *)")
        text = expression(each.operands[0], STRUCTURED_TEXT)
        lines += _with_comment(f"{each.name} := {text};", said(each))
    return lines


def matlab_constants(form: Form) -> list[str]:
    """Return the assignments of all constants, each below what it is."""
    lines: list[str] = []
    for each in form.constants:
        lines += [f"% {line}" for line in wrap(f"{each.meaning[0].upper()}{each.meaning[1:]}.", COLUMNS)]
        if len(each.values) == 1:
            lines.append(f"{each.name} = {matlab_integer(each.values[0])};")
            continue
        rows = wrap("; ".join(map(str, each.values)), COLUMNS - 8)
        lines += [f"{each.name} = int64([ ...", *(f"    {row} ..." for row in rows), "    ]);"]
    return lines


def matlab_integer(value: int) -> str:
    """Return a number as an int64, exact where it is read: a large one as odd part and power of two.

    Examples
    --------
    >>> matlab_integer(-12)
    'int64(-12)'
    >>> matlab_integer(3 * 2**60)
    'int64(3) * int64(2^60)'
    """
    if abs(value) < EXACT_DOUBLE:
        return f"int64({value})"
    shift = (value & -value).bit_length() - 1
    if abs(value >> shift) >= EXACT_DOUBLE:
        raise DzdesignError(f"constant {value} is not exact where MATLAB reads it")
    return f"int64({value >> shift}) * int64(2^{shift})"


def matlab_body(form: Form) -> list[str]:
    """Return the assignments; a choice is made by a mask, in a line of its own."""
    lines: list[str] = []
    for place, each in enumerate(form.lines):
        if place in form.headings:
            lines += ["", f"% {form.headings[place]}"]
        made, mask = each.operands[0], ""
        if made.operation == "choose":
            condition, yes, no = made.operands
            where = expression(condition, MATLAB)
            if yes.operation not in ("number", "constant"):
                yes, no, where = no, yes, f"~{where}"
            made, mask = no, f"{each.name}({where}) = {expression(yes, MATLAB)};"
        text = f"{each.name} = {expression(made, MATLAB)};"
        behind = f" % {told}" if (told := said(each)) else ""
        rows = list(_wrapped(text))
        rows = [f"{row} ..." for row in rows[:-1]] + rows[-1:]
        lines += [text + behind] if len(text + behind) <= COLUMNS else [f"% {told}", *rows]
        lines += [mask] if mask else []
    return lines


def _with_comment(text: str, told: str) -> Iterable[str]:
    """Return a text with its comment behind it or, where that is too long, before it."""
    whole = f"{text} (* {told} *)"
    return [whole] if len(whole) <= COLUMNS else [*_wrapped(f"(* {told} *)"), *_wrapped(text)]


def _wrapped(text: str) -> Iterable[str]:
    return wrap(text, COLUMNS, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)
