"""One root exception; each message is one sentence: what, expected, got, where, what to do."""

import difflib
from collections.abc import Iterable


class DzdesignError(Exception):
    """Root of every error that dzdesign raises on purpose; the command line turns it into exit status 2."""


class InputError(DzdesignError):
    """Input or usage is bad: a file, a column, a unit, a name, an option."""


class RequirementError(DzdesignError):
    """A requirement does not hold (a proof failed, an input is wrong): exit status 1, not a usage error."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return `` (did you mean 'x'?)`` for the known name nearest to `name`, or an empty string.

    Examples
    --------
    >>> nearest("f28334", ["f28335", "host"])
    " (did you mean 'f28335'?)"
    """
    matches = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
    return f" (did you mean '{matches[0]}'?)" if matches else ""


def one_line(text: str) -> str:
    """Return a message on one line: a file name or a cell may hold line breaks, or codes that steer a terminal.

    Examples
    --------
    >>> one_line("ramp\\n1.csv")
    'ramp 1.csv'
    """
    return "".join(character if character.isprintable() else " " for character in text)
