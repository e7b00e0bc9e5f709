"""Section on the uncertainty budget: what is counted between the recorded threshold and the largest offset."""

from collections.abc import Callable, Iterator

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine.accounting import reach_of_certificate
from dzdesign.design.machine.budget import ADDED_IN_FULL, Budget, BudgetLine
from dzdesign.report.compensator_sides import laws_of
from dzdesign.report.figures.budget import budget_figure
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, in_number_font, number, recorded, table_of

#: Pressure drops with a column of their own; all of them stand in the CSV.
COLUMNS = 6
#: Units of a half-width that a person may see in another one, and how many digits.
SHOWN_UNITS = {"mV": ".3g mV", "MPa": ".3g MPa"}


def budget_section(compensator: Compensator | None) -> Section:
    """Return the section on the budget of each side."""
    if compensator is None:
        return Section(missing="No compensator is here: `dzdesign design` makes compensator.json with its budget.")
    laws, units = laws_of(compensator), compensator.valve.recorded_units
    budgets = {name: law.budget for name, law in laws.items() if law.budget is not None}
    lines = [reach_of_certificate(compensator), f"The components are {ADDED_IN_FULL}."]
    if not budgets:
        return Section(lines=tuple(lines[:1]))
    both = len(budgets) > 1
    return Section(
        lines=tuple(lines),
        figures=[budget_figure(budget, name, both, units.of_side(name)) for name, budget in budgets.items()],
        tables=[budget_table(budget, name, both, units.of_side(name)) for name, budget in budgets.items()],
    )


def budget_table(budget: Budget, name: str, both: bool, units: RecordedUnits) -> Table:
    """Return the components: origin, half-width, sensitivity, contribution at the pressure drops, and price."""
    millivolts = units.label("mV")
    return table_of(
        f"Uncertainty budget{f', {name} commands' if both else ''}",
        budget.lines,
        ("component", lambda line: Cell(text=line.component, more=_origin(line))),
        ("half-width", lambda line: in_number_font(_half_width(line, units))),
        (f"sensitivity ({millivolts} per unit of it)", lambda line: in_number_font(_sensitivity(line, units))),
        *(
            (f"{units.text(budget.dp_MPa[at], '.2f MPa')} ({millivolts})", _contribution(at, units))
            for at in shown_places(len(budget.dp_MPa))
        ),
        ("price (% of command)", lambda line: number(100 * line.price, 3)),
        csv=csv_text(
            ("component", "origin", "source", "half_width", "unit", "dp_MPa", "sensitivity_mV", "contribution_mV",
             "price_percent"),
            _rows(budget),
        ),
        name=f"budget-components-{name}",
        notes=(
            "Contribution: by how much the component alone lowers what is certified. Sensitivity: that for one unit of "
            "its half-width, from the least to the most over the pressure drops.",
            "Price: the dead zone that the component costs, that is by how much the offset would rise without it.",
        ),
    )  # fmt: skip


def shown_places(count: int) -> tuple[int, ...]:
    """Return which of so many pressure drops have a column: all, or some from the lowest to the highest.

    Examples
    --------
    >>> shown_places(3), shown_places(11)
    ((0, 1, 2), (0, 2, 4, 6, 8, 10))
    """
    if count <= COLUMNS:
        return tuple(range(count))
    return tuple(round(place * (count - 1) / (COLUMNS - 1)) for place in range(COLUMNS))


def _contribution(at: int, units: RecordedUnits) -> Callable[[BudgetLine], Cell]:
    return lambda line: recorded(line.contribution_mV[at], ".2f mV", units)


def _origin(line: BudgetLine) -> str:
    return line.source if line.source.startswith(line.origin) else f"{line.origin}: {line.source}"


def _half_width(line: BudgetLine, units: RecordedUnits) -> str:
    form = SHOWN_UNITS.get(line.unit)
    if form is not None:
        return units.text(line.half_width, form)
    return f"{line.half_width:.4g} {line.unit}"


def _sensitivity(line: BudgetLine, units: RecordedUnits) -> str:
    """Return from where to where the sensitivity runs, for one unit of the half-width as it is shown."""
    if line.unit == "mV":  # of the threshold itself
        return "–"
    one = units.convert(1.0, line.unit) if line.unit in SHOWN_UNITS else 1.0
    ends = (units.number(end(line.sensitivity_mV) / one, ".3g mV") for end in (min, max))
    return " to ".join(dict.fromkeys(ends))


def _rows(budget: Budget) -> Iterator[tuple[object, ...]]:
    for line in budget.lines:
        for at, dp_MPa in enumerate(budget.dp_MPa):
            yield (
                line.component, line.origin, line.source, line.half_width, line.unit, dp_MPa, line.sensitivity_mV[at],
                line.contribution_mV[at], 100 * line.price,
            )  # fmt: skip
