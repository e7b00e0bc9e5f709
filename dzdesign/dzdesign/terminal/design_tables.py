"""A design as `dzdesign design` prints it: the law, its certificate and costs, and each way with the hysteresis."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dzdesign.terminal.page import Column, new_console, put_facts, put_line, put_rows

if TYPE_CHECKING:
    from fractions import Fraction

    from rich.console import Console

    from dzdesign.design.compensator import Compensator
    from dzdesign.design.redesign import HysteresisChoice

DITHER = (
    "Dither also reduces the hysteresis, but it shifts the thresholds. If the amplifier uses dither, record the ramps "
    "with it, and use identify --dithered and design --dither."
)
HEADING = (
    "Remaining dead zone and hysteresis in % of full command. To the knee: largest over the whole tested range. To a "
    "flow: largest at the tests. Hysteresis: mean and largest of the tests"
)
#: Of the inverse play where it would be an improvement: the table is of the recorded sweeps.
PLAY = (
    "The play (backlash inverse) subtracts the hysteresis measured on full sweeps. In small command cycles the "
    "hysteresis may be smaller. The play may then subtract too much, up to its full width. Try small cycles on the "
    "machine."
)


def _rational(value: "Fraction") -> str:
    return f"{value} = {float(value):.5f}"


def print_design(compensator: "Compensator") -> None:
    """Print a compensator, and what each way with the hysteresis would leave."""
    from dzdesign.design.position_loop import in_words
    from dzdesign.design.redesign import hysteresis_choices, without_sensors

    print_compensator(compensator)
    for line in in_words(compensator):
        put_line(new_console(), line)
    read_at = compensator.valve.recorded_units.text(compensator.reading_flow_L_min, ".2f L/min")
    choices = hysteresis_choices(compensator)
    beside = (without_sensors(compensator), *choices) if choices else ()
    print_choices(beside, read_at, dithered=compensator.valve.dither is not None)


def print_compensator(compensator: "Compensator", console: "Console | None" = None) -> None:
    """Print the law, the certificate, what the choices cost and where it ends."""
    from dzdesign.derivation.law import law
    from dzdesign.design.costs import design_warnings, lines_of_tests
    from dzdesign.design.pressure_inputs import signals_in_words
    from dzdesign.report.sections.provenance import remaining_section

    chosen, units = law(compensator.law), compensator.valve.recorded_units
    lines = [
        f"law: '{chosen.name}', Eq. {chosen.equation}: output u_O = {chosen.output}, at command u_i",
        *signals_in_words(compensator),
    ]
    for sign in compensator.signals.signs:
        side = compensator.side(sign)
        certificate = side.certificate
        low, high = (float(end) for end in certificate.dp_MPa)
        label = f"{compensator.valve.side_name(sign)}: " if compensator.two_sided else ""
        lines += [
            f"{label}the law's line: u_min0/u_max = {_rational(side.u_min0_over_u_max)} at dP0 ({side.start}), drive "
            f"range of the law k x_max/u_max = {_rational(side.drive_range_over_u_max)} (from there to full output)",
            f"{label}certificate (covers {compensator.certified_of}): the offset stays below the "
            f"{100 * certificate.confidence:.6g}% lower bound of the {certificate.guard} threshold "
            f"{units.span(low, high, '.3f MPa')}, at every pressure code; "
            + (
                compensator.valve.side(sign).none_in_words(certificate.guard, units)
                if certificate.zero_flow_L_min is None
                else compensator.valve.side(sign).zero_flow_in_words(units)
            ),
            f"{label}{compensator.valve.side(sign).between_in_words(certificate.guard)}",
        ]
    if compensator.current_drive is not None:
        lines += compensator.current_drive.in_words(units)
    warnings = design_warnings(compensator)
    elsewhere = {*warnings, *(line for sign in compensator.signals.signs for line in lines_of_tests(compensator, sign))}
    console = console or new_console()
    for line in (*(f"warning: {line}" for line in warnings), *lines):
        put_line(console, line)
    put_facts(console, *remaining_section(compensator).tables)
    if compensator.machine is not None:
        from dzdesign.report.sections.law import budget_section

        budget = budget_section(compensator)
        put_facts(console, *budget.tables)
        for line in budget.lines:
            put_line(console, line)
    for line in compensator.costs:
        if line not in elsewhere:
            put_line(console, f"note: {line}")


def print_choices(
    choices: "Sequence[HysteresisChoice]", read_at: str, *, dithered: bool = False, console: "Console | None" = None
) -> None:
    """Print the choices, nothing where there are none; the recommended one is marked.

    Of a valve that was not recorded under a dither it is said what one would need.
    """
    if not choices:
        return
    console = console or new_console()

    def share(value: float | None) -> str:
        return "-" if value is None else f"{value:.2%}"

    columns: dict[str, Column[HysteresisChoice]] = {
        "choice": lambda each: each.given + (f" ({judged})" if (judged := each.judged) else ""),
        "opening dead zone, to knee": lambda each: share(each.onset),
        f"opening dead zone, to {read_at}": lambda each: share(each.reading),
        "hysteresis, mean": lambda each: share(each.hysteresis),
        "hysteresis, largest": lambda each: share(each.largest),
    }
    put_rows(console, HEADING, choices, columns)
    for each in choices:
        if each.refused:
            put_line(console, f"{each.given}: {each.refused}")
    for each in choices:
        if each.possible:
            put_line(console, f"{each.given} is possible, not recommended: {each.possible}.")
    if any(each.judged and "play" in each.given for each in choices):
        put_line(console, PLAY)
    if not dithered:
        put_line(console, DITHER)
