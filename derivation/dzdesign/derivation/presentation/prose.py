"""Finds the symbols and the references in a sentence, so that a report can set them as such."""

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache

import sympy
from sympy.core.function import AppliedUndef

from dzdesign.derivation import symbols
from dzdesign.derivation.presentation.typeset import GREEK


@dataclass(frozen=True, slots=True)
class Quantity:
    """A symbol in a sentence, by its name."""

    name: str


@dataclass(frozen=True, slots=True)
class Formula:
    """An expression, or a chain of equal ones, in a sentence or on a line of its own."""

    sides: tuple[sympy.Basic, ...]


@dataclass(frozen=True, slots=True)
class Reference:
    """A statement that a sentence points to, with the words that name it there."""

    number: str
    words: "Words" = ()


@dataclass(frozen=True, slots=True)
class Code:
    """A word of the command line or of a file."""

    text: str


@dataclass(frozen=True, slots=True)
class Raised:
    """An exponent."""

    text: str


Words = tuple[str | Quantity | Formula | Reference | Code | Raised, ...]

#: Letters that are symbols wherever they stand alone, and those that are beside a sign only: elsewhere they are words.
_LETTERS = ("k", "x", "f", "n", "Q", "S", "W")
_BESIDE_SIGNS = r"(?<=[(+−] )[ast]\b|(?<=[(−])[ast]\b|\b[ast](?=\)| [=+] )|(?<=−\d )[at]\b"
_SIGNS = ((" - ", " − "), ("<=", "≤"), (">=", "≥"), (" -> ", " → "))
_MINUS = re.compile(r"(?<![\w)-])-(?=[\w(])")
_RANGE = re.compile(r"(?<=[\d)])-(?=[\d(])")
_REFERENCE = r"\(\d+[a-z]?\)|\b[TL]\d[a-z]?\b"


@cache
def _pattern() -> re.Pattern:
    known = vars(symbols).values()
    names = {value.name for value in known if isinstance(value, sympy.Symbol)}
    names |= {value.func.__name__ for value in known if isinstance(value, AppliedUndef)}
    names = {name for name in names if re.fullmatch(r"[A-Za-z]+_\w+'?|dP[01]?", name)} | {*GREEK, *_LETTERS}
    alternatives = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    return re.compile(
        rf"(?P<code>`[^`]+`)|(?P<reference>{_REFERENCE})|\^(?P<raised>\d+)"
        rf"|(?P<name>(?<![\w`])(?:{alternatives})(?![\w'])|{_BESIDE_SIGNS})"
    )


def parse_prose(sentence: str, numbers: Collection[str] = ()) -> Words:
    """Split a sentence into text, symbols and references; its signs become those of print.

    Parameters
    ----------
    sentence : str
    numbers : collection of str, optional
        Statements that may be referred to.

    Returns
    -------
    Words

    Examples
    --------
    >>> parse_prose("u_min0 by (18)", ["(18)"])
    (Quantity(name='u_min0'), ' by ', Reference(number='(18)', words=()))
    """
    return tuple(_words(_with_signs(sentence), numbers))


def _words(sentence: str, numbers: Collection[str]) -> Iterator:
    end = 0
    for found in _pattern().finditer(sentence):
        if found["reference"] and found["reference"] not in numbers:
            continue
        if found.start() > end:
            yield sentence[end : found.start()]
        if found["code"]:
            yield Code(found["code"].strip("`"))
        elif found["reference"]:
            yield Reference(found["reference"])
        elif found["raised"]:
            yield Raised(found["raised"])
        else:
            yield Quantity(found["name"])
        end = found.end()
    if end < len(sentence):
        yield sentence[end:]


def _with_signs(text: str) -> str:
    """Put a minus, an en dash and a comparison in place of their spelling on a keyboard."""
    for keyboard, printed in _SIGNS:
        text = text.replace(keyboard, printed)
    return _RANGE.sub("–", _MINUS.sub("−", text))
