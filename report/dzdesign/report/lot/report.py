"""report.html of a lot: from how many valves are calibrated to the hashes, in the style of the report of one valve."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dzdesign.core.errors import and_more
from dzdesign.report.lot.budget import lot_budget_lines
from dzdesign.report.lot.folder import Lot, read_lot
from dzdesign.report.lot.sections import sections_of
from dzdesign.report.lot.setting_text import untested_lines
from dzdesign.report.lot.spread import FAR, TWENTY, Spread, spreads_of
from dzdesign.report.lot.summary import DOES_NOT_HOLD
from dzdesign.report.lot.table import column_of
from dzdesign.report.page import Figure, Headline, Page, Report, misfit, report_of
from dzdesign.report.sections.cells import whole

#: Valves that the verdict names, and anomalies.
IN_VERDICT, ANOMALIES_IN_VERDICT = 8, 3


def report_of_lot(folder: Path, logo: str = "") -> Report:
    """Make the report of the folder of a lot, finished or stopped; `logo` is a data: address."""
    return make_lot_report(read_lot(folder), logo)


def make_lot_report(lot: Lot, logo: str = "") -> Report:
    """Make the report of a lot."""
    verdict = lot_headline(lot)
    spreads = spreads_of(lot.rows, lot.units)
    missing = list(lot.missing)
    if lot.summary and lot.calibrated and not lot.summary.verified:
        missing.append("the evidence of each valve: `dzdesign batch --verify` makes it")
    page = Page(
        title=f"Lot of {whole(lot.expected)} {'valve' if lot.expected == 1 else 'valves'}",
        verdict=verdict,
        figures=key_figures_of_lot(lot, spreads),
        template="lot.html.jinja",
        sections=sections_of(lot, spreads),
        missing=missing,
        logo=logo,
    )
    return report_of(page, lot.faults)


def lot_headline(lot: Lot) -> Headline:
    """Return the verdict: good only if every valve is calibrated and verified, and every file fits."""
    anomalies = lot.summary.anomalies if lot.summary else ()
    lines = [f"odd: {text}" for text in anomalies[:ANOMALIES_IN_VERDICT]]
    simulated = [row.name for row in lot.calibrated if "simulated" in row.warnings]
    if simulated:
        lines.insert(0, f"SIMULATED recordings, not of measured valves: {and_more(simulated, IN_VERDICT)}")
    if lot.summary:
        lines += lot_budget_lines(lot.summary.budget)
    if lot.summary and lot.summary.lot_setting:
        lines += untested_lines(lot.summary.lot_setting, lot.units)
    more = len(anomalies) - ANOMALIES_IN_VERDICT
    lines += [f"odd: {more} more, under “What the recordings leave open”"] if more > 0 else []
    return replace(_verdict(lot), cautions=tuple(lines), some_failed=bool(lot.failed))


def _verdict(lot: Lot) -> Headline:
    if lot.faults:
        return misfit(lot.faults)
    done, count, expected = len(lot.calibrated), len(lot.rows), lot.expected
    reasons = _not_calibrated(lot)
    if lot.summary is None:
        text = f"NOT FINISHED: {whole(count)} of {whole(expected)} valves tried, {whole(done)} calibrated"
        return Headline(kind="open", text=text, reasons=reasons)
    if not count:
        return Headline(kind="open", text="NOT KNOWN: the table is not here")
    words = f"{whole(done)} of {whole(count)} valves calibrated"
    if not done:
        text = f"NONE of {whole(count)} valves calibrated" if count > 1 else "The valve is NOT calibrated"
        return Headline(kind="bad", text=text, reasons=reasons)
    if reasons:
        refuted = any(row.status == DOES_NOT_HOLD for row in lot.failed)
        text = f"{words}, {whole(count - done)} NOT"
        return Headline(kind="bad" if refuted else "open", text=text, reasons=reasons)
    if not lot.summary.verified and lot.summary.firmware:
        text = f"{words}, each block tried on every input; the firmware itself is NOT VERIFIED"
        return Headline(kind="open", text=text)
    if not lot.summary.verified:
        what = "firmware and outputs are" if lot.summary.outputs else "firmware is"
        return Headline(kind="open", text=f"{words}; their {what} NOT VERIFIED")
    what = "firmware and the outputs of each are" if lot.summary.outputs else "firmware of each is"
    return Headline(kind="good", text=f"{words}, and the {what} verified")


def _not_calibrated(lot: Lot) -> tuple[str, ...]:
    """Return for each status how many valves have it, and which."""
    counts = Counter(row.status for row in lot.failed)
    return tuple(
        f"{whole(count)} {status}: {and_more([row.name for row in lot.failed if row.status == status], IN_VERDICT)}"
        for status, count in counts.most_common()
    )


def key_figures_of_lot(lot: Lot, spreads: Sequence[Spread]) -> tuple[Figure, ...]:
    """Return the numbers that matter."""
    by_column = {spread.column: spread for spread in spreads}
    figures = [_counts(lot), _look(lot, spreads)]
    for column, label, note in (
        ("dead_zone_opening_percent", "Dead zone left on opening", "of command, the worst of a valve's pressure drops"),
        ("dead_zone_closing_percent", "Dead zone left on closing", "of command, the worst of a valve's pressure drops"),
        ("lot_extra_dead_zone_percent", "Cost of one lot setting", "more dead zone than with each valve's own"),
        ("knee_opening_V", "Threshold: knee on opening", "at dP0"),
    ):
        of_sides = [by_column[name] for side in lot.sides if (name := column_of(side, column)) in by_column]
        if of_sides:
            figures.append(_spread_figure(label, note, of_sides))
    return tuple(figures)


def _counts(lot: Lot) -> Figure:
    failed = Counter(row.status for row in lot.failed)
    note = ", ".join(f"{whole(count)} {status}" for status, count in failed.most_common()) or "none left out"
    if lot.summary and lot.calibrated:
        note += "; verified" if lot.summary.verified else "; not verified"
    kind = "text" if not lot.failed else "bad" if DOES_NOT_HOLD in failed or not lot.calibrated else "open"
    return Figure(
        label="Calibrated", value=f"{whole(len(lot.calibrated))} of {whole(lot.expected)}", note=note, kind=kind
    )


def _look(lot: Lot, spreads: Sequence[Spread]) -> Figure:
    """Return how many valves need a look: those not calibrated, and those far from the rest."""
    far = {name for spread in spreads for name, _ in spread.far()}
    warned = sum(bool(row.warnings) for row in lot.calibrated)
    known = any(spread.limits for spread in spreads)
    parts = [
        f"{whole(len(lot.failed))} not calibrated",
        f"{whole(len(far))} beyond {FAR:g} robust s.d. in some quantity" if known else "too few to say which lie far",
    ]
    return Figure(
        label="Need a look",
        value=whole(len(lot.failed) + len(far)),
        note=f"{', '.join(parts)}. {whole(warned)} have a warning of their recordings",
    )


def _spread_figure(label: str, note: str, spreads: Sequence[Spread]) -> Figure:
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
