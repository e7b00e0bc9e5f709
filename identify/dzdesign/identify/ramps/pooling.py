"""Ramps at one pressure drop are one test, with more data: from one recording or from several, in any order."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from dzdesign.identify.ramps.branches import Branch
from dzdesign.identify.ramps.splitting import Ramp
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.left_out import LeftOut

#: Ramps whose pressure drops differ by less than this share are one test.
SAME_PRESSURE = 0.02
#: Files that the name of a test lists.
NAMED_FILES = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class PooledTest:
    """All ramps at one pressure drop."""

    #: Their samples, one ramp after the other; `source` names the files, and the ramps of a file with several tests.
    test: RampTest
    #: Rising and falling, of all ramps; None where no ramp has any.
    branches: tuple[Branch | None, Branch | None]
    #: Each ramp's file, and its number and times in it.
    ramps: tuple[str, ...]
    #: When each ramp was recorded, s on a clock common to all; NaN if that is not known.
    when: tuple[float, ...]
    #: Source and SHA-256 of every file in it.
    files: tuple[tuple[str, str], ...]
    #: What was left out of and before them.
    left_out: tuple[LeftOut, ...]


def pool_ramps(ramps: Sequence[Ramp]) -> list[PooledTest]:
    """Gather the ramps of all recordings by pressure drop, in its rising order; where it is unknown, to one test."""
    return [_pooled(group) for group in group_by_pressure(ramps)]


def group_by_pressure(ramps: Sequence[Ramp]) -> list[list[Ramp]]:
    """Return ramps in groups of one pressure drop each, in the order of rising pressure drop."""
    groups: list[list[Ramp]] = []
    for ramp in sorted(ramps, key=lambda ramp: (ramp.dp or 0.0, ramp.test.source, ramp.number, ramp.test.sha256)):
        known = [other.dp or 0.0 for other in groups[-1]] if groups else []
        if groups and (ramp.dp or 0.0) - np.mean(known) <= SAME_PRESSURE * (ramp.dp or 0.0):
            groups[-1].append(ramp)
        else:
            groups.append([ramp])
    return [sorted(group, key=lambda ramp: (ramp.test.source, ramp.test.sha256, ramp.number)) for group in groups]


def _pooled(group: list[Ramp]) -> PooledTest:
    first = group[0].test
    positive, negative = (
        tuple(dict.fromkeys(chain.from_iterable(each))) for each in zip(*(r.test.dp_from for r in group), strict=True)
    )
    dp = None if first.dp is None else np.concatenate([ramp.test.dp for ramp in group])
    time, u, q = (np.concatenate([getattr(ramp.test, name) for ramp in group]) for name in ("time", "u", "q"))
    test = RampTest(
        source=_name(group),
        sha256=first.sha256,
        time=time,
        u=u,
        q=q,
        dp=dp,
        dp_from=(positive, negative),
        dp_sign=first.dp_sign,
        dp_is_declared=any(ramp.test.dp_is_declared for ramp in group),
        unseen=(min(ramp.test.unseen[0] for ramp in group), max(ramp.test.unseen[1] for ramp in group)),
        columns=first.columns,
    )
    return PooledTest(
        test=test,
        branches=(_joined(group, rising=True), _joined(group, rising=False)),
        ramps=tuple(name_of_ramp(ramp) for ramp in group),
        when=tuple(ramp.when for ramp in group),
        files=tuple(dict.fromkeys((ramp.test.source, ramp.test.sha256) for ramp in group)),
        left_out=tuple(item for ramp in group for item in ramp.left_out),
    )


def _joined(group: list[Ramp], rising: bool) -> Branch | None:
    """Return the branches of one direction as one; None unless they span half of the command together."""
    parts = [branch for ramp in group for branch in ramp.branches if branch.rising == rising]
    if not parts:
        return None
    u, q = (np.concatenate([getattr(part, name) for part in parts]) for name in ("u", "q"))
    if np.ptp(u) < 0.5 * max(branch.u.max() for ramp in group for branch in ramp.branches):
        return None
    dp = None if parts[0].dp is None else np.concatenate([part.dp for part in parts])
    rates = np.array([part.rate for part in parts])
    rate = float(np.nanmax(rates)) if np.isfinite(rates).any() else math.nan
    sizes = [sum(branch.u.size for branch in ramp.branches if branch.rising == rising) for ramp in group]
    return Branch(rising=rising, u=u, q=q, dp=dp, rate=rate, counts=tuple(sizes))


def name_of_ramp(ramp: Ramp) -> str:
    """Return a ramp's file, and which one it is in it, when, if the file has several.

    The times are those of its first and last sample, s on the recording's own clock.
    """
    if ramp.of == 1:
        return ramp.test.source
    return f"{ramp.test.source} (ramp {ramp.number}, {ramp.test.time[0]:.1f} to {ramp.test.time[-1]:.1f} s)"


def _name(group: list[Ramp]) -> str:
    """Return the files of a group of ramps, and which ramps of a file if not all are in it."""
    names = []
    for file in dict.fromkeys((ramp.test.source, ramp.test.sha256) for ramp in group):
        of_file = [ramp for ramp in group if (ramp.test.source, ramp.test.sha256) == file]
        if len(of_file) == of_file[0].of:
            names.append(file[0])
        elif len(of_file) == 1:
            names.append(name_of_ramp(of_file[0]))
        else:
            names.append(f"{file[0]} (ramps {', '.join(str(ramp.number) for ramp in of_file)})")
    more = len(names) - NAMED_FILES
    return ", ".join(names[:NAMED_FILES]) + (f" and {more} more" if more > 0 else "")
