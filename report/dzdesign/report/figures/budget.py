"""The uncertainty budget as stacked bars: what each component takes from the threshold at each tested pressure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.machine.budget import Budget, BudgetLine
from dzdesign.identify.plots.style import CYCLE
from dzdesign.report.figures.figure import (
    LIGHT,
    ReportFigure,
    csv_text,
    legend_below,
    new_figure,
    side_words,
    to_report_figure,
)

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
