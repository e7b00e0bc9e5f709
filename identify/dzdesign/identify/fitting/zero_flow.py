"""The command at which a valve passes the flow that is allowed at zero: what is guarded where one is declared.

A worn edge leaks before it opens, and the first flow seen lies far below where it would matter. Of a flow that only
grows with the command, the mean over a stretch is at least the flow at its lower end. So a command is safe where the
mean over a stretch that begins there stays, at the confidence asked for, within the flow that is allowed; stretches of
several lengths are tried. The commands are tried from one far below the knee upwards, up to the first that fails: a
command above the true one is tried only as the first that may pass by mistake, so that trying many costs nothing.

The flow is the whole one: what was subtracted as a leak counts, with its error, and at a single pressure drop all that
was read at rest. What a meter's floor hides counts as the floor.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import L_MIN, Shown
from dzdesign.identify.fit.scatter import LEAST_DEGREES
from dzdesign.identify.knees.characteristic import FEWEST, SHUT_TO
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.knees.gated_line import GATE, BranchShape, straight_line
from dzdesign.identify.knees.line_fitting import DEGREES_OF_FREEDOM
from dzdesign.identify.knees.profile import crossing
from dzdesign.identify.options import IdentifyOptions

#: Lengths of the stretches over u_max, and by how much of the shortest each is moved on.
STRETCHES, STEP = (0.003, 0.01, 0.03, 0.06), 0.5
#: Length over u_max of the stretch about the crossing that tells the flow gain there.
ABOUT = 0.02
#: Ramps of a test that leak unlike are compared over this stretch below the crossing, over u_max.
COMPARED = 0.03


@dataclass(frozen=True, slots=True)
class _Readings:
    """Readings of one test's branch in the order of the command: V, m³/s, and the number of each one's ramp."""

    u: np.ndarray
    y: np.ndarray
    #: About their smoothed course, m³/s.
    residual: np.ndarray
    ramp: np.ndarray


def allowed_at_zero(group: DescribedTests, options: IdentifyOptions) -> tuple[float, ...] | None:
    """Return the flow at zero command that each test's bound answers for, a leak included, m³/s; None: not declared.

    It is the declared flow, or what the valve passes at rest and the noise level beyond it where that is more.
    """
    if options.zero_flow is None:
        return None
    return tuple(max(options.zero_flow, flow + group.noise_level) for flow in largest_at_rest(group, options))


def largest_at_rest(group: DescribedTests, options: IdentifyOptions) -> list[float]:
    """Return what the shut valve passes at most of the flow that was subtracted from each test, m³/s."""
    errors = student_errors(options, len(group.tests))
    return [flow + errors * error + options.meter_zero for flow, error in group.at_rest]


def refuse_a_large_zero_flow(group: DescribedTests, options: IdentifyOptions) -> None:
    """Refuse a flow at zero that lies on the straight part of the characteristic: it is not a leak but an opening."""
    if options.zero_flow is None:
        return
    least = min(group.tests, key=lambda item: item.q_max)
    if options.zero_flow >= options.knee_window[0] * least.q_max:
        raise InputError(
            f"a flow at zero of {Shown(options.zero_flow / L_MIN):.3g L/min} is declared, "
            f"{options.zero_flow / least.q_max:.0%} of the largest flow of '{least.test.source}', expected less than "
            f"{options.knee_window[0]:.0%}: above, the valve is open. Declare what the machine may leak at rest"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ZeroFlow:
    """Where each test passes the flow that is allowed at zero, V (T,): most likely, with its error, and for certain."""

    at: np.ndarray
    at_se: np.ndarray
    #: The highest command up to which the ramps certainly pass no more; -inf where there is none.
    safe: np.ndarray


def find_zero_flow(group: DescribedTests, column: int, options: IdentifyOptions) -> ZeroFlow | None:
    """Find where the valve passes the flow allowed at zero, as far as the data support it; None: not declared."""
    allowed = allowed_at_zero(group, options)
    if allowed is None:
        return None
    refuse_a_large_zero_flow(group, options)
    shapes = [item.branch(column) for item in group.tests]
    readings = [_readings(shape, group.floor) for shape in shapes]
    # What the flow in the readings may be: as estimated, and less what leak and zero error may be more for certain.
    rest = [flow for flow, _ in group.at_rest]
    crossings = [
        _crossing(shape, each, flow - at_rest, options.u_max)
        for shape, each, flow, at_rest in zip(shapes, readings, allowed, rest, strict=True)
    ]
    at, at_se = np.array(crossings).T
    scatter = _scatter(list(zip(shapes, readings, at.tolist(), strict=True)), options)
    errors = student_errors(options, len(STRETCHES) * len(shapes))
    safe = np.array([
        _highest_safe(
            shape, each, flow - at_rest - scatter, errors, se * math.sqrt(shape.variance_inflation), options.u_max
        )
        for shape, each, flow, at_rest, se in zip(
            shapes, readings, allowed, largest_at_rest(group, options), group.zero_se, strict=True
        )
    ])  # fmt: skip
    return ZeroFlow(at=at, at_se=at_se, safe=safe)


def student_errors(options: IdentifyOptions, count: int) -> float:
    """Return how many standard errors bound one of so many estimates, all together at the confidence."""
    from scipy.special import stdtrit

    return float(stdtrit(DEGREES_OF_FREEDOM, 1 - (1 - options.confidence) / count))


def _readings(shape: BranchShape, floor: float) -> _Readings:
    """Return the readings, outliers left out; those below the meter's floor count as the floor."""
    read = shape.prepared
    u, y = read.branch.u, read.y
    residual = y - np.interp(u, *read.profile)
    kept = np.abs(residual) <= GATE * max(shape.noise, shape.sigma)
    order = np.flatnonzero(kept)[np.argsort(u[kept], kind="stable")]
    seen = np.maximum(y[order], floor) if floor > 0 else y[order]
    return _Readings(u[order], seen, residual[order], read.branch.ramp_of_samples[order])


def _highest_safe(
    shape: BranchShape, readings: _Readings, most: float, errors: float, of_rest: float, u_max: float
) -> float:
    """Return the highest command up to which the flow certainly stays within `most`, m³/s; -inf where none does.

    `of_rest` is the standard error of what was subtracted, which all readings have in common.
    """
    u, sums, squares = readings.u, _sums(readings.y), _sums(readings.residual**2)
    start = SHUT_TO * shape.knee
    starts = np.arange(start, float(u[-1]), STEP * min(STRETCHES) * u_max)
    first = np.searchsorted(u, starts)
    passes = np.zeros(starts.size, dtype=bool)
    for share in STRETCHES:
        last = np.searchsorted(u, starts + share * u_max)
        count = np.maximum(last - first, 1)
        mean = (sums[last] - sums[first]) / count
        variance = np.maximum((squares[last] - squares[first]) / count, shape.noise**2)
        error = np.sqrt(variance * shape.variance_inflation / count + of_rest**2)
        passes |= (last - first >= FEWEST) & (mean + errors * error <= most)
    good = int(np.argmin(passes)) if not passes.all() else passes.size
    return float(starts[good - 1]) if good else -math.inf


def _sums(values: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(values)])


def _crossing(shape: BranchShape, readings: _Readings, flow: float, u_max: float) -> tuple[float, float]:
    """Return where the flow in the readings comes to `flow`, m³/s, and the standard error, V."""
    at = crossing(*shape.prepared.profile, flow)
    width = ABOUT * u_max
    for length in (width, 2 * width, 4 * width):
        rows = slice(*np.searchsorted(readings.u, [at - length / 2, at + length / 2]))
        u, y = readings.u[rows], readings.y[rows]
        if u.size < FEWEST or not np.ptp(u) > 0:
            continue
        slope, zero = straight_line(u, y)
        noise = max(shape.noise, float(np.std(readings.residual[rows])))
        error = noise * math.sqrt(shape.variance_inflation / u.size)
        # A slope that does not stand out tells nothing of where the flow crosses.
        if slope * length > 4 * error:
            place = float(np.clip(zero + flow / slope, at - length / 2, at + length / 2))
            return place, error / slope
    return at, 4 * width


def _scatter(tests: Sequence[tuple[BranchShape, _Readings, float]], options: IdentifyOptions) -> float:
    """Return what the flow of the next closing may exceed the ramps' mean by, m³/s, where ramps of a test leak unlike.

    Oil that warms up leaks more at the same command, which no shift of the command tells. Pooled over all tests.
    """
    from scipy.special import stdtrit

    squares, noise, degrees, fewest = 0.0, 0.0, 0, math.inf
    for shape, readings, at in tests:
        rows = (readings.u >= at - COMPARED * options.u_max) & (readings.u < at)
        count = np.bincount(readings.ramp[rows])
        told = count >= FEWEST
        if told.sum() < 2:
            continue
        means = np.bincount(readings.ramp[rows], weights=readings.y[rows])[told] / count[told]
        squares += float(np.sum((means - means.mean()) ** 2))
        variance = max(shape.noise**2, float(np.mean(readings.residual[rows] ** 2)))
        freedom = means.size - 1
        noise += freedom * variance * shape.variance_inflation * float(np.mean(1 / count[told]))
        degrees += freedom
        fewest = min(fewest, means.size)
    if degrees < LEAST_DEGREES or squares <= noise:
        return 0.0
    sd = math.sqrt((squares - noise) / degrees)
    return float(stdtrit(degrees, 1 - (1 - options.confidence) / len(tests))) * sd * math.sqrt(1 + 1 / fewest)
