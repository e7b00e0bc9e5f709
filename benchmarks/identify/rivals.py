"""Ways to read a threshold that the product is set beside, each from one ramp test: opening and closing, V."""

import numpy as np
from bench_model import L_MIN

from dzdesign.identify.reading.ramp_test import RampTest


def branches_of(test: RampTest, lag_s: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return command (corrected for the lag) and flow in L/min of the rising and the falling half."""
    u = np.interp(test.time - lag_s, test.time, test.u)
    top = int(np.argmax(test.u))
    return [(u[part], test.q[part] / L_MIN) for part in (slice(0, top + 1), slice(top + 1, None))]


def first_flow_seen(u: np.ndarray, q: np.ndarray) -> float:
    """Return the lowest command at which the meter shows flow: the paper's way, as it reads."""
    return float(u[q > 0].min())


def straight_line(u: np.ndarray, q: np.ndarray) -> float:
    """Return the zero of the least-squares line through the readings from 10 to 90 % of the largest."""
    inside = (q > 0.1 * q.max()) & (q < 0.9 * q.max())
    slope, start = np.polyfit(u[inside], q[inside], 1)
    return float(-start / slope)


def piecewise_regression(u: np.ndarray, q: np.ndarray) -> float:
    """Return the breakpoint that the package piecewise-regression finds, all readings taken as they are."""
    import warnings

    import piecewise_regression as package  # pyright: ignore[reportMissingImports]: of `make bench`

    # With a good start value and without its bootstrap restarts: the package at its fastest and luckiest.
    start = [float(u[q > 0.2 * q.max()].min())]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = package.Fit(u, q, n_breakpoints=1, start_values=start, n_boot=0, verbose=False)
    estimates = fit.get_results()["estimates"]
    return float(estimates["breakpoint1"]["estimate"]) if estimates else float("nan")


RIVALS = {"first flow seen": first_flow_seen, "line 10-90 %": straight_line}


def middle_threshold(rival, test: RampTest, lag_s: float) -> float:
    """Return the middle of a rival's opening and closing thresholds, V."""
    return float(np.mean([rival(*branch) for branch in branches_of(test, lag_s)]))
