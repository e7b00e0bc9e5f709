"""The fits of `identify` against referees that share no code with them: SciPy on raw samples, NumPy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import log_ndtr, logsumexp

from dzdesign.identify.fitting import constrained_fits as fit
from dzdesign.identify.fitting.constrained_fits import fit_knees
from dzdesign.identify.knees.gated_line import prepare_branch
from dzdesign.identify.knees.line_fitting import lay_line
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.branches import bin_branch
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

SEED = 20261121
PRESSURES = (0.5, 1.0, 2.0, 4.0)
U_MAX = 10.0


# --- the knees ----------------------------------------------------------------------------------------------


def described(floor=0.0, noise=0.15, knees=(5.45, 5.42, 5.36, 5.3), seed=0):
    tests = [
        synthetic_ramp(dp, Truth(knee_rising=knee, slope=3 * dp**0.5, noise=0.0), ramp_s=40.0)
        for dp, knee in zip(PRESSURES, knees, strict=True)
    ]
    rng = np.random.default_rng([SEED, seed])
    noisy = []
    for test in tests:
        q = test.q + noise * L_MIN * rng.standard_normal(test.q.size)
        q[q < floor * L_MIN] = 0.0 if floor else q[q < floor * L_MIN]
        noisy.append(type(test)(source=test.source, sha256=test.sha256, time=test.time, u=test.u, q=q, dp=test.dp))
    options = IdentifyOptions(meter_floor=floor * L_MIN, meter_lag=0.0)
    return describe_tests(noisy, options), noisy


def lines_by_numpy(shapes):
    """Slope and zero of the least-squares line of each branch, from its bins' sums by the normal equations."""
    knees = np.empty((len(shapes), 2))
    for row, pair in enumerate(shapes):
        for column, shape in enumerate(pair):
            bins = shape.bins
            n = bins.n.sum()
            u, y = np.sum(bins.n * bins.u) / n, np.sum(bins.n * bins.y) / n
            uu = np.sum(bins.c_uu + bins.n * (bins.u - u) ** 2)
            uy = np.sum(bins.c_uy + bins.n * (bins.u - u) * (bins.y - y))
            knees[row, column] = u - y * uu / uy
    return knees


def test_free_knees_are_the_least_squares_lines():
    group, _ = described()
    shapes = [item.shapes for item in group.tests]
    found = fit_knees(shapes, floor=0.0, u_max=U_MAX)
    assert np.abs(found.knee - lines_by_numpy(shapes)).max() < 1e-8


def tobit_knee(read, line, shape, floor):
    """Zero of one branch's line by the censored likelihood of its raw samples, no bins.

    A sample below the floor is one of little flow, or one that drops out.
    """
    u, q, cut = read.branch.u[line.kept], read.y[line.kept], line.censored[line.kept]

    def cost(parameters):
        slope, knee = shape.slope * (1 + parameters[0]), shape.knee + parameters[1]
        miss = (q[~cut] - slope * (u[~cut] - knee)) / shape.sigma
        depth = (floor - slope * (u[cut] - knee)) / shape.sigma
        shut = logsumexp([log_ndtr(depth), np.zeros_like(depth)], axis=0, b=[[1 - shape.dropped], [shape.dropped]])
        return 0.5 * np.sum(miss**2) - np.sum(shut)

    found = minimize(cost, [0.0, 0.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-9, "maxiter": 4000})
    assert found.success
    return shape.knee + found.x[1]


def worst_tobit_error(seed, floor=0.6, dropping=0.0):
    # From 1 % of the largest flow up, well below the floor, so that censored samples weigh.
    window = (0.01, 0.5)
    group, _ = described(floor=floor, seed=seed)
    worst, cut, rng = 0.0, 0, np.random.default_rng(seed)
    for item in group.tests:
        for branch in (shape.prepared.branch for shape in item.branches):
            q = np.where(rng.random(branch.q.size) < dropping, 0.0, branch.q)
            branch = replace(branch, q=q)
            read = prepare_branch(branch, item.test, u_max=U_MAX, floor=group.floor)
            line = lay_line(read, window)
            kept = line.kept
            bins = bin_branch(branch.u[kept], read.y[kept], line.censored[kept], U_MAX)
            assert (line.dropped > 0) == (dropping > 0)
            shape = replace(
                item.shapes[0], bins=bins, slope=line.slope, knee=line.knee, sigma=line.sigma, dropped=line.dropped
            )
            found = fit_knees([(shape, None)], floor=group.floor, u_max=U_MAX)
            worst = max(worst, abs(found.knee[0, 0] - tobit_knee(read, line, shape, group.floor)))
            cut += int(bins.censored.sum())
    return worst, cut


@pytest.mark.parametrize("seed", range(3))
def test_bins_lose_nothing_against_all_samples(seed):
    worst, cut = worst_tobit_error(seed)
    assert worst < 5e-6 and cut > 30


@pytest.mark.parametrize("seed", range(3))
def test_nor_with_drop_outs(seed):
    worst, cut = worst_tobit_error(seed, dropping=0.05)
    assert worst < 5e-6 and cut > 60


def test_the_referee_sees_drop_outs_taken_for_no_flow(monkeypatch):
    monkeypatch.setattr(fit, "branch_numbers", lambda shape, *others: original(replace(shape, dropped=0.0), *others))
    assert worst_tobit_error(0, dropping=0.05)[0] > 5e-4


def test_the_referee_sees_a_missing_term(monkeypatch):
    straight = fit.branch_numbers

    def without_the_censored(shape, *others):
        return straight(replace(shape, bins=replace(shape.bins, censored=np.zeros_like(shape.bins.censored))), *others)

    monkeypatch.setattr(fit, "branch_numbers", without_the_censored)
    assert worst_tobit_error(0)[0] > 1e-3


def test_the_referee_sees_bins_that_forget_their_inside(monkeypatch):
    monkeypatch.setattr(fit, "branch_numbers", lambda shape, *others: original(forgetful(shape), *others))
    assert worst_tobit_error(0)[0] > 2e-5


original = fit.branch_numbers


def forgetful(shape):
    """A shape whose bins know their means only."""
    nothing = np.zeros_like(shape.bins.c_uu)
    return replace(shape, bins=replace(shape.bins, c_uu=nothing, c_uy=nothing))
