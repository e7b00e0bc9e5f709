"""What lies where a firmware is to be written: for which target, and whether it is of the same design."""

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import family_of
from dzdesign.core.errors import InputError, and_more, quoted
from dzdesign.core.folder_contents import manifest_of
from dzdesign.core.options import flag_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest

#: What a folder holds, by the type of its manifest.
WORDS = {FirmwareManifest: "firmware", OutputManifest: "output"}
#: Differences that a message names.
MOST_NAMED = 4
#: Keys that another version may write otherwise for the same design, that follow from others, or that have words here.
TOLD_APART = {"schema", "tool", "made_from", "costs", "options", "target", "valve", "signals", "sides"}


def target_in(folder: Path) -> str:
    """Return the target of the firmware or other output that lies in a folder; nothing where there is none."""
    return str((manifest_of(folder) or {}).get("target", ""))


def refuse_another_design(folder: Path, compensator: Compensator) -> None:
    """Refuse a folder with what was made of another design: its sides and signals would be gone without a word.

    A design is the same where valve, options and numbers are, whichever version of dzdesign made it.
    """
    manifest = manifest_of(folder)
    kinds = {family_of(schema_of(kind)): word for kind, word in WORDS.items()}
    if manifest is None or (family := family_of(manifest["schema"])) not in kinds:
        return  # nothing, or nothing of ours, which is refused where it is written
    path = folder / Compensator.FILE_NAME
    try:
        earlier = read_artefact(read_bytes(path, f"compensator of the {kinds[family]}"), Compensator, str(path))
    except InputError as error:
        found = [f"its {Compensator.FILE_NAME} can't be read ({error})"]
    else:
        found = list(_differences(earlier, compensator))
    if found:
        raise InputError(
            f"'{folder}' holds the {kinds[family]} of another design: {and_more(found, MOST_NAMED)}; "
            "give `codegen` --replace to write over it, or choose a new folder with -o"
        )


def _differences(earlier: Compensator, compensator: Compensator) -> Iterator[str]:
    """Yield what two designs do not share, what a user would miss first."""
    there, here = len(earlier.signals.signs), len(compensator.signals.signs)
    if there != here:
        yield f"it drives {_solenoids(there)}, this one {_solenoids(here)}"
    if earlier.valve != compensator.valve:
        yield f"its valve is another one ({_recordings(earlier)}; this one {_recordings(compensator)})"
    if earlier.target != compensator.target:
        names = [each.target.name if each.target else "nobody knows which" for each in (earlier, compensator)]
        yield f"it was designed for {names[0]}, this one for {names[1]}"
    texts, ours = earlier.options or {}, compensator.options or {}
    options = [name for name in {**texts, **ours} if texts.get(name) != ours.get(name)]
    for name in options:
        yield f"{flag_of(name)} {quoted(texts.get(name, ''))}, here {quoted(ours.get(name, ''))}"
    if not options and (earlier.signals, earlier.sides) != (compensator.signals, compensator.sides):
        yield "signals or law of the same options are other numbers"
    for field in fields(Compensator):
        if field.name not in TOLD_APART and getattr(earlier, field.name) != getattr(compensator, field.name):
            yield f"its {field.name} is another"


def _solenoids(signs: int) -> str:
    return "one solenoid" if signs == 1 else "two solenoids"


def _recordings(compensator: Compensator) -> str:
    """Return name and number of the recordings that a valve was identified from."""
    names = [file.source for file in compensator.valve.made_from]
    return and_more([quoted(name) for name in names], 1) if names else "no recordings"
