"""Which valves of a lot were not tested where the lot was, and over which pressure drops a setting serves all."""

from collections.abc import Sequence
from dataclasses import dataclass

from dzdesign.design.lot import LotValve

#: Tests nearer than this share are at one pressure drop of the lot: no bench sets it to a per cent.
SAME = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Lacking:
    """A valve that was not tested at pressure drops at which half of the lot or more was.

    Attributes
    ----------
    name : str
        Of the valve.
    sign : {1, -1}
        Of the command.
    dp_MPa : tuple of float
        Which, as the others' tests have it in the middle.
    """

    name: str
    sign: int
    dp_MPa: tuple[float, ...]


def common_interval(lot: Sequence[LotValve]) -> tuple[float, float] | None:
    """Return the pressure drops that every valve was tested over, MPa; None where there are none, or no valve."""
    ends = [(side.dp_MPa[0], side.dp_MPa[-1]) for valve in lot for side in (valve.positive, valve.negative) if side]
    if not ends:
        return None
    low, high = max(low for low, _ in ends), min(high for _, high in ends)
    return (low, high) if low <= high else None


def lacking_in(lot: Sequence[LotValve]) -> tuple[Lacking, ...]:
    """Return the valves that lack one of the lot's pressure drops, in the order of the lot."""
    found = []
    for sign in (1, -1):
        tested = {valve.name: side.dp_MPa for valve in lot if (side := valve.positive if sign > 0 else valve.negative)}
        wanted = _pressures_of_lot(list(tested.values()))
        for name, own in tested.items():
            missing = [(low, high) for low, high in wanted if not any(low <= dp <= high for dp in own)]
            if missing:
                middles = tuple(round((low + high) / 2, 6) for low, high in missing)
                found.append(Lacking(name=name, sign=sign, dp_MPa=middles))
    return tuple(found)


def _pressures_of_lot(tested: Sequence[Sequence[float]]) -> list[tuple[float, float]]:
    """Return from where to where the tests of each pressure drop lie at which half of the valves or more was tested."""
    places = sorted((dp, valve) for valve, own in enumerate(tested) for dp in own)
    groups: list[list[tuple[float, int]]] = []
    for dp, valve in places:
        if groups and dp <= groups[-1][-1][0] * (1 + SAME):
            groups[-1].append((dp, valve))
        else:
            groups.append([(dp, valve)])
    return [
        (group[0][0], group[-1][0]) for group in groups if 2 * len({valve for _, valve in group}) >= len(tested)
    ]
