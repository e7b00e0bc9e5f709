"""Reading recordings as the command line names them: patterns, columns, declared pressure drops, no copies."""

import fnmatch
import glob
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME, check_place_of_files
from dzdesign.core.errors import InputError, nearest, neighbour, quoted
from dzdesign.core.units import parse_quantity
from dzdesign.terminal.progress import say, with_bar

if TYPE_CHECKING:
    from dzdesign.identify.reading.ramp_test import RampTest


def read_recordings(
    patterns: list[str],
    *,
    u_max: float,
    columns: str | dict[str, str] | None,
    dp: str | dict[str, str] | None,
    skip_rows: str | int | None = None,
    what: str = "reading recordings",
) -> "list[RampTest]":
    """Read the recordings that patterns name.

    Parameters
    ----------
    patterns : list of str
        Names of files, or patterns such as ``ramps/*.csv``.
    u_max : float
        Command in V that 100 % means.
    columns : str or dict, optional
        Of --columns, or of the table in the file of options.
    dp : str or dict, optional
        Pressure drop that --dp declares for all files, or that [dp] declares for each.
    skip_rows : str or int, optional
        Of --skip-rows.
    what : str
        For the bar of progress.

    Raises
    ------
    InputError
        If a file can't be read, or has no pressure drop where [dp] names those of others.
    """
    from dzdesign.identify.reading.column_labels import parse_columns
    from dzdesign.identify.reading.ramp_files import read_ramp_file

    chosen, skip = parse_columns(columns) if columns else {}, rows_to_skip(skip_rows)
    paths = expand(patterns)
    names = told_apart(paths)
    tests = [
        replace(read_ramp_file(path, u_max, columns=chosen, dp=_declared_dp(name, dp), skip_rows=skip), source=name)
        for path, name in with_bar(list(zip(paths, names, strict=True)), what)
    ]
    _refuse_unnamed(tests, dp)
    return tests


def rows_to_skip(text: str | int | None) -> int | None:
    """Return the number that --skip-rows says, or None if it is not given."""
    if text is None:
        return None
    if not re.fullmatch(r"\d{1,6}", str(text), re.ASCII):
        raise InputError(
            f"--skip-rows is {quoted(text)}, expected how many rows stand above the header, such as 12 (0: none)"
        )
    return int(text)


def expand(patterns: list[str]) -> list[Path]:
    """Return the files that the patterns name; cmd.exe leaves ``*.csv`` to the program."""
    paths = []
    for pattern in patterns:
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


def told_apart(paths: list[Path]) -> list[str]:
    """Return the files' names, with as many of their folders as tell those of one name apart.

    Examples
    --------
    >>> told_apart([Path("a/x/ramp.csv"), Path("b/x/ramp.csv"), Path("b/x/other.csv")])
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


def knee_window(text: str) -> tuple[float, float]:
    """Return the two shares of the largest flow that --knee-window names."""
    return two_per_cents(text, "--knee-window", "the largest flow such as '12-50'")


def two_per_cents(text: str, option: str, example: str) -> tuple[float, float]:
    """Return two per cents such as ``12-50`` as shares.

    Parameters
    ----------
    text : str
        As given.
    option, example : str
        Where, and what they are of; for the message.
    """
    # Digits and blanks without an end would be matched in the square of their number.
    digits = r"\s{0,9}(\d{1,9}(?:\.\d{0,15})?)\s{0,9}%?\s{0,9}"
    ends = re.fullmatch(f"{digits}-{digits}", text, re.ASCII)
    if ends is None:
        raise InputError(f"{option} is {quoted(text)}, expected two per cents of {example}")
    return float(ends[1]) / 100, float(ends[2]) / 100


def optional_quantity(text: str | None, quantity: str, option: str) -> float | None:
    """Return what an option says, in SI, or None if it is not given."""
    return None if text is None else parse_quantity(text, quantity, option)


def _declared_dp(name: str, declared: str | dict[str, str] | None) -> float | None:
    """Return the pressure drop that --dp or [dp] declares for a file, in Pa; a name goes before a pattern.

    The name may have folders before it, where they tell two files apart; [dp] may leave them out.
    """
    if declared is None or isinstance(declared, str):
        return optional_quantity(declared, "pressure", "--dp")
    last = name.rpartition("/")[2]
    patterns = [known for known in (name, last) if known in declared]
    patterns += [each for each in declared if fnmatch.fnmatchcase(name, each) or fnmatch.fnmatchcase(last, each)]
    return parse_quantity(declared[patterns[0]], "pressure", f"[dp] '{patterns[0]}'") if patterns else None


def _refuse_unnamed(tests: list["RampTest"], declared: str | dict[str, str] | None) -> None:
    """Refuse a file without a pressure drop where the table [dp] names others: a name was mistyped."""
    for test in tests:
        if isinstance(declared, dict) and test.dp is None:
            raise InputError(
                f"'{test.source}' has no column of dP, and no name in [dp] is its own{nearest(test.source, declared)}; "
                f'add "{test.source}" = "1 MPa" to [dp], with its pressure drop'
            )


def refuse_copies(tests: list["RampTest"]) -> None:
    """Refuse a recording that is given twice: counted as a repetition it would feign certainty."""
    known: dict[str, str] = {}
    for test in tests:
        if test.sha256 in known:
            raise InputError(
                f"'{test.source}' is byte for byte the same recording as '{known[test.sha256]}'; give it once "
                "(a repeated ramp test is welcome, a copy is no repetition)"
            )
        known[test.sha256] = test.source


def check_plots(folder: str | None, output: Path) -> None:
    """Refuse a folder for plots that can't be one, or in whose place the output goes."""
    if folder is None:
        return
    if not folder:
        raise InputError("--plots is empty, expected the name of a folder, such as plots")
    check_place_of_files(Path(folder), "--plots")
    if output.absolute() in (Path(folder).absolute(), *Path(folder).absolute().parents):
        raise InputError(f"--plots '{folder}' lies at '{output}', where -o puts a file; choose another --plots")
