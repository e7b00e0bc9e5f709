"""The uncertainty budget of a design, as `dzdesign design` prints it."""

from typing import TYPE_CHECKING

from dzdesign.terminal.page import Table, new_console, put_line, put_table

if TYPE_CHECKING:
    from rich.console import Console

    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.side_law import Budget, BudgetLine

#: Units of a half-width that a person may see in another one.
SHOWN_UNITS = ("mV", "MPa")


def print_budgets(compensator: "Compensator", console: "Console | None" = None) -> None:
    """Print the budget of each side: what each component takes from the threshold, and what it costs."""
    from dzdesign.design.side_law import ADDED_IN_FULL
    from dzdesign.design.signals import SIDE_NAMES

    console = console or new_console()
    for sign in compensator.signals.signs:
        side, budget = SIDE_NAMES[sign], compensator.side(sign).budget
        if budget is not None:
            title = f"Uncertainty budget of {compensator.certified_of}"
            title += "" if compensator.negative is None else f", {side} side"
            put_table(console, _table(title, budget, compensator.valve.recorded_units.of_side(side)))
    for line in _sources(compensator):
        put_line(console, line)
    put_line(
        console,
        f"how they add: {ADDED_IN_FULL}; a price is what the offset would gain without the component, of command",
    )


def _sources(compensator: "Compensator") -> list[str]:
    """Return where the components are from, those of one source together."""
    found: dict[str, list[str]] = {}
    for line in compensator.positive.budget.lines if compensator.positive.budget else ():
        words = line.source if line.source.startswith(line.origin) else f"{line.origin}: {line.source}"
        found.setdefault(words, []).append(line.component)
    return [f"{', '.join(components)} ({words})" for words, components in found.items()]


def _table(title: str, budget: "Budget", units: "RecordedUnits") -> Table:
    from dzdesign.report.page import shown_places

    millivolts, places = units.label("mV"), shown_places(len(budget.dp_MPa))
    at = [units.text(budget.dp_MPa[place], ".3g MPa") for place in places]
    headers = ("component", "origin", "half-width", "largest sensitivity (per unit)", *at, "price")
    table = Table(f"{title}, {millivolts}", *headers, words=(0, 1))
    for line in budget.lines:
        table.add_row(
            line.component,
            line.origin,
            _half_width(line, units),
            _sensitivity(line, units),
            *(units.number(line.contribution_mV[place], ".2f mV") for place in places),
            f"{line.price:.3%}",
        )
    together = (units.number(budget.combined_mV[place], ".2f mV") for place in places)
    table.add_row("together", "", "", "", *together, "")
    return table


def _half_width(line: "BudgetLine", units: "RecordedUnits") -> str:
    if line.unit in SHOWN_UNITS:
        return units.text(line.half_width, f".3g {line.unit}")
    return f"{line.half_width:.4g} {line.unit}"


def _sensitivity(line: "BudgetLine", units: "RecordedUnits") -> str:
    one = units.convert(1.0, line.unit) if line.unit in SHOWN_UNITS else 1.0
    return units.number(max(line.sensitivity_mV) / one, ".3g mV")

