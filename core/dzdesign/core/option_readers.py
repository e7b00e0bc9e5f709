"""What turns the text of an option into the value that a stage works with; the second argument names the option."""

import contextlib
import re
from collections.abc import Callable

from dzdesign.core.errors import InputError, quoted
from dzdesign.core.units import parse_quantity


def quantity(kind: str) -> Callable[[str, str], float]:
    """Return what reads a number with its unit, in SI."""
    return lambda text, option: parse_quantity(text, kind, option)


def number(expected: str, between: tuple[float, float] | None = None) -> Callable[[str | float, str], float]:
    """Return what reads a number without a unit, inside `between`; a message says what is `expected`."""

    def read(text: str | float, option: str) -> float:
        with contextlib.suppress(ValueError):
            value = float(text)
            if between is None or between[0] < value < between[1]:
                return value
        raise InputError(f"{option} is {quoted(text)}, expected {expected}")

    return read


def whole_number(expected: str, least: int = 0, digits: int = 6) -> Callable[[str | int, str], int]:
    """Return what reads a whole number of at most so many digits; a message says what is `expected`."""

    def read(text: str | int, option: str) -> int:
        if not re.fullmatch(rf"\d{{1,{digits}}}", str(text), re.ASCII) or int(text) < least:
            raise InputError(f"{option} is {quoted(text)}, expected {expected}")
        return int(text)

    return read


def percent_range(of: str) -> Callable[[str, str], tuple[float, float]]:
    """Return what reads two percentages such as ``12-50``, as shares; `of` says of what, with an example."""
    # Digits and blanks without an end would be matched in the square of their number.
    digits = r"\s{0,9}(\d{1,9}(?:\.\d{0,15})?)\s{0,9}%?\s{0,9}"

    def read(text: str, option: str) -> tuple[float, float]:
        ends = re.fullmatch(f"{digits}-{digits}", text, re.ASCII)
        if ends is None:
            raise InputError(f"{option} is {quoted(text)}, expected two per cents of {of}")
        return float(ends[1]) / 100, float(ends[2]) / 100

    return read
