"""The table of a batch: one row a valve, made from the valves' folders alone, whenever they were written; read back."""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from dzdesign.batch.calibration import FAILED, OK
from dzdesign.batch.results import AGAIN, Results
from dzdesign.batch.valves import RECORD, by_name
from dzdesign.core.artefact_files import read_bytes, sha256_of
from dzdesign.core.errors import InputError, quoted
from dzdesign.identify.valve.test_record import checked_record

if TYPE_CHECKING:
    from dzdesign.design.lot_setting import LotSetting, Designed
    from dzdesign.identify.valve.side_model import SideModel

#: Columns of either side, after its name; a valve that was not calibrated has blanks.
SIDE_COLUMNS = (
    *("dp0_MPa", "knee_opening_V", "knee_closing_V", "knee_se_V", "bound_V", "offset_V", "trend", "highest_dp_MPa"),
    *("beta_at_highest_dp", "k_x_max_over_u_max", "dead_zone_opening_percent", "dead_zone_closing_percent"),
    "common_extra_dead_zone_percent",
)
HASHED = {
    "valve_json_sha256": "valve.json",
    "compensator_json_sha256": "compensator.json",
    "firmware_manifest_sha256": "firmware/manifest.json",
}
TABLE = "valves.csv"
#: No number of the table is larger: volts, MPa, per cent, shares.
LARGEST = 1e6
#: A spreadsheet takes a cell that begins so for a formula, but for the '; one more ' before it makes it text.
FORMULA = re.compile(r"'*[=+\-@]")
SAFE = re.compile(f"'{FORMULA.pattern}")
TEXTS = ("name", "status", "reason", "warnings", "inputs_sha256", *HASHED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrated:
    """A valve's folder, read back: its manifest and, where it was calibrated, valve and compensator."""

    manifest: Mapping[str, Any]
    designed: "Designed | None"
    hashes: Mapping[str, str | None]


def read_back(results: Results, name: str, unwritten: Mapping[str, str]) -> Calibrated:
    """Read a valve's folder; one that could not be written has failed, whatever an earlier run left there.

    Parameters
    ----------
    results : Results
        Folder of the batch.
    name : str
        Of the valve.
    unwritten : mapping
        Name to the reason why its folder could not be written.
    """
    from dzdesign.design.compensator_file import compensator_from_document
    from dzdesign.design.lot_setting import Designed

    if name in unwritten:
        return Calibrated(manifest={"status": FAILED, "reason": unwritten[name]}, designed=None, hashes={})
    manifest = results.manifest(name)
    hashes = {column: manifest["files"].get(file) for column, file in HASHED.items()}
    if manifest["status"] != OK:
        return Calibrated(manifest=manifest, designed=None, hashes=hashes)
    path = results.of(name) / "compensator.json"
    content = read_bytes(path, "compensator of the batch")
    if sha256_of(content) != manifest["files"].get(path.name):
        raise InputError(f"'{path}' was changed; take the valve's folder away and run the batch again")
    designed = Designed.of(compensator_from_document(content, str(path)))
    return Calibrated(manifest=manifest, designed=designed, hashes=hashes)


def rows_of(
    found: Mapping[str, Calibrated],
    common: "LotSetting | None",
    records: Mapping[str, Mapping[str, str]] | None = None,
) -> list[dict[str, Any]]:
    """Return the rows, in the order of the names; see `SIDE_COLUMNS`.

    Parameters
    ----------
    found : mapping
        Name to what was read back.
    common : LotSetting or None
        For the cost of it at each valve.
    records : mapping, optional
        Name to the record that the valve was given, for those without a valve.json that has it.
    """
    both = any(each.designed and each.designed.own.negative for each in found.values())
    signs = {"": 1} if not both else {"positive_": 1, "negative_": -1}
    rows = []
    for name in sorted(found, key=by_name):
        each = found[name]
        row: dict[str, Any] = {"name": name, "status": each.manifest["status"], "reason": each.manifest["reason"]}
        for prefix, sign in signs.items():
            designed = each.designed
            has_side = designed is not None and (sign > 0 or designed.own.negative is not None)
            values = _side_values(designed, sign, common) if designed and has_side else {}
            row.update({prefix + column: values.get(column) for column in SIDE_COLUMNS})
        codes = [warning.code for warning in each.designed.valve.warnings] if each.designed else []
        row["warnings"] = " ".join(dict.fromkeys(codes))
        row["inputs_sha256"] = each.manifest.get("inputs_sha256") or None
        row.update({column: each.hashes.get(column) for column in HASHED})
        rows.append(row)
    _add_records(rows, [_record(found[row["name"]], (records or {}).get(row["name"], {})) for row in rows])
    return rows


def _record(valve: Calibrated, given: Mapping[str, str]) -> Mapping[str, str]:
    """Return a valve's record: of its valve.json, or as it was given if that can be a record."""
    if valve.designed:
        return valve.designed.valve.record
    try:
        return checked_record(given.items(), "the record")
    except InputError:  # such a valve has failed, and says why itself
        return {}


def _add_records(rows: Sequence[dict[str, Any]], records: Sequence[Mapping[str, str]]) -> None:
    """Add a column for each entry that some valve's record has, in the order in which they come."""
    names = dict.fromkeys(name for record in records for name in record)
    for row, record in zip(rows, records, strict=True):
        row.update({RECORD + name: record.get(name) for name in names})


def _side_values(designed: "Designed", sign: int, common: "LotSetting | None") -> dict[str, Any]:
    """Return what the table says of one side; numbers as valve.json has them."""
    own, side = designed.own, designed.valve.sides["positive" if sign > 0 else "negative"]
    test = _reference_test(side)
    left = _remaining(designed, sign, own)
    certificate = own.side(sign).certificate
    code = round(own.signals.dp_code(Fraction(repr(side.reference.dp_MPa))))
    return {
        "dp0_MPa": side.reference.dp_MPa,
        "knee_opening_V": test.u_knee_rising_V,
        "knee_closing_V": test.u_knee_falling_V,
        "knee_se_V": test.u_knee_se_V,
        "bound_V": side.guards[certificate.guard].u_lower_V[side.tests.index(test)],
        "offset_V": round(float(own.beta(code, sign) * own.side(sign).u_min0_over_u_max * own.u_max_V), 7),
        "trend": side.trend,
        "highest_dp_MPa": side.beta.dp_MPa[-1],
        "beta_at_highest_dp": side.guards[certificate.guard].beta[-1],
        "k_x_max_over_u_max": side.k_x_max_over_u_max,
        "dead_zone_opening_percent": left.get("opening"),
        "dead_zone_closing_percent": left.get("closing"),
        "common_extra_dead_zone_percent": extra_dead_zone(designed, common, sign) if common else None,
    }


def _reference_test(side: "SideModel") -> Any:
    return min(side.tests, key=lambda test: abs(test.dp_MPa - side.reference.dp_MPa))


def _remaining(designed: "Designed", sign: int, law: Any) -> dict[str, float]:
    """Return the worst dead zone over a valve's tests that a law leaves on each branch, in per cent of command."""
    from dzdesign.design.costs import remaining_dead_zone

    side = designed.valve.sides["positive" if sign > 0 else "negative"]
    each = [remaining_dead_zone(law, test, sign) for test in side.tests]
    return {name: round(100 * max(one[name] for one in each), 5) for name in each[0]}


def extra_dead_zone(designed: "Designed", common: "LotSetting", sign: int) -> float:
    """Return how much more dead zone the common setting leaves than a valve's own, in per cent of command.

    At the pressure drop of its tests where that is most, on opening; on closing where no opening was recorded.

    Parameters
    ----------
    designed : Designed
        The valve and its own compensator.
    common : LotSetting
        The setting of all.
    sign : {1, -1}
        Of the command.
    """
    from dzdesign.design.costs import remaining_dead_zone

    side = designed.valve.sides["positive" if sign > 0 else "negative"]
    branch = "opening" if side.tests[0].u_knee_rising_V is not None else "closing"
    laws = common.compensator, designed.own
    left = ([remaining_dead_zone(law, test, sign)[branch] for law in laws] for test in side.tests)
    return round(100 * max(shared - own for shared, own in left), 5)


def is_text(column: str) -> bool:
    """Tell a column of words from one of numbers.

    Parameters
    ----------
    column : str
        Its name.
    """
    return column in TEXTS or column.endswith("trend") or column.startswith(RECORD)


def safe_cell(text: str) -> str:
    """Return a text as a cell of a CSV file that no spreadsheet takes for a formula; `rows_from` takes it back.

    Parameters
    ----------
    text : str
        Somebody's.

    Examples
    --------
    >>> safe_cell("=1+1"), safe_cell("'=1"), safe_cell("4711")
    ("'=1+1", "''=1", '4711')
    """
    return f"'{text}" if FORMULA.match(text) else text


def table_files(rows: Sequence[Mapping[str, Any]]) -> dict[str, bytes]:
    """Return valves.csv and valves.parquet, the same rows in both, but for `safe_cell` in the former.

    Parameters
    ----------
    rows : sequence of mapping
        From `rows_of`.
    """
    import polars

    schema = {column: polars.String if is_text(column) else polars.Float64 for column in rows[0]}
    frame = polars.DataFrame([dict(row) for row in rows], schema=schema)
    parquet = io.BytesIO()
    frame.write_parquet(parquet)
    safe = frame.with_columns(polars.col(polars.String).str.replace(f"^({FORMULA.pattern})", "'${1}"))
    return {TABLE: safe.write_csv().encode(), "valves.parquet": parquet.getvalue()}


def rows_from(content: bytes, source: str) -> list[dict[str, Any]]:
    """Read the rows back from valves.csv; a number is finite and of a size that a valve can have.

    Parameters
    ----------
    content : bytes
        Of the file.
    source : str
        Its name, for the message.

    Raises
    ------
    InputError
        If it is no such table.
    """
    try:
        reader = csv.reader(io.StringIO(content.decode("utf-8"), newline=""), strict=True)
        heading, *lines = [*reader] or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"'{source}' is no table in UTF-8: {error}; {AGAIN}") from error
    sides = ("positive_", "negative_") if f"positive_{SIDE_COLUMNS[0]}" in heading else ("",)
    wanted = [*TEXTS, *(side + column for side in sides for column in SIDE_COLUMNS)]
    lost = [column for column in wanted if column not in heading]
    if lost or not lines:
        what = f"lacks the column '{lost[0]}'" if lost else "has no valve"
        raise InputError(f"'{source}' {what}; {AGAIN}")
    return [_row(heading, line, f"'{source}' row {number}") for number, line in enumerate(lines, start=2)]


def _row(heading: Sequence[str], line: Sequence[str], where: str) -> dict[str, Any]:
    if len(line) != len(heading):
        raise InputError(f"{where} has {len(line)} cells, expected {len(heading)}; {AGAIN}")
    row: dict[str, Any] = {}
    for column, cell in zip(heading, line, strict=True):
        if is_text(column):
            row[column] = cell[1:] if SAFE.match(cell) else cell
            continue
        try:
            row[column] = float(cell) if cell else None
        except ValueError:
            row[column] = math.nan
        if row[column] is not None and not abs(row[column]) <= LARGEST:
            raise InputError(f"{where}, column '{column}' is {quoted(cell)}, expected a number; {AGAIN}")
    return row
