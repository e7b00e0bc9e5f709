"""Branches of a ramp test: the rising and the falling part, corrected for the meter's lag, gathered in bins."""

from dataclasses import dataclass

import numpy as np

from dzdesign.identify.ramp_files import RampTest

#: Width of a bin over u_max: fine enough that a straight line inside it is exact to the noise.
BIN_WIDTH = 1e-3
#: A change of direction is real when the command has gone back by this share of its range.
TURN = 0.1
#: Points to which a recording is thinned before the search for changes of direction.
TURN_SEARCH_POINTS = 4000


@dataclass(frozen=True, slots=True, kw_only=True)
class Branch:
    """Samples of one direction, on one side of zero: command u in V, dp in Pa or None, flow q in m³/s, all (N,)."""

    rising: bool
    u: np.ndarray
    q: np.ndarray
    dp: np.ndarray | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Bins:
    """Sufficient statistics of samples per bin of u; a straight line's least squares needs no more.

    Attributes
    ----------
    n : (B,) array
        Samples; bins without any are left out.
    u, y : (B,) array
        Means of command (V) and of flow at the nominal pressure drop (m³/s).
    c_uu, c_uy, c_yy : (B,) array
        Sums of squares and products about the means.
    censored : (B,) array
        Samples in the bin that read below the meter's floor; they are not in the other sums.
    u_all : (B,) array
        Mean command of all samples, the censored ones too.
    """

    n: np.ndarray
    u: np.ndarray
    y: np.ndarray
    c_uu: np.ndarray
    c_uy: np.ndarray
    c_yy: np.ndarray
    censored: np.ndarray
    u_all: np.ndarray


def split_branches(test: RampTest, lag: float) -> tuple[Branch | None, Branch | None]:
    """Split a ramp test into its rising and falling branch, for commands from zero up.

    Parameters
    ----------
    test : RampTest
        One recording, of one ramp or several, with or without holds.
    lag : float
        Lag of the flow meter in s: the flow read at t belongs to the command at t - lag.

    Returns
    -------
    tuple
        Rising and falling branch; None where the recording has none.
    """
    u = np.interp(test.time - lag, test.time, test.u) if lag > 0 else test.u
    direction = sweep_direction(u)
    branches = []
    for rising in (True, False):
        mine = (direction == (1 if rising else -1)) & (u >= 0)
        if mine.sum() < 5 or np.ptp(u[mine]) < 0.5 * u.max():
            branches.append(None)
            continue
        dp = None if test.dp is None else test.dp[mine]
        branches.append(Branch(rising=rising, u=u[mine], q=test.q[mine], dp=dp))
    return branches[0], branches[1]


def sweep_direction(u: np.ndarray) -> np.ndarray:
    """Return +1 or -1 for every sample: the direction of the sweep it lies in, deaf to noise and holds.

    A turning point is an extreme after which the command has gone back by `TURN` of its range.
    """
    step = max(1, u.size // TURN_SEARCH_POINTS)
    thinned = u[::step]
    threshold = TURN * np.ptp(u)
    direction = np.zeros(u.size, dtype=int)
    low = high = start = 0
    heading = 0
    for index, value in enumerate(thinned):
        low = index if value < thinned[low] else low
        high = index if value > thinned[high] else high
        if heading >= 0 and thinned[high] - value > threshold:
            direction[start * step : high * step] = 1
            heading, start, low = -1, high, index
        elif heading <= 0 and value - thinned[low] > threshold:
            direction[start * step : low * step] = -1
            heading, start, high = 1, low, index
    direction[start * step :] = heading
    return direction


def bin_branch(u: np.ndarray, y: np.ndarray, censored: np.ndarray, u_max: float) -> Bins:
    """Gather samples in bins of `BIN_WIDTH` u_max.

    Parameters
    ----------
    u, y : (N,) array
        Command (V) and flow at the nominal pressure drop (m³/s).
    censored : (N,) bool array
        True where the meter read below its floor.
    u_max : float
        Full command, V.
    """
    index = np.floor(u / (BIN_WIDTH * u_max)).astype(int)
    used, index = np.unique(index, return_inverse=True)
    size = used.size

    def total(weight: np.ndarray, where: np.ndarray) -> np.ndarray:
        return np.bincount(index[where], weights=weight[where], minlength=size)

    seen = ~censored
    everything = np.ones_like(seen)
    n = total(np.ones_like(u), seen)
    n_all = total(np.ones_like(u), everything)
    safe = np.maximum(n, 1)
    u_mean, y_mean = total(u, seen) / safe, total(y, seen) / safe
    du, dy = u - u_mean[index], y - y_mean[index]
    return Bins(
        n=n,
        u=u_mean,
        y=y_mean,
        c_uu=total(du * du, seen),
        c_uy=total(du * dy, seen),
        c_yy=total(dy * dy, seen),
        censored=n_all - n,
        u_all=total(u, everything) / n_all,
    )
