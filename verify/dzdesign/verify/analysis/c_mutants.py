"""Wrong C: one constant, comparison or operator of a file changed at a time.

A constant is changed by one, or, beyond 16 bits, by one in the last of its 16 leading bits: the finest that a compare
value of 16 bits resolves. Below that lie the bits of a scaled product that its one rounding takes away.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

#: Comments, directives that hold no value, and what a mutation may meet; the first that matches is taken.
TOKEN = re.compile(
    r"(?P<skip>/\*.*?\*/|//[^\n]*|\#[ \t]*(?:include|ifndef|ifdef|endif|define[ \t]+\w+[ \t]*\n)[^\n]*"
    r"|\#[ \t]*define[ \t]+\w+)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<number>0[xX][0-9a-fA-F]+|\d+)(?P<suffix>[uUlL]*)"
    r"|(?P<operator><<=|>>=|<<|>>|<=|>=|==|!=|\+\+|--|\+=|-=|&=|\|=|&&|\|\||->|[-+<>&|^~!*/%=?:;,.(){}\[\]])",
    re.DOTALL,
)
#: What stands for an operator between two operands.
SWAPS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==",
    "+": "-", "-": "+", "<<": ">>", ">>": "<<", "&": "|", "|": "&", "&&": "||", "||": "&&",
    "+=": "-=", "-=": "+=", "++": "--", "--": "++",
}  # fmt: skip
#: Bits of the widest output, the compare value.
OUTPUT_BITS = 16
#: Left out where they stand before an operand.
DROPPED = ("-", "~", "!")
ENDS_OPERAND = re.compile(r"[\w\])]$")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """One change: its file, its line from 1, the change in words, and the whole file with it."""

    file: str
    line: int
    change: str
    text: str


def mutants_of(file: str, text: str) -> Iterator[Mutant]:
    """Yield every mutant of a file."""
    before = ""
    for token in TOKEN.finditer(text):
        if token["skip"] is not None:
            continue
        start, end = token.span("number") if token["number"] else token.span()
        for new in _instead(token, before):
            line = text.count("\n", 0, start) + 1
            code = text.splitlines()[line - 1].strip()
            change = f"{code[:70]}: {text[start:end]} -> {new or 'nothing'}"
            yield Mutant(file=file, line=line, change=change, text=text[:start] + new + text[end:])
        before = token[0]


def _instead(token: re.Match[str], before: str) -> list[str]:
    """Return what may stand in place of a token."""
    if token["number"]:
        value = int(token["number"], 0)
        change = 1 << max(value.bit_length() - OUTPUT_BITS, 0)
        return [str(value + change)] + ([str(value - change)] if value else [])
    operator = token["operator"]
    if operator in ("++", "--"):
        return [SWAPS[operator]]
    between = bool(ENDS_OPERAND.search(before)) and before != "return"
    if operator in SWAPS and between:
        return [SWAPS[operator]]
    return [""] if operator in DROPPED and not between else []
