"""The pressure drop that a file's name states: ``ramp_4MPa_2.csv``, ``V7_dP2.csv``."""

import re
from collections.abc import Sequence

from dzdesign.core.units import parse_quantity

#: A pressure in the name of a file, and a bare number after dP.
WITH_UNIT = re.compile(r"(?<![\d.])(\d{1,9}(?:[.,]\d{1,9})?)[\s_]*(MPa|bar|kPa|psi)(?![A-Za-z])", re.IGNORECASE)
BARE = re.compile(r"dp[ _=-]?(\d{1,9}(?:[.,]\d{1,9})?)", re.IGNORECASE)
UNITS = {"mpa": "MPa", "bar": "bar", "kpa": "kPa", "psi": "psi"}
#: Pressures that differ by no more than this factor are one: nominal here, measured there.
SAME = 1.5


def pressure_in_name(name: str) -> str | None:
    """Return the one pressure that a file's name states, such as ``4 MPa``, or None.

    Examples
    --------
    >>> pressure_in_name("ramp_4MPa_2.csv"), pressure_in_name("ramp_2.csv")
    ('4 MPa', None)
    """
    stated = WITH_UNIT.findall(name)
    found = {(number.replace(",", "."), UNITS[unit.lower()]) for number, unit in stated}
    return " ".join(found.pop()) if len(found) == 1 else None


def claimed_pressures(names: Sequence[str]) -> list[float]:
    """Return the numbers by which files' names tell their pressures apart; none if one of them has none.

    In Pa where each states a unit, and else as they stand.

    Parameters
    ----------
    names : sequence of str
        Of the files; folders before them count for nothing.

    Examples
    --------
    >>> claimed_pressures(["a/10bar.csv", "b/2MPa.csv"]), claimed_pressures(["V7_dP2.csv", "4bar.csv"])
    ([1000000.0, 2000000.0], [2.0, 4.0])
    """
    last = [name.rpartition("/")[2] for name in names]
    stated = [pressure_in_name(name) for name in last]
    if all(stated):
        return [parse_quantity(text, "pressure", "a file's name") for text in stated if text]
    numbers = [text.split()[0] if text else _bare(name) for text, name in zip(stated, last, strict=True)]
    return [float(number) for number in numbers] if all(numbers) else []


def _bare(name: str) -> str:
    found = BARE.search(name)
    return found[1].replace(",", ".") if found else ""


def contradicts(name: str, dp: float) -> str:
    """Return the pressure that a file's name states if the measured one, in Pa, is plainly another; or nothing.

    Parameters
    ----------
    name : str
        Of the file.
    dp : float
        As measured, Pa.

    Examples
    --------
    >>> contradicts("ramp_5MPa.csv", 1e6), contradicts("ramp_5MPa.csv", 4.8e6)
    ('5 MPa', '')
    """
    stated = pressure_in_name(name)
    claimed = parse_quantity(stated, "pressure", "a file's name") if stated else dp
    return "" if claimed / SAME < dp < claimed * SAME or not stated else stated
