"""Missing samples, which are counted: what a logger writes where it has no value, in text or numbers, and no signal."""

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import polars as pl

#: Counts of missing samples of one column: kind of missing sample, as `warnings.toml` words it, and what stands there.
Missing = Counter[tuple[str, str]]

#: What a spreadsheet writes where it has no value, in several languages. It begins as a comment does, and is none.
OF_A_SPREADSHEET = r"#(?:N/?[AD]|NV|(?:DIV/0|VALUE|WERT|VALEUR|VALOR|REF|BEZUG|NUM|ZAHL|NULL)!|NAME\?)"
#: What else stands for no value. A blank cell and ``nan`` do too, and are not counted: they say nothing but that.
OF_A_LOGGER = (
    r"[-\u2013\u2014]+|\*+|\?+|#{2,}|[<(\[]?(?:n/?a|n\.\s?a\.?|null|none|nil|void|missing|bad|err(?:or)?|fehler|fault"
    r"|invalid|ungültig|no ?(?:data|value|signal))[>)\]]?|[-+]?nan\(\w*\)|[-+]?1\.#(?:[QS]NAN|IND)\d*"
)
#: A reading beyond the range of a meter or channel.
OF_AN_OVERLOAD = (
    r"[-+]?\s?(?:o\.?l\.?|ovld|ovfl?|ovr|over|over[ -]?(?:load|flow|range)|under[ -]?(?:load|flow|range)|überlauf"
    r"|hi(?:gh)?|lo(?:w)?|inf(?:inity)?|\u221e|1\.#(?:INF|J)\d*)|\+{2,}|>{2,}|<{2,}"
)
NO_VALUE = rf"(?i)^(?:{OF_A_SPREADSHEET}|{OF_A_LOGGER}|{OF_AN_OVERLOAD})$"
_NO_VALUE, _OVERLOAD = re.compile(NO_VALUE), re.compile(rf"(?i)^(?:{OF_AN_OVERLOAD})$")
#: Numbers that stand for no value; 9.91e37 is SCPI's.
PLACEHOLDERS = (
    -99.99, -999.0, -999.25, -999.9, -9999.0, -99999.0, -999999.0,
    999.0, 999.9, 9999.0, 99999.0, 999999.0, 9.91e37,
)  # fmt: skip
#: The ends of a converter's range. No valve has a number from the last on: SCPI's 9.9e37, the largest float, infinity.
ENDS_OF_CONVERTERS, OVERFLOW = (-32768.0, 32767.0, 65535.0), 9e36
#: Share of such a number that no other value in the column reaches: in a column of its size it may be a measurement.
FAR = 0.5
#: A signal from 4 mA on has no current below this, A: a broken wire, or a channel that is off. NAMUR NE 43
#: calls less than 3.6 mA failed, but noise about a zero of 3.6 mA, cut off on one side, would raise thresholds.
NO_CURRENT = 0.002
#: What no signal is called.
NO_SIGNAL = f"a current below {1e3 * NO_CURRENT:g} mA"


def is_no_value(cell: str) -> bool:
    """Tell whether a cell of text stands for no value.

    Examples
    --------
    >>> [is_no_value(cell) for cell in ("---", "OL", "+OVER", "#N/A", "1.#QNAN", "-1", "Q")]
    [True, True, True, True, True, False, False]
    """
    return _NO_VALUE.match(cell) is not None


def without_markers(texts: "pl.Series", declared: Collection[str] = ()) -> "tuple[pl.Series, Missing]":
    """Return cells, blank where one stands for no value or is one of those `declared`, and what stood there."""
    marked = texts.str.contains(NO_VALUE).fill_null(False)
    if declared:
        marked |= texts.str.to_lowercase().is_in([each.lower() for each in declared]).fill_null(False)
    if not marked.any():
        return texts, Missing()
    found = Counter(texts.filter(marked).to_list())
    kinds = {text: "overload" if _OVERLOAD.match(text) else "marker" for text in found}
    return texts.set(marked, ""), Missing({(kinds[text], text): count for text, count in found.items()})


def without_placeholders(
    numbers: np.ndarray, *, rises: bool, declared: Sequence[float] = ()
) -> tuple[np.ndarray, Missing]:
    """Return numbers with NaN in place of those that mean no value, and how often each of those stood there.

    One is taken for that only where it lies far beyond all others: a flow of 9999 mL/min among others of its size
    is a flow. A column of nothing but 999 may be a pressure in kPa, one of nothing but -999 is none. What is `declared`
    to be none, or is no number of a valve at all, is none in any column.

    The numbers are in the unit of the file; of the time, which `rises`, 999 s may well be a number after a pause.
    """
    found = Missing()
    with np.errstate(invalid="ignore"):
        outside = (np.abs(numbers) >= OVERFLOW) & (numbers != PLACEHOLDERS[-1]) | np.isin(numbers, declared)
    if outside.any():
        for number, count in zip(*np.unique(numbers[outside], return_counts=True), strict=True):
            found["number" if number in declared else "overload", f"{number:g}"] += int(count)
        numbers = np.where(outside, np.nan, numbers)
    while (number := _outermost(numbers, rises=rises)) is not None:
        here = numbers == number
        numbers = np.where(here, np.nan, numbers)
        kind = "overload" if number in ENDS_OF_CONVERTERS else "number"
        found[kind, f"{number:g}"] += int(np.count_nonzero(here))
    return numbers, found


def without_failed_signals(numbers: np.ndarray, least: float) -> tuple[np.ndarray, Missing]:
    """Return numbers with NaN in place of those of a broken wire, which lie below the least, and how many those are."""
    with np.errstate(invalid="ignore"):
        failed = numbers < least
    count = int(np.count_nonzero(failed))
    if not count:
        return numbers, Missing()
    return np.where(failed, np.nan, numbers), Missing({("signal", NO_SIGNAL): count})


def describe_missing(found: Mapping[str, Missing]) -> dict[str, str]:
    """Return what was found, such as ``-9999 in 12 rows of 'dP_bar'``, by kind; of columns without one nothing."""
    words: dict[str, list[str]] = {}
    for label, counts in found.items():
        for (kind, what), count in counts.items():
            words.setdefault(kind, []).append(f"{what} in {count} row{'s' if count > 1 else ''} of '{label}'")
    return {kind: ", ".join(each) for kind, each in words.items()}


def _outermost(numbers: np.ndarray, *, rises: bool) -> float | None:
    """Return the least or the largest number, if it is one that means no value."""
    for end in (np.fmin.reduce(numbers, initial=np.inf), np.fmax.reduce(numbers, initial=-np.inf)):
        number = float(end)
        if number not in (*PLACEHOLDERS, *ENDS_OF_CONVERTERS) or (rises and number > 0):
            continue
        others = numbers[(numbers != number) & np.isfinite(numbers)]
        # What lies on the other side of zero counts for nothing.
        beyond = float((others / number).max()) if others.size else float(number > 0)
        if beyond < FAR:
            return number
    return None
