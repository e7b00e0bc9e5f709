"""The numbers behind the report's figures, as CSV files of the evidence folder: one set a side of the valve."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from dzdesign.verify.closed_loop.dead_zone import LoopComparison
from dzdesign.verify.exhaustive.input_map import InputMap

#: Every so many records are kept, 0.2 s of the paper's ramp, 0.2 % of the command: finer than a printed line is wide.
KEPT_RECORD = 20
#: Decimals of a flow, L/min: the plant is no better known.
FLOW_DIGITS = 3


#: Names of the files of a side, ``positive`` or ``negative``: ramps, compare values, drive at zero command.
closed_loop_name, input_map_name, zero_command_name = (
    f"{what}_{{}}.csv".format for what in ("closed_loop", "input_map", "zero_command")
)


def curve_files(loops: Sequence[LoopComparison], maps: Sequence[InputMap]) -> dict[str, str]:
    """Return the CSV files: name to content."""
    files = {}
    for side in dict.fromkeys(loop.result.side for loop in loops):
        files[closed_loop_name(side)] = _ramps([loop for loop in loops if loop.result.side == side])
    for one in maps:
        files[input_map_name(one.side)] = _csv(("command_code", "dp_code", "compare", "error", "status"), one.grid)
        files[zero_command_name(one.side)] = _csv(
            ("dp_code", "dp_MPa", "drive_V", "bound_V"),
            ((code, f"{dp:.4f}", f"{drive:.5f}", f"{bound:.5f}") for code, dp, drive, bound in one.zero_command),
        )
    return files


def _ramps(loops: Sequence[LoopComparison]) -> str:
    """Return the ramps of one side: one row per record, two columns of flow a pressure drop."""
    first = loops[0].direct
    kept = slice(None, None, KEPT_RECORD)
    columns: dict[str, Iterable[str]] = {
        "time_s": (f"{t:.2f}" for t in first.time[kept]),
        "command_percent": (f"{100 * share:.3f}" for share in first.command[kept]),
    }
    for loop in loops:
        name = f"{loop.result.dp_MPa:.4f}_MPa"
        for which, run in (("without", loop.direct), ("with", loop.compensated)):
            columns[f"q_{which}_{name}_L_min"] = _flows(run.q_mean_L_min[kept])
    return _csv(tuple(columns), zip(*columns.values(), strict=True))


def _flows(values: np.ndarray) -> list[str]:
    return [f"{value:.{FLOW_DIGITS}f}" if value >= 0.5 * 10**-FLOW_DIGITS else "0" for value in values.tolist()]


def _csv(header: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    return "\n".join([",".join(header), *(",".join(map(str, row)) for row in rows)]) + "\n"


def read_curves(text: str) -> Mapping[str, np.ndarray]:
    """Read one of these files back, column to numbers; what is not a table of numbers is a `ValueError`."""
    lines = text.splitlines()
    header = lines[0].split(",") if lines else []
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    if table.ndim != 2 or table.shape[1] != len(header) or not np.isfinite(table).all():
        raise ValueError(f"expected rows of {len(header)} numbers")
    return dict(zip(header, table.T, strict=True))
