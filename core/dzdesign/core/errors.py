"""One root exception; each message is one sentence: what, expected, got, where, what to do."""

import os
import reprlib
from collections.abc import Iterable, Sequence

#: Names in a folder among which a mistyped one is looked for.
MOST_NEIGHBOURS = 10_000


class DzdesignError(Exception):
    """Root of all deliberate errors of dzdesign; the command line exits with status 2."""


class InputError(DzdesignError):
    """Wrong input or usage, such as a file, a column, a unit, a name or an option."""


class MissingToolError(InputError):
    """A required external program or package is missing, too old, or fails on this machine."""


class RequirementError(DzdesignError):
    """A requirement does not hold, such as a failed proof or a wrong result; the command line exits with status 1."""


class InternalError(DzdesignError):
    """A result of dzdesign breaks its own rules: its fault, not that of the input; exit status 1 and one sentence."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return `` (did you mean 'x'?)`` for the known name nearest to `name`, or an empty string.

    Capitals count for little: ``COMAND`` is near to ``command``.

    Examples
    --------
    >>> nearest("f28334", ["f28335", "host"])
    " (did you mean 'f28335'?)"
    >>> nearest("HOST", ["f28335", "host"])
    " (did you mean 'host'?)"
    """
    import difflib  # here, because a start without an error does not need it

    known = list(known)
    by_lower_case = {each.lower(): each for each in reversed(known)}
    matches = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    near = difflib.get_close_matches(name.lower(), by_lower_case, n=1, cutoff=0.6)
    matches = [by_lower_case[near[0]]] if near and (not matches or near[0] == name.lower()) else matches
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


def neighbour(path: str | os.PathLike[str]) -> str:
    """Return `` (did you mean 'x'?)`` for what lies in the same folder under nearly that name, or an empty string.

    Where the folder of what is missing does not exist either, that folder's neighbours are looked at.
    """
    place, below = os.fspath(path), ""
    while place and not os.path.lexists(place):
        folder, name = os.path.split(place)
        if name and os.path.isdir(folder or "."):
            try:
                with os.scandir(folder or ".") as entries:
                    names = [entry.name for entry, _ in zip(entries, range(MOST_NEIGHBOURS), strict=False)]
            except OSError:
                return ""
            hint, before = nearest(name, names), os.path.join(folder, "")
            return hint.replace("mean '", f"mean '{before}").replace("'?)", f"{below}'?)")
        place, below = folder, os.path.join(os.sep, name) + below
    return ""


def and_more(names: Sequence[str], most: int) -> str:
    """Return names for a sentence, and how many more there are.

    Examples
    --------
    >>> and_more(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def one_line(text: str) -> str:
    """Return a message on one line: a file name or a cell may hold line breaks, or codes that steer a terminal.

    Examples
    --------
    >>> one_line("ramp\\n1.csv")
    'ramp 1.csv'
    """
    return "".join(character if character.isprintable() else " " for character in text)
