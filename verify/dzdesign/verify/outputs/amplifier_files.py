"""The law that a device makes of its file, from the text alone: units and meaning are stated here once more.

Nothing of `codegen` takes part: a wrong unit, side or rounding there must not be wrong here, too.
"""

import configparser
import re
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from io import StringIO
from itertools import pairwise

from dzdesign.core.errors import InputError

ZERO, ONE = Fraction(0), Fraction(1)
#: Increments of 100 % in CiA 408; steps of 0.01 %; millivolts of a full output of 10 V.
INCREMENTS, HUNDREDTHS, FULL_MV = 16384, 10_000, 10_000
#: Points of a TF5810 table.
TABLE_POINTS = 100
#: A number as files have it; one of another form could be of any size, such as 1e999999999.
DECIMAL = re.compile(r"-?[0-9]{1,9}(?:\.[0-9]{1,15})?")
COUNT = re.compile(r"0|[1-9][0-9]{0,8}")
#: A character that no file has: another line end, for one, may part lines here and not in the device.
STRANGE = re.compile(r"[^\r\n -~]")
#: Objects of CiA 408 that the dead band has; beside them a file would set what nobody certified.
RECORDS = ("6343", "6344", "6345")
OBJECTS = {"6342", *(record + entry for record in RECORDS for entry in ("", "sub0", "sub1"))}
#: All of a TF5810 file but its comments.
TABLE_TEXT = re.compile(
    r"\s*VAR_GLOBAL\s+ValveCharacteristicTable : ARRAY\[1\.\.100,1\.\.2\] OF LREAL := \[([^\]]*)\];"
    r"\s+ValveCharacteristicTblCount : INT := ([0-9]+);\s+END_VAR\s*"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FileLaw:
    """Drive over command of one direction, both over full: none up to and with `rest`, then through the points."""

    rest: Fraction
    #: Command and drive, from the rest on, rising.
    points: tuple[tuple[Fraction, Fraction], ...]

    def just_behind(self, command: Fraction) -> Fraction:
        """Return the drive that a command is about to make as it rises on from here."""
        if command < self.rest:
            return ZERO
        return self.drive(command) if command > self.rest else self.points[0][1]

    def drive(self, command: Fraction) -> Fraction:
        """Return the drive at a command."""
        if command <= self.rest:
            return ZERO
        commands = [each for each, _ in self.points]
        right = min(max(bisect_left(commands, command), 1), len(commands) - 1)
        (left, low), (end, high) = self.points[right - 1], self.points[right]
        return low + (high - low) * (command - left) / (end - left)


def read_file(device: str, content: bytes) -> Mapping[int, FileLaw]:
    """Return the law of each sign of command that the file for a device makes.

    Raises
    ------
    InputError
        If the text is none of that device's.
    """
    text = content.decode("latin-1")
    family = device.partition("-")[0]
    if family not in READERS:
        raise InputError(f"there is no reader of files for '{device}', expected one of {', '.join(READERS)}")
    if found := STRANGE.search(text):
        raise InputError(f"the file for {device} can't be read back: it has the character {found[0]!r}")
    try:
        return READERS[family](text)
    except (KeyError, IndexError, ValueError, ZeroDivisionError, configparser.Error) as error:
        raise InputError(f"the file for {device} can't be read back: {type(error).__name__}, {error}") from error


def _jump(rest: int, sides: Mapping[int, tuple[int, int]], steps: int) -> dict[int, FileLaw]:
    """Return the law that jumps behind its threshold to an offset, and runs straight to the drive at full command."""
    at = Fraction(rest, steps)
    return {
        sign: FileLaw(rest=at, points=((at, Fraction(offset, steps)), (ONE, Fraction(full, steps))))
        for sign, (offset, full) in sides.items()
    }


def _west(text: str) -> Mapping[int, FileLaw]:
    found: dict[str, int] = {}
    for line in text.splitlines():
        name, value = line.split(" ")
        if name in found:
            raise ValueError(f"'{name}' stands there twice")
        found[name] = _count(value)
    names = {1: ":A", -1: ":B"} if "MIN:A" in found else {1: ""}
    there = {sign: end for sign, end in names.items() if f"MIN{end}" in found}
    sides = {sign: (found.pop(f"MIN{end}"), found.pop(f"MAX{end}")) for sign, end in there.items()}
    laws = _jump(found.pop("TRIGGER"), sides, HUNDREDTHS)
    if found:
        raise ValueError(f"'{next(iter(found))}' is not a command of this device")
    return laws


def _cia408(text: str) -> Mapping[int, FileLaw]:
    from canopen.objectdictionary.eds import import_eds

    entries = configparser.ConfigParser(interpolation=None)
    entries.read_string(text)

    def value(section: str) -> int:
        found = _count(entries[section]["ParameterValue"])
        index, _, entry = section.partition("sub")
        read = dictionary[int(index, 16)]
        if (read[int(entry)] if entry else read).value != found:
            raise ValueError(f"as canopen reads it, 0x{section} is not {found}")
        return found

    objects = {section for section in entries.sections() if re.match(r"[0-9A-Fa-f]{4}", section)}
    if objects != OBJECTS or entries.defaults():
        others = sorted(objects ^ OBJECTS) or sorted(entries.defaults())
        raise ValueError(f"its objects are not those of the dead band: {', '.join(others)[:40]}")
    dictionary = import_eds(StringIO(text), None)  # type: ignore[no-untyped-call]
    if any(dictionary[int(record, 16)][0].default != 1 for record in RECORDS):
        raise ValueError("sub-index 0 of a record is not 1, its highest")
    if value("6342") != 1:
        raise ValueError("0x6342 is not 1, the function that jumps")
    sides = {1: (value("6343sub1"), INCREMENTS), -1: (value("6344sub1"), INCREMENTS)}
    return _jump(value("6345sub1"), sides, INCREMENTS)


def _rmc(text: str) -> Mapping[int, FileLaw]:
    [line] = [line for line in text.splitlines() if line and not line.startswith("#")]
    name, _, value = line.partition(" = ")
    number, unit = value.split(" ")
    if name not in ("Dead Band Eliminator", "Output Deadband"):
        raise ValueError(f"'{name}' is not a parameter of this device")
    offset = _number(number) * {"V": 1000, "mV": 1}[unit] / FULL_MV
    law = FileLaw(rest=ZERO, points=((ZERO, offset), (ONE - offset, ONE), (ONE, ONE)))
    return {1: law, -1: law}


def _beckhoff(text: str) -> Mapping[int, FileLaw]:
    declared = TABLE_TEXT.fullmatch(re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL))
    if declared is None:
        raise ValueError("beside comments it is not the declaration of one table and its count")
    *numbers, rest = [item.strip() for item in declared[1].split(",")]
    count = _count(declared[2])
    if len(numbers) != 2 * count or rest != f"{2 * (TABLE_POINTS - count)}(0.0)" or not count % 2:
        raise ValueError(f"{len(numbers)} numbers stand in a table of {count} points")
    return _table([(_number(x), _number(y)) for x, y in zip(numbers[::2], numbers[1::2], strict=True)])


def _csv(text: str) -> Mapping[int, FileLaw]:
    header, *rows = [line for line in text.splitlines() if line and not line.startswith("#")]
    if header != "command_percent,drive_percent":
        raise ValueError(f"the columns are '{header}'")
    return _table([(_number(x) / 100, _number(y) / 100) for x, y in (row.split(",") for row in rows)])


def _count(text: str) -> int:
    """Return a whole number as written in digits; another form, which a device may read otherwise, is none."""
    if not COUNT.fullmatch(text):
        raise ValueError(f"{text[:20]!r} is not a whole number")
    return int(text)


def _number(text: str) -> Fraction:
    """Return a decimal number; another form is a `ValueError`."""
    if not DECIMAL.fullmatch(text):
        raise ValueError(f"{text[:20]!r} is not a decimal number")
    return Fraction(text)


def _table(points: Sequence[tuple[Fraction, Fraction]]) -> Mapping[int, FileLaw]:
    """Return the law of points over both directions: a side whose drive is almost none has no solenoid."""
    if any(left[0] >= right[0] or left[1] >= right[1] for left, right in pairwise(points)):
        raise ValueError("the points do not increase")
    if (ZERO, ZERO) not in points or points[-1][0] != 1:
        raise ValueError("the points do not pass zero and reach full command")
    if any(abs(drive) > 1 for _, drive in points):
        raise ValueError("a point exceeds full drive")
    laws = {1: FileLaw(rest=ZERO, points=tuple(point for point in points if point[0] >= 0))}
    negative = tuple((-x, -y) for x, y in reversed(points) if x <= 0)
    if len(negative) > 2:
        laws[-1] = FileLaw(rest=ZERO, points=negative)
    return laws


READERS: Mapping[str, Callable[[str], Mapping[int, FileLaw]]] = {
    "west": _west,
    "cia408": _cia408,
    "rmc": _rmc,
    "rmc75": _rmc,
    "beckhoff": _beckhoff,
    "csv": _csv,
}
