"""What is odd in a lot though each of its valves is in order: a recording that two share, valves of another lot."""

from collections.abc import Mapping
from pathlib import Path

from dzdesign.batch.table import Calibrated
from dzdesign.core.errors import and_more

#: Names in a sentence.
NAMED = 5


def oddities_of(found: Mapping[str, Calibrated], folder: Path) -> list[str]:
    """Return sentences.

    Parameters
    ----------
    found : mapping
        Name of each valve of the lot to what was read back of it.
    folder : Path
        Of the batch.
    """
    return [*_shared_recordings(found), *_left_over(found, folder)]


def _shared_recordings(found: Mapping[str, Calibrated]) -> list[str]:
    """A bench that saves a recording under the wrong name gives a valve the firmware of another."""
    owners: dict[str, list[str]] = {}
    for name, each in found.items():
        for _, digest in each.designed.valve.made_from if each.designed else ():
            owners.setdefault(digest, []).append(name)
    groups = dict.fromkeys(tuple(dict.fromkeys(names)) for names in owners.values())
    return [
        f"{', '.join(names)} share a recording, byte for byte: was one saved under the name of another valve? Their "
        "firmware is that valve's"
        for names in groups
        if len(names) > 1
    ]


def _left_over(found: Mapping[str, Calibrated], folder: Path) -> list[str]:
    others = sorted(path.name for path in (folder / "valves").iterdir() if path.is_dir() and path.name not in found)
    others = [name for name in others if not name.startswith(".")]
    if not others:
        return []
    shown = and_more(others, NAMED)
    return [f"the folder 'valves' holds {shown}, not of this lot: left by an earlier run; take them away"]
