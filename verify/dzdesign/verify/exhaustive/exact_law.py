"""The exactly rounded law at every code pair, computed without the firmware's arithmetic.

Starts from the rationals in compensator.json and the law of `dzdesign.derivation`; along a row of constant pressure the
law is straight in the command code up to the edge's end and beyond it, so its rounded values come from exact addition
with carry: quotient and remainder advance by the quotient and remainder of the slope. No multiplication, shift or
reciprocal is shared with the generated C.
"""

from collections.abc import Iterator
from fractions import Fraction
from math import lcm
from typing import NamedTuple

import numpy as np

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import evaluate_line
from dzdesign.design.compensator import Compensator
from dzdesign.verify.evidence import Side

#: What sensor B's weight is stated over, where the two sensors count unlike (DESIGN: codes of A over 2^12).
WEIGHT_UNIT = 4096


class Betas(NamedTuple):
    """The two betas at one pressure drop: of the law, and the certified one at zero command."""

    law: Fraction
    zero: Fraction


class BetaNumerators(NamedTuple):
    """The two betas at many differences, as integers over a common denominator."""

    law: np.ndarray
    zero: np.ndarray
    denominator: int


class ExactLaw:
    """The law of one side of a compensator on integer codes.

    Parameters
    ----------
    compensator : Compensator
        Its numbers alone are taken: no function of it that computes.
    sign : {1, -1}
        Sign of the command.
    """

    def __init__(self, compensator: Compensator, sign: int = 1) -> None:
        signals = compensator.signals
        self.side: Side = "positive" if sign > 0 else "negative"
        side = compensator.side(sign)
        command = signals.command
        full = command.full_code if sign > 0 else command.negative_full_code
        if full is None:
            raise InputError("compensator.json has no negative command, of which the law was asked for")
        self.code_max = signals.code_max
        self.compare_max = signals.compare_max
        self.compare_limit = compensator.drive_functions.compare_limit
        self.zero = command.zero_code
        self.full = full
        self.sound_commands = range(command.valid_codes[0], command.valid_codes[1] + 1)
        self.a, self.b = signals.pressure_a, signals.pressure_b
        self.reverse = compensator.reverse_codes
        self.turn = -1 if sign < 0 and signals.swapped else 1
        self._law = law(compensator.law)
        self._kappa = side.drive_range_over_u_max
        self._u_min0 = side.u_min0_over_u_max
        self._zero_nodes = side.beta
        self._law_nodes = side.transition_beta or side.beta
        self._denominator = compensator.beta_denominator
        self._step = compensator.beta_step_codes
        self.transition_codes = compensator.transition_codes

    @property
    def span(self) -> int:
        """Codes of command from zero to full."""
        return abs(self.full - self.zero)

    def from_zero(self, code: int) -> int:
        """Return how far a command is from zero towards full, in codes, limited to both."""
        away = code - self.zero if self.full > self.zero else self.zero - code
        return min(max(away, 0), self.span)

    def difference(self, p_a: np.ndarray, p_b: np.ndarray) -> np.ndarray:
        """Return the differences of pressure codes, in codes of sensor A, that pairs of codes make (rounded down)."""
        weight = self._weight()
        a, b = (np.asarray(p, dtype=np.int64) - sensor.zero_code for p, sensor in ((p_a, self.a), (p_b, self.b)))
        return np.floor_divide(self.turn * (a * WEIGHT_UNIT - b * weight), WEIGHT_UNIT)

    def sound_pressures(self, p_a: np.ndarray, p_b: np.ndarray) -> np.ndarray:
        """Tell which pairs of pressure codes both sensors can give."""
        (a_low, a_high), (b_low, b_high) = self.a.valid_codes, self.b.valid_codes
        return (p_a >= a_low) & (p_a <= a_high) & (p_b >= b_low) & (p_b <= b_high)

    def slant(self) -> np.ndarray:
        """Return, per pressure code b, what a difference d is short of pressure code a: a = turn * d + slant[b]."""
        away = (np.arange(self.code_max + 1) - self.b.zero_code) * self._weight()
        return self.a.zero_code - self.turn * np.floor_divide(-self.turn * away, WEIGHT_UNIT)

    def _weight(self) -> int:
        a_MPa, b_MPa = (
            sensor.span_MPa / (sensor.full_code - sensor.zero_code) for sensor in (self.a, self.b)
        )
        return max(1, round(b_MPa / a_MPa * WEIGHT_UNIT))

    def betas(self, dp_code: int | None) -> Betas:
        """Return both betas at a difference; None, and one below ``-reverse``: the signal can't be right."""
        return Betas(self._at(self._law_nodes, dp_code), self._at(self._zero_nodes, dp_code))

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

    def _at(self, nodes: tuple[int, ...], dp_code: int | None) -> Fraction:
        if dp_code is None or dp_code < -self.reverse:
            return Fraction(min(nodes), self._denominator)
        left, past = divmod(max(dp_code, 0), self._step)
        rise = nodes[left + 1] - nodes[left]
        return Fraction(nodes[left] * self._step + rise * past, self._denominator * self._step)

    def corners(self, betas: Betas) -> list[tuple[int, Fraction]]:
        """Return the law in counts at the ends of its straight parts: zero command, the edge's end, full command."""
        line = evaluate_line(
            self._law,
            beta=betas.law,
            kappa=self._kappa,
            u_min0_over_u_max=self._u_min0,
            n_adc=self.span,
            n_full=self.compare_max,
        )
        corners = [(0, betas.zero * self._u_min0 * self.compare_max)]
        if self.transition_codes:
            corners.append((self.transition_codes, line.slope * self.transition_codes + line.start))
        return [*corners, (self.span, line.slope * self.span + line.start)]

    def lines_in_beta(self) -> list[tuple[int, Fraction, Fraction]]:
        """Return the corners as lines in their beta: command, counts at beta 0, counts that a beta of 1 adds.

        Raises
        ------
        RequirementError
            If the law is no line in beta.
        """
        at = [self.corners(Betas(Fraction(beta), Fraction(beta))) for beta in (0, 1, 2)]
        lines = [(code, none, one - none) for (code, none), (_, one) in zip(at[0], at[1], strict=True)]
        if any(two != none + 2 * more for (_, none, more), (_, two) in zip(lines, at[2], strict=True)):
            raise RequirementError("the law is not straight in beta, so its rows can't be prepared")
        return lines

    def rows(self, betas: list[Betas]) -> Iterator[np.ndarray]:
        """Yield, for command codes 0, 1, ... from zero on, the rounded and limited compare values at all `betas`."""
        at = {pair: self.corners(pair) for pair in set(betas)}
        parts = [at[pair] for pair in betas]
        for part in range(len(parts[0]) - 1):
            first, last = parts[0][part][0], parts[0][part + 1][0]
            starts = [corners[part][1] for corners in parts]
            slopes = [(corners[part + 1][1] - corners[part][1]) / (last - first) for corners in parts]
            # Neighbouring parts share a corner; the last one has its end too.
            yield from self._straight(starts, slopes, last - first + (part == len(parts[0]) - 2))

    def _straight(self, starts: list[Fraction], slopes: list[Fraction], count: int) -> Iterator[np.ndarray]:
        half = Fraction(1, 2)
        scale = lcm(*(value.denominator for value in {*slopes, *(start + half for start in starts)}))
        if scale >= 2**62:
            raise RequirementError(f"the law's common denominator needs {scale.bit_length()} bits, expected at most 62")
        # floor(value + 1/2) rounds to nearest, a half up.
        split = [divmod(int((start + half) * scale), scale) for start in starts]
        steps = [divmod(int(slope * scale), scale) for slope in slopes]
        quotient, remainder = (np.array(column, dtype=np.int64) for column in zip(*split, strict=True))
        step, carry = (np.array(column, dtype=np.int64) for column in zip(*steps, strict=True))
        for _ in range(count):
            yield np.clip(quotient, 0, self.compare_limit)
            remainder = remainder + carry
            over = remainder >= scale
            remainder = np.where(over, remainder - scale, remainder)
            quotient = quotient + step + over
