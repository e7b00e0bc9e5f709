"""The words of a report in the reader's language.

English is the key of a table of phrases. A phrase may have places, ``{}``, for numbers, units, names and other phrases
of the table: "Thresholds, {} commands". What the table lacks stays English: above all the findings, which stand in
the report as the evidence has them.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, lru_cache
from importlib.resources import files

import msgspec

from dzdesign.core.errors import InputError, nearest

#: Languages that a report can be in; English needs no table.
LANGUAGES = ("en", "de")
#: What parts the sentences of a text, and the clauses of a sentence; each may stand in the table on its own.
PARTED = (re.compile(r"((?<!\bEq)(?<!\bs\.[ed])\. )"), re.compile(r"(; )"))
#: An English word, no unit and no name of a file or an option: what stands in a place of a phrase and in no table has
#: none. A full stop ends a word, but not where a name goes on behind it.
ENGLISH = re.compile(r"(?<![\w.`/-])(?!(?:bar|psi|gpm)\b)[a-z]{3,}(?!\w|[./]\w|/)")
#: Characters of a text that is looked up: a longer one is no phrase.
LONGEST = 2000
#: Words that a sentence has, at least; a shorter text is a name, a number or a unit.
SENTENCE = 4
_language: ContextVar[str] = ContextVar("language", default="en")


def checked_language(language: str) -> str:
    """Return a language that there is.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if language not in LANGUAGES:
        raise InputError(f"--language is '{language}'{nearest(language, LANGUAGES)}, expected {' or '.join(LANGUAGES)}")
    return language


@contextmanager
def in_language(language: str) -> Iterator[None]:
    """Make a report in a language."""
    token = _language.set(checked_language(language))
    try:
        yield
    finally:
        _language.reset(token)


def current_language() -> str:
    """Return the language of the report that is being made."""
    return _language.get()


def word(english: str) -> str:
    """Return a word, phrase or text in the language of the report; in English what its table lacks.

    Of a text whose parts stand in the table each is translated, or none: half a sentence in each language helps nobody.

    Examples
    --------
    >>> with in_language("de"):
    ...     word("Hysteresis"), word("Thresholds, negative commands"), word("not in the table")
    ('Hysterese', 'Schwellen, negative Ansteuerung', 'not in the table')
    """
    return _translated(_language.get(), english) or english


def stays_english(text: str) -> bool:
    """Return whether a sentence is English in a report of another language."""
    language = _language.get()
    return language != "en" and len(text.split()) >= SENTENCE and _translated(language, text) is None


@lru_cache(maxsize=4096)
def _translated(language: str, english: str) -> str | None:
    """Return a text in a language; None if its table lacks a part of it."""
    if language == "en" or not english or len(english) > LONGEST:
        return None
    if (found := _phrase(language, english)) is not None:
        return found
    if english.endswith("."):
        known = _translated(language, english[:-1])
        return None if known is None else f"{known}."
    for separator in PARTED:
        parts = separator.split(english)
        if len(parts) > 1:
            made = [part if place % 2 else _translated(language, part) for place, part in enumerate(parts)]
            whole = [part for part in made if part is not None]
            return "".join(whole) if len(whole) == len(made) else None
    return None


def _phrase(language: str, english: str) -> str | None:
    """Return one phrase of the table with what stands in its places."""
    table = table_of_language(language)
    if english in table:
        return table[english]
    for literals, key in _patterns(language):
        filled = [(each, _translated(language, each)) for each in _fill(literals, english) or ()]
        if filled and all(known or not ENGLISH.search(each) for each, known in filled):
            return table[key].format(*(known or each for each, known in filled))
    return None


def _fill(literals: tuple[str, ...], text: str) -> list[str] | None:
    """Return what stands in the places between the literals of a phrase; None if the text is not of it."""
    first, last = literals[0], literals[-1]
    if not (text.startswith(first) and text.endswith(last) and len(text) > len(first) + len(last)):
        return None
    found, at, end = [], len(first), len(text) - len(last)
    for literal in literals[1:-1]:
        place = text.find(literal, at, end)
        if place <= at:
            return None
        found.append(text[at:place])
        at = place + len(literal)
    return [*found, text[at:end]] if at < end else None


@cache
def _patterns(language: str) -> tuple[tuple[tuple[str, ...], str], ...]:
    """Return the phrases with places, each by what stands around its places, the most particular first."""
    keys = [key for key in table_of_language(language) if "{}" in key]
    return tuple((tuple(key.split("{}")), key) for key in sorted(keys, key=lambda key: -len(key.replace("{}", ""))))


@cache
def table_of_language(language: str) -> Mapping[str, str]:
    """Return English phrase -> phrase of a language."""
    content = files("dzdesign.report").joinpath("words", f"{language}.toml").read_bytes()
    return msgspec.toml.decode(content, type=dict[str, str])
