"""Figures of the law and of the firmware: over-compensation, residual dead zone, transition, PWM, every input."""

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.codegen.f28335.target import ISR_DELAY_S
from dzdesign.codegen.project import target_named
from figures.example import Example
from figures.frame import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, note, panels, span

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def over_compensation(example: Example) -> "Figure":
    """Offset and closing threshold over the pressure drop without and with beta, and the flow at zero command."""
    figure, (left, right) = panels(3.7, 2)
    side = example.side
    dp = np.array(side.beta.dp_MPa)
    closing = np.array([test.u_knee_falling_V for test in side.tests])
    fixed = np.full(dp.size, side.curve.u_min0_V)
    left.plot(dp, closing, "v-", color=ORANGE, label="closing threshold")
    left.plot(dp, fixed, "--", color=PURPLE, lw=1.8, label="offset without beta")
    fine = np.linspace(dp[0], dp[-1], 181)
    left.plot(fine, example.offset_V(fine), "-", color=BLUE, lw=1.8, label="offset with beta")
    left.fill_between(dp, closing, fixed, where=fixed > closing, interpolate=True, color=PURPLE, alpha=0.18, hatch="//")
    note(left, "over-compensation:\nflow at zero command", (3.9, 5.195), (4.2, 5.11))
    left.set(xlabel="pressure drop (MPa)", ylabel="command (V)", ylim=(4.97, 5.27))
    left.legend(loc="lower left")
    level = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    rows = [
        [example.ramp(each, mode).q_largest_L_min[-1] for each in level] for mode in ("without beta", "compensated")
    ]
    for shift, flows, colour, hatch, name in (
        (-0.18, rows[0], PURPLE, "//", "without beta"),
        (0.18, rows[1], BLUE, "", "with beta"),
    ):
        bars = right.bar(level + shift, flows, 0.34, color=colour, hatch=hatch, edgecolor="white", label=name)
        right.bar_label(bars, [f"{flow:.2f}" if flow else "0" for flow in flows], fontsize=7.5, padding=1)
    right.set(xlabel="pressure drop (MPa)", ylabel="flow at zero command (L/min)", ylim=(0, 1.25 * max(rows[0])))
    right.legend(loc="upper left")
    return figure


def residual(example: Example) -> "Figure":
    """Drive over command at 1 MPa: where it crosses both thresholds, and what is left of the dead zone."""
    figure, (axes,) = panels(3.8)
    test, compensator = example.side.tests[1], example.compensator
    code = int(compensator.signals.pair(1).dp_code(Fraction(test.dp_MPa)))
    command = np.arange(0, 500)
    drive = 10 * np.array([float(compensator.drive(int(each), code)) for each in command])
    share = 100 * command / 4095
    axes.plot(share, drive, color=BLUE, lw=2, label="output of the law, 1 MPa")
    for height, colour, name in (
        (test.u_knee_rising_V, SKY, "valve opens"),
        (test.u_knee_falling_V, ORANGE, "valve closes"),
        (test.u_guard_lower_V, BLACK, "certified bound"),
    ):
        axes.axhline(height, color=colour, lw=1.6, ls="-." if name == "certified bound" else "-")
        under = name == "certified bound"
        axes.annotate(
            f"{name}, {height:.3f} V", (11.9, height), (0, -11 if under else 3), textcoords="offset points",
            ha="right", fontsize=8,
        )  # fmt: skip
    opens, closes = (share[np.argmax(drive > height)] for height in (test.u_knee_rising_V, test.u_knee_falling_V))
    axes.vlines((opens, closes), 5.05, (test.u_knee_rising_V, test.u_knee_falling_V), color=GREY, ls=":", lw=1)
    span(axes, 0, opens, 5.075, "")
    note(axes, f"residual on opening: {opens:.1f} %", (opens + 0.12, 5.075), ha="left")
    span(axes, 0, closes, 5.115, "")
    note(axes, f"residual on closing: {closes:.1f} %", (closes + 0.12, 5.115), ha="left")
    note(axes, "offset at zero command", (5.2, 5.152), (0.05, drive[0]), ha="left")
    axes.set(xlabel="command (% of full)", ylabel="output (V)", xlim=(0, 12), ylim=(5.05, 5.62))
    axes.legend(loc="upper left")
    return figure


def transition(example: Example) -> "Figure":
    """Drive over the first per cents of command, without and with a transition."""
    figure, (axes,) = panels(3.5)
    test = example.side.tests[1]
    command = np.arange(0, 130)
    for compensator, colour, line, name in (
        (example.without_transition, BLUE, "--", "--transition off"),
        (example.compensator, GREEN, "-", "with zero band and transition"),
    ):
        code = int(compensator.signals.pair(1).dp_code(Fraction(test.dp_MPa)))
        drive = 10 * np.array([float(compensator.drive(int(each), code)) for each in command])
        axes.plot(100 * command / 4095, drive, line, color=colour, lw=2, label=name)
    for height, name in ((test.u_knee_rising_V, "valve opens"), (test.u_knee_falling_V, "valve closes")):
        axes.axhline(height, color=ORANGE, lw=1.4)
        axes.annotate(
            f"{name}, {height:.3f} V", (3.15, height), (0, -11), textcoords="offset points", ha="right", fontsize=8
        )
    codes = example.compensator.transition_end
    end = 100 * codes / 4095
    axes.axvline(100 * example.compensator.zero_band_codes / 4095, color=GREY, ls=":", lw=1.2)
    axes.axvline(end, color=GREY, ls=":", lw=1.2)
    note(axes, f"transition's end: code {codes},\n{end:.2f} % of command", (1.55, 5.27), (end, 5.3))
    axes.set(xlabel="command (% of full)", ylabel="output at 1 MPa (V)", xlim=(0, 3.17))
    axes.legend(loc="upper left", bbox_to_anchor=(0.27, 0.95))
    return figure


def pwm(example: Example) -> "Figure":
    """The PWM's counter and output of the f28335 target, its samples and interrupts, while the command grows."""
    figure, (axes,) = panels(3.6)
    inputs = target_named("f28335").inputs()
    period, ticks, full = 1e3 / inputs.tick_Hz, inputs.tick_Hz // inputs.sample_Hz, inputs.compare_max
    periods = 6
    # A value is written by the interrupt after a sample, and loaded when the next period starts.
    shares = [0.50, 0.56, 0.56, 0.64, 0.64, 0.74]
    for tick, share in enumerate(shares):
        start = tick * period
        first = {name: name if tick == 0 else None for name in ("PWM counter", "compare value", "output on")}
        axes.plot((start, start + period), (0, 1), color=GREY, lw=1.1, label=first["PWM counter"])
        axes.plot((start, start + period), (share, share), color=BLUE, lw=2, label=first["compare value"])
        axes.fill_between((start, start + period * share), -0.5, -0.2, color=ORANGE, lw=0, label=first["output on"])
        sampled = tick % ticks == 0
        axes.plot(start + float(ISR_DELAY_S) * 1e3, 1.13, "|", color=BLACK, ms=9, mew=1.6,
                  label="interrupt, 20 µs later" if tick == 0 else None)  # fmt: skip
        if sampled:
            axes.plot(start, 1.13, "v", color=PURPLE, ms=7, label="samples" if tick == 0 else None)
            axes.axvline(start, color=PURPLE, lw=0.8, ls=":")
    axes.plot((0, periods * period), (-0.5, -0.5), color=BLACK, lw=0.8)
    note(axes, "sampled here ...", (0.98, 0.87), (2 * period, 1.07), ha="left")
    note(axes, "... drives from here on", (1.27, 0.12), (3 * period, 0.62), ha="left")
    axes.set(
        xlabel="time (ms)", xlim=(-0.03, periods * period + 0.03), ylim=(-0.55, 1.25), yticks=(0, 0.5, 1),
        yticklabels=("0", f"{full // 2}", f"{full}"), ylabel="count",
        title=f"PWM of {inputs.tick_Hz / 1e3:g} kHz, {inputs.sample_Hz} samples a second",
    )  # fmt: skip
    figure.legend(loc="outside lower center", ncols=5)
    return figure


def every_input(example: Example) -> "Figure":
    """The compare value over all pairs of command and difference codes, a coarse grid of the exact law."""
    figure, (axes,) = panels(3.9)
    compensator = example.compensator
    top, widest = compensator.signals.code_max, compensator.signals.pair(1).largest_difference
    commands = np.linspace(0, top, 41).astype(int)
    differences = np.linspace(-widest, widest, 64).astype(int)
    values = np.array([[compensator.compare(int(u), int(dp)) for u in commands] for dp in differences])
    drawn = axes.pcolormesh(commands, differences, values, cmap="cividis", shading="nearest", rasterized=True)
    figure.colorbar(drawn, label="compare value (60000: full output)")
    tested = [int(compensator.signals.pair(1).dp_code(Fraction(end))) for end in example.side.valid_dp_MPa]
    for code in tested:
        axes.axhline(code, color="white", lw=1.2, ls="--")
    axes.axhline(-compensator.reverse_codes, color="white", lw=1.2, ls=":")
    note(axes, "tested interval of pressure: certified", (2050, sum(tested) / 2), color="white")
    note(axes, "below: a sensor has failed, smallest beta", (2050, -1700), color="white")
    note(axes, "above: lowered with the continued bound", (2050, 2300), color="white")
    total = (top + 1) * (2 * widest + 1)
    axes.set(
        xlabel="code of the command",
        ylabel="difference of both pressure codes",
        title=f"{total} pairs, each of them tried",
    )
    return figure
