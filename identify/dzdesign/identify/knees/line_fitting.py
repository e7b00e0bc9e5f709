"""A straight line through the samples of a branch between two flows, which outliers and drop-outs do not move."""


import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import Shown
from dzdesign.identify.knees.gated_line import GATE, GatedLine, PreparedBranch, straight_line
from dzdesign.identify.knees.noise import measure_roughness
from dzdesign.identify.knees.profile import crossing
from dzdesign.identify.ramps.branches import median

#: Most rounds in which outliers are left out and the line is laid again: each finds those that the ones before hid.
ROUNDS = 20
#: Fewest samples for a line: the levels of a coarse table would tell its zero to one of them.
FEWEST = 5
#: Noise below this share of the largest flow is not believed: no meter is that fine.
FINEST_NOISE = 1e-5
#: Blocks into which the residuals in time order are cut, to see how coloured the noise is.
BLOCKS = 16
#: Of a standard error from these blocks, less the line's two parameters.
DEGREES_OF_FREEDOM = BLOCKS - 2


def fit_knee(read: PreparedBranch, window: tuple[float, float]) -> GatedLine:
    """Lay a line through the samples between two shares of the largest flow.

    Raises
    ------
    InputError
        Where there are too few samples for a line.
    """
    branch, y, floor = read.branch, read.y, read.floor
    u_low, u_high = (crossing(*read.profile, share * read.y_max) for share in window)
    inside = (branch.u >= u_low) & (branch.u <= u_high)
    if inside.sum() < FEWEST or not u_high > u_low:
        raise InputError(
            f"'{read.source}': only {inside.sum()} samples lie between {window[0]:.0%} and {window[1]:.0%} of the "
            "largest flow, expected at least 5; record a slower ramp or more levels"
        )
    u, y, censored = branch.u[inside], y[inside], branch.q[inside] < 0.5 * floor
    seen = ~censored
    _refuse_no_line(u[seen], window, floor, read.source)
    slope, knee = straight_line(u[seen], y[seen])
    finest = FINEST_NOISE * read.y_max
    kept = np.ones(u.size, dtype=bool)
    for _ in range(ROUNDS):
        line, before = slope * (u - knee), kept
        miss = np.abs(y - line)
        sigma = max(1.4826 * median(miss[~censored]), finest)
        # A zero reading is a censored sample only where flow below the floor is credible.
        kept = np.where(censored, line < floor + GATE * sigma, miss < GATE * sigma)
        if np.array_equal(kept, before):  # the same samples, so the same line
            break
        seen = kept & ~censored
        _refuse_no_line(u[seen], window, floor, read.source)
        slope, knee = straight_line(u[seen], y[seen])
    u_seen = u[seen]
    residual = _within_ramps(y[seen] - slope * (u_seen - knee), branch.ramp_of_samples[inside][seen])
    sigma = max(float(np.sqrt(np.sum(residual**2) / max(u_seen.size - 2, 1))), finest)
    by_blocks = inflation_by_blocks(residual, sigma)
    return GatedLine(
        window=window,
        slope=slope,
        knee=knee,
        lever=1 / u_seen.size + (u_seen.mean() - knee) ** 2 / np.sum((u_seen - u_seen.mean()) ** 2),
        sigma=sigma,
        block_inflation=by_blocks,
        variance_inflation=by_blocks,
        inside=inside,
        kept=_among(inside, kept),
        censored=_among(inside, censored),
        roughness=measure_roughness(u_seen, residual),
        outliers=int((~kept).sum()),
    )


def _within_ramps(residual: np.ndarray, ramp: np.ndarray) -> np.ndarray:
    """Return residuals about the mean of their ramp: what ramps differ by is scatter of the valve, and no noise."""
    if not ramp.size or ramp[0] == ramp[-1]:
        return residual
    count = np.maximum(np.bincount(ramp), 1)
    within: np.ndarray = residual - (np.bincount(ramp, weights=residual) / count)[ramp]
    return within


def _among(inside: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return which samples of all are chosen, from which of those inside the window are."""
    among = np.zeros(inside.size, dtype=bool)
    among[inside] = chosen
    return among


def inflation_by_blocks(residual: np.ndarray, sigma: float) -> float:
    """Return the long-run variance factor from the means of `BLOCKS` blocks in time order."""
    count = min(BLOCKS, residual.size // 2)
    if count < 4:
        return 1.0
    base, longer = divmod(residual.size, count)
    starts = np.arange(count) * base + np.minimum(np.arange(count), longer)
    sizes = np.diff(starts, append=residual.size)
    spread = float(np.sum(np.add.reduceat(residual, starts) ** 2 / sizes)) / (count - 2)
    return max(1.0, spread / sigma**2)


def _refuse_no_line(u: np.ndarray, window: tuple[float, float], floor: float, source: str) -> None:
    """Refuse samples that hold no straight line: too few above the meter's floor, or all at one command."""
    if u.size < FEWEST or np.ptp(u) == 0:
        raise InputError(
            f"'{source}': {u.size} samples at {np.unique(u).size} levels of the command lie between {window[0]:.0%} "
            f"and {window[1]:.0%} of the largest flow and above half the meter's floor of "
            f"{Shown(floor * 6e4):.3g L/min}, expected at least 5 at 2 levels; record a slower ramp or more levels, "
            "or correct --meter-floor"
        )
