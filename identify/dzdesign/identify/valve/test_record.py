"""The record of a test: who and what, in the words of the bench. It is kept and shown, and enters no calculation."""

import unicodedata
from collections.abc import Iterable

from dzdesign.core.errors import InputError, quoted

#: An acceptance report's head, with room to spare; what is longer belongs into a document of its own.
MOST_ENTRIES, LONGEST_NAME, LONGEST_TEXT = 40, 60, 200


def checked_record(entries: Iterable[tuple[object, object]], where: str) -> dict[str, str]:
    """Return a record as it is kept: blanks at the ends taken off, of whichever width they are.

    Messages say what the entries stand in, `where`.

    Raises
    ------
    InputError
        If a name or a text is empty, too long or more than one line, a name stands there twice, or there are too many.

    Examples
    --------
    >>> checked_record([("serial", "4711 "), ("oil", "HLP 46, 40 °C")], "--record")
    {'serial': '4711', 'oil': 'HLP 46, 40 °C'}
    """
    record: dict[str, str] = {}
    known: dict[str, str] = {}
    for given_name, given_text in entries:
        name = _line(given_name, LONGEST_NAME, f"{where}: a name", "such as serial")
        text = _line(given_text, LONGEST_TEXT, f"{where}: {name}", f'such as {name} = "4711"')
        other = known.setdefault(name.casefold(), name)
        if name in record or other != name:
            both = f"'{name}'" if other == name else f"'{other}' and '{name}'"
            raise InputError(f"{where} has {both} twice, expected each name once; leave one of them out")
        record[name] = text
        if len(record) > MOST_ENTRIES:
            raise InputError(
                f"{where} has more than {MOST_ENTRIES} entries, expected up to {MOST_ENTRIES}; leave out what the "
                "report need not show"
            )
    return record


def _line(value: object, longest: int, what: str, example: str) -> str:
    """Return one printable line: what a terminal or a reader of the page would not see is refused."""
    if not isinstance(value, str):
        raise InputError(f"{what} is {quoted(value)}, expected text {example}")
    # A blank pasted from a document may be of another width, between a number and its unit: 40 °C.
    line = "".join(" " if unicodedata.category(character) == "Zs" else character for character in value).strip()
    if not line:
        raise InputError(f"{what} is empty, expected text {example}; fill it in, or leave it out")
    if len(line) > longest:
        raise InputError(f"{what} is {quoted(line)}, {len(line)} characters, expected up to {longest}; shorten it")
    if not line.isprintable():
        raise InputError(
            f"{what} is {quoted(line)}, expected one line of characters that are printed, {example}; write it anew"
        )
    return line
