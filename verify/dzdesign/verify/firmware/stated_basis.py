"""What the bounds of a valve are said to rest on, against the numbers that they were made of."""

import math
from collections.abc import Iterator

import numpy as np

from dzdesign.identify.valve.guard_curve import CertifiedCurve
from dzdesign.identify.valve.side_model import SideModel

#: What a number of valve.json may be off by, V. A quantile's error counts so many roundings of a standard error.
ROUNDING_V, ROUNDINGS = 1e-7, 4.0
#: A drift that flattens out departs from a straight one by at most this share of itself.
UNEVEN = 0.4
#: A reading by hand is of a test's pressure drop within this share of it, and at a command but for rounding.
NEAR_DP, NEAR_V = 0.05, 1e-6


def about_basis(side: SideModel) -> Iterator[str]:
    """Yield what the bounds are said to rest on and is not what those of the guarded curve were made of."""
    stated, errors = side.certificate.repeatability, side.curve.errors
    for key, one, other in (
        ("sd_V", stated.sd_V, errors.ramp_sd_V),
        ("degrees_of_freedom", stated.degrees_of_freedom, errors.degrees_of_freedom),
        ("drift_V", stated.drift_V, errors.drift_V),
    ):
        if (one is None) != (other is None) or abs((one or 0.0) - (other or 0.0)) > ROUNDING_V:
            yield f"repeatability.{key} is {one}, but {other} in the errors of its {side.certificate.guard} curve"
    level, unseen = max(test.noise_level_L_min for test in side.tests), _unseen(side)
    if abs(side.certificate.unseen_below_L_min - unseen) > ROUNDING_V + 1e-5 * unseen:
        stated_L_min = side.certificate.unseen_below_L_min
        yield f"unseen_below_L_min is {stated_L_min}, but {unseen:.7f} follows from the low-flow readings and the level"
    if abs(side.certificate.level_L_min - level) > ROUNDING_V:
        yield f"level_L_min is {side.certificate.level_L_min}, but {level} is the largest noise level of the tests"
    if errors.drift_V is not None and errors.degrees_of_freedom is not None:
        found = errors.ramp_sd_V * math.sqrt(max(errors.covariance[-1][-1], 0.0))
        if abs((stated.drift_se_V or 0.0) - found) > ROUNDINGS * ROUNDING_V * (1 + found):
            yield f"repeatability.drift_se_V is {stated.drift_se_V}, but {found:.7f} follows from the ramps' scatter"


def _unseen(side: SideModel) -> float:
    """Return the flow at the guarded bounds that nothing shows, L/min: the meter's, unless readings tell at each test.

    A reading tells of a test within 5 % of its pressure drop, at its threshold and at that of its own pressure drop or
    above; of closing one after closing. At a higher pressure drop than it was taken at, so much more may flow. Its
    table needs one in the meter's range, and a reading that shows more at a lower command counts in its place.
    """
    level, most = side.certificate.level_L_min, 0.0
    of_guard = {"closing": ("falling",), "opening": ("rising", "falling")}.get(side.certificate.guard, ())
    shows = {"closing": ("falling", "rising"), "opening": ("rising",)}.get(side.certificate.guard, ())
    dps, thresholds = np.array(side.curve.dp_MPa), np.array(side.curve.u_threshold_V)
    confirmed = {
        row.source.rsplit(", row ", 1)[0]
        for row in side.low_flow
        if row.branch in of_guard[:1] and row.q_L_min - row.q_error_L_min > level
        and 4 * row.q_error_L_min <= row.q_L_min and np.any(np.abs(row.dp_MPa - dps) <= NEAR_DP * dps)
    }  # fmt: skip

    def threshold_at(dp: float) -> float:
        row = min(max(int(np.sum(dps < dp)), 1), dps.size - 1) if dps.size > 1 else 0
        slope = (thresholds[row] - thresholds[row - 1]) / (dps[row] - dps[row - 1]) if row else 0.0
        return float(thresholds[row] + slope * (dp - dps[row]))

    for dp, threshold in zip(dps, thresholds, strict=False):
        near = [row for row in side.low_flow if abs(row.dp_MPa / dp - 1) <= NEAR_DP]
        flows = []
        for row in near:
            if row.branch not in of_guard or row.source.rsplit(", row ", 1)[0] not in confirmed:
                continue
            if row.u_V <= max(threshold, threshold_at(row.dp_MPa)) - NEAR_V:
                continue
            flow = (row.q_L_min + row.q_error_L_min) * max(dp / row.dp_MPa, 1.0)
            earlier = [each for each in near if each.branch in shows and each.u_V <= row.u_V]
            for each in earlier:
                if each.q_L_min - each.q_error_L_min > (row.q_L_min + row.q_error_L_min) * max(dp / row.dp_MPa, 1.0):
                    flow = max(flow, (each.q_L_min + each.q_error_L_min) * max(dp / each.dp_MPa, 1.0))
            flows.append(flow)
        if not flows:
            return level
        most = max(most, min(flows))
    least = most or level
    below = [row for row in side.low_flow if row.branch in shows and row.u_V <= threshold_at(row.dp_MPa)]
    flowing = [row.q_L_min + row.q_error_L_min for row in below if row.q_L_min - row.q_error_L_min > least]
    return min(level, max([least, *flowing]))


def about_errors(curve: CertifiedCurve) -> Iterator[str]:
    """Yield why errors are none: of an unevenness that is no drift's, or a covariance that is that of nothing."""
    known, uneven = np.array(curve.errors.covariance), curve.errors.uneven_V
    if uneven and abs(uneven - UNEVEN * abs(curve.errors.drift_V or 0.0)) > ROUNDINGS * ROUNDING_V:
        yield f"uneven_V: {uneven}, expected 0 or {UNEVEN:.0%} of the drift, {curve.errors.drift_V}"
    row, column = np.unravel_index(np.abs(known - known.T).argmax(), known.shape)
    if known[row, column] != known[column, row]:
        yield f"covariance[{row}][{column}]: {known[row, column]}, but [{column}][{row}] is {known[column, row]}"
    elif np.linalg.eigvalsh(known)[0] <= 0:
        yield "covariance: it is that of no quantities, for a sum of them would have a negative variance"
