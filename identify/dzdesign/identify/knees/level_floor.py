"""The meter's floor on a staircase, where the command skips flows and readings between zero and the floor are no sign.

A meter with a floor is quiet where it shows nothing, and at a level whose flow is near its floor it shows that flow now
and nothing then.
"""

import numpy as np

from dzdesign.identify.knees.gated_line import fit_line
from dzdesign.identify.knees.noise import robust_sigma

#: Readings of a level on average, and levels between the two flows, for any of this to be seen.
READINGS, LEVELS = 5, 3
#: Noise of a shut reading over that of a flowing one, below which the meter shuts its noise off.
QUIET = 0.3
#: Shares of a level's readings that are zeros: where both are there, the flow is near the floor.
FEW, MANY = 0.02, 0.98
#: Readings above zero of which the smallest is the floor, with this one left for a spike.
SPIKES = 2


def floor_of_levels(u: np.ndarray, q: np.ndarray, shut: np.ndarray, ends: tuple[float, float]) -> float:
    """Return the smallest flow that the meter shows, m³/s, where levels tell that it has a floor; 0 elsewhere.

    Parameters
    ----------
    u, q : (N,) array
        Command, V, and flow, m³/s; several readings at each level of the command.
    shut : (M,) array
        Readings far below the first flow, m³/s.
    ends : tuple of float
        Commands between which the flow rises straight, V.
    """
    levels, index = np.unique(u, return_inverse=True)
    straight = (u >= ends[0]) & (u <= ends[1])
    if levels.size * READINGS > u.size or np.unique(index[straight]).size < LEVELS:
        return 0.0
    count = np.bincount(index)
    mean = np.bincount(index, weights=q) / count
    noise = robust_sigma((q - mean[index])[straight])
    shut_noise = robust_sigma(shut)
    if not shut_noise < QUIET * noise:
        return 0.0
    zero = np.abs(q - np.median(shut)) <= max(3 * shut_noise, 0.1 * noise)
    slope, knee = fit_line(u[straight & ~zero], q[straight & ~zero])
    zeros = np.bincount(index, weights=zero) / count
    mixed = (zeros > FEW) & (zeros < MANY)
    # A sharp edge passes this flow at a level that shows none at all.
    unseen = (zeros >= MANY) & (slope * (levels - knee) > 3 * noise)
    near = levels < ends[1]
    readings = np.sort(q[~zero & (u < ends[1])])
    if readings.size <= SPIKES or not np.any((mixed | unseen) & near):
        return 0.0
    return float(readings[SPIKES])
