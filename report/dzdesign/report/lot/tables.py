"""Tables of the report of a lot."""

from collections.abc import Collection, Sequence
from dataclasses import astuple, fields

from dzdesign.core.errors import and_more
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.lot.folder import Lot
from dzdesign.report.lot.reasons import ReasonGroup
from dzdesign.report.lot.spread import Spread
from dzdesign.report.lot.summary import LotSettingSummary, Quantiles
from dzdesign.report.lot.table import TABLE, TableRow, safe_cell
from dzdesign.report.lot.valve_names import short
from dzdesign.report.sections.cells import Cell, Table, number, whole

#: Valves that a cell names, and rows that a table has in the page; all of them stand in the CSV.
NAMED, ROWS = 40, 100
#: A lot of so many valves stands in the page with every row; of a larger one in which none lies far the first.
SMALL_LOT, FIRST = 50, 10
#: Characters of a table that the page holds: some 4000 valves.
EMBEDDED = 2_000_000
#: Columns of the whole table that the page shows, with heading and decimals.
NUMBERS = (
    ("knee_opening_V", "knee opening (V)", 3),
    ("knee_closing_V", "knee closing (V)", 3),
    ("offset_V", "offset (V)", 3),
    ("beta_at_highest_dp", "β at highest dP", 4),
    ("k_x_max_over_u_max", "k x_max/u_max", 4),
    ("dead_zone_opening_percent", "left on opening (%)", 2),
    ("dead_zone_closing_percent", "left on closing (%)", 2),
    ("lot_extra_dead_zone_percent", "extra of the lot setting (%)", 2),
)


def failed_table(groups: Sequence[ReasonGroup], failed: Sequence[TableRow]) -> Table:
    """Return the reasons, those of one kind in one row.

    Parameters
    ----------
    groups : sequence of ReasonGroup
    failed : sequence of TableRow
    """
    rows = []
    for group in groups:
        names = [f"{name} ({own})" if own else name for name, own in group.valves]
        rows.append(
            (
                Cell(text=f"✗ {group.status}", kind="bad"),
                Cell(text=whole(len(names)), kind="number"),
                Cell(text=group.what),
                Cell(text=group.advice or "–"),
                Cell(text=and_more(names, NAMED)),
            )
        )
    return Table(
        caption="Why valves are not calibrated, by kind of reason",
        columns=("status", "valves", "what is wrong", "what is expected, or to be done", "names"),
        rows=tuple(rows),
        csv=csv_text(
            ("name", "status", "reason"),
            ([safe_cell(text) for text in (row.name, row.status, row.reason)] for row in failed),
        ),
        name="not-calibrated",
    )


def spread_table(spreads: Sequence[Spread]) -> Table:
    """Return quantiles of every quantity, with the names of the extreme valves.

    Parameters
    ----------
    spreads : sequence of Spread
    """
    cells, rows = [], []
    for spread in spreads:
        digits, far, at = spread.quantity.digits, spread.far(), spread.at
        least, largest = (
            Cell(text=number(value, digits).text, kind="number", more=short(name))
            for value, name in zip((at.least, at.largest), spread.ends, strict=True)
        )
        known = spread.limits is not None
        cells.append(
            (
                Cell(text=spread.heading),
                Cell(text=whole(len(spread.values)), kind="number"),
                least, *(number(value, digits) for value in (at.q05, at.median, at.q95)), largest,
                number(spread.deviation if known else None, digits + 1),
                Cell(text=whole(len(far)) if known else "–", kind="number"),
            )
        )  # fmt: skip
        deviation, count = (round(spread.deviation, 7), len(far)) if known else (None, None)
        rows.append([spread.column, len(spread.values), *astuple(at), *spread.ends, deviation, count])
    return Table(
        caption="How the calibrated valves scatter",
        columns=("quantity", "valves", "least", "5 %", "median", "95 %", "largest", "robust s.d.", "far from the rest"),
        rows=tuple(cells),
        csv=csv_text(
            (
                "quantity", "valves", *(each.name for each in fields(Quantiles)), "least_is", "largest_is",
                "robust_sd", "far",
            ),
            rows,
        ),
        name="spread",
    )  # fmt: skip


def far_table(spreads: Sequence[Spread]) -> Table | None:
    """Return the valves that lie far from the rest, the farthest first; None if there are none.

    Parameters
    ----------
    spreads : sequence of Spread
    """
    found = [(spread, name, value) for spread in spreads for name, value in spread.far()]
    if not found:
        return None
    found.sort(key=lambda one: -abs(one[0].distance(one[2])))
    cells = tuple(
        (
            Cell(text=name),
            Cell(text=spread.heading),
            number(value, spread.quantity.digits),
            number(spread.at.median, spread.quantity.digits),
            number(spread.distance(value), 1, "+"),
        )
        for spread, name, value in found[:ROWS]
    )
    return Table(
        caption=f"Far from the rest, the first {ROWS} of {len(found)}" if len(found) > ROWS else "Far from the rest",
        columns=("valve", "quantity", "value", "median of the lot", "robust s.d. from the median"),
        rows=cells,
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
    """Return the warnings of the calibrated valves by code; None if there are none.

    Parameters
    ----------
    lot : Lot
    """
    by_code: dict[str, list[str]] = {}
    for row in lot.calibrated:
        for code in row.warnings:
            by_code.setdefault(code, []).append(row.name)
    if not by_code:
        return None
    ordered = sorted(by_code.items(), key=lambda one: (-len(one[1]), one[0]))
    count = len(lot.calibrated)
    return Table(
        caption="Warnings of the recordings, by code",
        columns=("code", "valves", "in the first of them it says", "names"),
        rows=tuple(
            (
                Cell(text=code, kind="symbol"),
                Cell(text=f"{whole(len(names))} of {whole(count)}", kind="number"),
                Cell(text=lot.warning_texts.get(code, "–")),
                Cell(text="all" if len(names) == count > 1 else and_more(names, NAMED)),
            )
            for code, names in ordered
        ),
        csv=csv_text(("code", "valve"), ((code, name) for code, names in ordered for name in names)),
        name="warnings",
    )


def holding_table(lot: Lot, setting: LotSettingSummary) -> Table:
    """Return the valves that hold the lot setting down.

    Parameters
    ----------
    lot : Lot
    setting : LotSettingSummary
        Of it.
    """
    rows = {row.name: row for row in lot.rows}
    cells = []
    for name in setting.binding:
        row = rows.get(name)
        margins = [f"{1e3 * margin:.3f}" for margin in setting.smallest_margin_V.get(name, ())]
        cells.append(
            (
                Cell(text=name),
                Cell(text=" and ".join(margins) or "–", kind="number"),
                *(
                    number(row.number(side, column) if row else None, digits)
                    for column, digits in (("offset_V", 3), ("lot_extra_dead_zone_percent", 2))
                    for side in lot.sides
                ),
            )
        )
    of = [f", {side}" if side else "" for side in lot.sides]
    caption = "Valves that hold the lot setting down"
    return Table(
        caption=f"{caption}, the first {ROWS} of {len(cells)}" if len(cells) > ROWS else caption,
        columns=(
            "valve", "margin under its own ceiling (mV)", *(f"own offset at dP0{each} (V)" for each in of),
            *(f"extra dead zone{each} (%)" for each in of),
        ),
        rows=tuple(cells[:ROWS]),
        notes=(
            "A valve's own ceiling, which its own offset may not exceed, runs straight between its tests, at its "
            "bounds or under them: this margin is no larger than that valve's margin under its bounds, which is said "
            "above of the nearest valve. Both are of the exact law, with half a count of rounding added; what dzdesign "
            "verify states is of the whole numbers that the C gives.",
        ),
    )  # fmt: skip


def valves_table(lot: Lot, far: Collection[str]) -> Table | None:
    """Return the table in short: of a small lot every row, of a large one the valves that lie far; all of it as CSV.

    Parameters
    ----------
    lot : Lot
    far : collection of str
        Valves far from the rest. Those that are not calibrated have no numbers.
    """
    if not lot.rows:
        return None
    rows, caption = lot.rows, "All valves"
    if len(rows) > SMALL_LOT:
        rows, caption = tuple(row for row in rows if row.name in far), "Calibrated valves far from the rest"
    if not rows:
        rows, caption = lot.rows[:FIRST], f"The first {FIRST} valves, since none lies far from the rest"
    if len(rows) > ROWS:
        rows, caption = rows[:ROWS], f"{caption}, the first {ROWS} of {len(rows)}"
    columns = [
        (side, column, f"{side} {heading}" if side else heading, digits)
        for side in lot.sides
        for column, heading, digits in NUMBERS
    ]
    serials = [_serial(row) for row in rows] if any(map(_serial, lot.rows)) else None
    good, embedded = Cell(text="✓ ok", kind="good"), len(lot.table) <= EMBEDDED
    return Table(
        caption=caption,
        columns=("valve", *(("serial",) if serials else ()), "status", *(each[2] for each in columns), "warnings"),
        rows=tuple(
            (
                Cell(text=row.name),
                *((Cell(text=serials[place] or "–"),) if serials else ()),
                good if row.calibrated else Cell(text=f"✗ {row.status}", kind="bad"),
                *(number(row.number(side, column), digits) for side, column, _, digits in columns),
                Cell(text=" ".join(row.warnings) or "–"),
            )
            for place, row in enumerate(rows)
        ),
        csv=lot.table if embedded else "",
        name="valves",
        notes=() if embedded else (f"The whole table is too large for a page; it is {TABLE} beside it.",),
    )


def _serial(row: TableRow) -> str:
    return next((text for name, text in row.record.items() if name.casefold() == "serial"), "")


def provenance_table(lot: Lot) -> Table:
    """Return the files that the report was made from.

    Parameters
    ----------
    lot : Lot
    """
    made_by = f"{lot.tool.name} {lot.tool.version}"
    return Table(
        caption="What this report was made from, with the SHA-256 of the bytes",
        columns=("file", "SHA-256", "made by"),
        rows=tuple(
            (Cell(text=name), Cell(text=sha256, kind="hash"), Cell(text=made_by)) for name, sha256 in lot.hashes
        ),
    )
