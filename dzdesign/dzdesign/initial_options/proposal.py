"""A look at recordings: which columns, pressures and sides they have, what is open, and the options file of it."""

from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError
from dzdesign.core.options import Paths, Table, paths_of
from dzdesign.initial_options.file_text import CHECK_DP, options_file
from dzdesign.initial_options.look import Look, Proposal
from dzdesign.stages.recordings import expand, read_recordings
from dzdesign.terminal.progress import say, stage_progress, with_bar

if TYPE_CHECKING:
    from dzdesign.identify.first_look import SideOverview
    from dzdesign.identify.reading.guessed_columns import GuessedColumns
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


def propose(ramps: Paths, *, columns: Table, dp: Table, skip_rows: int | None) -> Proposal:
    """Look at recordings, and return the file of options that this gives.

    Raises
    ------
    InputError
        If a recording can't be read.
    """
    patterns = paths_of(ramps)
    paths = expand(patterns) if patterns else _found_recordings()
    look, opens = _look(paths, columns, dp, skip_rows)
    seen = _summary(look)
    return Proposal(text=options_file(look, seen, opens), seen=tuple(seen), opens=tuple(opens), look=look)


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
    declared_columns: Table,
    declared_dp: Table,
    skip_rows: int | None,
) -> tuple[Look, list[str]]:
    """Return what was seen, and what is open."""
    from dzdesign.identify.first_look import look_at_sides, proposed_u_max
    from dzdesign.identify.reading.column_labels import parse_columns
    from dzdesign.identify.reading.guessed_columns import guess_columns

    given = parse_columns(declared_columns) if declared_columns else {}
    guesses = [guess_columns(path, skip_rows) for path in with_bar(paths, "looking at columns")]
    columns, opens, notes = _columns(guesses, given, declared=bool(declared_dp))
    undeclared, unused = _pressures(guesses, columns)
    opens, notes = opens + undeclared, notes + unused
    nothing = Look(paths=paths, guesses=guesses, columns=columns, dp={}, sides={}, refused={})
    if opens:
        return nothing, list(dict.fromkeys(opens))
    names = [path.as_posix() for path in paths]
    tests = read_recordings(names, u_max=10.0, columns=columns or None, dp=declared_dp, skip_rows=skip_rows)
    dp: dict[str, str] = {}
    if declared_dp:
        every = {test.source: declared_dp for test in tests} if isinstance(declared_dp, str) else declared_dp
        dp = dict(every)
    lacking = [test.source for test in tests if test.dp is None]
    if lacking:
        dp, missing, by_names = _pressures_by_names(lacking, alone=len(tests) == 1)
        opens, notes = opens + missing, notes + by_names
        if len(dp) == len(lacking):
            tests = read_recordings(names, u_max=10.0, columns=columns or None, dp=dp, skip_rows=skip_rows)
    u_max, u_seen = proposed_u_max(tests)
    sides: dict[str, SideOverview] = {}
    refused: dict[str, str] = {}
    in_per_cent = _is_in_per_cent(guesses, columns)
    if in_per_cent:
        u_max = 10.0
        notes.append('full command: in per cent, so not recorded; u-max = "10 V" is a guess, correct it')
    contradicted, doubts = _contradicted(tests, u_max, columns["dP"] if "dP" in columns and "dP" not in given else "")
    opens, notes = opens + contradicted, notes + doubts
    if not opens:
        with stage_progress() as stage:
            stage(f"looking at {len(tests)} recording{'s' if len(tests) > 1 else ''}")
            sides, refused = look_at_sides(tests, u_max)
    if not sides and not opens:
        opens = [f"identify would refuse these recordings: {next(iter(refused.values()))}"]
    return (
        Look(
            paths=paths, guesses=guesses, columns=columns, dp=dp, u_max=u_max, u_seen=None if in_per_cent else u_seen,
            in_per_cent=in_per_cent, sides=sides, refused=refused, notes=tuple(notes), skip_rows=skip_rows,
        ),
        opens,
    )  # fmt: skip


def _pressures_by_names(lacking: list[str], *, alone: bool) -> tuple[dict[str, str], list[str], list[str]]:
    """Return the pressures that files' names state, what is open, and notes; a single file may lack it."""
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
    from dzdesign.identify.reading.column_labels import PER_CENT
    from dzdesign.identify.reading.guessed_columns import is_per_cent

    if "u" in columns:  # a label that was chosen ends in its unit: Sollwert [%]
        return columns["u"].rstrip(" ])").endswith(PER_CENT)
    return any(is_per_cent(guess.understood.get("u")) for guess in guesses)


def _columns(
    guesses: "list[GuessedColumns]", given: dict[str, str], *, declared: bool
) -> tuple[dict[str, str], list[str], list[str]]:
    """Return the columns to write, what is open of them, and notes; `declared`: --dp says the pressure."""
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
        labelled = [guess for guess in guesses if quantity != "dP" or not any(guess.bare_pressures.values())]
        reason = next((guess.unclear[quantity] for guess in labelled if quantity in guess.unclear), None)
        if reason and quantity not in given:
            opens.append(f"column of {quantity}: {reason}")
    if "dP" in columns and "dP" not in given:
        notes.append(f"pressure drop: '{columns['dP']}', the only column in a unit of pressure; {CHECK_DP}")
    return columns, opens, list(dict.fromkeys(notes))


def _contradicted(tests: "list[RampTest]", u_max: float, guessed: str) -> tuple[list[str], list[str]]:
    """Return what is open, and what is worth a note, where a file's name says another pressure than its column.

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
    found = [f"'{source}' holds {dp_MPa:.3g} MPa" for source, _, dp_MPa in wrong[:NAMED_FILES]]
    more = f" and {len(wrong) - NAMED_FILES} more" if len(wrong) > NAMED_FILES else ""
    notes = [
        f"CHECK: a name says another pressure drop than the column: {', '.join(found)}{more}; the sensor is stuck, the "
        "unit is wrong, or the name is of another pressure"
    ]
    sides = [tests_of_side(tests, sign, u_max) for sign in SIDES.values()]
    stuck = [f"CHECK: {warning.text}" for side in sides for warning in about_a_stuck_sensor(side)]
    if stuck:
        return [], stuck
    named = {source for source, _, _ in wrong}
    doubts = [warning for side in sides if side for warning in (*about_stuck_recordings(side), *about_mixtures(side))]
    checks = [f"CHECK: {_with_source(warning)}" for warning in doubts if warning.source not in named]
    return [], (notes if wrong else []) + list(dict.fromkeys(checks))


def _with_source(warning: "Warning_") -> str:
    return f"'{warning.source}': {warning.text}" if warning.source else warning.text


def _pressures(guesses: "list[GuessedColumns]", columns: dict[str, str]) -> tuple[list[str], list[str]]:
    """Return what is open of columns that look like a pressure and have no unit, and what is worth a note."""
    opens: list[str] = []
    notes: list[str] = []
    if "dP" in columns or {"pA", "pB"} <= columns.keys():
        return opens, notes
    for guess in guesses:
        labels = {label: quantity for label, quantity in guess.bare_pressures.items() if quantity not in columns}
        if labels:
            quantities = [label for label in labels.values() if label] or (["pA", "pB"] if len(labels) > 1 else ["dP"])
            example = ", ".join(f"{name}={label}:bar" for name, label in zip(quantities, labels, strict=False))
            seen = "looks like a pressure" if len(labels) == 1 else "look like pressures"
            line = f'{" and ".join(map(repr, labels))} {seen}, without a unit; declare by --columns "{example}"'
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
    return lines + [_side_line(name, side) for name, side in look.sides.items()] + _refusals(look)


def _refusals(look: Look) -> list[str]:
    return [f"{name} commands would be refused: {reason}" for name, reason in look.refused.items()]


def _side_line(name: str, side: "SideOverview") -> str:
    pressures = ", ".join(f"{dp:.3g}" for dp in side.dp_MPa if dp is not None)
    where = f"{pressures} MPa" if pressures else "an unknown pressure drop"
    rate = "" if side.rate_V_s is None else f", at most {side.rate_V_s:.3g} V/s"
    floor = f"meter floor {side.floor_L_min:.2f} L/min" if side.floor_L_min else "no meter floor is seen"
    return (
        f"{name} commands: {side.ramps} ramp{'s' if side.ramps > 1 else ''} at {where}{rate}, "
        f"up to {side.q_max_L_min:.3g} L/min; {floor}"
    )
