"""The paper's figures 2, 3, 6 to 8, 16 to 19 and 23, redrawn from the recovered valves; printed numbers as marks."""

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, U_MAX_V
from dzdesign.derivation.law import law
from dzdesign.identify.plots.frame import finish, new_figure, plot_style, saved
from dzdesign.report.reproduction import Driver
from dzdesign.reproduce.recovered_valves import at_rest, printed_at
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRESSURES_MPA, PRODUCT, STEP_AT_S, Drive, ValveRuns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Reference and beside it: they differ in hue for the colour-blind (Okabe and Ito), and in lightness in print.
COLOURS = dict(zip(PRESSURES_MPA, ("#0072B2", "#E69F00"), strict=True))
BLACK, GREY = "#000000", "#6E6E6E"
#: Lines say who drives.
Line = str | tuple[int, tuple[int, ...]]
WITHOUT: Line = ":"
WITH: Line = "-"
NO_BETA: Line = (0, (5, 2))
#: Records between two points of a line: a tenth of a second of a ramp of 100 s.
EVERY = 10
#: Command of Fig. 3's example, V.
EXAMPLE_V = 4.0
MARKS = "marks: the printed numbers, in the colours of their pressure drops"
LAWS = {PAPER: "the paper's law", PRODUCT: "the product's C"}


def figure_files(runs: Sequence[ValveRuns]) -> dict[str, bytes]:
    """Draw every figure of the simulated, first and second valve: file name -> SVG; the same runs, the same bytes."""
    with plot_style():
        return {f"figure_{number:02}.svg": saved(figure, "svg") for number, figure in _figures(runs)}


def _figures(runs: Sequence[ValveRuns]) -> Iterator[tuple[int, "Figure"]]:
    simulated, first, second = runs
    yield 2, _over_pressure(simulated)
    yield 3, _construction(simulated)
    yield 6, _static_without(simulated)
    yield 7, _with_and_without(simulated, 7, "static characteristics (simulated valve)", with_beta_alone=False)
    yield 8, _step(simulated)
    yield 16, _beside_simulation(simulated, first, 16, "dead zone over pressure drop, without compensator", (DIRECT,))
    yield 17, _beside_simulation(simulated, first, 17, "simulation and test, with compensator", (PAPER, PRODUCT))
    yield 18, _with_and_without(first, 18, "static flow without and with compensator (first valve)")
    yield 19, _with_and_without(second, 19, "static flow without and with compensator (second valve)")
    yield 23, _effect_of_beta(first)


def _titled(number: int, height: float, title: str, *more: str) -> "Figure":
    return new_figure(height, f"Fig. {number}, redrawn: {title}", *more)


def _panels(number: int, title: str, draw: Callable[["Axes", Driver], None], drives: Sequence[Driver]) -> "Figure":
    """Draw one panel per driver, with one scale."""
    figure = _titled(number, 4.8, title, MARKS)
    panels = np.atleast_1d(figure.subplots(1, len(drives), sharey=True))
    for axes, by in zip(panels, drives, strict=True):
        draw(axes, by)
        axes.set(xlabel="command u_i (V)", xlim=(0, U_MAX_V * 1.02))
        if by in LAWS:
            axes.set_title(LAWS[by])
    panels[0].set(ylabel="flow Q (L/min)", ylim=(0, None))
    return finish(figure, 3)


def _draw_ramp(
    axes: "Axes", runs: ValveRuns, drive: Drive, dp_MPa: float, line: Line, label: str, *,
    color: str = "", width: float = 1.8, of: str = "q_mean_L_min",
) -> None:  # fmt: skip
    """Draw the rising branch of a ramp: the flow, or another quantity `of` the run."""
    run = runs.ramps[drive, dp_MPa]
    rising = slice(0, int(np.argmax(run.command)) + 1, EVERY)
    axes.plot(
        U_MAX_V * run.command[rising], getattr(run, of)[rising], ls=line, label=label, lw=width,
        color=color or COLOURS[dp_MPa],
    )  # fmt: skip


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
    _mark(axes, dead_zone_V, runs.valve.level_L_min, dp_MPa, "^", "dead zone")
    _mark(axes, U_MAX_V, float(printed.flow), dp_MPa, "s", "largest flow")


def _mark_with(axes: "Axes", runs: ValveRuns, dp_MPa: float) -> None:
    """Mark dead zone and largest flow with compensator."""
    valve = runs.valve.published
    dead_zone_V = float(valve.residual_percent) / 100 * U_MAX_V
    _mark(axes, dead_zone_V, runs.valve.level_L_min, dp_MPa, "v", "dead zone, with", hollow=True)
    _mark(axes, U_MAX_V, float(printed_at(valve, dp_MPa).flow_with), dp_MPa, "o", "largest flow, with", hollow=True)


def _draw_floor(axes: "Axes", runs: ValveRuns) -> None:
    if runs.valve.level_L_min:
        axes.axhline(runs.valve.level_L_min, color=GREY, ls=(0, (1, 3)), lw=1.2, label="meter's floor")


def _over_pressure(runs: ValveRuns) -> "Figure":
    """Fig. 2: flow over the commands of both signs at several pressure drops; the valve is taken as symmetric."""
    from matplotlib import colormaps

    figure = _titled(2, 4.8, "dead zone in the flow curves", "simulated valve at rest; negative side: its mirror image")
    axes = figure.subplots()
    pressures = np.arange(DP0_MPA, DP1_MPA + 1)
    for index, dp_MPa in enumerate(pressures):
        rest = at_rest(runs.valve.plant, float(dp_MPa))
        opens = float(rest.opens_V)
        u = np.array([-U_MAX_V, -opens, opens, U_MAX_V])
        flow = float(rest.flow_per_volt) * np.sign(u) * (np.abs(u) - opens)
        axes.plot(u, flow, color=colormaps["viridis"](0.8 * index / (pressures.size - 1)), lw=1.8,
                  ls=("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)))[index], label=f"{dp_MPa} MPa")  # fmt: skip
    axes.set(xlabel="command u_i (V)", ylabel="flow Q (L/min)", xlim=(-U_MAX_V, U_MAX_V))
    return finish(figure, 1)


def _construction(runs: ValveRuns) -> "Figure":
    """Fig. 3: how the compensation signal u_0 follows from the target line, at the reference."""
    rest = at_rest(runs.valve.plant, float(DP0_MPA))
    opens, slope = float(rest.opens_V), float(rest.flow_per_volt)
    largest = slope * (U_MAX_V - opens)
    flow = largest * EXAMPLE_V / U_MAX_V  # Eq. (9)
    kappa = 1 - opens / U_MAX_V  # k x_max over u_max
    driven = law("paper").evaluate_gain(1.0, kappa) * EXAMPLE_V + law("paper").evaluate_offset(1.0, opens)
    figure = _titled(3, 4.8, "static flow at the reference point, simulated valve", f"{DP0_MPA} MPa, valve at rest")
    axes = figure.subplots()
    blue = COLOURS[DP0_MPA]
    axes.plot([0, opens, U_MAX_V], [0, 0, largest], WITHOUT, color=blue, lw=2.2, label="without compensator")
    axes.plot([0, U_MAX_V], [0, largest], WITH, color=blue, lw=2.2, label="with compensator: target line")
    axes.plot([EXAMPLE_V] * 2, [0, flow], color=GREY, lw=1, ls="--")
    axes.plot([driven] * 2, [0, flow], color=GREY, lw=1, ls="--")
    low = -0.09 * largest
    for start, end, height, text in (
        (EXAMPLE_V, driven, flow, "u_0, Eq. (13)"),
        (0, EXAMPLE_V, low, "u_i"),
        (opens, driven, low, "u_i' = k x"),
        (0, opens, 2.2 * low, "u_min0"),
    ):
        axes.annotate("", (end, height), (start, height), arrowprops={"arrowstyle": "<->", "color": BLACK})
        axes.text((start + end) / 2, height - 0.02 * largest, text, ha="center", va="top")
    _mark(axes, opens, 0, DP0_MPA, "^", "dead zone")
    axes.set(xlabel="command (V)", ylabel="flow Q (L/min)", xlim=(0, 1.02 * U_MAX_V), ylim=(3.2 * low, 1.05 * largest))
    return finish(figure, 1)


def _static_without(runs: ValveRuns) -> "Figure":
    """Fig. 6: displacement and flow over the command."""
    figure = _titled(6, 4.8, "static characteristics without compensator (simulated valve)", MARKS)
    travel, flow = figure.subplots(1, 2)
    for dp_MPa in PRESSURES_MPA:
        printed, line = printed_at(runs.valve.published, dp_MPa), WITH if dp_MPa == DP0_MPA else NO_BETA
        _draw_ramp(travel, runs, Drive(DIRECT), dp_MPa, line, "", of="position_mm")
        _draw_ramp(flow, runs, Drive(DIRECT), dp_MPa, line, f"{dp_MPa:g} MPa")
        moves_V = float(printed.displacement_dead_zone_percent) / 100 * U_MAX_V
        _mark(travel, U_MAX_V, float(printed.stroke_mm), dp_MPa, "D", "largest displacement")
        _mark(travel, moves_V, 0.0, dp_MPa, ">", "dead zone of displacement")
        _mark_without(flow, runs, dp_MPa)
    for axes, quantity in ((travel, "displacement x_e (mm)"), (flow, "flow Q (L/min)")):
        axes.set(xlabel="command u_i (V)", ylabel=quantity, xlim=(0, 1.02 * U_MAX_V), ylim=(0, None))
    return finish(figure, 3)


def _with_and_without(runs: ValveRuns, number: int, title: str, with_beta_alone: bool = True) -> "Figure":
    """Figs. 7, 18, 19: without compensator and with it; Fig. 7 also ignoring beta."""
    valve = runs.valve.published

    def draw(axes: "Axes", by: Driver) -> None:
        for dp_MPa in PRESSURES_MPA:
            _draw_ramp(axes, runs, Drive(DIRECT), dp_MPa, WITHOUT, f"without, {dp_MPa:g} MPa")
            _draw_ramp(axes, runs, Drive(by), dp_MPa, WITH, f"with, {dp_MPa:g} MPa")
            _mark_without(axes, runs, dp_MPa)
            _mark_with(axes, runs, dp_MPa)
        if not with_beta_alone:
            beside = PRESSURES_MPA[1]
            _draw_ramp(axes, runs, Drive(by, False), beside, NO_BETA, f"with, without β, {beside:g} MPa", color=BLACK)
            _mark(axes, 0.0, float(valve.zero_flow_without_beta), beside, "*", "zero command without β")
        _draw_floor(axes, runs)

    return _panels(number, title, draw, (PAPER, PRODUCT))


def _step(runs: ValveRuns) -> "Figure":
    """Fig. 8: the step to full command."""
    figure = _titled(8, 4.4, f"step of the command from 0 to {U_MAX_V} V (simulated valve, {DP0_MPA} MPa)",
                     "one point a period of the PWM; dynamics of the default plant, none are printed")  # fmt: skip
    axes = figure.subplots()
    for by, name, line, colour in (
        (DIRECT, "without compensator", WITHOUT, BLACK),
        (PAPER, LAWS[PAPER], NO_BETA, COLOURS[PRESSURES_MPA[1]]),
        (PRODUCT, LAWS[PRODUCT], WITH, COLOURS[PRESSURES_MPA[0]]),
    ):
        run = runs.steps[Drive(by)]
        axes.plot(1e3 * (run.time - STEP_AT_S), run.q_L_min, ls=line, color=colour, lw=2, label=name)
    axes.set(xlabel="time after the step (ms)", ylabel="flow Q (L/min)", xlim=(-5, 40), ylim=(0, None))
    return finish(figure, 1)


def _beside_simulation(
    simulated: ValveRuns, tested: ValveRuns, number: int, title: str, drives: Sequence[Driver]
) -> "Figure":
    """Figs. 16, 17: the simulated valve beside the first one."""

    def draw(axes: "Axes", by: Driver) -> None:
        for dp_MPa in PRESSURES_MPA:
            _draw_ramp(axes, simulated, Drive(by), dp_MPa, NO_BETA, f"simulated valve, {dp_MPa:g} MPa", width=1.4)
            _draw_ramp(axes, tested, Drive(by), dp_MPa, WITH, f"first valve, {dp_MPa:g} MPa")
            (_mark_without if by == DIRECT else _mark_with)(axes, tested, dp_MPa)
        _draw_floor(axes, tested)

    return _panels(number, title, draw, drives)


def _effect_of_beta(runs: ValveRuns) -> "Figure":
    """Fig. 23: with and without beta at dP1."""
    dp_MPa = PRESSURES_MPA[1]

    def draw(axes: "Axes", by: Driver) -> None:
        _draw_ramp(axes, runs, Drive(by), dp_MPa, WITH, "with β")
        _draw_ramp(axes, runs, Drive(by, False), dp_MPa, NO_BETA, "without β", color=BLACK)
        _mark(axes, 0.0, float(runs.valve.published.zero_flow_without_beta), dp_MPa, "*", "zero command without β")
        _draw_floor(axes, runs)

    return _panels(23, f"impact of β on the flow (first valve, {dp_MPa:g} MPa)", draw, (PAPER, PRODUCT))
