"""What lies in the folder of a batch, read back for its report: hashes decide what belongs to it.

A finished batch states the hashes of its table and of its common setting in batch.json, and the table those of each
valve's artefacts. A file whose hash is another is said, and not used. Of a batch that was stopped there is no table
yet; then the valves' folders themselves are read.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import NoneType
from typing import Any

from dzdesign.batch.calibration import OK
from dzdesign.batch.results import AGAIN, SCHEMA, SUMMARY, VALVE_SCHEMA, Results
from dzdesign.batch.table import HASHED, TABLE, Calibrated, read_back, rows_from, rows_of
from dzdesign.batch.valves import NAME, by_name
from dzdesign.core.artefact_files import MANIFEST_NAME, parse_document, read_bytes, sha256_of
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.input_files import MOST_DOCUMENT
from dzdesign.core.shape import Exactly, check_shape
from dzdesign.terminal.progress import with_bar

#: What the report reads of a finished batch.json.
FINISHED = {
    "tool": {"name": str, "version": str},
    "verified": bool,
    "valves": int,
    "calibrated": int,
    "files": {TABLE: str},
    "common_setting": dict,
}
COMMON = {
    "file": str,
    "sha256": str,
    "dp_MPa": Exactly(2, float),
    "carrier": str,
    "binding": [str],
    "smallest_margin_V": dict,
    "without_binding": (dict, NoneType),
}
#: Of the common setting, as later versions write it.
COMMON_LATER = {
    "lacking": [{"name": str, "side": str, "dp_MPa": [float], "narrows": bool}],
    "dp_without_MPa": (Exactly(2, float), NoneType),
    "checked": {"valves": int, "worst": str, "dp_MPa": float, "smallest_margin_V": float},
}
#: Of a valve that lacks a pressure drop, as still later ones do.
LACKING_LATER = {"coarser_V": float, "cost_percent": float}
AT = {"0.5": float, "0.95": float, "1": float}
#: Largest table of which a report is made: beyond it, some 25 000 valves, no browser would show the page.
MOST_TABLE = MOST_DOCUMENT
#: Files or valves that a sentence names.
NAMED = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Lot:
    """What a report of a lot is of.

    Attributes
    ----------
    document : mapping
        batch.json.
    rows : tuple of mapping
        The table, a row a valve; numbers are float or None.
    table : str
        valves.csv; empty where it was not used.
    expected : int
        How many valves the batch has.
    hashes : tuple of (str, str)
        Name and SHA-256 of the files that were read.
    faults, missing : tuple of str
        What does not fit and was not used; what is not there.
    compared : bool
        Whether the valves' folders are there and were compared with the table.
    warning_texts : mapping
        Code of a warning to its text in the first valve that has it.
    """

    document: Mapping[str, Any]
    rows: tuple[Mapping[str, Any], ...]
    table: str
    expected: int
    hashes: tuple[tuple[str, str], ...]
    faults: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    compared: bool = False
    warning_texts: Mapping[str, str] = field(default_factory=dict)

    @property
    def oddities(self) -> tuple[str, ...]:
        """What is odd in the lot though each of its valves is in order; of an older batch.json none."""
        return tuple(self.document.get("oddities", ()))

    @property
    def complete(self) -> bool:
        """Whether the batch came to its end."""
        return self.document["complete"] is True

    @property
    def sides(self) -> tuple[str, ...]:
        """What stands before the name of a column of either side."""
        both = any("positive_offset_V" in row for row in self.rows[:1])
        return ("positive_", "negative_") if both else ("",)

    @property
    def calibrated(self) -> tuple[Mapping[str, Any], ...]:
        """The rows of the valves that are."""
        return tuple(row for row in self.rows if row["status"] == OK)

    @property
    def failed(self) -> tuple[Mapping[str, Any], ...]:
        """The rows of the others."""
        return tuple(row for row in self.rows if row["status"] != OK)

    def common(self) -> Mapping[str, Any] | None:
        """Return what batch.json says of the common setting, or None if there is none."""
        setting = self.document.get("common_setting", {})
        return setting if "sha256" in setting else None


def is_lot(folder: Path) -> bool:
    """Tell whether a folder is of a batch.

    Parameters
    ----------
    folder : Path
    """
    return _has(folder / SUMMARY, SCHEMA)


def refuse_uncalibrated(folder: Path) -> None:
    """Refuse the folder of a valve of a batch that was not calibrated: there is nothing to report but its reason.

    Parameters
    ----------
    folder : Path
        Of artefacts.

    Raises
    ------
    InputError
        With that reason.
    """
    path = folder / MANIFEST_NAME
    if not _has(path, VALVE_SCHEMA) or (folder / "valve.json").exists():
        return
    manifest = parse_document(read_bytes(path, "manifest"), str(path), (VALVE_SCHEMA,))
    if manifest.get("status") != OK:
        raise InputError(f"'{folder}' is of a valve that was not calibrated: {manifest.get('reason')}")


def _has(path: Path, schema: str) -> bool:
    try:
        parse_document(path.read_bytes(), str(path), (schema,))
    except (OSError, InputError):
        return False
    return True


def lot_of(folder: Path) -> Lot:
    """Read the folder of a batch.

    Parameters
    ----------
    folder : Path
        Finished or stopped.

    Raises
    ------
    InputError
        If batch.json or the table is not what `dzdesign batch` writes.
    """
    content = read_bytes(folder / SUMMARY, "summary of a batch")
    document = parse_document(content, str(folder / SUMMARY), (SCHEMA,))
    hashes = [(SUMMARY, sha256_of(content))]
    if document.get("complete") is not True:
        return _stopped(folder, document, hashes)
    check_shape(document, FINISHED, str(folder / SUMMARY), AGAIN)
    if "oddities" in document:  # they came later
        check_shape(document, {"oddities": [str]}, str(folder / SUMMARY), AGAIN)
    if "why_not" not in document["common_setting"]:
        _check_common(document["common_setting"], f"{folder / SUMMARY}: common_setting")
    faults: list[str] = []
    missing: list[str] = []
    found = _table(folder, document, faults, missing)
    rows = [] if found is None else rows_from(found, str(folder / TABLE))
    rows.sort(key=lambda row: by_name(row["name"]))  # an older version had V10 before V2
    hashes += [] if found is None else [(TABLE, sha256_of(found))]
    counted = {"valves": len(rows), "calibrated": sum(row["status"] == OK for row in rows)}
    faults += [
        f"{SUMMARY} was changed: it counts {document[key]} valves as '{key}', the table has {count}"
        for key, count in counted.items()
        if found is not None and document[key] != count
    ]
    hashes += _common(folder, document["common_setting"], faults, missing)
    return Lot(
        document=document,
        rows=tuple(rows),
        table=found.decode("utf-8") if found else "",
        expected=document["valves"],
        hashes=tuple(hashes),
        compared=(folder / "valves").is_dir(),
        warning_texts=_look_at_valves(folder, rows, faults, missing),
        faults=tuple(faults),
        missing=tuple(missing),
    )


def _check_common(setting: Mapping[str, Any], source: str) -> None:
    check_shape(setting, COMMON, source, AGAIN)
    check_shape(setting, {key: shape for key, shape in COMMON_LATER.items() if key in setting}, source, AGAIN)
    for each in setting.get("lacking", ()):
        if LACKING_LATER.keys() & each.keys():
            check_shape(each, LACKING_LATER, f"{source}.lacking", AGAIN)
    without = setting["without_binding"]
    if without is not None:
        shape = {"why_not": str} if "why_not" in without else {"left_out": [str], "quantiles": dict}
        check_shape(without, shape, f"{source}.without_binding", AGAIN)
        for at in without.get("quantiles", {}).values():
            check_shape({"quantiles": at}, {"quantiles": AT}, f"{source}.without_binding", AGAIN)


def _fits(path: Path, stated: str, faults: list[str], missing: list[str]) -> bytes | None:
    """Return a file's content; where it is gone or its hash is another, say so and return None."""
    if not path.is_file():
        missing.append(f"{path.name}: `dzdesign batch` makes it, from the folders that are done")
        return None
    content = read_bytes(path, "file of the batch")
    if sha256_of(content) != stated:
        faults.append(
            f"{path.name} was changed since `dzdesign batch` wrote it (SHA-256 {sha256_of(content)}, {SUMMARY} says "
            f"{stated}): not used"
        )
        return None
    return content


def _table(folder: Path, document: Mapping[str, Any], faults: list[str], missing: list[str]) -> bytes | None:
    if (folder / TABLE).is_file() and (folder / TABLE).stat().st_size > MOST_TABLE:
        raise InputError(
            f"the table of {document['valves']} valves, '{folder / TABLE}', is larger than {MOST_TABLE >> 20} MiB, too "
            "large for one page; read the table itself, or calibrate the lot in parts, each with a folder of its own"
        )
    content = _fits(folder / TABLE, document["files"][TABLE], faults, missing)
    for name, stated in document["files"].items():
        if name != TABLE and isinstance(stated, str) and NAME.fullmatch(name):
            _fits(folder / name, stated, faults, missing)
    return content


def _common(
    folder: Path, setting: Mapping[str, Any], faults: list[str], missing: list[str]
) -> list[tuple[str, str]]:
    """Return name and hash of the common setting's file, if there is one and it fits."""
    if "sha256" not in setting or not NAME.fullmatch(setting["file"]):
        return []
    found = _fits(folder / setting["file"], setting["sha256"], faults, missing)
    return [(setting["file"], setting["sha256"])] if found is not None else []


def _look_at_valves(
    folder: Path, rows: Sequence[Mapping[str, Any]], faults: list[str], missing: list[str]
) -> dict[str, str]:
    """Compare each valve's artefacts with the table's hashes; return a text of each warning."""
    if not (folder / "valves").is_dir():
        missing.append("the folders of the valves: they are not beside this table, so their hashes were not compared")
        return {}
    other: list[str] = []
    texts: dict[str, str] = {}
    for row in rows:
        if not NAME.fullmatch(row["name"]):
            other.append(row["name"])
            continue
        for column, file in HASHED.items():
            path = folder / "valves" / row["name"] / file
            if not row[column]:
                continue
            content = path.read_bytes() if path.is_file() else b""
            if sha256_of(content) != row[column]:
                other.append(f"{row['name']}/{file}")
            elif file == "valve.json" and set(row["warnings"].split()) - set(texts):
                texts = {**_texts(content, str(path)), **texts}
    if other:
        faults.append(
            f"files of valves are not those that the table was made from ({len(other)}): {and_more(other, NAMED)}"
        )
    return texts


def _texts(content: bytes, source: str) -> dict[str, str]:
    """Return the warnings of a valve.json, the first text of each code."""
    document = parse_document(content, source, ("dzdesign.valve/1",))
    check_shape(document, {"warnings": [{"code": str, "text": str}]}, source, AGAIN)
    return {each["code"]: each["text"] for each in reversed(document["warnings"])}


def _stopped(folder: Path, document: dict[str, Any], hashes: list[tuple[str, str]]) -> Lot:
    """Read what a batch that was stopped, or still runs, has come to."""
    names = document.get("names")
    if not isinstance(names, list) or not all(isinstance(name, str) and NAME.fullmatch(name) for name in names):
        names = sorted((path.name for path in _folders(folder)), key=by_name)
    there = [name for name in names if (folder / "valves" / name / MANIFEST_NAME).is_file()]
    found: dict[str, Calibrated] = {}
    faults: list[str] = []
    for name in with_bar(there, "reading the valves"):
        try:
            found[name] = read_back(Results(folder), name, {})
        except InputError as error:
            faults.append(str(error))
    return Lot(
        document={**document, "complete": False},
        rows=tuple(rows_of(found, None)) if found else (),
        table="",
        expected=max(len(names), len(there)),
        hashes=tuple(hashes),
        warning_texts={
            warning.code: warning.text
            for each in reversed(found.values())
            for warning in (reversed(each.designed.valve.warnings) if each.designed else ())
        },
        faults=tuple(faults),
        missing=(
            f"{len(names) - len(there)} of {len(names)} valves, the table and the common setting: the batch did not "
            "come to its end; the same `dzdesign batch` takes it up",
        ),
    )


def _folders(folder: Path) -> Iterator[Path]:
    place = folder / "valves"
    return (path for path in (place.iterdir() if place.is_dir() else ()) if NAME.fullmatch(path.name))
