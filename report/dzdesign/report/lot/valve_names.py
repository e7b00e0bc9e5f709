"""Names of valves: what one may be, and in which order a lot is listed."""

import re

#: A name is a folder's on every system and a cell's in every spreadsheet.
NAME = re.compile(r"[^\W_][\w .+-]{0,99}(?<![. ])")
DIGITS = re.compile(r"([0-9]+)")
#: Characters of a valve's name in a figure or a narrow cell; names may have a hundred.
SHORT = 18


def by_name(name: str) -> tuple[tuple[tuple[str, int, str], ...], str]:
    """Return what to sort a valve by: its name, the numbers in it as numbers.

    Examples
    --------
    >>> sorted(["V10", "V2", "V1b", "V1"], key=by_name)
    ['V1', 'V1b', 'V2', 'V10']
    """
    words, numbers = DIGITS.split(name)[::2], [digits.lstrip("0") for digits in DIGITS.findall(name)]
    # By length first: a number may have more digits than Python makes an int of.
    parts = ((word, len(digits), digits) for word, digits in zip(words, [*numbers, ""], strict=True))
    return tuple(parts), name


def short(name: str) -> str:
    """Return a valve's name for a narrow place.

    Examples
    --------
    >>> short("V0001"), short("a" * 30)
    ('V0001', 'aaaaaaaaaaaaaaaaa…')
    """
    printable = "".join(letter if letter.isprintable() else "·" for letter in name)
    return printable if len(printable) <= SHORT else f"{printable[: SHORT - 1]}…"
