"""Tables of the report: cells with a meaning, not with markup."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.verdicts import NOT_CHECKED, verdict_words

#: The sign beside a verdict, so that its colour is not its only carrier, and its kind.
VERDICTS = {True: ("✓", "good"), False: ("✗", "bad"), None: ("?", "open")}
Item = TypeVar("Item")


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One cell, `more` on a second line, smaller.

    Its kind is text, finding (a sentence, in which backticks stand about commands), number, code, symbol (code on one
    line), hash (on two), or the verdict good, bad or open.
    """

    text: str
    kind: str = "text"
    more: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table; `csv` holds all its rows, to be downloaded under its name, `notes` what marks in its cells point to."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    csv: str = ""
    name: str = ""
    notes: tuple[str, ...] = ()


def table_of(
    caption: str,
    items: Iterable[Item],
    *columns: tuple[str, Callable[[Item], Cell | str]],
    csv: str = "",
    name: str = "",
    notes: Sequence[str] = (),
) -> Table:
    """Return a table with a row an item; a column is its heading and what makes a cell of an item."""
    return Table(
        caption=caption,
        columns=tuple(heading for heading, _ in columns),
        rows=tuple(tuple(_cell(made(item)) for _, made in columns) for item in items),
        csv=csv,
        name=name,
        notes=tuple(notes),
    )


def _cell(cell: Cell | str) -> Cell:
    return cell if isinstance(cell, Cell) else Cell(text=cell)


def number(value: float | None, digits: int, sign: str = "") -> Cell:
    """Return a number with so many decimals, ``+`` before it to show its sign always; a dash for None.

    Examples
    --------
    >>> number(1.25, 1).text, number(None, 1).text, number(-0.01, 1).text
    ('1.2', '–', '0.0')
    """
    if value is None:
        return in_number_font("–")
    text = f"{value:{sign}.{digits}f}"
    if float(text) == 0:
        text = f"{0.0:{sign}.{digits}f}"
    return in_number_font(text.replace("-", "−"))


def recorded(value: float | None, form: str, units: RecordedUnits) -> Cell:
    """Return a number in the unit of the recordings; `form` is that of `RecordedUnits.number`.

    Examples
    --------
    >>> recorded(1.25, ".1f V", RecordedUnits()).text, recorded(None, ".1f V", RecordedUnits()).text
    ('1.2', '–')
    """
    if value is None:
        return in_number_font("–")
    text = units.number(value, form)
    return in_number_font(text.replace("-", "−") if text.strip("-0.") else text.removeprefix("-"))


def finding(text: str) -> Cell:
    """Return a sentence that states a finding: what stands between backticks is a command."""
    return Cell(text=text, kind="finding")


def in_number_font(text: str) -> Cell:
    """Return a text set as numbers are: such as a number with its unit, or a range."""
    return Cell(text=text, kind="number")


def from_to(values: Iterable[float | None], form: str) -> str:
    """Return from where to where the known values run; a single one where both ends read alike.

    Examples
    --------
    >>> from_to([1.0, 5.0, 2.0], ".2f"), from_to([2.5, None], ".1f"), from_to([], ".1f")
    ('1.00 to 5.00', '2.5', 'not known')
    """
    known = [value for value in values if value is not None]
    return " to ".join(dict.fromkeys(f"{end(known):{form}}" for end in (min, max))) if known else "not known"


def whole(value: int) -> str:
    """Return a whole number with a thin gap at each thousand.

    Examples
    --------
    >>> whole(33550336)
    '33\\u202f550\\u202f336'
    """
    return f"{value:,}".replace(",", "\u202f")


def counted(count: int, noun: str) -> str:
    """Return a count with its noun, in the plural where it is not one.

    Examples
    --------
    >>> counted(1, "ramp test"), counted(6, "ramp test")
    ('1 ramp test', '6 ramp tests')
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def unasked(words: str) -> Cell:
    """Return what stands in place of a verdict on what was not tried."""
    return Cell(text=f"{VERDICTS[None][0]} {words}", kind="open" if words == NOT_CHECKED else "")


def verdict(holds: bool | None) -> Cell:
    """Return a verdict with its sign; None: not checked."""
    sign, kind = VERDICTS[holds]
    return Cell(text=f"{sign} {verdict_words(holds)}", kind=kind)
