"""What the current makes of the set point's dither: a loop overshoots a wave's steps, or does not reach its top.

The certificate keeps the dither's peak free under the threshold. Of a controlled current that is the current's own, the
largest mean of a period of the PWM, at the corner of coil and supply at which it is largest.
"""

from math import ceil

import numpy as np

from dzdesign.design.current.circuit import CoilCircuit, CurrentSampling
from dzdesign.design.current.loop import CurrentLoop
from dzdesign.design.current.step_response import SensorLine, run_loop

#: Set points about which the wave is tried, of the rated current; for how long, until it has settled and after.
SHARES = (0.25, 0.5, 0.75)
SETTLED_S, SEEN_S = 0.2, 0.1


def dither_departure(
    loop: CurrentLoop,
    circuit: CoilCircuit,
    sampling: CurrentSampling,
    sensor: SensorLine,
    *,
    counts: int,
    ticks: int,
) -> tuple[int, int]:
    """Return by how many counts the current's peak lies above the set point's at most, and below it at most.

    Both are 0 or more; `counts` is the wave's peak, `ticks` the PWM periods of half of it.
    """
    above, below = [0.0], [0.0]
    for share in SHARES if counts else ():
        set_point, tops = round(share * loop.full_counts), (share + counts / loop.full_counts) * circuit.rated_A
        able = [corner for corner in circuit.corners() if circuit.duty(corner, tops) < 1]
        if not able or not counts < set_point <= loop.full_counts - counts:
            continue
        settled, seen = (round(seconds * sampling.tick_Hz) for seconds in (SETTLED_S, SEEN_S))
        wave = _wave(set_point, counts, ticks, settled + seen)
        means, _ = run_loop(loop, circuit, able, sampling, sensor, wave)
        peaks = means[settled:].max(axis=0) * loop.full_counts / circuit.rated_A - set_point - counts
        above.append(float(peaks.max()))
        below.append(float(-peaks.min()))
    return ceil(max(above)), ceil(max(below))


def _wave(set_point: int, counts: int, ticks: int, periods: int) -> np.ndarray:
    up: np.ndarray = np.arange(periods) % (2 * ticks) < ticks
    wave: np.ndarray = set_point + np.where(up, counts, -counts)
    return wave
