"""The command of a recording: which way it sweeps, without spikes and dither, and put right for the meter's lag."""

from dataclasses import replace

import numpy as np

from dzdesign.core.dither import Dither
from dzdesign.identify.reading.ramp_test import RampTest, despiked

#: A change of direction is real when the command has gone back by this share of its range.
TURN = 0.1
#: Points to which a recording is thinned before the search for changes of direction.
TURN_SEARCH_POINTS = 4000
#: A recording's first sweep that moves by less than this share of the range is a hold.
SMALLEST_MOVE = 0.01
#: A command is a spike if it stands out of its neighbours by this share of the range and this many usual steps.
SPIKE, SPIKE_STEPS = 0.02, 10
#: The mean that is free of dither is over so many waves at least, and so many samples.
WAVES, SAMPLES = 2, 9
#: Share of the declared peak by which half of the samples depart from their mean where the dither is recorded.
SEEN = 0.5
#: An undeclared one: departures of this share of full command, nine in ten of them within so many medians.
LEAST, ALIKE = 2e-3, 1.6


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


def without_dither(test: RampTest, dither: Dither | None, u_max: float) -> RampTest:
    """Return a recording whose command has the declared dither averaged out, where its column shows it.

    Of a ramp a mean about each sample is the command itself; corners are rounded over its length. One that shows a wave
    that nobody declared is as it was, with the wave's peak noted.
    """
    if test.u.size < SAMPLES:
        return test
    if dither is None:
        peak = _two_valued(test.u - _running_mean(test.u, SAMPLES), u_max)
        return replace(test, undeclared_dither=peak) if peak else test
    step = float(np.median(np.diff(test.time)))
    waves = round(WAVES / (dither.frequency_Hz * step)) if step > 0 else 0
    length = max(SAMPLES, min(waves, test.u.size)) // 2 * 2 + 1
    mean = _running_mean(test.u, length)
    if np.median(np.abs(test.u - mean)) < SEEN * dither.peak * u_max:
        return test
    return replace(test, u=mean, dither_averaged=length)


def _two_valued(departure: np.ndarray, u_max: float) -> float:
    """Return the peak of a square wave about the command, V; 0 where there is noise, the converter's steps, or nothing.

    Of a square wave all departures are alike. Of normal noise nine in ten stay within 2.4 medians, of the steps of a
    coarse converter within 1.8.
    """
    sizes = np.abs(departure)
    middle, high = (float(value) for value in np.quantile(sizes, (0.5, 0.9)))
    return middle if middle >= LEAST * u_max and high <= ALIKE * middle else 0.0


def _running_mean(values: np.ndarray, length: int) -> np.ndarray:
    """Return means about each value, of an odd number of them, of fewer towards the ends."""
    half, sums = length // 2, np.concatenate([[0.0], np.cumsum(values)])
    place = np.arange(values.size)
    reach = np.minimum(half, np.minimum(place, values.size - 1 - place))
    means: np.ndarray = (sums[place + reach + 1] - sums[place - reach]) / (2 * reach + 1)
    return means
