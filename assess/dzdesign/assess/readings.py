"""The quantities of a valve test, read from the curves of one set of recordings at one pressure drop.

At the end stand hysteresis, linearity and gain of a `Line`, a curve that is known by few points, of valve.json or of a
simulated loop: nothing is known of its noise, so there are no errors.
"""

import math
from dataclasses import dataclass

import numpy as np

from dzdesign.assess.flow_curves import CELL, ZERO, FlowCurve, PressureCurves
from dzdesign.assess.quantities import Reading, hidden, in_units, observed
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.knees.gated_line import GATE, straight_line
from dzdesign.identify.knees.profile import crossing
from dzdesign.identify.ramps.branches import median
from dzdesign.identify.valve.reading_flow import ideal_line

#: Shares of the largest flow at which the branches' distance is taken, and the fewest of them.
WIDTH_LEVELS, FEWEST_LEVELS = np.arange(5, 91, 5) / 100, 3
#: A flow is above the meter's floor, or above what flows at zero command, from this multiple of it on.
CLEAR = 1.2
#: A mean flow stands out of its noise from so many standard errors on.
STANDS_OUT = 3.0
#: The standard error of a median over that of a mean; the course is one of five bins.
OF_MEDIAN, BINS = 1.25, 5
#: Cells on either side of a flow through which the line to it is laid.
NEAR = 3
#: Fewest cells of a curve in the window of its best straight line.
FEWEST_CELLS = 10
#: Of a curve known by few points: points over the window of linearity, and over a branch for its straight part.
POINTS = 81
#: Flows between which its gain is taken, over the largest: where `identify` looks for the straight part.
STRAIGHT = (0.12, 0.5)


def read_quantities(
    curves: PressureCurves, *, u_max: float, reading_flow: float, rated: float, window: tuple[float, float],
    units: RecordedUnits = AS_COMPUTED,
) -> dict[str, Reading]:  # fmt: skip
    """Read every quantity of one set at one pressure drop, in its unit; symmetry, which needs both sides, is missing.

    Dead zones are read at `reading_flow`, linearity is a share of the flow `rated` (m³/s); `window` is over u_max (V).
    Reasons are in `units`.
    """
    rising, falling = curves.rising, curves.falling
    si = {
        "dead_zone_opening": _dead_zone(rising, "rising", reading_flow, u_max, units),
        "dead_zone_closing": _dead_zone(falling, "falling", reading_flow, u_max, units),
        "ideal_line": observed(ideal_line(reading_flow, curves.q_max)),
        "onset_opening": _onset(rising, "rising", u_max, units),
        "onset_closing": _onset(falling, "falling", u_max, units),
        "knee_opening": _knee(rising, "rising", u_max),
        "knee_closing": _knee(falling, "falling", u_max),
        "hysteresis": _hysteresis(rising, falling, u_max, units),
        "linearity": _linearity(curves, rated, window, u_max, units),
        "gain": _gain(curves),
        "flow_at_zero": _flow_at_zero(curves, units),
        "largest_flow": observed(curves.q_max),
    }
    return in_units(si)


def _no_branch(direction: str) -> Reading:
    return hidden(f"there is no {direction} branch")


def _dead_zone(
    curve: FlowCurve | None, direction: str, level: float, u_max: float, units: RecordedUnits
) -> Reading:
    """Return where a branch passes the level."""
    if curve is None:
        return _no_branch(direction)
    floor, noise = curve.read.floor, _noise_of_course(curve)
    asked, shown = (units.text(flow / L_MIN, ".3g L/min") for flow in (level, floor))
    if level < floor:
        bound = _passing(curve, floor, noise, u_max, units)
        reason = f"the meter shows nothing below {shown}, and the reading flow is {asked}"
        return hidden(reason, at_most=_bound_of(bound))
    if level < STANDS_OUT * noise:
        bound = _passing(curve, STANDS_OUT * noise, noise, u_max, units)
        return hidden(
            f"the reading flow of {asked} does not stand out of the noise, of which "
            f"{units.text(noise / L_MIN, '.2g L/min')} are left in the averaged flow",
            at_most=_bound_of(bound),
        )
    return _passing(curve, level, noise, u_max, units)


def _onset(curve: FlowCurve | None, direction: str, u_max: float, units: RecordedUnits) -> Reading:
    """Return where a branch begins to flow, as far as the meter shows it: below its floor no onset is seen."""
    if curve is None:
        return _no_branch(direction)
    floor, noise = curve.read.floor, _noise_of_course(curve)
    seen = _passing(curve, max(floor, STANDS_OUT * noise), noise, u_max, units)
    if not floor:
        return seen
    return hidden(f"the meter shows nothing below {units.text(floor / L_MIN, '.3g L/min')}", at_most=_bound_of(seen))


def _bound_of(reading: Reading) -> float | None:
    return reading.value if reading.value is not None else reading.at_most


def _noise_of_course(curve: FlowCurve) -> float:
    """Return the standard error of the smoothed course where the flow is small, m³/s."""
    u, _ = curve.read.profile
    n = curve.read.branch.u.size / u.size * (BINS if u.size >= 200 else 1)
    return OF_MEDIAN * curve.sigma * math.sqrt(min(curve.variance_inflation, n) / max(n, 1.0))


def _passing(curve: FlowCurve, level: float, noise: float, u_max: float, units: RecordedUnits) -> Reading:
    """Return the command at which the smoothed course best parts into flows below and above the level."""
    u, q = curve.read.profile
    if level > curve.read.y_max:
        largest, asked = (units.text(flow / L_MIN, ".3g L/min") for flow in (curve.read.y_max, level))
        return hidden(f"the largest flow of {largest} lies below the level of {asked}")
    at = crossing(u, q, level)
    if at <= u[0]:
        if u[0] > ZERO * u_max:
            return hidden(
                f"the flow lies above the level from the first recorded command of {units.text(u[0], '.3g V')} on; "
                "record from zero",
                at_most=float(u[0]) / u_max,
            )
        return observed(0.0, note="the flow lies above the level at every command, at zero too")
    next_ = int(np.clip(np.searchsorted(u, at), 1, u.size - 1))
    step = float(u[next_] - u[next_ - 1])
    rise = max(crossing(u, q, 2 * level) - at, step)
    return observed(at / u_max, se=math.hypot(step / math.sqrt(12), noise / level * rise) / u_max)


def _knee(curve: FlowCurve | None, direction: str, u_max: float) -> Reading:
    """Return the zero of the straight part; a zero below the recorded commands is none of theirs."""
    if curve is None:
        return _no_branch(direction)
    if curve.line is None:
        return hidden(f"there is no straight part: {curve.no_line}")
    line, lowest = curve.line, float(curve.read.branch.u.min())
    if line.knee < lowest - STANDS_OUT * line.knee_se:
        return hidden(
            f"the straight part, extrapolated, ends at {line.knee / u_max:.2%} of command, below the lowest that was "
            f"recorded ({lowest / u_max:.2%})",
            at_most=max(lowest, 0.0) / u_max,
        )
    return observed(line.knee / u_max, se=line.knee_se / u_max)


def _hysteresis(
    rising: FlowCurve | None, falling: FlowCurve | None, u_max: float, units: RecordedUnits
) -> Reading:
    """Return the largest distance of the branches at equal flow."""
    if rising is None or falling is None:
        return _no_branch("rising" if rising is None else "falling")
    top = min(curve.read.y_max for curve in (rising, falling))
    # What a branch does not come down to has no command.
    lowest = max(CLEAR * max(curve.read.floor, float(curve.q[0])) for curve in (rising, falling))
    levels = _levels(top, lowest)
    if len(levels) < FEWEST_LEVELS:
        return hidden(
            f"only {len(levels)} of the levels from {WIDTH_LEVELS[0]:.0%} to {WIDTH_LEVELS[-1]:.0%} of the largest "
            f"flow lie above {units.text(lowest / L_MIN, '.3g L/min')}, where the meter starts or the flow at zero "
            "command ends"
        )
    found = [(_command_at(rising, level), _command_at(falling, level)) for level in levels]
    widths = [abs(up[0] - down[0]) for up, down in found]
    widest = int(np.argmax(widths))
    return observed(
        widths[widest] / u_max,
        se=math.hypot(found[widest][0][1], found[widest][1][1]) / u_max,
        where=f"at {levels[widest] / top:.0%} of the largest flow",
    )


def _levels(top: float, lowest: float) -> list[float]:
    """Return the flows at which the branches' distance is taken."""
    return [share * top for share in WIDTH_LEVELS if share * top >= lowest]


def _command_at(curve: FlowCurve, level: float) -> tuple[float, float]:
    """Return the command at which the averaged curve has a flow, and its standard error, V.

    A line through the nearest cells averages their noise, of which the largest of many widths would take the worst.
    """
    at = crossing(curve.u, curve.q, level)
    right = int(np.clip(np.searchsorted(curve.u, at), 1, curve.u.size - 1))
    step = float(curve.u[right] - curve.u[right - 1])
    near = slice(max(right - NEAR, 0), right + NEAR)
    if curve.u[near].size < 2 * NEAR or step > 2 * CELL * curve.u[-1]:
        return at, step
    slope, zero = straight_line(curve.u[near], curve.q[near])
    if not slope > 0:
        return at, step
    on_line = float(np.clip(zero + level / slope, at - step, at + step))
    error = float(np.sqrt(np.mean(curve.q_se[near] ** 2))) / math.sqrt(2 * NEAR) / slope
    return on_line, error if math.isfinite(error) else step


def _linearity(
    curves: PressureCurves, rated: float, window: tuple[float, float], u_max: float, units: RecordedUnits
) -> Reading:
    """Return the largest departure of the mean curve from its best straight line."""
    low, high = (share * u_max for share in window)
    for curve in curves.curves:
        if curve.u[0] > low + CELL * u_max or curve.u[-1] < high - CELL * u_max:
            return hidden(
                f"the recorded commands, {units.number(curve.u[0], '.2f V')} to {units.text(curve.u[-1], '.2f V')}, do "
                f"not cover the window of {units.number(low, '.3g V')} to {units.text(high, '.3g V')}"
            )
    # As many points as the branch with fewest cells has there: between levels of a staircase nothing is known.
    count = min(int(np.sum((curve.u >= low) & (curve.u <= high))) for curve in curves.curves)
    if count < FEWEST_CELLS:
        return hidden(f"only {count} levels of the command lie in the window, expected {FEWEST_CELLS} at least")
    u = np.linspace(low, high, count)
    mean = np.mean([np.interp(u, curve.u, curve.q) for curve in curves.curves], axis=0)
    errors = np.array([np.interp(u, curve.u, curve.q_se) for curve in curves.curves])
    departure = _departure(u, mean)
    widest = int(np.argmax(departure))
    error = float(np.sqrt(np.sum(errors[:, widest] ** 2))) / len(errors) / rated
    return observed(
        float(departure[widest]) / rated,
        se=error if math.isfinite(error) else None,
        note=_one_branch(curves, len(curves.curves)),
        where=f"at {u[widest] / u_max:.0%} of command",
    )


def _departure(u: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Return how far a curve lies off its best straight line, (N,)."""
    # The ends stand for half a step each: counted in full they pull the line to themselves.
    weights = np.ones(u.size)
    weights[[0, -1]] = math.sqrt(0.5)  # of the departure, not of its square
    return np.asarray(np.abs(mean - np.polyval(np.polyfit(u, mean, 1, w=weights), u)))


def _one_branch(curves: PressureCurves, used: int) -> str:
    """Say of a mean of both branches that it is of one, where it is."""
    if used == 2:
        return ""
    return "of one branch only: " + (
        "the other has no straight part" if len(curves.curves) == 2 else "the other was not recorded"
    )


def _gain(curves: PressureCurves) -> Reading:
    """Return the mean slope of the straight parts."""
    straight = [(curve.line, curve.read.branch.u) for curve in curves.curves if curve.line]
    if not straight:
        return hidden(f"there is no straight part: {curves.curves[0].no_line}")
    lines, errors = [line for line, _ in straight], []
    for line, u in straight:
        spread = float(np.var(u[line.kept & ~line.censored])) * int(np.sum(line.kept & ~line.censored))
        errors.append(line.sigma * math.sqrt(line.variance_inflation / spread))
    count = len(lines)
    return observed(
        sum(line.slope for line in lines) / count,
        se=math.sqrt(sum(error**2 for error in errors)) / count,
        note=_one_branch(curves, count),
    )


def _flow_at_zero(curves: PressureCurves, units: RecordedUnits) -> Reading:
    """Return the flow that is left at zero command."""
    flow = curves.at_zero
    if flow.size == 0:
        why = "no recording holds zero command after closing" if curves.falling else "there is no falling branch"
        return hidden(f"{why}; let the command stand at zero for some seconds at the end")
    middle = median(flow)
    away = np.abs(flow - middle)
    sigma = 1.4826 * median(away)
    kept = flow[away <= max(GATE * sigma, 1e-3 * curves.q_max)]
    value = float(kept.mean())
    floor = curves.curves[0].read.floor
    if abs(value) < floor:
        return hidden(f"the meter shows nothing below {units.text(floor / L_MIN, '.3g L/min')}", at_most=floor)
    spread = float(kept.std()) * math.sqrt(min(curves.variance_inflation, kept.size) / kept.size)
    return observed(value, se=spread)


@dataclass(frozen=True, slots=True)
class Line:
    """One branch: flow (N,) in L/min over command (N,) as a share of full command, rising."""

    u: np.ndarray
    q: np.ndarray

    def command_at(self, flow: float) -> float:
        """Return the lowest command at which it passes a flow; NaN where it never does."""
        reached = np.flatnonzero(self.q >= flow)
        if not reached.size:
            return float("nan")
        at = int(reached[0])
        return float(self.u[0] if at == 0 else np.interp(flow, self.q[at - 1 : at + 1], self.u[at - 1 : at + 1]))


def hysteresis_of(rising: Line, falling: Line, floor: float = 0.0) -> float | None:
    """Return the largest distance of the branches at equal flow, a share of full command; `floor` of the meter, L/min.

    None where too few flows are common to both.

    Examples
    --------
    >>> line = np.linspace(0.0, 1.0, 11)
    >>> round(hysteresis_of(Line(line + 0.02, line), Line(line, line)), 6)
    0.02
    """
    top = min(float(line.q.max()) for line in (rising, falling))
    lowest = max(CLEAR * max(floor, float(line.q[0])) for line in (rising, falling))
    levels = _levels(top, lowest)
    if len(levels) < FEWEST_LEVELS:
        return None
    return max(abs(rising.command_at(level) - falling.command_at(level)) for level in levels)


def linearity_of(lines: tuple[Line, ...], rated: float, window: tuple[float, float] = (0.1, 0.9)) -> float | None:
    """Return the largest departure of the mean curve from its best straight line, over the flow `rated` (L/min).

    None where a branch does not cover the window, shares of full command.

    Examples
    --------
    >>> line = np.linspace(0.0, 1.0, 11)
    >>> round(linearity_of((Line(line, 20 * line),), rated=20.0), 6)
    0.0
    """
    low, high = window
    if not lines or rated <= 0 or any(line.u[0] > low + 0.01 or line.u[-1] < high - 0.01 for line in lines):
        return None
    u = np.linspace(low, high, POINTS)
    mean = np.mean([np.interp(u, line.u, line.q) for line in lines], axis=0)
    return float(_departure(u, mean).max()) / rated


def gain_of(lines: tuple[Line, ...]) -> float | None:
    """Return the mean slope of the straight parts, L/min per full command; None where no branch has one.

    Examples
    --------
    >>> line = np.linspace(0.0, 1.0, 11)
    >>> round(gain_of((Line(line, 20 * line),)), 6)
    20.0
    """
    slopes = []
    for line in lines:
        low, high = (line.command_at(share * float(line.q.max())) for share in STRAIGHT)
        if high > low:
            u = np.linspace(low, high, POINTS)
            slopes.append(float(np.polyfit(u, np.interp(u, line.u, line.q), 1)[0]))
    return float(np.mean(slopes)) if slopes else None
