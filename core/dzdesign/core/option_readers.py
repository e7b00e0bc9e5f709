"""Readers that turn the text of an option into the value for a stage; the second argument names the option."""

import contextlib
import re
from collections.abc import Callable

from dzdesign.core.errors import InputError, quoted
from dzdesign.core.units import EXAMPLES, parse_quantity


def quantity(kind: str) -> Callable[[str, str], float]:
    """Return what reads a number with its unit, in SI."""
    return lambda text, option: parse_quantity(text, kind, option)


def with_tolerance(kind: str) -> Callable[[str, str], tuple[float, float | None]]:
    """Return what reads a quantity and, after ± or +-, its tolerance, such as ``0.1 s +- 0.02 s``; None without one.

    The tolerance may be a percentage of the quantity.

    Examples
    --------
    >>> with_tolerance("time")("0.1 s ± 20 ms", "--lag"), with_tolerance("time")("0.1 s", "--lag")
    ((0.1, 0.02), (0.1, None))
    >>> with_tolerance("time")("0.1 s +- 30 %", "--lag")
    (0.1, 0.03)
    """

    def read(text: str, option: str) -> tuple[float, float | None]:
        if not isinstance(text, str):  # from a notebook
            return parse_quantity(text, kind, option), None
        value, *tolerance = re.split(r"\+/?-|±", text)
        if len(tolerance) > 1:
            raise InputError(f"{option} is {quoted(text)}, expected one tolerance, such as '0.1 s +- 0.02 s'")
        read_value = parse_quantity(value.strip(), kind, option)
        if not tolerance:
            return read_value, None
        stated = tolerance[0].strip()
        if stated.endswith("%"):
            return read_value, percent("20 %")(stated, option) * read_value
        if re.fullmatch(r"[\d.,]*[1-9][\d.,]*", stated):
            example = f"'{stated} {EXAMPLES[kind].split(',')[0]}' or '{stated} %'"
            raise InputError(f"{option}: the tolerance {quoted(stated)} has no unit; write {example}")
        return read_value, parse_quantity(stated, kind, option)

    return read


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


def percent(example: str, *, signed: bool = False) -> Callable[[str, str], float]:
    """Return what reads a percentage such as ``0.1 %`` as a share; the sign % must stand there, but for zero."""

    def read(text: str, option: str) -> float:
        found = re.fullmatch(rf"({'-?' if signed else ''}\d{{1,9}}(?:\.\d{{0,15}})?)\s?(%?)", text, re.ASCII)
        if found is None:
            raise InputError(f'{option} is {quoted(text)}, expected a percentage such as "{example}"')
        number = float(found[1])
        if number and not found[2]:
            meant = "" if abs(number) > 1 else f', or "{100 * number:.10g} %" if it is a share'
            raise InputError(f'{option} is {quoted(text)} without %; write "{found[1]} %"{meant}')
        return number / 100

    return read


def percent_range(of: str) -> Callable[[str, str], tuple[float, float]]:
    """Return what reads two percentages such as ``12-50``, as shares; `of` says of what, with an example."""
    # Digits and blanks without an end would be matched in the square of their number.
    digits = r"\s{0,9}(\d{1,9}(?:\.\d{0,15})?)\s{0,9}%?\s{0,9}"

    def read(text: str, option: str) -> tuple[float, float]:
        ends = re.fullmatch(f"{digits}-{digits}", text, re.ASCII)
        if ends is None:
            raise InputError(f"{option} is {quoted(text)}, expected two percentages of {of}")
        return float(ends[1]) / 100, float(ends[2]) / 100

    return read


def quantity_range(kind: str) -> Callable[[str, str], tuple[float, float]]:
    """Return what reads two numbers with one unit, such as ``1..5 MPa``, or one for both, in SI.

    Examples
    --------
    >>> quantity_range("time")("20..200 s", "--ramp-times"), quantity_range("time")("1 min", "--ramp-times")
    ((20.0, 200.0), (60.0, 60.0))
    """

    def read(text: str, option: str) -> tuple[float, float]:
        first, dots, last = text.partition("..") if isinstance(text, str) else (text, "", "")
        if not dots:
            only = parse_quantity(first, kind, option)
            return only, only
        unit = re.sub(r"^[\s\d.,+-]*", "", last)
        if not unit or not first.strip():
            example = EXAMPLES[kind].split(",")[0]
            raise InputError(f"{option} is {quoted(text)}, expected two numbers and a unit such as '1..5 {example}'")
        lower = first if re.search(r"[^\W\d]", first) else f"{first} {unit}"
        low, high = parse_quantity(lower, kind, option), parse_quantity(last, kind, option)
        if low > high:
            raise InputError(f"{option} is {quoted(text)}, expected the lower end first")
        return low, high

    return read
