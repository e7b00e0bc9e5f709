"""Texts of options of an amplifier's file in; the exact numbers that they stand for out."""

from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import percent, quantity

#: A larger share of command is no threshold of a zero command.
LARGEST_THRESHOLD = 0.3
PA_IN_MPA = 10**6


def given_dp_MPa(text: str | None) -> Fraction | None:
    """Return the pressure drop of ``--table-dp``, MPa; None where it was not given.

    Examples
    --------
    >>> given_dp_MPa("25 bar"), given_dp_MPa(None)
    (Fraction(5, 2), None)
    """
    return None if text is None else Fraction(repr(quantity("pressure")(text, "--table-dp"))) / PA_IN_MPA


def given_threshold(text: str | None) -> Fraction | None:
    """Return the share of command of ``--threshold``; None where it was not given.

    Examples
    --------
    >>> given_threshold("0.5 %"), given_threshold(None)
    (Fraction(1, 200), None)
    """
    if text is None:
        return None
    threshold = percent("0.5 %")(text, "--threshold")
    if threshold > LARGEST_THRESHOLD:
        raise InputError(
            f"--threshold is '{text}', expected at most {LARGEST_THRESHOLD:.0%}: the valve rests at every command up "
            "to it"
        )
    return Fraction(repr(threshold))
