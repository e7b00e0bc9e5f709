"""What a design costs, in a person's words: dead zone that remains, flow at the edge, drive at full command."""

from fractions import Fraction

from dzdesign.design.compensator import Compensator
from dzdesign.identify.model import SideModel, TestResult, ValveModel


def costs_of(compensator: Compensator, valve: ValveModel) -> tuple[str, ...]:
    """Return one line per test and per choice."""
    lines = []
    for sign in compensator.signals.signs:
        name = "positive" if sign > 0 else "negative"
        label = "" if compensator.negative is None else f"{name} side, "
        side = valve.sides[name]
        lines += [label + _cost_of_test(compensator, test, sign) for test in side.tests]
        lines += [label + line for line in _cost_of_side(compensator, side, sign)]
    low, high = (float(end) for end in compensator.positive.certificate.dp_MPa)
    lines.append(
        f"outside {low:.2f} to {high:.2f} MPa the nearest tested beta is held and nothing is certified; "
        f"a pressure difference below -{compensator.reverse_codes} codes is taken as a failed sensor: smallest beta"
    )
    return tuple(lines + _cost_of_options(compensator))


def _cost_of_test(compensator: Compensator, test: TestResult, sign: int) -> str:
    """Say what remains at one tested pressure drop."""
    signals, u_max = compensator.signals, float(compensator.u_max_V)
    command = signals.command
    code = round(signals.dp_code(Fraction(repr(test.dp_MPa))))

    def drive_at(from_zero: int) -> float:
        return float(compensator.drive(command.zero_code + command.direction(sign) * from_zero, code, sign))

    span, edge = command.span(sign), compensator.edge_codes
    offset, at_edge, full = drive_at(0), drive_at(edge), drive_at(span)
    parts = [f"{test.dp_MPa:.2f} MPa: offset {offset * u_max:.3f} V"]
    for name, knee in (("opening", test.u_knee_rising_V), ("closing", test.u_knee_falling_V)):
        if knee is not None and knee >= offset * u_max:
            left = _residual(knee / u_max, offset, at_edge, full, edge / span)
            parts.append(f"dead zone that remains on {name} {left:.2%} of command (knee)")
        elif knee is not None:
            above = offset * u_max - knee
            parts.append(f"flow at zero command on {name}: the offset lies {above:.3f} V above the knee")
    if edge and test.u_knee_falling_V is not None:
        flow = test.slope_L_min_V * max(at_edge * u_max - test.u_knee_falling_V, 0.0)
        parts.append(f"flow on closing at the edge's end {flow:.2f} L/min")
    parts.append(f"drive at full command {full:.2%}")
    return ", ".join(parts)


def _residual(knee: float, offset: float, at_edge: float, full: float, edge: float) -> float:
    """Return the command at which the drive reaches a threshold: two straight parts, with their corner at the edge."""
    if knee <= at_edge and edge:
        return edge * (knee - offset) / (at_edge - offset) if at_edge > offset else 0.0
    return edge + (1 - edge) * (knee - at_edge) / (full - at_edge)


def _cost_of_side(compensator: Compensator, side: SideModel, sign: int) -> list[str]:
    lines = []
    if side.trend == "increasing":
        lines.append(
            "the threshold grows with the pressure drop, so a pressure signal that reads too high raises the offset: a "
            "broken wire of sensor B is not recognised unless it has a live zero; monitor the sensors outside"
        )
    certificate = compensator.side(sign).certificate
    lines.append(
        f"the table's offset stays {1e3 * certificate.mean_loss_V:.2f} mV under the certified curve on average, "
        f"{1e3 * certificate.largest_loss_V:.2f} mV at most"
    )
    guard = certificate.guard
    if guard != "closing":
        lines.append(
            f"the {guard} threshold is guarded: at zero command, after closing, flow may remain, up to what the valve "
            "passes between its closing threshold and this offset"
        )
    return lines


def _cost_of_options(compensator: Compensator) -> list[str]:
    signals, amplifier = compensator.signals, compensator.amplifier
    lines = []
    if amplifier.dither_counts:
        peak = amplifier.dither_counts / signals.compare_max
        frequency = signals.tick_Hz / (2 * amplifier.dither_ticks)
        lines.append(
            f"dither of {frequency:.0f} Hz and {peak:.2%} of full drive: the offset stands lower by that much, so that "
            "zero command stays shut at the wave's top"
        )
    if amplifier.has_ramp:
        lines.append("ramps hold for zero command too: the valve closes no faster than they let it")
    if amplifier.compare_limit < signals.compare_max:
        lines.append(f"the drive ends at {amplifier.compare_limit / signals.compare_max:.1%} of full")
    if amplifier.window_codes:
        share = amplifier.window_codes / signals.command.span(1)
        lines.append(f"a command must pass zero by {share:.2%} before the other solenoid is driven")
    return lines
