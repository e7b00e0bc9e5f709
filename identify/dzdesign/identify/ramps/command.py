"""The command of a recording: which way it sweeps, without spikes, and put right for the meter's lag."""

import numpy as np

from dzdesign.identify.reading.ramp_test import RampTest, despiked

#: A change of direction is real when the command has gone back by this share of its range.
TURN = 0.1
#: Points to which a recording is thinned before the search for changes of direction.
TURN_SEARCH_POINTS = 4000
#: A recording's first sweep that moves by less than this share of the range is a hold.
SMALLEST_MOVE = 0.01
#: A command is a spike if it stands out of its neighbours by this share of the range and this many usual steps.
SPIKE, SPIKE_STEPS = 0.02, 10


def without_command_spikes(test: RampTest) -> RampTest:
    """Leave out samples whose command stands alone: their flow belongs to another command."""
    smooth = test.smooth
    usual = float(np.median(np.abs(np.diff(test.u))))
    kept = np.abs(test.u - smooth) <= max(SPIKE * np.ptp(smooth), SPIKE_STEPS * usual)
    return test if kept.all() else test.part(kept)


def lagged_command(time: np.ndarray, u: np.ndarray, lag: float) -> np.ndarray:
    """Return the command to which each reading of a meter with a lag (s) belongs; a late command has one below zero.

    The clock (s) may stand still, as of a logger that stamps in whole seconds.
    """
    if lag == 0:
        return u
    clock = _spread(time)
    return np.asarray(np.interp(clock - lag, clock, u))


def _spread(time: np.ndarray) -> np.ndarray:
    """Return the clock with stamps that repeat spread evenly over the time to the next stamp, lost rows apart."""
    stamps, first, count = np.unique(time, return_index=True, return_counts=True)
    if count.max() == 1 or stamps.size < 2:
        return time
    gaps = np.diff(stamps, append=np.nan)
    usual = float(np.nanmedian(gaps))
    gaps = np.minimum(np.where(np.isnan(gaps), usual, gaps), usual)
    rank = np.arange(time.size) - np.repeat(first, count)
    return time + rank * np.repeat(gaps / count, count)


def sweep_direction(u: np.ndarray) -> np.ndarray:
    """Return +1 or -1 for every sample: the direction of the sweep it lies in, deaf to noise and holds.

    A turning point is an extreme after which the command has gone back by `TURN` of its range.
    """
    step = max(1, u.size // TURN_SEARCH_POINTS)
    blocks = despiked(u)[: u.size // step * step].reshape(-1, step)
    thinned = despiked(np.median(blocks, axis=1))
    threshold = TURN * np.ptp(thinned)
    direction = np.zeros(u.size, dtype=int)
    turns = {way: _next_turn(thinned, way, threshold) for way in (1, -1)}
    heading = min(turns, key=lambda way: turns[way][1])
    turn, seen = turns[heading]
    if seen < thinned.size:
        direction[: turn * step] = -heading if _holds(thinned[: turn + 1], threshold) else heading
    while seen < thinned.size:
        start, heading = turn, -heading
        direction[start * step :] = heading
        turn, seen = (start + index for index in _next_turn(thinned[start:], heading, threshold))
    return direction


def _next_turn(u: np.ndarray, way: int, threshold: float) -> tuple[int, int]:
    """Return the extreme on a way (1: up, -1: down), and where the command has gone back from it by the threshold.

    The second lies beyond the end where it never does.
    """
    furthest = np.maximum.accumulate(way * u)
    back = furthest - way * u > threshold
    seen = int(np.argmax(back)) if back.any() else u.size
    return int(np.argmax(furthest == furthest[min(seen, u.size - 1)])), seen


def _holds(u: np.ndarray, turn: float) -> bool:
    """Tell whether a command before its first turn holds, noise aside: the hold is part of the sweep that follows."""
    quarter = max(u.size // 4, 1)
    moved = abs(float(np.median(u[:quarter])) - float(np.median(u[-quarter:])))
    return moved <= turn / TURN * SMALLEST_MOVE
