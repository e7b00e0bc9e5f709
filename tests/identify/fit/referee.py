"""The certificate once more, from the other side: the least next closing that data and class allow, stated in cvxpy.

Run as a process of its own, with a pickled list of programmes on stdin: CasADi's HiGHS and the one that cvxpy imports
crash each other.
"""

import pickle
import sys

import numpy as np


def least_thresholds(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the least g at each point with left @ g >= right, V."""
    import cvxpy

    points = left.shape[1]
    base = float(np.max(right))
    every = cvxpy.Variable((points, points))  # a column for each point, in mV
    rows = [left @ every >= 1e3 * np.tile((right - base * left.sum(axis=1))[:, None], points)]
    problem = cvxpy.Problem(cvxpy.Minimize(cvxpy.trace(every)), rows)
    problem.solve(solver=cvxpy.CLARABEL, tol_gap_abs=1e-9, tol_gap_rel=1e-9, tol_feas=1e-9)
    if problem.status not in (cvxpy.OPTIMAL, cvxpy.OPTIMAL_INACCURATE):
        raise ValueError(problem.status)
    return base + np.diag(every.value) / 1e3


if __name__ == "__main__":
    programmes = pickle.load(sys.stdin.buffer)
    pickle.dump([least_thresholds(*each) for each in programmes], sys.stdout.buffer)
