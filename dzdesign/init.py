"""`dzdesign init RAMP...`: look at recordings, write a commented dzdesign.toml with what was seen and what was not."""

import argparse
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefacts import check_file_may_be_written, to_json, write_file
from dzdesign.core.errors import InputError, one_line
from dzdesign.progress import say, stages, with_bar
from dzdesign.recordings import expand, read_recordings

if TYPE_CHECKING:
    from dzdesign.identify.first_look import GuessedColumns, SeenSide

#: Where recordings are looked for if none are named.
PLACES = tuple(
    f"{folder}*.{ending}"
    for folder in ("ramps/", "")
    for ending in ("csv", "csv.gz", "txt", "tdms", "mat", "h5", "hdf5", "parquet", "feather")
)


#: Who and what; last in the file, for in TOML a table ends where the next one begins.
RECORD_LINES = (
    "# Who and what, for the head of the report: any names. Nothing is computed from it.",
    "# What is of one valve alone may stand on the command line: --record \"serial = 4711\"",
    "# [record]",
    *(f"# {line}" for line in (
        'serial = "4711"', 'type = "4/3 proportional, 10 V"', 'operator = "K. Muster"', "date = 2026-01-31",
        'oil = "HLP 46"', 'oil-temperature = "40 °C"', 'bench = "bench 2"', 'meter = "gear meter, no. 12"',
    )),
)  # fmt: skip


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
    sides, refused : dict
        As `look_at_sides` gives them.
    """

    paths: "list[Path]"
    guesses: "list[GuessedColumns]"
    columns: dict[str, str]
    dp: dict[str, str]
    u_max: float = 10.0
    u_seen: float | None = None
    sides: "dict[str, SeenSide]"
    refused: dict[str, str]


def run_init(args: argparse.Namespace) -> int:
    """Write the file of options; 1 if it leaves something open without which `identify` can't run."""
    output = Path(args.output)
    if os.path.lexists(output):
        raise InputError(
            f"'{output}' exists, and init never writes over a file; give another name with -o, or move it away"
        )
    check_file_may_be_written(output)
    paths = expand(args.ramps) if args.ramps else _found_recordings()
    look, opens = _look(paths, args)
    text = _toml(look, opens)
    write_file(output, text)
    if args.json:
        print(to_json(_document(look, opens, args.output)), end="")
        return 1 if opens else 0
    for line in _summary(look):
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


def _look(paths: list[Path], args: argparse.Namespace) -> tuple[Look, list[str]]:
    """Return what was seen, and what is open."""
    from dzdesign.identify.column_labels import parse_columns
    from dzdesign.identify.first_look import guess_columns, is_per_cent, look_at_sides, pressure_in_name, proposed_u_max

    given = parse_columns(args.columns) if args.columns else {}
    guesses = [guess_columns(path) for path in with_bar(paths, "looking at columns")]
    columns = dict(given)
    opens = []
    for guess in guesses:
        for quantity, label in guess.chosen.items():
            if columns.setdefault(quantity, label) != label and quantity not in given:
                opens.append(f"column of {quantity}: '{columns[quantity]}' in one file, '{label}' in another")
    for quantity in ("time", "u", "Q"):
        reason = next((guess.unclear[quantity] for guess in guesses if quantity in guess.unclear), None)
        if reason and quantity not in given:
            opens.append(f"column of {quantity}: {reason}")
    nothing = Look(paths=paths, guesses=guesses, columns=columns, dp={}, sides={}, refused={})
    if opens:
        return nothing, list(dict.fromkeys(opens))
    names = [path.as_posix() for path in paths]
    tests = read_recordings(names, u_max=10.0, columns=columns or None, dp=args.dp)
    dp: dict[str, str] = args.dp if isinstance(args.dp, dict) else {}
    lacking = [test.source for test in tests if test.dp is None]
    if lacking:
        dp = {source: text for source in lacking if (text := pressure_in_name(source))}
        if len(dp) == len(lacking) and len(tests) > 1:
            tests = read_recordings(names, u_max=10.0, columns=columns or None, dp=dp)
        elif len(tests) > 1:
            unsaid = [source for source in lacking if source not in dp]
            opens = [f"pressure drop of '{source}': no column, and none in its name" for source in unsaid]
    u_max, u_seen = proposed_u_max(tests)
    if any(is_per_cent(guess.understood.get("u")) for guess in guesses):
        u_max, u_seen = 10.0, None
    sides, refused = {}, {}
    if not opens:
        with stages() as stage:
            stage(f"looking at {len(tests)} recording{'s' if len(tests) > 1 else ''}")
            sides, refused = look_at_sides(tests, u_max)
    if not sides and not opens:
        opens = [f"identify would refuse these recordings: {next(iter(refused.values()))}"]
    return (
        Look(
            paths=paths, guesses=guesses, columns=columns, dp=dp, u_max=u_max, u_seen=u_seen, sides=sides,
            refused=refused,
        ),
        opens,
    )  # fmt: skip


def _summary(look: Look) -> list[str]:
    """Return what was seen, for a person."""
    lines = [f"recordings: {len(look.paths)}, columns {', '.join(look.guesses[0].labels[:12])}"]
    if look.u_seen is not None:
        lines.append(f"largest command: {look.u_seen:.2f} V")
    return lines + [_said(name, side) for name, side in look.sides.items()] + _refusals(look)


def _refusals(look: Look) -> list[str]:
    return [f"{name} commands would be refused: {reason}" for name, reason in look.refused.items()]


def _said(name: str, side: "SeenSide") -> str:
    pressures = ", ".join("unknown" if dp is None else f"{dp:.3g}" for dp in side.dp_MPa)
    rate = "" if side.rate_V_s is None else f", at most {side.rate_V_s:.3g} V/s"
    floor = f"the meter starts at {side.floor_L_min:.2f} L/min" if side.floor_L_min else "the meter has no floor"
    return (
        f"{name} commands: {side.ramps} ramp{'s' if side.ramps > 1 else ''} at {pressures} MPa{rate}, "
        f"up to {side.q_max_L_min:.3g} L/min; {floor}"
    )


def _toml(look: Look, opens: list[str]) -> str:
    """Return the file: what identify is told, and as comments what it finds or takes by itself, with the reason."""
    lines = [
        "# Options of dzdesign, made by `dzdesign init` from a look at the recordings; one file for all commands:",
        "#   dzdesign identify RAMP... --config dzdesign.toml",
        "# What the command line says goes before what stands here. A line that begins with # says nothing.",
        "#",
        *(f"# {line}" for line in _summary(look)),
        *(f"# OPEN: {line}" for line in opens),
        "",
        *_command_lines(look),
        "",
        *_meter_lines(look),
        "",
        "# Reference pressure drop (default: the test nearest to 1 MPa).",
        '# dp0 = "1 MPa"',
        "# Stroke of the spool: gives k in V/mm; the recordings can't tell it.",
        '# x-max = "1.8 mm"',
        "# Of all lower bounds together.",
        "# confidence = 0.99",
        "# Processor, and the threshold that the certificate protects (closing, mean or opening).",
        '# target = "f28335"',
        '# guard = "closing"',
        "",
        *_column_lines(look, opens),
        *_dp_lines(look, opens),
        *RECORD_LINES,
    ]
    return "\n".join(one_line(line) for line in lines).rstrip() + "\n"


def _command_lines(look: Look) -> list[str]:
    value = f'u-max = "{look.u_max:g} V"'
    if look.u_seen is None:
        return ["# Full command; not seen (the command is in per cent, or was not read), so correct it.", value]
    if look.u_seen < 0.97 * look.u_max:
        return [f"# Full command: a guess, for the ramps end at {look.u_seen:.2f} V. Correct it if it is wrong.", value]
    return [f"# Full command: the ramps end at {look.u_seen:.2f} V.", value]


def _meter_lines(look: Look) -> list[str]:
    sides = list(look.sides.values())
    floor = max((side.floor_L_min for side in sides), default=None)
    found = "" if not floor else f"; identify finds {floor:.2f} L/min in the recordings"
    lines = [
        f"# Flow below which the meter reads zero{found}.",
        "# Declare the data sheet's, where that is larger.",
        f'# meter-floor = "{floor or 0.6:.2f} L/min"',
    ]
    if any(side.lag_is == "identified" for side in sides):
        lag = next(side.lag_s for side in sides if side.lag_is == "identified")
        lines += [
            f"# Lag of the meter: identify finds {lag:.3g} s, from ramps of two rates. Declared, it is taken as exact.",
            f'# meter-lag = "{lag:.3g} s"',
        ]
    else:
        rate = max((side.rate_V_s or 0.1 for side in sides), default=0.1)
        lines += [
            "# Lag of the meter: the recordings can't tell it (it takes ramps of two rates); see the data sheet. At",
            f"# {rate:.3g} V/s each 0.1 s of it moves the opening knee up, the closing knee down, {100 * rate:.3g} mV.",
            '# meter-lag = "0.1 s"',
        ]
    zeros = [abs(zero) for side in sides for zero in side.zero_L_min.values()]
    seen = f"; at rest it reads up to {max(zeros):.2g} L/min, which identify takes off" if zeros else ""
    return [*lines, f"# Bound of the meter's zero error beyond what shows at rest{seen}.", '# meter-zero = "0 L/min"']


def _column_lines(look: Look, opens: list[str]) -> list[str]:
    lines = ["# Which column is which quantity; after a colon the unit that a label lacks."]
    first = look.guesses[0]
    lines += [f"# Labels in '{look.paths[0].name}': {', '.join(first.labels[:40])}"]
    lines += [
        f"# {quantity} = {_quoted(column.label)}  (in {column.unit}; understood by its label)"
        for quantity, column in first.understood.items()
        if quantity not in look.columns
    ]
    open_ones = {name: why for guess in look.guesses for name, why in guess.unclear.items() if name not in look.columns}
    for quantity, why in open_ones.items():
        lines += [f"# {quantity} = ?  ({why})"]
    body = [f"{quantity} = {_quoted(label)}" for quantity, label in look.columns.items()]
    if body:
        lines += ["# Each is the only column that is left in a unit of its quantity, or as you said."]
        lines += ["[columns]", *body]
    elif opens and open_ones:
        lines += ["# [columns]", *(f'# {name} = "LABEL:UNIT"' for name in open_ones)]
    return [*lines, ""]


def _dp_lines(look: Look, opens: list[str]) -> list[str]:
    lines = []
    if look.dp:
        lines = ["# Pressure drop of recordings without a column of it, as their names (or you) say.", "[dp]"]
        lines += [f"{_quoted(name)} = {_quoted(text)}" for name, text in look.dp.items()]
    missing = [line.split("'")[1] for line in opens if line.startswith("pressure drop of")]
    if missing and not look.dp:
        lines = ["# Pressure drop of recordings without a column of it.", "# [dp]"]
    lines += [f'# {_quoted(name)} = "1 MPa"' for name in missing]
    return [*lines, ""] if lines else []


def _quoted(text: str) -> str:
    """Return a string of TOML: as in JSON, and without DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


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
