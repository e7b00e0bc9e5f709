"""The fixed words of a report in the reader's language.

English words are the keys of a table; what the table lacks stays English. Sentences with numbers in them, the verdict's
reasons, warnings and notes, are English in every report.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.resources import files

import msgspec

from dzdesign.core.errors import InputError, nearest

#: Languages that a report can be in; English needs no table.
LANGUAGES = ("en", "de")
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
    """Return a fixed word or phrase in the language of the report; in English what its table lacks.

    Examples
    --------
    >>> with in_language("de"):
    ...     word("Hysteresis"), word("not in the table")
    ('Hysterese', 'not in the table')
    """
    return english if _language.get() == "en" else table_of_language(_language.get()).get(english, english)


@cache
def table_of_language(language: str) -> Mapping[str, str]:
    """Return English word -> word of a language."""
    content = files("dzdesign.report").joinpath("words", f"{language}.toml").read_bytes()
    return msgspec.toml.decode(content, type=dict[str, str])
