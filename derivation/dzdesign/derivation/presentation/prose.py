"""Words of a report: text with formulas and references in it, each format writing these its own way."""

import re
from collections.abc import Collection, Iterable, Iterator

import sympy

from dzdesign.core.artefact_types import JsonText
from dzdesign.derivation.presentation.formulas import to_python, to_text
from dzdesign.derivation.symbols import QUANTITIES


class Formula(JsonText):
    """An expression, or a chain of equal ones, in a sentence or on a line of its own."""

    def __init__(self, *sides: sympy.Basic) -> None:
        self.sides = sides

    def __str__(self) -> str:
        return " = ".join(map(to_text, self.sides))

    def json_text(self) -> str:
        return " = ".join(map(to_python, self.sides))


class Reference(JsonText):
    """A statement that a sentence points to, with the words that name it there; its number unless given."""

    def __init__(self, number: str, *words: "Part") -> None:
        self.number = number
        self.words = Words(*words) if words else Words(number)

    def __str__(self) -> str:
        return str(self.words)

    def json_text(self) -> str:
        return self.number


class Words(JsonText):
    """Text, formulas and references in a row; what stands between backquotes in a text is code."""

    def __init__(self, *parts: "Part") -> None:
        flat = (one for part in parts for one in (part.parts if isinstance(part, Words) else (part,)))
        self.parts: tuple[str | Formula | Reference, ...] = tuple(one for one in flat if one != "")

    @classmethod
    def join(cls, parts: "Iterable[Part]", joint: str = ", ") -> "Words":
        """Return parts with a joint between each two."""
        return cls(*[one for part in parts for one in (joint, part)][1:])

    def __bool__(self) -> bool:
        return bool(self.parts)

    def __str__(self) -> str:
        return "".join(map(str, self.parts))

    json_text = __str__


Part = str | Formula | Reference | Words

_PARTS = re.compile(r"\$(?P<formula>[^$]+)\$|(?P<reference>\(\d+[a-z]?\)|\b[TL]\d+[a-z]?\b)")
_NAME = re.compile(r"[A-Za-z]\w*'?")


def parse_prose(sentence: str, numbers: Collection[str] = ()) -> Words:
    """Split a sentence into text, symbols between dollars, and references to statements of `numbers`.

    Examples
    --------
    >>> [type(part).__name__ for part in parse_prose("$u_min0$ by (18)", ["(18)"]).parts]
    ['Formula', 'str', 'Reference']
    """
    parts: list[Part] = []
    end = 0
    for found in _PARTS.finditer(sentence):
        if found["reference"] and found["reference"] not in numbers:
            continue
        parts.append(sentence[end : found.start()])
        parts += _symbols(found["formula"]) if found["formula"] else [Reference(found["reference"])]
        end = found.end()
    return Words(*parts, sentence[end:])


def _symbols(formula: str) -> Iterator[Part]:
    """Yield what stands between dollars: each name as a symbol, the rest as it is."""
    by_name, end = {str(name): name for name in QUANTITIES}, 0
    for found in _NAME.finditer(formula):
        yield formula[end : found.start()]
        yield Formula(by_name.get(found[0], sympy.Symbol(found[0])))
        end = found.end()
    yield formula[end:]
