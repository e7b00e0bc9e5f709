"""The table of a lot as a data frame, one row a valve: written as valves.csv and valves.parquet, and read back."""

import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.valve.model import SIDES
from dzdesign.report.lot.summary import AGAIN, ValveManifest

if TYPE_CHECKING:
    from polars import DataFrame

#: The table for a spreadsheet, and the same typed, which the report reads.
TABLE, TYPED_TABLE = "valves.csv", "valves.parquet"
#: A column that is an entry of each valve's record: record.serial.
RECORD = "record."
#: Columns of an output of the valves, such as output.fmu: its verdict, and the SHA-256 of its manifest.
OUTPUT, OUTPUT_HASH = "output.", ".manifest_sha256"
#: A spreadsheet takes a cell that begins so for a formula, but for the '; one more ' before it makes it text.
FORMULA = r"'*[=+\-@]"
#: Column of a hash -> the file of a valve's folder that has it.
HASHED = {
    "valve_json_sha256": "valve.json",
    "compensator_json_sha256": "compensator.json",
    "firmware_manifest_sha256": "firmware/manifest.json",
    "calibration_bin_sha256": "calibration.bin",
}
#: Columns of words before those of the sides, and after them.
FIRST, LAST = ("name", "status", "reason"), ("warnings", "inputs_sha256", *HASHED)
#: Columns of one side of a valve, named after it where the lot has both; blank where it is not calibrated. The dead
#: zones are what the valve's own compensator leaves, and what the lot setting leaves beyond that, in percent of
#: command: at the pressure drop of its tests where that is most.
SIDE_COLUMNS = (
    "dp0_MPa", "knee_opening_V", "knee_closing_V", "knee_se_V", "bound_V", "offset_V", "trend", "highest_dp_MPa",
    "beta_at_highest_dp", "k_x_max_over_u_max", "dead_zone_opening_percent", "dead_zone_closing_percent",
    "lot_extra_dead_zone_percent",
)  # fmt: skip
#: A name is a folder's on every system and a cell's in every spreadsheet.
NAME = re.compile(r"[^\W_][\w .+-]{0,99}(?<![. ])")
DIGITS = re.compile(r"([0-9]+)")

Cell = str | float | None


def column_of(side: str, column: str) -> str:
    """Return the name of a side's column.

    Examples
    --------
    >>> column_of("", "offset_V"), column_of("negative", "offset_V")
    ('offset_V', 'negative_offset_V')
    """
    return f"{side}_{column}" if side else column


def sides_of(columns: Iterable[str]) -> tuple[str, ...]:
    """Return the sides that a table has: "positive" and "negative", or one without a name."""
    return tuple(SIDES) if column_of("positive", SIDE_COLUMNS[0]) in columns else ("",)


def columns_of(sides: Iterable[str]) -> tuple[str, ...]:
    """Return the columns that every table with these sides has."""
    return (*FIRST, *(column_of(side, column) for side in sides for column in SIDE_COLUMNS), *LAST)


def by_name(name: str) -> tuple[tuple[tuple[str, int, str], ...], str]:
    """Return what to sort a valve by: its name, the numbers in it as numbers.

    Examples
    --------
    >>> sorted(["V10", "V2", "V1b", "V1"], key=by_name)
    ['V1', 'V1b', 'V2', 'V10']
    """
    words, numbers = DIGITS.split(name)[::2], [digits.lstrip("0") for digits in DIGITS.findall(name)]
    # By length first: a number may have more digits than Python makes an int of.
    parts = ((word, len(digits), digits) for word, digits in zip(words, [*numbers, ""], strict=True))
    return tuple(parts), name


def frame_of(rows: Sequence[Mapping[str, Cell]]) -> "DataFrame":
    """Return rows as a table: columns of both sides if a row has them, and of all outputs and entries of a record."""
    import polars

    found = dict.fromkeys(column for row in rows for column in row)
    more = [name for start in (OUTPUT, RECORD) for name in found if name.startswith(start)]
    columns = (*columns_of(sides_of(found)), *more)
    return polars.DataFrame(
        [{column: row.get(column) for column in columns} for row in rows],
        schema={column: polars.String if _is_text(column) else polars.Float64 for column in columns},
    )


def _is_text(column: str) -> bool:
    return column in (*FIRST, *LAST) or column.endswith("trend") or column.startswith((OUTPUT, RECORD))


def table_files(frame: "DataFrame") -> dict[str, bytes]:
    """Return valves.csv and valves.parquet, the same rows; no cell of the former is a formula for a spreadsheet."""
    import polars

    parquet = io.BytesIO()
    frame.write_parquet(parquet)
    cells = frame.with_columns(polars.col(polars.String).str.replace(f"^({FORMULA})", "'${1}"))
    return {TABLE: cells.write_csv().encode(), TYPED_TABLE: parquet.getvalue()}


def read_table(path: Path) -> "DataFrame":
    """Read valves.parquet, whose content is as batch.json states it."""
    import polars

    try:
        frame = polars.read_parquet(path)
    except polars.exceptions.PolarsError as error:
        raise InputError(f"'{path}' is no table: {str(error).splitlines()[0]}; {AGAIN}") from error
    if lost := [name for name in columns_of(sides_of(frame.columns)) if name not in frame.columns]:
        raise InputError(f"'{path}' lacks the column '{lost[0]}'; {AGAIN}")
    return frame


def read_manifest(folder: Path) -> ValveManifest:
    """Return what a valve's folder says of itself."""
    path = folder / MANIFEST_NAME
    return read_artefact(read_bytes(path, "manifest of a valve"), ValveManifest, str(path), AGAIN)
