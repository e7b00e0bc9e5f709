"""What the redrawn figures share: panels, a ramp's branches as lines, the printed numbers as marks."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dzdesign.derivation.account.published import DP0_MPA, U_MAX_V
from dzdesign.identify.plots.frame import finish, new_figure
from dzdesign.reproduce.artefact import Driver
from dzdesign.reproduce.recovered_valves import printed_at
from dzdesign.reproduce.rows import Subject
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRESSURES_MPA, PRODUCT, Drive, ValveRuns

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
MARKS = "marks: the printed numbers, in the colours of their pressure drops"
LAWS = {PAPER: "the paper's law", PRODUCT: "the product's C"}


class Panel(NamedTuple):
    """One panel: whose runs, who drives."""

    runs: ValveRuns
    by: Driver

    @property
    def title(self) -> str:
        """Who drives, and the hysteresis that is assumed."""
        hysteresis_V = self.runs.valve.plant.hysteresis_V
        return LAWS.get(self.by, "") + (f", hysteresis of {hysteresis_V:g} V assumed" if hysteresis_V else "")


def panels_of(subject: Subject, drivers: Sequence[Driver] = (PAPER, PRODUCT)) -> list[Panel]:
    """Return a panel for each driver without hysteresis, and for the last one with it."""
    panels = [Panel(subject.runs, by) for by in drivers]
    return panels + ([Panel(subject.with_hysteresis, drivers[-1])] if subject.with_hysteresis else [])


def titled(number: int, height: float, title: str, *more: str) -> "Figure":
    """Return an empty figure with its number in the paper."""
    return new_figure(height, f"Fig. {number}, redrawn: {title}", *more)


def drawn_panels(number: int, title: str, panels: Sequence[Panel], draw: Callable[["Axes", Panel], None]) -> "Figure":
    """Draw panels side by side, with one scale."""
    figure = titled(number, 4.8, title, MARKS)
    every = np.atleast_1d(figure.subplots(1, len(panels), sharey=True))
    for axes, panel in zip(every, panels, strict=True):
        draw(axes, panel)
        axes.set(xlabel="command u_i (V)", xlim=(0, U_MAX_V * 1.02))
        axes.set_title(panel.title.replace(", ", "\n"))
    every[0].set(ylabel="flow Q (L/min)", ylim=(0, None))
    return finish(figure, 3)


def draw_ramp(
    axes: "Axes", runs: ValveRuns, drive: Drive, dp_MPa: float, line: Line, label: str, *,
    color: str = "", width: float = 1.8,
) -> None:  # fmt: skip
    """Draw the flow over a rising ramp, and of a valve with hysteresis over the falling one."""
    run = runs.ramps[drive, dp_MPa]
    top, color = int(np.argmax(run.command)), color or COLOURS[dp_MPa]
    branches = [(slice(0, top + 1, EVERY), width, label)]
    if runs.valve.plant.hysteresis_V:
        branches.append((slice(top, None, EVERY), 0.6 * width, "_closing"))
    for part, thick, name in branches:
        axes.plot(U_MAX_V * run.command[part], run.q_mean_L_min[part], ls=line, label=name, lw=thick, color=color)


def mark(axes: "Axes", u_V: float, y: float, dp_MPa: float, marker: str, what: str, hollow: bool = False) -> None:
    """Mark a number that the paper prints, in the colour of its pressure drop; hollow marks show what is below them."""
    (line,) = axes.plot(u_V, y, marker, ls="none", clip_on=False, zorder=6, label=f"printed: {what}")
    if hollow:
        line.set(mfc="none", mec=COLOURS[dp_MPa], mew=1.7, ms=11 if dp_MPa == DP0_MPA else 7)
    else:
        line.set(mfc=COLOURS[dp_MPa], mec=BLACK, mew=1.0, ms=7)


def mark_without(axes: "Axes", runs: ValveRuns, dp_MPa: float) -> None:
    """Mark dead zone and largest flow without compensator."""
    printed = printed_at(runs.valve.published, dp_MPa)
    dead_zone_V = float(printed.dead_zone_percent) / 100 * U_MAX_V
    mark(axes, dead_zone_V, runs.valve.level_L_min, dp_MPa, "^", "dead zone")
    mark(axes, U_MAX_V, float(printed.flow), dp_MPa, "s", "largest flow")


def mark_with(axes: "Axes", runs: ValveRuns, dp_MPa: float) -> None:
    """Mark dead zone and largest flow with compensator."""
    valve = runs.valve.published
    dead_zone_V = float(valve.residual_percent) / 100 * U_MAX_V
    mark(axes, dead_zone_V, runs.valve.level_L_min, dp_MPa, "v", "dead zone, with", hollow=True)
    mark(axes, U_MAX_V, float(printed_at(valve, dp_MPa).flow_with), dp_MPa, "o", "largest flow, with", hollow=True)


def draw_floor(axes: "Axes", runs: ValveRuns) -> None:
    """Draw the flow at which the meter starts."""
    if runs.valve.level_L_min:
        axes.axhline(runs.valve.level_L_min, color=GREY, ls=(0, (1, 3)), lw=1.2, label="meter's floor")


def draw_both(axes: "Axes", panel: Panel) -> None:
    """Draw the flow without and with compensator, and mark what is printed of it."""
    runs, by = panel
    for dp_MPa in PRESSURES_MPA:
        draw_ramp(axes, runs, Drive(DIRECT), dp_MPa, WITHOUT, f"without, {dp_MPa:g} MPa")
        draw_ramp(axes, runs, Drive(by), dp_MPa, WITH, f"with, {dp_MPa:g} MPa")
        mark_without(axes, runs, dp_MPa)
        mark_with(axes, runs, dp_MPa)
    draw_floor(axes, runs)
