"""Units at the border: text such as ``"1 MPa"``, a column's unit or a signal becomes SI numbers, by way of pint."""

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, final

from dzdesign.core.errors import InputError, nearest, quoted

if TYPE_CHECKING:
    import pint

#: Of each quantity the SI unit in which it is kept inside, and the units to name when one is not understood.
_QUANTITIES = {
    "time": ("s", "s, ms, min"),
    "voltage": ("V", "V, mV"),
    "pressure": ("Pa", "MPa, bar, kPa, psi"),
    "flow": ("m**3/s", "L/min, Lmin, m3/s, gpm"),
    "length": ("m", "mm, m, in"),
    "frequency": ("Hz", "Hz, kHz, MHz"),
    "ratio": ("", "%"),
    "current": ("A", "mA, A"),
    "resistance": ("ohm", "ohm, kohm"),
    "inductance": ("H", "mH, H"),
    "curvature": ("V/Pa**2", "mV/MPa^2, mV/bar^2"),
}
SI_UNIT = {quantity: unit for quantity, (unit, _) in _QUANTITIES.items()}
EXAMPLES = {quantity: units for quantity, (_, units) in _QUANTITIES.items()}
#: Spellings of data-acquisition programs that pint does not read.
SPELLINGS = {
    **dict.fromkeys(("lmin", "l_min", "lpm", "l/min", "l/m", "liter/min", "litre/min", "ltr/min"), "L/min"),
    **dict.fromkeys(("gpm", "usgpm", "gal/min"), "gallon/minute"), "mlmin": "mL/min", "m3s": "m**3/s",
    "m3/h": "m**3/hour", "%": "percent", "pct": "percent", "vdc": "V", "volt": "V", "volts": "V",
    **dict.fromkeys(("kg/cm**2", "kgf/cm**2", "kp/cm**2"), "kgf/cm**2"), "n/mm**2": "N/mm**2",
    **dict.fromkeys(("sec", "sek", "sekunde", "sekunden"), "s"), "bar": "bar", "psi": "psi", "kpa": "kPa",
    "lph": "L/hour", "l/h": "L/hour",
}  # fmt: skip
#: Spellings whose case tells: mPa is a millipascal, and mpa may be either.
CASED = dict.fromkeys(("Mpa", "MPA"), "MPa")
#: Factors of the units that nearly every file and option has: pint, which takes half a second to begin, agrees.
FACTORS = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "min": ("time", 60.0), "V": ("voltage", 1.0), "mV": ("voltage", 1e-3),
    "MPa": ("pressure", 1e6), "bar": ("pressure", 1e5), "kPa": ("pressure", 1e3), "Pa": ("pressure", 1.0),
    "L/min": ("flow", 1.666666666666667e-05), "m": ("length", 1.0), "mm": ("length", 1e-3),
    "Hz": ("frequency", 1.0), "kHz": ("frequency", 1e3), "MHz": ("frequency", 1e6), "percent": ("ratio", 0.01),
    "A": ("current", 1.0), "mA": ("current", 1e-3), "ohm": ("resistance", 1.0), "H": ("inductance", 1.0),
    "mH": ("inductance", 1e-3),
}  # fmt: skip
#: What a pressure is relative to, which is no part of a drop: barg, bar(a), bar_g, MPa(g).
RELATIVE = re.compile(r"(bar|psi|[kMh]?pa|kgf?/cm[2²])(?:[gad]|[ _]?\([gad]\)|[ _][gad])", re.IGNORECASE)
#: A power: m3, dm³, min⁻¹, min-1.
POWER = re.compile(r"(?<=[a-zµ])(?:\^|\*\*)?(-?[123])(?![\w.])", re.IGNORECASE)
SUPERSCRIPTS = str.maketrans("⁻¹²³", "-123")
#: Flows at a gas's standard state.
OF_A_GAS = re.compile(r"(?:N|S|norm|std)\s?(?:l|m3|m³|cm3|cm³|cuft)\b.*|NL?PM|slpm|sccm|scfm", re.IGNORECASE)
#: Names with one-digit powers, times or per one another. A unit comes from a file, and pint computes what it reads:
#: ``9**9**9**9`` would never end.
FACTOR = r"[^\W\d]\w*(?:(?:\*\*|\^)-?\d)?"
UNIT = re.compile(rf"{FACTOR}(?:\s*[*/·\s]\s*{FACTOR})*")
LONGEST_UNIT, LONGEST_QUANTITY = 40, 200
#: May be 2000 or 2.0: a comma, or a point, before three digits.
THOUSANDS = {
    mark: re.compile(rf"(?<!\d)(?<!\d[.,])[1-9]\d{{0,2}}[{mark}]\d{{3}}(?!,?\d)", re.ASCII) for mark in (",", ".")
}
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)


@lru_cache(maxsize=1)
def _registry() -> "pint.UnitRegistry":
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def si_factor(unit: str, quantity: str) -> float:
    """Return the factor that turns a value in `unit` into the SI unit of `quantity`, a key of `SI_UNIT`.

    A unit is as a person or a data logger writes it: ``"bar"``, ``"L/min"``, ``"Lmin"``.

    Examples
    --------
    >>> round(si_factor("bar", "pressure"))
    100000
    """
    try:
        return _factor(unit, quantity)
    except Exception as error:  # pint and its tokenizer raise many kinds; all mean "not this unit"
        if quantity == "flow" and OF_A_GAS.fullmatch(unit[:LONGEST_UNIT].strip()):
            raise InputError(
                f"'{unit[:LONGEST_UNIT]}' is the flow of a gas at its standard state; if it is a liquid's flow, say "
                "its unit, such as L/min"
            ) from error
        raise InputError(
            f"'{unit[:LONGEST_UNIT]}' is not a unit of {quantity} that dzdesign knows"
            f"{nearest(unit, EXAMPLES[quantity].split(', '))}; expected for example {EXAMPLES[quantity]}"
        ) from error


@lru_cache(maxsize=1024)
def measures(unit: str, quantity: str) -> bool:
    """Tell whether a text is a unit of a quantity, a key of `SI_UNIT`.

    Examples
    --------
    >>> measures("bar", "pressure"), measures("bar", "flow")
    (True, False)
    """
    try:
        return bool(_factor(unit, quantity))
    except Exception:  # as in si_factor
        return False


def _factor(unit: str, quantity: str) -> float:
    spelled = plainly_spelled(unit)
    if len(spelled) > LONGEST_UNIT or not UNIT.fullmatch(spelled):
        raise ValueError(f"{spelled!r} is not a product of units")
    if spelled in FACTORS:
        of, factor = FACTORS[spelled]
        if of != quantity:
            raise ValueError(f"{spelled!r} is a unit of {of}")
        return factor
    # A unit scales from zero: gauge offsets (degC, dBm) have no place in these quantities.
    return float(_registry().Quantity(1.0, spelled).to(SI_UNIT[quantity]).magnitude)


def plainly_spelled(unit: str) -> str:
    """Return a unit as pint reads it, whatever a person or logger writes.

    Examples
    --------
    >>> [plainly_spelled(unit) for unit in ("dm³/min", "L·min⁻¹", "l/min.", "MPa(g)", "KPA", "mPa")]
    ['dm**3/min', 'L·min**-1', 'L/min', 'MPa', 'kPa', 'mPa']
    """
    bare = unit.strip()
    if len(bare) > LONGEST_UNIT:
        return bare
    bare = without_reference(bare.removesuffix(".").translate(SUPERSCRIPTS))
    powered = POWER.sub(r"**\1", bare)
    for spelled in (bare, powered):
        found = CASED.get(spelled) or SPELLINGS.get(spelled.lower())
        if found:
            return found
    return powered


def without_reference(unit: str) -> str:
    """Return a unit of pressure without what it is relative to.

    Examples
    --------
    >>> [without_reference(unit) for unit in ("barg", "bar(a)", "bar_g", "MPa(g)", "mA")]
    ['bar', 'bar', 'bar', 'MPa', 'mA']
    """
    found = RELATIVE.fullmatch(unit)
    return found[1] if found else unit


def refuse_thousands(text: str, what: str, *, points: bool = False) -> None:
    """Refuse a number whose comma may be a decimal one or stand between thousands, as in ``2,000``.

    ``0,125`` and ``2,0`` can only be decimals. With `points`, a point is in doubt too, as in a range that is copied
    from a data sheet: ``0..25.000 kPa``. `what` begins the message, such as ``--dp is '2,000 kPa'``.
    """
    found = THOUSANDS[","].search(text) or (THOUSANDS["."].search(text) if points else None)
    if found:
        whole, decimal = re.sub("[.,]", "", found[0]), float(found[0].replace(",", "."))
        raise InputError(f"{what}: '{found[0]}' may be {whole} or {decimal}; write {whole} or {decimal}")


def parse_quantity(text: str, quantity: str, option: str) -> float:
    """Read a number with its unit, such as ``"0.6 L/min"``, and return it in SI; a message names the `option`.

    Zero needs no unit.

    Examples
    --------
    >>> parse_quantity("1 MPa", "pressure", "--dp0")
    1000000.0
    """
    example = EXAMPLES[quantity].split(",")[0]
    if not isinstance(text, str):  # from a notebook
        raise InputError(f"{option}: expected text with a unit such as '1 {example}', got {quoted(text)}")
    words = text.strip().replace(",", ".")
    if len(text) > LONGEST_QUANTITY:
        raise InputError(f"{option} is {quoted(text)}, expected a number and a unit such as '1 {example}'")
    refuse_thousands(text, f"{option} is '{text}'")
    number = NUMBER.match(words)
    unit = words[number.end() :].strip() if number else ""
    if number is None or unit[:1] == ".":
        raise InputError(f"{option} is '{text}', expected a number and a unit such as '1 {example}'")
    if not unit and float(number.group()) == 0:
        return 0.0
    if not unit:
        raise InputError(f"{option} is '{text}' without a unit; write for example '{text} {example}'")
    try:
        value = float(number.group()) * si_factor(unit, quantity)
    except InputError as error:
        meant = f"; write for example '{number.group()} {example}'"
        raise InputError(f"{option} is '{text}': {error}{meant}") from error
    if not math.isfinite(value):
        raise InputError(f"{option} is '{text}', more than a number can hold; expected for example '1 {example}'")
    return value


def chance(p: float) -> str:
    """Say a p-value; one so small that only rounding is in its digits is said to be below.

    Examples
    --------
    >>> chance(0.0312), chance(3.6e-21)
    ('p = 0.031', 'p < 1e-9')
    """
    return f"p = {p:.2g}" if p >= 1e-9 else "p < 1e-9"


#: A signal as an engineer writes it, such as ``4..20 mA on 150 ohm = -10..10 V``: one reading for all options. Beyond
#: this length it is none, and matching it would take the square of its length.
LONGEST_SIGNAL = 120
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
    match = SIGNAL.fullmatch(text) if len(text) <= LONGEST_SIGNAL else None
    if match is None:
        return None
    refuse_thousands(text, what, points=points)
    meaning = None
    if match["top"]:
        meaning = Meaning(bottom=_exact(match["bottom"] or "0"), top=_exact(match["top"]), unit=match["means"].strip())
    shunt = match["shunt"] and _exact(match["shunt"]) * _exact_factor(match["ohm"].replace("Ω", "ohm"), "resistance")
    offset = _exact(match["offset"]) * _exact_factor(match["volt"], "voltage") if match["offset"] else Fraction(0)
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


def _exact_factor(unit: str, quantity: str) -> Fraction:
    """Return the exact factor from a unit to SI."""
    return Fraction(repr(si_factor(unit, quantity)))
