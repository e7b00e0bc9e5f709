"""`dzdesign init RAMP...`: look at recordings, write a commented dzdesign.toml with what was seen and what was not."""

import argparse
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from dzdesign.commands.init_file import CHECK_DP, options_file
from dzdesign.core.artefact_files import check_file_may_be_written, to_json, write_file
from dzdesign.core.errors import InputError
from dzdesign.recordings import expand, read_recordings, rows_to_skip
from dzdesign.terminal.progress import say, stages, with_bar

if TYPE_CHECKING:
    from dzdesign.identify.first_look import GuessedColumns, SeenSide
    from dzdesign.identify.reading.ramp_test import RampTest
    from dzdesign.identify.valve.model import Warning_

#: Where recordings are looked for if none are named.
PLACES = tuple(
    f"{folder}*.{ending}"
    for folder in ("ramps/", "")
    for ending in ("csv", "csv.gz", "txt", "tdms", "mat", "h5", "hdf5", "parquet", "feather")
)
#: Files that a line names.
NAMED_FILES = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What was seen of all recordings; the maps are None or empty where the files need none.

    Attributes
    ----------
    paths : list of Path
        The recordings.
    guesses : list of GuessedColumns
        One per recording.
    columns, dp : dict
        Of the tables [columns] and [dp] to write.
    u_max, u_seen : float
        Full command to declare and the largest seen, V.
    in_per_cent : bool
        True if the command is, so that full command can't be seen.
    sides, refused : dict
        As `look_at_sides` gives them.
    notes : tuple of str
        What was seen and is not used, or comes from elsewhere than a column.
    skip_rows : int or None
        As declared.
    """

    paths: "list[Path]"
    guesses: "list[GuessedColumns]"
    columns: dict[str, str]
    dp: dict[str, str]
    u_max: float = 10.0
    u_seen: float | None = None
    in_per_cent: bool = False
    sides: "dict[str, SeenSide]"
    refused: dict[str, str]
    notes: tuple[str, ...] = ()
    skip_rows: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """What a look at recordings proposes.

    Attributes
    ----------
    text : str
        Of the file of options.
    seen : tuple of str
        What was seen, for a person.
    opens : tuple of str
        What is open: without it `identify` can't run.
    look : Look
        What was seen.
    """

    text: str
    seen: tuple[str, ...]
    opens: tuple[str, ...]
    look: Look


def propose(
    ramps: list[str],
    *,
    columns: str | dict[str, str] | None,
    dp: str | dict[str, str] | None,
    skip_rows: int | str | None,
    output: str | None,
) -> Proposal:
    """Look at recordings, and write the file of options that this gives; the arguments are those of the command.

    Raises
    ------
    InputError
        If a recording can't be read, or the file exists.
    """
    if output is not None:
        if os.path.lexists(output):
            raise InputError(
                f"'{output}' exists, and init never writes over a file; give another name with -o, or move it away"
            )
        check_file_may_be_written(Path(output))
    paths = expand(ramps) if ramps else _found_recordings()
    look, opens = _look(paths, columns, dp, rows_to_skip(skip_rows))
    seen = _summary(look)
    text = options_file(look, seen, opens)
    if output is not None:
        write_file(Path(output), text)
    return Proposal(text=text, seen=tuple(seen), opens=tuple(opens), look=look)


def run_init(args: argparse.Namespace) -> int:
    """Write the file of options; 1 if it leaves something open without which `identify` can't run."""
    output = Path(args.output)
    proposal = propose(
        args.ramps, columns=args.columns, dp=args.dp, skip_rows=args.skip_rows, output=args.output
    )
    opens = proposal.opens
    if args.json:
        print(to_json(_document(proposal.look, list(opens), args.output)), end="")
        return 1 if opens else 0
    for line in proposal.seen:
        print(line)
    for line in opens:
        print(f"open: {line}")
    names = " ".join(map(_word, args.ramps)) if 0 < len(args.ramps) <= 3 else "RAMP..."
    print(f"Written: {output}" + ("; fill in what is open, then" if opens else "; read it, then"))
    print(f"  dzdesign identify {names} --config {_word(str(output))}")
    return 1 if opens else 0


def _word(name: str) -> str:
    """Return a name as one word of any shell; a pattern stays one."""
    return f'"{name}"' if " " in name else name


def _found_recordings() -> list[Path]:
    """Return the recordings in ./ramps, or in this folder."""
    for folder in ("ramps/", ""):
        found = sorted({path for place in PLACES if place.startswith(folder) for path in Path().glob(place)})
        if found:
            say(f"recordings found in {folder or 'this folder'}: {len(found)}")
            return found
    raise InputError("there are no recordings in ./ramps or in this folder; name them: dzdesign init RAMP...")


def _look(
    paths: list[Path],
    said_columns: str | dict[str, str] | None,
    said_dp: str | dict[str, str] | None,
    skip_rows: int | None,
) -> tuple[Look, list[str]]:
    """Return what was seen, and what is open."""
    from dzdesign.identify.first_look import guess_columns, look_at_sides, proposed_u_max
    from dzdesign.identify.reading.column_labels import parse_columns

    given = parse_columns(said_columns) if said_columns else {}
    guesses = [guess_columns(path, skip_rows) for path in with_bar(paths, "looking at columns")]
    columns, opens, notes = _columns(guesses, given, declared=bool(said_dp))
    undeclared, unused = _pressures(guesses, columns)
    opens, notes = opens + undeclared, notes + unused
    nothing = Look(paths=paths, guesses=guesses, columns=columns, dp={}, sides={}, refused={})
    if opens:
        return nothing, list(dict.fromkeys(opens))
    names = [path.as_posix() for path in paths]
    tests = read_recordings(names, u_max=10.0, columns=columns or None, dp=said_dp, skip_rows=skip_rows)
    dp = said_dp if isinstance(said_dp, dict) else {test.source: said_dp for test in tests} if said_dp else {}
    lacking = [test.source for test in tests if test.dp is None]
    if lacking:
        dp, unsaid, by_names = _pressures_by_names(lacking, alone=len(tests) == 1)
        opens, notes = opens + unsaid, notes + by_names
        if len(dp) == len(lacking):
            tests = read_recordings(names, u_max=10.0, columns=columns or None, dp=dp, skip_rows=skip_rows)
    u_max, u_seen = proposed_u_max(tests)
    in_per_cent = _is_in_per_cent(guesses, columns)
    if in_per_cent:
        u_max, u_seen = 10.0, None
        notes.append('full command: in per cent, so not recorded; u-max = "10 V" is a guess, correct it')
    contradicted, doubts = _contradicted(tests, u_max, columns["dP"] if "dP" in columns and "dP" not in given else "")
    opens, notes = opens + contradicted, notes + doubts
    sides, refused = {}, {}
    if not opens:
        with stages() as stage:
            stage(f"looking at {len(tests)} recording{'s' if len(tests) > 1 else ''}")
            sides, refused = look_at_sides(tests, u_max)
    if not sides and not opens:
        opens = [f"identify would refuse these recordings: {next(iter(refused.values()))}"]
    return (
        Look(
            paths=paths, guesses=guesses, columns=columns, dp=dp, u_max=u_max, u_seen=u_seen,
            in_per_cent=in_per_cent, sides=sides, refused=refused, notes=tuple(notes), skip_rows=skip_rows,
        ),
        opens,
    )  # fmt: skip


def _pressures_by_names(lacking: list[str], *, alone: bool) -> tuple[dict[str, str], list[str], list[str]]:
    """Return the pressures that files' names state, what is open, and what is to be said; a single file may lack it."""
    from dzdesign.identify.reading.named_pressure import pressures_in_name

    readings = {source: pressures_in_name(source) for source in lacking}
    dp = {source: texts[0] for source, texts in readings.items() if len(texts) == 1}
    opens = [
        f"pressure drop of '{source}': its name may say {' or '.join(texts)}; declare the right one by --dp or [dp]"
        if texts
        else f"pressure drop of '{source}': no column, and none in its name; declare it by --dp or [dp]"
        for source, texts in readings.items()
        if len(texts) > 1 or (not texts and not alone)
    ]
    if len(dp) == len(lacking):
        return dp, [], [f"pressure drop by the files' names: {', '.join(dict.fromkeys(dp.values()))}"]
    nothing = 'no pressure drop, by a column or a file\'s name; declare it, if you know it, by --dp "1 MPa"'
    return dp, opens, [] if opens else [nothing]


def _is_in_per_cent(guesses: "list[GuessedColumns]", columns: dict[str, str]) -> bool:
    from dzdesign.identify.first_look import is_per_cent
    from dzdesign.identify.reading.column_labels import PER_CENT

    if "u" in columns:  # a label that was chosen ends in its unit: Sollwert [%]
        return columns["u"].rstrip(" ])").endswith(PER_CENT)
    return any(is_per_cent(guess.understood.get("u")) for guess in guesses)


def _columns(
    guesses: "list[GuessedColumns]", given: dict[str, str], *, declared: bool
) -> tuple[dict[str, str], list[str], list[str]]:
    """Return the columns to write, what is open of them, and what is to be said; `declared`: --dp says the pressure."""
    columns, opens, notes = dict(given), [], []
    has_pressure = declared or "dP" in given or {"pA", "pB"} <= given.keys()
    for guess in guesses:
        for quantity, label in guess.chosen.items():
            if quantity == "dP" and has_pressure:
                notes += [f"not used: '{label}', as --dp says the pressure drop"] if declared else []
                continue
            if columns.setdefault(quantity, label) != label and quantity not in given:
                opens.append(f"column of {quantity}: '{columns[quantity]}' in one file, '{label}' in another")
    for quantity in ("time", "u", "Q", *(() if has_pressure else ("dP",))):
        # Of a pressure whose label says which and lacks a unit, `_pressures` says more.
        unsaid = [guess for guess in guesses if quantity != "dP" or not any(guess.bare_pressures.values())]
        reason = next((guess.unclear[quantity] for guess in unsaid if quantity in guess.unclear), None)
        if reason and quantity not in given:
            opens.append(f"column of {quantity}: {reason}")
    if "dP" in columns and "dP" not in given:
        notes.append(f"pressure drop: '{columns['dP']}', the only column in a unit of pressure; {CHECK_DP}")
    return columns, opens, list(dict.fromkeys(notes))


def _contradicted(tests: "list[RampTest]", u_max: float, guessed: str) -> tuple[list[str], list[str]]:
    """Return what is open, and what is only to be said, where a file's name says another pressure than its column.

    `guessed` is the label of a column that was taken for the drop because of its unit alone, or empty: then the column
    says itself that it is the drop, and the name may be of another pressure.
    """
    from dzdesign.identify.data_quality.pressures import about_a_stuck_sensor, about_mixtures, about_stuck_recordings
    from dzdesign.identify.ramps.sides import tests_of_side
    from dzdesign.identify.reading.named_pressure import contradicts
    from dzdesign.identify.valve.model import SIDES

    measured = [
        (test.source, median(test.dp.tolist())) for test in tests if test.dp is not None and not test.dp_is_declared
    ]
    wrong = [(source, stated, dp / 1e6) for source, dp in measured if (stated := contradicts(source, dp))]
    if guessed:
        return [
            f"column of dP: '{source}' says {stated} in its name, and {dp_MPa:.3g} MPa in '{guessed}', the only column "
            "in a unit of pressure; declare the one that is the drop, by --columns or --dp"
            for source, stated, dp_MPa in wrong
        ], []
    said = [f"'{source}' holds {dp_MPa:.3g} MPa" for source, _, dp_MPa in wrong[:NAMED_FILES]]
    more = f" and {len(wrong) - NAMED_FILES} more" if len(wrong) > NAMED_FILES else ""
    notes = [
        f"CHECK: a name says another pressure drop than the column: {', '.join(said)}{more}; the sensor is stuck, the "
        "unit is wrong, or the name is of another pressure"
    ]
    sides = [tests_of_side(tests, sign, u_max) for sign in SIDES.values()]
    stuck = [f"CHECK: {warning.text}" for mine in sides for warning in about_a_stuck_sensor(mine)]
    if stuck:
        return [], stuck
    named = {source for source, _, _ in wrong}
    doubts = [item for mine in sides if mine for item in (*about_stuck_recordings(mine), *about_mixtures(mine))]
    said = [f"CHECK: {_told(item)}" for item in doubts if item.source not in named]
    return [], (notes if wrong else []) + list(dict.fromkeys(said))


def _told(warning: "Warning_") -> str:
    return f"'{warning.source}': {warning.text}" if warning.source else warning.text


def _pressures(guesses: "list[GuessedColumns]", columns: dict[str, str]) -> tuple[list[str], list[str]]:
    """Return what is open of columns that look like a pressure and have no unit, and what is only to be said."""
    opens, notes = [], []
    if "dP" in columns or {"pA", "pB"} <= columns.keys():
        return opens, notes
    for guess in guesses:
        labels = {label: says for label, says in guess.bare_pressures.items() if says not in columns}
        if labels:
            quantities = [label for label in labels.values() if label] or (["pA", "pB"] if len(labels) > 1 else ["dP"])
            said = ", ".join(f"{name}={label}:bar" for name, label in zip(quantities, labels, strict=False))
            seen = "looks like a pressure" if len(labels) == 1 else "look like pressures"
            line = f'{" and ".join(map(repr, labels))} {seen}, without a unit; declare by --columns "{said}"'
            # A label that says pA is read as that, and refused; any other is passed over.
            opens += [f"pressure: {line}"] if any(labels.values()) else []
            notes += [] if any(labels.values()) else [f"not used: {line}"]
    return list(dict.fromkeys(opens)), list(dict.fromkeys(notes))


def _summary(look: Look) -> list[str]:
    """Return what was seen, for a person."""
    lines = [f"recordings: {len(look.paths)}, columns {', '.join(look.guesses[0].labels[:12])}"]
    if look.u_seen is not None:
        lines.append(f"largest command: {look.u_seen:.2f} V")
    lines += look.notes
    return lines + [_said(name, side) for name, side in look.sides.items()] + _refusals(look)


def _refusals(look: Look) -> list[str]:
    return [f"{name} commands would be refused: {reason}" for name, reason in look.refused.items()]


def _said(name: str, side: "SeenSide") -> str:
    pressures = ", ".join(f"{dp:.3g}" for dp in side.dp_MPa if dp is not None)
    where = f"{pressures} MPa" if pressures else "an unknown pressure drop"
    rate = "" if side.rate_V_s is None else f", at most {side.rate_V_s:.3g} V/s"
    floor = f"meter floor {side.floor_L_min:.2f} L/min" if side.floor_L_min else "no meter floor is seen"
    return (
        f"{name} commands: {side.ramps} ramp{'s' if side.ramps > 1 else ''} at {where}{rate}, "
        f"up to {side.q_max_L_min:.3g} L/min; {floor}"
    )


def _document(look: Look, opens: list[str], output: str) -> dict:
    return {
        "file": output,
        "recordings": [path.as_posix() for path in look.paths],
        "labels": [list(guess.labels) for guess in look.guesses],
        "columns": look.columns,
        "dp": look.dp,
        "u_max_V": look.u_max,
        "u_seen_V": look.u_seen,
        "sides": {name: asdict(side) for name, side in look.sides.items()},
        "refused": look.refused,
        "open": opens,
    }
