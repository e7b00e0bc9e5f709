"""The exactly rounded law at every code pair, computed without the firmware's arithmetic.

Starts from the rationals in compensator.json and the law of `dzdesign.derivation`; along a row of constant pressure the
law is a straight line in the command code, so its rounded values come from exact addition with carry: quotient and
remainder advance by the quotient and remainder of the slope. No multiplication, shift or reciprocal is shared with the
generated C.
"""

from collections.abc import Iterator
from fractions import Fraction
from math import lcm
from typing import Any

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import Line, evaluate_line


class ExactLaw:
    """The law of a compensator document on integer codes.

    Parameters
    ----------
    document : dict
        compensator.json, parsed and checked.
    """

    def __init__(self, document: dict[str, Any]) -> None:
        signals, table = document["signals"], document["beta"]
        self.command_max: int = signals["command_code_max"]
        self.pressure_max: int = signals["pressure_code_max"]
        self.compare_max: int = signals["compare_max"]
        self.reverse: int = document["reverse_codes"]
        self._law = law(document["law"])
        self._kappa = Fraction(*document["k_x_max_over_u_max"])
        self._u_min0 = Fraction(*document["u_min0_over_u_max"])
        self._nodes: list[int] = table["numerators"]
        self._denominator: int = table["denominator"]
        self._step: int = table["step_codes"]

    def beta(self, dp_code: int) -> Fraction:
        """Return beta at a difference of pressure codes; below ``-reverse`` the smallest one."""
        if dp_code < -self.reverse:
            return Fraction(min(self._nodes), self._denominator)
        left, past = divmod(max(dp_code, 0), self._step)
        rise = self._nodes[left + 1] - self._nodes[left]
        return Fraction(self._nodes[left] * self._step + rise * past, self._denominator * self._step)

    def line(self, beta: Fraction) -> Line:
        """Return the law at one beta in counts: slope per command code, and value at code 0."""
        return evaluate_line(
            self._law,
            beta=beta,
            kappa=self._kappa,
            u_min0_over_u_max=self._u_min0,
            n_adc=self.command_max,
            n_full=self.compare_max,
        )

    def rows(self, betas: list[Fraction]) -> Iterator[np.ndarray]:
        """Yield, for command codes 0, 1, ..., the rounded and limited compare values at all `betas`."""
        at = {beta: self.line(beta) for beta in set(betas)}
        lines = [at[beta] for beta in betas]
        half = Fraction(1, 2)
        scale = lcm(*(value.denominator for slope, start in lines for value in (slope, start + half)))
        if scale >= 2**62:
            raise RequirementError(f"the law's common denominator needs {scale.bit_length()} bits, expected at most 62")
        # floor(value + 1/2) rounds to nearest, a half up.
        starts = [divmod(int((start + half) * scale), scale) for _, start in lines]
        slopes = [divmod(int(slope * scale), scale) for slope, _ in lines]
        quotient, remainder = (np.array(column, dtype=np.int64) for column in zip(*starts, strict=True))
        step, carry = (np.array(column, dtype=np.int64) for column in zip(*slopes, strict=True))
        for _ in range(self.command_max + 1):
            yield np.clip(quotient, 0, self.compare_max)
            remainder = remainder + carry
            over = remainder >= scale
            remainder = np.where(over, remainder - scale, remainder)
            quotient = quotient + step + over
