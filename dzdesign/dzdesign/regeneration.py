"""A firmware against what `codegen` makes of its compensator.json now: also what no hash of its own manifest can tell.

Stands here and not in verify, which shares no code with what it checks: this one check asks the generator itself.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from dzdesign.core.artefact_files import TOOL, read_bytes, sha256_of
from dzdesign.core.errors import InputError

if TYPE_CHECKING:
    from dzdesign.verify.checks import Check
    from dzdesign.verify.verification import Verification


def with_regenerated(verification: "Verification", folder: Path) -> "Verification":
    """Return a verification with the check of `regenerated`, where that can be made.

    Parameters
    ----------
    verification : Verification
        Of the folder.
    folder : Path
        Of the firmware.
    """
    from dzdesign.verify.firmware.c2000ware import with_check

    check = regenerated(folder)
    return with_check(verification, check) if check else verification


def regenerated(folder: Path) -> "Check | None":
    """Tell whether every file is what `codegen` makes of compensator.json, but for those that are the user's.

    Parameters
    ----------
    folder : Path
        Of the firmware.

    Returns
    -------
    Check or None
        None where another version of dzdesign generated it, or one with another target.
    """
    from dzdesign.codegen.project import TARGET_NAMES, generate
    from dzdesign.design.compensator_file import compensator_from_document
    from dzdesign.verify.checks import Check
    from dzdesign.verify.firmware.folder import read_firmware_manifest
    from dzdesign.verify.requirements import REGENERATED

    _, manifest = read_firmware_manifest(folder)
    if manifest.get("tool") != TOOL or manifest.get("target") not in TARGET_NAMES:
        return None
    source = folder / "compensator.json"
    content = read_bytes(source, "compensator")
    try:
        firmware = generate(compensator_from_document(content, str(source)), manifest["target"], content)
    except InputError as error:
        return Check(name=REGENERATED, holds=False, text=str(error))
    made = {name: sha256_of(text.encode()) for name, text in firmware.files.items()}
    expected: dict[str, Any] = {**firmware.manifest, "files": made}
    others = [name for name in sorted(made) if name not in expected["board"] and _digest(folder / name) != made[name]]
    others += [f"{key} of manifest.json" for key in sorted(expected) if manifest.get(key) != expected[key]]
    if others:
        text = f"otherwise than generated now: {', '.join(others)}; make the firmware again with `dzdesign codegen`"
        return Check(name=REGENERATED, holds=False, text=text)
    text = f"generated again for {manifest['target']}: {len(made) - len(expected['board'])} files and the manifest are "
    text += "the same, byte for byte"
    return Check(name=REGENERATED, holds=True, text=text)


def _digest(path: Path) -> str | None:
    return sha256_of(path.read_bytes()) if path.is_file() else None
