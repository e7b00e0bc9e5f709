"""What a function block must give, in rational numbers from the compensator: no code and no number of the text.

Of converter codes that is the exactly rounded law. Of a PLC's units it is the law at the share of full command that a
number of 0.01 % is, its zero band and transition widened to whole numbers, rounded down; beta is the lesser of those at
the ends of the pressures that a number of 0.1 bar stands for, one of them either way, each taken to the code outside.
"""

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import ceil, floor, lcm

import numpy as np

from dzdesign.core.errors import InputError, RequirementError, quoted
from dzdesign.core.units import parse_quantity
from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.exact_law import BETA_UNIT, Betas, ExactLaw

#: Units of a PLC: of command and output in a whole, and of pressure in 1 MPa.
PER_WHOLE, PER_MPa = 10_000, 100
#: Numbers that the check computes with stay below this.
MOST = 2**61
HALF = Fraction(1, 2)
#: Straight parts of the law along the command, and numbers that describe one.
PARTS, NUMBERS = 3, 7


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """Numbers of a pressure input: valid from and to, and at no pressure."""

    low: int
    high: int
    zero: int


def cycles_of(compensator: Compensator, cycle_time: str) -> int:
    """Return how many cycles in a row the debounce time needs: the least that are not shorter; 0 without a cycle time.

    A debounce that was asked for in samples is the time that the samples take.
    """
    if not cycle_time:
        return 0
    asked = (compensator.options or {}).get("fault_debounce", "")
    needed_ns = Fraction(compensator.drive_functions.fault_samples * 10**9, compensator.signals.sample_Hz)
    if asked and "sample" not in asked:
        needed_ns = Fraction(round(parse_quantity(asked, "time", "--fault-debounce") * 1e9))
    cycle_ns = round(parse_quantity(cycle_time, "time", "the manifest's cycle_time") * 1e9)
    if cycle_ns <= 0:
        raise InputError(f"the manifest's cycle_time is {quoted(cycle_time)}, expected more than zero")
    return max(1, ceil(needed_ns / cycle_ns))


class ExactBlock(ExactLaw):
    """The law of one side in the units of the block's inputs and output."""

    def __init__(self, compensator: Compensator, sign: int, interface: str) -> None:
        super().__init__(compensator, sign)
        functions, command = compensator.drive_functions, compensator.signals.command
        self.of_codes = interface == "codes"
        self.leave_zero, self.unit = functions.leave_zero_codes, 4096
        #: The interlock takes a command up to this, from zero on, for zero command; None without one.
        self.interlock = functions.interlock_codes
        self.rounding, self.command_zero = HALF, command.zero_code
        self.commands = command.valid_codes
        #: Of every pressure input by name, and what a number ahead and one behind count in a difference.
        self.numbers = {
            name: Sensor(low=each.valid_codes[0], high=each.valid_codes[1], zero=each.zero_code)
            for name, each in compensator.signals.pressures.items()
        }
        self.weights = (4096, self._weight)
        self.largest = compensator.signals.pair(sign).largest_difference
        if not self.of_codes:
            self._take_units()

    def _take_units(self) -> None:
        codes = self.span

        def widened(command: int) -> int:
            return ceil(Fraction(command, codes) * PER_WHOLE)

        transition = self.transition_end - self.zero_band
        self.unit, self.rounding, self.command_zero, self.along = 1, Fraction(0), 0, self.sign
        self.commands = (-PER_WHOLE, PER_WHOLE)
        self.span, self.zero_band = PER_WHOLE, widened(self.zero_band)
        self.transition_end = self.zero_band + widened(transition)
        self.leave_zero = widened(self.leave_zero)
        self.interlock = None if self.interlock is None else widened(self.interlock)
        self.compare_limit = floor(Fraction(self.compare_limit, self.compare_max) * PER_WHOLE)
        self.compare_max = PER_WHOLE
        signals = self.compensator.signals
        finest_MPa = min(signals.pair(sign).ahead.per_code_MPa for sign in signals.signs)
        noise = floor(self.reverse * finest_MPa * PER_MPa)
        last = self.compensator.side(self.sign).certificate.dp_MPa[1]
        self.tested_to = floor(last * PER_MPa)
        self.numbers = {
            name: Sensor(
                low=ceil((low - each.zero_code) * each.per_code_MPa * PER_MPa) if low else -noise,
                high=floor((high - each.zero_code) * each.per_code_MPa * PER_MPa),
                zero=0,
            )
            for name, each in signals.pressures.items()
            for low, high in [each.valid_codes]
        }
        self.weights = (1, 1)
        self.codes_per_unit = 1 / (self.ahead.per_code_MPa * PER_MPa)
        self.reverse_codes, self.reverse = self.reverse, noise

    @property
    def sensors(self) -> tuple[Sensor, Sensor]:
        """The inputs ahead and behind."""
        ahead, behind = self.pair
        return self.numbers[ahead], self.numbers[behind]

    def betas_at(self, drop: int) -> Betas:
        """Return both betas at a pressure drop in units of the inputs."""
        if self.of_codes:
            return self.betas(min(drop, self.largest))
        if drop < -self.reverse:
            return self.least_betas()
        ends = floor(max(drop - 1, 0) * self.codes_per_unit), ceil((max(drop, 0) + 1) * self.codes_per_unit)
        found = [self.betas(min(code, self.largest)) for code in ends]
        return Betas(min(each.law for each in found), min(each.zero for each in found))

    def least_betas(self) -> Betas:
        """Return the betas of pressures that can't be right."""
        denominator = self._denominator
        return Betas(Fraction(min(self._law_nodes), denominator), Fraction(min(self._zero_nodes), denominator))

    def parts(self, corners: list[tuple[int, Fraction]]) -> list[list[int]]:
        """Return the law along the command in straight parts between its corners, each in whole numbers.

        First and last command, from zero; the output before it is limited, as a whole and a numerator, at the first;
        what each further command adds to both; and their denominator.
        """
        found: list[list[int]] = []
        for place, ((first, start), (last, end)) in enumerate(pairwise(corners)):
            slope = (end - start) / (last - first) if last > first else Fraction(0)
            start += self.rounding
            common = lcm(start.denominator, slope.denominator)
            if common >= MOST:
                raise RequirementError("the exact law needs more than 61 bits, so no input can be compared")
            whole, rest = divmod(int(start * common), common)
            step, step_rest = divmod(int(slope * common), common)
            found.append([first if place == 0 else first + 1, last, whole, rest, step, step_rest, common])
            if place:  # the part's first command is its left neighbour's last
                carried, found[-1][3] = divmod(rest + step_rest, common)
                found[-1][2] = whole + step + carried
        return found + [[0, -1, 0, 0, 0, 0, 1]] * (PARTS - len(found))

    def table(self, drops: range) -> np.ndarray:
        """Return the parts at each pressure drop and, last, where the pressures can't be right: (drops + 1, 3, 7)."""
        lines, zeros = self.lines_in_beta(), 2 if self.transition_end else 1
        betas = [*map(self.betas_at, drops), self.least_betas()]
        #: For a display, 2^15 of one.
        self.shown_betas = np.array([floor(each.law * BETA_UNIT) for each in betas])

        def row(betas: Betas) -> list[list[int]]:
            """Take the certified beta up to the zero band's end, and the law's beyond."""
            values = [none + more * betas.zero for _, none, more in lines[:zeros]]
            values += [none + more * betas.law for _, none, more in lines[zeros:]]
            return self.parts([(code, value) for (code, _, _), value in zip(lines, values, strict=True)])

        return np.array([row(each) for each in betas], dtype=np.int64)
