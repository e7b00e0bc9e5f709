"""Referees for the fits: the same problems, written from their statements for other solvers, on other data.

Nothing of `identify.fit` stands on the referees' side: cvxpy's CLARABEL at tight tolerances, NumPy's lines through raw
samples, pool-adjacent-violators on the profile likelihood, and a Tobit likelihood of single samples in SciPy. Each
referee is itself tried: a fault seeded in the fit must show as a disagreement.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import casadi as ca
import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize
from scipy.special import log_ndtr

from dzdesign.core.errors import InputError
from dzdesign.identify.fitting import casadi_problems as fit_problems
from dzdesign.identify.fitting import constrained_fits as fit
from dzdesign.identify.knees import characteristic
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.branches import Bins, bin_branch
from dzdesign.identify.valve.staircase import staircase
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

U_MAX = 10.0
SEED = 20261121
TRENDS = ("decreasing", "increasing", "flat")
#: V; what two solvers of one convex problem may differ by.
SAME = 1e-8
#: V; what bins of 10 mV may cost against single samples, where readings are censored.
BINNED = 50e-6
#: V; no offset may exceed its ceiling, nor a knee run the wrong way, by more.
FEASIBLE = 1e-9


def nearest_that_runs_one_way(wanted, weight, trend, ceiling=None):
    """Minimise ``sum(weight (x - wanted)^2)`` over x that run one way, not above a ceiling, by cvxpy.

    Scaled so that CLARABEL converges: lengths by the largest in the problem, and each unknown by its weight. What is
    flat is one unknown.
    """
    centre = wanted.mean() if ceiling is None else ceiling.mean()
    known = [wanted - centre, np.zeros(1) if ceiling is None else ceiling - centre]
    unit = max(float(np.abs(np.concatenate(known)).max()), 1e-12)
    root = np.sqrt(weight / weight.min())
    x = cp.Variable() * np.ones(wanted.size) if trend == "flat" else cp.multiply(1 / root, cp.Variable(wanted.size))
    constraints = [] if trend == "flat" else [cp.diff(x) <= 0 if trend == "decreasing" else cp.diff(x) >= 0]
    if ceiling is not None:
        constraints.append(x <= (ceiling - centre) / unit)
    miss = cp.multiply(root, x) - root * (wanted - centre) / unit
    solve(cp.Problem(cp.Minimize(cp.sum_squares(miss / np.linalg.norm(root))), constraints))
    return x.value * unit + centre


def pooled(best_of, size, trend):
    """Return what runs one way and costs least, by pooling adjacent violators: exact for convex costs of single items.

    ``best_of(members)`` is the value that costs a block of them least.
    """
    sign = 1 if trend == "increasing" else -1
    blocks = []
    for index in range(size):
        blocks.append(([index], best_of([index])))
        while len(blocks) > 1 and sign * (blocks[-1][1] - blocks[-2][1]) < 0:
            members = blocks[-2][0] + blocks[-1][0]
            blocks[-2:] = [(members, best_of(members))]
    return np.concatenate([np.full(len(members), value) for members, value in blocks])


#: As tight as double precision bears; without the refinement one problem in 300 stalls.
TIGHT = {"tol_gap_abs": 1e-13, "tol_gap_rel": 1e-13, "tol_feas": 1e-13}
REFINED = {"iterative_refinement_reltol": 1e-15, "iterative_refinement_abstol": 1e-15}


def solve(problem):
    problem.solve(solver=cp.CLARABEL, **TIGHT, **REFINED)
    assert problem.status == cp.OPTIMAL


class TestOffset:
    """`fit_offset`: the offset nearest to the guarded thresholds, monotone, under its ceiling."""

    @staticmethod
    def problem(seed, size, trend):
        """Thresholds that need not run as the trend says, errors over three decades, ceilings below or above them."""
        rng = np.random.default_rng([SEED, seed])
        se = 10 ** rng.uniform(-4, -1, size)
        drift = {"decreasing": -0.5, "increasing": 0.5, "flat": 0.0}[trend] * np.sort(rng.random(size))
        guard = rng.uniform(1, 6) + drift + se * rng.standard_normal(size)
        ceiling = guard - (4 * se if rng.random() < 0.5 else rng.uniform(-1, 4, size) * se)
        return guard, se, np.maximum(ceiling, 0.05)

    @staticmethod
    def fitted(guard, se, ceiling, trend, reference=0):
        """Return the offset found, V, and the weights of the statement: none outweighs another by more than 1e4."""
        found = fit.fit_offset(guard, se, ceiling, reference, u_max=U_MAX, trend=trend)
        assert found.beta[reference] == 1
        offset = found.u_min0 * found.beta
        assert (offset - ceiling).max() < FEASIBLE
        return offset, np.minimum((se.max() / se) ** 2, 1e4)

    def disagreement(self, seed, size, trend):
        guard, se, ceiling = self.problem(seed, size, trend)
        offset, weight = self.fitted(guard, se, ceiling, trend, seed % size)
        return np.abs(offset - nearest_that_runs_one_way(guard, weight, trend, ceiling)).max()

    @pytest.mark.parametrize("trend", TRENDS)
    @pytest.mark.parametrize("size", range(2, 13))
    def test_clarabel_finds_the_same(self, size, trend):
        assert max(self.disagreement(seed, size, trend) for seed in range(4)) < SAME

    @pytest.mark.slow
    @settings(max_examples=300, deadline=None, derandomize=True)
    @given(
        seed=st.integers(0, 10**6), size=st.integers(2, 12), trend=st.sampled_from(TRENDS), reference=st.floats(0, 0.99)
    )
    def test_pooling_finds_the_same(self, seed, size, trend, reference):
        """Exact, so any problem will do: CLARABEL is 1e-7 V off where a threshold comes within a hair of its bound."""
        guard, se, ceiling = self.problem(seed, size, trend)
        if seed % 2 and trend != "flat":  # as in use: ceilings that run one way, many of them equal
            ceiling = staircase(ceiling, trend)[1]
        offset, weight = self.fitted(guard, se, ceiling, trend, int(reference * size))

        def best_of(members):
            return min(np.average(guard[members], weights=weight[members]), ceiling[members].min())

        everything = list(range(size))
        expected = best_of(everything) * np.ones(size) if trend == "flat" else pooled(best_of, size, trend)
        assert np.abs(offset - expected).max() < SAME / 10

    def test_one_test_takes_the_nearest_that_it_may(self):
        one = np.array([5.0])
        for ceiling, expected in ((4.9, 4.9), (5.2, 5.0)):
            found = fit.fit_offset(one, 0.01 * one, np.array([ceiling]), 0, u_max=U_MAX, trend="flat")
            assert found.u_min0 == pytest.approx(expected, abs=SAME)

    def test_errors_of_zero_weigh_alike(self):
        guard = np.array([5.0, 5.2, 5.1])
        found = fit.fit_offset(guard, np.zeros(3), guard + 1, 0, u_max=U_MAX, trend="flat")
        assert found.u_min0 == pytest.approx(5.1, abs=SAME)

    @pytest.mark.parametrize("fault", ["direction reversed", "no ceiling", "no weights"])
    def test_the_referee_sees_a_fault(self, fault, monkeypatch, fresh_solvers, wording):
        original = ca.qpsol

        def faulty(*problem):
            solver = original(*problem)

            def solved(**bounds):
                if fault == "direction reversed":
                    bounds["lbg"], bounds["ubg"] = -bounds["ubg"], -bounds["lbg"]
                if fault == "no ceiling":
                    bounds["lbx"] = -np.inf
                return solver(**bounds)

            solved.stats = solver.stats
            return solved

        monkeypatch.setattr(ca, "qpsol", faulty)
        if fault == "no weights":
            monkeypatch.setattr(fit, "LARGEST_WEIGHT", 1.0)
        if fault != "no weights":  # seen by the fit itself
            with wording.refusal(InputError):
                for seed in range(10):
                    self.disagreement(seed, 6, "decreasing")
            return
        seen = [self.disagreement(seed, 6, "decreasing") for seed in range(10)]
        assert max(seen) > 1e4 * SAME


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


def fitted(shapes, trend, floor=0.0, ordered=1):
    return fit.fit_knees(shapes, floor=floor, u_max=U_MAX, trend=trend, ordered=ordered)


def over_pairs(function, pairs):
    return np.array([[function(item) for item in pair] for pair in pairs])


def forget_solvers():
    for build in (fit_problems.offset_solver, fit_problems._knee_solver):
        build.cache_clear()


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
    for trend in ("flat", "decreasing", "increasing"):
        first = fitted(quiet, trend)
        fitted(loud, trend)
        kept = fitted(quiet, trend)
        forget_solvers()
        assert np.array_equal(first.knee, kept.knee) and np.array_equal(first.knee_se, kept.knee_se)
        assert np.array_equal(first.slope, kept.slope) and first.active == kept.active


class TestLines:
    """`fit_knees` without an order and without censored samples: one least-squares line a branch."""

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
        knee = fitted(shapes, "flat").knee
        raw = np.abs(knee - over_pairs(self.polyfit_knee, samples)).max()
        return raw, np.abs(knee - self.clarabel_knees(shapes)).max()

    @pytest.mark.parametrize("seed", range(12))
    def test_polyfit_and_clarabel_find_the_same(self, seed):
        assert max(self.disagreement(seed)) < SAME

    @pytest.mark.parametrize("statistic", ["c_uy", "c_uu"])
    def test_the_referees_see_a_fault(self, statistic, monkeypatch):
        monkeypatch.setattr(fit, "branch_numbers", without(statistic))
        assert min(self.disagreement(0)) > 100 * SAME


class TestOrderedKnees:
    """`fit_knees` with an order: nearest in likelihood among the knees that run one way."""

    @staticmethod
    def clarabel_knees(samples, shapes, slopes, trend):
        """With the slopes known, the cost is a parabola about each line's zero: a quadratic programme."""
        zero = np.array([raw.u.mean() - raw.y.mean() / slope for raw, slope in zip(samples, slopes, strict=True)])
        stiffness = [
            raw.u.size * (slope / shape.sigma) ** 2 for raw, shape, slope in zip(samples, shapes, slopes, strict=True)
        ]
        return nearest_that_runs_one_way(zero, np.array(stiffness), trend)

    @staticmethod
    def best_slope(samples, knee):
        return np.dot(samples.y, samples.u - knee) / np.dot(samples.u - knee, samples.u - knee)

    @classmethod
    def pooling_knees(cls, samples, shapes, trend):
        """Pool adjacent violators on the likelihood with each slope at its best: no slope is taken from the fit."""
        zero = np.array([TestLines.polyfit_knee(raw) for raw in samples])

        def force(index, knee):
            raw, slope = samples[index], cls.best_slope(samples[index], knee)
            return slope * np.sum(raw.y - slope * (raw.u - knee)) / shapes[index].sigma ** 2

        def best_of(members):
            if len(members) == 1:
                return zero[members[0]]
            low, high = zero[members].min(), zero[members].max()
            return brentq(lambda knee: sum(force(member, knee) for member in members), low, high, xtol=1e-13)

        return pooled(best_of, len(samples), trend)

    def disagreement(self, seed, trend, ordered=1, spread=0.05):
        """Return disagreements with both referees, of the other branch, of slopes; and how far knees run wrong, V."""
        pairs, shapes = valve(seed, spread)
        found = fitted(shapes, trend, ordered=ordered)
        samples, mine = [pair[ordered] for pair in pairs], [pair[ordered] for pair in shapes]
        knees, slopes = found.knee[:, ordered], found.slope[:, ordered]
        best = np.array([self.best_slope(raw, knee) for raw, knee in zip(samples, knees, strict=True)])
        other = np.array([TestLines.polyfit_knee(pair[1 - ordered]) for pair in pairs])
        return {
            "clarabel": np.abs(knees - self.clarabel_knees(samples, mine, slopes, trend)).max(),
            "pooled": np.abs(knees - self.pooling_knees(samples, mine, trend)).max(),
            "other branch": np.abs(found.knee[:, 1 - ordered] - other).max(),
            "slopes": U_MAX * np.abs(slopes / best - 1).max(),
            "wrong way": 10
            * max((later - knee) * (1 if trend == "decreasing" else -1) for knee, later in pairwise(knees)),
        }

    @pytest.mark.parametrize("trend", ["decreasing", "increasing"])
    @pytest.mark.parametrize("seed", range(10))
    def test_clarabel_and_pooling_find_the_same(self, seed, trend):
        for name, difference in self.disagreement(seed, trend, ordered=seed % 2).items():
            assert difference < SAME, name

    @pytest.mark.parametrize("seed", range(4))
    def test_knees_that_break_the_order_by_thousands_of_errors(self, seed):
        """From such a start IPOPT once found no way back, and called the problem infeasible."""
        for name, difference in self.disagreement(seed, "decreasing", spread=0.3).items():
            assert difference < SAME, name

    @pytest.mark.parametrize("fault", ["reversed", "left out", "c_uy", "sloppy"])
    def test_the_referees_see_a_fault(self, fault, monkeypatch, fresh_solvers):
        original = ca.nlpsol

        def faulty(name, plugin, problem, options):
            solver = original(name, plugin, {**problem, "g": -problem["g"]}, options)

            def solved(x0, p, lbg, ubg):
                return solver(x0=x0, p=p, lbg=lbg if fault == "reversed" else -np.inf, ubg=ubg)

            solved.stats, solved.size1_out, solved.get_function = solver.stats, solver.size1_out, solver.get_function
            return solved

        if fault in ("reversed", "left out"):
            monkeypatch.setattr(ca, "nlpsol", faulty)
        if fault == "c_uy":
            monkeypatch.setattr(fit, "branch_numbers", without("c_uy"))
        if fault == "sloppy":  # a constraint met to a thousandth of a standard error
            for name, value in {"tol": 1e-3, "compl_inf_tol": 1e-3, "bound_relax_factor": 1e-3}.items():
                monkeypatch.setitem(fit_problems.IPOPT, f"ipopt.{name}", value)
        seen = self.disagreement(1, "decreasing")
        assert seen["pooled"] > 10 * SAME
        if fault in ("reversed", "left out"):
            assert seen["clarabel"] > 1e4 * SAME
        if fault == "c_uy":
            assert seen["slopes"] > 10 * SAME


@pytest.mark.parametrize("seed", range(12))
def test_knees_that_run_one_way_by_themselves_are_not_moved_by_that_order(seed):
    """`order_knees` then takes the free fit, and fits an order to one branch without the other."""
    _, shapes = valve(seed)
    free = fitted(shapes, "flat")
    order = np.argsort(-free.knee[:, 1])
    ordered = fitted([shapes[row] for row in order], "decreasing", ordered=1)
    alone = fitted([(None, shapes[row][1]) for row in order], "decreasing", ordered=1)
    for name in ("knee", "slope"):
        expected = getattr(free, name)[order]
        np.testing.assert_allclose(getattr(ordered, name), expected, rtol=SAME)
        np.testing.assert_allclose(getattr(alone, name)[:, 1], expected[:, 1], rtol=SAME)
        merged = getattr(alone.with_other_branch(ordered, 0), name)
        np.testing.assert_allclose(merged, expected, rtol=SAME)
    np.testing.assert_allclose(alone.knee_se[:, 1], free.knee_se[order, 1], rtol=1e-6)


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
        knee = fitted([(shape, None)], "flat", floor).knee[0, 0]
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
        knee = fitted([item.shapes for item in described.tests], "flat", described.floor).knee
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
            knee = fitted([(shape, None)], "flat", 0.0 if fault == "floor at zero" else floor).knee[0, 0]
            seen.append(abs(knee - expected))
        assert max(seen) > BINNED
