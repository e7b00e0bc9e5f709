"""Units at the border: text such as ``"1 MPa"`` or a column's unit becomes an SI number, by way of pint."""

from functools import lru_cache
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError

if TYPE_CHECKING:
    import pint

#: The SI unit in which each quantity is kept inside, and the units to name when one is not understood.
SI_UNIT = {"time": "s", "voltage": "V", "pressure": "Pa", "flow": "m**3/s", "length": "m", "ratio": ""}
EXAMPLES = {
    "time": "s, ms, min",
    "voltage": "V, mV",
    "pressure": "MPa, bar, kPa, psi",
    "flow": "L/min, Lmin, m3/s, gpm",
    "length": "mm, m, in",
    "ratio": "%",
}
#: Spellings of data-acquisition programs that pint does not read.
SPELLINGS = {
    "lmin": "L/min", "l_min": "L/min", "lpm": "L/min", "l/min": "L/min", "gpm": "gallon/minute",
    "m3/s": "m**3/s", "m3s": "m**3/s", "m3/h": "m**3/hour", "cm3/s": "cm**3/s", "%": "percent",
    "pct": "percent",
}  # fmt: skip


@lru_cache(maxsize=1)
def _registry() -> "pint.UnitRegistry":
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def si_factor(unit: str, quantity: str) -> float:
    """Return the factor that turns a value in `unit` into the SI unit of `quantity`.

    Parameters
    ----------
    unit : str
        A unit as written by a person or a data logger: ``"bar"``, ``"L/min"``, ``"Lmin"``.
    quantity : str
        A key of `SI_UNIT`.

    Raises
    ------
    InputError
        If the unit is unknown or does not measure `quantity`.

    Examples
    --------
    >>> round(si_factor("bar", "pressure"))
    100000
    """
    spelled = SPELLINGS.get(unit.strip().lower(), unit.strip())
    try:
        # A unit scales from zero: gauge offsets (degC, dBm) have no place in these quantities.
        factor = _registry().Quantity(1.0, spelled).to(SI_UNIT[quantity]).magnitude
    except Exception as error:  # pint and its tokenizer raise many kinds; all mean "not this unit"
        raise InputError(
            f"'{unit}' is not a unit of {quantity} that dzdesign knows (expected for example {EXAMPLES[quantity]})"
        ) from error
    return float(factor)


def parse_quantity(text: str, quantity: str, option: str) -> float:
    """Read a number with its unit, such as ``"0.6 L/min"``, and return it in SI.

    Parameters
    ----------
    text : str
        Number, then unit.
    quantity : str
        A key of `SI_UNIT`.
    option : str
        The option or key the text came from, for the message.

    Raises
    ------
    InputError
        If the number or the unit can't be read.

    Examples
    --------
    >>> parse_quantity("1 MPa", "pressure", "--dp0")
    1000000.0
    """
    words = text.strip().replace(",", ".")
    cut = len(words)
    while cut and not (words[cut - 1].isdigit() or words[cut - 1] == "."):
        cut -= 1
    unit = words[cut:].strip()
    try:
        value = float(words[:cut])
    except ValueError as error:
        raise InputError(
            f"{option} is '{text}', expected a number and a unit such as '1 {EXAMPLES[quantity].split(',')[0]}'"
        ) from error
    if not unit:
        example = f"{text} {EXAMPLES[quantity].split(',')[0]}"
        raise InputError(f"{option} is '{text}' without a unit; write for example '{example}'")
    return value * si_factor(unit, quantity)
