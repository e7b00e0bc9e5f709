"""Whether the valve that a compensator holds is that of the valve.json which it names, where that can be told."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dzdesign.core.artefacts import parse_document, sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.identify.model import SCHEMA
from dzdesign.verify.checks import Check
from dzdesign.verify.report_shelf import is_of, shelf_of
from dzdesign.verify.required import VALVE


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
    stated, valve = document["made_from"][0]["sha256"], document["valve"]
    if stated == sha256_of(to_json(valve).encode()):  # as `identify` writes it: no file is needed
        text = "its SHA-256, as `identify` writes it, is the one that compensator.json names"
        return [Check(name=VALVE, holds=True, text=text)]
    for name, content, found in _valves_around(folder):
        digest = sha256_of(content)
        if digest == stated:
            holds = found == valve
            text = f"compared with {name}, which has the SHA-256 that compensator.json names"
            text += "" if holds else ", but is another valve; make the compensator again with `dzdesign design`"
            return [Check(name=VALVE, holds=holds, text=text)]
        if found == valve:
            text = f"{name} is that valve, but its SHA-256 is {digest} and compensator.json names {stated}; make the "
            return [Check(name=VALVE, holds=False, text=f"{text}compensator again with `dzdesign design`")]
    return []


def _valves_around(folder: Path) -> Iterator[tuple[str, bytes, dict[str, Any]]]:
    """Yield name, content and document of each valve.json, whatever its name is; none where nothing can be read."""
    shelf: dict[str, bytes] = {}
    with contextlib.suppress(InputError):
        shelf = shelf_of(folder)
    for name, content in shelf.items():
        if is_of(content, SCHEMA):
            with contextlib.suppress(InputError):
                yield name, content, parse_document(content, name, (SCHEMA,))
