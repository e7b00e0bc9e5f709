"""Which valves a batch has: one subfolder of recordings per valve, or a CSV file with one row per valve."""

import csv
import io
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError, nearest
from dzdesign.identify.valve.test_record import checked_record
from dzdesign.report.lot.table import NAME, RECORD, by_name
from dzdesign.stages.recordings import expand, recordings_in

RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Valve:
    """One valve of the lot: files or patterns of its recordings, and what is different for it.

    `overrides` are options as on the command line, `record` the entries of its record beside those of all valves.
    """

    name: str
    patterns: tuple[str, ...]
    overrides: Mapping[str, str] = field(default_factory=dict)
    record: Mapping[str, str] = field(default_factory=dict)

    def recordings(self) -> dict[Path, str]:
        """Return its recordings, each with the pattern that names it; refuse none, and one that is named twice."""
        if not self.patterns:
            raise InputError(f"valve '{self.name}' has no recording; expected files such as ramp_1MPa.csv")
        found: dict[Path, str] = {}
        places: dict[str, str] = {}
        for pattern in self.patterns:
            for path in expand([pattern]):
                place = os.path.abspath(path)
                if place in places:
                    raise InputError(
                        f"valve '{self.name}' takes the file '{path.name}' twice, by '{Path(places[place]).name}' and "
                        f"by '{Path(pattern).name}' of its column files; make each of them match other files"
                    )
                found[path] = places[place] = pattern
        return found


def valves_of(source: Path, pattern: str | None, options: Collection[str]) -> list[Valve]:
    """Return the valves that a folder or a CSV file names, in the order of their names; see `by_name`.

    A folder has one subfolder a valve, whose recordings the pattern matches (None: all that are called as recordings
    are). A CSV file has the columns name, files, record.NAME and any of the options, which that valve then has of its
    own.
    """
    if source.is_dir():
        valves = _of_folder(source, pattern)
    else:
        if pattern is not None:
            raise InputError(f"--pattern is for a folder, and '{source}' is none; write patterns in its column files")
        valves = _of_table(source, options)
    if not valves and source.is_dir() and _recordings_in(source, pattern):
        raise InputError(
            f"'{source}' holds recordings itself, of one valve; give the folder that holds it, or use `dzdesign "
            "identify`"
        )
    if not valves:
        raise InputError(f"'{source}' names no valve; expected one subfolder of recordings, or one row, a valve")
    _check_names([valve.name for valve in valves], source)
    return sorted(valves, key=lambda valve: by_name(valve.name))


def _of_folder(folder: Path, pattern: str | None) -> list[Valve]:
    try:
        visible = [path for path in sorted(folder.iterdir()) if not path.name.startswith(".")]
    except OSError as error:
        raise InputError(f"'{folder}' can't be read: {error.strerror}; check who may read it") from error
    # A link to a folder that is gone was a valve: its reason is that the file can't be read.
    gone = {path: (str(path),) for path in visible if path.is_symlink() and not path.exists()}
    folders = [path for path in visible if path in gone or path.is_dir()]
    return [Valve(name=path.name, patterns=gone.get(path) or tuple(_recordings_in(path, pattern))) for path in folders]


def _recordings_in(folder: Path, pattern: str | None) -> list[str]:
    # Folders alone are left out: a valve of which a recording can't be read is refused, not calibrated on the rest.
    found = folder.glob(pattern) if pattern else recordings_in(folder)
    return sorted(str(path) for path in found if not path.is_dir() and not path.name.startswith("."))


def _of_table(path: Path, options: Collection[str]) -> list[Valve]:
    """Read the CSV file; a pattern of its column `files` is relative to its folder."""
    try:
        text = read_bytes(path, "list of valves").decode("utf-8-sig")
        rows = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"'{path}' is no CSV in UTF-8: {error}; first row name,files") from error
    if not any(cell.strip() for row in rows for cell in row):
        raise InputError(f"'{path}' is empty, expected a list of valves with a first row name,files")
    if len(rows[0]) == 1 and (other := next((mark for mark in ";\t" if mark in rows[0][0]), None)):
        raise InputError(
            f"'{path}' parts its columns by {'a tab' if other == chr(9) else repr(other)}, expected a comma; save it "
            "as CSV with commas (a ';' parts the patterns in the column files)"
        )
    labels = [label.strip() for label in rows[0]]  # an entry of the record keeps its own spelling
    named = {name.rstrip("_"): name for name in options}  # from is a word of Python, and from_ the argument
    plain = [label.replace("-", "_") for label in labels]
    heading = [
        label if label.startswith(RECORD) else named.get(word, word) for label, word in zip(labels, plain, strict=True)
    ]
    known = ("name", "files", *options)
    for label in heading:
        if label not in known and not label.startswith(RECORD):
            raise InputError(
                f"'{path}' has a column '{label[:40]}'{nearest(label, known)}, expected name, files, options of "
                "identify and design, and entries of the record such as record.serial"
            )
    names = [label.removeprefix(RECORD) for label in heading if label.startswith(RECORD)]
    checked_record(((name, "-") for name in names), f"'{path}', its columns {RECORD}NAME")
    if len(set(heading)) < len(heading) or not {"name", "files"} <= set(heading):
        raise InputError(f"'{path}' has the columns {', '.join(heading)}, expected name and files, each column once")
    valves = []
    for number, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != len(heading):
            raise InputError(f"'{path}' row {number} has {len(row)} cells, expected {len(heading)} as in its first row")
        cells = {label: cell.strip() for label, cell in zip(heading, row, strict=True)}
        name, files = cells.pop("name"), cells.pop("files")
        patterns = [str(path.parent / part.strip()) for part in files.split(";") if part.strip()]
        filled = {label: cell for label, cell in cells.items() if cell}
        record = {label.removeprefix(RECORD): cell for label, cell in filled.items() if label.startswith(RECORD)}
        overrides = {label: cell for label, cell in filled.items() if not label.startswith(RECORD)}
        valves.append(Valve(name=name, patterns=tuple(patterns), overrides=overrides, record=record))
    return valves


def _check_names(names: Sequence[str], source: Path) -> None:
    """Refuse names that can't be a folder's everywhere, and two that are one where case is not told apart."""
    seen: dict[str, str] = {}
    for name in names:
        if not NAME.fullmatch(name) or RESERVED.fullmatch(name):
            raise InputError(
                f"'{source}' has a valve named '{name[:100]}', expected up to 100 letters, digits, blanks and . _ + -, "
                "a letter or digit first; rename it"
            )
        if seen.get(name.casefold()) == name:
            raise InputError(f"'{source}' has two valves named '{name}'; rename one, or put all files of it in one row")
        if name.casefold() in seen:
            raise InputError(f"'{source}' has the valves '{seen[name.casefold()]}' and '{name}'; rename one")
        seen[name.casefold()] = name
