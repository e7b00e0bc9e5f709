"""A lot's setting and certificates in sentences, for the terminal and for the page."""

from collections.abc import Sequence

from dzdesign.core.errors import and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.lot.spread import EXTRA, TWENTY
from dzdesign.report.lot.summary import LotBudget, LotSettingSummary, LotSummary, Quantiles, UntestedPressures

#: Valves of one sentence that are named.
NAMED = 3
#: Said where the lot setting leaves some valve less dead zone than its own.
NEGATIVE_COST = (
    "a negative cost: with the lot setting that valve has less dead zone than with its own, at each of its tests; it "
    "is certified all the same, for the lot's offset lies below the valve's bound too"
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


def checked_line(setting: LotSettingSummary, units: RecordedUnits) -> str:
    """Say for how many valves it is proved that the lot setting lies under their bounds, and which is nearest."""
    checked = setting.checked
    return (
        f"it lies under the bounds of each of the {checked.valves} valves, at every pressure code of its tests; "
        f"nearest is {checked.worst}: the exact law with half a count of rounding stays "
        f"{units.text(1e3 * checked.smallest_margin_V, '.3f mV')} under its bound at "
        f"{units.text(checked.dp_MPa, '.2f MPa')}"
    )


def untested_lines(setting: LotSettingSummary, units: RecordedUnits) -> list[str]:
    """Say which valves were not tested where the lot was, and what that costs the lot setting."""
    narrow = [each for each in setting.untested if each.narrows]
    lines = []
    if narrow:
        them = "it" if len({each.name for each in narrow}) == 1 else "them"
        wider = f", and without {them} {span(*setting.dp_without_MPa, units)}" if setting.dp_without_MPa else ""
        lines.append(
            f"{_untested(narrow, units)}: so the lot setting holds for all {span(*setting.dp_MPa, units)}{wider}; "
            f"record what is missing, or calibrate {them} apart"
        )
    return lines + _coarse_lines([each for each in setting.untested if not each.narrows], units)


def _coarse_lines(inside: Sequence[UntestedPressures], units: RecordedUnits) -> list[str]:
    """Say of valves whose bounds are coarser between two tests by how much, and what that costs."""
    lines = [
        f"{_untested([each], units)}: between the tests beside it only the lower of their two bounds is known, there "
        f"about {units.text(1e3 * each.coarser_V, '.3g mV')} under what a test would show, and {each.name} holds the "
        f"lot setting down: that may cost each valve up to {each.cost_percent:.2g} % of command; record what is missing"
        for each in inside
        if each.cost_percent > 0
    ]
    free = [each for each in inside if each.cost_percent == 0]
    if coarse := [each for each in free if each.coarser_V > 0]:
        lines.append(
            f"{_untested(coarse, units)}: between the tests beside it only the lower of their two bounds is known, "
            "which costs nothing, as other valves hold the lot setting down"
        )
    if same := [each for each in free if each.coarser_V == 0]:
        lines.append(f"{_untested(same, units)}: that costs the lot setting nothing")
    return lines


def cost_lines(summary: LotSummary) -> list[str]:
    """Say of each side what one setting for all costs."""
    costs = {column: at for column, at in summary.quantiles.items() if column.endswith(EXTRA)}
    lines = [
        (f"{column.removesuffix(EXTRA).rstrip('_')} side: " if column != EXTRA else "")
        + f"it leaves more dead zone than each valve's own setting: {cost_text(at, summary.calibrated)}"
        for column, at in costs.items()
    ]
    return [*lines, NEGATIVE_COST] if any(at.least < 0 for at in costs.values()) else lines


def cost_text(at: Quantiles, count: int) -> str:
    """Say a cost at the median valve, at one in twenty if there are so many, and at most."""
    one_in_twenty = f"{at.q95:.2f} % at one in twenty, " if count >= TWENTY else ""
    return f"{at.median:.2f} % of command at the median valve, {one_in_twenty}{at.largest:.2f} % at most"


def _untested(lacking: Sequence[UntestedPressures], units: RecordedUnits) -> str:
    """Say which valves lack which pressure drops, those that lack the same together."""
    at: dict[tuple[float, ...], dict[str, None]] = {}
    for each in lacking:
        at.setdefault(each.dp_MPa, {})[each.name] = None
    return "; ".join(
        f"{and_more(list(names), NAMED)} {'was' if len(names) == 1 else 'were'} not tested at "
        f"{' and '.join(units.number(dp, '.4g MPa') for dp in pressures)} {units.label('MPa')}, as the lot was"
        for pressures, names in at.items()
    )


def span(low: float, high: float, units: RecordedUnits) -> str:
    """Return a range of pressure drops in words.

    Examples
    --------
    >>> span(1.0, 5.0, RecordedUnits()), span(2.5, 2.5, RecordedUnits())
    ('from 1 to 5 MPa', 'at 2.5 MPa only')
    """
    first, last = (units.number(end, ".3g MPa") for end in (low, high))
    return f"from {first} to {last} {units.label('MPa')}" if high > low else f"at {first} {units.label('MPa')} only"
