"""Referees for the fits: the same problems, written from their statements for other solvers, on other data.

Nothing of `identify.fitting` stands on the referees' side: cvxpy's CLARABEL at tight tolerances, NumPy's lines through
raw samples, and a Tobit likelihood of single samples in SciPy. Each referee is itself tried: a fault seeded in the fit
must show as a disagreement.
"""

from dataclasses import dataclass, replace

import cvxpy as cp
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import log_ndtr

from dzdesign.identify.fitting import casadi_problems as fit_problems
from dzdesign.identify.fitting import constrained_fits as fit
from dzdesign.identify.knees import characteristic
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.branches import Bins, bin_branch
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

U_MAX = 10.0
SEED = 20261121
#: V; what two solvers of one convex problem may differ by.
SAME = 1e-8
#: V; what bins of 10 mV may cost against single samples, where readings are censored.
BINNED = 50e-6
#: V; no offset may exceed its ceiling, nor a knee run the wrong way, by more.
FEASIBLE = 1e-9


#: As tight as double precision bears; without the refinement one problem in 300 stalls.
TIGHT = {"tol_gap_abs": 1e-13, "tol_gap_rel": 1e-13, "tol_feas": 1e-13}
REFINED = {"iterative_refinement_reltol": 1e-15, "iterative_refinement_abstol": 1e-15}


def solve(problem):
    problem.solve(solver=cp.CLARABEL, **TIGHT, **REFINED)
    assert problem.status == cp.OPTIMAL


@dataclass(frozen=True, kw_only=True)
class Shape:
    """What the joint fit needs to know of a branch; start values off by some standard errors, as if censored."""

    bins: Bins
    slope: float
    knee: float
    sigma: float
    y_max: float
    variance_inflation: float = 1.0
    dropped: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Raw samples of a branch: V, m³/s, and which read below the meter's floor."""

    u: np.ndarray
    y: np.ndarray
    censored: np.ndarray

    def described(self, rng=None) -> Shape:
        u, y = self.u[~self.censored], self.y[~self.censored]
        slope, start = np.polyfit(u, y, 1)
        sigma = float(np.std(y - slope * u - start))
        off = np.zeros(2) if rng is None else 4 * sigma / slope / np.sqrt(u.size) * rng.standard_normal(2)
        return Shape(
            bins=bin_branch(self.u, self.y, self.censored, U_MAX),
            slope=slope * (1 + off[0]),
            knee=-start / slope + off[1],
            sigma=sigma,
            y_max=slope * 4.5,
        )


def line(rng, knee, slope_L_min, noise_share):
    """Samples of a straight line beyond its knee, no censored ones."""
    u = np.sort(rng.uniform(knee + 0.2, knee + rng.uniform(1, 4), int(10 ** rng.uniform(1.7, 3.7))))
    y = slope_L_min * L_MIN * (u - knee + noise_share * rng.standard_normal(u.size))
    return Samples(u=u, y=y, censored=np.zeros(u.size, dtype=bool))


def valve(seed, spread=0.05):
    """Return raw samples and shapes of 2 to 8 tests, both branches; knees run no way, meters from quiet to loud."""
    rng = np.random.default_rng([SEED, seed])
    samples = [
        tuple(
            line(
                rng, 5 - 0.1 * column + spread * rng.standard_normal(), 4 * np.sqrt(1 + row), 10 ** rng.uniform(-4, -1)
            )
            for column in (0, 1)
        )
        for row in range(rng.integers(2, 9))
    ]
    return samples, [tuple(branch.described(rng) for branch in pair) for pair in samples]


def fitted(shapes, floor=0.0):
    return fit.fit_knees(shapes, floor=floor, u_max=U_MAX)


def over_pairs(function, pairs):
    return np.array([[function(item) for item in pair] for pair in pairs])


def forget_solvers():
    fit_problems._knee_solver.cache_clear()


@pytest.fixture
def fresh_solvers():
    """No solver of before in a test that seeds a fault in them, and none of it afterwards."""
    forget_solvers()
    yield
    forget_solvers()


def without(*names):
    """Return a cost of a branch that leaves out some of the statistics: a seeded fault."""
    original = fit.branch_numbers

    def faulty(shape, *others):
        dropped = {name: np.zeros_like(getattr(shape.bins, name)) for name in names}
        return original(replace(shape, bins=replace(shape.bins, **dropped)), *others)

    return faulty


def test_a_solver_that_was_used_before_gives_what_a_new_one_gives():
    """Solvers are kept, so nothing of one valve may be left in them for the next."""
    quiet, loud = valve(1)[1], valve(2)[1]
    forget_solvers()
    for _ in range(2):
        first = fitted(quiet)
        fitted(loud)
        kept = fitted(quiet)
        forget_solvers()
        assert np.array_equal(first.knee, kept.knee) and np.array_equal(first.knee_se, kept.knee_se)
        assert np.array_equal(first.slope, kept.slope)


class TestLines:
    """`fit_knees` without censored samples: one least-squares line a branch."""

    @staticmethod
    def polyfit_knee(samples):
        slope, start = np.polyfit(samples.u - samples.u.mean(), samples.y / L_MIN, 1)
        return samples.u.mean() - start / slope

    @staticmethod
    def clarabel_knees(shapes):
        """Least squares in slope and intercept from the bins' statistics, all branches in one problem."""
        places, costs = [], []
        for shape in (shape for pair in shapes for shape in pair):
            bins = shape.bins
            total, centre, unit = bins.n.sum(), np.average(bins.u, weights=bins.n), shape.y_max
            slope, intercept = cp.Variable(), cp.Variable()  # in y_max per volt; in y_max, at the centre
            root = np.sqrt(bins.n / total)
            costs.append(
                cp.sum_squares(cp.multiply(root, slope * (bins.u - centre) + intercept - bins.y / unit))
                + slope**2 * (bins.c_uu.sum() / total)
                - 2 * slope * (bins.c_uy.sum() / total / unit)
            )
            places.append((centre, slope, intercept))
        solve(cp.Problem(cp.Minimize(cp.sum(costs))))
        return np.array([centre - intercept.value / slope.value for centre, slope, intercept in places]).reshape(-1, 2)

    def disagreement(self, seed):
        samples, shapes = valve(seed)
        knee = fitted(shapes).knee
        raw = np.abs(knee - over_pairs(self.polyfit_knee, samples)).max()
        return raw, np.abs(knee - self.clarabel_knees(shapes)).max()

    @pytest.mark.parametrize("seed", range(12))
    def test_polyfit_and_clarabel_find_the_same(self, seed):
        assert max(self.disagreement(seed)) < SAME

    @pytest.mark.parametrize("statistic", ["c_uy", "c_uu"])
    def test_the_referees_see_a_fault(self, statistic, monkeypatch):
        monkeypatch.setattr(fit, "branch_numbers", without(statistic))
        assert min(self.disagreement(0)) > 100 * SAME


def tobit_knee(samples, sigma, floor, start):
    """Maximise the likelihood of single samples: those seen by their density, the others by their probability."""
    u, y, cut = samples.u, samples.y, samples.censored
    slope_0, knee_0 = start
    slope_unit, knee_unit = 1e-3 * slope_0, sigma / slope_0 / np.sqrt(u.size)

    def cost(x):
        slope, knee = slope_0 + slope_unit * x[0], knee_0 + knee_unit * x[1]
        mean = slope * (u - knee)
        miss, depth = (y[~cut] - mean[~cut]) / sigma, (floor - mean[cut]) / sigma
        likely = log_ndtr(depth)
        mills = np.exp(-(depth**2) / 2 - likely) / np.sqrt(2 * np.pi)
        pull = np.concatenate([-miss, mills]) / sigma  # derivative by the mean, those seen first
        at = np.concatenate([u[~cut], u[cut]])
        gradient = [np.dot(pull, at - knee) * slope_unit, -slope * pull.sum() * knee_unit]
        return 0.5 * np.dot(miss, miss) - likely.sum(), np.array(gradient)

    best = minimize(cost, np.zeros(2), jac=True, method="BFGS", options={"gtol": 1e-7})
    assert np.abs(best.jac).max() < 1e-4, best.message  # in standard errors of the knee, so far below 1 uV
    return knee_0 + knee_unit * best.x[1]


def opening(seed, *, slope=4.0, noise=0.15, floor=0.6, n=4000, width=1.2):
    """A branch just beyond its knee at 5.4 V, read by a meter that shows nothing below its floor (L/min)."""
    rng = np.random.default_rng([SEED, seed])
    u = np.linspace(5.4, 5.4 + width, n)
    y = slope * (u - 5.4) + noise * rng.standard_normal(n)
    return Samples(u=u, y=np.where(y < floor, 0.0, y) * L_MIN, censored=y < floor)


METERS = {
    "usual": {},
    "quiet": {"noise": 0.02},
    "high floor": {"floor": 2.0, "noise": 0.5, "width": 2.0},
    "steep": {"slope": 20.0},
    "few samples": {"n": 400},
}


class TestCensored:
    """`fit_knees` on bins against the Tobit likelihood of single samples."""

    @staticmethod
    def disagreement(samples, floor, shape=None):
        shape = shape or samples.described()
        knee = fitted([(shape, None)], floor).knee[0, 0]
        return abs(knee - tobit_knee(samples, shape.sigma, floor, (shape.slope, shape.knee)))

    @pytest.mark.parametrize("meter", METERS)
    @pytest.mark.parametrize("seed", range(4))
    def test_single_samples_give_the_same(self, seed, meter):
        samples = opening(seed, **METERS[meter])
        assert samples.censored.sum() > 20
        assert self.disagreement(samples, METERS[meter].get("floor", 0.6) * L_MIN) < BINNED

    @pytest.mark.parametrize("depth", [3.0, 5.9, 7.0, 9.0, 30.0])
    @pytest.mark.parametrize("many", [1, 40])
    def test_drop_outs_far_above_the_floor(self, depth, many):
        """Zeros at many standard deviations above the floor: there ``1 + erf`` has no digits left, the fit must."""
        plain = opening(1)
        shape = plain.described()
        at = 5.4 + (0.6 + depth * shape.sigma / L_MIN) / 4 + np.linspace(-4e-3, 4e-3, many)
        samples = Samples(
            u=np.concatenate([plain.u, at]),
            y=np.concatenate([plain.y, np.zeros(many)]),
            censored=np.concatenate([plain.censored, np.ones(many, dtype=bool)]),
        )
        bins = bin_branch(samples.u, samples.y, samples.censored, U_MAX)
        assert self.disagreement(samples, 0.6 * L_MIN, replace(shape, bins=bins)) < BINNED

    @pytest.mark.parametrize(("floor", "noise"), [(0.6, 0.15), (5.0, 1.5)])
    def test_recordings_as_they_are_described(self, floor, noise, monkeypatch):
        """The samples are those of `identify` itself, on their way into the bins."""
        seen = []

        def spy(u, y, censored, u_max):
            seen.append(Samples(u=u, y=y, censored=censored))
            return bin_branch(u, y, censored, u_max)

        monkeypatch.setattr(characteristic, "bin_branch", spy)
        tests = [synthetic_ramp(dp, Truth(noise=noise, slope=4 * dp**0.5), seed=3) for dp in (1.0, 2.0)]
        tests = [replace(test, q=np.where(test.q < floor * L_MIN, 0.0, test.q)) for test in tests]
        described = describe_tests(tests, IdentifyOptions(meter_floor=floor * L_MIN))
        shapes = [shape for item in described.tests for shape in item.shapes]
        knee = fitted([item.shapes for item in described.tests], described.floor).knee
        expected = [
            tobit_knee(samples, shape.sigma, described.floor, (shape.slope, shape.knee))
            for samples, shape in zip(seen, shapes, strict=True)
        ]
        assert floor < 1 or min(samples.censored.sum() for samples in seen) > 20
        assert np.abs(knee.ravel() - expected).max() < BINNED

    @pytest.mark.parametrize("fault", ["censored left out", "c_uy", "floor at zero", "all samples' mean"])
    def test_the_referee_sees_a_fault(self, fault, monkeypatch):
        floor = 0.6 * L_MIN
        if fault in ("censored left out", "c_uy"):
            monkeypatch.setattr(fit, "branch_numbers", without(fault.split()[0]))
        seen = []
        for seed in range(6):
            samples = opening(seed, n=400)
            shape = samples.described()
            expected = tobit_knee(samples, shape.sigma, floor, (shape.slope, shape.knee))
            if fault == "all samples' mean":  # of a bin through which the flow comes to the floor: it once stood so
                everything = bin_branch(samples.u, samples.y, np.zeros(samples.u.size, dtype=bool), U_MAX)
                shape = replace(shape, bins=replace(shape.bins, u_censored=everything.u))
            knee = fitted([(shape, None)], 0.0 if fault == "floor at zero" else floor).knee[0, 0]
            seen.append(abs(knee - expected))
        assert max(seen) > BINNED
