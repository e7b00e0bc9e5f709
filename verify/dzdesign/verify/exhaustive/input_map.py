"""What the compiled core gives over its range of inputs: a coarse grid to draw, and every code at zero command.

The check of all inputs (`all_inputs`) counts; this shows. The grid is denser where the valve was tested.
"""

from fractions import Fraction
from pathlib import Path

import numpy as np

from dzdesign.verify.closed_loop.ramps import Curves, input_map_name, zero_command_name
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences, PreparedInputs
from dzdesign.verify.exhaustive.zero_command import bounds_at, counted_dither, guarded_bounds, pressure_drops
from dzdesign.verify.toolchain.compiled_core import core_answers

#: Columns of the grid over the converter's codes; rows over all differences, and over the tested ones.
COMMANDS, WIDE_ROWS, TESTED_ROWS = 46, 36, 54
#: The denser rows reach so far beyond the tested interval, as a share of its width.
BEYOND = 0.15


def map_inputs(folder: Path, prepared: PreparedInputs, at_zero: np.ndarray) -> dict[str, Curves]:
    """Return what one side of the compiled core gives, by the file's name.

    The grid: command code, difference of pressure codes, compare value, its error in counts, and status word. Of a
    command that is not sound the law says nothing, and there is not an error. At zero command, at every difference of
    the tested interval: its code, pressure drop, the drive with a dither's peak that the recordings lack, and the lower
    bound of the threshold. `at_zero` are the compare values that the check of all inputs found there.
    """
    exact, found = prepared.exact, prepared.differences
    compensator, bounds = exact.compensator, guarded_bounds(exact.compensator, exact.sign)
    known_V = bounds_at(pressure_drops(exact, found, (Fraction(repr(dp)) for dp in bounds.dp_MPa)), bounds)
    tested = np.flatnonzero(~np.isnan(known_V))
    commands, rows = _commands(exact), _grid_rows(found, tested).tolist()
    drawn = [(code, *_pair(exact, found, row)) for row in rows for code in commands]
    given, status = core_answers(folder, exact.sign, np.array(drawn)).astype(int).T
    expected = []
    for row in rows:
        corners = exact.corners(exact.betas(int(found.values[row])))
        expected += [exact.compare_value(code, corners) if code in exact.sound_commands else None for code in commands]
    errors = [0 if value is None else int(one) - value for one, value in zip(given, expected, strict=True)]
    a_MPa = float(exact.a.span_MPa) / (exact.a.full_code - exact.a.zero_code)
    volt = float(compensator.u_max_V) / exact.compare_max
    return {
        input_map_name(exact.side): {
            "command_code": np.tile(commands, len(rows)),
            "dp_code": np.repeat(found.values[rows], len(commands)),
            "compare": given,
            "error": np.array(errors),
            "status": status,
        },
        zero_command_name(exact.side): {
            "dp_code": found.values[tested],
            "dp_MPa": (found.values[tested] * a_MPa).round(4),
            "drive_V": ((at_zero[tested] + counted_dither(compensator)) * volt).round(5),
            "bound_V": known_V[tested].round(5),
        },
    }


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
