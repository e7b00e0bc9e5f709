"""Finds the symbols and the references in a sentence, so that a report can set them as such."""

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache

import sympy

from dzdesign.derivation.symbols import QUANTITIES


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


Words = tuple[str | Formula | Reference | Code, ...]

#: Letters that are symbols wherever they stand alone, and those that are beside a sign only: elsewhere they are words.
_LETTERS = ("k", "x", "f", "n", "Q", "S", "W", "beta", "gamma", "kappa", "lambda", "rho")
_BESIDE_SIGNS = r"(?<=[(+−] )[ast]\b|(?<=[(−])[ast]\b|\b[ast](?=\)| [=+] )|(?<=−\d )[at]\b"
_SIGNS = ((" - ", " − "), ("<=", "≤"), (">=", "≥"), (" -> ", " → "))
_MINUS = re.compile(r"(?<![\w)-])-(?=[\w(])")
_RANGE = re.compile(r"(?<=[\d)])-(?=[\d(])")
_REFERENCE = r"\(\d+[a-z]?\)|\b[TL]\d[a-z]?\b"


@cache
def _pattern() -> re.Pattern[str]:
    declared = {name.func.__name__ if name.args else name.name for name in QUANTITIES}
    names = {name for name in declared if re.fullmatch(r"[A-Za-z]+_\w+'?|dP[01]?", name)} | set(_LETTERS)
    alternatives = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    return re.compile(
        rf"(?P<code>`[^`]+`)|(?P<reference>{_REFERENCE})"
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
    (Formula(sides=(u_min0,)), ' by ', Reference(number='(18)', words=()))
    """
    return tuple(_words(_with_signs(sentence), numbers))


def _words(sentence: str, numbers: Collection[str]) -> Iterator[str | Formula | Reference | Code]:
    by_name = {str(name): name for name in QUANTITIES}
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
        else:
            yield Formula((by_name.get(found["name"], sympy.Symbol(found["name"])),))
        end = found.end()
    if end < len(sentence):
        yield sentence[end:]


def _with_signs(text: str) -> str:
    """Put a minus, an en dash and a comparison in place of their spelling on a keyboard."""
    for keyboard, printed in _SIGNS:
        text = text.replace(keyboard, printed)
    return _RANGE.sub("–", _MINUS.sub("−", text))
