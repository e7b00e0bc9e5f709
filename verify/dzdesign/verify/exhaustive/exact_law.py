"""The exactly rounded law at every code pair, computed without the firmware's arithmetic.

Starts from the rationals in compensator.json and the law of `dzdesign.derivation`; along a row of constant pressure the
law is straight in the command code over the zero band, over the transition and beyond. No multiplication, shift or
reciprocal is shared with the generated C.
"""

from fractions import Fraction
from functools import cache
from math import floor
from typing import NamedTuple

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import evaluate_line
from dzdesign.design.compensator import Compensator
from dzdesign.verify.loop_results import Side

#: What the weight of the sensor behind is stated over, where the two sensors count unlike (codes ahead over 2^12).
WEIGHT_UNIT = 4096
#: What dz_beta() multiplies beta by, rounding down; bits of the status.
BETA_UNIT = 2**15
COMMAND, DIFFERENCE, ABOVE = 1, 8, 16
#: The bit of each pressure input.
PRESSURES = {"A": 2, "B": 4, "C": 512}


class Betas(NamedTuple):
    """The two betas at one pressure drop: of the law, and the certified one at zero command."""

    law: Fraction
    zero: Fraction


class BetaNumerators(NamedTuple):
    """The two betas at many differences, as integers over a common denominator."""

    law: np.ndarray
    zero: np.ndarray
    denominator: int


class Answer(NamedTuple):
    """What the law gives for three codes: compare value, status word and beta over 2^15."""

    compare: int
    status: int
    beta: int


class ExactLaw:
    """The law of one side of a compensator on integer codes."""

    def __init__(self, compensator: Compensator, sign: int = 1) -> None:
        signals, side, command = compensator.signals, compensator.side(sign), compensator.signals.command
        self.compensator, self.sign = compensator, sign
        self.side: Side = compensator.valve.side_name(sign)
        self.code_max, self.compare_max = signals.code_max, signals.compare_max
        self.compare_limit = compensator.drive_functions.compare_limit
        self.zero = command.zero_code
        self.along, self.span = command.direction(sign), command.span(sign)
        self.full = self.zero + self.along * self.span
        self.sound_commands = range(command.valid_codes[0], command.valid_codes[1] + 1)
        #: Names of the pressure inputs ahead and behind, their sensors, and their bits of the status.
        self.pair = signals.negative_pair if sign < 0 else "AB"
        sensors = {"A": signals.pressure_a, "B": signals.pressure_b, "C": signals.pressure_c or signals.pressure_a}
        self.ahead, self.behind = (sensors[name] for name in self.pair)
        self.bits = tuple(PRESSURES[name] for name in self.pair)
        self.reverse = compensator.reverse_codes
        # A code above the last test's own says that the pressure drop lies above the tests.
        self.tested_to = floor(side.certificate.dp_MPa[1] / self.ahead.per_code_MPa)
        self.zero_band, self.transition_end = compensator.zero_band_codes, compensator.transition_end
        self._law = law(compensator.law)
        self._kappa, self._u_min0 = side.drive_range_over_u_max, side.u_min0_over_u_max
        self._zero_nodes, self._law_nodes = side.beta, side.law_beta
        self._denominator, self._step = compensator.beta_denominator, compensator.beta_step_codes
        self._weight = max(1, round(self.behind.per_code_MPa / self.ahead.per_code_MPa * WEIGHT_UNIT))

    def from_zero(self, code: int) -> int:
        """Return how far a command is from zero towards full, in codes, limited to both."""
        return min(max(self.along * (code - self.zero), 0), self.span)

    def difference(self, p_ahead: np.ndarray, p_behind: np.ndarray) -> np.ndarray:
        """Return the differences of pressure codes, in codes of the sensor ahead, that pairs make (rounded down)."""
        ahead = np.asarray(p_ahead, dtype=np.int64) - self.ahead.zero_code
        behind = np.asarray(p_behind, dtype=np.int64) - self.behind.zero_code
        differences: np.ndarray = np.floor_divide(ahead * WEIGHT_UNIT - behind * self._weight, WEIGHT_UNIT)
        return differences

    def slant(self) -> np.ndarray:
        """Return, per code b behind, what a difference d is short of the code a ahead: a = d + slant[b]."""
        away = (np.arange(self.code_max + 1) - self.behind.zero_code) * self._weight
        return self.ahead.zero_code - np.floor_divide(-away, WEIGHT_UNIT)

    def betas(self, dp_code: int) -> Betas:
        """Return both betas at a difference; one below ``-reverse`` says that the signal can't be right."""
        both = self.beta_numerators(np.array([dp_code]))
        law, zero = (Fraction(int(numerators[0]), both.denominator) for numerators in (both.law, both.zero))
        return Betas(law, zero)

    def beta_numerators(self, differences: np.ndarray) -> BetaNumerators:
        """Return both betas at many differences of pressure codes."""
        left, past = np.divmod(np.maximum(differences, 0), self._step)
        failed = differences < -self.reverse

        def interpolated(nodes: tuple[int, ...]) -> np.ndarray:
            node = np.array([*nodes, nodes[-1]], dtype=np.int64)  # the last node is reached, never passed
            between = node[left] * self._step + (node[left + 1] - node[left]) * past
            return np.where(failed, min(nodes) * self._step, between)

        law, zero = interpolated(self._law_nodes), interpolated(self._zero_nodes)
        return BetaNumerators(law, zero, self._denominator * self._step)

    def corners(self, betas: Betas) -> list[tuple[int, Fraction]]:
        """Return the law in counts at the ends of its straight parts, by the codes from zero command on.

        They are zero command, the zero band's end, the transition's end and full command; up to the zero band's end,
        `zero_band`, it is the certified beta that counts, and from the transition's end on the law's.
        """
        line = evaluate_line(
            self._law,
            beta=betas.law,
            kappa=self._kappa,
            u_min0_over_u_max=self._u_min0,
            n_adc=self.span,
            n_full=self.compare_max,
        )
        at_zero = betas.zero * self._u_min0 * self.compare_max
        corners = [(0, at_zero)]
        if self.transition_end:
            corners.append((self.zero_band, at_zero))
            corners.append((self.transition_end, line.slope * self.transition_end + line.start))
        return [*corners, (self.span, line.slope * self.span + line.start)]

    def compare_value(self, command_code: int, corners: list[tuple[int, Fraction]]) -> int:
        """Return the rounded and limited compare value (a half goes up) of a command, between two of the corners."""
        away = self.from_zero(command_code)
        part = next(place for place in range(len(corners) - 1) if away <= corners[place + 1][0])
        (first, start), (last, end) = corners[part : part + 2]
        counts = start + (end - start) * Fraction(away - first, last - first)
        return min(max((counts + Fraction(1, 2)).__floor__(), 0), self.compare_limit)

    def answer(self, u: int, ahead: int, behind: int) -> Answer:
        """Return what the law gives for any codes of command and sensors."""
        status = COMMAND * (u not in self.sound_commands)
        for code, sensor, bit in zip((ahead, behind), (self.ahead, self.behind), self.bits, strict=True):
            status |= bit * (not sensor.valid_codes[0] <= code <= sensor.valid_codes[1])
        drop = -self.reverse - 1  # of pressures that can't be right
        if not status & sum(self.bits):
            drop = int(self.difference(np.array(ahead), np.array(behind)))
            status |= DIFFERENCE * (drop < -self.reverse) | ABOVE * (drop > self.tested_to)
        corners, beta = self._at_drop(drop)
        return Answer(0 if status & COMMAND else self.compare_value(u, corners), status, beta)

    @cache  # noqa: B019 (the cache goes with the few laws of a run)
    def _at_drop(self, drop: int) -> tuple[list[tuple[int, Fraction]], int]:
        betas = self.betas(drop)
        return self.corners(betas), floor(betas.law * BETA_UNIT)

    def lines_in_beta(self) -> list[tuple[int, Fraction, Fraction]]:
        """Return the corners as lines in their beta: command, counts at beta 0, counts that a beta of 1 adds."""
        at = [self.corners(Betas(Fraction(beta), Fraction(beta))) for beta in (0, 1, 2)]
        lines = [(code, none, one - none) for (code, none), (_, one) in zip(at[0], at[1], strict=True)]
        if any(two != none + 2 * more for (_, none, more), (_, two) in zip(lines, at[2], strict=True)):
            raise RequirementError("the law is not straight in beta, so its rows can't be prepared")
        return lines
