"""`AboveTests`: the bound of a threshold continued above the last test by the curve's premise, for valve.json.

No ramp was recorded there, so the premise says more above the tests than between them. `line`: the threshold goes on
straight. `smooth`: it bends by at most M, downwards too. `monotone` bounds a rising threshold by its last value, and a
falling one not at all.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.certified_bound import CertifiedBound
from dzdesign.identify.valve.quantity_types import PressureDrop, Voltage

#: What a number of the file may be off by.
ROUNDING = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class AboveTests:
    """The bound above the last tested pressure drop; nothing is known beyond its last node."""

    certified: bool
    """Whether the bound above the tests holds with the side's confidence, provided that its premise holds. False: the
    premise gives no bound there."""
    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Nodes from the last tested pressure drop to the point at which the bound reaches zero."""
    u_lower_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Lower bounds at the nodes, linear between them: the continued threshold minus its errors."""

    def __post_init__(self) -> None:
        count = len(self.dp_MPa)
        if count < 2 or count != len(self.u_lower_V):
            raise RuleError(
                f"above the tests {count} pressure drops stand beside {len(self.u_lower_V)} bounds, expected two or "
                "more, and as many of each"
            )
        if any(left >= right for left, right in pairwise(self.dp_MPa)):
            raise RuleError("the pressure drops above the tests must rise")
        if any(right > left + ROUNDING for left, right in pairwise(self.u_lower_V)):
            raise RuleError("a bound above the tests must not rise")

    def bound(self) -> CertifiedBound:
        """Return the bound on the interval of the nodes, exact."""
        return CertifiedBound.of(self.dp_MPa, self.u_lower_V)

    def in_words(self, premise: str) -> str:
        """Return what the continued bound rests on."""
        rests: dict[str, str] = {
            "line": "the threshold continues as a straight line",
            "smooth": "the threshold continues from the last tests' value and slope, with curvature at most M",
            "monotone": "the threshold keeps rising or stays constant",
        }
        if self.certified:
            return f"certified if {rests[premise]}"
        return (
            "not certified: the threshold continues with the steepest slope between two tests: nothing bounds it there"
        )

