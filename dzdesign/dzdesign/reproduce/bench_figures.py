"""The paper's figures 12 and 13, the pulse, and 20 to 22, the flow over the load and with the oil's temperature."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.derivation.account.published import (
    DUTY_COMMAND_V,
    DUTY_WITH_PERCENT,
    DUTY_WITHOUT_PERCENT,
    LOAD_COMMANDS_V,
    LOAD_DP_MPA,
    PWM_AMPLITUDE_V,
    U_MAX_V,
)
from dzdesign.identify.plots.frame import finish
from dzdesign.reproduce.artefact import Driver
from dzdesign.reproduce.assumptions import OILS
from dzdesign.reproduce.figure_parts import (
    BLACK,
    COLOURS,
    EVERY,
    LAWS,
    NO_BETA,
    WITH,
    WITHOUT,
    Line,
    draw_floor,
    titled,
)
from dzdesign.reproduce.load_and_oil import LoadAndOil
from dzdesign.reproduce.rows import Subject
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRODUCT, ValveRuns, paper_duty_percent
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PERIODS_DRAWN = 4
BLUE, ORANGE = COLOURS.values()
OIL_COLOURS: tuple[str, ...] = (BLUE, BLACK, ORANGE)
OIL_LINES: tuple[Line, ...] = ("-", NO_BETA, "-.")


def pulse(number: int, valves: Sequence[ValveRuns], with_compensator: bool) -> "Figure":
    """Figs. 12 and 13: the pulse at 2 V without and with compensator; Fig. 13 does not say of which valve."""
    what = "with compensator" if with_compensator else "without compensator"
    printed = DUTY_WITH_PERCENT if with_compensator else DUTY_WITHOUT_PERCENT
    figure = titled(
        number, 4.8 if with_compensator else 3.2, f"PWM signal {what}, command of {DUTY_COMMAND_V} V",
        f"dashed: the printed duty cycle, {printed} %; amplitude as printed, {PWM_AMPLITUDE_V} V",
    )  # fmt: skip
    rows = valves if with_compensator else valves[:1]
    every = np.atleast_1d(figure.subplots(len(rows), 1, sharex=True, sharey=True))
    for axes, runs in zip(every, rows, strict=True):
        if with_compensator:
            name = runs.valve.published.name
            _draw_pulse(axes, paper_duty_percent(runs.valve.published), WITH, BLUE, f"{name}, {LAWS[PAPER]}")
            if runs.product_duty_percent is not None:
                _draw_pulse(axes, runs.product_duty_percent, WITH, ORANGE, f"{name}, {LAWS[PRODUCT]}")
            axes.set_title(name)
        else:
            _draw_pulse(axes, 100 * DUTY_COMMAND_V / U_MAX_V, WITH, BLUE, "command as duty cycle")
        _draw_pulse(axes, float(printed), NO_BETA, BLACK, "printed duty cycle")
        axes.set(ylabel="PWM signal u_O (V)", ylim=(-0.2, 1.15 * float(PWM_AMPLITUDE_V)))
    every[-1].set(xlabel="time (ms)", xlim=(0, 1e3 * PERIODS_DRAWN * PWM_PERIOD_S))
    return finish(figure, 2 if with_compensator else 1)


def _draw_pulse(axes: "Axes", duty_percent: float, line: Line, color: str, label: str) -> None:
    """Draw a pulse that begins each period of the PWM high."""
    high, period_ms = float(PWM_AMPLITUDE_V), 1e3 * PWM_PERIOD_S
    starts = np.arange(PERIODS_DRAWN) * period_ms
    ends = starts + period_ms * duty_percent / 100
    time = np.stack([starts, starts, ends, ends, starts + period_ms])
    level = np.tile([[0.0], [high], [high], [0.0], [0.0]], PERIODS_DRAWN)
    axes.plot(time.T.ravel(), level.T.ravel(), ls=line, color=color, lw=1.8, label=f"{label}: {duty_percent:.1f} %")


def effect_of_load(number: int, subject: Subject) -> "Figure":
    """Figs. 20 and 21: flow over the load at a constant pressure drop, one command each."""
    command = LOAD_COMMANDS_V[number - 20]
    figure = titled(
        number, 4.2, f"impact of loads on the flow (first valve, {LOAD_DP_MPA} MPa, command of {command} V)",
        "with compensator; the loads are assumed: the paper does not give them",
    )  # fmt: skip
    axes = figure.subplots()
    for under, runs in zip(subject.load_and_oil, subject.all, strict=True):
        hysteresis_V = runs.valve.plant.hysteresis_V
        with_it = f", hysteresis of {hysteresis_V:g} V" if hysteresis_V else ""
        for by, color in ((PAPER, BLUE), (PRODUCT, ORANGE)):
            line, width = (NO_BETA, 1.4) if hysteresis_V else (WITH, 2.2)
            if (by, command) in under.over_load:
                flow, label = under.over_load[by, command], LAWS[by] + with_it
                axes.plot(under.load_MPa, flow, ls=line, lw=width, color=BLACK if hysteresis_V else color, label=label)
    axes.set(xlabel="load pressure (MPa)", ylabel="flow Q (L/min)", ylim=(0, 1.15 * axes.get_ylim()[1]))
    return finish(figure, 2)


def effect_of_oil(subject: Subject) -> "Figure":
    """Fig. 22: flow over the command with each oil."""
    figure = titled(
        22, 4.8, f"impact of oil temperature on the flow (first valve, {LOAD_DP_MPA} MPa)",
        "dotted: without compensator; temperatures and oil are assumed: the paper does not give them",
    )  # fmt: skip
    every = figure.subplots(1, 2)
    under = subject.load_and_oil[0]
    by = PRODUCT if (PRODUCT, OILS[0].temperature_C) in under.oils else PAPER
    _draw_oils(every[0], under, by)
    draw_floor(every[0], subject.runs)
    middle = under.oils[by, OILS[1].temperature_C]
    for oil, color, line in zip(OILS, OIL_COLOURS, OIL_LINES, strict=True):
        run = under.oils[by, oil.temperature_C]
        rising = slice(0, int(np.argmax(run.command)) + 1, EVERY)
        more = run.q_mean_L_min[rising] - middle.q_mean_L_min[rising]
        every[1].plot(U_MAX_V * run.command[rising], more, ls=line, color=color, lw=1.5)
    every[0].set(ylabel="flow Q (L/min)", ylim=(0, None), title=LAWS[by])
    every[1].set(ylabel="change of the flow (L/min)", title=f"{LAWS[by]}, less that at {OILS[1].temperature_C:g} °C")
    for axes in every:
        axes.set(xlabel="command u_i (V)", xlim=(0, 1.02 * U_MAX_V))
    return finish(figure, 2)


def _draw_oils(axes: "Axes", under: LoadAndOil, compensator: Driver) -> None:
    """Draw the rising ramps with each oil, without compensator and with one."""
    for oil, color, line in zip(OILS, OIL_COLOURS, OIL_LINES, strict=True):
        for by in (DIRECT, compensator):
            run = under.oils[by, oil.temperature_C]
            rising = slice(0, int(np.argmax(run.command)) + 1, EVERY)
            style, label = (WITHOUT, f"_{oil}") if by == DIRECT else (line, f"with, {oil.temperature_C:g} °C")
            u_V = U_MAX_V * run.command[rising]
            axes.plot(u_V, run.q_mean_L_min[rising], ls=style, color=color, lw=1.5, label=label)
