"""What lies in the folder of a lot, read back for its report: hashes decide what belongs to it.

A finished lot states the hashes of its table and of its lot setting in batch.json, and the table those of each valve's
artefacts. Of a file whose hash is another no report is made.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME, digest_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import parse_document, read_bytes, sha256_of
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.report.artefacts import change_in
from dzdesign.report.lot.summary import AGAIN, OK, SUMMARY_NAME, VALVES, LotSummary, UnfinishedLot, ValveManifest
from dzdesign.report.lot.table import (
    HASHED,
    NAME,
    OUTPUT,
    OUTPUT_HASH,
    TABLE,
    TYPED_TABLE,
    Cell,
    frame_of,
    read_manifest,
    read_table,
    sides_of,
)

if TYPE_CHECKING:
    from polars import DataFrame

#: Files or valves that a sentence names.
NAMED = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Lot:
    """What a report of a lot is of.

    `frame` is the table, empty where it is not there, and `text` that of valves.csv; `hashes` are the name and SHA-256
    of each file that was read.
    """

    summary: LotSummary
    frame: "DataFrame"
    text: str
    hashes: tuple[tuple[str, str], ...]
    missing: tuple[str, ...]

    @property
    def units(self) -> RecordedUnits:
        """In which its valves were recorded."""
        return self.summary.recorded_units

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
    """Read the files of a finished lot; one that is not as batch.json and the table state it is an `InputError`."""
    content = read_bytes(folder / SUMMARY_NAME, "summary of a lot")
    kinds: tuple[type[LotSummary | UnfinishedLot], ...] = (LotSummary, UnfinishedLot)
    summary = read_artefact(content, kinds, str(folder / SUMMARY_NAME), AGAIN)
    if isinstance(summary, UnfinishedLot):
        raise InputError(
            f"the batch in '{folder}' did not come to its end; give the same `dzdesign batch` again, which takes it up"
        )
    stated = {name: summary.files.get(name, "not stated") for name in (TABLE, TYPED_TABLE)}
    if summary.lot_setting:
        stated[summary.lot_setting.file] = summary.lot_setting.sha256
    if summary.firmware:
        stated[f"{summary.firmware.folder}/{MANIFEST_NAME}"] = summary.firmware.manifest_sha256
    hashes, missing = {SUMMARY_NAME: sha256_of(content)}, []
    for name, digest in stated.items():
        if not (folder / name).is_file():
            missing.append(f"{name}: `dzdesign batch` makes it, from the folders that are done")
        elif digest_of(folder / name) != digest:
            raise InputError(f"'{folder / name}' was changed since `dzdesign batch` wrote it; {AGAIN}")
        else:
            hashes[name] = digest
    frame = read_table(folder / TYPED_TABLE) if TYPED_TABLE in hashes else frame_of([])
    if len(frame) and (len(frame), int((frame["status"] == OK).sum())) != (summary.valves, summary.calibrated):
        raise InputError(f"'{folder / SUMMARY_NAME}' counts other valves than the table has; {AGAIN}")
    if (folder / VALVES).is_dir():
        _compare(folder / VALVES, summary, frame)
    else:
        missing.append("the folders of the valves: they are not beside this table, so their hashes were not compared")
    text = read_bytes(folder / TABLE, "table of the lot").decode() if TABLE in hashes else ""
    return Lot(summary=summary, frame=frame, text=text, hashes=tuple(hashes.items()), missing=tuple(missing))


def _compare(valves: Path, summary: LotSummary, frame: "DataFrame") -> None:
    """Refuse valves whose artefacts have other hashes than the table states."""
    other: list[str] = []
    for row in frame.iter_rows(named=True):
        if not NAME.fullmatch(row["name"]):
            other.append(row["name"])
            continue
        for file, stated in _stated(row, summary):
            path = valves / row["name"] / file
            if stated and not (path.is_file() and digest_of(path) == stated):
                other.append(f"{row['name']}/{file}")
            elif stated and path.name == MANIFEST_NAME and (change := change_in(path.parent)):
                other.append(f"{row['name']}/{path.parent.name}: {change}")
    if other:
        what = f"{len(other)} files of '{valves}' are not as the table has them"
        raise InputError(f"{what}: {and_more(other, NAMED)}; {AGAIN}")


def _stated(row: Mapping[str, Cell], summary: LotSummary) -> Iterator[tuple[str, Cell]]:
    """Yield each file of a valve whose hash the table may state, with that hash."""
    yield from ((file, row[column]) for column, file in HASHED.items())
    for target, output in summary.outputs.items():
        yield f"{output.folder}/{MANIFEST_NAME}", row.get(OUTPUT + target + OUTPUT_HASH)
