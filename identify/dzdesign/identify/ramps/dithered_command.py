"""A command column that shows the dither of the drive: the command is its mean, which the spool follows."""

from dataclasses import replace

import numpy as np

from dzdesign.core.dither import Dither
from dzdesign.identify.reading.ramp_test import RampTest

#: The mean is over so many waves at least, and so many samples.
WAVES, SAMPLES = 2, 9
#: Share of the declared peak by which half of the samples depart from their mean where the dither is recorded.
SEEN = 0.5
#: An undeclared one: departures of this share of full command, nine in ten of them within so many medians.
LEAST, ALIKE = 2e-3, 1.6


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
