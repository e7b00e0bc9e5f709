"""Stick and slip: how far the spool stands off its mean course, as the flow of a slow ramp shows it.

Without dither a spool waits until the command is a breakaway ahead of it, and then jumps. On a ramp it moves in steps,
to both sides of its mean course alike, and so it stops: a line through the ramp tells the mean, and half of all stops
lie below it. The steps are a ripple of the flow, slower than the meter's noise, which the dead zone shows by itself:
there the spool moves as well, and no flow follows.

A meter that reads zero below a floor shows no noise there. Then what neighbouring readings on the line differ by tells
its quick noise, and nothing of slow noise, or of a pump's pulsation. But these rise and fall alike, and a spool that
sticks does not: many small steps one way, while it waits, and a few large ones the other way.

A supply that swings moves the flow as well. A meter that lags shows that late and smaller, so the flow brought to the
nominal pressure drop by each sample swings, too. What of it the pressure drop tells is no step of the spool, if it
swings as much while the valve is shut; where it does not, the flow has moved the pressure.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.knees.gated_line import GatedLine, PreparedBranch

#: Flows are averaged over this share of u_max, and compared with their mean over so many of these averages: wider than
#: the steps of a spool, narrower than a bend of the characteristic.
AVERAGED, LOCAL = 2e-3, 31
#: Fewest samples of a ramp, and of averages, that tell a ripple.
FEWEST_SAMPLES, FEWEST_AVERAGES = 200, 40
#: Shares of u_max that the dead zone's part stays away from rest and from the knee.
FROM_REST, FROM_KNEE = 0.05, 0.03
#: A ripple is real where its variance is so many times the noise's, and its height above this share of u_max.
RIPPLE_RATIO, SMALLEST_RIPPLE = 4.0, 1e-3

#: A meter whose readings in the dead zone are one number to this share shows no noise there. One of whose neighbouring
#: readings on the line as many are equal moves in steps of its own.
ONE_NUMBER = 0.5
#: Spread of the pressure drop over its running mean from which it swings, and the share of it that the shut valve must
#: show as well.
SWINGS, WHILE_SHUT = 0.01, 0.5
#: Samples by which a flow may follow a swing; sums of these span the delay of a meter's filter.
DELAYS = (0, 1, 3, 8, 20, 50)
#: Standard errors by which the steps of all ramps have to be skewed.
SKEWED = 4.0


@dataclass(frozen=True, slots=True)
class Course:
    """Residuals of a stretch of one ramp, averaged over equal steps of the command."""

    #: Variances, (m³/s)², of averages about their local mean, of samples from their neighbours, and of averages if
    #: samples were independent.
    slow: float
    quick: float
    white: float
    #: Skewness of the steps from average to average, and how many.
    skewness: float
    steps: int


@dataclass(frozen=True, slots=True)
class _Ramp:
    """One ramp of a branch: its course on the line, and in the dead zone if the meter shows noise there."""

    on_line: Course
    at_rest: Course | None


def spool_ripples(reads: Sequence[PreparedBranch], lines: Sequence[GatedLine], u_max: float) -> list[float]:
    """Return for each branch the standard deviation of the spool about its mean course, as a command, V.

    It is 0 where the noise explains the ripple, and where nothing tells: ramps too short for it, and a meter that shows
    no noise in the dead zone and is read in steps above it.
    """
    branches = [_ramps(read, line, u_max) for read, line in zip(reads, lines, strict=True)]
    courses = [ramp.on_line for ramps in branches for ramp in ramps]
    in_steps = sum(course.skewness for course in courses) > SKEWED * math.sqrt(
        sum(6 / course.steps for course in courses)
    )
    return [_ripple(ramps, line.slope, u_max, in_steps) for ramps, line in zip(branches, lines, strict=True)]


def _ripple(ramps: list[_Ramp], slope: float, u_max: float, in_steps: bool) -> float:
    ripples = []
    for ramp in ramps:
        line, rest = ramp.on_line, ramp.at_rest
        # Noise that grows with the flow does so at all speeds alike.
        noise = rest.slow * line.quick / rest.quick if rest else line.white
        real = line.slow > RIPPLE_RATIO * noise and (rest is not None or in_steps)
        ripples.append(line.slow - noise if real else 0.0)
    ripple = math.sqrt(float(np.mean(ripples))) / slope if ripples else 0.0
    return ripple if ripple > SMALLEST_RIPPLE * u_max else 0.0


def _ramps(read: PreparedBranch, line: GatedLine, u_max: float) -> list[_Ramp]:
    """Return those ramps of a branch that can tell a ripple."""
    u, q, seen = read.branch.u, read.branch.q, line.kept & ~line.censored
    still = (u > FROM_REST * u_max) & (u < line.knee - FROM_KNEE * u_max)
    residual = read.y - line.slope * (u - line.knee)
    ramps = []
    for part in read.branch.ramps:
        residual[part] -= _swings(read, line, part, residual[part], seen[part], still[part], u_max)
        on_line = _course(u[part][seen[part]], residual[part][seen[part]], u_max)
        at_rest = _course(u[part][still[part]], read.y[part][still[part]], u_max)
        if on_line is None or at_rest is None:
            continue
        _, counts = np.unique(q[part][still[part]], return_counts=True)
        if counts.max() <= ONE_NUMBER * counts.sum() and at_rest.quick > 0:
            ramps.append(_Ramp(on_line, at_rest))
        elif np.mean(np.diff(q[part][seen[part]]) == 0) < ONE_NUMBER and on_line.quick > 0:
            ramps.append(_Ramp(on_line, None))
    return ramps


def _swings(
    read: PreparedBranch,
    line: GatedLine,
    part: slice,
    residual: np.ndarray,
    seen: np.ndarray,
    still: np.ndarray,
    u_max: float,
) -> np.ndarray:
    """Return what of the residuals of one ramp (N,) follows the swings of the supply, m³/s."""
    none = np.zeros(residual.size)
    if read.branch.dp is None or min(seen.sum(), still.sum()) < FEWEST_SAMPLES:
        return none
    dp, u = read.branch.dp[part], read.branch.u[part]
    width = max(int(AVERAGED * LOCAL * u_max / max(np.ptp(u), AVERAGED * u_max) * u.size), 1)
    padded = np.pad(dp, (width // 2, width - 1 - width // 2), mode="edge")
    swing = dp / np.convolve(padded, np.full(width, 1 / width), "valid") - 1
    if np.std(swing[seen]) < SWINGS or np.std(swing[still]) < WHILE_SHUT * np.std(swing[seen]):
        return none
    # Eq. (1): a share of the flow itself.
    flow = line.slope * np.maximum(u - line.knee, 0.0)
    late = np.array([flow * np.concatenate([np.full(k, swing[0]), swing[: swing.size - k]]) for k in DELAYS])
    inside = late[:, seen]
    found: np.ndarray = np.linalg.lstsq(inside @ inside.T, inside @ residual[seen], rcond=None)[0] @ late
    return found


def _course(u: np.ndarray, y: np.ndarray, u_max: float) -> Course | None:
    """Return what averages and samples scatter by; None of too few."""
    if u.size < FEWEST_SAMPLES:
        return None
    index = np.floor((u - u.min()) / (AVERAGED * u_max)).astype(int)
    count = np.bincount(index)
    averages = np.bincount(index, weights=y)[count > 0] / count[count > 0]
    if averages.size < FEWEST_AVERAGES:
        return None
    local = np.convolve(averages, np.full(LOCAL, 1 / LOCAL), "valid")
    middle = averages[LOCAL // 2 : LOCAL // 2 + local.size]
    quick, steps = float(np.mean(np.diff(y) ** 2)) / 2, np.diff(averages) - np.mean(np.diff(averages))
    spread = float(np.mean(steps**2))
    return Course(
        slow=float(np.mean((middle - local) ** 2)),
        quick=quick,
        white=quick * float(np.mean(1 / count[count > 0])),
        skewness=float(np.mean(steps**3)) / spread**1.5 if spread > 0 else 0.0,
        steps=steps.size,
    )
