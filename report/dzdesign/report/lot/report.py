"""report.html of a lot: from how many valves are calibrated to the hashes, in the style of the report of one valve."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dzdesign.core.errors import and_more
from dzdesign.report.cells import whole
from dzdesign.report.figure import figure_style
from dzdesign.report.lot.folder import Lot, read_lot
from dzdesign.report.lot.sections import sections_of
from dzdesign.report.lot.spread import EXTRA, FAR, TWENTY, Spread, spreads_of
from dzdesign.report.lot.summary import DOES_NOT_HOLD
from dzdesign.report.lot.table import column_of
from dzdesign.report.lot.words import lot_budget_lines, untested_lines
from dzdesign.report.page import Figure, Headline, Page, Report, report_of

#: Valves that the verdict names, and anomalies.
IN_VERDICT, ANOMALIES_IN_VERDICT = 8, 3
#: Columns of the cards, their labels, and of what they are.
CARDS = (
    ("dead_zone_opening_percent", "Dead zone left on opening", "of command, the worst of a valve's pressure drops"),
    ("dead_zone_closing_percent", "Dead zone left on closing", "of command, the worst of a valve's pressure drops"),
    (EXTRA, "Cost of one lot setting", "more dead zone than with each valve's own"),
    ("knee_opening_V", "Threshold: knee on opening", "at dP0"),
)


def report_of_lot(folder: Path, logo: str = "") -> Report:
    """Make the report of the folder of a lot; `logo` is a data: address."""
    lot = read_lot(folder)
    spreads = spreads_of(lot.frame, lot.units)
    missing = list(lot.missing)
    if len(lot.calibrated) and not lot.summary.verified:
        missing.append("the evidence of each valve: `dzdesign batch --verify` makes it")
    with figure_style():
        sections = sections_of(lot, spreads)
    page = Page(
        title=f"Lot of {whole(lot.summary.valves)} {'valve' if lot.summary.valves == 1 else 'valves'}",
        verdict=_headline(lot),
        figures=_cards(lot, spreads),
        template="lot.html.jinja",
        sections=sections,
        missing=missing,
        logo=logo,
    )
    return report_of(page)


def _headline(lot: Lot) -> Headline:
    """Return the verdict: good only if every valve is calibrated and verified, and every file fits."""
    anomalies = lot.summary.anomalies
    lines = [f"odd: {text}" for text in anomalies[:ANOMALIES_IN_VERDICT]]
    warned = lot.calibrated.select("name", "warnings").iter_rows()
    simulated = [name for name, codes in warned if "simulated" in codes.split()]
    if simulated:
        lines.insert(0, f"SIMULATED recordings, not of measured valves: {and_more(simulated, IN_VERDICT)}")
    lines += lot_budget_lines(lot.summary.budget)
    if lot.summary.lot_setting:
        lines += untested_lines(lot.summary.lot_setting, lot.units)
    more = len(anomalies) - ANOMALIES_IN_VERDICT
    lines += [f"odd: {more} more, under “What the recordings leave open”"] if more > 0 else []
    return replace(_verdict(lot), cautions=tuple(lines), some_failed=bool(len(lot.failed)))


def _verdict(lot: Lot) -> Headline:
    done, count, failed = len(lot.calibrated), len(lot.frame), lot.failed
    by_status = [
        (status, failed.filter(failed["status"] == status)["name"].to_list()) for status, _ in _statuses(lot)
    ]
    reasons = tuple(f"{whole(len(names))} {status}: {and_more(names, IN_VERDICT)}" for status, names in by_status)
    if not count:
        return Headline(kind="open", text="NOT KNOWN: the table is not here")
    words, outputs = f"{whole(done)} of {whole(count)} valves calibrated", lot.summary.outputs
    if not done:
        text = f"NONE of {whole(count)} valves calibrated" if count > 1 else "The valve is NOT calibrated"
        return Headline(kind="bad", text=text, reasons=reasons)
    if reasons:
        kind = "bad" if any(status == DOES_NOT_HOLD for status, _ in by_status) else "open"
        return Headline(kind=kind, text=f"{words}, {whole(count - done)} NOT", reasons=reasons)
    if lot.summary.verified:
        what = "firmware and the outputs of each are" if outputs else "firmware of each is"
        return Headline(kind="good", text=f"{words}, and the {what} verified")
    if lot.summary.firmware:
        text = f"{words}, each block tried on every input; the firmware itself is NOT VERIFIED"
    else:
        text = f"{words}; their {'firmware and outputs are' if outputs else 'firmware is'} NOT VERIFIED"
    return Headline(kind="open", text=text)


def _statuses(lot: Lot) -> list[tuple[str, int]]:
    """Return the statuses of the valves that are not calibrated, with their counts, the most frequent first."""
    return Counter(lot.failed["status"].to_list()).most_common()


def _cards(lot: Lot, spreads: Sequence[Spread]) -> tuple[Figure, ...]:
    """Return the numbers that matter: how many are calibrated, and need a look; and how the valves scatter."""
    done, failed, statuses = len(lot.calibrated), len(lot.failed), _statuses(lot)
    note = ", ".join(f"{whole(count)} {status}" for status, count in statuses) or "none left out"
    if done:
        note += "; verified" if lot.summary.verified else "; not verified"
    kind = "text" if not failed else "bad" if DOES_NOT_HOLD in dict(statuses) or not done else "open"
    far = {name for spread in spreads for name, _ in spread.far()}
    warned = int((lot.calibrated["warnings"] != "").sum())
    known = any(spread.limits for spread in spreads)
    odd = f"{whole(len(far))} beyond {FAR:g} robust s.d. in some quantity" if known else "too few to say which lie far"
    figures = [
        Figure(label="Calibrated", value=f"{whole(done)} of {whole(lot.summary.valves)}", note=note, kind=kind),
        Figure(
            label="Need a look",
            value=whole(failed + len(far)),
            note=f"{whole(failed)} not calibrated, {odd}. {whole(warned)} have a warning of their recordings",
        ),
    ]
    by_column = {spread.column: spread for spread in spreads}
    for column, label, of in CARDS:
        of_sides = [by_column[name] for side in lot.sides if (name := column_of(side, column)) in by_column]
        if of_sides:
            figures.append(_card(label, of, of_sides))
    return tuple(figures)


def _card(label: str, note: str, spreads: Sequence[Spread]) -> Figure:
    """Return median, the middle nine tenths and the largest of a quantity, of each side."""
    unit = spreads[0].quantity.unit_in(spreads[0].units)
    medians = " and ".join(spread.text(spread.at.median) for spread in spreads)
    parts = []
    for spread in spreads:
        at = spread.at
        least, low, high, most = map(spread.text, (at.least, at.q05, at.q95, at.largest))
        side = f"{spread.side}: " if spread.side else ""
        if len(spread.values) < TWENTY:
            parts.append(f"{side}all from {least} to {most} {unit}")
        else:
            parts.append(f"{side}5 to 95 % of the valves {low} to {high} {unit}, at most {most} {unit}")
    return Figure(label=label, value=f"{medians} {unit}", note=f"median, {note}; {'; '.join(parts)}")
