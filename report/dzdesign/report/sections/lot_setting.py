"""A common setting in the report: of how many valves it is, which is the worst, and what it costs each of them."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

from dzdesign.core.verdicts import NOT_CHECKED
from dzdesign.report.artefact_chain import Chain
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, number
from dzdesign.report.summary import Figure
from dzdesign.verify.exhaustive.exact_law import ExactLaw

#: Valves in the table of the page; all of them stand in the CSV.
ROWS = 40
SECTION = ("lot", "The lot")


@dataclass(frozen=True, slots=True, kw_only=True)
class LotCost:
    """What a common setting costs one valve on one side, as shares of full command.

    The command that passes before the drive reaches the valve's own lower bound, at a tested pressure drop.
    """

    valve: str
    side: str
    least_percent: float
    least_dp_MPa: float
    most_percent: float
    most_dp_MPa: float


def common_count(compensator: dict[str, Any] | None) -> int:
    """Return of how many valves a compensator is the common setting; 0 of a valve's own.

    Parameters
    ----------
    compensator : dict or None
        compensator.json.
    """
    return (compensator or {}).get("common_valves") or 0


def carrier_of(compensator: dict[str, Any]) -> str:
    """Return the name, in the lot, of the valve that the file holds.

    Parameters
    ----------
    compensator : dict
        compensator.json of a common setting.
    """
    stated = compensator["made_from"][0]["sha256"]
    names = (each["name"] for each in compensator.get("lot", ()) if each["valve_sha256"] == stated)
    return next(names, "the valve in compensator.json")


def lot_costs(compensator: dict[str, Any]) -> tuple[LotCost, ...]:
    """Return what the setting costs every valve, the dearest first.

    Parameters
    ----------
    compensator : dict
        compensator.json of a common setting.
    """
    signs = {name: sign for name, sign in (("positive", 1), ("negative", -1)) if compensator["sides"][name]}
    found = [
        cost for name, sign in signs.items() for cost in _costs_of_side(compensator, ExactLaw(compensator, sign), name)
    ]
    return tuple(sorted(found, key=lambda each: -each.most_percent))


def _costs_of_side(compensator: dict[str, Any], exact: ExactLaw, name: str) -> Iterator[LotCost]:
    u_max = float(Fraction(*compensator["u_max_V"]))
    code_MPa = float(Fraction(*exact.a["span_MPa"])) / (exact.a["full_code"] - exact.a["zero_code"])

    @cache  # the valves of a lot are tested at the same few pressure drops
    def corners_at(dp_code: int) -> list[tuple[float, float]]:
        return [(away / exact.span, float(counts)) for away, counts in exact.corners(exact.betas(dp_code))]

    for valve in compensator.get("lot", ()):
        side = valve["sides"][name]
        if side is None:
            continue
        shares = [
            (_share(corners_at(round(dp / code_MPa)), bound * exact.compare_max / u_max), dp)
            for dp, bound in zip(side["dp_MPa"], side["u_lower_V"], strict=True)
        ]
        (least, least_at), (most, most_at) = min(shares), max(shares)
        yield LotCost(
            valve=valve["name"], side=name, least_percent=100 * least, least_dp_MPa=least_at, most_percent=100 * most,
            most_dp_MPa=most_at,
        )  # fmt: skip


def _share(corners: list[tuple[float, float]], counts: float) -> float:
    """Return the share of full command at which the drive reaches so many counts: 0 if at zero command, 1 if never."""
    if corners[0][1] >= counts:
        return 0.0
    for (left, low), (right, high) in pairwise(corners):
        if high >= counts:
            return left + (right - left) * (counts - low) / (high - low)
    return 1.0


def lot_figures(chain: Chain) -> tuple[Figure, ...]:
    """Return what the page of a common setting leads with; none of a valve's own.

    Parameters
    ----------
    chain : Chain
    """
    compensator, evidence = chain.document("compensator"), chain.document("verification")
    count = common_count(compensator)
    if not count or compensator is None:
        return ()
    carrier = carrier_of(compensator)
    first = Figure(
        label="Common setting",
        value=f"of {count} valves",
        note=f"one law for all; the file holds one of them, {carrier}, its carrier",
    )
    return (first, _worst(evidence), _cost(lot_costs(compensator)))


def _worst(evidence: dict[str, Any] | None) -> Figure:
    found = [each["lot"] for each in evidence["inputs"] if each.get("lot")] if evidence else []
    if not found:
        return Figure(
            label="Worst valve of the lot", value=NOT_CHECKED, kind="open",
            note="no evidence here compares the C with the bounds of each valve",
        )  # fmt: skip
    worst = min(found, key=lambda each: each["smallest_margin_V"])
    over = list(dict.fromkeys(name for each in found for name in each["over_compensated"]))
    return Figure(
        label=f"Worst valve of the lot: {worst['worst']}",
        value=f"{1e3 * worst['smallest_margin_V']:.3f} mV",
        note="margin of the C's compare values at zero command under its own lower bound, at "
        f"{worst['worst_dp_MPa']:.2f} MPa; {len(over)} of {min(each['valves'] for each in found)} valves "
        "over-compensated",
        kind="bad" if over else "text",
    )


def _cost(costs: tuple[LotCost, ...]) -> Figure:
    label = "What it costs over the lot"
    if not costs:
        return Figure(label=label, value="not known", note="the file holds no valve but its carrier", kind="open")
    most, least = costs[0], min(costs, key=lambda each: each.least_percent)
    return Figure(
        label=label,
        value=f"{least.least_percent:.1f} to {most.most_percent:.1f} %",
        note=f"of command passes before the drive reaches a valve's own lower bound: least {least.valve} at "
        f"{least.least_dp_MPa:.2f} MPa, most {most.valve} at {most.most_dp_MPa:.2f} MPa; each stands under The lot",
    )


def lot_section(compensator: dict[str, Any]) -> Section:
    """Return the section on the lot.

    Parameters
    ----------
    compensator : dict
        compensator.json of a common setting.
    """
    count, carrier, lot = common_count(compensator), carrier_of(compensator), compensator.get("lot", [])
    if not lot:
        return Section(missing=f"The file is of {count} valves and names none but one; run `dzdesign batch` again.")
    costs = lot_costs(compensator)
    sides = {(each["name"], name): side for each in lot for name, side in each["sides"].items() if side}
    rows = [_row(cost, sides[cost.valve, cost.side]) for cost in costs]
    caption = "What the common setting costs each valve, the dearest first"
    if len(costs) > ROWS:
        caption += f": the first {ROWS} of {len(costs)}"
    return Section(
        lines=(
            f"One setting for {count} valves, each with bounds of its own; lot SHA-256 {compensator['lot_sha256']}.",
            f"All else in this report that is of one valve (recordings, thresholds, β, certificate, closed loop) is of "
            f"{carrier}, the carrier.",
            "Cost: the share of the command that passes before the drive reaches the valve's own lower bound, at its "
            "tested pressure drops, in the exact law. How much more that is than with a setting of its own stands in "
            "the report of dzdesign batch.",
        ),
        tables=(
            Table(
                caption=caption,
                columns=("valve", "commands", "tested (MPa)", "least bound (V)", "confidence (%)", "cost, least (%)",
                         "cost, most (%)", "most at (MPa)"),
                rows=tuple(rows[:ROWS]),
                csv=csv_text(
                    ("valve", "side", "least_percent", "least_dp_MPa", "most_percent", "most_dp_MPa"),
                    [
                        [each.valve, each.side, round(each.least_percent, 4), each.least_dp_MPa,
                         round(each.most_percent, 4), each.most_dp_MPa]
                        for each in costs
                    ],
                ),
                name="lot",
            ),
        ),
    )  # fmt: skip


def _row(cost: LotCost, side: dict[str, Any]) -> tuple[Cell, ...]:
    low, high = side["dp_MPa"][0], side["dp_MPa"][-1]
    return (
        Cell(text=cost.valve),
        Cell(text=cost.side),
        Cell(text=f"{low:.2f}" if low == high else f"{low:.2f} to {high:.2f}", kind="number"),
        number(min(side["u_lower_V"]), 3),
        Cell(text=f"{100 * side['confidence']:.6g}", kind="number"),
        number(cost.least_percent, 2),
        number(cost.most_percent, 2),
        number(cost.most_dp_MPa, 2),
    )
