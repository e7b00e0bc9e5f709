"""The valves of a common setting: what each was bounded to by its ramp tests, and that the offset lies under it.

The certificate of a compensator's file is for the valve in it. A common setting is of many, so its file holds of each
what `verify` needs to see that none is over-compensated: name, hash of valve.json, and the guarded threshold's bounds.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate, pairwise
from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import InputError, RequirementError, and_more, quoted
from dzdesign.identify.valve.side_model import TRENDS, SideModel

if TYPE_CHECKING:
    from dzdesign.design.compensator import Compensator

#: Over-compensated valves that a sentence names.
NAMED = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSide:
    """One sign of command of a valve: lower bounds of the guarded threshold.

    Attributes
    ----------
    trend : {"decreasing", "flat", "increasing"} or None
        How the threshold runs with the pressure drop.
    confidence : float
        With which all bounds hold together.
    dp_MPa, lower_V : tuple of float
        Tested pressure drops, rising, and the bound at each.
    """

    trend: str | None
    confidence: float
    dp_MPa: tuple[float, ...]
    lower_V: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.trend is not None and self.trend not in TRENDS:
            raise InputError(f"a trend of the lot is {quoted(self.trend)}, expected one of {', '.join(TRENDS)}")
        if not self.dp_MPa or len(self.dp_MPa) != len(self.lower_V):
            raise InputError(f"{len(self.dp_MPa)} pressure drops have {len(self.lower_V)} bounds, expected one each")
        if any(left >= right for left, right in pairwise(self.dp_MPa)):
            raise InputError("the pressure drops of a valve do not rise from test to test")

    @classmethod
    def of(cls, side: SideModel, guard: str) -> "LotSide":
        """Return the bounds of an identified side."""
        return cls(
            trend=side.trend,
            confidence=side.certificate.confidence,
            dp_MPa=side.guards[guard].beta_dp_MPa,
            lower_V=side.guards[guard].u_lower_V,
        )

    def steps(self) -> Iterator[tuple[Fraction, Fraction, Fraction]]:
        """Yield from where to where (MPa) which bound holds (V): straight from the tests, the threshold being monotone.

        A threshold that falls with dP is, below a test, at least that test's bound.
        """
        pressures = [Fraction(repr(dp)) for dp in self.dp_MPa]
        bounds = [Fraction(repr(bound)) for bound in self.lower_V]
        if self.trend == "decreasing":
            best = list(accumulate(reversed(bounds[1:]), max))[::-1]
        elif self.trend == "increasing":
            best = list(accumulate(bounds[:-1], max))
        else:
            best = [min(bounds)] * (len(bounds) - 1)
        if not best:
            yield pressures[0], pressures[0], bounds[0]
        for (low, high), bound in zip(pairwise(pressures), best, strict=True):
            yield low, high, bound


@dataclass(frozen=True, slots=True, kw_only=True)
class LotValve:
    """A valve of the lot.

    Attributes
    ----------
    name : str
        By which it stands in the table of the batch.
    valve_sha256 : str
        Of its valve.json.
    positive, negative : LotSide
        Bounds of each sign of command that the setting drives; negative: or None.
    """

    name: str
    valve_sha256: str
    positive: LotSide
    negative: LotSide | None = None

    @classmethod
    def of(cls, name: str, valve_sha256: str, sides: Mapping[int, SideModel], guards: Mapping[int, str]) -> "LotValve":
        """Return a valve's part; `sides` and `guards` by the sign of command."""
        bounds = {sign: LotSide.of(side, guards[sign]) for sign, side in sides.items()}
        return cls(name=name, valve_sha256=valve_sha256, positive=bounds[1], negative=bounds.get(-1))


@dataclass(frozen=True, slots=True, kw_only=True)
class LotMargin:
    """How far the offset of a common setting stays under the bound of one valve.

    Attributes
    ----------
    name : str
        Of the valve.
    sign : {1, -1}
        Of the command, where that is least.
    dp_MPa : Fraction
        Pressure drop, where it is least.
    margin_V : Fraction
        The least distance; negative of a valve that is over-compensated.
    """

    name: str
    sign: int
    dp_MPa: Fraction
    margin_V: Fraction


def lot_margins(compensator: "Compensator") -> tuple[LotMargin, ...]:
    """Return each valve's margin, exactly, at every code of its own tested interval, worst side, worst code.

    A code stands for all pressures that may have made it; rounding and dither count as drive.

    Parameters
    ----------
    compensator : Compensator
        A common setting with its lot.
    """
    signals = compensator.signals
    kept = Fraction(1, 2 * signals.compare_max) + Fraction(compensator.amplifier.dither_counts, signals.compare_max)
    margins: dict[str, LotMargin] = {}
    for sign in signals.signs:
        law = compensator.side(sign)
        low, high = signals.difference_error(sign)
        numerators = _numerators(law.beta_numerators, compensator.beta_step_codes, signals.largest_difference(sign))
        scale = compensator.beta_denominator * compensator.beta_step_codes
        unit_V = law.u_min0_over_u_max * compensator.u_max_V / scale
        for valve in compensator.lot:
            side = valve.positive if sign > 0 else valve.negative
            if side is None:
                raise InputError(f"'{valve.name}' of the lot has no bounds of the negative side; run `batch` again")
            for left, right, bound in side.steps():
                first = max(ceil(signals.dp_code(left)) - high, 0)
                last = min(floor(signals.dp_code(right)) - low, numerators.size - 1)
                if first > last and left == right:  # one test, between two codes: both of them count
                    first, last = last, min(first, numerators.size - 1)
                if first > last:
                    continue
                code = first + int(numerators[first : last + 1].argmax())
                margin = bound - int(numerators[code]) * unit_V - kept * compensator.u_max_V
                if valve.name not in margins or margin < margins[valve.name].margin_V:
                    margins[valve.name] = LotMargin(
                        name=valve.name, sign=sign, dp_MPa=signals.dp_MPa(code), margin_V=margin
                    )
    return tuple(margins.values())


def _numerators(nodes: Sequence[int], step: int, last: int) -> np.ndarray:
    """Return the table between its nodes, times their distance: whole numbers at every code from 0 to `last`."""
    index, past = np.divmod(np.arange(last + 1), step)
    table = np.array(nodes, dtype=np.int64)  # at most 2^31 times a step: far from 2^63
    return table[index] * (step - past) + table[index + 1] * past


def prove_lot(compensator: "Compensator") -> tuple[LotMargin, ...]:
    """Prove that a common setting over-compensates no valve of its lot, and return the margins.

    Raises
    ------
    RequirementError
        If it does, with the valves' names, the worst first.
    """
    margins = lot_margins(compensator)
    above = sorted((each for each in margins if each.margin_V < 0), key=lambda each: each.margin_V)
    if above:
        worst = above[0]
        raise RequirementError(
            f"the common setting over-compensates {len(above)} of {len(margins)} valves of its lot: "
            f"{and_more([each.name for each in above], NAMED)}; {worst.name} by {-1e3 * float(worst.margin_V):.3f} mV "
            f"at {float(worst.dp_MPa):.2f} MPa"
        )
    return margins
