"""Where programs are found: in the folders that PATH names in full, never in the working folder.

Whoever works in a folder that somebody sent must not run a program that lies in it. So an entry of PATH that is empty
or relative is left out, for dzdesign and for the programs that it starts; and Windows, which looks into the working
folder before PATH, is given full names alone.
"""

import errno
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

#: By which programs on Windows do not look for others in the working folder.
NOT_HERE = "NoDefaultCurrentDirectoryInExePath"


def find_program(name: str, folders: Sequence[str] | None = None) -> str | None:
    """Return the full path of a program, by default one of PATH, or None; a name with a folder in it stands for itself.

    Examples
    --------
    >>> find_program("no-such-program") is None
    True
    """
    if os.path.dirname(name):
        return _first([os.path.abspath(name)])
    places = search_folders() if folders is None else folders
    return _first([os.path.join(folder, name) for folder in places])


def search_folders() -> list[str]:
    """Return the folders of PATH that are named in full."""
    entries = os.environ.get("PATH", os.defpath).split(os.pathsep)
    return [entry for entry in (each.strip('"') for each in entries) if entry and Path(entry).is_absolute()]


def program_environment(environment: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return an environment, by default that of this process, with which a program finds others likewise."""
    given = dict(os.environ if environment is None else environment)
    if "PATH" in given:
        given["PATH"] = os.pathsep.join(search_folders())
    return {**given, NOT_HERE: "1"} if os.name == "nt" else given


def with_full_name(command: Sequence[str]) -> list[str]:
    """Return a command that begins with the full path of its program; without one a `FileNotFoundError`."""
    path = find_program(command[0])
    if path is None:
        raise FileNotFoundError(errno.ENOENT, "no such program on PATH", command[0])
    return [path, *command[1:]]


def _first(places: Sequence[str]) -> str | None:
    """Return the first of some places at which a program lies; on Windows it has one of the endings of PATHEXT."""
    for place in places:
        for each in _with_endings(place, os.environ.get("PATHEXT", "") if os.name == "nt" else ""):
            if os.path.isfile(each) and os.access(each, os.X_OK):
                return each
    return None


def _with_endings(place: str, endings: str) -> list[str]:
    """Return a place as it may be called: as it is, if it has one of the endings or there are none, else with each.

    Examples
    --------
    >>> _with_endings("gcc", ".COM;.EXE"), _with_endings("gcc.exe", ".COM;.EXE"), _with_endings("gcc", "")
    (['gcc.COM', 'gcc.EXE'], ['gcc.exe'], ['gcc'])
    """
    known = [each for each in endings.split(";") if each]
    if not known or place.lower().endswith(tuple(each.lower() for each in known)):
        return [place]
    return [place + each for each in known]
