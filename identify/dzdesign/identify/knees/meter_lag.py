"""The flow meter's lag, from ramps of two rates.

At a rate of r V/s a meter that lags by tau shows the rising knee r tau too high and the falling one r tau too low. On
one ramp rate that can't be told from hysteresis; a second rate moves the knees and leaves the hysteresis where it was.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import FULL_SWEEP
from dzdesign.identify.knees.gated_line import prepare_branch
from dzdesign.identify.knees.line_fitting import lay_line
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.pooling import group_by_pressure
from dzdesign.identify.ramps.splitting import Ramp

#: Rates that differ by less than this factor are one.
TWO_RATES = 1.5
#: Standard errors that a lag must exceed to be believed.
LAG_SIGNIFICANCE = 3.0
#: A lag known no better than this, s, is not known.
USELESS = 0.1


@dataclass(frozen=True, slots=True)
class MeterLag:
    """Lag of the flow meter and its standard error, s; `origin` says how it is known.

    `origin` is "declared", "identified" (from ramps of two rates) or "unknown": then none is taken.
    """

    seconds: float
    se: float
    origin: Literal["declared", "identified", "unknown"]


def find_lag(ramps: Sequence[Ramp], options: IdentifyOptions) -> MeterLag:
    """Find the meter's lag, unless it is declared, from all ramps, split as if there were no lag."""
    if options.meter_lag is not None:
        return MeterLag(options.meter_lag, 0.0, "declared")
    total = weighted = 0.0
    for group in group_by_pressure(ramps):
        for rising in (True, False):
            rates, knees, errors = _knees(group, rising, options)
            if rates.size < 2 or rates.max() < TWO_RATES * rates.min():
                continue
            # Each group and direction has a knee of its own, so only departures from its mean tell the lag.
            weight = errors**-2.0
            pace = (rates - np.average(rates, weights=weight)) * (1 if rising else -1)
            total += float(np.sum(weight * pace**2))
            weighted += float(np.sum(weight * pace * knees))
    se = 1 / math.sqrt(total) if total > 0 else math.inf
    if se > USELESS:
        return MeterLag(0.0, math.nan, "unknown")
    seconds = weighted / total
    # Below its error there may be none; the error counts in the bounds either way.
    return MeterLag(seconds if seconds > LAG_SIGNIFICANCE * se else 0.0, se, "identified")


def _knees(group: Sequence[Ramp], rising: bool, options: IdentifyOptions) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rate (V/s), knee and its standard error (V) of each ramp's branch of one direction; without those that
    show no knee by themselves."""
    found = []
    highest = max((branch.u.max() for ramp in group for branch in ramp.branches), default=0.0)
    for ramp in group:
        for branch in ramp.branches:
            whole = branch.u.max() >= FULL_SWEEP * highest and np.ptp(branch.u) >= FULL_SWEEP * highest
            if branch.rising is not rising or not math.isfinite(branch.rate) or not whole:
                continue
            read = prepare_branch(branch, ramp.test, u_max=options.u_max, floor=options.meter_floor or 0.0)
            with suppress(InputError):
                line = lay_line(read, options.knee_window)
                if line.slope > 0:
                    found.append((branch.rate, line.knee, line.knee_se))
    columns = np.array(found).reshape(-1, 3)
    return columns[:, 0], columns[:, 1], columns[:, 2]
