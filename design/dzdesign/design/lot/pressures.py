"""Which valves of a lot were not tested where the lot was, and over which pressure drops a setting serves all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.design.lot.valves import LotSide, LotValve

#: Tests nearer than this share are at one pressure drop of the lot: no bench sets it to a percent.
SAME = 0.05
#: Trends of which a test between two others raises the bound: of another, the lowest of all holds everywhere.
SLOPING = ("decreasing", "increasing")


@dataclass(frozen=True, slots=True, kw_only=True)
class Lacking:
    """A valve that was not tested at pressure drops at which half of the lot or more was."""

    #: Of the valve.
    name: str
    #: Of the command.
    sign: int
    #: Which, as the others' tests have it in the middle.
    dp_MPa: tuple[float, ...]
    #: By how much its bound there lies under the straight line between its bounds at the tests beside, at most: what a
    #: test there would gain, about. 0 where its threshold has no trend, or lies outside its tests.
    coarser_V: float = 0.0


def common_interval(lot: Sequence[LotValve]) -> tuple[float, float] | None:
    """Return the pressure drops that every valve was tested over, MPa; None where there are none, or no valve."""
    ends = [(side.dp_MPa[0], side.dp_MPa[-1]) for valve in lot for sign in (1, -1) if (side := valve.side(sign))]
    if not ends:
        return None
    low, high = max(low for low, _ in ends), min(high for _, high in ends)
    return (low, high) if low <= high else None


def lacking_in(lot: Sequence[LotValve]) -> tuple[Lacking, ...]:
    """Return the valves that lack one of the lot's pressure drops, in the order of the lot."""
    found = []
    for sign in (1, -1):
        tested = {valve.name: side for valve in lot if (side := valve.side(sign))}
        wanted = _pressures_of_lot([side.dp_MPa for side in tested.values()])
        for name, side in tested.items():
            missing = [(low, high) for low, high in wanted if not any(low <= dp <= high for dp in side.dp_MPa)]
            if missing:
                middles = tuple(round((low + high) / 2, 6) for low, high in missing)
                coarser = max(_coarser_V(side, dp) for dp in middles)
                found.append(Lacking(name=name, sign=sign, dp_MPa=middles, coarser_V=coarser))
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
        if side and not all(side.dp_MPa[0] < dp < side.dp_MPa[-1] for dp in each.dp_MPa):
            names.add(each.name)
    before = common_interval(lot)
    after = common_interval([valve for valve in lot if valve.name not in names])
    if before and after and before[0] <= after[0] * (1 + SAME) and after[1] <= before[1] * (1 + SAME):
        return frozenset(), None  # the other side of command, or another valve, ends there too
    return frozenset(names), after if names else None


def _coarser_V(side: LotSide, dp_MPa: float) -> float:
    """Return how far a bound between two tests lies under the straight line through theirs, V."""
    if side.trend not in SLOPING or not side.dp_MPa[0] < dp_MPa < side.dp_MPa[-1]:
        return 0.0
    straight = np.interp(dp_MPa, side.dp_MPa, side.u_lower_V)
    return max(float(straight) - float(side.bound().in_doubles(np.array([dp_MPa]))[0]), 0.0)


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
