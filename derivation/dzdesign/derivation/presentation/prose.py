"""Words of a report, each format writing them its own way: one notation for symbols, code and references in a text."""

import re

import sympy

from dzdesign.core.artefact_types import JsonText
from dzdesign.derivation.presentation.formulas import to_python, to_text

#: What is no plain text in a sentence: a reference with its words, code, symbols and formulas, a statement's number.
PARTS = re.compile(
    r"\[\[(?P<to>[^|]+)\|(?P<words>.+?)\]\]|`(?P<code>[^`]+)`|\$(?P<formula>[^$]+)\$"
    r"|(?P<number>\(\d+[a-z]?\)|\b[TL]\d+[a-z]?\b)"
)


class Formula(JsonText):
    """An expression, or a chain of equal ones, on a line of its own."""

    def __init__(self, *sides: sympy.Basic) -> None:
        self.sides = sides

    def __str__(self) -> str:
        return " = ".join(map(to_text, self.sides))

    def json_text(self) -> str:
        return " = ".join(map(to_python, self.sides))


class Words(JsonText):
    """Sentences: ``$u_min0$`` is a symbol, ```paper``` code, ``(18)`` and ``[[S|the definition of $S$]]`` references.

    Examples
    --------
    >>> str(Words("$u_min0$ by [[S|the definition of $S$]] and (18)"))
    'u_min0 by the definition of S and (18)'
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def __bool__(self) -> bool:
        return bool(self.text)

    def __str__(self) -> str:
        return re.sub(r"\[\[[^|]+\||\]\]|\$", "", self.text)

    json_text = __str__


def inline(*sides: sympy.Basic) -> str:
    """Return a formula as a part of a sentence; an equation as its two sides."""
    parts = sides[0].args if len(sides) == 1 and isinstance(sides[0], sympy.Eq) else sides
    return f"${' = '.join(map(to_text, parts))}$"
