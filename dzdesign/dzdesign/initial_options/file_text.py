"""The text of the dzdesign.toml that `dzdesign init` writes: every line with its reason, as a comment above it."""

import json
from typing import TYPE_CHECKING

from dzdesign.core.errors import one_line
from dzdesign.core.units import SPELLINGS

if TYPE_CHECKING:
    from dzdesign.identify.reading.guessed_columns import GuessedColumns
    from dzdesign.initial_options.look import Look

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
#: Said where a pressure was taken for the drop because of its unit alone.
CHECK_DP = "check that it is the drop over the valve, and not the pressure of one port or of the supply"


def options_file(look: "Look", summary: list[str], opens: list[str]) -> str:
    """Return the file: what identify is told, and as comments what it finds or takes by itself, with the reason."""
    lines = [
        "# Options of dzdesign, made by `dzdesign init` from a look at the recordings; one file for all commands:",
        "#   dzdesign identify RAMP... --config dzdesign.toml",
        "# What the command line says goes before what stands here. A line that begins with # says nothing.",
        "#",
        *(f"# {line}" for line in summary),
        *(f"# OPEN: {line}" for line in opens),
        "",
        *_command_lines(look),
        "",
        *_skip_lines(look),
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


def _command_lines(look: "Look") -> list[str]:
    value = f'u-max = "{look.u_max:g} V"'
    if look.in_per_cent:
        return ["# Full command, what 100 % means: recordings in per cent don't say it. A guess: correct it.", value]
    if look.u_seen is None:
        return ["# Full command: not looked at, as something is open. A guess: correct it.", value]
    if look.u_seen < 0.97 * look.u_max:
        return [f"# Full command: a guess, for the ramps end at {look.u_seen:.2f} V. Correct it if it is wrong.", value]
    return [f"# Full command: the ramps end at {look.u_seen:.2f} V.", value]


def _skip_lines(look: "Look") -> list[str]:
    if look.skip_rows is None:
        return []
    note = "# Rows above the header of a file of text; without this line it is found."
    return [note, f"skip-rows = {look.skip_rows}", ""]


def _meter_lines(look: "Look") -> list[str]:
    sides = list(look.sides.values())
    floor = max((side.floor_L_min for side in sides), default=None)
    found = f"identify finds {floor:.2f} L/min" if floor else "none is seen, 0.60 L/min is an example"
    lines = [
        f"# The meter's floor, the flow below which it reads zero: {found if sides else 'not looked at'}.",
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


def _column_lines(look: "Look", opens: list[str]) -> list[str]:
    lines = ["# Which column is which quantity; after a colon the unit that a label lacks."]
    first = look.guesses[0]
    lines += [f"# Labels in '{look.paths[0].name}': {', '.join(first.labels[:40])}"]
    lines += [
        f"# {quantity} = {_quoted(column.label)}  (in {_shown(column.unit)}; understood by its label)"
        for quantity, column in first.understood.items()
        if quantity not in look.columns
    ]
    open_ones = {name: why for guess in look.guesses for name, why in guess.unclear.items() if name not in look.columns}
    for quantity, why in open_ones.items():
        lines += [f"# {quantity} = ?  ({why})"]
    body = [f"{quantity} = {_quoted(label)}" for quantity, label in look.columns.items()]
    if body:
        lines += ["# Each is the only column that is left in a unit of its quantity, or as you said."]
        if "dP" in look.columns and any("dP" in guess.chosen for guess in look.guesses):
            lines += [f"# dP: {CHECK_DP}."]
        lines += ["[columns]", *body]
    templates = [f'# {name} = "LABEL:UNIT"' for name in open_ones] if opens else []
    known = look.columns.keys() | first.understood.keys()
    if not look.dp and "dP" not in known and not {"pA", "pB"} <= known:
        templates += [*(() if "dP" in open_ones else ('# dP = "LABEL:UNIT"',)), *_port_lines(first)]
    if templates:
        lines += [*(() if body else ("# [columns]",)), *templates]
    return [*lines, ""]


def _port_lines(guess: "GuessedColumns") -> list[str]:
    """Return how sensors on both sides of the valve's edge are declared, with their labels where two can be they."""
    known = [f"{label}:bar" for label in guess.bare_pressures] or list(guess.pressures)
    labels = [_quoted(label) for label in known] if len(known) == 2 else ['"LABEL:UNIT"'] * 2
    return [
        "# or, of a sensor on either side, pA of the higher pressure, in place of dP:",
        *(f"# {port} = {label}" for port, label in zip(("pA", "pB"), labels, strict=True)),
    ]


def _shown(unit: str) -> str:
    """Return a unit as it is written: labels without a slash say Lmin."""
    return "L/min" if SPELLINGS.get(unit.lower()) == "L/min" else unit


def _dp_lines(look: "Look", opens: list[str]) -> list[str]:
    """Return the pressures of files' names, and of those that are open a line to fill in, or one for each reading."""
    from dzdesign.identify.reading.named_pressure import pressures_in_name

    lines = []
    if look.dp:
        lines = ["# Pressure drop of recordings without a column of it, as their names (or you) say.", "[dp]"]
        lines += [f"{_quoted(name)} = {_quoted(text)}" for name, text in look.dp.items()]
    missing = [line.split("'")[1] for line in opens if line.startswith("pressure drop of")]
    if missing and not look.dp:
        lines = ["# Pressure drop of recordings without a column of it.", "# [dp]"]
    # Of a name with two readings a line for each, the right one to be kept.
    readings = [(name, text) for name in missing for text in pressures_in_name(name) or ("1 MPa",)]
    lines += [f"# {_quoted(name)} = {_quoted(text)}" for name, text in readings]
    return [*lines, ""] if lines else []


def _quoted(text: str) -> str:
    """Return a string of TOML: as in JSON, and without DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
