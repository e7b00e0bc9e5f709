"""Comparison of a firmware with a new generation from its compensator.json, which also reveals an edited manifest.

This is here and not in verify, which shares no code with what it checks: this one check asks the generator itself.
"""

from collections.abc import Collection
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME, read_bytes, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.errors import InputError, MissingToolError, quoted

if TYPE_CHECKING:
    from dzdesign.codegen.other_targets import Output
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.firmware_manifest import FirmwareManifest
    from dzdesign.design.output_manifest import OutputManifest
    from dzdesign.verify.requirements import Check

    Manifest = FirmwareManifest | OutputManifest


def regenerated(folder: Path) -> "Check":
    """Tell whether every file is what `codegen` makes of compensator.json, but for those that the user fills in.

    It is not checked where another version of dzdesign generated the firmware, or one with other targets: then nothing
    tells an edited file from a generated one, so the firmware does not hold.
    """
    from dzdesign.codegen.project import TARGET_NAMES
    from dzdesign.verify.firmware.folder import read_firmware_manifest
    from dzdesign.verify.requirements import REGENERATED

    manifest = read_firmware_manifest(folder)
    if reason := not_generated_here(manifest, TARGET_NAMES):
        return REGENERATED.check(holds=None, text=reason)
    try:
        firmware = firmware_again(folder, manifest)
    except InputError as error:
        return REGENERATED.check(holds=False, text=str(error))
    expected = firmware.manifest
    compared = {name: digest for name, digest in expected.files.items() if name not in expected.board}
    others = [name for name in sorted(compared) if _digest(folder / name) != compared[name]]
    others += _others_in_manifest(folder, manifest, expected)
    if others:
        text = f"otherwise than generated now: {', '.join(others)}; make the firmware again with `dzdesign codegen`"
        return REGENERATED.check(holds=False, text=text)
    same = f"the manifest and {len(compared)} other files are the same, byte for byte"
    text = f"generated again for {manifest.target}: {same}"
    return REGENERATED.check(holds=True, text=text)


def firmware_again(folder: Path, manifest: "FirmwareManifest") -> "Firmware":
    """Generate the firmware of a folder's compensator.json, of the kind that the manifest names.

    What `generate` refuses is an `InputError`, and so is a compensator.json that can't be read.
    """
    from dzdesign.codegen.project import generate
    from dzdesign.verify.firmware.folder import read_compensator

    content = read_bytes(folder / "compensator.json", "compensator")
    return generate(read_compensator(folder), manifest.target, content, manifest.calibration, manifest.vectors)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputAgain:
    """What `codegen` makes of the compensator.json of an output now, or why it makes none."""

    output: "Output | None" = None
    reason: str = ""
    #: Of none: whether this version and this machine could make it.
    refused: bool = False


def output_again(folder: Path) -> OutputAgain:
    """Generate an output that is no C firmware from its compensator.json; one that can't be read is an `InputError`."""
    from importlib import import_module

    from dzdesign.codegen.other_targets import OTHER_TARGETS, generate_output, settings_of
    from dzdesign.verify.firmware.folder import read_compensator
    from dzdesign.verify.outputs.folder import read_output_manifest

    manifest = read_output_manifest(folder)
    if reason := not_generated_here(manifest, OTHER_TARGETS):
        return OutputAgain(reason=reason)
    content, compensator = read_bytes(folder / "compensator.json", "compensator"), read_compensator(folder)
    compiled = getattr(import_module(OTHER_TARGETS[manifest.target].module), "made_by_another_compiler", None)
    try:
        settings = settings_of(manifest.target, manifest.settings)
        there = {name: (folder / name).read_bytes() for name in manifest.files if (folder / name).is_file()}
        if compiled and (reason := compiled(there)):
            return OutputAgain(reason=f"{reason}; verify it with the one that made it")
        return OutputAgain(output=generate_output(compensator, manifest.target, settings, content))
    except MissingToolError as error:
        return OutputAgain(reason=str(error))
    except InputError as error:
        return OutputAgain(reason=str(error), refused=True)


def output_regenerated(folder: Path, again: OutputAgain | None = None) -> "Check":
    """Tell whether every file of an output other than a C firmware is what `codegen` makes of compensator.json now.

    It is not checked where the output was compiled, and the compiler is missing here or another one. `again` is the
    output where it was generated before.
    """
    from dzdesign.verify.outputs.folder import read_output_manifest
    from dzdesign.verify.requirements import REGENERATED

    manifest, again = read_output_manifest(folder), again or output_again(folder)
    output = again.output
    if output is None:
        return REGENERATED.check(holds=False if again.refused else None, text=again.reason)
    others = [name for name, text in output.contents.items() if _digest(folder / name) != sha256_of(text)]
    others += _others_in_manifest(folder, manifest, output.manifest)
    if others:
        found = f"otherwise than generated now: {', '.join(sorted(others))}"
        return REGENERATED.check(holds=False, text=f"{found}; make the output again with `dzdesign codegen`")
    count = len(output.contents)
    text = f"generated again for {manifest.target}: the manifest and {count} other files are the same, byte for byte"
    return REGENERATED.check(holds=True, text=text)


def _others_in_manifest(folder: Path, manifest: "Manifest", expected: "Manifest") -> list[str]:
    """Return the keys of the manifest that are others; where none is, whether it is written otherwise."""
    keys = sorted(field.name for field in fields(expected))
    others = [f"{key} of {MANIFEST_NAME}" for key in keys if getattr(manifest, key) != getattr(expected, key)]
    if not others and read_bytes(folder / MANIFEST_NAME, "firmware manifest") != to_json_bytes(expected):
        others.append(f"keys or spelling of {MANIFEST_NAME}")
    return others


def not_generated_here(manifest: "Manifest", known: Collection[str]) -> str:
    """Return why this version can't generate a firmware again, and what to do; nothing where it can."""
    tool = f"{manifest.tool.name} {manifest.tool.version}"
    this = f"{THIS_TOOL.name} {THIS_TOOL.version}"
    if manifest.tool != THIS_TOOL:
        found = f"generated by {quoted(tool)}, and this is {this}"
    elif manifest.target not in known:
        found = f"generated for {quoted(manifest.target)}, which is no target of {this}"
    else:
        return ""
    return f"{found}; make it again with `dzdesign codegen`, or verify it with the version that made it"


def _digest(path: Path) -> str | None:
    return sha256_of(path.read_bytes()) if path.is_file() else None
