"""What lies in an artefact folder and around it, read once."""

import contextlib
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, parse_document, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.errors import InputError
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.report.lot.valve_folder import ValveManifest
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.firmware.reproduced import added_files

VERIFICATION_NAME = Evidence.FILE_NAME
#: No larger file is read, and no more of them in a folder: an artefact is far smaller.
LARGEST, MOST = 32 * 2**20, 500
#: The schema stands in the first bytes of an artefact.
HEAD = 512


def read_artefact_folder(folder: Path) -> dict[str, bytes]:
    """Return what dzdesign made in a folder and in the folders in it, by name below it.

    Of an evidence or firmware folder the folder around it is looked at too: what it was made from lies there.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"'{folder}' is not a folder, expected one with artefacts of dzdesign; check the name")
    try:
        folder, root = folder.resolve(), artefact_root(folder)
        within = sorted(place for place in root.iterdir() if place.is_dir() and not place.name.startswith("."))
        named = _files_in(folder, root)
    except OSError as error:
        raise InputError(f"'{folder}' can't be read: {error.strerror or error}") from error
    evidence = (folder / VERIFICATION_NAME).is_file()
    others = _evidence_of_others(folder, within)
    files: dict[str, bytes] = {}
    for place in dict.fromkeys((root, *within[:MOST], folder)):  # in one order whichever was named: same bytes
        if place == folder:
            files |= named
        elif place not in others and not (evidence and (place / VERIFICATION_NAME).is_file()):  # only the one named
            with contextlib.suppress(OSError):  # a neighbour that is not ours to read
                files |= _files_in(place, root)
    if not any(name.endswith(".json") for name in files):
        raise InputError(
            f"'{folder}' has no artefact of dzdesign, expected verification.json, firmware, compensator.json or "
            "valve.json; give the folder that `dzdesign demo`, `verify` or `codegen` wrote"
        )
    return files


def artefact_root(folder: Path) -> Path:
    """Return the folder that a report looks into: that around an evidence, firmware or output folder."""
    folder = Path(folder).resolve()
    return folder.parent if _is_one_stage(folder) else folder


def asked_prefixes(folder: Path) -> tuple[str, ...]:
    """Return how the names of a folder's own files begin; the other files only lie around it."""
    return (f"{folder.resolve().name}/",) if _is_one_stage(folder) else ("",)


def _evidence_of_others(folder: Path, within: list[Path]) -> set[Path]:
    """Return the folders of evidence that are of another firmware than the one that was named, if one is of it."""
    if not (folder / MANIFEST_NAME).is_file() or (folder / VERIFICATION_NAME).is_file():
        return set()
    digest = sha256_of((folder / MANIFEST_NAME).read_bytes()).encode()
    evidence = [place for place in within if _is_small(place / VERIFICATION_NAME)]
    # The hash stands in the file of what was made from it, and nowhere else.
    ours = {place for place in evidence if digest in (place / VERIFICATION_NAME).read_bytes()}
    return set(evidence) - ours if ours else set()


def _is_small(path: Path) -> bool:
    with contextlib.suppress(OSError):
        return path.is_file() and path.stat().st_size <= LARGEST
    return False


def _is_one_stage(folder: Path) -> bool:
    """Tell evidence and firmware from a folder that holds them; a valve's of a batch has a manifest too."""
    if (folder / VERIFICATION_NAME).is_file():
        return True
    path = folder / MANIFEST_NAME
    if not path.is_file():
        return False
    try:
        parse_document(path.read_bytes(), MANIFEST_NAME, (schema_of(ValveManifest),))
    except InputError:
        return True
    return False


def _files_in(place: Path, root: Path) -> dict[str, bytes]:
    """Return JSON of this tool, the evidence's CSV, what a manifest lists and a build reads, by name below `root`."""
    evidence = (place / VERIFICATION_NAME).is_file()
    suffixes = (".json", ".csv") if evidence else (".json",)
    paths = [path for path in sorted(place.iterdir()) if path.suffix in suffixes]
    files = {}
    for path in paths[:MOST]:
        if path.is_file() and path.stat().st_size <= LARGEST:
            content = path.read_bytes()
            if path.suffix == ".csv" or b'"dzdesign.' in content[:HEAD]:
                files[path.relative_to(root).as_posix()] = content
    manifest = files.get((place / MANIFEST_NAME).relative_to(root).as_posix())
    added = _added_in(place, manifest)  # all of them: evidence states the hash of each
    for name in [*list(listed_files(manifest))[:MOST], *added]:
        path = place / name
        inside = path.resolve().is_relative_to(place)  # a name in a manifest is somebody's text
        if inside and path.is_file() and (name in added or path.stat().st_size <= LARGEST):
            files[path.relative_to(root).as_posix()] = path.read_bytes()
    return files


def _added_in(place: Path, manifest: bytes | None) -> list[str]:
    """Return the files of a firmware that a build may read and its manifest does not list."""
    if manifest is None or not is_of(manifest, schema_of(FirmwareManifest)):
        return []
    try:
        return added_files(place, read_artefact(manifest, FirmwareManifest, MANIFEST_NAME).files)
    except InputError:
        return []


def is_document(leaf: str) -> bool:
    """Tell whether a file that no manifest lists was read as an artefact or a table, and not as what a build reads."""
    return "/" not in leaf and leaf.endswith((".json", ".csv"))


def is_of(content: bytes, schema: str) -> bool:
    """Tell whether a file's first bytes name a schema, such as ``dzdesign.valve/1``."""
    return f'"{schema}"'.encode() in content[:HEAD]


def listed_files(manifest: bytes | None) -> dict[str, str]:
    """Return the files that a manifest of evidence or firmware lists, with their hashes; none of what is none."""
    if manifest is None:
        return {}
    try:
        files = parse_document(manifest, MANIFEST_NAME, (schema_of(Evidence), schema_of(FirmwareManifest))).get("files")
    except InputError:
        return {}
    listed = files.items() if isinstance(files, dict) else ()
    return {name: str(digest) for name, digest in listed if ".." not in name.split("/") and "\0" not in name}
