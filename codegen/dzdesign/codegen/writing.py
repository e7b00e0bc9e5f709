"""Generated files on disk: never over those of another design, and with a note on what was kept or replaced."""

from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import TypeVar

from dzdesign.codegen.other_targets import Output
from dzdesign.codegen.project import Firmware
from dzdesign.core.artefact_files import manifest_of, write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import family_of, read_bytes
from dzdesign.core.errors import InputError, and_more, quoted
from dzdesign.core.options import flag_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest

Made = TypeVar("Made", Firmware, Output)
#: What a folder holds, by the family of its manifest.
WORDS = {family_of(schema_of(FirmwareManifest)): "firmware", family_of(schema_of(OutputManifest)): "output"}
#: Differences that a message names.
MOST_NAMED = 4
#: Keys that another version may write otherwise for the same design, or that have words of their own.
TOLD_APART = {"schema", "tool", "made_from", "costs", "options", "valve"}


def write_generated(made: Made, folder: Path, *, over_another: bool = False) -> Made:
    """Write the folder of a firmware or another output; board files that their user changed stay as they are.

    The result is the same, with a note on what was kept, and on another target that was replaced. A place that can't
    be written, or holds files that would be lost, is an `InputError`; so is one with another design, or another kind of
    output, unless it is to be written over.
    """
    folder, target = Path(folder), made.manifest.target

    def check() -> None:
        if not over_another:
            _refuse_another(folder, made)

    check()  # of two at once, the other one may have written since
    earlier = str((manifest_of(folder) or {}).get("target", ""))
    kept = write_folder(folder, made.contents, made.manifest, check)
    notes = [made.note] if made.note else []
    if earlier not in ("", target):
        notes.append(f"what '{folder}' held for {earlier} was replaced by this for {target}; to have both, give each "
                     "its own folder with -o")  # fmt: skip
    if kept:
        note = f"kept as you changed it: {', '.join(kept)}"
        if newer := [name for name, other in kept.items() if other]:
            note += f"; would be generated otherwise now: {', '.join(newer)}"
        notes.append(f"{note}; for what is generated now, move yours away or choose a new folder with -o")
    return replace(made, note="; ".join(notes))


def _refuse_another(folder: Path, made: Firmware | Output) -> None:
    """Refuse a folder with what was made of another design, or another kind of output: it would be gone unsaid.

    A design is the same where valve, options and numbers are, whichever version of dzdesign made it.
    """
    manifest = manifest_of(folder)
    if manifest is None or (family := family_of(manifest["schema"])) not in WORDS:
        return  # nothing, or nothing of ours, which is refused where it is written
    path = folder / Compensator.FILE_NAME
    try:
        earlier = read_artefact(read_bytes(path, f"compensator of the {WORDS[family]}"), Compensator, str(path))
    except InputError as error:
        found = [f"its {Compensator.FILE_NAME} can't be read ({error})"]
    else:
        found = list(_differences(earlier, made.compensator))
    if isinstance(made, Output) and (target := manifest.get("target")) != made.manifest.target:
        found = [f"it is for {quoted(target)}", *found]
    if found:
        raise InputError(
            f"'{folder}' holds another {WORDS[family]}: {and_more(found, MOST_NAMED)}; `codegen --replace` writes over "
            "it; or choose a new folder with -o"
        )


def _differences(earlier: Compensator, compensator: Compensator) -> Iterator[str]:
    """Yield what two designs do not share, what a user would miss first."""
    there, here = len(earlier.signals.signs), len(compensator.signals.signs)
    if there != here:
        yield f"it drives {_solenoids(there)}, this one {_solenoids(here)}"
    if earlier.valve != compensator.valve:
        yield f"its valve is another one ({_recordings(earlier)}; this one {_recordings(compensator)})"
    texts, ours = earlier.options or {}, compensator.options or {}
    options = [name for name in {**texts, **ours} if texts.get(name) != ours.get(name)]
    for name in options:
        flag = flag_of(name)
        given = [f"with {flag} {quoted(each[name])}" if each.get(name) else f"without {flag}" for each in (texts, ours)]
        yield f"it was designed {given[0]}, this one {given[1]}"
    if options:
        return  # from which other numbers follow
    for field in fields(Compensator):
        if field.name not in TOLD_APART and getattr(earlier, field.name) != getattr(compensator, field.name):
            yield f"its {field.name} is another"


def _solenoids(signs: int) -> str:
    return "one solenoid" if signs == 1 else "two solenoids"


def _recordings(compensator: Compensator) -> str:
    """Return name and number of the recordings that a valve was identified from."""
    names = [file.source for file in compensator.valve.made_from]
    return and_more([quoted(name) for name in names], 1) if names else "no recordings"
