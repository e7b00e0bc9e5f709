"""Section on what a design leaves at the tested pressure drops: dead zone, flow on closing, drive."""

from collections.abc import Callable, Iterator, Sequence

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs import lines_of_tests
from dzdesign.design.costs_at_tests import CostAtTest, costs_at_tests
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, in_number_font, recorded, table_of

BRANCHES = ("opening", "closing")
NEVER = "never"


def remaining_section(compensator: Compensator) -> Section:
    """Return the section with a table a side."""
    return Section(tables=[_table(compensator, sign, costs) for sign, costs in _costs(compensator)])


def other_costs(compensator: Compensator) -> tuple[str, ...]:
    """Return the costs of a design without those that its table holds."""
    held = {line for sign, _ in _costs(compensator) for line in lines_of_tests(compensator, sign)}
    return tuple(line for line in compensator.costs if line not in held)


def _costs(compensator: Compensator) -> Iterator[tuple[int, Sequence[CostAtTest]]]:
    for sign in compensator.signals.signs:
        try:
            costs = costs_at_tests(compensator, sign)
        except InputError:  # an output that never opens the valve; the lines of its costs say so
            continue
        yield sign, costs


def _table(compensator: Compensator, sign: int, costs: Sequence[CostAtTest]) -> Table:
    units = compensator.valve.recorded_units.of_side(SIDE_NAMES[sign])
    read = units.text(compensator.reading_flow_L_min, ".2f L/min")
    caption = f"Dead zone by design, in per cent of command, at the onset (knee) and read at {read}"
    if compensator.negative is not None:
        caption += f"; {SIDE_NAMES[sign]} commands"
    columns: list[tuple[str, Callable[[CostAtTest], Cell]]] = [
        (f"dP ({units.label('MPa')})", lambda one: recorded(one.dp_MPa, ".2f MPa", units)),
        (f"offset ({units.label('V')})", lambda one: recorded(one.offset_V, ".3f V", units)),
        *((f"onset, {branch} (%)", _onset(branch, units)) for branch in BRANCHES),
        *((f"read, {branch} (%)", _read(branch)) for branch in BRANCHES),
        ("ideal line (%)", lambda one: _percent(one.ideal)),
    ]
    if compensator.machine is not None:
        columns.insert(4, ("opening at the machine's other end (%)", lambda one: _percent(one.last_opening)))
    if compensator.transition_codes > 0:
        flow = f"flow on closing at the transition's end ({units.label('L/min')})"
        columns.append((flow, lambda one: recorded(one.at_end_L_min, ".2f L/min", units)))
    columns.append(("drive at full command (%)", _drive))
    return table_of(caption, costs, *columns)


def _percent(share: float | None) -> Cell:
    if share is not None and share > 1:
        return in_number_font(NEVER)
    return in_number_font("–" if share is None else f"{100 * share:.2f}")


def _drive(cost: CostAtTest) -> Cell:
    """Return the drive at full command, and the command from which it no longer rises."""
    reached = "" if cost.limited_from is None else f" from {100 * cost.limited_from:.1f} % on"
    return in_number_font(f"{100 * cost.full:.2f}{reached}")


def _read(branch: str) -> Callable[[CostAtTest], Cell]:
    return lambda one: _percent(one.read.get(branch))


def _onset(branch: str, units: RecordedUnits) -> Callable[[CostAtTest], Cell]:
    """Return the dead zone to the knee, or by how much the offset lies above it."""

    def cell(one: CostAtTest) -> Cell:
        above = one.above_knee_V.get(branch)
        if above is None:
            return _percent(one.onset.get(branch))
        return Cell(text=f"none: {units.text(above, '.3f dV')} above the knee")

    return cell
