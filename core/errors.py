"""One root exception; each message is one sentence: what, expected, got, where, what to do."""

import difflib
import reprlib
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


#: Characters of a value that a message quotes, and of a message.
QUOTED, LONGEST_MESSAGE = 40, 1200
#: Of an integer that is written in decimals: the interpreter refuses some 14000.
MOST_BITS = 14_000


def quoted(value: object) -> str:
    """Return the beginning of a value as it would be written, for a message.

    Not by ``str``: of an integer with 5000 digits, or of tables a thousand deep, that is an error itself.

    Examples
    --------
    >>> quoted("1 MPa"), quoted(16**5000)
    ("'1 MPa'", 'a whole number of 20001 bits')
    """
    if isinstance(value, int) and value.bit_length() > MOST_BITS:
        return f"a whole number of {value.bit_length()} bits"
    if isinstance(value, str | int | float):
        text = repr(value[: QUOTED + 1] if isinstance(value, str) else value)
    else:
        text = reprlib.repr(value)
    return text if len(text) <= QUOTED + 2 else f"{text[:QUOTED]}..."


def clear_line(text: str) -> str:
    """Return a message on one line, of which too long a middle is left out: what is wrong, and what to do, stay."""
    text = one_line(text)
    half = LONGEST_MESSAGE // 2
    return text if len(text) <= LONGEST_MESSAGE else f"{text[:half]} ... {text[-half:]}"


def one_line(text: str) -> str:
    """Return a message on one line: a file name or a cell may hold line breaks, or codes that steer a terminal.

    Examples
    --------
    >>> one_line("ramp\\n1.csv")
    'ramp 1.csv'
    """
    return "".join(character if character.isprintable() else " " for character in text)
