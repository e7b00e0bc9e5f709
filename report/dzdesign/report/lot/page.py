"""report.html of a lot: from how many valves are calibrated to the hashes, in the style of the report of one valve."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from dzdesign.core.errors import and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.firmware_manifest import setting_words
from dzdesign.report.figure import figure_style
from dzdesign.report.lot.folder import Lot, read_lot
from dzdesign.report.lot.spread import EXTRA, FAR, FEWEST, TWENTY, Spread, spread_figure, spreads_of
from dzdesign.report.lot.summary import DOES_NOT_HOLD, OK, VALVES, LotSettingSummary, LotSummary, Quantiles
from dzdesign.report.lot.table import OUTPUT, OUTPUT_HASH, RECORD, column_of
from dzdesign.report.page import (
    Cell,
    Figure,
    Headline,
    Page,
    Report,
    Section,
    Table,
    finding,
    in_number_font,
    report_of,
    table_of,
    table_of_rows,
    whole,
)

#: Valves that the verdict names, and anomalies; valves that a cell names, and rows of the table in the page.
IN_VERDICT, ANOMALIES_IN_VERDICT, NAMED, ROWS = 8, 3, 20, 50
#: Columns of the cards, their labels, and of what they are.
CARDS = (
    ("dead_zone_opening_percent", "Dead zone left on opening", "of command, the worst of a valve's pressure drops"),
    ("dead_zone_closing_percent", "Dead zone left on closing", "of command, the worst of a valve's pressure drops"),
    (EXTRA, "Cost of one lot setting", "more dead zone than with each valve's own"),
)
#: Columns that are drawn; the table and its CSV have all.
DRAWN = ("knee_opening_V", "offset_V", "k_x_max_over_u_max", "dead_zone_opening_percent", EXTRA)
FAR_RULE = (
    f"Far from the rest: further from the lot's median than {FAR:g} robust standard deviations (s.d.), 1.4826 times "
    "the median absolute deviation. Of a normal lot one valve in 2000 lies there in each quantity by chance. No "
    "verdict: these valves are calibrated; look for a mix-up, a part, or the recording."
)


def report_of_lot(folder: Path, logo: str = "") -> Report:
    """Make the report of the folder of a lot; `logo` is a data: address."""
    lot = read_lot(folder)
    spreads = spreads_of(lot.frame, lot.units)
    missing = list(lot.missing)
    if len(lot.calibrated) and not lot.summary.verified:
        missing.append("the evidence of each valve: `dzdesign batch --verify` makes it")
    hashes = [(name, Cell(text=digest, kind="hash")) for name, digest in lot.hashes]
    with figure_style():
        sections = {
            "valves": Section(tables=(_valves_table(lot, spreads),)),
            "spread": _spread_section(lot, spreads),
            "setting": _setting_section(lot),
            "warnings": _warnings_section(lot.summary),
            "provenance": Section(tables=(table_of_rows("Files that were read", ("file", "SHA-256"), hashes),)),
        }
    if lot.summary.outputs:
        sections["outputs"] = Section(lines=output_lines(lot.summary))
    return report_of(
        Page(
            title=f"Lot of {whole(lot.summary.valves)} {'valve' if lot.summary.valves == 1 else 'valves'}",
            verdict=_headline(lot),
            figures=tuple(_cards(lot, spreads)),
            template="lot.html.jinja",
            sections=sections,
            missing=missing,
            logo=logo,
        )
    )


# --- what it leads with -------------------------------------------------------------------------------------


def _headline(lot: Lot) -> Headline:
    """Return the verdict: good only if every valve is calibrated and verified, and every file fits."""
    anomalies = lot.summary.anomalies
    lines = [f"odd: {text}" for text in anomalies[:ANOMALIES_IN_VERDICT]]
    if simulated := lot.summary.warnings.get("simulated"):
        lines.insert(0, f"SIMULATED recordings, not of measured valves: {and_more(simulated, IN_VERDICT)}")
    lines += certified_lines(lot.summary.certified_of)
    lines += untested_lines(lot.summary.lot_setting, lot.units) if lot.summary.lot_setting else ()
    more = len(anomalies) - ANOMALIES_IN_VERDICT
    lines += [f"odd: {more} more, under “Warnings”"] if more > 0 else []
    return replace(_verdict(lot), cautions=tuple(lines), some_failed=bool(len(lot.failed)))


def _verdict(lot: Lot) -> Headline:
    done, count = len(lot.calibrated), len(lot.frame)
    if not count:
        return Headline(kind="open", text="NOT KNOWN: the table is not here")
    by_status = {key[0]: rows["name"].to_list() for key, rows in lot.failed.group_by("status", maintain_order=True)}
    reasons = tuple(
        f"{whole(len(names))} {status}: {and_more(names, IN_VERDICT)}"
        for status, names in sorted(by_status.items(), key=lambda item: -len(item[1]))
    )
    if not done:
        text = f"NONE of {whole(count)} valves calibrated" if count > 1 else "The valve is NOT calibrated"
        return Headline(kind="bad", text=text, reasons=reasons)
    words, outputs = f"{whole(done)} of {whole(count)} valves calibrated", lot.summary.outputs
    if reasons:
        kind = "bad" if DOES_NOT_HOLD in by_status else "open"
        return Headline(kind=kind, text=f"{words}, {whole(count - done)} NOT", reasons=reasons)
    if lot.summary.verified:
        what = "firmware and the outputs of each are" if outputs else "firmware of each is"
        return Headline(kind="good", text=f"{words}, and the {what} verified")
    if lot.summary.firmware:
        text = f"{words}, each block tried on every input; the firmware itself is NOT VERIFIED"
    else:
        text = f"{words}; their {'firmware and outputs are' if outputs else 'firmware is'} NOT VERIFIED"
    return Headline(kind="open", text=text)


def _cards(lot: Lot, spreads: Sequence[Spread]) -> Iterator[Figure]:
    """Yield the numbers that matter: how many need a look, and how the valves scatter."""
    far, failed = {name for spread in spreads for name in spread.far["name"]}, len(lot.failed)
    known = any(spread.deviation for spread in spreads)
    odd = f"{whole(len(far))} beyond {FAR:g} robust s.d. in some quantity" if known else "too few to say which lie far"
    warned = int((lot.calibrated["warnings"] != "").sum())
    note = f"{whole(failed)} not calibrated, {odd}. {whole(warned)} have a warning of their recordings"
    yield Figure(label="Need a look", value=whole(failed + len(far)), note=note, kind="open" if failed else "text")
    for column, label, of in CARDS:
        if of_sides := [spread for spread in spreads if spread.quantity.column == column]:
            medians = " and ".join(one.text(one.at.median) for one in of_sides)
            ends = (f"{one.text(one.at.least)} to {one.text(one.at.largest)}" for one in of_sides)
            unit = of_sides[0].unit
            note = f"median, {of}; all from {' and from '.join(ends)} {unit}"
            yield Figure(label=label, value=f"{medians} {unit}", note=note)


# --- the valves and how they scatter ------------------------------------------------------------------------


def _valves_table(lot: Lot, spreads: Sequence[Spread]) -> Table | None:
    """Return a row for each valve: those that are not calibrated, those far from the rest, then the others."""
    if not len(lot.frame):
        return None
    far: dict[str, list[tuple[float, str]]] = {}
    for spread in spreads:
        for name, _, distance in spread.far.iter_rows():
            far.setdefault(name, []).append((distance, f"{spread.heading}: {distance:+.1f} s.d."))
    order = {name: -max(abs(distance) for distance, _ in found) for name, found in far.items()}
    rows = sorted(lot.frame.iter_rows(named=True), key=lambda row: (row["status"] == OK, order.get(row["name"], 0.0)))
    serial = next((name for name in lot.frame.columns if name.casefold() == f"{RECORD}serial"), None)

    def remark(row: dict[str, Any]) -> Cell:
        lies = "; ".join(words for _, words in far.get(row["name"], ())).replace("-", "−")
        return finding(row["reason"] or (f"far from the rest: {lies}" if lies else "–"))

    def outputs(row: dict[str, Any]) -> str:
        columns = [name for name in row if name.startswith(OUTPUT) and not name.endswith(OUTPUT_HASH) and row[name]]
        return ", ".join(f"{name.removeprefix(OUTPUT)} {row[name]}" for name in columns)

    def status(row: dict[str, Any]) -> Cell:
        return Cell(text="✓ ok", kind="good") if row["status"] == OK else Cell(text=f"✗ {row['status']}", kind="bad")

    def column(spread: Spread) -> tuple[str, Callable[[dict[str, Any]], Cell]]:
        return spread.heading, lambda row: _value(row[spread.column], spread)

    return table_of(
        "The valves" + (f", the first {ROWS} of {whole(len(rows))}" if len(rows) > ROWS else ""),
        rows[:ROWS],
        ("valve", lambda row: Cell(text=row["name"], more=outputs(row))),
        *((("serial", lambda row: row[serial] or "–"),) if serial else ()),
        ("status", status),
        ("reason, or where it lies far from the rest", remark),
        *map(column, spreads),
        ("warnings", lambda row: row["warnings"] or "–"),
        csv=lot.text,
        name="valves",
        notes=(
            FAR_RULE if len(lot.calibrated) >= FEWEST
            else f"Which valves lie far from the rest is said of lots of {FEWEST} calibrated valves or more.",
        ),
    )  # fmt: skip


def _value(value: float | None, spread: Spread) -> Cell:
    return in_number_font("–" if value is None else spread.text(value).replace("-", "−"))


def _spread_section(lot: Lot, spreads: Sequence[Spread]) -> Section:
    """Return the section on how the calibrated valves scatter, with the names of the extreme ones."""
    if not spreads:
        return Section(missing="No valve is calibrated, so there is nothing to compare.")
    figures = [
        spread_figure(
            f"spread-{side}" if side else "spread",
            [each for each in spreads if each.side == side and each.quantity.column in DRAWN],
            "The calibrated valves in the order of their names, at dP0: the knee, where the straight part of the flow "
            "meets zero; the offset, under the threshold's bound; the drive range from the threshold to full flow; and "
            "the dead zone that each valve's own compensator leaves, and what one setting for all adds to it, at its "
            "worst pressure drop. Where names count up as the valves were measured, a slope or a step is a drift of "
            "the bench or of the production."
            + (f" {side.capitalize()} commands." if side else ""),
        )
        for side in lot.sides
    ]

    def column(heading: str, level: str, end: str = "") -> tuple[str, Callable[[Spread], Cell]]:
        def cell(spread: Spread) -> Cell:
            name = spread.valves["name"][getattr(spread.valves["value"], end)()] if end else ""
            return replace(_value(getattr(spread.at, level), spread), more=name)

        return heading, cell

    table = table_of(
        "How the calibrated valves scatter",
        spreads,
        ("quantity", lambda each: each.heading),
        ("valves", lambda each: in_number_font(whole(len(each.valves)))),
        column("least", "least", "arg_min"),
        column("5 %", "q05"),
        column("median", "median"),
        column("95 %", "q95"),
        column("largest", "largest", "arg_max"),
        ("far from the rest", lambda each: in_number_font(whole(len(each.far)) if each.deviation else "–")),
    )
    return Section(lines=tuple(_tested_lines(lot)), figures=figures, tables=(table,))


def _tested_lines(lot: Lot) -> Iterator[str]:
    """Say at which pressure drops the numbers hold, and which way the thresholds move."""
    for side in lot.sides:
        of = f"{side.capitalize()} commands: " if side else ""
        first, last, trends = (
            lot.calibrated[column_of(side, column)].drop_nulls() for column in ("dp0_MPa", "highest_dp_MPa", "trend")
        )
        if len(first):
            dp0, highest = (lot.units.span(one.min(), one.max(), ".3g MPa") for one in (first, last))
            counts = ", ".join(f"{trend} in {whole(count)}" for trend, count in Counter(trends).most_common())
            yield (f"{of}dP0 is {dp0}, the highest tested pressure drop {highest}. Threshold over the pressure drop: "
                   f"{counts or 'known in no'} valves.")  # fmt: skip


# --- one setting for all ------------------------------------------------------------------------------------


def _setting_section(lot: Lot) -> Section:
    setting = lot.summary.lot_setting
    if setting is None:
        return Section(missing=f"There is no lot setting: {lot.summary.why_no_lot_setting}.", optional=True)
    lines = [checked_line(setting, lot.units), *untested_lines(setting, lot.units), *cost_lines(lot.summary)]
    return Section(
        lines=(
            "The largest offset that over-compensates none of the valves, certified for each of them "
            f"{span(*setting.dp_MPa, lot.units)}, is in {setting.file}; its trend is that of {setting.carrier}. It is "
            f"held down by {and_more(setting.binding, NAMED)}.",
            *(f"{line[0].upper()}{line[1:]}." for line in lines),
        ),
    )


def certified_lines(certified_of: Sequence[str]) -> tuple[str, ...]:
    """Return what the certificates of a lot are of, as a line for a person."""
    bare = not any("machine" in each for each in certified_of)
    left_out = "coil temperature, supply voltage, pressure sensors, oil and ageing are not counted"
    note = f": no machine was declared, so {left_out}" if bare else ""
    return (f"The certificates cover {', of others '.join(certified_of)}{note}.",) if certified_of else ()


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
    """Say which valves were not tested where the lot was, so that the lot setting holds over less."""
    at: dict[tuple[float, ...], dict[str, None]] = {}
    for each in setting.untested:
        at.setdefault(each.dp_MPa, {})[each.name] = None
    wider = f", and without these {span(*setting.dp_without_MPa, units)}" if setting.dp_without_MPa else ""
    return [
        f"{and_more(list(names), 3)} {'was' if len(names) == 1 else 'were'} not tested at "
        f"{' and '.join(units.number(dp, '.4g MPa') for dp in pressures)} {units.label('MPa')}, as the lot was: so the "
        f"lot setting holds for all {span(*setting.dp_MPa, units)}{wider}; record what is missing, or calibrate them "
        "apart"
        for pressures, names in at.items()
    ]


def cost_lines(summary: LotSummary) -> list[str]:
    """Say of each side what one setting for all costs."""
    return [
        (f"{column.removesuffix(EXTRA).rstrip('_')} side: " if column != EXTRA else "")
        + f"it leaves more dead zone than each valve's own setting: {cost_text(at, summary.calibrated)}"
        for column, at in summary.quantiles.items()
        if column.endswith(EXTRA)
    ]


def cost_text(at: Quantiles, count: int) -> str:
    """Say a cost at the median valve, at one in twenty if there are so many, and at most."""
    one_in_twenty = f"{at.q95:.2f} % at one in twenty, " if count >= TWENTY else ""
    return f"{at.median:.2f} % of command at the median valve, {one_in_twenty}{at.largest:.2f} % at most"


def span(low: float, high: float, units: RecordedUnits) -> str:
    """Return a range of pressure drops in words.

    Examples
    --------
    >>> span(1.0, 5.0, RecordedUnits()), span(2.5, 2.5, RecordedUnits())
    ('from 1 to 5 MPa', 'at 2.5 MPa only')
    """
    words = units.span(low, high, ".3g MPa")
    return words if high > low else f"{words} only"


# --- warnings and outputs ---------------------------------------------------------------------------------


def _warnings_section(summary: LotSummary) -> Section:
    """Return the section on warnings of the valves by code, and on what is odd across valves."""
    ordered = sorted(summary.warnings.items(), key=lambda one: (-len(one[1]), one[0]))
    codes = [f"{code}: {len(names)} of {summary.valves} valves: {and_more(names, NAMED)}" for code, names in ordered]
    odd = tuple(f"{text}." for text in summary.anomalies)
    return Section(groups=(("Warnings of the recordings", tuple(codes) or ("None.",)), ("Odd across valves", odd)))


def output_lines(summary: LotSummary) -> tuple[str, ...]:
    """Say of each kind of output of how many valves it was made and holds, and which are the others."""
    lines = []
    for target, output in summary.outputs.items():
        found = {"does not hold": output.does_not_hold, "not made": output.not_made}
        found |= {"NOT VERIFIED": output.not_verified} if summary.verified else {}
        words = [f"made for {output.made} of {summary.valves} valves"]
        words += [f"verified, and holds for {len(output.holds)}"] if summary.verified else ["not verified"]
        words += [f"{verdict} for {and_more(names, NAMED)}" for verdict, names in found.items() if names]
        settings = "".join(f", {word}" for word in setting_words(output.settings))
        lines.append(f"output {target}{settings}: {'; '.join(words)}; in {VALVES}/NAME/{output.folder}")
    return tuple(lines)
