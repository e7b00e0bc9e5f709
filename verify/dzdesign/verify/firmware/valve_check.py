"""Whether the valve that a compensator holds is that of the valve.json which it names, where that can be told."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dzdesign.core.artefact_files import parse_document, sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.identify.valve.model import SCHEMA
from dzdesign.report.artefact_folder import is_of, shelf_of
from dzdesign.verify.checks import Check
from dzdesign.verify.requirements import VALVE


def valve_follows(folder: Path, document: dict[str, Any]) -> list[Check]:
    """Tell whether the valve in a compensator is that of the file it names; nothing where that file is not at hand.

    The name alone says nothing: a valve.json of another hash and another content is a stranger's.

    Parameters
    ----------
    folder : Path
        Of the firmware; valve.json is looked for around it, where the report finds it too.
    document : dict
        compensator.json.
    """
    source, valve = document["made_from"][0], document["valve"]
    stated = source["sha256"]
    around = list(_valves_around(folder))
    other = _replaced(source, valve, around)
    if stated == sha256_of(to_json(valve).encode()):  # as `identify` writes it: no file is needed
        text = f"the valve that compensator.json holds has, as `identify` writes it, the SHA-256 {stated} in made_from"
        return [Check(name=VALVE, holds=True, text=other + text)]
    for name, content, found in around:
        digest = sha256_of(content)
        if digest == stated:
            holds = found == valve
            text = f"compared with {name}, which has the SHA-256 {stated} in made_from"
            text += "" if holds else ", but is another valve; make the compensator again with `dzdesign design`"
            return [Check(name=VALVE, holds=holds, text=other + text)]
        if found == valve:
            text = f"{name} is that valve, but its SHA-256 is {digest} and compensator.json names {stated}; make the "
            return [Check(name=VALVE, holds=False, text=f"{text}compensator again with `dzdesign design`")]
    return []


def _replaced(source: dict[str, Any], valve: dict[str, Any], around: list[tuple[str, bytes, dict[str, Any]]]) -> str:
    """Say that the file of the name in made_from is another by now, if it is."""
    for name, content, found in around:
        if name == source["source"] and found != valve:
            return f"{name} beside the firmware is ANOTHER valve, SHA-256 {sha256_of(content)}, and not used; "
    return ""


def _valves_around(folder: Path) -> Iterator[tuple[str, bytes, dict[str, Any]]]:
    """Yield name, content and document of each valve.json, whatever its name is; none where nothing can be read."""
    shelf: dict[str, bytes] = {}
    with contextlib.suppress(InputError):
        shelf = shelf_of(folder)
    for name, content in shelf.items():
        if is_of(content, SCHEMA):
            with contextlib.suppress(InputError):
                yield name, content, parse_document(content, name, (SCHEMA,))
