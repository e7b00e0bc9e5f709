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

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fit.curve_class import CurveClass, one_way, scatter_of_ramps
from dzdesign.identify.fit.ramp_model import broken_line
from dzdesign.identify.fit.scatter import Scatter

#: Shares of the error probability, 1 % by default: of the floors, the roofs and the bound above the tests. The rest,
#: 20 %, is kept for the rule of the bends.
FLOORS, ROOFS, ABOVE = 0.70, 0.05, 0.05
DRAWS, SEED = 40_000, 20240
#: Neighbouring draws that count as one where the scatter's error is integrated.
TOGETHER = 8
#: Largest error of a proof, V per V by which thresholds differ: it is taken off the offset; multipliers that are
#: rounding; and the slack, mV, below which a row may hold with equality.
PROOF, SMALLEST, SLACK = 1e-6, 1e-9, 1e-5
#: Solvers, tried in turn: tight tolerances may leave the first in numerical difficulties. Whichever answers, its
#: multipliers are solved for once more and prove themselves, so that a poor answer costs an offset and no safety.
SOLVERS: tuple[tuple[str, dict[str, float]], ...] = (
    ("highs-ds", {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}),
    ("highs-ds", {}),
    ("highs-ipm", {}),
)
#: What a number of the file, which has seven decimals, may be off by, V.
ROUNDING_V = 1.5e-7
#: Above the tests: the first node over the last pressure drop, each over the one before, the last one.
FIRST_STEP, STEP, FURTHEST = 1.05, 1.1, 16.0
#: Times the last pressure drop at which the test that gives the slope is chosen.
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
    """Multipliers of one offset: rows that they belong to, the values, and which state and direction the rows have."""

    state: float
    direction: int
    rows: np.ndarray
    multipliers: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """The certified bound of a branch's next closing on the grid (N,), chords between."""

    curves: CurveClass
    data: tuple[DataSet, ...]
    #: V.
    bound: np.ndarray
    #: Standard deviations between the sums and their floors, and where a knot scatters unlike the others, there.
    critical: float
    critical_unlike: float | None
    #: One for each grid point.
    proofs: tuple[Proof, ...]


def certify(
    scatter: Scatter, curves: CurveClass, *, confidence: float = 0.99, unknown_drift: float = 0.0
) -> Certificate:
    """Certify the next closing (or opening) of a branch.

    `unknown_drift` is the largest drift over the series, V, that the order of the ramps can't tell.

    Raises
    ------
    NoCurveAgreesError
        If no threshold of the class agrees with the data.
    """
    data, critical, critical_unlike = data_sets(scatter, curves.grid_MPa, 1 - confidence, unknown_drift)
    bound = np.full(curves.grid_MPa.size, np.inf)
    proofs: list[Proof | None] = [None] * bound.size
    refused: NoCurveAgreesError | None = None
    for each in one_way(curves):
        for known in data:
            try:
                offsets, multipliers = largest_offsets(each, known)
            except NoCurveAgreesError as error:  # of a direction that is not known, the data may contradict one
                refused = error
                continue
            lower = each.under_chords(offsets)
            for at in map(int, np.flatnonzero(lower < bound)):
                bound[at] = lower[at]
                # Of a direction alone the chord's lower end is what counts, with its proof.
                source = at if np.isfinite(each.density).all() else _lowest_end(each, offsets, at)
                rows = np.flatnonzero(multipliers[source])
                proofs[at] = Proof(state=known.state, direction=each.direction, rows=rows,
                                   multipliers=multipliers[source][rows])  # fmt: skip
    if not np.isfinite(bound).all() and refused is not None:
        raise refused
    return Certificate(
        curves=curves,
        data=data,
        bound=bound,
        critical=critical,
        critical_unlike=critical_unlike,
        proofs=tuple(proof for proof in proofs if proof is not None),
    )


def largest_offsets(curves: CurveClass, data: DataSet) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest safe offset at every grid point, V (N,), and the multipliers (N, R) that prove it.

    Their rows are those of `known_rows`. A multiplier's error is made good: what A'l lacks of e(p) counts with the
    largest threshold that there may be.
    """
    from scipy.optimize import linprog
    from scipy.sparse import csr_array, eye_array, kron

    left, right = known_rows(curves, data)
    count, base = curves.grid_MPa.size, float(data.floor.max())
    # mV from a common zero, so that all numbers of the programme are of one size. Rows that sum to nothing keep theirs.
    right = 1e3 * (right - base * left.sum(axis=1))
    # The programmes of all points at once: the solver is called once in place of thirty times.
    every = kron(eye_array(count), csr_array(left.T), format="csr")
    points = np.eye(count)
    for method, options in SOLVERS:
        solved = linprog(-np.tile(right, count), A_eq=every, b_eq=points.ravel(), method=method, options=options)
        if solved.status == 0:
            break
    else:
        raise NoCurveAgreesError(
            "the thresholds of the ramps agree with no curve of the premise; declare another --curve, or record more "
            "ramps"
        )
    # No threshold of the class lies further from the common zero than this.
    largest = 2 * float(data.roof.max() - data.floor.min())
    offsets, multipliers = np.empty(count), np.maximum(solved.x, 0.0).reshape(count, -1)
    slack = np.abs(solved.lower.marginals).reshape(count, -1)
    for at, point in enumerate(points):
        multipliers[at] = _exact(left, point, (multipliers[at] > SMALLEST) | (slack[at] < SLACK))
        left_over = float(np.sum(np.abs(left.T @ multipliers[at] - point)))
        if left_over > PROOF:
            raise InputError(f"the certificate's multipliers miss their proof by {left_over:.1g}; record more ramps")
        offsets[at] = base + float(right @ multipliers[at]) / 1e3 - left_over * largest
    return offsets, multipliers


def _exact(left: np.ndarray, point: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Return multipliers whose proof is exact to double precision, of the rows that hold with equality alone."""
    from scipy.optimize import nnls

    found = np.zeros(used.size)
    found[used] = nnls(left[used].T, point)[0]
    return found


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


def _lowest_end(curves: CurveClass, offsets: np.ndarray, at: int) -> int:
    other = min(at + 1, offsets.size - 1) if curves.direction < 0 else max(at - 1, 0)
    return at if offsets[at] <= offsets[other] else other


# ------------------------------------------------------------------------------------------------------- the data set
def contrasts(scatter: Scatter, state: float) -> np.ndarray:
    """Return weights (J, n) of the ramps, each with the sum 1, in a valve of that state.

    Knots first; then averages of three neighbours and a straight line at both ends and the middle, which bound curves
    that bend little more sharply. Where a knot scatters unlike the others they would mix two variances, and stay out.
    """
    model = scatter.model
    count, dp = model.knots_MPa.size, model.ramps.dp_MPa
    rows = [model.weights[:count] + (state * model.weights[count] if model.drift else 0.0)]
    if count == 1 or scatter.unlike is not None:
        return rows[0]
    rows += [rows[0][at - 1 : at + 2].mean(axis=0, keepdims=True) for at in range(1, count - 1)]
    clock = [model.ramps.clock] if model.drift and model.ramps.clock is not None else []
    at = np.array([[1, each, *([state] * len(clock))] for each in (dp.min(), dp.mean(), dp.max())])
    rows.append(at @ np.linalg.pinv(np.column_stack([np.ones(dp.size), dp, *clock])))
    return np.vstack(rows)


def states_of(scatter: Scatter) -> tuple[float, ...]:
    """Return the states that the series has seen: both ends of a drift."""
    return (-0.5, 0.5) if scatter.model.drift else (0.0,)


def data_sets(
    scatter: Scatter, grid_MPa: np.ndarray, error: float, unknown_drift: float
) -> tuple[tuple[DataSet, ...], float, float | None]:
    """Return what is known in each state, the critical value, and that of a knot that scatters unlike the others."""
    states = states_of(scatter)
    weights = [contrasts(scatter, state) for state in states]
    every, unlike = np.vstack(weights), scatter.unlike
    tails = {"low": FLOORS * error, "high": ROOFS * error}
    own: dict[str, float] = {}
    if unlike is not None:  # two scatters, each with half of the tail
        tails = {name: tail / 2 for name, tail in tails.items()}
        rows = np.vstack([each[unlike.knot] for each in weights])
        own = {name: critical(rows, unlike.degrees, 1.0, tail) for name, tail in tails.items()}
    common = {name: critical(every, scatter.degrees, scatter.share, tail) for name, tail in tails.items()}
    ramps = scatter.model.ramps
    at = broken_line(ramps.dp_MPa, grid_MPa)
    clock = np.zeros(ramps.y.size) if ramps.clock is None else ramps.clock
    budget = np.zeros(ramps.y.size) if ramps.budget is None else ramps.budget
    unknown = 0.0 if scatter.model.drift else unknown_drift
    found = []
    for state, each in zip(states, weights, strict=True):
        next_one = np.full(len(each), scatter.share * scatter.variance)
        low, high = np.full(len(each), common["low"]), np.full(len(each), common["high"])
        if unlike is not None:
            next_one[unlike.knot] = max(unlike.variance, scatter.variance)
            low[unlike.knot], high[unlike.knot] = own["low"], own["high"]
        sd = np.sqrt(next_one + each**2 @ scatter_of_ramps(scatter))
        middle = each @ ramps.y
        wide = unknown * (0.5 + np.abs(each @ clock)) + np.abs(each) @ budget
        found.append(
            DataSet(state=state, rows=each @ at, floor=middle - low * sd - wide, roof=middle + high * sd + wide)
        )
    return tuple(found), common["low"], own.get("low")


def critical(weights: np.ndarray, degrees: float, share: float, tail: float) -> float:
    """Return the standard deviations that the largest error of these sums exceeds with that probability.

    One next closing, with `share` of a ramp's variance, is common to all of them.
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
    return float(brentq(lambda c: np.mean(chdtr(degrees, degrees * (largest / c) ** 2)) - tail, 1.0, 1e4, xtol=1e-4))


@lru_cache(maxsize=8)
def _largest_errors(weights: bytes, shape: tuple[int, int], share: float) -> np.ndarray:
    """Return the largest error of each draw, in its standard deviations; of all sums the ramps and the next closing."""
    rng, rows = np.random.default_rng(SEED), np.frombuffer(weights).reshape(shape)
    of_ramps, of_next = rng.standard_normal((DRAWS, shape[1])), rng.standard_normal((DRAWS, 1))
    errors = of_ramps @ rows.T - np.sqrt(share) * of_next
    largest: np.ndarray = (errors / np.sqrt(share + np.sum(rows**2, axis=1))).max(axis=1)
    return largest


# --------------------------------------------------------------------------------------------------- above the tests
@dataclass(frozen=True, slots=True, kw_only=True)
class AboveBound:
    """The class continued above the last test: nodes, MPa, and the bound there, V, chords between."""

    dp_MPa: np.ndarray
    bound: np.ndarray


def continue_above(
    scatter: Scatter,
    certificate: Certificate,
    *,
    confidence: float = 0.99,
    unknown_drift: float = 0.0,
) -> AboveBound | None:
    """Continue the bound above the last test; None where the class says nothing there: a direction that may fall.

    A line goes on; a curve that bends by at most M lies at most M/2 (x - a)(x - b) below the chord of two tests a < b,
    b the last. Of all tests that one gives the slope which leaves the largest bound, by their errors and M alone.
    """
    curves, model = certificate.curves, scatter.model
    knots = np.round(model.knots_MPa, 6)
    last = float(curves.grid_MPa[-1])
    if curves.kind == "points" or (curves.kind == "monotone" and curves.direction <= 0):
        return None
    steps = [1.0, FIRST_STEP]
    while steps[-1] * STEP < FURTHEST:
        steps.append(steps[-1] * STEP)
    nodes = np.round(last * np.array(steps), 6)
    if curves.kind == "monotone":
        return AboveBound(dp_MPa=nodes, bound=np.full(nodes.size, certificate.bound[-1]))
    bend = 2.0 * float(curves.density.max()) if curves.kind == "bends" else float(curves.density.max())
    found = []
    for start in range(knots.size - 1):
        band, value = _band_above(scatter, curves, start, nodes, confidence, unknown_drift)
        sag = bend / 2 * (nodes - last) * (nodes - knots[start])
        taken_off = float(np.interp(CHOSEN_AT * last, nodes, band + sag))
        found.append((taken_off, start, value - band - sag))
        if curves.kind == "line":
            break
    bound = min(found, key=lambda each: each[:2])[2]
    # It is concave, so chords between the nodes lie below it; and it never says more than the last test's own bound.
    return AboveBound(dp_MPa=nodes, bound=np.minimum.accumulate(np.minimum(bound, certificate.bound[-1])))


def _band_above(
    scatter: Scatter,
    curves: CurveClass,
    start: int,
    nodes: np.ndarray,
    confidence: float,
    unknown_drift: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return by what errors take off the threshold continued to the nodes, and that, V: the least of all states."""
    model = scatter.model
    ramps, count = model.ramps, model.knots_MPa.size
    clock = np.zeros(ramps.y.size) if ramps.clock is None else ramps.clock
    budget = np.zeros(ramps.y.size) if ramps.budget is None else ramps.budget
    share = ((nodes - nodes[0]) / (model.knots_MPa[-1] - model.knots_MPa[start]))[:, None]
    by_state = []
    for state in states_of(scatter):
        if curves.kind == "line":
            columns = [np.ones(ramps.y.size), ramps.dp_MPa, *([clock] if model.drift else [])]
            at = np.column_stack([np.ones(nodes.size), nodes, *([np.full(nodes.size, state)] if model.drift else [])])
            by_state.append(at @ np.linalg.pinv(np.column_stack(columns)))
            continue
        rows = model.weights[:count] + (state * model.weights[count] if model.drift else 0.0)
        by_state.append(rows[-1] + share * (rows[-1] - rows[start]))
    tail = ABOVE * (1 - confidence)
    degrees = min(scatter.degrees, scatter.unlike.degrees) if scatter.unlike else scatter.degrees
    factor = critical(np.vstack(by_state), degrees, scatter.share, tail)
    variances = scatter_of_ramps(scatter)
    unknown = 0.0 if model.drift else unknown_drift
    lows = [
        (
            factor * np.sqrt(scatter.share * variances.max() + each**2 @ variances)
            + unknown * (0.5 + np.abs(each @ clock)) + np.abs(each) @ budget,
            each @ ramps.y,
        )
        for each in by_state
    ]  # fmt: skip
    lowest = np.min([value - band for band, value in lows], axis=0)
    band = lows[0][1] - lowest
    return band, lows[0][1]
