"""Parts of a simulated bench that the benchmarks share: the command, a spool with play or that sticks, a slow meter.

NumPy and SciPy only: no code of the product, whose answers are judged by what these parts do.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

#: Seconds, from V, to V.
Segment = tuple[float, float, float]


def hold(seconds: float, level: float = 0.0) -> Segment:
    return seconds, level, level


def ramp(
    up_s: float = 40.0, top: float = 10.0, *, before: float = 3.0, at_top: float = 1.0, after: float = 3.0
) -> tuple[Segment, ...]:
    """Hold, up, hold, down, hold."""
    return hold(before), (up_s, 0.0, top), hold(at_top, top), (up_s, top, 0.0), hold(after)


def staircase(step: float, dwell: float, top: float = 10.0) -> tuple[Segment, ...]:
    """Levels held from zero to the top and back."""
    up = np.arange(0, top + step / 2, step)
    return tuple(hold(dwell, float(level)) for level in (*up, *up[::-1]))


def duration(command: Sequence[Segment]) -> float:
    return sum(segment[0] for segment in command)


def commanded(command: Sequence[Segment], rate_Hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the times (s) of the samples and the command (V) at them."""
    ends = np.cumsum([0.0, *(segment[0] for segment in command)])
    time = np.arange(0.0, ends[-1], 1 / rate_Hz)
    corners = np.ravel([(a, b) for a, b in zip(ends, np.nextafter(ends[1:], 0), strict=False)])
    return time, np.interp(time, corners, np.ravel([segment[1:] for segment in command]))


def with_play(u: np.ndarray, play: float, begins: float | None = None) -> np.ndarray:
    """Return where a spool stands that a command drags along with play; it begins at the command, or where it is said.

    Parameters
    ----------
    u : (N,) ndarray
        Command, V.
    play : float
        Width of the play, V.
    begins : float, optional
        Where the spool stands at first, V.
    """
    spool, half = [], play / 2
    at = float(u[0]) if begins is None else begins
    for value in u.tolist():
        at = min(max(at, value - half), value + half)
        spool.append(at)
    return np.array(spool)


def that_sticks(u: np.ndarray, breakaway: float, rng: np.random.Generator) -> np.ndarray:
    """Return where a spool stands that waits until the command is a breakaway (within 20 %) ahead, and jumps to it."""
    spool, at, next_one = [], float(u[0]), breakaway
    for value in u.tolist():
        if abs(value - at) > next_one:
            at, next_one = value, breakaway * (1 + 0.2 * rng.uniform(-1, 1))
        spool.append(at)
    return np.array(spool)


def lagged(values: np.ndarray, samples: float) -> np.ndarray:
    """Return what comes through a first-order lag of so many samples, at rest in the first value."""
    pole = np.exp(-1 / samples)
    late: np.ndarray = lfilter([1 - pole], [1, -pole], values - values[0]) + values[0]
    return late
