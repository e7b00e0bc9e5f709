"""A lot setting in the report of its firmware: of how many valves it is, the worst of them, and what each pays."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.verdicts import NOT_CHECKED
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_valves import LotSide
from dzdesign.report.chain import Chain
from dzdesign.report.compensator_sides import SIGNS, laws_of
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.page import Figure, Section
from dzdesign.report.sections.cells import Cell, in_number_font, number, recorded, table_of
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.exhaustive.exact_law import ExactLaw

#: Valves in the table of the page; all of them stand in the CSV.
ROWS = 40
#: Numbers of a valve that stand in the CSV.
NUMBERS = ("least_percent", "least_dp_MPa", "most_percent", "most_dp_MPa")


@dataclass(frozen=True, slots=True, kw_only=True)
class LotCost:
    """What a lot setting costs one valve on one side, in percent of command, at the pressure drops of its tests.

    The command that passes before the output reaches the valve's own lower bound.
    """

    valve: str
    side: str
    bounds: LotSide
    least_percent: float
    least_dp_MPa: float
    most_percent: float
    most_dp_MPa: float


def carrier_of(compensator: Compensator) -> str:
    """Return the name, in the lot, of the valve that the file of a lot setting holds."""
    names = (each.name for each in compensator.lot if each.valve_sha256 == compensator.valve_json_sha256)
    return next(names, "the valve in compensator.json")


def lot_costs(compensator: Compensator) -> tuple[LotCost, ...]:
    """Return what a lot setting costs every valve, the dearest first."""
    found = [cost for name in laws_of(compensator) for cost in _costs_of_side(compensator, name)]
    return tuple(sorted(found, key=lambda each: -each.most_percent))


def _costs_of_side(compensator: Compensator, name: str) -> Iterator[LotCost]:
    exact = ExactLaw(compensator, SIGNS[name])
    counts_per_V = exact.compare_max / float(compensator.u_max_V)

    @cache  # the valves of a lot are tested at the same few pressure drops
    def corners_at(dp_code: int) -> tuple[list[float], list[float]]:
        corners = exact.corners(exact.betas(dp_code))
        return [float(counts) for _, counts in corners], [100 * away / exact.span for away, _ in corners]

    for valve in compensator.lot:
        side: LotSide | None = getattr(valve, name)
        if side is None:
            continue
        percents = []
        for dp, bound in zip(side.dp_MPa, side.u_lower_V, strict=True):
            corners = corners_at(round(compensator.signals.dp_code(Fraction(dp))))
            percents.append((float(np.interp(bound * counts_per_V, *corners, left=0.0, right=100.0)), dp))
        (least, least_at), (most, most_at) = min(percents), max(percents)
        yield LotCost(
            valve=valve.name, side=name, bounds=side, least_percent=least, least_dp_MPa=least_at, most_percent=most,
            most_dp_MPa=most_at,
        )  # fmt: skip


def lot_figures(chain: Chain) -> tuple[Figure, ...]:
    """Return what the page of a lot setting leads with; none of a valve's own."""
    compensator = chain.compensator
    if compensator is None or not compensator.lot:
        return ()
    first = Figure(
        label="Lot setting",
        value=f"of {len(compensator.lot)} valves",
        note=f"one law for all; the file holds one of them, {carrier_of(compensator)}, its carrier",
    )
    units = chain.recorded_units
    return (first, _worst(chain.evidence, units), _cost(lot_costs(compensator), units))


def _worst(evidence: Evidence | None, units: RecordedUnits) -> Figure:
    found = [each.lot for each in evidence.inputs if each.lot] if evidence else []
    if not found:
        return Figure(
            label="Worst valve of the lot", value=NOT_CHECKED, kind="open",
            note="no evidence here compares the C code with the bounds of each valve",
        )  # fmt: skip
    worst = min(found, key=lambda each: each.smallest_margin_V)
    over = {name for each in found for name in each.over_compensated}
    return Figure(
        label=f"Worst valve of the lot: {worst.worst}",
        value=units.text(1e3 * worst.smallest_margin_V, ".3f mV"),
        note="margin of the C code's compare values at zero command under its own lower bound, at "
        f"{units.text(worst.worst_dp_MPa, '.2f MPa')}; {len(over)} of {min(each.valves for each in found)} valves "
        "over-compensated",
        kind="bad" if over else "text",
    )


def _cost(costs: tuple[LotCost, ...], units: RecordedUnits) -> Figure:
    label = "What it costs over the lot"
    if not costs:
        return Figure(label=label, value="not known", note="the file holds no valve but its carrier", kind="open")
    most, least = costs[0], min(costs, key=lambda each: each.least_percent)
    return Figure(
        label=label,
        value=f"{least.least_percent:.1f} to {most.most_percent:.1f} %",
        note=f"of command passes before the output reaches a valve's own lower bound: least {least.valve} at "
        f"{units.text(least.least_dp_MPa, '.2f MPa')}, most {most.valve} at {units.text(most.most_dp_MPa, '.2f MPa')}; "
        "each stands under The lot",
    )


def lot_section(compensator: Compensator) -> Section:
    """Return the section on the lot of a lot setting."""
    count, costs = len(compensator.lot), lot_costs(compensator)
    if not costs:
        return Section(missing=f"The file is of {count} valves and names none but one; run `dzdesign batch` again.")
    more = f": the first {ROWS} of {len(costs)}" if len(costs) > ROWS else ""
    units = compensator.valve.recorded_units
    pressure, command = units.label("MPa"), units.label("V")

    def least_bound(one: LotCost) -> Cell:
        return recorded(min(one.bounds.u_lower_V), ".3f V", units.of_side(one.side))

    def tested(one: LotCost) -> Cell:
        ends = (units.number(end(one.bounds.dp_MPa), ".2f MPa") for end in (min, max))
        return in_number_font(" to ".join(dict.fromkeys(ends)))

    table = table_of(
        f"What the lot setting costs each valve, the dearest first{more}",
        costs[:ROWS],
        ("valve", lambda one: one.valve),
        ("commands", lambda one: one.side),
        (f"tested ({pressure})", tested),
        (f"least bound ({command})", least_bound),
        ("confidence (%)", lambda one: in_number_font(f"{100 * one.bounds.confidence:.6g}")),
        ("cost, least (%)", lambda one: number(one.least_percent, 2)),
        ("cost, most (%)", lambda one: number(one.most_percent, 2)),
        (f"most at ({pressure})", lambda one: recorded(one.most_dp_MPa, ".2f MPa", units)),
        csv=csv_text(
            ("valve", "side", *NUMBERS),
            ((cost.valve, cost.side, *(round(getattr(cost, name), 4) for name in NUMBERS)) for cost in costs),
        ),
        name="lot",
    )
    return Section(
        lines=(
            f"One setting for {count} valves, each with bounds of its own; lot SHA-256 {compensator.lot_sha256}.",
            f"All else in this report that is of one valve (recordings, thresholds, β, certificate, closed loop) is of "
            f"{carrier_of(compensator)}, the carrier.",
            "Cost: the share of the command that passes before the output reaches the valve's own lower bound, at its "
            "tested pressure drops, in the exact law. How much more that is than with a setting of its own stands in "
            "the report of dzdesign batch.",
        ),
        tables=(table,),
    )
