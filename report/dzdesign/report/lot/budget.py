"""The uncertainty budgets of a lot's valves: what each component takes and costs, from the least to the largest."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import quantity
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.report.compensator_sides import laws_of
from dzdesign.report.sections.cells import Cell, Table, number, recorded, table_of

#: Of a number in mV and of a price in percent: finer than any error here.
DIGITS = 5
Millivolts = Annotated[float, quantity("mV", "Largest of any valve at any pressure drop.", ge=-1e6, le=1e6)]
Price = Annotated[float, Meta(ge=-1e3, le=1e3)]
#: Quantiles of the price, in the order of the file.
ENDS = ("least", "median", "largest")


@dataclass(frozen=True, slots=True, kw_only=True)
class LotBudgetLine:
    """One component of the budgets of the calibrated valves."""

    side: Annotated[str, Meta(description="Side of the valve: positive or negative.")]
    component: Annotated[str, Meta(description="Source of the uncertainty.")]
    origin: Annotated[
        tuple[str, ...], Meta(description="Measured, declared or default: each origin that occurs in a valve's budget.")
    ]
    contribution_mV: Millivolts
    price_percent: Annotated[
        tuple[Price, Price, Price], Meta(description="Least, median and largest price, in percent of command.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class LotBudget:
    """What the certificates of a lot cover, and the components of their budgets."""

    certified_of: Annotated[
        tuple[str, ...],
        Meta(
            description="What the certificates cover: the valve as recorded, alone or with the declared machine. "
            "Each that occurs."
        ),
    ]
    lines: Annotated[tuple[LotBudgetLine, ...], Meta(description="Components, with those of each side together.")]


def lot_budget(designed: Mapping[str, Compensator]) -> LotBudget | None:
    """Return the budgets of calibrated valves as one; None without a valve."""
    if not designed:
        return None
    found: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    for compensator in designed.values():
        for name, law in laws_of(compensator).items():
            for line in law.budget.lines if law.budget else ():
                entry = (line.origin, max(line.contribution_mV), 100 * line.price)
                found.setdefault((name, line.component), []).append(entry)
    return LotBudget(
        certified_of=tuple(sorted({each.certified_of for each in designed.values()})),
        lines=tuple(
            LotBudgetLine(
                side=side,
                component=component,
                origin=tuple(dict.fromkeys(origin for origin, _, _ in entries)),
                contribution_mV=round(max(mV for _, mV, _ in entries), DIGITS),
                price_percent=tuple(  # type: ignore[arg-type]
                    round(of([price for _, _, price in entries]), DIGITS) for of in (min, median, max)
                ),
            )
            for (side, component), entries in found.items()
        ),
    )


def lot_budget_lines(budget: LotBudget | None) -> tuple[str, ...]:
    """Return what the certificates of a lot are of, as a line for a person."""
    if budget is None:
        return ()
    if len(budget.certified_of) > 1:
        return (f"The certificates cover, of some valves, {', of others '.join(budget.certified_of)}.",)
    if any("machine" in each for each in budget.certified_of):
        return (f"The certificates cover {budget.certified_of[0]}.",)
    return (
        "The certificates cover the valves as recorded: no machine was declared, so coil temperature, "
        "supply voltage, pressure sensors, oil and ageing are not counted.",
    )


def lot_budget_table(budget: LotBudget | None, units: RecordedUnits) -> Table | None:
    """Return the components of all budgets; None where there are none."""
    if budget is None or not budget.lines:
        return None
    both = len({line.side for line in budget.lines}) > 1

    def price(place: int) -> Callable[[LotBudgetLine], Cell]:
        return lambda line: number(line.price_percent[place], 3)

    return table_of(
        "Uncertainty budgets of the valves: what each component takes at most, and what it costs",
        budget.lines,
        ("component", lambda line: Cell(text=line.component, more=", ".join(line.origin))),
        *((("commands", lambda line: line.side),) if both else ()),
        (f"largest contribution ({units.label('mV')})", lambda line: recorded(line.contribution_mV, ".2f mV", units)),
        *((f"price, {which} (% of command)", price(place)) for place, which in enumerate(ENDS)),
    )
