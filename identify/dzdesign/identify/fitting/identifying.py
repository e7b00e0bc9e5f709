"""What the data say of both branches' thresholds, of where useful flow begins, and of k x_max: no bound."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import MPA, ANYWHERE_MPa, Direction
from dzdesign.identify.fit.curve_class import CurveClass
from dzdesign.identify.fit.estimate import covariance_of_curve, estimate_side
from dzdesign.identify.fit.scatter import Scatter
from dzdesign.identify.fitting.guarded_thresholds import FINEST_ERROR
from dzdesign.identify.knees.described_tests import DescribedTests, Knees
from dzdesign.identify.knees.gated_line import BranchShape
from dzdesign.identify.knees.profile import read_at_top
from dzdesign.identify.valve.guard_curve import CertifiedCurve, OpeningCurve
from dzdesign.identify.valve.side_model import IDENTIFIED, IdentifiedCurve

#: Samples at this share of the largest command and above give the largest flow.
TOP = 0.98


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedSide:
    """Identified curves by what the valve does on a branch, and k x_max with its standard error, V."""

    curves: dict[str, IdentifiedCurve]
    k_x_max: float
    k_x_max_se: float


def identify_curve(
    group: DescribedTests, branches: Mapping[str, Scatter], curves: CurveClass, reference: int
) -> IdentifiedSide:
    """Identify the curves of the branches, "closing" and "opening", in the class that their bound rests on.

    Raises
    ------
    InputError
        If the fit does not converge.
    """
    names = [name for name in IDENTIFIED if name in branches]
    estimate = estimate_side([branches[name] for name in names], curves)
    known = group.tests[0].dp is not None
    dp = np.array([ANYWHERE_MPa if item.dp is None else item.dp / MPA for item in group.tests])
    found = {}
    for name, curve in zip(names, estimate.curves, strict=True):
        u = np.interp(dp, estimate.grid_MPa, curve)
        covariance = covariance_of_curve(branches[name], dp, straight=curves.kind == "line")
        covariance += np.diag(_shifts(group, 1 - IDENTIFIED.index(name)) ** 2)
        beta, beta_se = ratio_to(reference, u, covariance)
        found[name] = IdentifiedCurve(
            dp_MPa=tuple(map(float, dp)) if known else (),
            u_V=tuple(map(float, u)),
            u_se_V=tuple(map(float, np.sqrt(np.diag(covariance)))),
            beta=tuple(map(float, beta)) if known else (),
            beta_se=tuple(map(float, beta_se)) if known else (),
        )
    k_x_max, k_x_max_se = command_to_full_stroke(group, reference)
    return IdentifiedSide(curves=found, k_x_max=k_x_max, k_x_max_se=k_x_max_se)


def ratio_to(reference: int, u: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return Eq. (5)'s ratio of thresholds to that at dP0, and its standard error, (T,)."""
    beta = u / u[reference]
    variance = np.diag(covariance) - 2 * beta * covariance[:, reference] + beta**2 * covariance[reference, reference]
    return beta, np.sqrt(np.maximum(variance, 0.0)) / abs(u[reference])


def _shifts(group: DescribedTests, column: int) -> np.ndarray:
    """Return by how much a straight part wider than the window that was asked for moved each knee, V (T,).

    It is wider where no bend is seen. What moved the knee is a bend that the noise hides, or the noise itself: it
    counts as one standard error.
    """
    shapes = [item.branch(column) for item in group.tests]
    return np.array([shape.knee_of_window - shape.knee for shape in shapes])


def command_to_full_stroke(group: DescribedTests, reference: int) -> tuple[float, float]:
    """Return k x_max, the command from the knee to the largest flow at dP0 (Eq. 11), and its standard error, V.

    It is read on the rising branch where there is one. Where the meter could not show the largest flow, another
    pressure drop tells it.
    """
    # A test whose meter showed all of its flow knows of a stop; of several such the one of the nearest pressure drop.
    whole = [row for row, item in enumerate(group.tests) if not all(each.prepared.unseen_top for each in item.branches)]
    teller = min(whole, key=lambda row: (abs(row - reference), row)) if whole else reference
    shapes = group.tests[teller].branches
    # The straight line beyond what the meter showed is of the branch by which the valve opens.
    first = shapes[0].prepared
    readers = shapes[: 1 if first.unseen_top else read_at_top(first.recorded[0].size)]
    shape = max(readers, key=lambda each: each.full_flow)
    k_x_max = shape.full_flow / shape.slope
    return k_x_max, k_x_max * float(np.hypot(_top_error(shape) / shape.full_flow, _slope_error(shape) / shape.slope))


def _top_error(shape: BranchShape) -> float:
    """Return the standard error of a branch's largest flow, m³/s."""
    u = shape.prepared.branch.u
    count = max(int(np.sum(u >= TOP * u.max())), 1)
    return float(shape.sigma * np.sqrt(max(shape.variance_inflation / count, 0.0)))


def _slope_error(shape: BranchShape) -> float:
    """Return the standard error of the slope of a branch's line, m³/(s V)."""
    u = shape.prepared.branch.u[shape.line.kept & ~shape.line.censored]
    squares = max(float(np.sum((u - u.mean()) ** 2)), np.finfo(float).tiny) if u.size else np.inf
    return float(shape.sigma * np.sqrt(shape.variance_inflation / squares))


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
