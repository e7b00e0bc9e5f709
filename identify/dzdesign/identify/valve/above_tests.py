"""`AboveTests`: the bound of a threshold continued above the last test by the curve's premise, for valve.json.

No ramp was recorded there, so the premise says more above the tests than between them. `line`: the threshold goes on
straight. `smooth`: it bends by at most M, downwards too. `monotone` bounds a rising threshold by its last value, and a
falling one not at all: the steepest slope between two tests is then taken on, and nothing is certified.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Annotated

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.constants import REFUSED, Premise
from dzdesign.identify.valve.certified_bound import BoundPiece, CertifiedBound
from dzdesign.identify.valve.quantity_types import PressureDrop, Probability, SecondDifference, Voltage, VoltageError
from dzdesign.identify.valve.staircase import Direction

#: What a number of the file may be off by.
ROUNDING = 1e-7
#: Below this a bound says no more, V: so the numbers of the file stay small whatever M.
LOWEST_V = -1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class AboveTests:
    """The bound above the last tested pressure drop; nothing is known beyond its last node."""

    certified: Annotated[
        bool,
        Meta(
            description="Whether the bound above the tests holds with the side's confidence, provided that its premise "
            "holds. False: the premise gives no bound there, or the tests contradict it."
        ),
    ]
    slope_from_MPa: Annotated[
        PressureDrop | None,
        Meta(
            description="For the premise smooth, the test whose chord to the last test gives the slope; null for "
            "another premise."
        ),
    ]
    curvature_V_MPa2: Annotated[
        SecondDifference,
        quantity(
            "V/MPa2", "Bound M of the curvature above the tests, in both directions; 0 unless the premise is smooth."
        ),
    ]
    lack_of_fit_p: Annotated[
        Probability | None,
        Meta(
            description="Probability that the tests bend downwards at least as much as these if M were true; nothing "
            "is certified below 0.01. Null: M was estimated from the tests, or the premise is another."
        ),
    ]
    dp_MPa: Annotated[
        tuple[PressureDrop, ...],
        quantity("MPa", "Nodes from the last tested pressure drop to the point at which the bound reaches zero."),
    ]
    band_V: Annotated[
        tuple[VoltageError, ...],
        quantity(
            "V",
            "Amount that errors take off the continued threshold at each node. It covers noise, scatter and "
            "systematic errors, with the leverage of the tests.",
        ),
    ]
    u_lower_V: Annotated[
        tuple[Voltage, ...],
        quantity(
            "V",
            "Lower bounds at the nodes: the continued threshold minus the band and M/2 (dP - last) (dP - "
            "slope_from). Between nodes the bound is their chord, minus M/2 (dP - a) (b - dP) in the first "
            "interval.",
        ),
    ]

    def __post_init__(self) -> None:
        count = len(self.dp_MPa)
        if count < 2 or not count == len(self.band_V) == len(self.u_lower_V):
            raise RuleError(
                f"above the tests {count} pressure drops stand beside {len(self.band_V)} bands and "
                f"{len(self.u_lower_V)} bounds, expected two or more, and as many of each"
            )
        if any(left >= right for left, right in pairwise(self.dp_MPa)):
            raise RuleError("the pressure drops above the tests must rise")
        if self.certified and self.lack_of_fit_p is not None and self.lack_of_fit_p < REFUSED:
            raise RuleError(
                f"above the tests a bound is certified that these tests refuse (p = {self.lack_of_fit_p:.2g})"
            )

    def bound(self) -> CertifiedBound:
        """Return the bound on the interval of the nodes, exact, certified or not."""
        nodes, bounds = ([Fraction(repr(value)) for value in values] for values in (self.dp_MPa, self.u_lower_V))
        bends = [Fraction(repr(self.curvature_V_MPa2)), *(Fraction(0) for _ in nodes[2:])]
        return CertifiedBound(
            pieces=tuple(
                BoundPiece(*ends, *values, bend)
                for ends, values, bend in zip(pairwise(nodes), pairwise(bounds), bends, strict=True)
            )
        )

    def check(
        self, premise: Premise, trend: Direction, dp_MPa: Sequence[float], u_V: Sequence[float], lower_V: float
    ) -> None:
        """Refuse bounds that do not follow from the thresholds (V) at the tests, or from their lower bound at the last.

        The band stands for itself: errors of the tests are not in valve.json. It is the last test's at first, and it
        grows faster and faster, for so does the leverage.
        """
        bends = premise == "smooth"
        if bends != (self.slope_from_MPa is not None) or (self.curvature_V_MPa2 and not bends):
            raise RuleError("a slope's test and an M above the tests belong to the premise 'smooth', and to no other")
        if abs(self.dp_MPa[0] - dp_MPa[-1]) > ROUNDING or abs(self.u_lower_V[0] - lower_V) > 2 * ROUNDING:
            raise RuleError("the bound above the tests must begin at the last test's")
        if self.certified and premise == "monotone" and trend != "increasing":
            raise RuleError(f"above the tests a {trend} threshold is certified that is only known to run one way")
        start = slope_start(self.slope_from_MPa, dp_MPa)
        at = np.array(self.dp_MPa)
        continued = continued_threshold(premise, trend, dp_MPa, u_V, start, at)
        expected = continued - np.array(self.band_V) - largest_bend(self.curvature_V_MPa2, dp_MPa, start, at)
        expected = np.maximum(expected, LOWEST_V)
        # The slope is of two tests: rounding turns it the more the closer they stand.
        apart = float(np.diff(dp_MPa).min()) if premise == "monotone" else dp_MPa[-1] - dp_MPa[start]
        lever = (at - dp_MPa[-1]) / apart
        steepest = float(np.abs(np.diff(u_V) / np.diff(dp_MPa)).max())
        bend = self.curvature_V_MPa2 * (at - dp_MPa[start])
        allowed = 8 * ROUNDING * (1 + lever) * (1 + steepest + bend) + largest_bend(ROUNDING, dp_MPa, start, at)
        off = np.abs(np.array(self.u_lower_V) - expected) - allowed
        if np.any(off > 0):
            place = int(off.argmax())
            raise RuleError(
                f"the bound at {self.dp_MPa[place]:g} MPa, above the tests, is {self.u_lower_V[place]:g} V, but "
                f"{expected[place]:g} V follows from the thresholds at the tests, band and M"
            )
        growth = np.diff(self.band_V) / np.diff(at)
        if premise != "monotone" and np.any(np.diff(growth[1:]) < -8 * ROUNDING / np.diff(at).min()):
            raise RuleError("the band above the tests must grow faster and faster")

    def in_words(self, premise: Premise, trend: Direction, units: RecordedUnits) -> str:
        """Return what the continued bound rests on, and whether it is certified."""
        if premise == "line":
            rests = "the threshold continues as a straight line, with the line's band"
        elif premise == "smooth":
            bend = units.text(1e3 * self.curvature_V_MPa2, ".3g mV/MPa²")
            rests = f"the threshold continues from the last tests' value and slope, with curvature at most M = {bend}"
            if not self.certified:
                rests += f", which the tests contradict (p = {self.lack_of_fit_p or 0.0:.2g})"
        elif trend == "increasing":
            rests = "the threshold keeps rising or stays constant"
        else:
            rests = "the threshold continues with the steepest slope between two tests: nothing bounds it there"
        return f"{'certified if' if self.certified else 'not certified:'} {rests}"


def slope_start(slope_from_MPa: float | None, dp_MPa: Sequence[float]) -> int:
    """Return the row of the test that the slope is taken from; the first one where no test is named."""
    if slope_from_MPa is None:
        return 0
    away = [abs(dp - slope_from_MPa) for dp in dp_MPa[:-1]]
    row = away.index(min(away)) if away else 0
    if not away or away[row] > ROUNDING:
        raise RuleError(f"the slope above the tests is from {slope_from_MPa:g} MPa, expected a test below the last one")
    return row


def continued_threshold(
    premise: Premise, trend: Direction, dp_MPa: Sequence[float], u_V: Sequence[float], start: int, at_MPa: np.ndarray
) -> np.ndarray:
    """Return the threshold continued above the tests, V: straight, without a band and without a bend."""
    if premise != "monotone":
        slope = (u_V[-1] - u_V[start]) / (dp_MPa[-1] - dp_MPa[start])
    elif trend == "increasing":
        slope = 0.0
    else:
        slope = min(0.0, float(np.min(np.diff(u_V) / np.diff(dp_MPa))))
    continued: np.ndarray = u_V[-1] + slope * (at_MPa - dp_MPa[-1])
    return continued


def largest_bend(curvature: float, dp_MPa: Sequence[float], start: int, at_MPa: np.ndarray) -> np.ndarray:
    """Return by how much a threshold whose second divided difference is at least -M may lie below its chord's line, V.

    f(x) = f(b) + f[a, b] (x - b) + f[a, b, x] (x - a) (x - b), and 2 f[a, b, x] >= -M.
    """
    bend: np.ndarray = curvature / 2 * (at_MPa - dp_MPa[-1]) * (at_MPa - dp_MPa[start])
    return bend
