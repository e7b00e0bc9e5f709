"""Which part of each recording is read (`--from`, `--to`), and in which order they were taken (`--order`)."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import Paths, Table, paths_of
from dzdesign.core.units import parse_quantity
from dzdesign.stages.recordings import is_named, said_of

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
            if not any(is_named(pattern, test.source) for test in tests):
                known = [test.source for test in tests]
                raise InputError(
                    f"[{option}] names '{pattern}', which is no recording here{nearest(pattern, known)}; correct the "
                    "name, or leave it out"
                )
    return [_part(test, _seconds(test.source, start, "from"), _seconds(test.source, end, "to")) for test in tests]


def _seconds(source: str, table: Table, option: str) -> float | None:
    """Return what an option, or its table, says of a recording, s."""
    said = said_of(source, table, option)
    return parse_quantity(said[0], "time", said[1]) if said else None


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


def in_order(tests: "Sequence[RampTest]", order: Sequence[str]) -> "list[RampTest]":
    """Return recordings with the times at which they began, where an order of their names is stated."""
    from dzdesign.identify.reading.series import in_stated_order

    if not order:
        return list(tests)
    by_name = {test.source: test for test in tests}
    if sorted(order) != sorted(by_name):
        raise InputError("its option order does not name each recording once")
    stated = {test.source: test for test in in_stated_order([by_name[name] for name in order])}
    return [stated[test.source] for test in tests]


def stated_order(tests: "Sequence[RampTest]", paths: Sequence[Path], order: Paths | None) -> tuple[str, ...]:
    """Return the names of the recordings, read from `paths`, in the order that --order states; none without it.

    An item of the order is a recording, by its file name or path, or several with commas between them.

    Raises
    ------
    InputError
        If an item is not a recording's, or a recording is missing.
    """
    if order is None:
        return ()
    places = [place for item in paths_of(order) for place in _named(os.fspath(item), paths, tests)]
    twice = next((place for count, place in enumerate(places) if place in places[:count]), None)
    missing = next((place for place in range(len(tests)) if place not in places), None)
    if twice is not None:
        raise _wrong(f"names '{tests[twice].source}' twice")
    if missing is not None:
        raise _wrong(f"lacks '{tests[missing].source}'")
    return tuple(tests[place].source for place in places)


def _wrong(what: str) -> InputError:
    return InputError(f"--order {what}; expected each recording once, by its file name, in the order of taking")


def _named(item: str, paths: Sequence[Path], tests: "Sequence[RampTest]") -> list[int]:
    """Return the places of the recordings that an item names; a name may have commas in it."""
    pieces, found = item.split(","), []
    while pieces:
        for count in range(len(pieces), 0, -1):
            place = _place_of(",".join(pieces[:count]).strip(), paths, tests)
            if place is not None:
                break
        else:
            name = pieces[0].strip()
            suggestion = nearest(name, [test.source for test in tests])
            raise _wrong(f"names '{name}', but no such recording was given{suggestion}")
        found.append(place)
        pieces = pieces[count:]
    return found


def _place_of(name: str, paths: Sequence[Path], tests: "Sequence[RampTest]") -> int | None:
    """Return the place of the recording of that path, or whose path ends so; None if there is none.

    Raises
    ------
    InputError
        If there are several.
    """
    if not name:
        return None
    whole, parts = os.path.abspath(name), Path(name).parts
    found = [place for place, path in enumerate(paths) if os.path.abspath(path) == whole]
    found = found or [
        place for place, path in enumerate(paths) if Path(os.path.abspath(path)).parts[-len(parts) :] == parts
    ]
    if len(found) > 1:
        names = " or ".join(f"'{tests[place].source}'" for place in found[:2])
        raise _wrong(f"names '{name}', which may be {names}")
    return found[0] if found else None
