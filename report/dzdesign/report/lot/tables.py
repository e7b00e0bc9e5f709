"""Tables of the report of a lot."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import astuple, fields, replace

from dzdesign.core.errors import and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.lot.folder import Lot
from dzdesign.report.lot.outputs import output_verdicts
from dzdesign.report.lot.reasons import ReasonGroup
from dzdesign.report.lot.spread import EXTRA, QUANTITIES, Quantity, Spread
from dzdesign.report.lot.summary import LotSettingSummary, Quantiles
from dzdesign.report.lot.table import TABLE, TableRow, safe_cell
from dzdesign.report.lot.valve_names import short
from dzdesign.report.sections.cells import Cell, Table, finding, in_number_font, number, recorded, table_of, whole

#: Valves that a cell names, and rows that a table has in the page; all of them stand in the CSV.
NAMED, ROWS = 40, 100
#: A lot of so many valves stands in the page with every row; of a larger one in which none lies far the first.
SMALL_LOT, FIRST = 50, 10
#: Characters of a table that the page holds: some 4000 valves.
EMBEDDED = 2_000_000


def failed_table(groups: Sequence[ReasonGroup], failed: Sequence[TableRow]) -> Table:
    """Return the reasons, those of one kind in one row; the reason of each valve is in the CSV."""

    def names(group: ReasonGroup) -> str:
        named = [f"{name} ({particular})" if particular else name for name, particular in group.valves]
        return and_more(named, NAMED)

    return table_of(
        "Why valves are not calibrated, by kind of reason",
        groups,
        ("status", lambda group: _failed(group.status)),
        ("valves", lambda group: in_number_font(whole(len(group.valves)))),
        ("what is wrong", lambda group: finding(group.what)),
        ("what is expected, or to be done", lambda group: finding(group.advice or "–")),
        ("names", names),
        csv=csv_text(
            ("name", "status", "reason"),
            ([safe_cell(text) for text in (row.name, row.status, row.reason)] for row in failed),
        ),
        name="not-calibrated",
    )


def _cell(quantity: Quantity, value: float | None, units: RecordedUnits) -> Cell:
    """Return a value of a quantity, in the unit of the recordings."""
    if quantity.unit == "V":
        return recorded(value, f".{quantity.digits}f V", units)
    return number(value, quantity.digits)


def spread_table(spreads: Sequence[Spread]) -> Table:
    """Return quantiles of every quantity, with the names of the extreme valves."""

    def quantile(name: str) -> Callable[[Spread], Cell]:
        return lambda spread: _cell(spread.quantity, getattr(spread.at, name), spread.units)

    def end(name: str, place: int) -> Callable[[Spread], Cell]:
        return lambda spread: replace(quantile(name)(spread), more=short(spread.ends[place]))

    def deviation(spread: Spread) -> Cell:
        known, digits = spread.deviation if spread.limits else None, spread.quantity.digits + 1
        return recorded(known, f".{digits}f dV", spread.units) if spread.quantity.unit == "V" else number(known, digits)

    def csv_row(spread: Spread) -> list[object]:
        known = (round(spread.deviation, 7), len(spread.far())) if spread.limits else (None, None)
        return [spread.column, len(spread.values), *astuple(spread.at), *spread.ends, *known]

    names = [each.name for each in fields(Quantiles)]
    return table_of(
        "How the calibrated valves scatter",
        spreads,
        ("quantity", lambda spread: spread.heading),
        ("valves", lambda spread: in_number_font(whole(len(spread.values)))),
        ("least", end("least", 0)),
        ("5 %", quantile("q05")),
        ("median", quantile("median")),
        ("95 %", quantile("q95")),
        ("largest", end("largest", 1)),
        ("robust s.d.", deviation),
        ("far from the rest", lambda spread: in_number_font(whole(len(spread.far())) if spread.limits else "–")),
        csv=csv_text(
            ("quantity", "valves", *names, "least_is", "largest_is", "robust_sd", "far"), map(csv_row, spreads)
        ),
        name="spread",
    )


def far_table(spreads: Sequence[Spread]) -> Table | None:
    """Return the valves that lie far from the rest, the farthest first; None if there are none."""
    found = [(spread, name, value) for spread in spreads for name, value in spread.far()]
    if not found:
        return None
    found.sort(key=lambda one: -abs(one[0].distance(one[2])))
    return table_of(
        f"Far from the rest, the first {ROWS} of {len(found)}" if len(found) > ROWS else "Far from the rest",
        found[:ROWS],
        ("valve", lambda one: one[1]),
        ("quantity", lambda one: one[0].heading),
        ("value", lambda one: _cell(one[0].quantity, one[2], one[0].units)),
        ("median of the lot", lambda one: _cell(one[0].quantity, one[0].at.median, one[0].units)),
        ("robust s.d. from the median", lambda one: number(one[0].distance(one[2]), 1, "+")),
        csv=csv_text(
            ("valve", "quantity", "value", "median", "robust_sd_from_median"),
            (
                (name, spread.column, value, spread.at.median, round(spread.distance(value), 2))
                for spread, name, value in found
            ),
        ),
        name="far-from-the-rest",
    )


def warnings_table(lot: Lot) -> Table | None:
    """Return the warnings of the calibrated valves by code; None if there are none."""
    by_code: dict[str, list[str]] = {}
    for row in lot.calibrated:
        for code in row.warnings:
            by_code.setdefault(code, []).append(row.name)
    if not by_code:
        return None
    ordered = sorted(by_code.items(), key=lambda one: (-len(one[1]), one[0]))
    count = len(lot.calibrated)
    return table_of(
        "Warnings of the recordings, by code",
        ordered,
        ("code", lambda one: Cell(text=one[0], kind="symbol")),
        ("valves", lambda one: in_number_font(f"{whole(len(one[1]))} of {whole(count)}")),
        ("in the first of them it says", lambda one: lot.warning_texts.get(one[0], "–")),
        ("names", lambda one: "all" if len(one[1]) == count > 1 else and_more(one[1], NAMED)),
        csv=csv_text(("code", "valve"), ((code, name) for code, names in ordered for name in names)),
        name="warnings",
    )


def holding_table(lot: Lot, setting: LotSettingSummary) -> Table:
    """Return the valves that hold the lot setting down."""
    rows = {row.name: row for row in lot.rows}

    def figure_of(side: str, column: str) -> Callable[[str], Cell]:
        units = lot.units.of_side(side)
        shown = QUANTITIES[column]
        return lambda name: _cell(shown, rows[name].number(side, column) if name in rows else None, units)

    def margins(name: str) -> Cell:
        found = setting.smallest_margin_V.get(name, ())
        shown = [lot.units.number(1e3 * margin, ".3f mV") for margin in found]
        return in_number_font(" and ".join(shown) or "–")

    caption = "Valves that hold the lot setting down"
    if len(setting.binding) > ROWS:
        caption += f", the first {ROWS} of {len(setting.binding)}"
    of = {side: f", {side}" if side else "" for side in lot.sides}
    return table_of(
        caption,
        setting.binding[:ROWS],
        ("valve", lambda name: name),
        (f"margin under its own ceiling ({lot.units.label('mV')})", margins),
        *(
            (f"own offset at dP0{words} ({lot.units.label('V')})", figure_of(side, "offset_V"))
            for side, words in of.items()
        ),
        *((f"extra dead zone{words} (%)", figure_of(side, EXTRA)) for side, words in of.items()),
        notes=(
            "A valve's own ceiling, which its own offset may not exceed, runs straight between its tests, at its "
            "bounds or under them: this margin is no larger than that valve's margin under its bounds, which is said "
            "above of the nearest valve. Both are of the exact law, with half a count of rounding added; what dzdesign "
            "verify states is of the whole numbers that the C code gives.",
        ),
    )


def valves_table(lot: Lot, far: Collection[str]) -> Table | None:
    """Return the table in short: of a small lot every row, of a large one the valves that lie far; all of it as CSV."""
    if not lot.rows:
        return None
    rows, caption = lot.rows, "All valves"
    if len(rows) > SMALL_LOT:
        rows, caption = tuple(row for row in rows if row.name in far), "Calibrated valves far from the rest"
    if not rows:
        rows, caption = lot.rows[:FIRST], f"The first {FIRST} valves, since none lies far from the rest"
    if len(rows) > ROWS:
        rows, caption = rows[:ROWS], f"{caption}, the first {ROWS} of {len(rows)}"
    embedded = len(lot.table) <= EMBEDDED

    def figure_of(side: str, quantity: Quantity) -> Callable[[TableRow], Cell]:
        return lambda row: _cell(quantity, row.number(side, quantity.column), lot.units.of_side(side))

    return table_of(
        caption,
        rows,
        ("valve", lambda row: Cell(text=row.name, more=output_verdicts(row))),
        *((("serial", lambda row: _serial(row) or "–"),) if any(map(_serial, lot.rows)) else ()),
        ("status", lambda row: Cell(text="✓ ok", kind="good") if row.calibrated else _failed(row.status)),
        *(
            (f"{side} {quantity.short_heading(lot.units)}".lstrip(), figure_of(side, quantity))
            for side in lot.sides
            for quantity in QUANTITIES.values()
        ),
        ("warnings", lambda row: " ".join(row.warnings) or "–"),
        csv=lot.table if embedded else "",
        name="valves",
        notes=() if embedded else (f"The whole table is too large for a page; it is {TABLE} beside it.",),
    )


def _failed(status: str) -> Cell:
    return Cell(text=f"✗ {status}", kind="bad")


def _serial(row: TableRow) -> str:
    return next((text for name, text in row.record.items() if name.casefold() == "serial"), "")


def provenance_table(lot: Lot) -> Table:
    """Return the files that the report was made from."""
    return table_of(
        "What this report was made from, with the SHA-256 of the bytes",
        lot.hashes,
        ("file", lambda one: one[0]),
        ("SHA-256", lambda one: Cell(text=one[1], kind="hash")),
        ("made by", lambda one: f"{lot.tool.name} {lot.tool.version}"),
    )
