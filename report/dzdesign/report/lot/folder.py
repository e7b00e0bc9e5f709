"""What lies in the folder of a lot, read back for its report: hashes decide what belongs to it.

A finished lot states the hashes of its table and of its lot setting in batch.json, and the table those of each valve's
artefacts. A file whose hash is another is named, and not used. Of a lot whose batch was stopped there is no table yet;
then the valves' folders themselves are read.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, parse_document, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Tool, schema_of
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.input_files import MOST_DOCUMENT
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.lot.changed_outputs import change_in
from dzdesign.report.lot.summary import AGAIN, OK, SUMMARY_NAME, LotSummary, UnfinishedLot
from dzdesign.report.lot.table import HASHED, OUTPUT_HASH, TABLE, TableRow, read_table
from dzdesign.report.lot.table_rows import table_rows
from dzdesign.report.lot.valve_folder import VALVES, ValveManifest, read_manifest, read_valve_folder
from dzdesign.report.lot.valve_names import NAME

#: Largest table of which a report is made: beyond it, some 25 000 valves, no browser would show the page.
MOST_TABLE = MOST_DOCUMENT
#: Files or valves that a sentence names.
NAMED = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Lot:
    """What a report of a lot is of.

    `summary` is None of a lot whose batch did not come to its end, `table` the text of valves.csv, empty where it was
    not used, `expected` how many valves the lot has, `hashes` the name and SHA-256 of each file that was read. `faults`
    do not fit and were not used. `compared` says whether the valves' folders are there and were compared with the
    table, `warning_texts` has for each code of a warning its text in the first valve that has it.
    """

    tool: Tool
    summary: LotSummary | None
    rows: tuple[TableRow, ...]
    table: str = ""
    expected: int
    hashes: tuple[tuple[str, str], ...]
    faults: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    compared: bool = False
    warning_texts: Mapping[str, str] = field(default_factory=dict)

    @property
    def units(self) -> RecordedUnits:
        """In which its valves were recorded."""
        return self.summary.recorded_units if self.summary else AS_COMPUTED

    @property
    def sides(self) -> tuple[str, ...]:
        """Sides of the table: "positive" and "negative", or one without a name."""
        return tuple(self.rows[0].sides) if self.rows else ("",)

    @property
    def calibrated(self) -> tuple[TableRow, ...]:
        """The rows of the valves that are."""
        return tuple(row for row in self.rows if row.calibrated)

    @property
    def failed(self) -> tuple[TableRow, ...]:
        """The rows of the others."""
        return tuple(row for row in self.rows if not row.calibrated)


def is_lot(folder: Path) -> bool:
    """Tell whether a folder is of a lot."""
    return _is_of(folder / SUMMARY_NAME, schema_of(LotSummary), schema_of(UnfinishedLot))


def _is_of(path: Path, *schemas: str) -> bool:
    try:
        parse_document(path.read_bytes(), str(path), schemas)
    except (OSError, InputError):
        return False
    return True


def refuse_uncalibrated(folder: Path) -> None:
    """Refuse the folder of a valve of a lot that was not calibrated: there is nothing to report but its reason."""
    if not _is_of(folder / MANIFEST_NAME, schema_of(ValveManifest)) or (folder / "valve.json").exists():
        return
    manifest = read_manifest(folder)
    if manifest.status != OK:
        raise InputError(f"'{folder}' is of a valve that was not calibrated: {manifest.reason}")


def read_lot(folder: Path) -> Lot:
    """Read the folder of a lot, finished or stopped."""
    content = read_bytes(folder / SUMMARY_NAME, "summary of a lot")
    kinds: tuple[type[LotSummary | UnfinishedLot], ...] = (LotSummary, UnfinishedLot)
    found = read_artefact(content, kinds, str(folder / SUMMARY_NAME), AGAIN)
    own_hash = (SUMMARY_NAME, sha256_of(content))
    if isinstance(found, UnfinishedLot):
        return _unfinished(folder, found, own_hash)
    return _LotFiles(folder, found).lot(own_hash)


class _LotFiles:
    """The files of a finished lot, compared with the hashes that batch.json and the table state."""

    def __init__(self, folder: Path, summary: LotSummary) -> None:
        self.folder, self.summary = folder, summary
        self.faults: list[str] = []
        self.missing: list[str] = []
        self.hashes: list[tuple[str, str]] = []

    def lot(self, own_hash: tuple[str, str]) -> Lot:
        table = self._table()
        rows = [] if table is None else read_table(table, str(self.folder / TABLE))
        counted = {
            "valves": (self.summary.valves, len(rows)),
            "calibrated": (self.summary.calibrated, sum(row.calibrated for row in rows)),
        }
        self.faults += [
            f"{SUMMARY_NAME} was changed: it counts {stated} valves as '{key}', the table has {count}"
            for key, (stated, count) in counted.items()
            if table is not None and stated != count
        ]
        if setting := self.summary.lot_setting:
            self._fitting(setting.file, setting.sha256)
        if firmware := self.summary.firmware:
            self._fitting(f"{firmware.folder}/{MANIFEST_NAME}", firmware.manifest_sha256)
        texts = self._compared_valves(rows)
        return Lot(
            tool=self.summary.tool,
            summary=self.summary,
            rows=tuple(rows),
            table="" if table is None else table.decode("utf-8"),
            expected=self.summary.valves,
            hashes=(own_hash, *((name, digest) for name, digest in self.hashes if name != "valves.parquet")),
            compared=(self.folder / VALVES).is_dir(),
            warning_texts=texts,
            faults=tuple(self.faults),
            missing=tuple(self.missing),
        )

    def _table(self) -> bytes | None:
        """Return valves.csv if it is as it was written, and compare the other files of the table."""
        path = self.folder / TABLE
        if path.is_file() and path.stat().st_size > MOST_TABLE:
            raise InputError(
                f"the table of {self.summary.valves} valves, '{path}', is larger than {MOST_TABLE >> 20} MiB, too "
                "large for one page; read the table itself, or calibrate the lot in parts, each with a folder of its "
                "own"
            )
        if TABLE not in self.summary.files:
            raise InputError(f"'{self.folder / SUMMARY_NAME}' lacks the key 'files.{TABLE}'; {AGAIN}")
        found = {
            name: self._fitting(name, stated) for name, stated in self.summary.files.items() if NAME.fullmatch(name)
        }
        return found[TABLE]

    def _fitting(self, name: str, stated: str) -> bytes | None:
        """Return a file's content; where it is gone or its hash is another, say so and return None."""
        path = self.folder / name
        if not path.is_file():
            self.missing.append(f"{name}: `dzdesign batch` makes it, from the folders that are done")
            return None
        content = read_bytes(path, "file of the lot")
        digest = sha256_of(content)
        if digest != stated:
            self.faults.append(
                f"{name} was changed since `dzdesign batch` wrote it (SHA-256 {digest}, {SUMMARY_NAME} says {stated}): "
                "not used"
            )
            return None
        self.hashes.append((name, digest))
        return content

    def _compared_valves(self, rows: Sequence[TableRow]) -> dict[str, str]:
        """Compare each valve's artefacts with the table's hashes; return a text of each warning."""
        if not (self.folder / VALVES).is_dir():
            self.missing.append(
                "the folders of the valves: they are not beside this table, so their hashes were not compared"
            )
            return {}
        other: list[str] = []
        changed: list[str] = []
        texts: dict[str, str] = {}
        for row in rows:
            if not NAME.fullmatch(row.name):
                other.append(row.name)
                continue
            for file, stated in self._stated(row):
                path = self.folder / VALVES / row.name / file
                content = path.read_bytes() if stated and path.is_file() else b""
                if stated and sha256_of(content) != stated:
                    other.append(f"{row.name}/{file}")
                elif content and path.name == MANIFEST_NAME and (change := change_in(path.parent)):
                    changed.append(f"{row.name}/{path.parent.name}: {change}")
                elif content and file == "valve.json" and not texts.keys() >= set(row.warnings):
                    valve = read_artefact(content, ValveModel, str(path))
                    texts = {**{each.code: each.text for each in reversed(valve.warnings)}, **texts}
        if other:
            self.faults.append(
                f"files of valves are not those that the table was made from ({len(other)}): {and_more(other, NAMED)}"
            )
        if changed:
            self.faults.append(
                f"folders of valves are not as `dzdesign batch` wrote them ({len(changed)}): {and_more(changed, NAMED)}"
            )
        return texts

    def _stated(self, row: TableRow) -> Iterator[tuple[str, str | None]]:
        """Yield each file of a valve whose hash the table may state, with that hash."""
        yield from ((file, row.hashes.get(column)) for column, file in HASHED.items())
        for target, output in self.summary.outputs.items():
            yield f"{output.folder}/{MANIFEST_NAME}", row.outputs.get(target + OUTPUT_HASH)


def _unfinished(folder: Path, found: UnfinishedLot, own_hash: tuple[str, str]) -> Lot:
    """Read what a batch that was stopped, or still runs, has come to."""
    names = [name for name in found.names if NAME.fullmatch(name)]
    there = [name for name in names if (folder / VALVES / name / MANIFEST_NAME).is_file()]
    valves, faults = [], []
    for name in there:
        try:
            valves.append(read_valve_folder(folder / VALVES / name))
        except InputError as error:
            faults.append(str(error))
    return Lot(
        tool=found.tool,
        summary=None,
        rows=tuple(table_rows(valves)),
        expected=len(names),
        hashes=(own_hash,),
        warning_texts={
            warning.code: warning.text
            for each in reversed(valves)
            for warning in (reversed(each.compensator.valve.warnings) if each.compensator else ())
        },
        faults=tuple(faults),
        missing=(
            f"{len(names) - len(there)} of {len(names)} valves, the table and the lot setting: the batch did not "
            "come to its end; the same `dzdesign batch` takes it up",
        ),
    )
