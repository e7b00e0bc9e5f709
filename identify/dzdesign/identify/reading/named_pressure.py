"""The pressure drop that a file's name states: ``ramp_4MPa.csv``, ``V7_dP2.csv``; or may state: ``ramp_2_5MPa.csv``."""

import re
from collections.abc import Sequence

from dzdesign.core.units import parse_quantity
from dzdesign.identify.constants import LARGEST_DP, SMALLEST_DP

#: A number, and one that may be its whole part: names of files often can't hold a point.
_NUMBER = r"(?:(?<!\d)(\d{1,9})([_p-]))?(?<![\d.])(\d{1,9}(?:[.,]\d{1,9})?)"
#: A pressure in the name of a file, and a bare number after dP.
WITH_UNIT = re.compile(rf"{_NUMBER}[\s_]*(MPa|bar|kPa|psi)(?![A-Za-z])", re.IGNORECASE)
BARE = re.compile(rf"dp[ _=-]?{_NUMBER}", re.IGNORECASE)
UNITS = {"mpa": "MPa", "bar": "bar", "kpa": "kPa", "psi": "psi"}
#: Pressures that differ by no more than this factor are one: nominal here, measured there.
SAME = 1.5


def pressures_in_name(name: str) -> tuple[str, ...]:
    """Return the pressures as which a file's name can be read: none, one, or the decimal one and the other.

    ``2p5`` is a decimal number; ``2_5MPa`` may be 2.5 MPa, or 5 MPa after a number of its own, so may ``0_5MPa`` (valve
    0, run 0), and ``2.000 bar`` may be two thousand. What is not a valve's pressure drop is none of the readings.

    Examples
    --------
    >>> pressures_in_name("ramp_4MPa_2.csv"), pressures_in_name("ramp_0p5MPa.csv"), pressures_in_name("ramp_2_5MPa.csv")
    (('4 MPa',), ('0.5 MPa',), ('2.5 MPa', '5 MPa'))
    """
    found = {
        _with_unit(_readings(before, mark, number, after=number), UNITS[unit.lower()])
        for before, mark, number, unit in WITH_UNIT.findall(name)
    }
    return found.pop() if len(found) == 1 else ()


def _readings(before: str, mark: str, number: str, after: str) -> tuple[str, ...]:
    """Return the decimal number, and the other reading if there is one; `after`: that of digits with a mark between."""
    whole, _, fraction = number.replace(",", ".").partition(".")
    if fraction:
        thousands = len(fraction) == 3 and len(whole) <= 3 and int(whole) > 0
        return (f"{whole}.{fraction}", *((whole + fraction,) if thousands else ()))
    if not before:
        return (number,)
    decimal = f"{before}.{number}"
    return (decimal,) if mark in "pP" else (decimal, after)


def _with_unit(readings: tuple[str, ...], unit: str) -> tuple[str, ...]:
    """Return readings with their unit, without those that no valve's pressure drop can be."""
    texts = [f"{reading} {unit}" for reading in readings]
    possible = [text for text in texts if SMALLEST_DP <= _in_Pa(text) <= LARGEST_DP] or texts
    return tuple(possible)


def _in_Pa(text: str) -> float:
    return parse_quantity(text, "pressure", "a file's name")


def claimed_pressures(names: Sequence[str]) -> list[float]:
    """Return the numbers by which files' names tell their pressures apart; none if one of them has none.

    In Pa where each states a unit, and else as they stand. Where names can be read in two ways, the readings that lie
    closest together.

    Folders before a name count for nothing.

    Examples
    --------
    >>> claimed_pressures(["a/10bar.csv", "b/2MPa.csv"]), claimed_pressures(["V7_dP2.csv", "4bar.csv"])
    ([1000000.0, 2000000.0], [2.0, 4.0])
    """
    last = [name.rpartition("/")[2] for name in names]
    stated = [pressures_in_name(name) for name in last]
    if all(stated):
        return _closest([[_in_Pa(text) for text in texts] for texts in stated])
    numbers = [
        [float(text.split()[0]) for text in texts] or _bare(name) for texts, name in zip(stated, last, strict=True)
    ]
    return _closest(numbers) if all(numbers) else []


def _bare(name: str) -> list[float]:
    found = BARE.search(name)
    if not found:
        return []
    before, mark, number = (part or "" for part in found.groups())
    return [float(text) for text in _readings(before, mark, number, after=before)]


def _closest(readings: Sequence[Sequence[float]]) -> list[float]:
    """Return one reading of each such that the largest is the smallest multiple of the smallest."""
    chosen = []
    for least in {value for values in readings for value in values}:
        above = [[value for value in values if value >= least] for values in readings]
        if all(above):
            chosen.append([min(values) for values in above])
    return min(chosen, key=lambda values: max(values) / max(min(values), 1e-9), default=[])


def contradicts(name: str, dp: float) -> str:
    """Return what a file's name states if the measured pressure, in Pa, is plainly another in any reading; or nothing.

    Examples
    --------
    >>> contradicts("ramp_5MPa.csv", 1e6), contradicts("ramp_5MPa.csv", 4.8e6), contradicts("ramp_2_5MPa.csv", 4.8e6)
    ('5 MPa', '', '')
    """
    stated = pressures_in_name(name)
    agrees = any(_in_Pa(text) / SAME < dp < _in_Pa(text) * SAME for text in stated)
    return "" if agrees else " or ".join(stated)
