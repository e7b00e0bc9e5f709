"""What lies in the folder of a lot, read back for its report: hashes decide what belongs to it.

A finished lot states the hashes of its table and of its lot setting in batch.json, and the table those of each valve's
artefacts. A file whose hash is another is named, and not used. Of a lot whose batch was stopped there is no table yet;
then the valves' folders themselves are read.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME, parse_document, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Tool, schema_of
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.folder_contents import digest_of
from dzdesign.core.input_files import MOST_DOCUMENT
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.lot.summary import AGAIN, OK, SUMMARY_NAME, VALVES, LotSummary, UnfinishedLot, ValveManifest
from dzdesign.report.lot.table import (
    HASHED,
    NAME,
    OUTPUT,
    OUTPUT_HASH,
    TABLE,
    Cell,
    frame_of,
    read_manifest,
    read_table,
    read_valve_folder,
    sides_of,
    table_of_valves,
)
from dzdesign.report.outputs import change_in

if TYPE_CHECKING:
    from polars import DataFrame

#: Largest table of which a report is made: beyond it, some 25 000 valves, no browser would show the page.
MOST_TABLE = MOST_DOCUMENT
#: Files or valves that a sentence names.
NAMED = 10
Row = Mapping[str, Cell]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lot:
    """What a report of a lot is of.

    `summary` is None of a lot whose batch did not come to its end, `text` that of valves.csv, empty where it was not
    used, `expected` how many valves the lot has, `hashes` the name and SHA-256 of each file that was read. `faults` do
    not fit and were not used. `compared` says whether the valves' folders are there and were compared with the table,
    `warning_texts` has for each code of a warning its text in the first valve that has it.
    """

    tool: Tool
    summary: LotSummary | None
    frame: "DataFrame"
    text: str = ""
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
        return sides_of(self.frame.columns)

    @property
    def calibrated(self) -> "DataFrame":
        """The rows of the valves that are."""
        return self.frame.filter(self.frame["status"] == OK)

    @property
    def failed(self) -> "DataFrame":
        """The rows of the others."""
        return self.frame.filter(self.frame["status"] != OK)


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
    return _finished(folder, found, own_hash)


def _finished(folder: Path, summary: LotSummary, own_hash: tuple[str, str]) -> Lot:
    """Read the files of a finished lot, compared with the hashes that batch.json and the table state."""
    path, hashes = folder / TABLE, [own_hash]
    faults: list[str] = []
    missing: list[str] = []
    if path.is_file() and path.stat().st_size > MOST_TABLE:
        raise InputError(
            f"the table of {summary.valves} valves, '{path}', is larger than {MOST_TABLE >> 20} MiB, too large for one "
            "page; read the table itself, or calibrate the lot in parts, each with a folder of its own"
        )
    if TABLE not in summary.files:
        raise InputError(f"'{folder / SUMMARY_NAME}' lacks the key 'files.{TABLE}'; {AGAIN}")
    stated = {name: digest for name, digest in summary.files.items() if NAME.fullmatch(name)}
    if summary.lot_setting:
        stated[summary.lot_setting.file] = summary.lot_setting.sha256
    if summary.firmware:
        stated[f"{summary.firmware.folder}/{MANIFEST_NAME}"] = summary.firmware.manifest_sha256
    content, frame = b"", frame_of([])
    for name, digest in stated.items():
        if not (folder / name).is_file():
            missing.append(f"{name}: `dzdesign batch` makes it, from the folders that are done")
        elif (found := digest_of(folder / name)) != digest:
            faults.append(f"{name} was changed since `dzdesign batch` wrote it (SHA-256 {found}, {SUMMARY_NAME} says "
                          f"{digest}): not used")  # fmt: skip
        else:
            hashes += [(name, digest)] if name != "valves.parquet" else []
            content = read_bytes(path, "file of the lot") if name == TABLE else content
    if content:
        frame = read_table(content, str(path))
        counts = {"valves": (summary.valves, len(frame)),
                  "calibrated": (summary.calibrated, int((frame["status"] == OK).sum()))}  # fmt: skip
        faults[:0] = [
            f"{SUMMARY_NAME} was changed: it counts {says} valves as '{key}', the table has {count}"
            for key, (says, count) in counts.items() if says != count
        ]  # fmt: skip
    texts: dict[str, str] = {}
    if (folder / VALVES).is_dir():
        texts = _compared(folder / VALVES, summary, frame, faults)
    else:
        missing.append("the folders of the valves: they are not beside this table, so their hashes were not compared")
    return Lot(
        tool=summary.tool, summary=summary, frame=frame, text=content.decode("utf-8"), expected=summary.valves,
        hashes=tuple(hashes), compared=(folder / VALVES).is_dir(), warning_texts=texts, faults=tuple(faults),
        missing=tuple(missing),
    )  # fmt: skip


def _compared(valves: Path, summary: LotSummary, frame: "DataFrame", faults: list[str]) -> dict[str, str]:
    """Compare each valve's artefacts with the table's hashes, and add to the faults; return a text of each warning."""
    other: list[str] = []
    changed: list[str] = []
    texts: dict[str, str] = {}
    for row in frame.iter_rows(named=True):
        if not NAME.fullmatch(row["name"]):
            other.append(row["name"])
            continue
        for file, stated in _stated(row, summary):
            path = valves / row["name"] / file
            if stated and not (path.is_file() and digest_of(path) == stated):
                other.append(f"{row['name']}/{file}")
            elif stated and path.name == MANIFEST_NAME and (change := change_in(path.parent)):
                changed.append(f"{row['name']}/{path.parent.name}: {change}")
            elif stated and file == ValveModel.FILE_NAME and not texts.keys() >= set(row["warnings"].split()):
                valve = read_artefact(read_bytes(path, "valve"), ValveModel, str(path))
                texts = {**{each.code: each.text for each in reversed(valve.warnings)}, **texts}
    for what, names in (("files of valves are not those that the table was made from", other),
                        ("folders of valves are not as `dzdesign batch` wrote them", changed)):  # fmt: skip
        if names:
            faults.append(f"{what} ({len(names)}): {and_more(names, NAMED)}")
    return texts


def _stated(row: Row, summary: LotSummary) -> Iterator[tuple[str, Cell]]:
    """Yield each file of a valve whose hash the table may state, with that hash."""
    yield from ((file, row[column]) for column, file in HASHED.items())
    for target, output in summary.outputs.items():
        yield f"{output.folder}/{MANIFEST_NAME}", row.get(OUTPUT + target + OUTPUT_HASH)


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
    warnings = [warning for each in valves if each.compensator for warning in each.compensator.valve.warnings]
    left = f"{len(names) - len(there)} of {len(names)} valves, the table and the lot setting"
    return Lot(
        tool=found.tool, summary=None, frame=table_of_valves(valves), expected=len(names), hashes=(own_hash,),
        warning_texts={warning.code: warning.text for warning in reversed(warnings)}, faults=tuple(faults),
        missing=(f"{left}: the batch did not come to its end; the same `dzdesign batch` takes it up",),
    )  # fmt: skip
