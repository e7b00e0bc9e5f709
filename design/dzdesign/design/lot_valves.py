"""The valves of a lot: of each, what its ramp tests bounded the guarded threshold to, and at which pressure drops.

The certificate of a compensator's file is for the valve in it. A lot setting is of many, so its file holds of each what
`verify` needs to see that none is over-compensated: name, hash of valve.json, and the guarded threshold's bounds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from dzdesign.core.artefact_types import RuleError, Sha256, quantity
from dzdesign.identify.constants import Direction
from dzdesign.identify.valve.certified_bound import CertifiedBound
from dzdesign.identify.valve.quantity_types import PressureDrop, Voltage
from dzdesign.identify.valve.side_model import SideModel


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSide:
    """Lower bounds of a valve's guarded threshold for one sign of the command."""

    trend: Direction | None
    """Trend of the threshold over the pressure drop; null if fewer than two pressure drops were tested."""
    confidence: Annotated[float, quantity("1", ge=0.5, le=1)]
    """Joint confidence level of all bounds."""
    tested_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Tested pressure drops, in ascending order."""
    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Nodes of the bound, in ascending order."""
    u_lower_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Lower bound of the threshold at each node, linear between them."""

    def __post_init__(self) -> None:
        if not self.dp_MPa or len(self.dp_MPa) != len(self.u_lower_V):
            raise RuleError(f"{len(self.dp_MPa)} pressure drops have {len(self.u_lower_V)} bounds, expected one each")
        if any(left >= right for nodes in (self.dp_MPa, self.tested_MPa) for left, right in pairwise(nodes)):
            raise RuleError("the pressure drops of a valve do not rise from test to test")

    @classmethod
    def of(cls, side: SideModel, guard: str) -> "LotSide":
        """Return the bounds of an identified side."""
        curve = side.certified[guard]
        return cls(
            trend=side.trend,
            confidence=side.certificate.confidence,
            tested_MPa=curve.dp_MPa,
            dp_MPa=curve.bound_dp_MPa,
            u_lower_V=curve.bound_V,
        )

    def bound(self) -> CertifiedBound:
        """Return the bound on the whole tested interval, exact."""
        return CertifiedBound.of(self.dp_MPa, self.u_lower_V)


@dataclass(frozen=True, slots=True, kw_only=True)
class LotValve:
    """A valve of the lot."""

    name: str
    """Name of the valve in the table of the batch."""
    valve_sha256: Sha256
    """SHA-256 of its valve.json."""
    positive: LotSide
    """Bounds for positive commands."""
    negative: LotSide | None = None
    """Bounds for negative commands; null if the setting drives none."""

    def side(self, sign: int) -> LotSide | None:
        """Return the bounds of one sign of command."""
        return self.positive if sign > 0 else self.negative

    @classmethod
    def of(cls, name: str, valve_sha256: str, sides: Mapping[int, SideModel], guards: Mapping[int, str]) -> "LotValve":
        """Return a valve's part; `sides` and `guards` by the sign of command."""
        bounds = {sign: LotSide.of(side, guards[sign]) for sign, side in sides.items()}
        return cls(name=name, valve_sha256=valve_sha256, positive=bounds[1], negative=bounds.get(-1))


#: Tests nearer than this share are at one pressure drop of the lot: no bench sets it to a percent.
SAME = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Lacking:
    """A valve that was not tested at pressure drops at which half of the lot or more was."""

    #: Of the valve.
    name: str
    #: Of the command.
    sign: int
    #: Which, as the others' tests have it in the middle.
    dp_MPa: tuple[float, ...]


def common_interval(lot: Sequence[LotValve]) -> tuple[float, float] | None:
    """Return the pressure drops that every valve was tested over, MPa; None where there are none, or no valve."""
    sides = [side for valve in lot for sign in (1, -1) if (side := valve.side(sign))]
    ends = [(side.tested_MPa[0], side.tested_MPa[-1]) for side in sides]
    if not ends:
        return None
    low, high = max(low for low, _ in ends), min(high for _, high in ends)
    return (low, high) if low <= high else None


def lacking_in(lot: Sequence[LotValve]) -> tuple[Lacking, ...]:
    """Return the valves that lack one of the lot's pressure drops, in the order of the lot."""
    found = []
    for sign in (1, -1):
        tested = {valve.name: side for valve in lot if (side := valve.side(sign))}
        wanted = _pressures_of_lot([side.tested_MPa for side in tested.values()])
        for name, side in tested.items():
            missing = [(low, high) for low, high in wanted if not any(low <= dp <= high for dp in side.tested_MPa)]
            if missing:
                middles = tuple(round((low + high) / 2, 6) for low, high in missing)
                found.append(Lacking(name=name, sign=sign, dp_MPa=middles))
    return tuple(found)


def without_narrow(
    lot: Sequence[LotValve], lacking: Sequence[Lacking]
) -> tuple[frozenset[str], tuple[float, float] | None]:
    """Return which valves make the interval of the lot narrower by what they lack, and what it is without them.

    The interval is None without any such valve, or where none is left.
    """
    sides = {(valve.name, sign): valve.side(sign) for valve in lot for sign in (1, -1)}
    names = set()
    for each in lacking:
        side = sides[each.name, each.sign]
        if side and not all(side.tested_MPa[0] < dp < side.tested_MPa[-1] for dp in each.dp_MPa):
            names.add(each.name)
    before = common_interval(lot)
    after = common_interval([valve for valve in lot if valve.name not in names])
    if before and after and before[0] <= after[0] * (1 + SAME) and after[1] <= before[1] * (1 + SAME):
        return frozenset(), None  # the other side of command, or another valve, ends there too
    return frozenset(names), after if names else None


def _pressures_of_lot(tested: Sequence[Sequence[float]]) -> list[tuple[float, float]]:
    """Return from where to where the tests of each pressure drop lie at which half of the valves or more was tested."""
    places = sorted((dp, valve) for valve, pressures in enumerate(tested) for dp in pressures)
    groups: list[list[tuple[float, int]]] = []
    for dp, valve in places:
        if groups and dp <= groups[-1][-1][0] * (1 + SAME):
            groups[-1].append((dp, valve))
        else:
            groups.append([(dp, valve)])
    return [(group[0][0], group[-1][0]) for group in groups if 2 * len({valve for _, valve in group}) >= len(tested)]
