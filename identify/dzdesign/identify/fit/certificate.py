"""The certified offset: the largest that no threshold contradicts which the data and the premise allow.

    maximise  o(p)   over multipliers l >= 0   with   o = r'l,   A'l = e(p),

where the rows A g >= r are what is known of the next closing's threshold g on the grid: its class, and the data set.
Any such l proves o on its own: o = l'r <= l'A g = g(p) for every g that meets the rows. So the multipliers stand
beside the offset, and a reader needs no solver to check it. Its dual, the least g(p) of all, is what a test states in
cvxpy.

The data set: weighted sums of the ramps' thresholds bound the same sums of the next closing, all at once. The largest
of their errors has a distribution that is simulated once, with a fixed seed; the error of the scatter itself,
independent of it, is integrated.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fit.curve_class import CurveClass, Kind, one_way
from dzdesign.identify.fit.ramp_model import broken_line
from dzdesign.identify.fit.scatter import Scatter

#: Shares of the error probability, 1 % by default, of the roofs, and what is kept for the rule of the bends. The floors
#: have the rest: all of it where only the tests themselves are certified.
ROOFS, OF_BENDS = 0.05, 0.2
DRAWS, SEED = 40_000, 20240
#: Neighbouring draws that count as one where the scatter's error is integrated.
TOGETHER = 8
#: Largest error of a proof, V per V by which thresholds differ: it is taken off the offset; multipliers that are
#: rounding; and the slack, mV, below which a row may hold with equality.
PROOF, SMALLEST, SLACK = 1e-6, 1e-9, 1e-5
#: Times the rows that the multipliers are solved for in at most.
ROUNDS = 100
#: Solvers, tried in turn: tight tolerances may leave the first in numerical difficulties, and loose ones name rows that
#: miss a proof. Whichever answers, its multipliers are solved for once more and prove themselves, so that a poor answer
#: costs an offset and no safety.
SOLVERS: tuple[tuple[str, dict[str, float]], ...] = (
    ("highs-ds", {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}),
    ("highs-ipm", {}),
    ("highs-ds", {}),
)
#: What a number of the file, which has seven decimals, may be off by, V.
ROUNDING_V = 1.5e-7
#: Above the tests: the first node over the last pressure drop, each over the one before, the last one.
FIRST_STEP, STEP, FURTHEST = 1.05, 1.1, 16.0
#: Times the last pressure drop at which the chord above the tests is chosen, and a line through all ramps is bounded.
CHOSEN_AT = 2.0


class NoCurveAgreesError(InputError):
    """No threshold of a class agrees with the data."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DataSet:
    """What is known of the next closing g of a valve in one state: floor <= weights y-like sums of g <= roof (J,)."""

    #: Place in the series, -1/2 or 1/2 where there is a drift, else 0.
    state: float
    #: Sums of g on the grid (J, N).
    rows: np.ndarray
    #: V; those of the knots come first.
    floor: np.ndarray
    roof: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """The offsets of one state and direction, V (N,), with the rows of each that matter and their multipliers."""

    state: float
    direction: int
    offsets: np.ndarray
    rows: tuple[np.ndarray, ...]
    multipliers: tuple[np.ndarray, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Criticals:
    """Standard deviations between the sums and their floors and roofs; those of a knot that scatters unlike apart."""

    floor: float
    #: None where nothing between the tests is certified.
    roof: float | None
    floor_unlike: float | None = None
    roof_unlike: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """The certified bound of a branch's next closing on the grid (N,), chords between."""

    curves: CurveClass
    data: tuple[DataSet, ...]
    #: V.
    bound: np.ndarray
    criticals: Criticals
    #: One for each state of the valve and each direction of the class that the data allow.
    proofs: tuple[Proof, ...]


def certify(scatter: Scatter, curves: CurveClass, *, confidence: float = 0.99) -> Certificate:
    """Certify the next closing (or opening) of a branch.

    Raises
    ------
    NoCurveAgreesError
        If no threshold of the class agrees with the data.
    """
    criticals = find_criticals(scatter, curves.kind, 1 - confidence)
    data = data_sets(scatter, curves.grid_MPa, criticals)
    bound, proofs = np.full(curves.grid_MPa.size, np.inf), list[Proof]()
    refused: NoCurveAgreesError | None = None
    for each in one_way(curves):
        for known in data:
            try:
                proof = largest_offsets(each, known)
            except NoCurveAgreesError as error:  # of a direction that is not known, the data may contradict one
                refused = error
                continue
            bound = np.minimum(bound, each.under_chords(proof.offsets))
            proofs.append(proof)
    if refused is not None and not proofs:
        raise refused
    return Certificate(curves=curves, data=data, bound=bound, criticals=criticals, proofs=tuple(proofs))


def largest_offsets(curves: CurveClass, data: DataSet, sums: np.ndarray | None = None) -> Proof:
    """Return the largest safe offset at every grid point, or the least of other sums of g, and what proves it.

    Parameters
    ----------
    curves, data
        What is known of g on the grid (N,).
    sums
        Weights (T, N) of the sums; e(p) of each grid point where none are given.

    Raises
    ------
    NoCurveAgreesError
        If no threshold of the class agrees with the data.
    """
    from scipy.optimize import linprog
    from scipy.sparse import csr_array, eye_array, kron

    left, right, _ = _from_common_zero(curves, data)
    sums = np.eye(curves.grid_MPa.size) if sums is None else sums
    count = len(sums)
    # The programmes of all points at once: the solver is called once in place of thirty times.
    every = kron(eye_array(count), csr_array(left.T), format="csr")
    for method, options in SOLVERS:
        solved = linprog(-np.tile(right, count), A_eq=every, b_eq=sums.ravel(), method=method, options=options)
        if solved.status == 0:
            break
    else:
        raise NoCurveAgreesError(
            "the thresholds of the ramps agree with no curve of the premise; declare another --curve, or record more "
            "ramps"
        )
    # Rows that hold with equality, or that the solver used.
    slack, used = (each.reshape(count, -1) for each in (np.abs(solved.lower.marginals), solved.x))
    return prove(curves, data, [np.flatnonzero(row) for row in (used > SMALLEST) | (slack < SLACK)], sums)


def prove(
    curves: CurveClass, data: DataSet, rows: Sequence[np.ndarray], sums: np.ndarray | None = None
) -> Proof:
    """Return the offset that some rows of what is known prove at each grid point, with exact multipliers.

    They are those of `known_rows`; other sums (T, N) of g than its values are proved alike.

    Raises
    ------
    InputError
        If the rows prove nothing.
    """
    from scipy.optimize import nnls

    left, _, _ = _from_common_zero(curves, data)
    kept, multipliers = [], []
    sums = np.eye(len(rows)) if sums is None else sums
    for point, of_point in zip(sums, rows, strict=True):
        found = np.zeros(of_point.size)
        if of_point.size:
            with suppress(RuntimeError):  # of many equal rows it may go round: then they prove nothing, which is said
                found = nnls(left[of_point].T, point, maxiter=ROUNDS * of_point.size)[0]
        used = found > SMALLEST  # else the rows that are named would follow from rounding
        kept.append(of_point[used])
        multipliers.append(found[used])
    return Proof(
        state=data.state, direction=curves.direction, offsets=proved_offsets(curves, data, kept, multipliers, sums),
        rows=tuple(kept), multipliers=tuple(multipliers),
    )  # fmt: skip


def proved_offsets(
    curves: CurveClass, data: DataSet, rows: Sequence[np.ndarray], multipliers: Sequence[np.ndarray],
    sums: np.ndarray | None = None,
) -> np.ndarray:
    """Return the offset that multipliers of some rows prove at each grid point, V: additions, and no solver.

    What A'l lacks of e(p), of rounding, counts with what thresholds differ by.

    Raises
    ------
    InputError
        If a multiplier is below zero, or they prove nothing.
    """
    left, right, base = _from_common_zero(curves, data)
    # No threshold of the class lies further from the common zero than this.
    highest = data.roof if np.isfinite(data.roof).all() else data.floor
    largest = 2 * float(highest.max() - data.floor.min())
    sums = np.eye(len(rows)) if sums is None else sums
    offsets = np.empty(len(rows))
    for at, (point, of_point, found) in enumerate(zip(sums, rows, multipliers, strict=True)):
        left_over = float(np.sum(np.abs(found @ left[of_point] - point)))
        if not left_over <= PROOF or np.any(found < 0):
            raise InputError(f"the multipliers of a certified bound miss their proof by {left_over:.1g}")
        offsets[at] = base * point.sum() + float(right[of_point] @ found) / 1e3 - left_over * largest
    return offsets


def _from_common_zero(curves: CurveClass, data: DataSet) -> tuple[np.ndarray, np.ndarray, float]:
    """Return `known_rows` with the right sides in mV from a common zero, and that, V.

    So all numbers of the programme are of one size. Rows that sum to nothing keep theirs.
    """
    left, right = known_rows(curves, data)
    base = float(data.floor.max())
    return left, 1e3 * (right - base * left.sum(axis=1)), base


def known_rows(curves: CurveClass, data: DataSet) -> tuple[np.ndarray, np.ndarray]:
    """Return all that is known as A g >= r: (R, N), (R,). In this order: class from below, above; floors; roofs."""
    a, low, high = curves.rows()
    parts = ((a, low), (-a, -high), (data.rows, data.floor), (-data.rows, -data.roof))
    kept = [(rows[np.isfinite(right)], right[np.isfinite(right)]) for rows, right in parts]
    return np.vstack([rows for rows, _ in kept]), np.concatenate([right for _, right in kept])


def running_minimum(bound: np.ndarray, direction: int) -> np.ndarray:
    """Return the law's offset: the largest under the bound that runs one way; 0: that is the same everywhere.

    Of ``maximise sum(o), o <= bound, o[k + 1] <= o[k]`` it is the optimum: each o is some bound's, at this point or
    before, and that one's multipliers prove it.
    """
    if direction == 0:
        return np.full_like(bound, bound.min())
    found = np.minimum.accumulate(bound if direction < 0 else bound[::-1])
    return found if direction < 0 else found[::-1]


# ------------------------------------------------------------------------------------------------------- the data set
def contrasts(scatter: Scatter, state: float) -> np.ndarray:
    """Return weights (J, n) of the ramps, each with the sum 1, in a valve of that state.

    Knots first; then averages of three neighbours and a straight line at both ends, the middle and above the tests,
    which bound curves that bend little more sharply. Where a knot scatters unlike the others they would mix two
    variances, and stay out.
    """
    model = scatter.model
    count, dp = model.knots_MPa.size, model.ramps.dp_MPa
    rows = [model.at_knots(state)]
    if count == 1 or scatter.unlike is not None:
        return rows[0]
    rows += [rows[0][at - 1 : at + 2].mean(axis=0, keepdims=True) for at in range(1, count - 1)]
    rows.append(line_at(scatter, np.array([dp.min(), dp.mean(), dp.max(), CHOSEN_AT * dp.max()]), state))
    every = np.vstack(rows)
    # Of two tests the line's ends are the tests themselves: which of two equal rows proves a bound is no one's choice.
    new = [not np.any(np.all(np.abs(every[:row] - every[row]) < SMALLEST, axis=1)) for row in range(len(every))]
    return every[new]


def line_at(scatter: Scatter, dp_MPa: np.ndarray, state: float) -> np.ndarray:
    """Return the weights (T, n) of the ramps in a straight line through all of them, at pressure drops (T,)."""
    model = scatter.model
    line = model.weigh(model.with_clock(np.column_stack([np.ones(model.ramps.y.size), model.ramps.dp_MPa])))
    at: np.ndarray = np.column_stack([np.ones(dp_MPa.size), dp_MPa]) @ line[:2]
    return at + state * line[2] if model.drift else at


def states_of(scatter: Scatter) -> tuple[float, ...]:
    """Return the states that the series has seen: both ends of a drift."""
    return (-0.5, 0.5) if scatter.model.drift else (0.0,)


def find_criticals(scatter: Scatter, kind: Kind, error: float) -> Criticals:
    """Return the critical values of all sums in all states; of two scatters each has half of the error probability."""
    alone, unlike = kind == "points", scatter.unlike
    # Of tests alone the sums that mix them would only cost.
    weights = [contrasts(scatter, state)[: scatter.model.knots_MPa.size if alone else None]
               for state in states_of(scatter)]  # fmt: skip
    floors = 1.0 if alone else 1 - ROOFS - (OF_BENDS if kind == "bends" else 0.0)
    parts = 1 if unlike is None else 2

    def value(rows: np.ndarray, degrees: float, share: float, of_error: float) -> float:
        return critical(rows, degrees, share, of_error * error / parts)

    every = np.vstack(weights) * np.sqrt(scatter.of_ramps / scatter.variance)
    floor = value(every, scatter.degrees, scatter.share, floors)
    roof = None if alone else value(every, scatter.degrees, scatter.share, ROOFS)
    if unlike is None:
        return Criticals(floor=floor, roof=roof)
    of_ramps = np.sqrt(scatter.of_ramps / max(unlike.variance, scatter.variance))
    rows = np.vstack([each[unlike.knot] for each in weights]) * of_ramps
    return Criticals(
        floor=floor,
        roof=roof,
        floor_unlike=value(rows, unlike.degrees, 1.0, floors),
        roof_unlike=None if alone else value(rows, unlike.degrees, 1.0, ROOFS),
    )


def data_sets(scatter: Scatter, grid_MPa: np.ndarray, criticals: Criticals) -> tuple[DataSet, ...]:
    """Return what is known of the next closing in each state of the valve."""
    unlike, ramps = scatter.unlike, scatter.model.ramps
    at = broken_line(ramps.dp_MPa, grid_MPa)
    found = []
    for state in states_of(scatter):
        each = contrasts(scatter, state)
        if criticals.roof is None:  # tests alone
            each = each[: scatter.model.knots_MPa.size]
        next_one = np.full(len(each), scatter.share * scatter.variance)
        low, high = np.full(len(each), criticals.floor), np.full(len(each), criticals.roof or 0.0)
        if unlike is not None:
            next_one[unlike.knot] = max(unlike.variance, scatter.variance)
            low[unlike.knot], high[unlike.knot] = criticals.floor_unlike or 0.0, criticals.roof_unlike or 0.0
        sd = np.sqrt(next_one + each**2 @ scatter.of_ramps)
        middle = each @ ramps.y
        wide = np.abs(each) @ ramps.budgets + ramps.shared
        roof = np.full(len(each), np.inf) if criticals.roof is None else middle + high * sd + wide
        found.append(DataSet(state=state, rows=each @ at, floor=middle - low * sd - wide, roof=roof))
    return tuple(found)


#: Fewest standard deviations that are looked for.
LEAST_CRITICAL = 1e-3


def critical(weights: np.ndarray, degrees: float, share: float, tail: float) -> float:
    """Return the standard deviations that the largest error of these sums exceeds with that probability.

    The weights are of ramps whose variance is 1. One next closing, with `share` of that, is common to all sums.
    """
    rounded = weights.round(9) + 0.0
    in_order = np.ascontiguousarray(rounded[:, np.lexsort(rounded)])  # whatever order the ramps came in
    return _critical(in_order.tobytes(), weights.shape, float(degrees), round(share, 2), tail)


@lru_cache(maxsize=64)
def _critical(weights: bytes, shape: tuple[int, int], degrees: float, share: float, tail: float) -> float:
    from scipy.optimize import brentq
    from scipy.special import chdtr

    largest = _largest_errors(weights, shape, share)
    if not np.isfinite(degrees):
        return float(np.quantile(largest, 1 - tail))
    largest = np.maximum(np.sort(largest).reshape(-1, TOGETHER).mean(axis=1), 0.0)

    def beyond(deviations: float) -> float:
        return float(np.mean(chdtr(degrees, degrees * (largest / deviations) ** 2)) - tail)

    # At a low confidence less than one standard deviation is enough; at the lowest none is.
    return LEAST_CRITICAL if beyond(LEAST_CRITICAL) <= 0 else float(brentq(beyond, LEAST_CRITICAL, 1e4, xtol=1e-4))


@lru_cache(maxsize=8)
def _largest_errors(weights: bytes, shape: tuple[int, int], share: float) -> np.ndarray:
    """Return the largest error of each draw, in its standard deviations; of all sums the ramps and the next closing."""
    rows, (of_ramps, of_next) = np.frombuffer(weights).reshape(shape), _draws(shape[1])
    errors = of_ramps @ rows.T - np.sqrt(share) * of_next
    largest: np.ndarray = (errors / np.sqrt(share + np.sum(rows**2, axis=1))).max(axis=1)
    return largest


@lru_cache(maxsize=4)
def _draws(ramps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors of so many ramps and of the next closing in all draws, in their standard deviations."""
    rng = np.random.default_rng(SEED)
    return rng.standard_normal((DRAWS, ramps)), rng.standard_normal((DRAWS, 1))


# --------------------------------------------------------------------------------------------------- above the tests
@dataclass(frozen=True, slots=True, kw_only=True)
class AboveBound:
    """The class continued above the last test: nodes, MPa, and the bound there, V, chords between."""

    dp_MPa: np.ndarray
    bound: np.ndarray
    #: False of a threshold that is only known to run one way, and may fall: then it is a guess.
    certified: bool = True


def continue_above(scatter: Scatter, certificate: Certificate) -> AboveBound | None:
    """Continue the bound above the last test; None where nothing is known between the tests either.

    A threshold that rises, as far as is known, stays; one that may fall goes on with the steepest slope between two
    tests, and nothing is certified. A line goes on; a curve that bends by at most M lies at most M/2 (x - a)(x - b)
    below the chord of two tests a < b, b the last. Of all tests a that one is taken which leaves the largest bound.
    """
    curves, model = certificate.curves, scatter.model
    knots = model.knots_MPa
    last = float(curves.grid_MPa[-1])
    if curves.kind == "points":
        return None
    steps = [1.0, FIRST_STEP]
    while steps[-1] * STEP < FURTHEST:
        steps.append(steps[-1] * STEP)
    nodes = np.round(last * np.array(steps), 7)
    if curves.kind == "monotone":
        rises = curves.direction > 0
        slope = 0.0 if rises else min(float(np.min(np.diff(model.at_knots() @ model.ramps.y) / np.diff(knots))), 0.0)
        return AboveBound(
            dp_MPa=nodes, bound=certificate.bound[-1] + slope * (nodes - last), certified=rises
        )
    # A line is the same, whichever tests it is taken from.
    starts = range(1 if curves.kind == "line" else knots.size - 1)
    chosen = max(starts, key=lambda start: float(_least_above(certificate, knots, start, CHOSEN_AT * nodes[:1])[0]))
    bound = _least_above(certificate, knots, chosen, nodes)
    # It is concave, so chords between the nodes lie below it; and it never says more than the last test's own bound.
    return AboveBound(dp_MPa=nodes, bound=np.minimum.accumulate(np.minimum(bound, certificate.bound[-1])))


def _least_above(certificate: Certificate, knots_MPa: np.ndarray, start: int, dp_MPa: np.ndarray) -> np.ndarray:
    """Return the least threshold, V, at pressure drops (T,) above the tests, on the chord of a knot and the last one.

    The class and the data bound both ends and their difference: it is one more sum in the programme of the tests.
    """
    curves = certificate.curves
    grid = curves.grid_MPa
    at = int(np.abs(grid[:-1] - knots_MPa[start]).argmin())
    beyond = ((dp_MPa - grid[-1]) / (grid[-1] - grid[at]))[:, None]
    chord = (1 + beyond) * np.eye(grid.size)[-1] - beyond * np.eye(grid.size)[at]
    least: np.ndarray = np.full(dp_MPa.size, np.inf)
    for each in one_way(curves):
        for known in certificate.data:
            with suppress(NoCurveAgreesError):  # as in `certify`, which has refused what no direction allows
                least = np.minimum(least, largest_offsets(each, known, chord).offsets)
    # Between two tests and beyond them it bends no more than in the outermost interval and those that count.
    least -= _bend_above(curves, knots_MPa, start) / 2 * (dp_MPa - grid[-1]) * (dp_MPa - grid[at])
    return least


def _bend_above(curves: CurveClass, knots_MPa: np.ndarray, start: int) -> float:
    """Return M from a knot on, V/MPa².

    An estimated one is the largest of the intervals from there to the last test: in one that is H wide 4 c / H for a
    change c of the chords' slopes beside it, of either sign. So a kink of c just before the last test and another one
    just above it, together 2 c (x - b), lie within M/2 (x - a)(x - b).
    """
    if curves.change is None:
        return float(curves.density.max())
    changes, gaps = np.pad(curves.change.max(axis=0), 1), np.diff(knots_MPa)
    found = 4 * np.maximum(changes[:-1], changes[1:]) / gaps
    return float(found[start:].max())
