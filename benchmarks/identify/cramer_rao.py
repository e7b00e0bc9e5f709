"""The Cramér-Rao bound of a threshold, from readings of which those below the meter's floor are censored (Tobit).

Parameters of one ramp test, none of them known: opening threshold, closing threshold, slope and saturated flow, the
last two common to both branches. A reading is Gaussian about ``mu = min(s max(u - u_min, 0), Q_sat)`` and is reported
only above the floor. With z = (floor - mu)/sigma, a Tobit reading holds

    J(z) = 1 - Phi(z) + z phi(z) + phi(z)^2 / Phi(z)

of an uncensored reading's information (grad mu grad mu^T)/sigma^2. The threshold that is compared is the middle of
opening and closing: for it, slopes common to the branches or one each give the same bound (the designs are mirrored),
so the comparison is fair to an estimator that frees them. The meter's lag is declared, so it is known.
"""

from dataclasses import dataclass

import numpy as np
from bench_model import U_MAX_V, Bench
from scipy.special import log_ndtr, ndtr


@dataclass(frozen=True, slots=True, kw_only=True)
class Bound:
    """Smallest standard errors of an unbiased estimator at one pressure drop.

    Attributes
    ----------
    middle_V : float
        Of the middle of opening and closing threshold.
    branch_V : float
        Of the closing threshold, the slope of that branch its own.
    slope : float
        Of the common slope, relative.
    """

    middle_V: float
    branch_V: float
    slope: float


def tobit_share(z: np.ndarray) -> np.ndarray:
    """Return J(z), the share of a reading's information that is left when it is censored below mu + z sigma."""
    log_phi = -0.5 * z**2 - 0.5 * np.log(2 * np.pi)
    return ndtr(-z) + z * np.exp(log_phi) + np.exp(2 * log_phi - log_ndtr(z))


def branch_information(bench: Bench, dp_MPa: float, threshold_V: float) -> np.ndarray:
    """Return the Fisher information of (threshold, slope, saturated flow) from one branch, V and L/min.

    For AR(1) noise the gradients, weighted by the root of J, are whitened by the noise's own filter: exact for white
    noise with a floor and for coloured noise without one, and close to both where few readings are partly censored.
    """
    u = np.linspace(0.0, U_MAX_V, round(bench.ramp_s * bench.rate_Hz))
    slope, travel = bench.slope_at(dp_MPa), u - threshold_V
    open_, saturated = travel > 0, travel >= bench.saturation_V
    straight = open_ & ~saturated
    gradient = np.zeros((3, u.size))
    gradient[0, straight], gradient[1, straight], gradient[2, saturated] = -slope, travel[straight], 1.0
    if bench.floor_L_min > 0:
        mu = slope * np.clip(travel, 0.0, bench.saturation_V)
        gradient *= np.sqrt(np.clip(tobit_share((bench.floor_L_min - mu) / bench.noise_L_min), 0.0, 1.0))
    first = np.outer(gradient[:, 0], gradient[:, 0])
    new = gradient[:, 1:] - bench.ar * gradient[:, :-1]
    return (first + new @ new.T / (1 - bench.ar**2)) / bench.noise_L_min**2


def cramer_rao(bench: Bench, dp_MPa: float) -> Bound:
    """Return the bound at one pressure drop."""
    opening = branch_information(bench, dp_MPa, bench.opening_V(dp_MPa))
    closing = branch_information(bench, dp_MPa, bench.closing_V(dp_MPa))
    both = np.zeros((4, 4))
    for information, own in ((opening, 0), (closing, 1)):
        at = np.array([own, 2, 3])
        both[np.ix_(at, at)] += information
    covariance = _inverse(both)
    middle = np.array([0.5, 0.5, 0.0, 0.0])[: covariance.shape[0]]
    return Bound(
        middle_V=float(np.sqrt(middle @ covariance @ middle)),
        branch_V=float(np.sqrt(_inverse(closing)[0, 0])),
        slope=float(np.sqrt(covariance[2, 2]) / bench.slope_at(dp_MPa)),
    )


def beta_bound(bench: Bench, dp_MPa: float, dp0_MPa: float = 1.0, *, closing: bool = False) -> float:
    """Return the bound of beta(dP) = u_min(dP)/u_min(dP0), the two tests being independent.

    Of the middle of opening and closing, or of closing alone, the slope of that branch its own.
    """
    of = bench.closing_V if closing else bench.threshold_V
    at, reference = of(dp_MPa), of(dp0_MPa)
    last, first = cramer_rao(bench, dp_MPa), cramer_rao(bench, dp0_MPa)
    errors = [(bound.branch_V if closing else bound.middle_V) for bound in (last, first)]
    return float(at / reference * np.hypot(errors[0] / at, errors[1] / reference))


def _inverse(information: np.ndarray) -> np.ndarray:
    """Invert, leaving out the saturated flow where no sample saturates."""
    size = information.shape[0] - (information[-1, -1] == 0)
    return np.linalg.inv(information[:size, :size])
