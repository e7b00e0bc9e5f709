"""A branch of a ramp test: the samples of one direction of the command, gathered in bins."""

import math
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import BIN_WIDTH


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """Samples of one direction, on one side of zero: command u in V, dp in Pa or None, flow q in m³/s, all (N,).

    `rate` is the pace of the command, V/s, always positive; of several ramps the fastest; NaN if it is not known.
    `counts` are the samples of each ramp, one ramp after the other; none where the branch is of one ramp.
    """

    rising: bool
    u: np.ndarray
    q: np.ndarray
    dp: np.ndarray | None
    rate: float = math.nan
    counts: tuple[int, ...] = ()

    @property
    def ramp_of_samples(self) -> np.ndarray:
        """Number of each sample's ramp, from 0 (N,)."""
        return np.repeat(np.arange(max(len(self.counts), 1)), self.counts or (self.u.size,))

    @property
    def ramps(self) -> list[slice]:
        """Which samples are each ramp's; a ramp without this branch has none."""
        ends = np.cumsum(self.counts or (self.u.size,)).tolist()
        return [slice(start, end) for start, end in zip([0, *ends], ends, strict=False)]


def at_nominal_pressure(branch: Branch, dp: float | None) -> np.ndarray:
    """Return a branch's flow brought to one pressure drop (Pa), m³/s; as it is where the pressure is not known."""
    # Eq. (1): Q grows as sqrt(dP); below a tenth of the nominal pressure the ratio would only carry noise.
    if dp is None or branch.dp is None:
        return branch.q
    flow: np.ndarray = branch.q * np.sqrt(dp / np.maximum(branch.dp, 0.1 * dp))
    return flow


@dataclass(frozen=True, slots=True, kw_only=True)
class Bins:
    """Sufficient statistics of samples per bin of u, each (B,): all that the best straight line depends on."""

    #: Samples; bins without any are left out.
    n: np.ndarray
    #: Means of command (V) and of flow at the nominal pressure drop (m³/s).
    u: np.ndarray
    y: np.ndarray
    #: Sums of squares and products about the means; those of y alone are the same for every line.
    c_uu: np.ndarray
    c_uy: np.ndarray
    #: Samples in the bin that read below the meter's floor; they are not in the other sums. Their mean command, 0 where
    #: there are none.
    censored: np.ndarray
    u_censored: np.ndarray


def bin_index(u: np.ndarray, u_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of each sample's bin of `BIN_WIDTH` u_max, empty ones not counted, and the samples of each."""
    index = np.floor(u / (BIN_WIDTH * u_max)).astype(int)
    index -= index.min()
    count = np.bincount(index)
    filled = count > 0
    return (index, count) if filled.all() else ((np.cumsum(filled) - 1)[index], count[filled])


def bin_branch(u: np.ndarray, y: np.ndarray, censored: np.ndarray, u_max: float) -> Bins:
    """Gather samples, which are `censored` where the meter read below its floor, in bins of `BIN_WIDTH` u_max."""
    index, count = bin_index(u, u_max)

    def total(weight: np.ndarray, where: np.ndarray) -> np.ndarray:
        return np.bincount(index[where], weights=weight[where], minlength=count.size)

    seen = ~censored
    n, cut = total(np.ones_like(u), seen), total(np.ones_like(u), censored)
    safe = np.maximum(n, 1)
    u_mean, y_mean = total(u, seen) / safe, total(y, seen) / safe
    du, dy = u - u_mean[index], y - y_mean[index]
    return Bins(
        n=n,
        u=u_mean,
        y=y_mean,
        c_uu=total(du * du, seen),
        c_uy=total(du * dy, seen),
        censored=cut,
        u_censored=total(u, censored) / np.maximum(cut, 1),
    )
