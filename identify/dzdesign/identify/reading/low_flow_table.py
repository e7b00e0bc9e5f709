"""A table of flows that were measured by hand below the meter's floor: with a measuring glass, or a cylinder's drift.

A row is one reading at rest: the command, the pressure drop over the metering edge, the flow with its largest error,
and the branch on which the command was reached: after closing a spool with play stands elsewhere than after opening.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dzdesign.core.artefact_files import open_bytes, sha256_of_file
from dzdesign.core.errors import InputError, quoted
from dzdesign.identify.constants import L_MIN, LARGEST_DP, MPA, SMALLEST_DP
from dzdesign.identify.reading.column_labels import Column, split_label
from dzdesign.identify.reading.scaling import scaling_of
from dzdesign.identify.reading.text_file import read_text
from dzdesign.identify.valve.low_flow import Branch, LowFlow

#: Rows and columns that no table made by hand exceeds, and characters of a cell that a message quotes.
MOST_ROWS, MOST_COLUMNS, QUOTED = 1000, 100, 40
#: The columns, as they are best named.
EXAMPLE = "u_V,dP_MPa,Q [mL/min],Q_error [mL/min],branch"
#: Words for the branch on which a command was reached.
BRANCHES: dict[str, Branch] = {"rising": "rising", "opening": "rising", "falling": "falling", "closing": "falling"}
#: A command may exceed full command by the rounding of a display.
ABOVE_FULL = 1.001


@dataclass(frozen=True, slots=True, kw_only=True)
class LowFlowTable:
    """The readings of one file; those of negative commands have a negative command."""

    source: str
    sha256: str
    rows: tuple[LowFlow, ...]


def readings_of_side(tables: Sequence[LowFlowTable], sign: int) -> tuple[LowFlow, ...]:
    """Return the readings of one side (1, -1), their commands counted from zero."""
    rows = [row for table in tables for row in table.rows if (row.u_V < 0) == (sign < 0)]
    return tuple(replace(row, u_V=abs(row.u_V)) for row in rows)


def read_low_flow(path: Path, u_max: float, name: str = "") -> LowFlowTable:
    """Read a table of low flows: CSV with commas, semicolons or tabs, `#` before comments.

    Parameters
    ----------
    path : Path
        The file.
    u_max : float
        Command in V that 100 % means, and that none exceeds.
    name : str, optional
        Of the table, where it is not the file's.

    Raises
    ------
    InputError
        If it is no such table; with its row and column where one cell is wrong.
    """
    with open_bytes(path, "low-flow table") as file:
        digest = sha256_of_file(file)
        lines = read_text(file, path).decode().split("\n")
    kept = [(number, line) for number, line in enumerate(lines, start=1) if line.strip(' \t,;"')]
    kept = [(number, line) for number, line in kept if not line.lstrip(' \t"').startswith("#")]
    if not kept:
        raise InputError(f"'{path}' is empty, expected a table of low flows with a header such as {EXAMPLE}")
    separator = next((mark for mark in ";\t," if mark in kept[0][1]), ",")
    width = kept[0][1].count(separator) + 1
    if width > MOST_COLUMNS:
        raise InputError(f"'{path}' has {width} columns, expected at most {MOST_COLUMNS}, such as {EXAMPLE}")
    columns = _columns(path, [cell.strip(' \t"') for cell in kept[0][1].split(separator)])
    if not 1 < len(kept) <= MOST_ROWS + 1:
        raise InputError(f"'{path}' has {len(kept) - 1} rows, expected 1 to {MOST_ROWS} of flows measured one by one")
    source = name or path.name.encode(errors="replace").decode()
    typed = []
    for number, line in kept[1:]:
        if (found := line.count(separator) + 1) != width:
            raise InputError(f"'{path}' row {number} has {found} cells, expected {width} as its header")
        cells = [cell.strip(' \t"') for cell in line.split(separator)]
        typed.append(_Row(path, number, cells, columns, u_max))
    _refuse_two_marks(typed)
    rows = [row.reading(source) for row in typed]
    _refuse_two_signs(typed)
    _refuse_repeated(path, rows)
    return LowFlowTable(source=source, sha256=digest, rows=tuple(rows))


def _columns(path: Path, labels: list[str]) -> dict[str, tuple[int, Column]]:
    """Return quantity -> place and column."""
    found: dict[str, tuple[int, Column]] = {}
    for place, label in enumerate(labels):
        lower, name, unit = label.lower(), None, ""
        if "error" in lower:
            at = lower.index("error")
            quantity, unit = split_label((label[:at].rstrip(" _") + label[at + len("error") :]).strip())
            name = "error" if quantity == "Q" else None
        elif lower == "branch":
            name = "branch"
        else:
            name, unit = split_label(label)
        if name not in ("u", "dP", "Q", "error", "branch"):
            continue  # a column of remarks
        if name in found:
            raise InputError(f"'{path}' has two columns of {name}, '{labels[found[name][0]]}' and '{label}'; keep one")
        found[name] = place, Column(label=label, unit=unit)
    for name, why in (
        ("u", "the command"),
        ("dP", "the pressure drop over the metering edge during the reading"),
        ("Q", "the flow"),
        ("error", "the largest error of the flow from volume, time and, with a cylinder, its leakage"),
        ("branch", "which states whether the command was reached while opening or closing"),
    ):
        if name not in found:
            raise InputError(
                f"'{path}' has no column of {name}, {why} (columns found: {', '.join(labels)[:200]}); expected "
                f"{EXAMPLE}"
            )
    return found


@dataclass(frozen=True, slots=True)
class _Row:
    """One row of a table, read cell by cell."""

    path: Path
    number: int
    cells: list[str]
    columns: dict[str, tuple[int, Column]]
    u_max: float

    def reading(self, source: str) -> LowFlow:
        """Return the reading, or refuse what no valve gives."""
        u, dp, q, error = (self.number_of(name) for name in ("u", "dP", "Q", "error"))
        branch = self.cells[self.columns["branch"][0]].lower()
        if branch not in BRANCHES:
            raise self.wrong("branch", "expected opening or closing, the direction in which the command was reached")
        if abs(u) > ABOVE_FULL * self.u_max:
            raise self.wrong("u", f"expected at most full command, {self.u_max:g} V; give --u-max, or correct it")
        if not SMALLEST_DP <= dp <= LARGEST_DP:
            raise self.wrong(
                "dP",
                f"expected {SMALLEST_DP / MPA:g} to {LARGEST_DP / MPA:g} MPa: without a pressure drop nothing flows "
                "through any edge",
            )
        if not error > 0:
            raise self.wrong("error", "expected more than zero; give the largest error from volume, time and leakage")
        if u < 0:
            q = abs(q)  # counted from zero down, as a cylinder that moves the other way
        if q < -error:
            raise self.wrong("Q", "expected a flow in the direction of the command; leave out readings against it")
        return LowFlow(
            source=f"{source}, row {self.number}", branch=BRANCHES[branch], u_V=u, dp_MPa=dp / MPA,
            q_L_min=max(q, 0.0) / L_MIN, q_error_L_min=error / L_MIN,
        )  # fmt: skip

    def marks(self, name: str) -> set[str]:
        """Return the decimal marks in a cell."""
        return {".", ","} & set(self.cells[self.columns[name][0]])

    def number_of(self, name: str) -> float:
        """Return a cell's number in SI units and V, or refuse what is none."""
        place, column = self.columns[name]
        quantity = "Q" if name == "error" else name
        text = self.cells[place].replace("\u2212", "-")
        if text.count(",") == 1 and "." not in text:
            text = text.replace(",", ".")  # in a table whose cells no comma parts
        try:
            value = float(text)
        except ValueError as error:
            raise self.wrong(name, "expected a number") from error
        scaling = scaling_of(self.path, quantity, column, self.u_max)
        scaled = value * scaling.gain + scaling.offset
        if not math.isfinite(scaled) or abs(scaled) > LARGEST_DP:
            raise self.wrong(name, "expected a plausible value for a valve")
        return scaled

    def wrong(self, name: str, expected: str) -> InputError:
        """Return the refusal of a cell."""
        place, column = self.columns[name]
        cell = self.cells[place][:QUOTED]
        return InputError(f"'{self.path}' row {self.number}, column '{column.label}': {quoted(cell)}, {expected}")


def _refuse_two_marks(rows: Sequence[_Row]) -> None:
    """Refuse a point in one number and a comma in another: of 1,200 nobody can tell a thousand and more from one."""
    known: set[str] = set()
    for row in rows:
        for name in ("u", "dP", "Q", "error"):
            known |= row.marks(name)
            if len(known) > 1:
                raise row.wrong(name, "expected one decimal mark in the whole table, and no thousands separator")


def _refuse_two_signs(rows: Sequence[_Row]) -> None:
    """Refuse flows of both signs, beyond their errors, at negative commands: some would go against the command."""
    signs: set[bool] = set()
    for row in rows:
        flow = row.number_of("Q")
        if row.number_of("u") < 0 and abs(flow) > row.number_of("error"):
            signs.add(flow > 0)
        if len(signs) > 1:
            raise row.wrong("Q", "expected flows of one sign at all negative commands; correct or leave out the others")


def _refuse_repeated(path: Path, rows: Sequence[LowFlow]) -> None:
    """Refuse a reading that stands there twice: as two they would seem to agree."""
    known: dict[tuple[object, ...], LowFlow] = {}
    for row in rows:
        other = known.setdefault((row.u_V, row.dp_MPa, row.q_L_min, row.q_error_L_min, row.branch), row)
        if other is not row:
            raise InputError(f"'{path}': {row.source} repeats {other.source} in every cell; give each reading once")
