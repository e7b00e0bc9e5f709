"""Tables of the report: cells with a meaning, not with markup."""

from collections.abc import Sequence
from dataclasses import dataclass

from dzdesign.core.verdicts import verdict_words

#: The sign beside a verdict: colour is never the only carrier.
SIGNS = {True: "✓", False: "✗", None: "?"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One cell.

    Attributes
    ----------
    text : str
        What stands in it.
    kind : {"text", "number", "code", "symbol", "hash", "good", "bad", "open"}
        How it is set; the last three are verdicts; a symbol is code on one line, a hash on two.
    more : str
        A second line, smaller.
    """

    text: str
    kind: str = "text"
    more: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table.

    Attributes
    ----------
    caption : str
        What it shows.
    columns : tuple of str
        Headings, units in them.
    rows : tuple of tuple of Cell
    csv : str
        The same to be downloaded; empty if it is not offered.
    name : str
        Of the CSV file.
    notes : tuple of str
        Below it, what marks in its cells point to.
    """

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    csv: str = ""
    name: str = ""
    notes: tuple[str, ...] = ()


def number(value: float | None, digits: int, sign: str = "") -> Cell:
    """Return a number with so many decimals; a dash for None.

    Parameters
    ----------
    value : float or None
    digits : int
    sign : str
        ``+`` to show it always.

    Examples
    --------
    >>> number(1.25, 1).text, number(None, 1).text, number(-0.01, 1).text
    ('1.2', '–', '0.0')
    """
    if value is None:
        return Cell(text="–", kind="number")
    shown = f"{value:{sign}.{digits}f}"
    if float(shown) == 0:
        shown = f"{0.0:{sign}.{digits}f}"
    return Cell(text=shown.replace("-", "−"), kind="number")


def whole(value: int) -> str:
    """Return a whole number with a thin gap at each thousand.

    Parameters
    ----------
    value : int

    Examples
    --------
    >>> whole(33550336)
    '33\\u202f550\\u202f336'
    """
    return f"{value:,}".replace(",", "\u202f")


def counted(count: int, noun: str) -> str:
    """Return a count with its noun, in the plural where it is not one.

    Parameters
    ----------
    count : int
    noun : str

    Examples
    --------
    >>> counted(1, "ramp test"), counted(6, "ramp test")
    ('1 ramp test', '6 ramp tests')
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def verdict(holds: bool | None) -> Cell:
    """Return a verdict with its sign.

    Parameters
    ----------
    holds : bool or None
        None: not checked.
    """
    return Cell(text=f"{SIGNS[holds]} {verdict_words(holds)}", kind={True: "good", False: "bad", None: "open"}[holds])


def text_row(cells: Sequence[str]) -> tuple[Cell, ...]:
    """Return a row of words.

    Parameters
    ----------
    cells : sequence of str
    """
    return tuple(Cell(text=cell) for cell in cells)
