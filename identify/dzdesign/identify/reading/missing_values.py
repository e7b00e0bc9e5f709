"""Numbers that loggers write where they have no value, such as -9999: missing samples, which are counted and said."""

from collections import Counter
from typing import final

import numpy as np

#: Such numbers; 9.91e37 is SCPI's.
NO_VALUES = (-999.0, -999.25, -999.9, -9999.0, -99999.0, -999999.0, 999.0, 9999.0, 99999.0, 999999.0, 9.91e37)
#: Share of such a number that no other value in the column reaches: in a column of its size it may be a measurement.
FAR = 0.5


@final
class NoValues:
    """What of one file was taken for missing samples, from block to block."""

    def __init__(self) -> None:
        self._found: Counter[tuple[float, str]] = Counter()

    def without(self, numbers: np.ndarray, label: str, *, rises: bool) -> np.ndarray:
        """Return numbers with NaN in place of those that mean no value.

        One is taken for that only where it lies far beyond all others: a flow of 9999 mL/min among others of its size
        is a flow. A column of nothing but 999 may be a pressure in kPa, one of nothing but -999 is none.

        Parameters
        ----------
        numbers : (N,) array
            Of the next rows, in the unit of the file.
        label : str
            Of their column.
        rises : bool
            True for the time, which may well go on after a pause at 999 s.
        """
        while (number := _outermost(numbers, rises=rises)) is not None:
            here = numbers == number
            numbers = np.where(here, np.nan, numbers)
            self._found[number, label] += int(np.count_nonzero(here))
        return numbers

    def said(self) -> str:
        """Return what was found, such as ``-9999 in 12 rows of 'dP_bar'``, or nothing."""
        return ", ".join(
            f"{number:g} in {count} row{'s' if count > 1 else ''} of '{label}'"
            for (number, label), count in self._found.items()
        )


def _outermost(numbers: np.ndarray, *, rises: bool) -> float | None:
    """Return the least or the largest number, if it is one that means no value."""
    for end in (np.fmin.reduce(numbers, initial=np.inf), np.fmax.reduce(numbers, initial=-np.inf)):
        number = float(end)
        if number not in NO_VALUES or (rises and number > 0):
            continue
        others = numbers[(numbers != number) & np.isfinite(numbers)]
        # What lies on the other side of zero counts for nothing.
        beyond = float((others / number).max()) if others.size else float(number > 0)
        if beyond < FAR:
            return number
    return None
