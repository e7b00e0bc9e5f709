"""What the compiled core gives over its range of inputs: a coarse grid to draw, and every code at zero command.

The check of all inputs (`all_inputs`) counts; this shows. The grid is denser where the valve was tested.
"""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences, differences
from dzdesign.verify.exhaustive.zero_command import bounds_at, counted_dither, guarded_bounds, pressure_drops
from dzdesign.verify.loop_results import Side
from dzdesign.verify.toolchain.compiled_core import core_answers

#: Columns of the grid over the converter's codes; rows over all differences, and over the tested ones.
COMMANDS, WIDE_ROWS, TESTED_ROWS = 46, 36, 54
#: The denser rows reach so far beyond the tested interval, as a share of its width.
BEYOND = 0.15


@dataclass(frozen=True, slots=True, kw_only=True)
class InputMap:
    """What one side gives on a grid of command codes and differences of pressure codes, and at zero command."""

    side: Side
    #: Command code, difference of pressure codes, compare value, its error in counts, and status word; along the
    #: commands first. Of a command that is not sound the law says nothing, and there is not an error.
    grid: tuple[tuple[int, int, int, int, int], ...]
    #: At every difference of the tested interval: its code, pressure drop in MPa, drive at zero command in V (with a
    #: dither that the recordings lack its peak), and the lower bound of the threshold in V.
    zero_command: tuple[tuple[int, float, float, float], ...]


def map_inputs(folder: Path, compensator: Compensator, sign: int = 1) -> InputMap:
    """Call one side of the compiled core over the grid."""
    exact = ExactLaw(compensator, sign)
    found = differences(exact)
    bounds = guarded_bounds(compensator, sign)
    known_V = bounds_at(pressure_drops(exact, found, (Fraction(repr(dp)) for dp in bounds.dp_MPa)), bounds)
    tested = np.flatnonzero(~np.isnan(known_V))
    commands, rows, grid = _commands(exact), _grid_rows(found, tested).tolist(), []
    drawn = [(code, *_pair(exact, found, row)) for row in rows for code in commands]
    resting = [(exact.zero, *_pair(exact, found, row)) for row in tested.tolist()]
    answers = core_answers(folder, sign, np.array([*drawn, *resting])).tolist()
    for place, row in enumerate(rows):
        dp_code = int(found.values[row])
        corners, begin = exact.corners(exact.betas(dp_code)), place * len(commands)
        for code, (given, status) in zip(commands, answers[begin : begin + len(commands)], strict=True):
            error = given - exact.compare_value(code, corners) if code in exact.sound_commands else 0
            grid.append((code, dp_code, given, error, status))
    a_MPa = float(exact.a.span_MPa) / (exact.a.full_code - exact.a.zero_code)
    volt = float(compensator.u_max_V) / exact.compare_max
    peak = counted_dither(compensator)
    return InputMap(
        side=exact.side,
        grid=tuple(grid),
        zero_command=tuple(
            (
                int(found.values[row]),
                float(found.values[row]) * a_MPa,
                (given + peak) * volt,
                float(known_V[row]),
            )
            for row, (given, _) in zip(tested.tolist(), answers[len(drawn) :], strict=True)
        ),
    )


def _commands(exact: ExactLaw) -> list[int]:
    """Return codes over the converter's range, zero and full command among them."""
    spread = np.linspace(0, exact.code_max, COMMANDS).round().astype(int).tolist()
    return sorted({*spread, exact.zero, exact.full})


def _grid_rows(found: Differences, tested: np.ndarray) -> np.ndarray:
    """Return places of differences that sound codes make: over all of them, and closer over the tested ones."""
    made = np.flatnonzero(found.made)
    wide = made[np.linspace(0, made.size - 1, WIDE_ROWS).round().astype(int)]
    if tested.size == 0:
        return np.unique(wide)
    room = BEYOND * (tested[-1] - tested[0] + 1)
    close = np.linspace(tested[0] - room, tested[-1] + room, TESTED_ROWS).round().astype(int)
    near = found.values[np.clip(close, made[0], made[-1])] - found.values[0]
    return np.unique([*wide, *(row for row in near if found.made[row])])


def _pair(exact: ExactLaw, found: Differences, row: int) -> tuple[int, int]:
    """Return a pair of sound pressure codes that makes a difference."""
    b = int(found.b_first[row])
    return int(exact.turn * found.values[row] + found.slant[b]), b
