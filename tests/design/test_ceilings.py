"""Ceilings by whole numbers are those of the curve itself, code by code; the table is as good as cvxpy's under them.

Doubles never decide what they can't, of a ceiling or of a margin.
"""

import random
from fractions import Fraction

import cvxpy
import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.design import ceiling as ceilings
from dzdesign.design import exact_row
from dzdesign.design.beta_table import STEP_CODES, TableMargins, best_nodes, between_nodes
from dzdesign.design.ceiling import OffsetAbove, OffsetCurve, certified_row, certified_V, offset_ceiling, offset_row
from dzdesign.design.exact_row import ExactRow, least_of
from dzdesign.design.machine import allowance_of
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.certified_bound import BoundPiece, CertifiedBound

SIGNALS = Signals()
CODES = SIGNALS.pair(1).largest_difference
#: Two numbers that are one double, and on either side of it others.
CLOSE = [Fraction(10**30 + step, 3 * 10**30) for step in (1, 0, 2, 1)]


def bound_of(nodes, values):
    steps = zip(nodes, nodes[1:], values, values[1:], strict=False)
    return CertifiedBound(pieces=tuple(BoundPiece(*each) for each in steps))


def curve_of(seed, *, above=True, hold=True, on_codes=False):
    """Return a curve under a bound that goes on above the tests; on request with corners on whole codes."""
    rng = random.Random(seed)
    step = SIGNALS.pair(1).dp_MPa(1) if on_codes else Fraction(1, 10**7)
    tests = sorted(rng.sample(range(round(Fraction(1, 2) / step), round(6 / step)), 4))
    nodes = [place * step for place in tests]
    lower = [Fraction(rng.randrange(40_000_000, 52_000_000), 10**7) for _ in nodes]
    certified = bound_of(nodes, lower)
    between = (nodes[0] + (nodes[-1] - nodes[0]) * share for share in (Fraction(1, 3), Fraction(4, 5)))
    places = sorted({*nodes, *between})
    offset = [certified.at(place) - Fraction(rng.randrange(1, 3_000_000), 10**7) for place in places]
    lowest = min(piece.least(piece.from_MPa, piece.to_MPa) for piece in certified.pieces)
    offset = [min(value, lowest) for value in offset]
    further = [nodes[-1] + Fraction(each) for each in (0, Fraction(1, 3), 2, 5, 9)]
    falls = [lower[-1] - Fraction(rng.randrange(0, 9_000_000) * number, 10**7) for number in range(5)]
    goes_on = bound_of(further, falls)
    return OffsetCurve(
        dp_MPa=tuple(places),
        offset_V=tuple(offset),
        certified=certified,
        hold_below_MPa=places[2] if hold else None,
        above=OffsetAbove.under(goes_on, offset[-1], certified=bool(seed % 2)) if above else None,
    )


@pytest.mark.parametrize("seed", range(6))
def test_a_row_is_the_curve_at_every_code(seed):
    curve = curve_of(seed, above=seed < 4, hold=seed % 3 > 0, on_codes=seed % 2 > 0)
    places = [*range(-6, CODES + 6, 7), *(round(SIGNALS.pair(1).dp_code(node)) for node in curve.dp_MPa)]
    certified, offset = (row(curve, SIGNALS.pair(1), -6, CODES + 6) for row in (certified_row, offset_row))
    assert len(certified) == CODES + 13
    for code in places:
        dp_MPa = SIGNALS.pair(1).dp_MPa(code)
        assert certified[code + 6] == certified_V(curve, dp_MPa), code
        assert offset[code + 6] == curve.at(dp_MPa), code


def test_corners_on_whole_codes_are_met():
    """Else the test above would say nothing of them."""
    assert any(SIGNALS.pair(1).dp_code(node).denominator == 1 for node in curve_of(1, on_codes=True).dp_MPa)


def test_a_curve_above_its_bound_is_refused_where_it_first_is():
    curve = curve_of(2)
    high = OffsetCurve(
        dp_MPa=curve.dp_MPa, offset_V=(*curve.offset_V[:-1], Fraction(6)), certified=curve.certified,
        hold_below_MPa=None,
    )  # fmt: skip
    refused = []
    for code in range(CODES):
        try:
            certified_V(high, SIGNALS.pair(1).dp_MPa(code))
        except RequirementError as error:
            refused.append(str(error))
            break
    with pytest.raises(RequirementError) as caught:
        offset_ceiling(high, Fraction(10), allowance_of(SIGNALS))
    assert [str(caught.value)] == refused


def test_the_least_of_windows_and_of_rows_is_exact():
    """Numbers that are one double are told apart; rising, falling, equal and written in unlike terms."""
    rng = random.Random(3)
    values = [rng.choice(CLOSE) + rng.choice((0, 0, 0, Fraction(1, 7))) for _ in range(200)]
    assert len({float(value) for value in values}) == 2
    scale = [rng.randrange(1, 5) for _ in values]
    row = ExactRow(
        tuple(value.numerator * by for value, by in zip(values, scale, strict=True)),
        tuple(value.denominator * by for value, by in zip(values, scale, strict=True)),
    )
    for width in (1, 2, 5):
        wanted = [min(values[at : at + width]) for at in range(len(values) - width + 1)]
        assert list(row.least_of_windows(width)) == wanted
    other = ExactRow(row.numerators[::-1], row.denominators[::-1])
    assert list(least_of([row, other])) == list(map(min, values, values[::-1]))
    assert row.least() == min(values)
    assert list(row.at_least(CLOSE[0])) == [max(value, CLOSE[0]) for value in values]
    factor, less = Fraction(-3, 7), Fraction(1, 9)
    assert list(row.line(factor, less)) == [value * factor - less for value in values]


def test_doubles_alone_would_be_wrong(monkeypatch):
    """The fault that the test above must see: equal doubles taken for equal numbers."""
    monkeypatch.setattr(exact_row.ExactRow, "_is_less", lambda *given: False)
    with pytest.raises(AssertionError):
        test_the_least_of_windows_and_of_rows_is_exact()


def test_a_corner_that_has_one_bound_alone_is_seen(monkeypatch):
    """The fault that the rows' test must see: a bound that jumps at a test has there the lower of both sides."""
    nodes = [SIGNALS.pair(1).dp_MPa(code) for code in (200, 400, 600)]
    pieces = (BoundPiece(nodes[0], nodes[1], Fraction(5), Fraction(5)),
              BoundPiece(nodes[1], nodes[2], Fraction(4), Fraction(4)))  # fmt: skip
    curve = OffsetCurve(
        dp_MPa=tuple(nodes), offset_V=(Fraction(4),) * 3, certified=CertifiedBound(pieces=pieces), hold_below_MPa=None
    )
    assert certified_row(curve, SIGNALS.pair(1), 400, 400)[0] == certified_V(curve, nodes[1]) == 4
    high = OffsetCurve(
        dp_MPa=tuple(nodes), offset_V=(Fraction(9, 2), Fraction(9, 2), Fraction(4)), certified=curve.certified,
        hold_below_MPa=None,
    )  # fmt: skip
    with pytest.raises(RequirementError):
        certified_row(high, SIGNALS.pair(1), 400, 400)
    bounds = ceilings._bounds
    monkeypatch.setattr(ceilings, "_bounds", lambda *given: list(bounds(*given))[:1])
    ceilings.KNOWN.clear()
    assert certified_row(high, SIGNALS.pair(1), 400, 400)[0] == Fraction(9, 2)
    ceilings.KNOWN.clear()


def test_doubles_are_the_nearest():
    row = ExactRow((1, 10**40 + 1, -7), (3, 3 * 10**40, 11))
    np.testing.assert_array_equal(row.doubles, [float(value) for value in row])


# ---- the table

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
