"""The metering edge whose pressure drop a recording holds, where the ports' pressures are its columns.

A valve of four ports opens two edges at once: P to A and B to T at positive commands, P to B and A to T at negative
ones. Which pressures were recorded says which edge is meant; with all four both edges are there.
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures, si_factor
from dzdesign.identify.valve.recorded_drop import DropColumns, DropQuantity

#: Pressures of a valve's ports, as columns are called.
PORTS: tuple[DropQuantity, ...] = ("pP", "pA", "pB", "pT")
#: Sign of the command -> its edges, inlet first, each from the port ahead to the port behind.
EDGES: Mapping[int, tuple[tuple[DropQuantity, DropQuantity], ...]] = {
    1: (("pP", "pA"), ("pB", "pT")),
    -1: (("pP", "pB"), ("pA", "pT")),
}
#: Sensors A and B alone measure one pressure drop, A minus B. Either may be the higher one at negative commands.
TWO_SENSORS: tuple[DropQuantity, DropQuantity] = ("pA", "pB")
#: What may change its sign with the command: the drop of two ports of an edge runs from the port ahead.
OF_EITHER_SIGN: tuple[tuple[DropQuantity, ...], ...] = (("dP",), TWO_SENSORS)
#: Commands within this share of u_max are at rest: noise about zero does not turn the valve round.
AT_REST = 0.01
#: What a pressure is measured from, behind its unit, as in bara, MPa(g) and psi abs; or as a word of its label.
REFERENCE = re.compile(
    r"(bar|psi|pa|at|kgf?/cm(?:2|\u00b2))[\s_([]*(a|g|abs\.?|absolute?|ga?uge|rel\.?|relativ)[)\]]?$", re.IGNORECASE
)
REFERENCE_IN_LABEL = re.compile(r"(?<![^\W_])(?:abs|absolute?|ga?uge|rel|relativ)(?![^\W_])", re.IGNORECASE)
#: The ambient pressure, Pa.
AMBIENT = 101_325.0
#: A recording shows a side if so many samples of its command go that far into it, over u_max.
SMALLEST_SWEEP, SWEEP_SAMPLES = 0.1, 5


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MeteringEdge:
    """Which quantities make the pressure drop at each sign of the command: dP itself, or those ahead and behind.

    None where nothing makes it at that sign; `ambiguous` where both edges could be meant.
    """

    positive: tuple[DropQuantity, ...] | None = None
    negative: tuple[DropQuantity, ...] | None = None
    ambiguous: bool = False

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantities that are read; none where there is no pressure drop."""
        return tuple(dict.fromkeys((*(self.positive or ()), *(self.negative or ()))))

    @property
    def side_without(self) -> str:
        """The one side without a pressure drop beside another with it, or nothing."""
        if not self.quantities:
            return ""
        return "positive" if self.positive is None else "negative" if self.negative is None else ""

    def drop(self, data: Mapping[str, np.ndarray], u: np.ndarray, u_max: float) -> np.ndarray | None:
        """Return the pressure drop of samples at commands `u`, NaN where none is known; None without any column."""
        if not self.quantities:
            return None
        both = [_difference(data, names, u.size) for names in (self.positive, self.negative)]
        if self.positive == self.negative:
            return both[0]
        return np.where(_side_of_samples(u, u_max) > 0, *both)

    def columns(self, labels: Mapping[str, str]) -> tuple[tuple[DropColumns, ...], tuple[DropColumns, ...]]:
        """Return which columns make it at positive and at negative commands; empty where none does."""
        positive, negative = (
            (DropColumns(quantities=names, labels=tuple(labels[name] for name in names)),) if names else ()
            for names in (self.positive, self.negative)
        )
        return positive, negative


def metering_edge(quantities: Collection[str]) -> MeteringEdge:
    """Return what makes the pressure drop of recorded quantities.

    Examples
    --------
    >>> metering_edge(["pP", "pA", "pB"])
    MeteringEdge(positive=('pP', 'pA'), negative=('pP', 'pB'), ambiguous=False)
    >>> metering_edge(["pA", "pB"]).negative, metering_edge(["pP", "pA"]).negative
    (('pA', 'pB'), None)
    """
    if "dP" in quantities:
        return MeteringEdge(positive=("dP",), negative=("dP",))
    known = set(quantities) & set(PORTS)
    if known == set(PORTS):
        return MeteringEdge(ambiguous=True)
    if known == set(TWO_SENSORS):
        return MeteringEdge(positive=TWO_SENSORS, negative=TWO_SENSORS)
    positive, negative = (next((edge for edge in EDGES[sign] if known >= set(edge)), None) for sign in (1, -1))
    return MeteringEdge(positive=positive, negative=negative)


def gauge_beside_absolute(edge: MeteringEdge, labels: Mapping[str, str], units: Mapping[str, str]) -> str:
    """Return what to say where the drop is that of an absolute pressure and another, by quantity's label and unit.

    One without a word on it may be either, so it is refused beside an absolute one, and is gauge beside a gauge one.
    """
    for pair in (edge.positive, edge.negative):
        kinds = {_reference(units[name], labels[name]): name for name in pair or ()}
        if len(kinds) == 1 or "absolute" not in kinds:
            continue
        kind, other = next((kind, name) for kind, name in kinds.items() if kind != "absolute")
        one = kinds["absolute"]
        bare = REFERENCE.sub(r"\1", units[one]).rpartition("..")[2].lstrip("0123456789. ")
        ambient = AMBIENT / si_factor(bare, "pressure") if measures(bare, "pressure") else 0.0
        gauge = f"{bare}g" if measures(f"{bare}g", "pressure") else bare
        off = f'--columns "{one}={labels[one]}:{ambient:.4f}..{100 + ambient:.4f} = 0..100 {gauge}"'
        if kind:
            return (
                f"'{labels[one]}', an absolute pressure, and '{labels[other]}', a gauge pressure: their difference is "
                f"off by the ambient pressure. Take that off, for example {off}"
            )
        return (
            f"'{labels[one]}', an absolute pressure, and '{labels[other]}', which may be a gauge pressure. If it is "
            f'absolute too, give --columns "{other}={labels[other]}:{units[one]}"; if not, {off}'
        )
    return ""


def _reference(unit: str, label: str) -> str:
    """Return what a pressure is measured from, ``absolute`` or ``gauge``; nothing where unit and label don't say.

    Examples
    --------
    >>> [_reference(unit, "pA") for unit in ("bara", "MPa (abs)", "4..20 mA = 0..100 barg", "kPa")]
    ['absolute', 'absolute', 'gauge', '']
    """
    found = REFERENCE.search(unit.strip())
    word = found[2] if found else ""
    if not word and "=" not in unit and (found := REFERENCE_IN_LABEL.search(label)):
        word = found[0]
    return {"a": "absolute", "g": "gauge", "r": "gauge"}.get(word[:1].lower(), "")


def which_edge(labels: Mapping[str, str]) -> str:
    """Return what to say where all four ports were recorded, under these labels."""
    named = ", ".join(f"{port}={labels[port]}" for port in PORTS[:3])
    return (
        "the pressures of P, A, B and T, so the drop of either edge: pP - pA (pP - pB at negative commands), or pB - "
        f'pT (pA - pT); name the ports of the metering edge only, for example --columns "{named}"'
    )


def side_without_dp(edge: MeteringEdge, labels: Mapping[str, str], path: Path, u: np.ndarray, u_max: float) -> str:
    """Return the side that a recording shows and that has no pressure drop beside the other's, or nothing.

    Raises
    ------
    InputError
        If the recording shows that side only.
    """
    if not edge.side_without:
        return ""
    sign = 1 if edge.side_without == "positive" else -1
    shown = {each: np.count_nonzero(each * u >= SMALLEST_SWEEP * u_max) >= SWEEP_SAMPLES for each in (1, -1)}
    if shown[sign] and not shown[-sign]:
        there = " and ".join(f"'{labels[name]}'" for name in edge.quantities)
        one, other = (" and ".join(each) for each in EDGES[sign])
        raise InputError(
            f"'{path}' holds {edge.side_without} commands only, and {there} make the pressure drop of the other side; "
            f"expected {one}, or {other}, or dP. If these commands open the edge between them, name the ports so by "
            "--columns"
        )
    return edge.side_without if shown[sign] else ""


def _difference(data: Mapping[str, np.ndarray], names: tuple[str, ...] | None, size: int) -> np.ndarray:
    if names is None:
        return np.full(size, np.nan)
    return data[names[0]] if len(names) == 1 else data[names[0]] - data[names[1]]


def _side_of_samples(u: np.ndarray, u_max: float) -> np.ndarray:
    """Return +1 or -1 for every sample: the side to which the command goes next; after the last ramp, where it was."""
    away = np.flatnonzero(np.abs(u) > AT_REST * u_max)
    if not away.size:
        return np.ones(u.size)
    coming = np.minimum(np.searchsorted(away, np.arange(u.size)), away.size - 1)
    side: np.ndarray = np.sign(u[away])[coming]
    return side
