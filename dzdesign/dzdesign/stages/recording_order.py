"""`--order`: recordings in the order in which they were taken."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import Paths, paths_of

if TYPE_CHECKING:
    from dzdesign.identify.reading.ramp_test import RampTest


def in_order(tests: "Sequence[RampTest]", paths: Sequence[Path], order: Paths | None) -> "list[RampTest]":
    """Return recordings, read from `paths`, with the times at which they began, where --order states them.

    An item of the order is a recording, by its file name or path, or several with commas between them.

    Raises
    ------
    InputError
        If an item is not a recording's, or a recording is missing.
    """
    from dzdesign.identify.reading.series import in_stated_order

    if order is None:
        return list(tests)
    places = _places(tests, paths, order)
    twice = next((place for count, place in enumerate(places) if place in places[:count]), None)
    missing = next((place for place in range(len(tests)) if place not in places), None)
    if twice is not None:
        raise _wrong(f"names '{tests[twice].source}' twice")
    if missing is not None:
        raise _wrong(f"lacks '{tests[missing].source}'")
    stated = dict(zip(places, in_stated_order([tests[place] for place in places]), strict=True))
    return [stated[place] for place in range(len(tests))]


def stated_order(tests: "Sequence[RampTest]", paths: Sequence[Path], order: Paths | None) -> tuple[str, ...]:
    """Return the names of the recordings in the order of taking, as `in_order` read it; none where none is stated."""
    return () if order is None else tuple(tests[place].source for place in _places(tests, paths, order))


def _places(tests: "Sequence[RampTest]", paths: Sequence[Path], order: Paths) -> list[int]:
    return [place for item in paths_of(order) for place in _named(os.fspath(item), paths, tests)]


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
