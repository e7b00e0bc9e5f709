"""Signals as an engineer writes them, such as ``4..20 mA on 150 ohm = -10..10 V``: one reading for all options."""

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import final

from dzdesign.core.units import refuse_thousands, si_factor

#: Beyond this it is none, and matching it would take the square of its length.
LONGEST = 120
_NUMBER = r"[-+]?\d{1,9}(?:[.,]\d{1,9})?"
_POSITIVE = r"\d{1,9}(?:[.,]\d{1,9})?"
SIGNAL = re.compile(
    rf"\s*(?P<low>{_NUMBER})\s*\.\.\s*(?P<high>{_NUMBER})(?:\s*(?!on\b|x\b)(?P<unit>[^\d\s=+.,_-][^\s=+,]*))?"
    rf"(?:\s+on\s+(?P<shunt>{_POSITIVE})\s*(?P<ohm>[A-Za-zΩ]+))?"
    rf"(?:\s+x\s+(?P<gain>{_POSITIVE}))?"
    rf"(?:\s*\+\s*(?P<offset>{_POSITIVE})\s*(?P<volt>[A-Za-z]+))?"
    rf"(?:\s*=\s*(?:(?P<bottom>{_NUMBER})\s*\.\.\s*)?(?P<top>{_NUMBER})\s*(?P<means>\D\S*(?:\s\S+)*))?\s*",
    re.ASCII,
)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Meaning:
    """What a signal's ends stand for, in a unit as it was written; a single value is that of the upper end."""

    bottom: Fraction
    top: Fraction
    unit: str


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SignalRange:
    """``LOW..HIGH [UNIT] [on SHUNT ohm] [x GAIN] [+ OFFSET V] [= [BOTTOM..]TOP UNIT]``, as it was written."""

    text: str
    #: Ends, in `unit`; empty for a bare number, such as a duty cycle.
    low: Fraction
    high: Fraction
    unit: str
    #: Resistor that makes a voltage of a current, ohm; None without one.
    shunt_ohm: Fraction | None
    #: Of the attenuator behind it, and what is added, V.
    gain: Fraction
    offset_V: Fraction
    meaning: Meaning | None

    @property
    def is_wired(self) -> bool:
        """Whether it says how the signal becomes the voltage at a converter's pin."""
        return self.shunt_ohm is not None or self.gain != 1 or self.offset_V != 0


def read_signal_range(text: str, what: str, *, points: bool = False) -> SignalRange | None:
    """Read a signal; None if it is none. `what` and `points` are those of `refuse_thousands`.

    Raises
    ------
    InputError
        If a unit of the wiring is none, or a number may have thousands.

    Examples
    --------
    >>> read_signal_range("4..20 mA on 150 ohm = -10..10 V", "--command-signal").meaning
    Meaning(bottom=Fraction(-10, 1), top=Fraction(10, 1), unit='V')
    """
    match = SIGNAL.fullmatch(text) if len(text) <= LONGEST else None
    if match is None:
        return None
    refuse_thousands(text, what, points=points)
    meaning = None
    if match["top"]:
        meaning = Meaning(bottom=_exact(match["bottom"] or "0"), top=_exact(match["top"]), unit=match["means"].strip())
    shunt = match["shunt"] and _exact(match["shunt"]) * _factor(match["ohm"].replace("Ω", "ohm"), "resistance")
    offset = _exact(match["offset"]) * _factor(match["volt"], "voltage") if match["offset"] else Fraction(0)
    return SignalRange(
        text=text,
        low=_exact(match["low"]),
        high=_exact(match["high"]),
        unit=match["unit"] or "",
        shunt_ohm=shunt or None,
        gain=_exact(match["gain"] or "1"),
        offset_V=offset,
        meaning=meaning,
    )


def _exact(number: str) -> Fraction:
    return Fraction(number.replace(",", "."))


def _factor(unit: str, quantity: str) -> Fraction:
    """Return the exact factor from a unit to SI."""
    return Fraction(repr(si_factor(unit, quantity)))
