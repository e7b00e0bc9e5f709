"""Hysteresis, linearity and gain of a curve that is known by few points: of valve.json, or of a simulated loop.

The formulas are those of `QUANTITIES`; nothing is known of the noise here, so there are no errors.
"""

from dataclasses import dataclass

import numpy as np

from dzdesign.assess.readings import CLEAR, FEWEST_LEVELS, WIDTH_LEVELS

#: Points over the window of linearity, and over a branch for its straight part.
POINTS = 81
#: Flows between which the gain is taken, over the largest: where `identify` looks for the straight part.
STRAIGHT = (0.12, 0.5)


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
    levels = [share * top for share in WIDTH_LEVELS if share * top >= lowest]
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
    weights = np.ones(POINTS)
    weights[[0, -1]] = np.sqrt(0.5)  # the ends stand for half a step each
    departure = np.abs(mean - np.polyval(np.polyfit(u, mean, 1, w=weights), u))
    return float(departure.max()) / rated


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
