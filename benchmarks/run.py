"""All benchmarks, one after another, and one Markdown table of every limit: ``run.py [--quick] [-o FILE]``.

Each runs in a process of its own, with its own tables; a benchmark that ends without rows is named in the table.
Exit status 1 if a limit is missed or a benchmark failed.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from scoreboard import Row, kept_rows, markdown, say

FOLDER = Path(__file__).parent
#: Benchmark to whether it can be had `--quick`.
BENCHMARKS = {"identify": True, "isr": False, "verify": True, "outputs": True, "paper": True, "blocks": True}
NO_ROWS = "ended without rows"


def rows_of(name: str, quick: bool, folder: Path) -> list[Row]:
    """Run one benchmark and return its rows; one that misses in their place if there are none."""
    file = folder / f"{name}.json"
    options = ["--quick"] if quick and BENCHMARKS[name] else []
    say(f"benchmark {name}")
    done = subprocess.run([sys.executable, FOLDER / name / "run.py", *options, "--rows", file], check=False)
    return kept_rows(file) or [Row(what=NO_ROWS, value=float(done.returncode), limit=-1.0, note="exit status")]


def table(rows: dict[str, list[Row]]) -> str:
    """Return the rows that have a limit as a Markdown table."""
    cells = [
        (name, row.what, f"{row.value:.4g} {row.unit}".strip(), f"{row.limit:g}", row.verdict, row.note)
        for name, some in rows.items()
        for row in some
        if row.limit is not None
    ]
    return markdown(("benchmark", "goal", "measured", "limit", "", "note"), cells)


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmarks asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="less of each: minutes in place of hours")
    parser.add_argument("--only", choices=BENCHMARKS, action="append", help="one benchmark; may be given again")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="also write the table there")
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        rows = {name: rows_of(name, chosen.quick, Path(folder)) for name in chosen.only or BENCHMARKS}
    text = table(rows)
    print(text)
    if chosen.output:
        chosen.output.write_text(text + "\n", encoding="utf-8")
    return 1 if any(row.verdict == "MISSES" for some in rows.values() for row in some) else 0


if __name__ == "__main__":
    raise SystemExit(main())
