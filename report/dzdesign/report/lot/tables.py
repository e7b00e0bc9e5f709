"""Tables of the report of a lot."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from dzdesign.batch.calibration import OK
from dzdesign.batch.reasons import ReasonGroup
from dzdesign.batch.table import TABLE, safe_cell
from dzdesign.batch.valves import RECORD
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.lot.folder import Lot
from dzdesign.report.lot.spread import Spread, short
from dzdesign.report.sections.cells import Cell, Table, number, whole

#: Valves that a cell names, and rows that a table has in the page; all of them stand in the CSV.
NAMED, ROWS = 40, 100
#: A lot of so many valves stands in the page with every row; of a larger one in which none lies far the first.
SMALL_LOT, FIRST = 50, 10
#: Characters of a table that the page holds: some 4000 valves.
EMBEDDED = 2_000_000
#: Columns of the whole table that the page shows, with heading and decimals.
SHOWN = (
    ("knee_opening_V", "knee opening (V)", 3),
    ("knee_closing_V", "knee closing (V)", 3),
    ("offset_V", "offset (V)", 3),
    ("beta_at_highest_dp", "β at highest dP", 4),
    ("k_x_max_over_u_max", "k x_max/u_max", 4),
    ("dead_zone_opening_percent", "left on opening (%)", 2),
    ("dead_zone_closing_percent", "left on closing (%)", 2),
    ("common_extra_dead_zone_percent", "extra of the common setting (%)", 2),
)


def named(names: Sequence[str], most: int = NAMED) -> str:
    """Return names for a sentence or a cell, and how many more there are.

    Parameters
    ----------
    names : sequence of str
    most : int
        That are named.

    Examples
    --------
    >>> named(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    more = f" and {whole(len(names) - most)} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def failed_table(groups: Sequence[ReasonGroup], failed: Sequence[Mapping[str, Any]]) -> Table:
    """Return the reasons, those of one kind in one row.

    Parameters
    ----------
    groups : sequence of ReasonGroup
    failed : sequence of mapping
        Rows of the table.
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
                Cell(text=named(names)),
            )
        )
    return Table(
        caption="Why valves are not calibrated, by kind of reason",
        columns=("status", "valves", "what is wrong", "what is expected, or to be done", "names"),
        rows=tuple(rows),
        csv=csv_text(
            ("name", "status", "reason"),
            ([safe_cell(row[key]) for key in ("name", "status", "reason")] for row in failed),
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
        digits, far = spread.quantity.digits, spread.far()
        ends = [
            Cell(text=number(spread.at[q], digits).text, kind="number", more=short(spread.name_at(q))) for q in "01"
        ]
        middle = [number(spread.at[q], digits) for q in ("0.05", "0.5", "0.95")]
        known = spread.limits is not None
        cells.append(
            (
                Cell(text=spread.heading),
                Cell(text=whole(len(spread.values)), kind="number"),
                ends[0], *middle, ends[1],
                number(spread.deviation if known else None, digits + 1),
                Cell(text=whole(len(far)) if known else "–", kind="number"),
            )
        )  # fmt: skip
        rows.append(
            [
                spread.side + spread.quantity.column, len(spread.values),
                *(spread.at[q] for q in ("0", "0.05", "0.25", "0.5", "0.75", "0.95", "1")),
                spread.name_at("0"), spread.name_at("1"), round(spread.deviation, 7) if known else None,
                len(far) if known else None,
            ]
        )  # fmt: skip
    return Table(
        caption="How the calibrated valves scatter",
        columns=("quantity", "valves", "least", "5 %", "median", "95 %", "largest", "robust s.d.", "far from the rest"),
        rows=tuple(cells),
        csv=csv_text(
            ("quantity", "valves", "least", "q05", "q25", "median", "q75", "q95", "largest", "least_is", "largest_is",
             "robust_sd", "far"),
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
            number(spread.at["0.5"], spread.quantity.digits),
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
                (name, spread.side + spread.quantity.column, value, spread.at["0.5"], round(spread.distance(value), 2))
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
        for code in row["warnings"].split():
            by_code.setdefault(code, []).append(row["name"])
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
                Cell(text="all" if len(names) == count > 1 else named(names)),
            )
            for code, names in ordered
        ),
        csv=csv_text(("code", "valve"), ((code, name) for code, names in ordered for name in names)),
        name="warnings",
    )


def holding_table(lot: Lot) -> Table | None:
    """Return the valves that hold the common setting down; None if there is no such setting.

    Parameters
    ----------
    lot : Lot
    """
    common = lot.common()
    if common is None:
        return None
    rows = {row["name"]: row for row in lot.rows}
    margins = common["smallest_margin_V"]
    cells = []
    for name in common["binding"]:
        row = rows.get(name, {})
        margin = [f"{1e3 * each:.3f}" for each in margins.get(name, []) if isinstance(each, int | float)]
        cells.append(
            (
                Cell(text=name),
                Cell(text=" and ".join(margin) or "–", kind="number"),
                *(number(row.get(side + "offset_V"), 3) for side in lot.sides),
                *(number(row.get(side + "common_extra_dead_zone_percent"), 2) for side in lot.sides),
            )
        )
    of = [f", {side.rstrip('_')}" if side else "" for side in lot.sides]
    caption = "Valves that hold the common setting down"
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
        rows, caption = tuple(row for row in rows if row["name"] in far), "Calibrated valves far from the rest"
    if not rows:
        rows, caption = lot.rows[:FIRST], f"The first {FIRST} valves, since none lies far from the rest"
    if len(rows) > ROWS:
        rows, caption = rows[:ROWS], f"{caption}, the first {ROWS} of {len(rows)}"
    columns = [
        (side + column, f"{side.rstrip('_')} {heading}" if side else heading, digits)
        for side in lot.sides
        for column, heading, digits in SHOWN
    ]
    serials = [column for column in lot.rows[0] if column.casefold() == f"{RECORD}serial"]
    serial = ("serial",) if serials else ()
    good, embedded = Cell(text="✓ ok", kind="good"), len(lot.table) <= EMBEDDED
    return Table(
        caption=caption,
        columns=("valve", *serial, "status", *(heading for _, heading, _ in columns), "warnings"),
        rows=tuple(
            (
                Cell(text=row["name"]),
                *(Cell(text=next((row[key] for key in serials if row[key]), "–")) for _ in serial),
                good if row["status"] == OK else Cell(text=f"✗ {row['status']}", kind="bad"),
                *(number(row[column], digits) for column, _, digits in columns),
                Cell(text=row["warnings"] or "–"),
            )
            for row in rows
        ),
        csv=lot.table if embedded else "",
        name="valves",
        notes=() if embedded else (f"The whole table is too large for a page; it is {TABLE} beside it.",),
    )


def provenance_table(lot: Lot) -> Table:
    """Return the files that the report was made from.

    Parameters
    ----------
    lot : Lot
    """
    tool = lot.document.get("tool")
    made_by = f"{tool.get('name')} {tool.get('version')}" if isinstance(tool, dict) else "–"
    return Table(
        caption="What this report was made from, with the SHA-256 of the bytes",
        columns=("file", "SHA-256", "made by"),
        rows=tuple(
            (Cell(text=name), Cell(text=sha256, kind="hash"), Cell(text=made_by)) for name, sha256 in lot.hashes
        ),
    )
