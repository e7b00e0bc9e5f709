"""7. What a long recording costs: memory and time of identifying 1.2 and 12 million rows of one file.

Every measurement is a process of its own, and so is the making of the files: what a process has taken at its height is
told at its end, and that of the one which started it counts too.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scoreboard import Row, environment, print_rows, say

#: Rows made at a time, and rows of the two files.
PART = 400_000
ROWS, QUICK = (1_200_000, 12_000_000), (600_000, 2_400_000)
FORMATS = ("csv", "csv.gz", "parquet", "feather", "h5", "tdms")
QUICK_FORMATS = ("csv", "h5")
#: Memory that the longer file may take, MB.
MOST_MEMORY = 2048
#: Bytes a row, roughly, of all formats.
ROW_BYTES = 40
KNEES = (5.4, 5.3)
MB = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What a process took: memory at its height (bytes), time of all cores (s), and what it printed."""

    memory: int
    seconds: float
    output: str


def columns_of(rows: int, seed: int):
    """Yield the columns of one slow ramp up and down, part by part."""
    noise, half = np.random.default_rng(seed), rows // 2
    for start in range(0, rows, PART):
        row = np.arange(start, min(start + PART, rows))
        rising = row < half
        u = np.where(rising, row, 2 * half - 1 - row) * (10 / half)
        flow = np.clip(4 * (u - np.where(rising, *KNEES)), 0, None) + 0.08 * noise.standard_normal(row.size)
        dp = 1 + 0.002 * noise.standard_normal(row.size)
        yield {"time_s": row * (200 / rows), "u_V": u, "dP_MPa": dp, "Q_Lmin": flow}


def make(kind: str, rows: int, path: str, seed: int) -> None:
    """Write a recording; of Parquet and Feather all of it is in memory here."""
    import polars as pl

    parts = columns_of(rows, seed)
    if kind in ("parquet", "feather"):
        frame = pl.concat(pl.DataFrame(part) for part in parts)
        frame.write_parquet(path) if kind == "parquet" else frame.write_ipc(path)
    elif kind == "h5":
        import h5py

        with h5py.File(path, "w") as file:
            for part in parts:
                for name, data in part.items():
                    if name not in file:
                        file.create_dataset(name, (0,), "f8", maxshape=(None,), chunks=(1 << 16,))
                    file[name].resize(file[name].size + data.size, axis=0)
                    file[name][-data.size :] = data
    elif kind == "tdms":
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(path) as writer:
            for part in parts:
                writer.write_segment([ChannelObject("bench", name, data) for name, data in part.items()])
    else:
        import gzip

        with gzip.open(path, "wb", compresslevel=1) if kind == "csv.gz" else open(path, "wb") as file:
            for index, part in enumerate(parts):
                pl.DataFrame(part).write_csv(file, include_header=index == 0, float_precision=5)


def run_identify(path: str) -> None:
    """Identify one recording, and print its knees and their error."""
    from dzdesign.identify.identification import identify
    from dzdesign.identify.reading.ramp_files import read_ramp_file

    (test,) = identify([read_ramp_file(Path(path))]).positive.tests
    print(test.u_knee_rising_V, test.u_knee_falling_V, test.u_knee_se_V)


def scan(path: str) -> None:
    """Read every number of a CSV and do nothing with it but add it up."""
    import polars as pl

    print(pl.scan_csv(path).select(pl.all().sum()).collect(engine="streaming").row(0)[0])


def cost_of(*arguments: object) -> Cost:
    """Run this file with these arguments and return what that took."""
    command = [sys.executable, __file__, *map(str, arguments)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment())
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} failed")
    return Cost(memory=1024 * usage.ru_maxrss, seconds=usage.ru_utime + usage.ru_stime, output=output)


def print_reading(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 7."""
    few, many = QUICK if quick else ROWS
    with tempfile.TemporaryDirectory() as folder:
        if shutil.disk_usage(folder).free < 3 * ROW_BYTES * (few + many):
            print_rows("7. Long recordings", [rows := Row(what="no room on the disk for it", value=float("nan"))])
            return [rows]
        rows = []
        for kind in QUICK_FORMATS if quick else FORMATS:
            say(f"{kind}: {few} and {many} rows")
            rows += _rows_of(kind, few, many, seed, Path(folder))
    print_rows(f"7. Long recordings: {few} and {many} rows of one file, seconds of all cores", rows)
    return rows


def _rows_of(kind: str, few: int, many: int, seed: int, folder: Path) -> list[Row]:
    costs, path, scanned = [], folder / f"ramp.{kind}", None
    for count in (few, many):
        cost_of("make", kind, count, path, seed)
        costs.append(cost_of("identify", path))
        scanned = cost_of("scan", path) if kind == "csv" else None
        path.unlink()
    small, large = costs
    memory = f"{small.memory / MB:.0f} MB for the short file"
    *knees, error = map(float, large.output.split())
    away = max(abs(knee - true) for knee, true in zip(knees, KNEES, strict=True)) / error
    rows = [
        Row(what=f"{kind}: memory", value=large.memory / MB, unit="MB", limit=MOST_MEMORY, note=memory),
        Row(what=f"{kind}: knees off, in their errors", value=away, limit=4, note=f"error {1e3 * error:.3f} mV"),
        Row(what=f"{kind}: time", value=large.seconds, unit="s", note=f"{small.seconds:.1f} s of the short file"),
    ]
    if scanned:
        note = f"{scanned.seconds:.1f} s and {scanned.memory / MB:.0f} MB for a scan that adds every column up"
        rows.append(Row(what=f"{kind}: time over a scan's", value=large.seconds / scanned.seconds, note=note))
    return rows


if __name__ == "__main__":
    what, *given = sys.argv[1:]
    if what == "make":
        make(given[0], int(given[1]), given[2], int(given[3]))
    elif what == "identify":
        run_identify(*given)
    else:
        scan(*given)
