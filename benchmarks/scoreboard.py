"""Rows of results with their limits, as tables."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter

WIDTH = 150


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One measured number: `limit` None where it stands for comparison only; it holds if value <= limit."""

    what: str
    value: float
    limit: float | None = None
    unit: str = ""
    note: str = ""

    @property
    def verdict(self) -> str:
        """Return holds, MISSES or nothing; a number that is not one misses."""
        if self.limit is None:
            return ""
        return "holds" if self.value <= self.limit else "MISSES"


def console():
    """Return the console of stdout."""
    from rich.console import Console

    return Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH)


def print_rows(title: str, rows: Iterable[Row]) -> None:
    """Print rows as one table."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold")
    for index, column in enumerate(("what", "measured", "limit", "", "note")):
        table.add_column(column, justify="right" if index in (1, 2) else "left", overflow="fold")
    for row in rows:
        limit = "" if row.limit is None else f"{row.limit:g} {row.unit}".strip()
        table.add_row(row.what, f"{row.value:.4g} {row.unit}".strip(), limit, row.verdict, row.note)
    console().print(table)


def markdown(headings: Sequence[str], cells: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table, its columns padded."""
    table = [list(headings), *map(list, cells)]
    widths = [max(len(row[column]) for row in table) for column in range(len(headings))]
    table.insert(1, ["-" * width for width in widths])
    lines = (" | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table)
    return "\n".join(f"| {line} |" for line in lines)


def keep_rows(rows: Iterable[Row], file: Path | None) -> None:
    """Write rows to a file from which `kept_rows` reads them, for the table of all benchmarks."""
    if file:
        file.write_text(json.dumps([asdict(row) for row in rows]), encoding="utf-8")


def kept_rows(file: Path) -> list[Row]:
    """Return the rows of a file that `keep_rows` wrote; none if there is no such file."""
    return [Row(**row) for row in json.loads(file.read_text(encoding="utf-8"))] if file.exists() else []


def markdown_rows(rows: Iterable[Row]) -> str:
    """Return rows as a Markdown table."""
    cells = []
    for row in rows:
        limit = "" if row.limit is None else f"{row.limit:g} {row.unit}".strip()
        cells.append((row.what, f"{row.value:.4g} {row.unit}".strip(), limit, row.verdict, row.note))
    return markdown(("goal", "measured", "limit", "verdict", "note"), cells)


def environment() -> dict[str, str]:
    """Return the environment in which a benchmark starts another of its files: with this one to be found."""
    return os.environ | {"PYTHONPATH": str(Path(__file__).parent)}


def say(text: str) -> None:
    """Tell progress, on stderr."""
    print(text, file=sys.stderr, flush=True)


def share_interval(failures: int, count: int) -> str:
    """Return the 95 % interval of a share in per cent (Clopper and Pearson)."""
    from scipy.special import betaincinv

    low = betaincinv(failures, count - failures + 1, 0.025) if failures else 0.0
    high = betaincinv(failures + 1, count - failures, 0.975) if failures < count else 1.0
    return f"{failures} of {count}, 95 % interval {100 * low:.2f}-{100 * high:.2f} %"


def run_parts(
    description: str, parts: Mapping[str, tuple[Callable[..., list[Row]], int]], quick: str, arguments: list[str] | None
) -> int:
    """Run the parts asked for on the command line, print what missed its limit, and return 1 if any did.

    A part is a function of ``quick`` and ``seed``, and its seed; `quick` is the help of the option of that name.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--only", choices=parts, action="append", help="one part; may be given again")
    parser.add_argument("--rows", type=Path, metavar="FILE", help="also write all rows there, as JSON")
    chosen = parser.parse_args(arguments)
    start = perf_counter()
    rows = []
    for name in chosen.only or parts:
        part, seed = parts[name]
        rows += part(quick=chosen.quick, seed=seed)
        sys.stdout.flush()
    keep_rows(rows, chosen.rows)
    missed = [row for row in rows if row.verdict == "MISSES"]
    if missed:
        print_rows(f"Missed: {len(missed)} of {sum(row.limit is not None for row in rows)} limits", missed)
    print(f"{perf_counter() - start:.0f} s")
    return 1 if missed else 0
