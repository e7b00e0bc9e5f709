"""Section on the uncertainty budget: what is counted between the recorded threshold and the largest offset."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.certificate import reach_of_certificate
from dzdesign.design.compensator import Compensator
from dzdesign.design.side_law import ADDED_IN_FULL, Budget, BudgetLine
from dzdesign.identify.plots.style import CYCLE
from dzdesign.report.artefacts import laws_of
from dzdesign.report.cells import Cell, Table, in_number_font, number, recorded, table_of
from dzdesign.report.figure import (
    LIGHT,
    ReportFigure,
    csv_text,
    legend_below,
    new_figure,
    side_words,
    to_report_figure,
)
from dzdesign.report.page import Section

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


#: Components with a part of their own, if it is no smaller than this share of the largest sum; the others are one part.
SHOWN, SMALLEST = 5, 0.02
#: Hatches in turn, as hues alone would be told apart by nobody in a grey print.
HATCHES = ("", "///", "...", "\\\\\\", "xxx", "ooo", "---")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """A part of every bar: a component, or all that are too small to be seen."""

    label: str
    hue: str
    contribution_mV: tuple[float, ...]


def budget_figure(budget: Budget, name: str, both: bool, units: RecordedUnits) -> ReportFigure:
    """Draw the contributions at every tested pressure drop, and what they come to together."""
    parts = _parts(budget)
    figure = new_figure(3.9, legend_rows=(len(parts) + 2) // 2, top=0.3 if both else 0.12)
    axes = figure.subplots()
    if both:
        axes.set_title(f"{name} commands")
    places, below = np.arange(len(budget.dp_MPa)), np.zeros(len(budget.dp_MPa))
    for index, part in enumerate(parts):
        height = units.convert(np.maximum(part.contribution_mV, 0.0), "mV")
        axes.bar(
            places, height, 0.62, bottom=below, label=part.label, facecolor=LIGHT[part.hue],
            edgecolor=LIGHT["face"], hatch=HATCHES[index % len(HATCHES)], linewidth=0.6,
        )  # fmt: skip
        below = below + height
    together = units.convert(np.array(budget.combined_mV), "mV")
    axes.hlines(together, places - 0.4, places + 0.4, color=LIGHT["ink"], lw=2, label="all together", zorder=4)
    axes.set_xticks(places, [units.number(dp, ".2f MPa") for dp in budget.dp_MPa])
    axes.set(
        xlabel=f"pressure drop dP ({units.label('MPa')})", ylabel=f"taken off the threshold ({units.label('mV')})",
        ylim=(0, None),
    )  # fmt: skip
    axes.grid(visible=False, axis="x")
    legend_below(figure, 2)
    worst = int(np.argmax(together))
    return to_report_figure(
        figure,
        f"budget-{name}",
        f"The uncertainty budget{side_words(name, both)}: how far each component alone lowers the offset under the "
        "threshold as it was recorded, with its origin in brackets. A line across a bar is what all of them come to "
        "together; it may lie off the bar's top, because the drive, oil and ageing multiply what the others leave.",
        f"Stacked bars of {len(parts)} components at {len(budget.dp_MPa)} pressure drops; together at most "
        f"{units.text(budget.combined_mV[worst], '.1f mV')} at {units.text(budget.dp_MPa[worst], '.2f MPa')}.",
        csv_text(
            ("dp_MPa", *(f"{line.component} ({line.origin}) mV" for line in budget.lines), "together_mV"),
            (
                (dp, *(line.contribution_mV[at] for line in budget.lines), budget.combined_mV[at])
                for at, dp in enumerate(budget.dp_MPa)
            ),
        ),
    )


def _parts(budget: Budget) -> tuple[_Part, ...]:
    """Return the largest components in the order of the budget, and the others as one."""
    lines = [line for line in budget.lines if max(line.contribution_mV) > 0]
    least = SMALLEST * max(budget.combined_mV)
    largest = sorted(lines, key=lambda line: -max(line.contribution_mV))[:SHOWN]
    largest = [line for line in largest if max(line.contribution_mV) >= least]
    shown: Sequence[BudgetLine] = [line for line in lines if line in largest]
    others = [line for line in lines if line not in largest]
    parts = [
        _Part(label=f"{line.component} ({line.origin})", hue=hue, contribution_mV=line.contribution_mV)
        for line, hue in zip(shown, CYCLE, strict=False)
    ]
    if others:
        together = tuple(sum(each) for each in zip(*(line.contribution_mV for line in others), strict=True))
        parts.append(_Part(label=f"{len(others)} smaller ones, in the table", hue="soft", contribution_mV=together))
    return tuple(parts)
