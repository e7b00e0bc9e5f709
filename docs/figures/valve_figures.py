"""Figures of the valve and of what is identified: dead zone, thresholds, beta, staircase."""

from typing import TYPE_CHECKING

import numpy as np

from figures.example import Example
from figures.frame import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, note, panels, span

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

L_MIN = 1e-3 / 60
#: Row of the example's test at 1 MPa.
AT_1_MPA = 1


def dead_zone(example: Example) -> "Figure":
    """Flow over command at 1 MPa, without and with the compensator: the generated C drives the simulated valve."""
    figure, (axes,) = panels(3.5)
    direct, driven = (example.ramp(1.0, mode) for mode in ("direct", "compensated"))
    for run, colour, line, name in (
        (direct, ORANGE, "--", "without the compensator"),  # the dashes of the report
        (driven, BLUE, "-", "with the compensator"),
    ):
        axes.plot(100 * run.command, run.q_mean_L_min, line, color=colour, lw=1.8, label=name)
    opens = 100 * direct.command[np.argmax(direct.q_mean_L_min > 0.01)]
    span(axes, 0, opens, 0.45, f"dead zone: {opens:.0f} % of command")  # at the axis: no curve crosses its text there
    note(axes, "closing happens\nat a lower command\nthan opening", (80, 3.2), (56, 1.2))
    axes.set(xlabel="command (% of full)", ylabel="flow at 1 MPa (L/min)", xlim=(0, 100), ylim=(0, None))
    axes.legend(loc="upper left")
    return figure


def thresholds(example: Example) -> "Figure":
    """The edge at 1 MPa: samples, straight lines, and knee, level and onset of both branches."""
    figure, axes = panels(3.9, 2, sharey=True)
    side = example.found.sides["positive"]
    item, test = side.described.tests[AT_1_MPA], side.model.tests[AT_1_MPA]
    level = side.model.certificate.level_L_min
    names = ("opening (rising command)", "closing (falling command)")
    opening = test.u_knee_rising_V, test.u_onset_rising_V
    closing = test.u_knee_falling_V, test.u_onset_falling_V
    for panel, shape, (knee, onset), name, colour in zip(
        axes, item.shapes, (opening, closing), names, (BLUE, ORANGE), strict=True
    ):
        read, at_level = shape.prepared.branch, knee + level * L_MIN / shape.slope
        one = read.ramps[0]
        panel.plot(read.u[one], read.q[one] / L_MIN, ".", ms=2, color=GREY, alpha=0.35, label="samples of one ramp")
        u = np.array([knee, 6.3])
        panel.plot(u, (u - knee) * shape.slope / L_MIN, color=colour, lw=1.8, label="straight part, extended")
        panel.axhline(level, color=BLACK, ls=":", lw=1.2, label=f"what counts as flow, {level:.2f} L/min")
        for value, height, marker, size, face in (
            (knee, 0.0, "o", 6, colour), (at_level, level, "s", 6, colour), (onset, 0.0, "D", 11, "none"),
        ):  # fmt: skip
            panel.plot(value, height, marker, ms=size, mec=BLACK, mfc=face, zorder=5)
        note(panel, f"knee {knee:.3f} V\n(dot)", (knee + 0.45, -0.3), (knee + 0.03, -0.02), ha="left")
        note(panel, f"onset {onset:.3f} V\n(diamond)", (onset - 0.3, -0.62), (onset - 0.02, -0.08))
        note(panel, f"level {at_level:.3f} V\n(square)", (at_level - 0.3, 1.9), (at_level, level + 0.1))
        panel.set(title=name, xlabel="command (V)", xlim=(4.55, 6.4), ylim=(-0.95, 3.4))
    axes[0].set_ylabel("flow at 1 MPa (L/min)")
    handles, labels = axes[0].get_legend_handles_labels()
    handles[0].set(markersize=5)
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def beta(example: Example) -> "Figure":
    """The thresholds over the pressure drop, and beta: the closing one relative to its value at dP0."""
    figure, (left, right) = panels(3.4, 2)
    side = example.side
    dp = np.array(side.beta.dp_MPa)
    for values, errors, marker, colour, name in (
        (
            [test.u_knee_rising_V for test in side.tests],
            [t.u_knee_rising_se_V for t in side.tests],
            "^",
            BLUE,
            "opening",
        ),
        (
            [test.u_knee_falling_V for test in side.tests],
            [t.u_knee_falling_se_V for t in side.tests],
            "v",
            ORANGE,
            "closing",
        ),
    ):
        left.errorbar(
            dp, values, 3 * np.array(errors), fmt=marker, color=colour, ms=6, capsize=3, label=f"knee, {name}"
        )
    fall = side.trend_change_V
    left.set(xlabel="pressure drop (MPa)", ylabel="threshold (V)", title=f"The threshold falls by {-1e3 * fall:.0f} mV")
    left.legend(title="bars: 3 standard errors", title_fontsize=8)
    right.plot(dp, side.beta.beta, "o-", color=PURPLE, label="beta, identified")
    fine = np.linspace(0.0, 6.0, 241)
    held = example.offset_V(fine) / side.curve.u_min0_V
    right.plot(fine, held, color=BLACK, ls="--", lw=1.2, label="beta, as the firmware has it")
    right.axvline(side.reference.dp_MPa, color=GREY, ls=":", lw=1.2)
    note(right, "dP0", (side.reference.dp_MPa + 0.4, 0.9745))
    note(right, "below dP0 the paper\nholds beta at 1", (2.9, 1.0075), (0.6, 1.001))
    right.set(
        xlabel="pressure drop (MPa)", ylabel="beta = u_min(dP) / u_min0 (1)", title="beta, straight between the tests"
    )
    right.legend(loc="lower left")
    right.set_ylim(0.957, 1.0125)
    return figure


def _steps(axes: "Axes", side: object) -> None:
    """Draw what is certified at the tests and between them."""
    axes.plot(side.curve.bound_dp_MPa, side.curve.bound_V, color=GREEN, lw=2.5, label="certified bound")


def staircase(example: Example) -> "Figure":
    """Thresholds, bounds, what is certified between the tests and the offset below that; right enlarged."""
    figure, axes = panels(3.9, 2, width_ratios=(3, 2))
    side = example.side
    fine = np.linspace(side.beta.dp_MPa[0], side.beta.dp_MPa[-1], 1801)
    offset = example.offset_V(fine)
    for panel in axes:
        dp = side.beta.dp_MPa
        panel.plot(dp, [t.u_guard_V for t in side.tests], "v", color=ORANGE, ms=6, label="closing threshold")
        panel.plot(
            dp, [t.u_guard_lower_V for t in side.tests], "_", color=BLACK, ms=13, mew=2, label="its 99 % lower bound"
        )
        _steps(panel, side)
        panel.plot(fine, offset, color=BLUE, lw=1.2, label="offset at zero command, after rounding")
        panel.set(xlabel="pressure drop (MPa)")
    axes[0].set(ylabel="command (V)", title="the tested interval")
    axes[1].set(title="two tests, enlarged", xlim=(1.85, 3.15), ylim=(5.085, 5.175))
    note(axes[1], "between two tests the bound\nallows for a bend", (2.45, 5.145), (2.5, 5.098))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure
