"""A position loop around a valve, advanced in small steps: `hunts` shares no code with what `design` states of it."""

from dataclasses import dataclass

import numpy as np

from dzdesign.design.costs_at_tests import LawCorners
from dzdesign.design.position_loop import Swinging


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A valve and a loop of nobody's: all drives and commands are shares of full, times in s, 1250 samples a second."""

    lag_s: float
    delay_s: float
    offset: float
    at_end: float
    full: float
    zero_band: float
    end: float
    leaves: float
    opens: float
    closes: float


def drawn(rng: np.random.Generator) -> Drawn:
    """Draw lag, delay, play, transition and thresholds."""
    opens, width = rng.uniform(0.2, 0.7), rng.choice([0.0, rng.uniform(0.002, 0.06)])
    zero_band, lag = rng.uniform(0.002, 0.008), 10 ** rng.uniform(np.log10(0.005), np.log10(0.06))
    return Drawn(
        lag_s=float(lag),
        delay_s=round(float(rng.uniform(0.05, 0.6) * lag) * 1250) / 1250,
        offset=float(opens - width - rng.uniform(0.002, 0.02)),
        at_end=float(opens + rng.uniform(0.0, 0.01)),
        full=float(rng.uniform(0.9, 1.0)),
        zero_band=float(zero_band),
        end=float(zero_band + rng.uniform(0.004, 0.03)),
        leaves=float(1.25 * zero_band),
        opens=float(opens),
        closes=float(opens - width),
    )


def swinging(of: Drawn) -> Swinging:
    """Return a draw as `design` takes it."""
    law = LawCorners(
        offset=of.offset, at_end=of.at_end, full=of.full, zero_band=of.zero_band, end=of.end, leaves=of.leaves
    )
    return Swinging(lag_s=of.lag_s, delay_s=of.delay_s, sample_Hz=1250, law=law, opens=of.opens, closes=of.closes)


def hunts(of: Drawn, gain: float, seconds: float, fine: int = 5) -> bool:
    """Let the loop go from five errors, with four plays; tell whether one still swings, and no less, at the end.

    Spool, play and piston are advanced by `fine` explicit steps a sample.
    """
    starts, plays = np.meshgrid([0.02, 0.06, 0.2, 0.6, 1.0], [0.0, 0.4, 0.8, 1.0])
    x, width = starts.ravel() / gain, plays.ravel() * (of.opens - of.closes)
    spool, play, side = np.zeros(x.size), np.zeros(x.size), np.ones(x.size)
    edge, step_s, line = of.opens - width / 2, 1 / 1250 / fine, [x] * (round(of.delay_s * 1250) + 1)
    largest, signs, before = np.zeros((4, x.size)), np.zeros(x.size), np.sign(x)
    samples = int(seconds * 1250)
    for sample in range(samples):
        command = np.clip(gain * line[0], -1.0, 1.0)
        side = np.where((np.sign(command) == -side) & (np.abs(command) > of.leaves), -side, side)
        share = np.where(np.sign(command) == side, np.abs(command), 0.0)
        early = of.offset + (of.at_end - of.offset) * (share - of.zero_band) / (of.end - of.zero_band)
        late = of.at_end + (of.full - of.at_end) * (share - of.end) / (1 - of.end)
        aim = side * np.where(share <= of.zero_band, of.offset, np.where(share < of.end, early, late))
        for _ in range(fine):
            spool = spool + step_s / of.lag_s * (aim - spool)
            play = np.minimum(np.maximum(play, spool - width / 2), spool + width / 2)
            flow = np.where(play > edge, play - edge, np.where(play < -edge, play + edge, 0.0))
            x = x - step_s * flow / (of.full - of.opens)
        line = [*line[1:], x]
        quarter = 4 * sample // samples
        largest[quarter] = np.maximum(largest[quarter], np.abs(x))
        signs += (np.sign(x) == -before) & (quarter == 3)
        before = np.where(x == 0, before, np.sign(x))
    return bool(((signs > 1) & (largest[3] > 0.98 * largest[2])).any())
