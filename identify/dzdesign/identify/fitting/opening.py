"""Where useful flow begins on opening, as a curve over the pressure drop."""

from collections.abc import Mapping

import numpy as np

from dzdesign.identify.constants import Direction
from dzdesign.identify.fitting.bounds import FINEST_ERROR
from dzdesign.identify.knees.knee_table import Knees
from dzdesign.identify.valve.guard_curve import CertifiedCurve, OpeningCurve


def opening_curve(
    knees: Knees, direction: Direction, guards: Mapping[str, CertifiedCurve], u_max: float
) -> OpeningCurve | None:
    """Return where useful flow begins on opening, from the knees of the rising branch that run one way.

    It must not lie below the curves of the guards. None where dP is unknown, or without a rising branch.
    """
    from scipy.optimize import isotonic_regression

    dp = next(iter(guards.values())).dp_MPa
    knee, se = knees.knee[:, 0], knees.knee_se[:, 0]
    if not dp or np.isnan(knee).any():
        return None
    weights = np.maximum(se, FINEST_ERROR * u_max) ** -2
    if direction == "flat":
        knee = np.full_like(knee, np.average(knee, weights=weights))
    else:
        knee = isotonic_regression(knee, weights=weights, increasing=direction == "increasing").x
    # The larger of two curves that run one way runs that way too.
    highest = np.max([knee, *(np.array(curve.u_offset_V) for curve in guards.values())], axis=0)
    return OpeningCurve(dp_MPa=dp, u_V=tuple(map(float, highest)), u_se_V=tuple(map(float, se)))
