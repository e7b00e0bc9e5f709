"""valves.csv: the table of a lot, one row per valve, written and read back."""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import get_args

from dzdesign.core.errors import InputError, quoted
from dzdesign.report.lot.summary import AGAIN, LARGEST, OK, Status

TABLE = "valves.csv"
#: A column that is an entry of each valve's record: record.serial.
RECORD = "record."
#: Columns of an output of the valves, such as output.fmu: its verdict, and the SHA-256 of its manifest.
OUTPUT, OUTPUT_HASH = "output.", ".manifest_sha256"
#: A spreadsheet takes a cell that begins so for a formula, but for the '; one more ' before it makes it text.
FORMULA = re.compile(r"'*[=+\-@]")
SAFE = re.compile(f"'{FORMULA.pattern}")
#: Column of a hash -> the file of a valve's folder that has it.
HASHED = {
    "valve_json_sha256": "valve.json",
    "compensator_json_sha256": "compensator.json",
    "firmware_manifest_sha256": "firmware/manifest.json",
    "calibration_bin_sha256": "calibration.bin",
}
#: Columns of words before those of the sides, and after them.
FIRST, LAST = ("name", "status", "reason"), ("warnings", "inputs_sha256", *HASHED)

Cell = str | float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SideFigures:
    """Columns of one side of a valve, named after it where the lot has both; blank where it is not calibrated.

    The dead zones are what the valve's own compensator leaves, and what the lot setting leaves beyond that, in percent
    of command: at the pressure drop of its tests where that is most.
    """

    dp0_MPa: float | None = None
    knee_opening_V: float | None = None
    knee_closing_V: float | None = None
    knee_se_V: float | None = None
    bound_V: float | None = None
    offset_V: float | None = None
    trend: str | None = None
    highest_dp_MPa: float | None = None
    beta_at_highest_dp: float | None = None
    k_x_max_over_u_max: float | None = None
    dead_zone_opening_percent: float | None = None
    dead_zone_closing_percent: float | None = None
    lot_extra_dead_zone_percent: float | None = None


SIDE_COLUMNS = tuple(each.name for each in fields(SideFigures))


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRow:
    """One valve of the lot: what its folder's manifest says, and its figures by side ("" where the lot has one).

    `hashes` has SHA-256 by column, ``inputs_sha256`` and those of `HASHED`; `record` who and what, as the engineer
    says; `outputs` the cells about its outputs, by column without `OUTPUT`.
    """

    name: str
    status: Status
    reason: str
    sides: Mapping[str, SideFigures]
    warnings: tuple[str, ...] = ()
    hashes: Mapping[str, str] = field(default_factory=dict)
    record: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def calibrated(self) -> bool:
        """Whether it is."""
        return self.status == OK

    def number(self, side: str, column: str) -> float | None:
        """Return a number of a side."""
        value = getattr(self.sides[side], column)
        return value if isinstance(value, float | int) else None

    def cells(self) -> dict[str, Cell]:
        """Return the row as the file has it, but for its record."""
        sides = {
            column_of(side, column): getattr(figures, column)
            for side, figures in self.sides.items()
            for column in SIDE_COLUMNS
        }
        hashes = {column: self.hashes.get(column) for column in LAST[1:]}
        first = {"name": self.name, "status": self.status, "reason": self.reason}
        return {**first, **sides, "warnings": " ".join(self.warnings), **hashes}


def column_of(side: str, column: str) -> str:
    """Return the name of a side's column.

    Examples
    --------
    >>> column_of("", "offset_V"), column_of("negative", "offset_V")
    ('offset_V', 'negative_offset_V')
    """
    return f"{side}_{column}" if side else column


def safe_cell(text: str) -> str:
    """Return a text as a cell that no spreadsheet takes for a formula; `read_table` takes it back.

    Examples
    --------
    >>> safe_cell("=1+1"), safe_cell("'=1"), safe_cell("4711")
    ("'=1+1", "''=1", '4711')
    """
    return f"'{text}" if FORMULA.match(text) else text


def table_files(rows: Sequence[TableRow]) -> dict[str, bytes]:
    """Return valves.csv and valves.parquet, the same rows in both, but for `safe_cell` in the former."""
    import polars

    outputs = dict.fromkeys(name for row in rows for name in row.outputs)
    names = dict.fromkeys(name for row in rows for name in row.record)
    cells = [
        {
            **row.cells(),
            **{OUTPUT + name: row.outputs.get(name) for name in outputs},
            **{RECORD + name: row.record.get(name) for name in names},
        }
        for row in rows
    ]
    frame = polars.DataFrame(
        cells, schema={column: polars.String if _is_text(column) else polars.Float64 for column in cells[0]}
    )
    parquet = io.BytesIO()
    frame.write_parquet(parquet)
    safe = frame.with_columns(polars.col(polars.String).str.replace(f"^({FORMULA.pattern})", "'${1}"))
    return {TABLE: safe.write_csv().encode(), "valves.parquet": parquet.getvalue()}


def _is_text(column: str) -> bool:
    return column in (*FIRST, *LAST) or column.endswith("trend") or column.startswith((OUTPUT, RECORD))


def read_table(content: bytes, source: str) -> list[TableRow]:
    """Read valves.csv; a number is finite and of a size that a valve can have."""
    try:
        reader = csv.reader(io.StringIO(content.decode("utf-8"), newline=""), strict=True)
        heading, *lines = [*reader] or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"'{source}' is not a table in UTF-8: {error}; {AGAIN}") from error
    sides = ("positive", "negative") if column_of("positive", SIDE_COLUMNS[0]) in heading else ("",)
    wanted = (*FIRST, *LAST, *(column_of(side, column) for side in sides for column in SIDE_COLUMNS))
    lost = [column for column in wanted if column not in heading]
    if lost or not lines:
        what = f"lacks the column '{lost[0]}'" if lost else "has no valve"
        raise InputError(f"'{source}' {what}; {AGAIN}")
    return [_row(heading, line, sides, f"'{source}' row {number}") for number, line in enumerate(lines, start=2)]


def _row(heading: Sequence[str], line: Sequence[str], sides: Sequence[str], where: str) -> TableRow:
    if len(line) != len(heading):
        raise InputError(f"{where} has {len(line)} cells, expected {len(heading)}; {AGAIN}")
    cells = dict(zip(heading, line, strict=True))
    words = {name: cell[1:] if SAFE.match(cell) else cell for name, cell in cells.items() if _is_text(name)}
    values = {name: words[name] or None if name in words else _number(cells[name], name, where) for name in heading}
    status = next((each for each in get_args(Status) if each == words["status"]), None)
    if status is None:
        raise InputError(f"{where}, column 'status' is {quoted(words['status'])}, expected a status; {AGAIN}")
    return TableRow(
        name=words["name"],
        status=status,
        reason=words["reason"],
        sides={
            side: SideFigures(**{column: values[column_of(side, column)] for column in SIDE_COLUMNS})  # type: ignore[arg-type]
            for side in sides
        },
        warnings=tuple(words["warnings"].split()),
        hashes={column: words[column] for column in LAST[1:] if words[column]},
        record={name.removeprefix(RECORD): cell for name, cell in words.items() if name.startswith(RECORD) and cell},
        outputs={name.removeprefix(OUTPUT): cell for name, cell in words.items() if name.startswith(OUTPUT) and cell},
    )


def _number(cell: str, column: str, where: str) -> float | None:
    try:
        value = float(cell) if cell else None
    except ValueError:
        value = math.nan
    if value is not None and not abs(value) <= LARGEST:
        raise InputError(f"{where}, column '{column}' is {quoted(cell)}, expected a number; {AGAIN}")
    return value
