"""The paper's figures 2, 3, 6 to 8, 12, 13, 16 to 23, redrawn from the recovered valves; printed numbers as marks."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, SATURATED_FROM_V, U_MAX_V
from dzdesign.derivation.law import law
from dzdesign.identify.plots.frame import finish, saved
from dzdesign.identify.plots.style import plot_style
from dzdesign.reproduce.artefact import Driver
from dzdesign.reproduce.bench_figures import effect_of_load, effect_of_oil, pulse
from dzdesign.reproduce.figure_parts import (
    BLACK,
    COLOURS,
    GREY,
    LAWS,
    MARKS,
    NO_BETA,
    WITH,
    WITHOUT,
    Panel,
    draw_both,
    draw_floor,
    draw_ramp,
    drawn_panels,
    mark,
    mark_with,
    mark_without,
    panels_of,
    titled,
)
from dzdesign.reproduce.recovered_valves import OF_READING, at_rest, printed_at, recover_simulated
from dzdesign.reproduce.rows import Subject
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRESSURES_MPA, PRODUCT, STEP_AT_S, Drive, ValveRuns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Command of Fig. 3's example, V.
EXAMPLE_V = 4.0


def figure_files(valves: Sequence[Subject], stopped: Subject) -> dict[str, bytes]:
    """Draw every figure of the simulated, first and second valve, and of the first with a stop: file name -> SVG; the
    same runs, the same bytes.
    """
    with plot_style():
        return {f"figure_{name}.svg": saved(figure, "svg") for name, figure in figures(valves, stopped)}


def figures(valves: Sequence[Subject], stopped: Subject) -> Iterator[tuple[str, "Figure"]]:
    """Yield each figure with its number in the paper, two digits; what a stop changes of Fig. 18 stands beside it."""
    simulated, first, second = valves
    static = "static flow without and with compensator"
    yield "02", _over_pressure(simulated.runs)
    yield "03", _construction(simulated.runs)
    yield "06", _static_without()
    yield "07", _with_and_without_beta(simulated)
    yield "08", _step(simulated.runs)
    yield "12", pulse(12, (first.runs, second.runs), with_compensator=False)
    yield "13", pulse(13, (first.runs, second.runs), with_compensator=True)
    over = "dead zone over pressure drop, without compensator"
    yield "16", _beside_simulation(simulated, first, 16, over, (DIRECT,))
    yield "17", _beside_simulation(simulated, first, 17, "simulation and test, with compensator", (PAPER, PRODUCT))
    yield "18", drawn_panels(18, f"{static} (first valve)", panels_of(first), draw_both)
    yield "18_with_a_stop", _saturation(stopped, f"{static} (first valve, with a stop)")
    yield "19", drawn_panels(19, f"{static} (second valve)", panels_of(second), draw_both)
    yield "20", effect_of_load(20, first)
    yield "21", effect_of_load(21, first)
    yield "22", effect_of_oil(first)
    yield "23", _effect_of_beta(first)


def _over_pressure(runs: ValveRuns) -> "Figure":
    """Fig. 2: flow over the commands of both signs at several pressure drops; the valve is taken as symmetric."""
    from matplotlib import colormaps

    figure = titled(2, 4.8, "dead zone in the flow curves", "simulated valve at rest; negative side: its mirror image")
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
    figure = titled(3, 4.8, "static flow at the reference point, simulated valve", f"{DP0_MPA} MPa, valve at rest")
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
    mark(axes, opens, 0, DP0_MPA, "^", "dead zone")
    axes.set(xlabel="command (V)", ylabel="flow Q (L/min)", xlim=(0, 1.02 * U_MAX_V), ylim=(3.2 * low, 1.05 * largest))
    return finish(figure, 1)


def _static_without() -> "Figure":
    """Fig. 6: displacement in both readings of its dead zone, and flow, over the command."""
    more = "valve at rest; the flow is the same in both readings of the displacement's dead zone"
    figure = titled(6, 5.0, "static characteristics without compensator (simulated valve)", more, MARKS)
    every = figure.subplots(1, 3)
    for axes, reading in zip(every, OF_READING, strict=False):
        valve = recover_simulated(reading)
        for dp_MPa in PRESSURES_MPA:
            rest, printed = at_rest(valve.plant, dp_MPa), printed_at(valve.published, dp_MPa)
            moves, opens = float(rest.moves_V), float(rest.opens_V)
            travel, overlap = float(rest.position_mm(U_MAX_V)), valve.plant.overlap_mm
            line, share = WITH if dp_MPa == DP0_MPA else NO_BETA, float(printed.displacement_dead_zone_percent) / 100
            corners = ([0, moves, opens, U_MAX_V], [0, 0, overlap, travel])
            axes.plot(*corners, ls=line, color=COLOURS[dp_MPa], lw=1.8, label=f"{dp_MPa:g} MPa")
            mark(axes, U_MAX_V, float(printed.stroke_mm), dp_MPa, "D", "largest displacement")
            dead = (share * U_MAX_V, 0.0) if reading == "preload" else (opens, share * float(printed.stroke_mm))
            mark(axes, *dead, dp_MPa, ">", "displacement's dead zone")
        of = "command" if reading == "preload" else "travel"
        axes.set(ylabel="displacement x_e (mm)", title=f"by {reading}: a share of the {of}", ylim=(0, 1.9))
    simulated = recover_simulated("preload")
    for dp_MPa in PRESSURES_MPA:
        rest = at_rest(simulated.plant, dp_MPa)
        opens = float(rest.opens_V)
        flow = float(rest.flow_per_volt) * (U_MAX_V - opens)
        line = WITH if dp_MPa == DP0_MPA else NO_BETA
        every[2].plot([0, opens, U_MAX_V], [0, 0, flow], ls=line, color=COLOURS[dp_MPa], lw=1.8)
        printed = printed_at(simulated.published, dp_MPa)
        mark(every[2], float(printed.dead_zone_percent) / 100 * U_MAX_V, 0.0, dp_MPa, "^", "dead zone of flow")
        mark(every[2], U_MAX_V, float(printed.flow), dp_MPa, "s", "largest flow")
    every[2].set(ylabel="flow Q (L/min)", title="either", ylim=(0, None))
    for axes in every:
        axes.set(xlabel="command u_i (V)", xlim=(0, 1.02 * U_MAX_V))
    return finish(figure, 2)


def _with_and_without_beta(subject: Subject) -> "Figure":
    """Fig. 7: without compensator, with it, and with it ignoring beta."""
    beside = PRESSURES_MPA[1]

    def draw(axes: "Axes", panel: Panel) -> None:
        draw_both(axes, panel)
        label = f"with, without β, {beside:g} MPa"
        draw_ramp(axes, panel.runs, Drive(panel.by, False), beside, NO_BETA, label, color=BLACK)
        flow = float(panel.runs.valve.published.zero_flow_without_beta)
        mark(axes, 0.0, flow, beside, "*", "zero command without β")

    return drawn_panels(7, "static characteristics (simulated valve)", panels_of(subject), draw)


def _step(runs: ValveRuns) -> "Figure":
    """Fig. 8: the step to full command."""
    figure = titled(8, 4.4, f"step of the command from 0 to {U_MAX_V} V (simulated valve, {DP0_MPA} MPa)",
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
    simulated: Subject, tested: Subject, number: int, title: str, drivers: Sequence[Driver]
) -> "Figure":
    """Figs. 16, 17: the simulated valve beside the first one."""
    panels = panels_of(tested, drivers)
    beside = dict(zip(map(id, panels), panels_of(simulated, drivers), strict=True))

    def draw(axes: "Axes", panel: Panel) -> None:
        runs, by = panel
        other = beside[id(panel)].runs
        for dp_MPa in PRESSURES_MPA:
            draw_ramp(axes, other, Drive(by), dp_MPa, NO_BETA, f"simulated valve, {dp_MPa:g} MPa", width=1.4)
            draw_ramp(axes, runs, Drive(by), dp_MPa, WITH, f"first valve, {dp_MPa:g} MPa")
            (mark_without if by == DIRECT else mark_with)(axes, runs, dp_MPa)
        draw_floor(axes, runs)

    return drawn_panels(number, title, panels, draw)


def _saturation(stopped: Subject, title: str) -> "Figure":
    """Fig. 18 with the stop that Section 4.2 tells of: the commands from which the paper's curves are flat."""

    def draw(axes: "Axes", panel: Panel) -> None:
        draw_both(axes, panel)
        low, high = (float(text) for text in SATURATED_FROM_V)
        axes.axvspan(low, high, color=GREY, alpha=0.25, lw=0, label=f"printed: flat from {low:g}-{high:g} V on")

    return drawn_panels(18, title, panels_of(stopped), draw)


def _effect_of_beta(subject: Subject) -> "Figure":
    """Fig. 23: with and without beta at dP1."""
    dp_MPa = PRESSURES_MPA[1]

    def draw(axes: "Axes", panel: Panel) -> None:
        runs, by = panel
        draw_ramp(axes, runs, Drive(by), dp_MPa, WITH, "with β")
        draw_ramp(axes, runs, Drive(by, False), dp_MPa, NO_BETA, "without β", color=BLACK)
        mark(axes, 0.0, float(runs.valve.published.zero_flow_without_beta), dp_MPa, "*", "zero command without β")
        draw_floor(axes, runs)

    return drawn_panels(23, f"impact of β on the flow (first valve, {dp_MPa:g} MPa)", panels_of(subject), draw)
