"""Figures 6, 7, 16 to 19 and 23 of the paper, redrawn from the recovered valves; marks: its numbers."""

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.derivation.account import published as paper
from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, U_MAX_V, PublishedValve
from dzdesign.derivation.law import law
from dzdesign.identify.plots.style import finish, new_figure, plot_style, saved
from dzdesign.reproduce.law_numbers import law_of
from dzdesign.reproduce.recovered_valves import METER_START_L_MIN, AtRest, printed_at
from dzdesign.reproduce.runs import DIRECT, PRESSURES_MPA, PRODUCT, WITHOUT_BETA, ValveRuns
from dzdesign.verify.closed_loop.loop import LoopRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Reference and beside it: they differ in hue for the colour-blind (Okabe and Ito), and in lightness in print.
COLOURS = dict(zip(PRESSURES_MPA, ("#0072B2", "#E69F00"), strict=True))
BLUE, ORANGE = COLOURS.values()
BLACK, GREY = "#000000", "#6E6E6E"
#: Lines say who drives: nobody, the product, the paper's law at rest.
Line = str | tuple[int, tuple[int, ...]]
WITHOUT: Line = ":"
WITH: Line = "-"
LAW: Line = (0, (5, 2))
#: Records between two points of a line: a tenth of a second of a ramp of 100 s.
EVERY = 10
MARKS = "marks: the printed numbers, in the colours of their pressure drops"


def figure_files(valves: Sequence[ValveRuns]) -> dict[str, bytes]:
    """Draw every figure of the simulated, first and second valve: file name -> SVG; the same runs, the same bytes."""
    with plot_style():
        return {f"figure_{name}.svg": saved(figure, "svg") for name, figure in figures(valves)}


def figures(valves: Sequence[ValveRuns]) -> Iterator[tuple[str, "Figure"]]:
    """Yield each figure with its number in the paper, two digits."""
    simulated, first, second = valves
    static = "static flow without and with compensator"
    yield "06", _at_rest(simulated)
    yield "07", _over_command(7, "static characteristics (simulated valve)", simulated, _static, _without_beta)
    for number, drive, mark, title in (
        (16, DIRECT, _mark_without, "dead zone over pressure drop, without compensator"),
        (17, PRODUCT, _mark_with, "simulation and test, with compensator"),
    ):

        def beside(axes: "Axes", runs: ValveRuns, drive: str = drive, mark: Mark = mark) -> None:
            for dp_MPa, color in COLOURS.items():
                _rising(axes, simulated.ramps[drive, dp_MPa], LAW, f"simulated valve, {dp_MPa:g} MPa", color)
                _rising(axes, runs.ramps[drive, dp_MPa], WITH, f"first valve, {dp_MPa:g} MPa", color)
                mark(axes, runs, dp_MPa)

        yield f"{number}", _over_command(number, title, first, beside)
    yield "18", _over_command(18, f"{static} (first valve)", first, _static, _saturation)
    yield "19", _over_command(19, f"{static} (second valve)", second, _static)
    yield "23", _over_command(23, f"impact of β on the flow (first valve, {DP1_MPA} MPa)", first, _without_beta)


def _new(number: int, title: str, *more: str, headings: Sequence[str] = ("",)) -> "tuple[Figure, list[Axes]]":
    """Return a figure with its number in the paper, and panels side by side over the command."""
    figure = new_figure(4.8, f"Fig. {number}, redrawn: {title}", *more)
    every = list(np.atleast_1d(figure.subplots(1, len(headings))))
    for axes, heading in zip(every, headings, strict=True):
        axes.set(xlabel="command u_i (V)", ylabel="flow Q (L/min)", xlim=(0, 1.02 * U_MAX_V), title=heading)
    return figure, every


def _done(figure: "Figure", rows: int) -> "Figure":
    """Let every panel begin at no flow, and put one legend below in so many rows."""
    for axes in figure.axes:
        axes.set_ylim(0, None)
    return finish(figure, rows)


def _over_command(number: int, title: str, runs: ValveRuns, *draw: Callable[["Axes", ValveRuns], None]) -> "Figure":
    """Draw flow over the command, with the meter's floor."""
    figure, (axes,) = _new(number, title, MARKS)
    for each in draw:
        each(axes, runs)
    axes.axhline(METER_START_L_MIN, color=GREY, ls=(0, (1, 3)), lw=1.2, label="meter's floor")
    return _done(figure, 4)


def _rising(axes: "Axes", run: LoopRun, line: Line, label: str, color: str) -> None:
    """Draw the flow over a rising ramp."""
    part = slice(0, int(np.argmax(run.command)) + 1, EVERY)
    axes.plot(U_MAX_V * run.command[part], run.q_mean_L_min[part], ls=line, label=label, lw=1.8, color=color)


def _papers_law(axes: "Axes", runs: ValveRuns, dp_MPa: float, label: str, color: str, with_beta: bool = True) -> None:
    """Draw the flow under the paper's law, the valve at rest."""
    command = np.linspace(0.0, 1.0, 201)
    driven = U_MAX_V * paper_drive(runs.valve.published, command, dp_MPa, with_beta)
    flow = AtRest(runs.valve.plant, dp_MPa).flow_L_min(driven)
    axes.plot(U_MAX_V * command, flow, ls=LAW, label=label, lw=1.4, color=color)


def paper_drive(valve: PublishedValve, command: np.ndarray, dp_MPa: float, with_beta: bool = True) -> np.ndarray:
    """Return the output of the paper's compensator over u_max, at dP0 or dP1, of what the paper prints.

    u_min0 is the offset that leaves the printed dead zone at dP0, beta the ratio of the valve's dead zones, Eq. (5); k
    x_max is the command left above u_min0. `with_beta` says whether the selector of Eq. (7) heeds the pressure drop.
    """
    stated, chosen = law_of(valve, (0,) * 6), law("paper")
    beta = stated.read1 / stated.read0 if with_beta and dp_MPa != DP0_MPA else 1.0
    drive = chosen.evaluate_gain(beta, 1 - stated.offset0) * command + chosen.evaluate_offset(beta, stated.offset0)
    return np.asarray(np.clip(drive, 0.0, 1.0))


def _mark(axes: "Axes", u_V: float, y: float, dp_MPa: float, marker: str, what: str, hollow: bool = False) -> None:
    """Mark a number that the paper prints, in the colour of its pressure drop; hollow marks show what is below them."""
    (line,) = axes.plot(u_V, y, marker, ls="none", clip_on=False, zorder=6, label=f"printed: {what}")
    if hollow:
        line.set(mfc="none", mec=COLOURS[dp_MPa], mew=1.7, ms=11 if dp_MPa == DP0_MPA else 7)
    else:
        line.set(mfc=COLOURS[dp_MPa], mec=BLACK, mew=1.0, ms=7)


def _mark_without(axes: "Axes", runs: ValveRuns, dp_MPa: float) -> None:
    """Mark dead zone and largest flow without compensator."""
    printed = printed_at(runs.valve.published, dp_MPa)
    dead_zone_V = float(printed.dead_zone_percent) / 100 * U_MAX_V
    _mark(axes, dead_zone_V, METER_START_L_MIN, dp_MPa, "^", "dead zone")
    _mark(axes, U_MAX_V, float(printed.flow), dp_MPa, "s", "largest flow")


def _mark_with(axes: "Axes", runs: ValveRuns, dp_MPa: float) -> None:
    """Mark dead zone and largest flow with compensator."""
    valve = runs.valve.published
    dead_zone_V = float(valve.residual_percent) / 100 * U_MAX_V
    _mark(axes, dead_zone_V, METER_START_L_MIN, dp_MPa, "v", "dead zone, with", hollow=True)
    _mark(axes, U_MAX_V, float(printed_at(valve, dp_MPa).flow_with), dp_MPa, "o", "largest flow, with", hollow=True)


#: What marks printed numbers of a valve at a pressure drop.
Mark = Callable[["Axes", ValveRuns, float], None]


def _static(axes: "Axes", runs: ValveRuns) -> None:
    """Draw the flow without and with compensator, and mark what is printed of it."""
    for dp_MPa, color in COLOURS.items():
        _rising(axes, runs.ramps[DIRECT, dp_MPa], WITHOUT, f"without, {dp_MPa:g} MPa", color)
        _rising(axes, runs.ramps[PRODUCT, dp_MPa], WITH, f"the product's C, {dp_MPa:g} MPa", color)
        _papers_law(axes, runs, dp_MPa, f"the paper's law, {dp_MPa:g} MPa", color)
        _mark_without(axes, runs, dp_MPa)
        _mark_with(axes, runs, dp_MPa)


def _without_beta(axes: "Axes", runs: ValveRuns) -> None:
    """Draw product and law with beta and without, off the reference."""
    dp_MPa = PRESSURES_MPA[1]
    _rising(axes, runs.ramps[PRODUCT, dp_MPa], WITH, f"the product's C, {dp_MPa:g} MPa", ORANGE)
    _rising(axes, runs.ramps[WITHOUT_BETA, dp_MPa], WITH, f"without β, {dp_MPa:g} MPa", BLACK)
    _papers_law(axes, runs, dp_MPa, f"the paper's law, {dp_MPa:g} MPa", ORANGE)
    _papers_law(axes, runs, dp_MPa, "the paper's law without β", BLACK, with_beta=False)
    flow = float(runs.valve.published.zero_flow_without_beta)
    _mark(axes, 0.0, flow, dp_MPa, "*", "zero command without β")


def _saturation(axes: "Axes", runs: ValveRuns) -> None:
    """Shade the commands from which the paper's curves are flat."""
    low, high = (float(text) for text in paper.SATURATED_FROM_V)
    axes.axvspan(low, high, color=GREY, alpha=0.25, lw=0, label=f"printed: flat from {low:g}-{high:g} V on")


def _at_rest(runs: ValveRuns) -> "Figure":
    """Fig. 6: displacement and flow over the command."""
    figure, (displacement, flow) = _new(
        6, "static characteristics without compensator (simulated valve)", "valve at rest", MARKS,
        headings=("displacement, its dead zone a share of the command", "flow"),
    )  # fmt: skip
    for dp_MPa, color in COLOURS.items():
        rest, printed = AtRest(runs.valve.plant, dp_MPa), printed_at(runs.valve.published, dp_MPa)
        moves, opens, travel = rest.moves_V, rest.opens_V, rest.position_mm(U_MAX_V)
        corners = ([0, moves, opens, U_MAX_V], [0, 0, runs.valve.plant.overlap_mm, travel])
        displacement.plot(*corners, WITH, color=color, lw=1.8, label=f"{dp_MPa:g} MPa")
        _mark(displacement, U_MAX_V, float(printed.stroke_mm), dp_MPa, "D", "largest displacement")
        share = float(printed.displacement_dead_zone_percent) / 100
        _mark(displacement, share * U_MAX_V, 0.0, dp_MPa, ">", "displacement's dead zone")
        flow.plot([0, opens, U_MAX_V], [0, 0, rest.flow_per_volt * (U_MAX_V - opens)], WITH, color=color, lw=1.8)
        _mark_without(flow, runs, dp_MPa)
    displacement.set_ylabel("displacement x_e (mm)")
    return _done(figure, 2)
