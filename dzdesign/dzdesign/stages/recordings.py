"""How stages read recordings: patterns, columns, declared pressure drops, no copies."""

import fnmatch
import glob
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.errors import InputError, nearest, neighbour, quoted
from dzdesign.core.option_readers import percent_range, quantity, whole_number, with_tolerance
from dzdesign.core.options import FIT, METER, RECORDINGS, Option, Paths, Table, Text, Texts, paths_of, read_options
from dzdesign.core.units import parse_quantity
from dzdesign.terminal.progress import say, with_bar

if TYPE_CHECKING:
    from dzdesign.identify.reading.ramp_test import RampTest

#: What recordings are called where none are named; notes and photographs may lie beside them.
SUFFIXES = ("csv", "txt", "tsv", "dat", "gz", "tdms", "mat", "h5", "hdf5", "parquet", "feather", "arrow")


def recordings_in(folder: Path) -> list[Path]:
    """Return what lies in a folder and is called as recordings are; a folder alone is none."""
    there = folder.iterdir() if folder.is_dir() else ()
    return sorted(
        path for path in there
        if path.suffix[1:].lower() in SUFFIXES and not path.is_dir() and not path.name.startswith(".")
    )  # fmt: skip


def read_sample_rate(text: str, option: str) -> float:
    """Read --sample-rate, Hz."""
    rate = parse_quantity(text, "frequency", option)
    if not rate > 0:
        raise InputError(f"{option} is '{text}', expected more than zero, such as '100 Hz'")
    return rate


def read_missing(given: Texts, option: str) -> tuple[str, ...]:
    """Read --missing: texts with commas between them, or one or several an item."""
    texts = [given] if isinstance(given, str) or not isinstance(given, Iterable) else list(given)
    if not all(isinstance(text, str) for text in texts):
        raise InputError(f"{option} is {quoted(given)}, expected texts such as 'Sensor off, -500'")
    found = tuple(part.strip() for text in texts for part in text.split(","))
    if not all(found):
        raise InputError(f"{option} is {quoted(given)}, with nothing between two commas; expected texts such as 'OFF'")
    return found


#: Reads --skip-rows.
read_skip_rows = whole_number("how many rows stand above the header, such as 12 (0: none)")


@dataclass(frozen=True, kw_only=True)
class ColumnArguments:
    """How the columns of recordings are found."""

    columns: Annotated[Table, Option("MAP", RECORDINGS)] = None
    """Columns, such as "u=AO0:V, Q=Flow (L/min)". Each entry is a quantity, its label in the file and, after a colon, a
    unit that the label lacks. Quantities are time, u, Q and dP, or in place of dP the pressures of the ports: pP, pA,
    pB, pT. Of equal labels, "Q=Q_Lmin#2" is the second. Of two solenoids, "u=uA_V - uB_V" is the signed command. In the
    options file this is a table [columns]."""
    dp: Annotated[Table, Option("P", RECORDINGS, example="1 MPa")] = None
    """Pressure drop of files without a column for it, such as "1 MPa". In the options file also a table [dp] from file
    name or pattern to pressure."""
    sample_rate: Annotated[Text, Option("F", RECORDINGS, example="100 Hz", read=read_sample_rate)] = None
    """Sampling rate of files without a time column, such as "100 Hz"."""
    skip_rows: Annotated[int | str | None, Option("N", RECORDINGS, read=read_skip_rows)] = None
    """Number of rows above the header of a text file, such as a logger's preamble (default: found)."""
    missing: Annotated[Texts | None, Option("TEXT", RECORDINGS, read=read_missing)] = None
    """Further texts or numbers that stand for no value, such as "Sensor off, -500". Repeatable; in the options file
    also a list. ---, n/a, OL, -9999 and similar entries are known."""


@dataclass(frozen=True, kw_only=True)
class RampArguments(ColumnArguments):
    """How ramp tests are read."""

    u_max: Annotated[str, Option("U", RECORDINGS, example="10 V", read=quantity("voltage"))] = "10 V"
    """Full command."""
    meter_floor: Annotated[Text, Option("Q", METER, example="0.6 L/min", read=quantity("flow"))] = None
    """Flow below which the meter reads zero (default: found)."""
    meter_lag: Annotated[Text, Option("T", METER, example="0.1 s", read=with_tolerance("time"))] = None
    """Lag of the flow meter, with its tolerance, such as "0.1 s +- 0.02 s" (default: found from ramps of two rates).
    Without a tolerance it is 20 %, and at least 0.05 s."""
    knee_window: Annotated[str, Option("A-B", FIT, read=percent_range("the largest flow such as '12-50'"))] = "12-50"
    """Flow range of the straight-line fit, in percent of maximum flow."""


def meter_choices(arguments: RampArguments, names: Iterable[str]) -> dict[str, Any]:
    """Return options of those names, each read; the lag's tolerance under a name of its own."""
    read = read_options(arguments, names)
    seconds, tolerance = read["meter_lag"] or (None, None)
    return {**read, "meter_lag": seconds, "meter_lag_tolerance": tolerance}


def read_recordings(
    patterns: Paths, arguments: ColumnArguments, u_max: float, what: str = "reading recordings",
    names: Sequence[str] = (),
) -> "list[RampTest]":  # fmt: skip
    """Read the recordings that patterns name, with the columns of the arguments; `u_max`, V, is what 100 % means.

    Refuses a file that can't be read, or has no pressure drop where [dp] names those of others. `what` is for the bar;
    `names` are those of the recordings, one a file, where they are not those of the files.
    """
    from dzdesign.identify.reading.column_labels import parse_columns
    from dzdesign.identify.reading.ramp_files import read_ramp_file
    from dzdesign.identify.reading.scaling import unit_of_pressure

    chosen, dp = parse_columns(arguments.columns) if arguments.columns else {}, arguments.dp
    read = read_options(arguments, ["sample_rate", "skip_rows", "missing"])
    paths = expand(patterns)
    names = names or distinct_names(paths)
    tests = []
    for path, name in with_bar(list(zip(paths, names, strict=True)), what):
        declared = said_of(name, dp, "dp")
        test = read_ramp_file(
            path, u_max, columns=chosen, dp=declared and parse_quantity(declared[0], "pressure", declared[1]),
            sample_rate=read["sample_rate"], skip_rows=read["skip_rows"], missing=read["missing"] or (),
        )  # fmt: skip
        units = test.units if declared is None else {**test.units, **unit_of_pressure(declared[0])}
        tests.append(replace(test, source=name, units=units))
    _refuse_unnamed(tests, dp)
    if dp is None and len(tests) > 1:
        for path, test in zip(paths, tests, strict=True):
            if test.dp is None and (why := _unclear_pressures(path, chosen, read["skip_rows"])):
                raise InputError(f"'{test.source}' has no column of dP: {why}")
    return tests


def _unclear_pressures(path: Path, chosen: Mapping[str, str], skip_rows: int | None) -> str:
    """Return which columns may make the drop that a recording lacks, with what to declare; nothing if none may."""
    from dzdesign.identify.reading.columns import propose_columns

    look = propose_columns(path, chosen, skip_rows, time_is_declared=True)
    if look.unclear.get("dP") or "dP" not in look.proposed:
        return look.unclear.get("dP", "")
    label = look.proposed["dP"].label
    return f"'{label}' is the only column in a unit of pressure; if it is the drop, give --columns \"dP={label}\""


def expand(patterns: Paths) -> list[Path]:
    """Return the files that one or several patterns name; cmd.exe leaves ``*.csv`` to the program."""
    paths = []
    for path in paths_of(patterns):
        pattern = os.fspath(path)
        magic = glob.has_magic(pattern) and "\0" not in pattern and not os.path.exists(pattern)
        matches = sorted(glob.glob(pattern)) if magic else [pattern]
        if not matches:
            near = neighbour(os.path.dirname(pattern)) if not glob.has_magic(os.path.dirname(pattern)) else ""
            raise InputError(f"no file matches '{pattern}'{near}; check the name and the folder")
        paths += [Path(match) for match in matches]
    return _without_manifests(paths)


def _without_manifests(paths: list[Path]) -> list[Path]:
    """Return the files without those that dzdesign itself puts into a folder of recordings; each is named."""
    kept = [path for path in paths if path.name != MANIFEST_NAME]
    for path in paths if kept else ():
        if path.name == MANIFEST_NAME:
            say(f"'{path}' is left out: a manifest that dzdesign writes beside recordings, and none itself")
    return kept or paths


def distinct_names(paths: list[Path]) -> list[str]:
    """Return the files' names, with as many of their folders as tell those of one name apart.

    Examples
    --------
    >>> distinct_names([Path("a/x/ramp.csv"), Path("b/x/ramp.csv"), Path("b/x/other.csv")])
    ['a/x/ramp.csv', 'b/x/ramp.csv', 'other.csv']
    """
    of_one_name: dict[str, list[Path]] = {}
    for path in paths:
        of_one_name.setdefault(path.name, []).append(path)
    names = []
    for path in paths:
        others = [other.parts for other in of_one_name[path.name] if other != path]
        shown = next(
            (count for count in range(1, len(path.parts)) if all(o[-count:] != path.parts[-count:] for o in others)),
            len(path.parts),
        )
        names.append("/".join(path.parts[-shown:]).replace("//", "/").encode(errors="replace").decode())
    return names


def is_named(pattern: str, name: str) -> bool:
    """Tell whether a name or a pattern of a table is a recording's, with its folders or without."""
    names = name, name.rpartition("/")[2]
    return pattern in names or any(fnmatch.fnmatchcase(each, pattern) for each in names)


def said_of(name: str, table: Table, option: str) -> tuple[str, str] | None:
    """Return what an option, or its table, says of a recording, and where; a name goes before a pattern."""
    if table is None or isinstance(table, str):
        return None if table is None else (table, f"--{option}")
    patterns = [known for known in (name, name.rpartition("/")[2]) if known in table]
    patterns += [pattern for pattern in table if is_named(pattern, name)]
    return (table[patterns[0]], f"[{option}] '{patterns[0]}'") if patterns else None


def _refuse_unnamed(tests: list["RampTest"], declared: Table) -> None:
    """Refuse a file without a pressure drop where the table [dp] names others: a name was mistyped."""
    for test in tests:
        if isinstance(declared, Mapping) and test.dp is None:
            raise InputError(
                f"'{test.source}' has no column of dP, and no name in [dp] is its own{nearest(test.source, declared)}; "
                f'add "{test.source}" = "1 MPa" to [dp], with its pressure drop'
            )


def refuse_copies(tests: Sequence["RampTest"]) -> None:
    """Refuse a recording that is given twice: counting a copy as a repeat would understate the uncertainty.

    The same file, or the same samples: see `series`.
    """
    from dzdesign.identify.reading.series import find_copy

    known: dict[str, str] = {}
    for recording in tests:
        if recording.sha256 in known:
            raise InputError(
                f"'{recording.source}' is an exact copy of the recording '{known[recording.sha256]}'; give it once "
                "(a repeated ramp test is welcome, a copy is no repetition)"
            )
        known[recording.sha256] = recording.source
    if copy := find_copy(tests):
        raise InputError(
            f"'{tests[copy.other].source}' is the recording '{tests[copy.one].source}', saved again: {copy.agree} of "
            f"{copy.compared} rows with flow are in both. Give it once. A repeated ramp test is welcome, but a copy is "
            "no repetition, nor is a second run of a simulation without noise"
        )
