"""vectors.csv: codes in, and what the core must answer, from the exact law in rationals.

The codes are those of every node, corner and fault, then random ones.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping
from itertools import cycle, product
from math import floor
from random import Random
from typing import NamedTuple

from dzdesign.codegen.core.constants import STATUS_BITS, THIRD_BIT
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import CODE_LIMIT, WEIGHT_UNIT, CommandSignal, PressureSignal, Signals

#: Of every random choice; the same compensator gives the same vectors.
SEED = 1
INPUTS = ("u_adc", "ahead_adc", "behind_adc")
#: Of each sign of command: what `dz_comp()`, `dz_status()` and `dz_beta()` return.
ANSWERS = {
    1: ("compare_counts", "status_bits", "beta_x_32768"),
    -1: ("compare_negative_counts", "status_negative_bits", "beta_negative_x_32768"),
}
BETA_UNIT = 2**15
STATUS = {name: 1 << place for place, name in enumerate(STATUS_BITS)}
STATUS |= {name: 1 << place for name, (place, _) in THIRD_BIT.items()}


class Codes(NamedTuple):
    """The inputs of one call of the core: the pressures are those ahead and behind, for either sign of command."""

    u_adc: int
    ahead_adc: int
    behind_adc: int


def vectors_text(compensator: Compensator, count: int) -> str:
    """Return vectors.csv with so many rows of whole numbers below the names of its columns.

    Fewer than hit every node, corner and fault are an `InputError`.
    """
    signs = compensator.signals.signs
    header = (*INPUTS, *(name for sign in signs for name in ANSWERS[sign]))
    rows = [
        (*codes, *(value for sign in signs for value in answers(compensator, codes, sign)))
        for codes in chosen_codes(compensator, count)
    ]
    return "".join(",".join(map(str, row)) + "\n" for row in (header, *rows))


def answers(compensator: Compensator, codes: Codes, sign: int) -> tuple[int, int, int]:
    """Return what the core of one sign must answer: compare value, bits of status, beta over 2^15 rounded down."""
    pair, u = compensator.signals.pair(sign), codes.u_adc
    ranges = (signal.valid_codes for signal in (compensator.signals.command, pair.ahead, pair.behind))
    valid_u, *valid = (low <= code <= high for code, (low, high) in zip(codes, ranges, strict=True))
    difference, too_low = pair.difference(codes.ahead_adc, codes.behind_adc), -compensator.reverse_codes - 1
    status = (not valid_u) * STATUS["COMMAND"]
    status += sum(STATUS[f"PRESSURE_{name}"] for name, sound in zip(pair.names, valid, strict=True) if not sound)
    if all(valid):
        tested_to = pair.dp_code(compensator.side(sign).certificate.dp_MPa[1])
        status += (difference <= too_low) * STATUS["DIFFERENCE"] + (difference > tested_to) * STATUS["ABOVE"]
    else:
        difference = too_low  # a failed sensor, and the smallest beta as for it
    compare = compensator.compare(u, difference, sign) if valid_u else 0
    return compare, status, int(compensator.law_beta(difference, sign) * BETA_UNIT)


def chosen_codes(compensator: Compensator, count: int) -> list[Codes]:
    """Return so many different inputs: first those that `required_codes` names, then random ones.

    Fewer than are required are an `InputError`. A random input has any command of the converter, any pressure drop that
    sound pressures make, from none on, and any pair of them that makes it, of the sides by turns.
    """
    required = required_codes(compensator)
    chosen = list(dict.fromkeys(codes for group in required.values() for codes in group))
    if count < len(chosen):
        at_nodes = len(next(iter(required.values())))
        raise InputError(
            f"--vectors is {count}, expected {len(chosen)} or more: {at_nodes} for the nodes of beta and "
            f"{len(chosen) - at_nodes} for corners and faults"
        )
    random, found = Random(SEED), set(chosen)
    sides = cycle([_Side(compensator, sign) for sign in compensator.signals.signs])
    while len(chosen) < count:
        side = next(sides)
        u = _drawn(random, range(compensator.signals.code_max + 1))
        codes = Codes(u, *side.pressures(side.drops[_drawn(random, range(len(side.drops)))], random))
        if codes not in found:
            found.add(codes)
            chosen.append(codes)
    return chosen


def required_codes(compensator: Compensator) -> Mapping[str, list[Codes]]:
    """Return the inputs that the vectors can't do without, by what they are for; some stand in several groups."""
    random = Random(SEED)
    sides = [_Side(compensator, sign) for sign in compensator.signals.signs]

    def of_sides(inputs: str) -> list[Codes]:
        found = [codes for side in sides for codes in getattr(side, inputs)(random)]
        return list(dict.fromkeys(codes for codes in found if max(codes) <= CODE_LIMIT and min(codes) >= 0))

    return {
        "nodes of beta": of_sides("at_nodes"),
        "corners of the command": of_sides("at_command_corners"),
        "corners of the pressure drop": of_sides("at_drop_corners"),
        "ends of the pressures": of_sides("at_pressure_ends"),
        "faults": of_sides("at_faults"),
    }


class _Side:
    """The law of one sign of command, and which codes lie where it bends or ends."""

    def __init__(self, compensator: Compensator, sign: int) -> None:
        self._compensator, self._sign = compensator, sign
        self._signals = signals = compensator.signals
        self._command, self._pair = signals.command, signals.pair(sign)
        self._a, self._b = self._pair.ahead, self._pair.behind
        # A pressure drop d and code b behind need code a = slant of b + d ahead; the slant never falls.
        zero = self._a.zero_code
        behind = range(self._b.valid_codes[0], self._b.valid_codes[1] + 1)
        self._slant = [zero - self._pair.difference(zero, b) for b in behind]
        self._tested_to = floor(self._pair.dp_code(compensator.side(sign).certificate.dp_MPa[1]))
        #: Pressure drops from none on that sound pressures make.
        self.drops = [drop for drop in range(self._pair.largest_difference + 1) if self._codes_of_b(drop)]
        self._three = [drop for drop in dict.fromkeys((0, self._tested_to, self.drops[-1])) if self._codes_of_b(drop)]
        self._middle = (compensator.transition_end + self._command.span(sign)) // 2

    def pressures(self, drop: int, random: Random) -> tuple[int, int]:
        """Return one of the pairs of sound pressure codes that make a drop."""
        b = _drawn(random, self._codes_of_b(drop))
        return self._code_of_a(drop, b), b

    def at_nodes(self, random: Random) -> Iterator[Codes]:
        """Every node of beta and one code to either side: at zero command, and at another beyond the transition."""
        c, step = self._compensator, self._compensator.beta_step_codes
        beyond = range(max(c.transition_end, 1), self._middle + 1)
        nodes = range(0, step * c.nodes(self._sign), step)
        for drop in dict.fromkeys(node + by for node in nodes for by in (-1, 0, 1)):
            if self._codes_of_b(drop):
                yield self._codes(0, drop, random)
                yield self._codes(_drawn(random, beyond), drop, random)

    def at_command_corners(self, random: Random) -> Iterator[Codes]:
        """Zero command, ends of zero band and transition, full command and where the output's limit is reached."""
        c, span = self._compensator, self._command.span(self._sign)
        corners = dict.fromkeys((0, c.zero_band_codes, c.transition_end, span))
        for drop in self._three:
            reached = bisect_left(range(span + 1), True, key=lambda away: self._is_limited(away, drop))
            for away in dict.fromkeys(corner + by for corner in (*corners, reached) for by in (-1, 0, 1)):
                yield self._codes(away, drop, random)

    def at_drop_corners(self, _: Random) -> Iterator[Codes]:
        """No drop, the limit of what a failed sensor makes, the highest tested and the largest, and one code about.

        Of unlike sensors each with the pairs that leave least and most to the next code.
        """
        corners = (-self._compensator.reverse_codes, 0, self._tested_to, self.drops[-1])
        drops = dict.fromkeys(corner + by for corner in corners for by in (-1, 0, 1))
        for drop, away in product(drops, (0, self._middle)):
            pairs = [(self._code_of_a(drop, b), b) for b in self._codes_of_b(drop)]
            for end in (min, max) if pairs else ():
                yield Codes(self._code(away), *end(pairs, key=self._rounded_off))

    def at_pressure_ends(self, _: Random) -> Iterator[Codes]:
        """Both pressures at their least and largest valid codes and at no pressure: a drop below zero too."""
        ends = [(*sensor.valid_codes, sensor.zero_code) for sensor in (self._a, self._b)]
        for away, p_a, p_b in product((0, self._middle), *ends):
            yield Codes(self._code(away), p_a, p_b)

    def at_faults(self, random: Random) -> Iterator[Codes]:
        """Each signal at its valid range's ends and beyond, by itself and with the others beyond theirs.

        The other pressure makes a difference that is none of a failed sensor, where there is such a one.
        """
        p_a, p_b = self.pressures(0, random)
        ranges = [_about(signal, self._signals) for signal in (self._command, self._a, self._b)]
        yield from (Codes(u, p_a, p_b) for u in ranges[0])
        for away in (0, self._middle):
            pairs = [[(a, b) for b in self._b.valid_codes] for a in ranges[1]]
            pairs += [[(a, b) for a in self._a.valid_codes] for b in ranges[2]]
            yield from (Codes(self._code(away), *self._least_drop(each)) for each in pairs)
        beyond = [(signal.valid_codes[0] - 1, signal.valid_codes[1] + 1) for signal in (self._a, self._b)]
        for u in (self._code(self._middle), self._command.valid_codes[0] - 1, self._command.valid_codes[1] + 1):
            yield from (Codes(u, *pair) for pair in product(*beyond))

    def _least_drop(self, pairs: list[tuple[int, int]]) -> tuple[int, int]:
        """Return the pair of the least pressure drop that no failed sensor makes, or of the nearest to that."""
        drops = [self._pair.difference(*pair) for pair in pairs]
        ranked = [(drop < -self._compensator.reverse_codes, abs(drop)) for drop in drops]
        return pairs[ranked.index(min(ranked))]

    def _is_limited(self, away: int, drop: int) -> bool:
        limit = self._compensator.drive_functions.compare_limit
        return self._compensator.compare(self._code(away), drop, self._sign) == limit

    def _codes(self, away: int, drop: int, random: Random) -> Codes:
        return Codes(self._code(away), *self.pressures(drop, random))

    def _code(self, away: int) -> int:
        """Return the code of a command so many codes from zero towards full."""
        return self._command.zero_code + self._command.direction(self._sign) * away

    def _rounded_off(self, pair: tuple[int, int]) -> int:
        """Return by how much a pair's difference was rounded down, of `WEIGHT_UNIT`; of like sensors nothing."""
        return (self._b.zero_code - pair[1]) * self._pair.weight % WEIGHT_UNIT

    def _code_of_a(self, drop: int, p_b: int) -> int:
        return self._slant[p_b - self._b.valid_codes[0]] + drop

    def _codes_of_b(self, drop: int) -> range:
        """Return the codes behind for which a valid one ahead makes a drop."""
        low, high = (code - drop for code in self._a.valid_codes)
        first = self._b.valid_codes[0]
        return range(first + bisect_left(self._slant, low), first + bisect_right(self._slant, high))


def _about(signal: CommandSignal | PressureSignal, signals: Signals) -> list[int]:
    """Return the ends of a signal's valid codes and one beyond, those of the converter, and the largest of 16 bits."""
    low, high = signal.valid_codes
    return [low - 1, low, high, high + 1, 0, signals.code_max, signals.code_max + 1, CODE_LIMIT]


def _drawn(random: Random, values: range) -> int:
    """Draw one of the values; `random()` alone is the same in every version of Python."""
    return values[int(random.random() * len(values))]
