"""Missing samples, which are counted: numbers of a logger that has no value, such as -9999, and no signal."""

from collections import Counter
from collections.abc import Mapping

import numpy as np

from dzdesign.identify.reading.scaling import NO_CURRENT, Scaling

#: Such numbers; 9.91e37 is SCPI's.
PLACEHOLDERS = (-999.0, -999.25, -999.9, -9999.0, -99999.0, -999999.0, 999.0, 9999.0, 99999.0, 999999.0, 9.91e37)
#: Share of such a number that no other value in the column reaches: in a column of its size it may be a measurement.
FAR = 0.5
#: What no signal is called.
NO_SIGNAL = f"a current below {1e3 * NO_CURRENT:g} mA"


def without_placeholders(numbers: np.ndarray, *, rises: bool) -> tuple[np.ndarray, Counter[float]]:
    """Return numbers with NaN in place of those that mean no value, and how often each of those stood there.

    One is taken for that only where it lies far beyond all others: a flow of 9999 mL/min among others of its size
    is a flow. A column of nothing but 999 may be a pressure in kPa, one of nothing but -999 is none.

    The numbers are in the unit of the file; of the time, which `rises`, 999 s may well be a number after a pause.
    """
    found: Counter[float] = Counter()
    while (number := _outermost(numbers, rises=rises)) is not None:
        here = numbers == number
        numbers = np.where(here, np.nan, numbers)
        found[number] += int(np.count_nonzero(here))
    return numbers, found


def without_failed_signals(numbers: np.ndarray, scaling: Scaling) -> tuple[np.ndarray, Counter[str]]:
    """Return numbers with NaN in place of those of a broken wire, and how many those are."""
    with np.errstate(invalid="ignore"):
        failed = numbers < scaling.no_signal_below
    count = int(np.count_nonzero(failed))
    return (np.where(failed, np.nan, numbers), Counter({NO_SIGNAL: count})) if count else (numbers, Counter())


def describe_missing(found: Mapping[str, Mapping[float, int] | Mapping[str, int]]) -> str:
    """Return what was found, such as ``-9999 in 12 rows of 'dP_bar'``, or nothing."""
    return ", ".join(
        f"{number if isinstance(number, str) else f'{number:g}'} in {count} row{'s' if count > 1 else ''} of '{label}'"
        for label, counts in found.items()
        for number, count in counts.items()
    )


def _outermost(numbers: np.ndarray, *, rises: bool) -> float | None:
    """Return the least or the largest number, if it is one that means no value."""
    for end in (np.fmin.reduce(numbers, initial=np.inf), np.fmax.reduce(numbers, initial=-np.inf)):
        number = float(end)
        if number not in PLACEHOLDERS or (rises and number > 0):
            continue
        others = numbers[(numbers != number) & np.isfinite(numbers)]
        # What lies on the other side of zero counts for nothing.
        beyond = float((others / number).max()) if others.size else float(number > 0)
        if beyond < FAR:
            return number
    return None
