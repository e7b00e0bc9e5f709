"""The law in counts as a linear function of beta for one side, which is faster than the law itself for many betas."""

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import lcm

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import evaluate_line


@dataclass(frozen=True, slots=True, kw_only=True)
class LineInBeta:
    """Counts at a command: ``(start + code * slope) / unit``, each a number at beta 0 and what a beta of 1 adds."""

    start: tuple[int, int]
    slope: tuple[int, int]
    unit: int

    def counts(self, code: int | Fraction, beta: Fraction) -> Fraction:
        """Return the counts of the law at codes of command, from zero, and a beta."""
        codes, parts = code.numerator, code.denominator
        none, more = (start * parts + codes * slope for start, slope in zip(self.start, self.slope, strict=True))
        up = none * beta.denominator + more * beta.numerator
        return Fraction(up, self.unit * parts * beta.denominator)


@lru_cache(maxsize=64)
def line_in_beta(name: str, kappa: Fraction, u_min0_over_u_max: Fraction, n_adc: int, n_full: int) -> LineInBeta:
    """Return the law of a name as such a line, from the law itself at three betas.

    The arguments are those of `evaluate_line`; a law that is not straight in beta is a `RequirementError`.
    """
    at = [
        evaluate_line(
            law(name), beta=beta, kappa=kappa, u_min0_over_u_max=u_min0_over_u_max, n_adc=n_adc, n_full=n_full
        )
        for beta in (0, 1, 2)
    ]
    if any(2 * one != none + two for none, one, two in zip(*at, strict=True)):
        raise RequirementError(f"the law '{name}' is not straight in beta")
    parts = [part for line in at[:2] for part in (line.start, line.slope)]
    unit = lcm(*(part.denominator for part in parts))
    start, slope, start_one, slope_one = (part.numerator * (unit // part.denominator) for part in parts)
    return LineInBeta(start=(start, start_one - start), slope=(slope, slope_one - slope), unit=unit)
