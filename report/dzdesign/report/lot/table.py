"""valves.csv: the table of a lot as a data frame, one row a valve, written, read back, and made from their folders."""

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from dzdesign.core.artefact_files import MANIFEST_NAME, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError, quoted
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import SIDES
from dzdesign.identify.valve.test_record import checked_record
from dzdesign.report.artefacts import standing_warnings
from dzdesign.report.lot.summary import AGAIN, LARGEST, OK, Status, ValveManifest

if TYPE_CHECKING:
    from polars import DataFrame

TABLE = "valves.csv"
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
    sides = [column_of(side, column) for side in sides_of(found) for column in SIDE_COLUMNS]
    more = [name for start in (OUTPUT, RECORD) for name in found if name.startswith(start)]
    columns = (*FIRST, *sides, *LAST, *more)
    return polars.DataFrame(
        [{column: row.get(column) for column in columns} for row in rows],
        schema={column: polars.String if _is_text(column) else polars.Float64 for column in columns},
    )


def _is_text(column: str) -> bool:
    return column in (*FIRST, *LAST) or column.endswith("trend") or column.startswith((OUTPUT, RECORD))


def safe(text: str) -> str:
    """Return a text as a cell that no spreadsheet takes for a formula; `read_table` takes it back.

    Examples
    --------
    >>> safe("=1+1"), safe("'=1"), safe("4711")
    ("'=1+1", "''=1", '4711')
    """
    return f"'{text}" if re.match(FORMULA, text) else text


def table_files(frame: "DataFrame") -> dict[str, bytes]:
    """Return valves.csv and valves.parquet, the same rows in both, but for `safe` cells in the former."""
    import polars

    parquet = io.BytesIO()
    frame.write_parquet(parquet)
    cells = frame.with_columns(polars.col(polars.String).str.replace(f"^({FORMULA})", "'${1}"))
    return {TABLE: cells.write_csv().encode(), "valves.parquet": parquet.getvalue()}


def read_table(content: bytes, source: str) -> "DataFrame":
    """Read valves.csv; a number is finite and of a size that a valve can have."""
    import polars

    try:
        heading = next(csv.reader(io.StringIO(content.decode("utf-8"), newline="")), [])
        # Polars leaves quotes in a heading doubled.
        frame = polars.read_csv(content, infer_schema=False, new_columns=heading)
    except (UnicodeDecodeError, csv.Error, polars.exceptions.PolarsError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"'{source}' is no table: {reason}; {AGAIN}") from error
    wanted = (*FIRST, *(column_of(side, column) for side in sides_of(frame.columns) for column in SIDE_COLUMNS), *LAST)
    if lost := [column for column in wanted if column not in frame.columns]:
        raise InputError(f"'{source}' lacks the column '{lost[0]}'; {AGAIN}")
    if frame.is_empty():
        raise InputError(f"'{source}' has no valve; {AGAIN}")
    numbers = polars.col(*(column for column in frame.columns if not _is_text(column)))
    read = frame.with_columns(
        numbers.cast(polars.Float64, strict=False),
        polars.col("name", "status", "reason", "warnings").fill_null(""),
    ).with_columns(polars.col(polars.String).str.replace(f"^'({FORMULA})", "${1}"))
    for column in read.columns:
        if column == "status":
            good, what = read[column].is_in(get_args(Status)), "a status"
        elif not _is_text(column):
            good, what = frame[column].is_null() | (read[column].abs() <= LARGEST).fill_null(False), "a number"
        else:
            continue
        if not good.all():
            row = int(good.arg_min() or 0)
            cell = quoted(frame[column][row] or "")
            raise InputError(f"'{source}' row {row + 2}, column '{column}' is {cell}, expected {what}; {AGAIN}")
    return read


# --- from the folders of the valves -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveFolder:
    """A valve of a lot, as its folder has it: its manifest and, where it was calibrated, valve and compensator."""

    manifest: ValveManifest
    compensator: Compensator | None = None

    @property
    def name(self) -> str:
        """Its name."""
        return self.manifest.name


def read_manifest(folder: Path) -> ValveManifest:
    """Return what a valve's folder says of itself."""
    path = folder / MANIFEST_NAME
    return read_artefact(read_bytes(path, "manifest of a valve"), ValveManifest, str(path), AGAIN)


def read_valve_folder(folder: Path) -> ValveFolder:
    """Read a valve's folder."""
    manifest = read_manifest(folder)
    if manifest.status != OK:
        return ValveFolder(manifest=manifest)
    path = folder / "compensator.json"
    content = read_bytes(path, "compensator of the lot")
    if sha256_of(content) != manifest.files.get(path.name):
        raise InputError(f"'{path}' was changed; take the valve's folder away and {AGAIN}")
    return ValveFolder(manifest=manifest, compensator=read_artefact(content, Compensator, str(path)))


def table_of_valves(
    valves: Sequence[ValveFolder],
    lot_law: Compensator | None = None,
    records: Mapping[str, Mapping[str, str]] | None = None,
) -> "DataFrame":
    """Return the table of valves as read back, in the order of the names.

    `lot_law` is the lot setting, for the cost of it at each valve; `records` what each valve was given as its record,
    for those without a valve.json that has it.
    """
    both = any(each.compensator and each.compensator.negative for each in valves)
    rows: list[dict[str, Cell]] = []
    for each in sorted(valves, key=lambda valve: by_name(valve.name)):
        manifest, own = each.manifest, each.compensator
        standing = standing_warnings(own.valve, own) if own else ()
        row: dict[str, Cell] = {"name": each.name, "status": manifest.status, "reason": manifest.reason}
        for side in SIDES if both else ("",):
            row |= {column_of(side, column): None for column in SIDE_COLUMNS}
            if own and not (side == "negative" and own.negative is None):
                figures = _figures(own, SIDES.get(side, 1), lot_law)
                row |= {column_of(side, column): value for column, value in figures.items()}
        row["warnings"] = " ".join(dict.fromkeys(warning.code for warning in standing))
        row["inputs_sha256"] = manifest.inputs_sha256
        row |= {column: manifest.files.get(file) for column, file in HASHED.items()}
        for output in manifest.outputs:
            row[OUTPUT + output.target] = output.verdict
            row[OUTPUT + output.target + OUTPUT_HASH] = manifest.files.get(f"{output.folder}/{MANIFEST_NAME}")
        record = _record(each, (records or {}).get(each.name, {}))
        rows.append({**row, **{RECORD + name: text for name, text in record.items()}})
    return frame_of(rows)


def _record(valve: ValveFolder, given: Mapping[str, str]) -> Mapping[str, str]:
    """Return a valve's record: of its valve.json, or as it was given if that can be a record."""
    if valve.compensator:
        return valve.compensator.valve.record
    try:
        return checked_record(given.items(), "the record")
    except InputError:  # such a valve has failed, and says why itself
        return {}


def _figures(own: Compensator, sign: int, lot_law: Compensator | None) -> dict[str, Cell]:
    """Return the columns of one side; numbers as valve.json has them."""
    side = own.valve.sides["positive" if sign > 0 else "negative"]
    test = min(side.tests, key=lambda test: abs((test.dp_MPa or 0.0) - (side.reference.dp_MPa or 0.0)))
    left = {branch: round(100 * max(values), 5) for branch, values in _remaining(own, own, sign).items()}
    curve = side.certified[own.side(sign).certificate.guard]
    code = round(own.signals.dp_code(Fraction(repr(side.reference.dp_MPa))))
    values = (
        side.reference.dp_MPa, test.u_knee_rising_V, test.u_knee_falling_V, test.u_knee_se_V,
        curve.u_lower_V[side.tests.index(test)],
        round(float(own.beta(code, sign) * own.side(sign).u_min0_over_u_max * own.u_max_V), 7), side.trend,
        side.beta.dp_MPa[-1], side.beta.beta[-1], side.k_x_max_over_u_max, left.get("opening"), left.get("closing"),
        extra_dead_zone(own, lot_law, sign) if lot_law else None,
    )  # fmt: skip
    return dict(zip(SIDE_COLUMNS, values, strict=True))


def _remaining(own: Compensator, law: Compensator, sign: int) -> dict[str, list[float]]:
    """Return the dead zone that a law leaves at each of a valve's tests, by branch, as shares of command."""
    from dzdesign.design.costs_at_tests import remaining_dead_zone

    tests = own.valve.sides["positive" if sign > 0 else "negative"].tests
    left = [remaining_dead_zone(law, test, sign) for test in tests]
    return {branch: [each[branch] for each in left] for branch in left[0]}


def extra_dead_zone(own: Compensator, lot_law: Compensator, sign: int) -> float:
    """Return how much more dead zone the lot setting leaves than a valve's own, in percent of command.

    At the pressure drop of its tests where that is most, on opening; on closing where no opening was recorded.
    """
    with_lot, with_own = (_remaining(own, law, sign) for law in (lot_law, own))
    branch = "opening" if "opening" in with_own else "closing"
    pairs = zip(with_lot[branch], with_own[branch], strict=True)
    return round(100 * max(lot - alone for lot, alone in pairs), 5)
