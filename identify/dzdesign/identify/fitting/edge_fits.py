"""An edge of two straight parts, fitted to the readings of one test: what a slow meter with a floor shows of it."""

import math

import numpy as np

from dzdesign.identify.fitting.edge_averages import EdgeAverages

#: Rounds in which base, slope and knee are fitted, and share of u_max by which the knee moves at most in one.
ROUNDS, LARGEST_STEP = 3, 0.03
#: The slope may be that of the straight part divided or multiplied by this.
OTHER_SLOPE = 2.0
#: Added to the scaled normal equations, so that columns that are alike can be told apart.
RIDGE = 1e-12


def fit_edges(
    test: EdgeAverages, share: np.ndarray, width: np.ndarray, *, seconds: float, u_max: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sum of squares, knee (V) and slope (m³/(s V)) of the fits of H edges to one test, each (H,).

    An edge opens with a `share` (H,) of its flow gain over a `width` (H,), V, and then with all of it; the knee is
    where its last part comes to zero. The meter has a lag of so many seconds.
    """
    knee, slope = np.full(share.size, test.knee), np.full(share.size, test.slope)
    shift = seconds * test.rate
    # The knee is that of readings put right for this lag, as the other knees are for theirs: how the two differ is in
    # the bounds already.
    u = test.u + (shift if test.rising else -shift)
    first, second = (1 - share) * width, share * width
    base = np.zeros(share.size)
    root = np.sqrt(test.weight)
    for _ in range(ROUNDS):
        x = u - knee[:, None]
        before, gain_before = _reading(x + first[:, None], shift, rising=test.rising)
        beyond, gain_beyond = _reading(x - second[:, None], shift, rising=test.rising)
        flow = share[:, None] * before + (1 - share)[:, None] * beyond
        gain = share[:, None] * gain_before + (1 - share)[:, None] * gain_beyond
        shown, part = _above_floor(test, slope[:, None] * flow)
        columns = [part * flow * root, -part * slope[:, None] * gain * root]
        if test.floor == 0:
            columns.append(np.broadcast_to(root, x.shape))
        missed = (test.y - shown - base[:, None]) * root
        design = np.stack(columns, axis=1)  # (H, P, B)
        right = (design @ missed[:, :, None])[:, :, 0]
        normal = design @ design.transpose(0, 2, 1)
        scale = np.sqrt(np.maximum(np.einsum("hpp->hp", normal), np.finfo(float).tiny))
        normal = normal / scale[:, :, None] / scale[:, None, :] + RIDGE * np.eye(len(columns))
        step = np.linalg.solve(normal, (right / scale)[:, :, None])[:, :, 0] / scale
        squares = np.einsum("hb,hb->h", missed, missed) - np.einsum("hp,hp->h", step, right)
        slope = np.clip(slope + step[:, 0], test.slope / OTHER_SLOPE, OTHER_SLOPE * test.slope)
        knee = knee + np.clip(step[:, 1], -LARGEST_STEP * u_max, LARGEST_STEP * u_max)
        base = base + step[:, 2] if test.floor == 0 else base
    return np.maximum(squares, 0.0), knee, slope


def _above_floor(test: EdgeAverages, flow: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
    """Return what a meter shows of a flow on average that reads zero below its floor, and its derivative."""
    if test.floor == 0:
        return flow, 1.0
    from scipy.special import ndtr

    above, below = (flow - test.floor) / test.noise, (-flow - test.floor) / test.noise
    seen, edge = ndtr(above), np.exp(-(above**2) / 2)
    other, other_edge = (ndtr(below), np.exp(-(below**2) / 2)) if test.signed else (0.0, 0.0)
    density = 1 / math.sqrt(2 * math.pi)
    shown = flow * (seen + other) + test.noise * density * (edge - other_edge)
    return shown, seen + other + test.floor / test.noise * density * (edge + other_edge)


def _reading(x: np.ndarray, shift: float, *, rising: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return what a first-order meter shows of a flow of unit slope from x = 0 on, and its derivative.

    `shift` is the rate times the lag, V.
    """
    ahead = np.maximum(x, 0.0)
    if shift <= 0:
        return ahead, (x > 0).astype(float)
    if rising:
        gain = 1 - np.exp(-ahead / shift)
        return ahead - shift * gain, gain
    gain = np.exp(np.minimum(x, 0.0) / shift)
    return ahead + shift * gain, gain
