"""What the data say of both branches' thresholds, and of k x_max, each with its error: no bound."""

from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import MPA
from dzdesign.identify.fitting.constrained_fits import KneeFit
from dzdesign.identify.fitting.joint_curve import fit_joint_curve
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.guard_curve import CurvePremise
from dzdesign.identify.valve.identified_curve import IdentifiedCurve


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedSide:
    """Identified curves by what the valve does on a branch, and k x_max with its standard error, V."""

    curves: dict[str, IdentifiedCurve]
    k_x_max: float
    k_x_max_se: float


def identify_curve(
    group: DescribedTests, knees: KneeFit, premise: CurvePremise, reference: int, options: IdentifyOptions
) -> IdentifiedSide:
    """Identify the curve of a side: straight under the premise `line`, a threshold for each test under another.

    Raises
    ------
    InputError
        If the joint fit does not converge.
    """
    tests = group.tests
    known = tests[0].dp is not None
    dp = np.array([(item.dp or 0.0) / MPA for item in tests])
    joint = fit_joint_curve(
        [item.shapes for item in tests],
        knees,
        [_beside_noise(group, knees, column) for column in (0, 1)],
        dp_MPa=dp if premise == "line" and len(tests) > 1 else None,
        reference=reference,
        floor=group.floor,
        u_max=options.u_max,
    )
    curves = {}
    for column, name in ((1, "closing"), (0, "opening")):
        if tests[0].shapes[column] is None:
            continue
        beta, beta_se = joint.beta(column, reference)
        curves[name] = IdentifiedCurve(
            dp_MPa=tuple(map(float, dp)) if known else (),
            u_V=tuple(map(float, joint.u[:, column])),
            u_se_V=tuple(map(float, np.sqrt(np.diag(joint.covariance[column])))),
            beta=tuple(map(float, beta)) if known else (),
            beta_se=tuple(map(float, beta_se)) if known else (),
        )
    return IdentifiedSide(curves=curves, k_x_max=joint.k_x_max, k_x_max_se=joint.k_x_max_se)


def _beside_noise(group: DescribedTests, knees: KneeFit, column: int) -> np.ndarray | None:
    """Return the covariance of a branch's thresholds beside the noise of the samples, V² (T, T).

    From ramp to ramp they scatter. And where the straight part was taken wider than the window that was asked for, for
    no bend is seen, the wider window moved the knee: by a bend that the noise hides, or by the noise itself. That shift
    counts as one standard error.
    """
    if group.tests[0].shapes[column] is None:
        return None
    se = knees.knee_se[:, column]
    covariance = group.between(column).covariance_of_mean(se) - np.diag(se**2)
    shapes = [item.branch(column) for item in group.tests]
    shifts = np.array([shape.knee_of_window - shape.knee for shape in shapes])
    found: np.ndarray = covariance + np.diag(shifts**2)
    return found
