"""`--from` and `--to`: the part of each recording that is read."""

import fnmatch
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import Table
from dzdesign.core.units import parse_quantity

if TYPE_CHECKING:
    from dzdesign.identify.reading.ramp_test import RampTest


#: The command is at rest within this share of its range.
AT_REST = 0.1


def parts_of(tests: "Sequence[RampTest]", start: Table, end: Table) -> "list[RampTest]":
    """Return recordings without what lies before `start` and after `end`, which their records say.

    Raises
    ------
    InputError
        If a table names no recording, too few rows are left of one, or a ramp is cut: a knee would be laid through
        what is left of it.
    """
    for option, table in (("from", start), ("to", end)):
        for pattern in table if isinstance(table, Mapping) else ():
            if not any(_names(pattern, test.source) for test in tests):
                known = [test.source for test in tests]
                raise InputError(
                    f"[{option}] names '{pattern}', which is no recording here{nearest(pattern, known)}; correct the "
                    "name, or leave it out"
                )
    return [_part(test, _seconds(test.source, start, "from"), _seconds(test.source, end, "to")) for test in tests]


def _names(pattern: str, source: str) -> bool:
    """Tell whether a name or a pattern of a table is a recording's, with its folders or without."""
    names = source, source.rpartition("/")[2]
    return pattern in names or any(fnmatch.fnmatchcase(name, pattern) for name in names)


def _seconds(source: str, table: Table, option: str) -> float | None:
    """Return what an option, or its table, says of a recording, s; a name takes precedence over a pattern."""
    if table is None:
        return None
    if isinstance(table, str):
        return parse_quantity(table, "time", f"--{option}")
    patterns = [name for name in (source, source.rpartition("/")[2]) if name in table]
    patterns += [pattern for pattern in table if _names(pattern, source)]
    return parse_quantity(table[patterns[0]], "time", f"[{option}] '{patterns[0]}'") if patterns else None


def _part(test: "RampTest", start: float | None, end: float | None) -> "RampTest":
    import dataclasses

    import numpy as np

    from dzdesign.identify.ramps.sweep_pressure import stretches
    from dzdesign.identify.reading.ramp_files import MIN_ROWS

    if start is None and end is None:
        return test
    asked = " and ".join(f"--{name} {value:g} s" for name, value in (("from", start), ("to", end)) if value is not None)
    kept = np.ones(test.time.size, dtype=bool)
    if start is not None:
        kept &= test.time >= start
    if end is not None:
        kept &= test.time <= end
    if np.count_nonzero(kept) < MIN_ROWS:
        raise InputError(
            f"'{test.source}' runs from {test.time[0]:.1f} to {test.time[-1]:.1f} s: {asked} leaves "
            f"{np.count_nonzero(kept)} rows, expected at least {MIN_ROWS} of a ramp test; correct the seconds"
        )
    size, last = np.abs(test.u), test.time.size - 1
    rest = float(size.min()) + AT_REST * float(np.ptp(size))
    for row in (0, -1):
        place = int(np.flatnonzero(kept)[row])
        if place not in (0, last) and size[place] > rest:
            raise InputError(
                f"'{test.source}': {asked} cuts a ramp at {test.time[place]:.1f} s, where the command is not at rest; "
                "choose seconds before and after a whole ramp"
            )
    return dataclasses.replace(test.part(kept), left_out=tuple(stretches(test, np.flatnonzero(~kept), "option")))
