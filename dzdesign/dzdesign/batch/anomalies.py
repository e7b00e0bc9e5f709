"""Anomalies across a lot whose valves are individually in order: what two of them share, and valves of another lot."""

import os
from collections.abc import Collection, Sequence
from pathlib import Path

from dzdesign.batch.valve_folders import ValveFolder
from dzdesign.batch.valves import Valve
from dzdesign.codegen.calibration.block import entry_of_record
from dzdesign.core.errors import InputError, and_more, quoted
from dzdesign.report.lot.summary import VALVES
from dzdesign.report.lot.table import by_name

#: Names in a sentence.
NAMED = 5


def anomalies_of(found: Sequence[ValveFolder], folder: Path, valves: Sequence[Valve]) -> list[str]:
    """Return sentences on a lot as read back from its folder, and as it was given, with patterns of recordings."""
    overlapping = _overlapping(valves)
    names = {each.name for each in found}
    shared = (*_shared_recordings(found, overlapping), *_shared_serials(found, overlapping))
    return [*overlapping.values(), *shared, *_left_over(names, folder)]


def _overlapping(valves: Sequence[Valve]) -> dict[tuple[str, ...], str]:
    """Return what to say of valves whose patterns match one file, by their names."""
    owners: dict[str, dict[str, str]] = {}
    for valve in valves:
        try:
            for path, pattern in valve.recordings().items():
                owners.setdefault(os.path.abspath(path), {})[valve.name] = pattern
        except InputError:  # such a valve has failed, and says so itself
            continue
    shared: dict[tuple[str, ...], list[str]] = {}
    for place, by in owners.items():
        if len(by) > 1:
            shared.setdefault(tuple(by), []).append(place)
    lines = {}
    for names, places in shared.items():
        by = owners[places[0]]
        more = f" and {len(places) - 1} more" if len(places) > 1 else ""
        what = " and ".join(f"'{by[name]}' of {name}" for name in names[:2])
        lines[names] = (
            f"{and_more(names, NAMED)} take the same file, '{Path(places[0]).name}'{more}: in the column files {what} "
            "overlap; let each valve's match its own files alone, unless one valve is meant twice, with other options"
        )
    return lines


def _shared_recordings(found: Sequence[ValveFolder], known: Collection[tuple[str, ...]]) -> list[str]:
    """A bench that saves a recording under the wrong name gives a valve the firmware of another."""
    owners: dict[str, list[str]] = {}
    for each in found:
        for source in each.manifest.made_from if each.compensator else ():
            owners.setdefault(source.sha256, []).append(each.name)
    groups = dict.fromkeys(tuple(dict.fromkeys(names)) for names in owners.values())
    return [
        f"{and_more(names, NAMED)} share a recording, byte for byte, in files of their own: was one saved under the "
        "name of another valve? Their firmware is that valve's; record the ramp test again"
        for names in groups
        if len(names) > 1 and names not in known
    ]


def _shared_serials(found: Sequence[ValveFolder], known: Collection[tuple[str, ...]]) -> list[str]:
    """A block is told from another valve's by its serial number."""
    owners: dict[str, list[str]] = {}
    for each in found:
        if each.compensator and (serial := entry_of_record(each.compensator, "serial")):
            owners.setdefault(serial, []).append(each.name)
    return [
        f"{and_more(names, NAMED)} have the same serial number, {quoted(serial)}, and by it their blocks can't be told "
        "apart; correct record.serial"
        for serial, names in owners.items()
        if len(names) > 1 and tuple(names) not in known
    ]


def _left_over(names: Collection[str], folder: Path) -> list[str]:
    there = (path.name for path in (folder / VALVES).iterdir() if path.is_dir() and path.name not in names)
    others = sorted((name for name in there if not name.startswith(".")), key=by_name)
    if not others:
        return []
    return [
        f"the folder '{VALVES}' holds {and_more(others, NAMED)}, not of this lot: left by an earlier run; take them "
        "away"
    ]
