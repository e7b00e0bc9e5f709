"""A firmware or another output designed and generated again from its compensator.json, to be compared with its folder.

This is here and not in verify, which shares no code with what it checks: it is handed the text as a value.
"""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.errors import InputError, MissingToolError, RequirementError, quoted

if TYPE_CHECKING:
    from dzdesign.codegen.other_targets import Output
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest
    from dzdesign.verify.folder import Regenerated

    Manifest = FirmwareManifest | OutputManifest


def regenerated(folder: Path) -> "Regenerated":
    """Design a folder's compensator.json again, and generate what the manifest names; a bad file is an `InputError`.

    Nothing can be said where another version of dzdesign made the folder, or one with other targets, or where a
    compiler is missing.
    """
    from dzdesign.verify.folder import (
        Regenerated,
        holds_output,
        read_compensator,
        read_firmware_manifest,
        read_output_manifest,
    )

    manifest: Manifest = read_output_manifest(folder) if holds_output(folder) else read_firmware_manifest(folder)
    compensator = read_compensator(folder)
    if unknown := _unknown_origin(manifest):
        return Regenerated(unknown=unknown)
    try:
        unknown = _not_derived(compensator)
        made = _made(folder, manifest, compensator)
    except MissingToolError as error:
        return Regenerated(unknown=str(error))
    except InputError as error:
        return Regenerated(fault=str(error))
    contents = {name: text.encode() if isinstance(text, str) else text for name, text in made.contents.items()}
    return Regenerated(
        files={**contents, MANIFEST_NAME: to_json_bytes(made.manifest)},
        board=frozenset(getattr(made.manifest, "board", ())),
        unknown=unknown,
    )


@contextmanager
def generated_code(folder: Path) -> Iterator[Path]:
    """Give a folder with the generated text of a firmware; of one that differs from it a `RequirementError`."""
    from dzdesign.verify.folder import reproduced

    again = regenerated(folder)
    check = reproduced(folder, again)
    if check.holds is False or not again.files:
        raise RequirementError(f"nothing of '{folder}' was compiled or run: {check.text}")
    with again.written() as code:
        yield code


def _not_derived(compensator: "Compensator") -> str:
    """Design a compensator again; return why it is not known whether its numbers follow, nothing where they do.

    A number that does not follow is an `InputError`; another version of dzdesign may have chosen it just as well.
    """
    from dzdesign.design.redesign import prove_derived, refuse_without_options

    try:
        prove_derived(compensator)
    except InputError as error:
        if compensator.tool == THIS_TOOL:
            raise
        version = quoted(compensator.tool.version)
        return f"designed by dzdesign {version}, and this is {THIS_TOOL.version}: {error}"
    try:
        refuse_without_options(compensator, compensator.FILE_NAME)
    except InputError as error:
        return str(error)
    return ""


def _made(folder: Path, manifest: "Manifest", compensator: "Compensator") -> "Firmware | Output":
    from importlib import import_module

    from dzdesign.codegen.other_targets import OTHER_TARGETS, generate_output, settings_of
    from dzdesign.codegen.project import generate
    from dzdesign.design.firmware_manifest import FirmwareManifest

    if isinstance(manifest, FirmwareManifest):
        return generate(compensator, manifest.target, manifest.calibration, manifest.vectors)
    settings = settings_of(manifest.target, manifest.settings)
    module = import_module(OTHER_TARGETS[manifest.target].module)
    if compiled := getattr(module, "made_by_another_compiler", None):
        there = {name: (folder / name).read_bytes() for name in manifest.files if (folder / name).is_file()}
        if reason := compiled(there):
            raise MissingToolError(f"{reason}; verify it with the one that made it")
    return generate_output(compensator, manifest.target, settings)


def _unknown_origin(manifest: "Manifest") -> str:
    """Return why this version can't generate a folder again, and what to do; nothing where it can."""
    from dzdesign.codegen.other_targets import OTHER_TARGETS
    from dzdesign.codegen.project import TARGET_NAMES

    known: Collection[str] = TARGET_NAMES if hasattr(manifest, "board") else OTHER_TARGETS.keys()
    tool = f"{manifest.tool.name} {manifest.tool.version}"
    this = f"{THIS_TOOL.name} {THIS_TOOL.version}"
    if manifest.tool != THIS_TOOL:
        found = f"generated by {quoted(tool)}, and this is {this}"
    elif manifest.target not in known:
        found = f"generated for {quoted(manifest.target)}, which is no target of {this}"
    else:
        return ""
    return f"{found}; make it again with `dzdesign codegen`, or verify it with the version that made it"
