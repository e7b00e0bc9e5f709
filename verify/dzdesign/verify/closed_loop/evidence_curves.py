"""The numbers behind the report's figures: arrays of the evidence, stored as CSV files, one set a side of the valve."""

from collections.abc import Mapping, Sequence

import numpy as np

from dzdesign.verify.closed_loop.dead_zone import LoopComparison

#: Columns of one figure, (N,) each and rounded as they are stored, so that they are the same read back.
Curves = Mapping[str, np.ndarray]
#: Every so many records are kept, 0.2 s of the paper's ramp, 0.2 % of the command: finer than a printed line is wide.
KEPT_RECORD = 20
#: Decimals of a flow, L/min: the plant is no better known.
FLOW_DIGITS = 3


#: Names of the files of a side, ``positive`` or ``negative``: ramps, compare values, drive at zero command.
closed_loop_name, input_map_name, zero_command_name = (
    f"{what}_{{}}.csv".format for what in ("closed_loop", "input_map", "zero_command")
)


def loop_curves(loops: Sequence[LoopComparison]) -> dict[str, Curves]:
    """Return the ramps of each side by the file's name: a record a row, two columns of flow a pressure drop."""
    files: dict[str, Curves] = {}
    for side in dict.fromkeys(loop.result.side for loop in loops):
        of_side = [loop for loop in loops if loop.result.side == side]
        kept, first = slice(None, None, KEPT_RECORD), of_side[0].direct
        columns = {"time_s": first.time[kept].round(2), "command_percent": (100 * first.command[kept]).round(3)}
        for loop in of_side:
            for which, run in (("without", loop.direct), ("with", loop.compensated)):
                name = f"q_{which}_{loop.result.dp_MPa:.4f}_MPa_L_min"
                columns[name] = np.maximum(run.q_mean_L_min[kept].round(FLOW_DIGITS), 0.0)
        files[closed_loop_name(side)] = columns
    return files


def csv_of(curves: Curves) -> str:
    """Return columns as CSV; what is rounded to a few decimals needs no more digits to be the same read back."""
    rows = np.column_stack([*curves.values()]).tolist()
    return "\n".join([",".join(curves), *(",".join(f"{cell:.12g}" for cell in row) for row in rows)]) + "\n"


def read_curves(text: str) -> Curves:
    """Read one of these files back; what is not a table of numbers is a `ValueError`."""
    lines = text.splitlines()
    header = lines[0].split(",") if lines else []
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    if table.ndim != 2 or table.shape[1] != len(header) or not np.isfinite(table).all():
        raise ValueError(f"expected rows of {len(header)} numbers")
    return dict(zip(header, table.T, strict=True))
