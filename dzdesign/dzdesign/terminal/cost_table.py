"""The table of what a design leaves at the tested pressure drops, as `dzdesign design` prints it."""

from typing import TYPE_CHECKING

from dzdesign.terminal.page import new_console, put_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.costs_at_tests import CostAtTest


def print_costs_at_tests(compensator: "Compensator", console: "Console | None" = None) -> None:
    """Print a table for each side: dead zones in percent of command, flow and drive."""
    from dzdesign.design.costs_at_tests import costs_at_tests
    from dzdesign.design.signals import SIDE_NAMES

    console = console or new_console()
    for sign in compensator.signals.signs:
        side = SIDE_NAMES[sign]
        units, costs = compensator.valve.recorded_units.of_side(side), costs_at_tests(compensator, sign)
        read_at = units.text(compensator.reading_flow_L_min, ".2f L/min")
        title = (
            "Remaining dead zone in % of full command: where the output reaches the valve's knee, and where the flow "
            f"reaches {read_at}"
        )
        title += "" if compensator.negative is None else f", {side} side"
        transition, machine = compensator.transition_codes > 0, compensator.machine is not None
        columns = _columns(units, read_at, transition=transition, machine=machine)
        put_rows(console, title, costs, columns)


def _columns(
    units: "RecordedUnits", read_at: str, *, transition: bool, machine: bool
) -> "dict[str, Callable[[CostAtTest], str]]":
    def share(value: float | None) -> str:
        return "-" if value is None else f"{value:.2%}"

    def onset(cost: "CostAtTest", branch: str) -> str:
        above = cost.above_knee_V.get(branch)
        if above is None:
            return share(cost.onset.get(branch))
        return f"flow at zero, {units.text(above, '.3f dV')} above"

    columns: dict[str, Callable[[CostAtTest], str]] = {
        f"dP ({units.label('MPa')})": lambda each: units.number(each.dp_MPa, ".2f MPa"),
        f"offset ({units.label('V')})": lambda each: units.number(each.offset_V, ".3f V"),
        "to knee: opening": lambda each: onset(each, "opening"),
        "to knee: closing": lambda each: onset(each, "closing"),
        "opening at the machine's other end": lambda each: (
            "never" if each.last_opening is not None and each.last_opening > 1 else share(each.last_opening)
        ),
        f"to {read_at}: opening": lambda each: share(each.read.get("opening")),
        f"to {read_at}: closing": lambda each: share(each.read.get("closing")),
        f"to {read_at}: ideal": lambda each: share(each.ideal),
    }
    if not machine:
        del columns["opening at the machine's other end"]
    if transition:
        columns[f"flow at transition's end, closing ({units.label('L/min')})"] = lambda each: (
            "-" if each.at_end_L_min is None else units.number(each.at_end_L_min, ".2f L/min")
        )
    return columns | {"largest output": lambda each: each.drive_text()}
