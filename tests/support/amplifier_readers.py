"""Files of amplifiers read back from their text alone, and the law that their manuals state, in exact numbers.

No code of the product takes part: limits, units and the bound of the threshold are written here once more.
"""

import csv
import re
from bisect import bisect_right
from dataclasses import dataclass
from fractions import Fraction

import canopen

#: Steps of a search for a threshold, over full command: finer than a hundredth of a per cent.
GRID = 40_000
#: A command that is hardly any.
JUST = Fraction(1, 10**12)


@dataclass(frozen=True)
class ReadLaw:
    """Points of command and drive for both directions, and up to which command there is no drive."""

    points: list[tuple[Fraction, Fraction]]
    rest: Fraction = Fraction(0)

    def drive(self, command):
        """Return the drive at a command, both over full."""
        command = Fraction(command)
        if abs(command) <= self.rest and self.rest:
            return Fraction(0)
        commands = [point[0] for point in self.points]
        right = min(max(bisect_right(commands, command), 1), len(commands) - 1)
        (left, low), (end, high) = self.points[right - 1], self.points[right]
        return low + (high - low) * (command - left) / (end - left)


def jump_law(steps, rest, sides):
    """Return no drive up to `rest`, then straight from offset to full: `sides` has both in steps by sign."""
    points = []
    for sign in sorted(sides):
        offset, full = (sign * Fraction(value, steps) for value in sides[sign])
        ends = [(sign * Fraction(rest, steps), offset), (Fraction(sign), full)]
        points += ends[::sign]
    return ReadLaw(points=points, rest=Fraction(rest, steps))


def read_west(text):
    """Return the law of lines such as ``MIN:A 2000``, in 0.01 %."""
    found = dict(line.split(" ") for line in text.splitlines())
    sides = {}
    for sign, letter in ((1, ":A"), (-1, ":B"), (1, "")):
        if f"MIN{letter}" in found:
            sides[sign] = int(found[f"MIN{letter}"]), int(found[f"MAX{letter}"])
    assert len(found) == 1 + 2 * len(sides), "a line that no manual knows"
    return jump_law(10_000, int(found["TRIGGER"]), sides)


def read_dcf(path):
    """Return the law of a DCF, read by `canopen`: 16384 increments are full."""
    dictionary = canopen.import_od(str(path))
    assert dictionary[0x6342].value == 1, "type 1 jumps"
    offsets = {sign: dictionary[index][1].value for sign, index in ((1, 0x6343), (-1, 0x6344))}
    for index in (0x6343, 0x6344, 0x6345):
        assert dictionary[index][1].data_type == canopen.objectdictionary.INTEGER16
        assert 0 <= dictionary[index][1].value <= 16384
    return jump_law(16384, dictionary[0x6345][1].value, {sign: (value, 16384) for sign, value in offsets.items()})


def read_rmc(text):
    """Return the law of an offset in V or mV that is added to every command, of 10 V at full."""
    [line] = [line for line in text.splitlines() if not line.startswith("#")]
    value, unit = re.fullmatch(r"(?:Dead Band Eliminator|Output Deadband) = ([\d.]+) (mV|V)", line).groups()
    offset = Fraction(value) / {"mV": 10_000, "V": 10}[unit]
    one = Fraction(1)
    half = [(JUST, offset), (1 - offset, one), (one, one)]
    return ReadLaw(points=[*[(-command, -drive) for command, drive in half[::-1]], *half])


def read_structured_text(text):
    """Return the law of the pairs in an ARRAY[1..100,1..2] OF LREAL, joined by straight lines, as far as its count."""
    plain = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
    body = re.search(r"ARRAY\[1\.\.100,1\.\.2\] OF LREAL := \[(.*?)\];", plain, flags=re.DOTALL)[1]
    values = []
    for item in body.replace("\n", " ").split(","):
        repeated = re.fullmatch(r"(\d+)\((.*)\)", item.strip())
        values += [Fraction(repeated[2])] * int(repeated[1]) if repeated else [Fraction(item.strip())]
    assert len(values) == 200, "two numbers of each of 100 points"
    count = int(re.search(r"ValveCharacteristicTblCount : INT := (\d+);", plain)[1])
    assert count % 2 == 1 and 3 <= count <= 99 and not any(values[2 * count :])
    return ReadLaw(points=list(zip(values[: 2 * count : 2], values[1 : 2 * count : 2], strict=True)))


def read_csv(text):
    """Return the law of a table in per cent."""
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    pairs = [(Fraction(row["command_percent"]) / 100, Fraction(row["drive_percent"]) / 100) for row in rows]
    return ReadLaw(points=pairs)


def read_file(device, path):
    """Return the law of a device's file."""
    text = path.read_text(encoding="ascii")
    if device == "cia408":
        return read_dcf(path)
    if device.startswith("west"):
        return read_west(text)
    return {"beckhoff": read_structured_text, "csv": read_csv}.get(device, read_rmc)(text)


@dataclass(frozen=True)
class StatedBound:
    """Lower bound of the guarded threshold of one side, from the numbers of compensator.json."""

    dp_MPa: list[Fraction]
    lower_V: list[Fraction]
    curvature: list[Fraction]

    @classmethod
    def of(cls, document, side):
        """Return the bound of a side of a compensator.json; its premise must not be monotone."""
        guard = document["sides"][side]["certificate"]["guard"]
        curve = document["valve"]["sides"][side]["certified"][guard]
        keys = ("dp_MPa", "u_lower_V", "curvature_V_MPa2")
        return cls(*([Fraction(repr(value)) for value in curve[key]] for key in keys))

    def at(self, dp_MPa):
        """Return the chord of the two tests about a pressure drop, less M/2 (x - a) (b - x), V."""
        right = min(max(bisect_right(self.dp_MPa, dp_MPa), 1), len(self.dp_MPa) - 1)
        a, b = self.dp_MPa[right - 1 : right + 1]
        low, high = self.lower_V[right - 1 : right + 1]
        chord = low + (high - low) * (dp_MPa - a) / (b - a)
        return chord - self.curvature[right - 1] / 2 * (dp_MPa - a) * (b - dp_MPa)

    def places(self, count):
        """Return pressure drops from the first test to the last, the tests among them, MPa."""
        first, last = self.dp_MPa[0], self.dp_MPa[-1]
        return sorted({*self.dp_MPa, *(first + (last - first) * Fraction(n, count) for n in range(count + 1))})


def over_compensated(law, document, zero, *, factor=Fraction(1), kept=Fraction(0), count=1000):
    """Return how many pressure drops have a drive above the bound at a command that may be zero, of all sides.

    The bound is lowered by a factor, and by a share of full drive.
    """
    full_V, found = Fraction(*document["u_max_V"]), 0
    for sign, side in ((1, "positive"), (-1, "negative")):
        if document["sides"].get(side) is None:
            continue
        bound = StatedBound.of(document, side)
        commands = [Fraction(0), zero / 2, zero, law.rest + JUST]  # behind its rest a jump has just been made
        drive = max(sign * law.drive(sign * command) for command in commands)
        found += sum(drive + kept > factor * bound.at(place) / full_V for place in bound.places(count))
    return found


def dead_zone(law, sign, threshold):
    """Return the least command on a grid whose drive reaches a threshold, all over full; None: no command does."""
    low, high = 0, GRID
    if sign * law.drive(Fraction(sign)) < threshold:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if sign * law.drive(Fraction(sign * middle, GRID)) >= threshold else (middle, high)
    return high / GRID
