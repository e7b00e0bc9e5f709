"""Ramps that are cut where the engineer reads a part of a recording: what of them still shows a threshold.

The rule. A branch counts if it was cut in its rest only, or if what is left of it comes to the top and, below the edge,
half of the way down. What is left of any other branch is left out: a knee would be laid through a fragment.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import FULL_SWEEP
from dzdesign.identify.ramps.command import sweep_direction
from dzdesign.identify.ramps.sides import AT_REST, tests_of_side
from dzdesign.identify.ramps.splitting import Ramp, split_ramps
from dzdesign.identify.ramps.sweep_pressure import FIRST_FLOW, stretches
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import SIDES


@dataclass(frozen=True, slots=True, kw_only=True)
class PartOfRamp:
    """A ramp of a whole recording, and what a part of the recording holds of it."""

    #: Such as ``ramp 2, 12.3 to 62.1 s``, from where the command leaves its rest to where it is back.
    name: str
    #: Directions that the part shows, and those that are lost.
    kept: tuple[str, ...]
    lost: tuple[str, ...]
    #: Whether the part has some of it and not all.
    is_cut: bool
    #: Which rows of the recording belong to a fragment that is left out (N,).
    fragment: np.ndarray


def parts_of_ramps(test: RampTest, inside: np.ndarray, u_max: float) -> list[PartOfRamp]:
    """Return all ramps of a recording, and which of their branches are left in its rows `inside` (N,).

    None where the recording as a whole can't be parted in ramps: then that may be what is left out.
    """
    sides = {name: tests_of_side([test], sign, u_max) for name, sign in SIDES.items()}
    both = all(sides.values())
    try:
        return [
            _part(ramp, f" ({name} side)" if both else "", test.time, inside)
            for name, of_side in sides.items()
            for side in of_side
            for ramp in split_ramps(side, lag=0.0)
            if ramp.branches
        ]
    except InputError:
        return []


def _part(ramp: Ramp, side: str, time: np.ndarray, inside: np.ndarray) -> PartOfRamp:
    found = ramp.test
    left = np.isin(found.time, time[inside])
    kept: list[str] = []
    lost: list[str] = []
    fragment = np.zeros(time.size, dtype=bool)
    for name, rows, shows in _branches(ramp, left):
        (kept if shows else lost).append(name)
        for stretch in stretches(found, np.flatnonzero(rows & left), "option") if not shows else ():
            of_it = (found.time >= stretch.from_s) & (found.time <= stretch.to_s)
            if found.u[of_it].max() > AT_REST * float(found.u.max()):  # at rest the other side's ramps are near
                fragment |= inside & (time >= stretch.from_s) & (time <= stretch.to_s)
    moves = found.u > AT_REST * found.u.max()
    is_cut = bool(left[moves].any() and not left[moves].all())
    name = f"ramp {ramp.number}{side}, {found.time[moves][0]:.1f} to {found.time[moves][-1]:.1f} s"
    return PartOfRamp(name=name, kept=tuple(kept), lost=tuple(lost), is_cut=is_cut, fragment=fragment)


def _branches(ramp: Ramp, left: np.ndarray) -> Iterator[tuple[str, np.ndarray, bool]]:
    """Yield name, rows and whether the rows that are left show a threshold, of each branch of a ramp."""
    u, direction = ramp.test.smooth, sweep_direction(ramp.test.u)
    full = float(np.quantile(ramp.test.q, 0.99))
    first = (ramp.test.q > FIRST_FLOW[0] * full) & (ramp.test.q < FIRST_FLOW[1] * full)
    for branch in ramp.branches:
        rows = direction == (1 if branch.rising else -1)
        if not rows.any():
            continue
        top, bottom = float(u[rows].max()), float(u[rows].min())
        edge = float(np.median(u[rows & first])) if (rows & first).any() else top / 2
        of_it = u[rows & left]
        shows = of_it.size > 0 and of_it.max() >= FULL_SWEEP * top and of_it.min() <= (bottom + edge) / 2
        yield ("rising" if branch.rising else "falling"), rows, bool(shows)
