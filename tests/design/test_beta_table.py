"""The table's programme, translated once, gives what cvxpy gives for each valve; margins are exact where it counts."""

from fractions import Fraction

import cvxpy
import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.design.beta_table import STEP_CODES, TableMargins, best_nodes, between_nodes
from dzdesign.design.exact_row import ExactRow

COUNT = 300


def limit_of(seed):
    rng = np.random.default_rng(seed)
    slope = {0: -0.2, 1: 0.2, 2: 0.0}[seed % 3]
    return 0.8 + slope * np.linspace(0, 1, COUNT) + 0.02 * rng.standard_normal(COUNT).cumsum() / 17


def by_cvxpy(limit, worth, trend, last, top):
    """Return the best value that nodes can have, stated anew."""
    codes = np.arange(limit.size)
    size = (limit.size - 1) // STEP_CODES + 2
    beta = cvxpy.Variable(size)
    index, share = codes // STEP_CODES, (codes % STEP_CODES) / STEP_CODES
    weights = np.zeros((limit.size, size))
    weights[codes, index], weights[codes, index + 1] = 1 - share, share
    way = {"decreasing": -1, "increasing": 1}.get(trend, 0)
    steps = cvxpy.diff(beta)
    rules = [weights @ beta <= limit, beta <= top]
    rules += [way * steps[:last] >= 0 if way else steps[:last] == 0]
    behind = last + 1 if trend == "increasing" else last
    rules += [steps[behind:] <= 0] if behind < size - 1 else []
    value = worth @ (weights @ beta) + worth[-1] * beta[-1]
    problem = cvxpy.Problem(cvxpy.Maximize(value), rules)
    problem.solve(solver=cvxpy.CLARABEL)
    return problem.value, weights


@pytest.mark.parametrize("seed", range(6))
def test_the_best_nodes_are_as_good_as_cvxpys(seed):
    limit, trend = limit_of(seed), ("decreasing", "increasing", "flat")[seed % 3]
    last, worth = (5, 2)[seed // 3], np.where(np.arange(COUNT) < 150, 1.0, 0.01)
    nodes = np.array(best_nodes(limit, worth, trend, last, 1.0))
    best, weights = by_cvxpy(limit, worth, trend, last, 1.0)
    assert np.all(weights @ nodes <= limit + 1e-6)
    assert worth @ (weights @ nodes) + worth[-1] * nodes[-1] == pytest.approx(best, abs=1e-5)
    steps = np.diff(nodes)[:last]
    assert np.all({"decreasing": -steps, "increasing": steps}.get(trend, -abs(steps)) >= -1e-9)


def test_a_table_does_not_depend_on_the_one_before():
    worth = np.ones(COUNT)
    first = best_nodes(limit_of(0), worth, "decreasing", 5, 1.0)
    for seed in (3, 6):
        best_nodes(limit_of(seed), worth, "decreasing", 5, 1.0)
    assert best_nodes(limit_of(0), worth, "decreasing", 5, 1.0) == first


@pytest.mark.parametrize(("limit", "worth", "why"), [(np.nan, 1, "refused"), (-np.inf, 1, "refused"), (1, -1, "unb")])
def test_no_nodes_are_said_so(limit, worth, why):
    limits = limit_of(0)
    limits[7] = limit
    with pytest.raises(RequirementError, match=why):
        best_nodes(limits, np.full(COUNT, float(worth)), "decreasing", 5, 1.0)


def margins(shift):
    """Return the margins of a table that touches its ceiling at code 70, or misses it by a shift that no double has."""
    nodes, unit = [3, 2, 2], Fraction(1, 3 * STEP_CODES)
    values = [Fraction(int(value)) * unit + Fraction(1, 10**4) for value in between_nodes(nodes, 100)]
    values[70] += shift - Fraction(1, 10**4)
    row = ExactRow(tuple(each.numerator for each in values), tuple(each.denominator for each in values))
    return TableMargins(limit=row, nodes=nodes, unit=unit)


@pytest.mark.parametrize(("sign", "exceeded"), [(0, []), (1, []), (-1, [70])])
def test_what_doubles_cannot_tell_is_told_exactly(sign, exceeded):
    shift = Fraction(sign, 10**30)
    found = margins(shift)
    assert found.doubles[70] == pytest.approx(0, abs=1e-15)
    assert found.exceeded() == exceeded
    assert found.least(np.arange(100)) == shift == found.at(70)
    assert found.least(np.arange(60)) == Fraction(1, 10**4)
