"""Folders of batches on paper: a table of so many valves and the batch.json that belongs to it, nothing calibrated."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from dzdesign.batch.summary import summary_of
from dzdesign.batch.valve_folders import Results
from dzdesign.core.documents import sha256_of
from dzdesign.report.lot.table import HASHED, SIDE_COLUMNS, Cell, column_of, frame_of, table_files

REASONS = (
    "'ramp_dP1.csv' row {place}, column 'u_V': 'overload' is not a number; correct it, or leave the cell blank",
    "valve '{name}' has no recording; expected files such as ramp_1MPa.csv",
)


def side_figures(rng: np.random.Generator) -> dict[str, Cell]:
    """Return the columns of one side of a valve that scatters about one design."""
    opening = rng.normal(5.45, 0.12)
    return {
        "dp0_MPa": 1.0,
        "knee_opening_V": round(opening, 7),
        "knee_closing_V": round(opening - 0.12 + rng.normal(0, 0.01), 7),
        "knee_se_V": 0.002,
        "bound_V": round(opening - 0.13, 7),
        "offset_V": round(opening - 0.21, 7),
        "trend": "decreasing",
        "highest_dp_MPa": 5.0,
        "beta_at_highest_dp": round(rng.normal(0.974, 0.004), 7),
        "k_x_max_over_u_max": round(rng.normal(0.459, 0.01), 7),
        "dead_zone_opening_percent": round(rng.normal(5.3, 0.7), 5),
        "dead_zone_closing_percent": round(rng.normal(2.8, 0.4), 5),
    }


def lot_rows(count: int, *, failed: Sequence[int] = (), bipolar: bool = False, seed: int = 3) -> list[dict[str, Cell]]:
    """Return a table: valves by number, some of which are not calibrated."""
    rows = []
    for number in range(count):
        rng, name = np.random.default_rng([seed, number]), f"V{number:04d}"
        bad = number in failed
        row: dict[str, Cell] = {
            "name": name,
            "status": "failed" if bad else "ok",
            "reason": REASONS[number % 2].format(name=name, place=number) if bad else "",
            "warnings": "" if bad else "no-saturation",
            "inputs_sha256": sha256_of(name.encode()),
        }
        for side in ("positive", "negative") if bipolar else ("",):
            row |= dict.fromkeys(column_of(side, column) for column in SIDE_COLUMNS)
            row = row if bad else with_figures(row, side, **side_figures(rng))
        rows.append(row if bad else row | {column: sha256_of(f"{name} {column}".encode()) for column in HASHED})
    return rows


def with_figures(row: Mapping[str, Cell], side: str = "", **figures: Cell) -> dict[str, Cell]:
    """Return a row with other numbers on one side."""
    return {**row, **{column_of(side, column): value for column, value in figures.items()}}


def write_lot_folder(folder: Path, rows: Sequence[Mapping[str, Cell]], *, verified: bool = False) -> Path:
    """Write the table and batch.json as a finished batch does; the folders of the valves are elsewhere."""
    results = Results(folder)
    frame = frame_of(rows)
    files = table_files(frame)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    summary = summary_of(
        frame, files=files, made_from={}, verified=verified, anomalies=(), lot_setting=None,
        why_no_lot_setting="made on paper",
    )  # fmt: skip
    results.write_summary(summary)
    (folder / "valves").rmdir()
    return folder
