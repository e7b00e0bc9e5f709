"""Every input and the exactly rounded law at it, as integers that a C program can step through on any machine.

All arithmetic here is in integers of any length.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import lcm

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.verify.exhaustive.exact_drive import HELD, LATCHED, STEP_UNIT
from dzdesign.verify.exhaustive.exact_law import BETA_UNIT, DIFFERENCE, PRESSURES, ExactLaw
from dzdesign.verify.toolchain.compiled_core import DIRECTION, PAIR, PART, PLAN, ROW

#: Codes beyond the converter's range: the largest that 16 bits hold.
OUTSIDE = 65535
#: Remainders and their sums fit 64 bits with a sign below this.
LARGEST_DENOMINATOR = 2**62
#: Of a sample: rows and places (commands), and which of the codes of 16 bits; 257 divides 65535.
SAMPLED_ROWS, SAMPLED_PLACES, SAMPLED_STRIDE = 32, 200, 257
#: Spreads the pairs that rows begin with: 2^16 over the golden ratio.
SPREAD = 40503
#: Above every numerator of beta.
KEY = 2**31


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences:
    """Every difference of sound pressure codes from the lowest to the highest, and the pairs (a, b) that make it."""

    #: (D,): differences, rising by one.
    values: np.ndarray
    #: (D,): codes behind of the first and last pair, all between them belong to one pair. None: last < first.
    b_first: np.ndarray
    b_last: np.ndarray
    #: By code behind: code ahead less the difference.
    slant: np.ndarray

    @property
    def made(self) -> np.ndarray:
        """True for those that sound codes make."""
        return self.b_last >= self.b_first

    @property
    def pairs(self) -> int:
        """Pairs of sound pressure codes."""
        return int(np.maximum(self.b_last - self.b_first + 1, 0).sum())


def differences(exact: ExactLaw) -> Differences:
    """Return every difference that sound pressure codes make."""
    slant = exact.slant()
    (a_low, a_high), (b_low, b_high) = exact.ahead.valid_codes, exact.behind.valid_codes
    sound = slant[b_low : b_high + 1]  # never falls: along a difference both codes rise together
    ends = sorted(a - s for a in (a_low, a_high) for s in (sound[0], sound[-1]))
    values = np.arange(ends[0], ends[-1] + 1)
    first = np.searchsorted(sound, a_low - values, side="left")
    last = np.searchsorted(sound, a_high - values, side="right") - 1
    return Differences(values=values, b_first=b_low + first, b_last=b_low + last, slant=slant)


@dataclass(frozen=True, slots=True, kw_only=True)
class Straight:
    """Places where all laws are straight, up to `end`: counts and a half, over `denominator`, and their steps."""

    end: int
    denominator: int
    start: np.ndarray
    step: np.ndarray


class PreparedInputs:
    """What programs/every_input.c steps through for one side."""

    def __init__(self, exact: ExactLaw) -> None:
        self.exact = exact
        self.differences = differences(exact)
        betas = exact.beta_numerators(np.append(self.differences.values, -exact.reverse - 1))
        self._unit = betas.denominator
        key, law_of = np.unique(betas.law * KEY + betas.zero, return_inverse=True)
        both = np.stack(np.divmod(key, KEY))
        self._beta_values = both[0] * BETA_UNIT // self._unit
        self._law_of = law_of
        self._corners = self._corner_numerators(both)
        self._codes = exact.code_max + 1
        self._zero_place = exact.zero if self.exact.along > 0 else exact.code_max - exact.zero
        ends = (exact.sound_commands[0], exact.sound_commands[-1])
        self._sound = ends if self.exact.along > 0 else tuple(exact.code_max - code for code in ends[::-1])
        self._parts = self._straight_parts()

    def everything(self, *, cube: bool = True, impatient: bool = False) -> bytes:
        """Return all rows and all places; with `cube` every pair of pressures at zero command too.

        With `impatient` the check ends where a row has a fault.
        """
        rows = np.arange(self.differences.values.size)
        return self._assembled(rows, np.zeros(0, dtype="<i4"), 1, {"cube": cube, "impatient": impatient})

    def sample(self) -> bytes:
        """Return some rows and places, all corners among them: `sampled_rows`, `sampled_places`."""
        return self._assembled(self.sampled_rows(), self.sampled_places().astype("<i4"), SAMPLED_STRIDE, {})

    def code_at(self, place: int) -> int:
        """Return the command's code at a place."""
        return place if self.exact.along > 0 else self.exact.code_max - place

    def sampled_rows(self) -> np.ndarray:
        """Return rows at and beside the ends, no pressure drop, the failed-sensor limit, and some in between."""
        made = np.flatnonzero(self.differences.made)
        values = self.differences.values[made]
        corners = (values[0], -self.exact.reverse - 1, -self.exact.reverse, -1, 0, 1, values[-1])
        near = [made[np.abs(values - corner).argmin()] for corner in corners]
        spread = made[np.linspace(0, made.size - 1, SAMPLED_ROWS - len(near)).astype(int)]
        return np.unique([*near, *spread])

    def sampled_places(self) -> np.ndarray:
        """Return places at and beside the ends of codes, sound commands and parts of the law, and some in between."""
        corners = {0, self._codes - 1, self._zero_place, *self._sound, *(part.end for part in self._parts)}
        near = {place + by for place in corners for by in (-1, 0, 1)}
        spread = set(np.linspace(0, self._codes - 1, SAMPLED_PLACES).astype(int).tolist())
        return np.array(sorted(place for place in near | spread if 0 <= place < self._codes))

    def sampled_codes(self) -> list[tuple[int, int, int]]:
        """Return the command's codes at some places, each with pressure codes of some rows and with ones not sound."""
        found, rows = self.differences, self.sampled_rows()
        b = found.b_first[rows]
        pairs = [*zip((found.values[rows] + found.slant[b]).tolist(), b.tolist(), strict=True)]
        pairs += self._fallback_pairs()[["a", "b"]].tolist()
        return [(self.code_at(place), *pair) for place in self.sampled_places().tolist() for pair in pairs]

    def _corner_numerators(self, both: np.ndarray) -> tuple[int, list[tuple[int, np.ndarray]]]:
        """Return the law at its corners, in counts and a half over one denominator, for all pairs of betas."""
        lines = self.exact.lines_in_beta()
        scale = lcm(2, *(each for _, none, more in lines for each in (none.denominator, more.denominator * self._unit)))
        law, zero = both.astype(object)
        corners = []
        for away, none, more in lines:
            beta = law if away > self.exact.zero_band else zero  # zero command has the certified beta
            corners.append((away, beta * int(more * scale / self._unit) + int(none * scale) + scale // 2))
        return scale, corners

    def _straight_parts(self) -> list[Straight]:
        """Return the parts of all laws, in places, with what is constant before, behind and outside the sound ones."""
        scale, corners = self._corners
        none = np.zeros_like(corners[0][1])
        (sound_from, sound_to), zero = (self._sound[0], self._sound[1] + 1), self._zero_place
        parts = [(sound_from, scale, none, none), (zero, scale, corners[0][1], none)]
        for (first, low), (last, high) in pairwise(corners):
            width = last - first
            parts.append((zero + last + (last == corners[-1][0]), scale * width, low * width, high - low))
        parts += [(sound_to, scale, corners[-1][1], none), (self._codes, scale, none, none)]
        kept: list[Straight] = []
        begin = 0
        for end, denominator, start, step in parts:
            if end > begin:
                shared = int(np.gcd.reduce(np.concatenate([start, step, [denominator]])))
                kept.append(
                    Straight(end=end, denominator=denominator // shared, start=start // shared, step=step // shared)
                )
                begin = end
        largest = max(part.denominator for part in kept)
        if largest >= LARGEST_DENOMINATOR:
            raise RequirementError(f"the law's denominator needs {largest.bit_length()} bits, expected at most 62")
        return kept

    def _laws(self) -> np.ndarray:
        laws = np.zeros((self._corners[1][0][1].size, len(self._parts)), dtype=PART)
        for place, part in enumerate(self._parts):
            laws["quotient"][:, place] = part.start // part.denominator
            laws["remainder"][:, place] = part.start % part.denominator
            laws["step"][:, place] = part.step // part.denominator
            laws["carry"][:, place] = part.step % part.denominator
        return laws

    def _rows(self) -> np.ndarray:
        found = self.differences
        rows = np.zeros(found.values.size, dtype=ROW)
        rows["offset"] = found.values
        rows["pairs"] = np.maximum(found.b_last - found.b_first + 1, 0)
        rows["b_low"] = np.where(found.made, found.b_first, 0)
        rows["first"] = np.arange(rows.size) * SPREAD % np.maximum(rows["pairs"], 1)
        rows["law"] = self._law_of[:-1]
        return rows

    def _directions(self) -> np.ndarray:
        """Return which way the law goes, place by place, from each row to the next; nothing below no pressure drop."""
        made = np.flatnonzero(self.differences.made)
        forward = made[1:][self.differences.values[made[:-1]] >= 0]
        before = made[:-1][self.differences.values[made[:-1]] >= 0]
        directions = np.zeros(self.differences.values.size, dtype=DIRECTION)
        directions["until"] = self._sound[1] + 1
        corners = self._corners[1]
        changes = [(away, values[self._law_of[forward]] - values[self._law_of[before]]) for away, values in corners]
        for part, ((first, start), (last, end)) in enumerate(pairwise(changes)):
            at_start, at_end = (np.sign(change.astype(float)).astype(int) for change in (start, end))
            turn = np.full(forward.size, last)
            crossing = np.flatnonzero(at_start * at_end < 0)
            for place in crossing:  # the first command at or behind the crossing
                turn[place] = first - (first - last) * start[place] // (start[place] - end[place])
            directions["until"][forward, 2 * part] = self._zero_place + turn
            if last != corners[-1][0]:
                directions["until"][forward, 2 * part + 1] = self._zero_place + last
            directions["sign"][forward, 2 * part] = np.where(at_start, at_start, at_end)
            directions["sign"][forward, 2 * part + 1] = np.where(at_end, at_end, at_start)
        return directions

    def _fallback_pairs(self) -> np.ndarray:
        """Return pressure codes of which one or both are not sound, then sound ones; ends and middles."""
        inside, outside = [], []
        for sensor in (self.exact.ahead, self.exact.behind):
            low, high = sensor.valid_codes
            inside.append((low, (low + high) // 2, high))
            outside.append(tuple(code for code in (low - 1, high + 1, OUTSIDE) if code >= 0))
        pairs = [(a, b, 0) for a in outside[0] for b in inside[1] + outside[1]]
        pairs += [(a, b, 0) for a in inside[0] for b in outside[1]]
        pairs += [(a, b, 1) for a in inside[0] for b in inside[1]]
        return np.array(pairs, dtype=PAIR)

    def _assembled(self, chosen: np.ndarray, places: np.ndarray, stride: int, how: dict[str, bool]) -> bytes:
        """Return the plan and its tables, one after the other, each at a multiple of 8 bytes."""
        exact, safe, functions = self.exact, int(self._law_of[-1]), self.exact.compensator.drive_functions
        laws, rows = self._laws(), self._rows()[chosen]
        used, rows["law"] = np.unique(np.append(rows["law"], safe), return_inverse=True)[0], rows["law"]
        rows["law"] = np.searchsorted(used, rows["law"])
        laws = laws[used]
        plan = np.zeros((), dtype=PLAN)
        count = len(self._parts)
        plan["denominator"][:count] = [part.denominator for part in self._parts]
        plan["part_end"][:count] = [part.end for part in self._parts]
        at_zero = self._corners[1][0][1][safe] // self._corners[0]
        values = {
            "parts": count,
            "codes": self._codes,
            "first_code": self.code_at(0),
            "code_step": self.exact.along,
            "sound_from": self._sound[0],
            "sound_to": self._sound[1] + 1,
            "zero_place": self._zero_place,
            "zero_code": exact.zero,
            "compare_limit": exact.compare_limit,
            "reverse": exact.reverse,
            "tested_to": exact.tested_to,
            "dither_counts": functions.dither_counts,
            "dither_ticks": functions.dither_ticks,
            "both": len(exact.compensator.signals.signs) == 2,
            "leave_zero": functions.leave_zero_codes,
            "ramp_unit": STEP_UNIT,
            "failed_status": DIFFERENCE + HELD + LATCHED * (functions.fault_latch and functions.fault_samples == 1),
            "lowest": self.differences.values[0],
            "safe_law": np.searchsorted(used, safe),
            "safe_at_zero": min(max(at_zero, 0), exact.compare_limit),
            "rows": rows.size,
            "places": places.size,
            "stride": stride,
        }
        values |= dict(zip(("a_low", "a_high"), exact.ahead.valid_codes, strict=True))
        values |= dict(zip(("b_low", "b_high"), exact.behind.valid_codes, strict=True))
        other = next(name for name in PRESSURES if name not in exact.pair)
        for end, name in zip(("ahead", "behind", "other"), (*exact.pair, other), strict=True):
            values |= {f"{end}_input": list(PRESSURES).index(name), f"{end}_bit": PRESSURES[name]}
        pairs = self._fallback_pairs()
        values["pairs"] = pairs.size
        tables = {
            "laws_at": laws,
            "rows_at": rows,
            "directions_at": self._directions() if not places.size else np.zeros(0, dtype=DIRECTION),
            "slant_at": self.differences.slant.astype("<i4"),
            "pairs_at": pairs,
            "places_at": places,
            "betas_at": self._beta_values[used].astype("<u2"),
        }
        content = b""
        for name, table in tables.items():
            values[name] = PLAN.itemsize + len(content)
            content += table.tobytes() + bytes(-table.nbytes % 8)
        for name, value in (values | how).items():
            plan[name] = value
        return plan.tobytes() + content
