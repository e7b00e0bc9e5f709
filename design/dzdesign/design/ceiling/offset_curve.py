"""An offset over the pressure drop, exactly from the decimal numbers of valve.json, and the bound that holds it."""

from bisect import bisect_left
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.core.worded import worded
from dzdesign.design.offset.above_tests import OffsetAbove
from dzdesign.identify.valve.certified_bound import CertifiedBound, NEAR_MPa

#: valve.json has seven decimals, so a sum of two of its numbers is right to this, in V.
DECIMALS = Fraction(1, 10**6)


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetCurve:
    """An offset over the pressure drop and the bounds that hold it, exactly from the decimal numbers of valve.json."""

    #: Nodes, from the first tested pressure drop to the last, rising.
    dp_MPa: tuple[Fraction, ...]
    #: Offset at each; linear between them.
    offset_V: tuple[Fraction, ...]
    #: Lower bound of the guarded threshold on that interval; None of an offset that nothing has to bound.
    certified: CertifiedBound | None
    #: Up to this dP0 the offset is at most the one there, as Eq. (7) holds beta = 1; None follows the tests.
    hold_below_MPa: Fraction | None
    #: How it goes on above the tests; None: the last offset is held, and nothing is certified.
    above: OffsetAbove | None = None

    def at(self, dp_MPa: Fraction) -> Fraction:
        """Return the offset in V by the selector of Eq. (7).

        For dP <= dP0 the paper holds beta = 1; where the threshold grows with dP that would over-compensate, so there
        the smaller of the two is taken. Below the tested interval the first node is held.
        """
        if self.above is not None and dp_MPa > self.dp_MPa[-1]:
            return self.above.at(dp_MPa)
        value = self._straight(dp_MPa)
        if self.hold_below_MPa is not None and dp_MPa <= self.hold_below_MPa:
            value = min(value, self._straight(self.hold_below_MPa))
        return value

    def _straight(self, dp_MPa: Fraction) -> Fraction:
        nodes, offset = self.dp_MPa, self.offset_V
        if dp_MPa >= nodes[-1]:
            return offset[-1]
        if dp_MPa <= nodes[0]:
            return offset[0]
        right = bisect_left(nodes, dp_MPa)
        share = (dp_MPa - nodes[right - 1]) / (nodes[right] - nodes[right - 1])
        return offset[right - 1] + share * (offset[right] - offset[right - 1])

    def bound(self, dp_MPa: Fraction) -> Fraction | None:
        """Return the lower bound of the guarded threshold at dP in V, or None where nothing is certified."""
        if self.above is not None and dp_MPa > self.dp_MPa[-1]:
            return self.above.bound_at(dp_MPa)
        return None if self.certified is None else self.certified.at(dp_MPa)

    def in_doubles(self, dp_MPa: np.ndarray) -> np.ndarray:
        """Return the offset in double precision, V, and where a bound is certified the lower of both.

        The pressure drops rise.
        """
        nodes, offset = (np.array([float(value) for value in values]) for values in (self.dp_MPa, self.offset_V))
        value: np.ndarray = np.interp(dp_MPa, nodes, offset)
        if self.above is not None:
            value = np.where(dp_MPa > nodes[-1], self.above.in_doubles(dp_MPa), value)
        if self.hold_below_MPa is not None:
            hold = float(self.hold_below_MPa)
            value = np.where(dp_MPa <= hold + NEAR_MPa, np.minimum(value, np.interp(hold, nodes, offset)), value)
        return value if self.certified is None else np.minimum(value, self.certified.in_doubles(dp_MPa))


def certified_V(curve: OffsetCurve, dp_MPa: Fraction) -> Fraction:
    """Return the offset that is certified at a pressure drop, V; a curve above its bound is refused."""
    offset, bound = curve.at(dp_MPa), curve.bound(dp_MPa)
    if bound is None:
        return offset
    if offset > bound + DECIMALS:
        raise RequirementError(
            worded(
                "beta u_min0 is {offset:.4f V} at {dp:.3f MPa}, above the threshold's lower bound of {bound:.4f V}; "
                "make valve.json again with `dzdesign identify`",
                offset=float(offset),
                dp=float(dp_MPa),
                bound=float(bound),
            )
        )
    return min(offset, bound)
