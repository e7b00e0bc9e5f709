"""Plots of an identified valve: what each threshold rests on, what is certified, and the law's offset beside it.

Only what was identified is drawn: nothing is fitted or smoothed here.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.knees.described_tests import DescribedTest
from dzdesign.identify.knees.gated_line import BranchShape
from dzdesign.identify.plots.style import HUES, finish, new_figure, plot_style, pressure_names, saved
from dzdesign.identify.plots.valve_curves import BRANCHES, draw_beta, draw_thresholds, tested_pressures
from dzdesign.identify.side import Identification, SideIdentification
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.side_model import SideModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Points of a branch that a panel shows at most; a record's 10 000 would hide one another.
MOST_POINTS = 1500
#: Residuals beyond this many sigma are drawn at this edge, so that a drop-out does not flatten the others.
RESIDUAL_EDGE = 8.0
#: Of the rising and the falling branch.
NAMES, MARKERS = (tuple(branch[index] for branch in BRANCHES) for index in (1, 2))
COLOURS = tuple(HUES[hue] for *_, hue in BRANCHES)


def plot_files(found: Identification) -> dict[str, bytes]:
    """Draw an identified valve, each plot as SVG and as PNG: file name -> content; the same valve, the same bytes.

    There is ``flow_<dP>_MPa`` for each pressure drop, ``thresholds`` and, where beta runs over several pressure drops,
    ``beta``; of a valve with two sides each name starts with its side's.
    """
    with plot_style():
        return {
            f"{name}.{suffix}": saved(figure, suffix)
            for name, figure in draw_figures(found)
            for suffix in ("svg", "png")
        }


def draw_figures(found: Identification) -> Iterator[tuple[str, "Figure"]]:
    """Return each plot's name and figure, one after the other."""
    for name, side in found.sides.items():
        units = found.model.recorded_units.of_side(name)
        prefix, dp = f"{name}_" if len(found.sides) > 1 else "", [test.dp_MPa for test in side.model.tests]
        of = f", {name} commands" if prefix else ""
        for row, flow in enumerate(pressure_names([f"{prefix}flow"] * len(dp), dp)):
            yield flow, _flow_figure(found.model, side, row, units, of)
        yield f"{prefix}thresholds", _thresholds_figure(side.model, units, of)
        if len(side.model.beta.beta) > 1:
            yield f"{prefix}beta", _beta_figure(side.model, units, of)


# Flow over command ---------------------------------------------------------------------------------------------------


def _flow_figure(
    valve: ValveModel, side: SideIdentification, row: int, units: RecordedUnits, of: str
) -> "Figure":
    """Draw one ramp test: the whole range, its edge enlarged, and the residuals about the straight lines.

    `of` names the side, of a valve with two.
    """
    item, test = side.described.tests[row], side.model.tests[row]
    figure = new_figure(6.6, *_flow_title(side.model, test, units, of))
    panels: dict[str, Axes] = figure.subplot_mosaic(
        [["flow", "edge"], ["residual", "edge"]], height_ratios=(2, 1), width_ratios=(3, 2)
    )
    flow, edge, residual = (panels[name] for name in ("flow", "edge", "residual"))
    branches = [
        (column, shape, knee, onset, side.knees.slope[row, column])
        for column, (shape, knee, onset) in enumerate(zip(item.shapes, _knees(test), _onsets(test), strict=True))
        if shape and knee is not None and onset is not None
    ]
    whole = (0.0, max(shape.prepared.branch.u.max() for _, shape, *_ in branches))
    near, flows = _edge_limits(valve, test, item)
    for axes, limits, size in ((flow, whole, 4.5), (edge, near, 7)):
        for column, shape, *_ in branches:
            _draw_samples(axes, shape, column, limits, units)
        for column, shape, knee, _, slope in branches:
            _draw_line(axes, shape, column, knee, slope / L_MIN, units)
        for column, _, knee, *_ in branches:
            axes.plot(units.convert(knee, "V"), 0, MARKERS[column], ms=size, color=COLOURS[column], mec=HUES["ink"],
                      mew=0.8, label=f"knee {NAMES[column]}", zorder=5)  # fmt: skip
        for column, _, _, onset, _ in branches:  # hollow and larger: a knee at the same command shows inside it
            axes.plot(units.convert(onset, "V"), 0, MARKERS[column], ms=1.8 * size, mfc="none", mec=COLOURS[column],
                      mew=1.6, label=f"onset {NAMES[column]}", zorder=6)  # fmt: skip
        bound = units.convert(test.u_guard_lower_V, "V")
        axes.axvline(bound, color=HUES["ink"], ls="-.", lw=1.2, label="certified bound")
        if valve.meter.floor_L_min > 0:
            floor = units.convert(valve.meter.floor_L_min, "L/min")
            axes.axhline(floor, color=HUES["soft"], ls=":", lw=1.5, label="meter's floor")
    for column, shape, knee, _, slope in branches:
        _draw_residuals(residual, shape, column, knee, slope, units)
    at = "" if test.dp_MPa is None else f" at {units.text(test.dp_MPa, '.3f MPa')}"
    # A spike beyond the largest flow would flatten all the rest.
    top = units.convert(max(shape.y_max for _, shape, *_ in branches) / L_MIN, "L/min")
    command, flows_at = f"command u ({units.label('V')})", f"flow Q{at} ({units.label('L/min')})"
    all_u, edge_u = (tuple(units.convert(end, "V") for end in limits) for limits in (whole, near))
    edge_flow = tuple(units.convert(end, "L/min") for end in flows)
    flow.set(ylabel=flows_at, title="whole range", xlim=all_u, ylim=(-0.08 * top, 1.1 * top))
    edge.set(xlabel=command, ylabel=flows_at, title="the edge, enlarged", xlim=edge_u, ylim=edge_flow)
    sigma = " / ".join(units.number(shape.sigma / L_MIN, ".2g L/min") for _, shape, *_ in branches)
    residual.set(xlabel=command, ylabel="residual (σ)", xlim=all_u)
    residual.set(ylim=(-1.15 * RESIDUAL_EDGE, 1.15 * RESIDUAL_EDGE), yticks=(-6, -3, 0, 3, 6))
    residual.set_title(f"about the straight lines, in their windows; σ = {sigma} {units.label('L/min')}")
    return finish(figure, 2)


def _flow_title(side: SideModel, test: TestResult, units: RecordedUnits, of: str) -> tuple[str, str, str]:
    """Return the lines that say which test it is and what was found in it."""

    def pair(values: tuple[float | None, float | None]) -> str:
        known = ((name, u) for name, u in zip(NAMES, values, strict=True) if u is not None)
        return ", ".join(f"{name} {units.text(u, '.3f V')}" for name, u in known)

    at = "pressure drop not recorded" if test.dp_MPa is None else units.text(test.dp_MPa, ".3f MPa")
    error = units.text(1e3 * test.u_knee_se_V, ".1f mV")
    threshold, bound = (units.text(u, ".3f V") for u in (test.u_guard_V, test.u_guard_lower_V))
    return (
        f"{at}{of}: {test.source}",
        f"knee {pair(_knees(test))} (s.e. {error}); onset {pair(_onsets(test))}",
        f"{side.certificate.guard} threshold {threshold}, certified above {bound} "
        f"({_percent(side)} for all tests together); {test.outliers} outliers left out",
    )


def _percent(side: SideModel) -> str:
    return f"{100 * side.certificate.confidence:.6g} %"


def _knees(test: TestResult) -> tuple[float | None, float | None]:
    return test.u_knee_rising_V, test.u_knee_falling_V


def _onsets(test: TestResult) -> tuple[float | None, float | None]:
    return test.u_onset_rising_V, test.u_onset_falling_V


def _edge_limits(
    valve: ValveModel, test: TestResult, item: DescribedTest
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ranges of command (V) and flow (L/min) that show knees, onsets, bound and floor."""
    marks = [u for u in (*_knees(test), *_onsets(test), test.u_guard_lower_V) if u is not None]
    room = max(0.5 * (max(marks) - min(marks)), 0.01 * valve.u_max_V)
    low, high = max(min(marks) - room, 0.0), max(marks) + room
    noise = max(shape.sigma for shape in item.branches) / L_MIN
    first_knee = min(u for u in _knees(test) if u is not None)
    top = max(1.1 * test.slope_L_min_V * (high - first_knee), 2 * valve.meter.floor_L_min, 6 * noise)
    return (low, high), (-0.15 * top, top)


def _thinned(points: np.ndarray) -> np.ndarray:
    """Return every so-manieth, at most `MOST_POINTS`."""
    return points[:: max(1, -(-points.size // MOST_POINTS))]


def _draw_samples(
    axes: "Axes", shape: BranchShape, column: int, limits: tuple[float, float], units: RecordedUnits
) -> None:
    """Draw the samples of a branch between two commands, at the nominal pressure drop."""
    u, (low, high) = shape.prepared.branch.u, limits
    at = _thinned(np.flatnonzero((u >= low) & (u <= high)))
    flow = units.convert(shape.prepared.y[at] / L_MIN, "L/min")
    axes.plot(units.convert(u[at], "V"), flow, MARKERS[column], ms=4 if at.size < 300 else 2,
              color=COLOURS[column], alpha=0.35, mew=0, rasterized=True, label=f"samples {NAMES[column]}",
              zorder=2)  # fmt: skip


def _draw_line(
    axes: "Axes", shape: BranchShape, column: int, knee: float, slope: float, units: RecordedUnits
) -> None:
    """Draw the straight line (V, L/min/V): solid where samples bear it, dashed from there to its zero, the knee."""
    inside = shape.prepared.branch.u[shape.line.inside]
    ends = np.array([inside.min(), inside.max()])
    reach = np.array([knee, max(ends[0], knee)])
    solid, dashed = (
        (units.convert(u, "V"), units.convert(slope * (u - knee), "L/min")) for u in (ends, reach)
    )
    axes.plot(*solid, "-", color=COLOURS[column], lw=2, label=f"line {NAMES[column]}", zorder=4)
    axes.plot(*dashed, "--", color=COLOURS[column], lw=1.6, zorder=4)


def _draw_residuals(
    axes: "Axes", shape: BranchShape, column: int, knee: float, slope: float, units: RecordedUnits
) -> None:
    """Draw how far the window's samples lie from the line, over sigma; gated ones are marked, all of them."""
    line, u = shape.line, shape.prepared.branch.u
    miss = np.clip((shape.prepared.y - slope * (u - knee)) / shape.sigma, -RESIDUAL_EDGE, RESIDUAL_EDGE)
    u = units.convert(u, "V")
    used = _thinned(np.flatnonzero(line.kept & ~line.censored))
    gated = np.flatnonzero(line.inside & ~line.kept)
    axes.plot(u[used], miss[used], MARKERS[column], ms=4 if used.size < 300 else 2, color=COLOURS[column],
              alpha=0.35, mew=0, rasterized=True, zorder=2)  # fmt: skip
    if gated.size:
        axes.plot(u[gated], miss[gated], "x", ms=5, mew=1.3, color=HUES["ink"], rasterized=True, zorder=3,
                  label=f"outlier (beyond {RESIDUAL_EDGE:g} σ: at the edge)")  # fmt: skip
    axes.axhline(0, color=HUES["ink"], lw=0.8)


# Over the pressure drop ----------------------------------------------------------------------------------------------


def _thresholds_figure(side: SideModel, units: RecordedUnits, of: str) -> "Figure":
    """Draw the thresholds of all tests, the guarded one with its bound, and the law's offset."""
    tests, curve = side.tests, side.curve
    change, error = (1e3 * (value or 0) for value in (side.trend_change_V, side.trend_change_se_V))
    over = f"{units.number(change, '.0f mV')} ± {units.text(error, '.0f mV')} over the range"
    trend = f"; {side.trend}: {over}" if side.trend else ""
    figure = new_figure(
        5.4,
        f"Thresholds of {len(tests)} pressure drop{'s' if len(tests) > 1 else ''}{of}: {_sources(side)}",
        f"{side.certificate.guard} threshold guarded ({_percent(side)} for all tests together){trend}",
        f"identified u_min0 = {units.number(side.reference.u_min_V, '.4f V')} ± "
        f"{units.text(side.reference.u_min_se_V, '.4f dV')}, certified offset {units.text(curve.u_min0_V, '.4f V')}"
        + (f" at dP0 = {units.text(side.reference.dp_MPa or 0.0, '.3f MPa')}" if side.beta.beta else ""),
    )
    axes, dp = figure.subplots(), units.convert(tested_pressures(side), "MPa")
    draw_thresholds(axes, side, curve, units)
    lower, threshold = (units.convert(np.array(values), "V") for values in (curve.u_lower_V, curve.u_threshold_V))
    axes.vlines(dp, lower, threshold, color=HUES["soft"], lw=7, alpha=0.35,
                label="from lower bound to threshold", zorder=1)  # fmt: skip
    axes.plot(dp, threshold, "s", ms=11, mfc="none", mec=HUES["ink"], label="guarded threshold", zorder=5)
    return finish(figure, 3)


def _beta_figure(side: SideModel, units: RecordedUnits, of: str) -> "Figure":
    """Draw the identified beta, what the bounds allow, and dP0."""
    dp, beta, u_min0 = tested_pressures(side), side.beta.beta, side.reference.u_min_V
    dp0 = side.reference.dp_MPa or 0.0
    figure = new_figure(
        5.0,
        f"β over {units.number(dp[0], '.3f MPa')} to {units.text(dp[-1], '.3f MPa')}{of}: {_sources(side)}",
        f"β = {beta[0]:.4f} to {beta[-1]:.4f}, 1 at dP0 = {units.text(dp0, '.3f MPa')} "
        f"(identified u_min0 = {units.text(u_min0, '.4f V')}); bounds: {_percent(side)} for all tests together",
    )
    axes = figure.subplots()
    draw_beta(axes, side, side.curve, units)
    axes.plot(units.convert(dp, "MPa"), np.array(side.curve.u_lower_V) / u_min0, "_", ms=14, mew=2, color=HUES["ink"],
              label="lower bound / u_min0, at the test", zorder=5)  # fmt: skip
    axes.plot(units.convert(dp0, "MPa"), 1, "o", ms=13, mfc="none", mec=HUES["ink"], label="dP0, where β = 1")
    return finish(figure, 2)


def _sources(side: SideModel) -> str:
    first, last = side.tests[0].source, side.tests[-1].source
    return f"{first} to {last}" if len(side.tests) > 1 else first
