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
        title = f"Remaining dead zone in command: at the onset (knee) and read at {read_at}"
        title += "" if compensator.negative is None else f", {side} side"
        columns = _columns(units, transition=compensator.transition_codes > 0, machine=compensator.machine is not None)
        put_rows(console, title, costs, columns)


def _columns(
    units: "RecordedUnits", *, transition: bool, machine: bool
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
        "onset: opening": lambda each: onset(each, "opening"),
        "onset: closing": lambda each: onset(each, "closing"),
        "opening at the machine's other end": lambda each: (
            "never" if each.last_opening is not None and each.last_opening > 1 else share(each.last_opening)
        ),
        "read: opening": lambda each: share(each.read.get("opening")),
        "read: closing": lambda each: share(each.read.get("closing")),
        "ideal line": lambda each: share(each.ideal),
    }
    if not machine:
        del columns["opening at the machine's other end"]
    if transition:
        columns[f"flow on closing at transition's end ({units.label('L/min')})"] = lambda each: (
            "-" if each.at_end_L_min is None else units.number(each.at_end_L_min, ".2f L/min")
        )
    return columns | {"drive at full command": lambda each: each.drive_text()}
