"""Whether the files of a firmware folder are those that were generated, and which files are the user's own."""

from pathlib import Path, PurePosixPath

from dzdesign.core.errors import and_more
from dzdesign.core.folder_contents import digest_of
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify import requirements
from dzdesign.verify.firmware.build_inputs import is_built, is_source, is_taken_for, is_written_by_cmake
from dzdesign.verify.firmware.project_file import is_project
from dzdesign.verify.requirements import Check

#: User's files that a sentence names.
MOST_NAMED = 5
#: Folder of a firmware for files of the user's own, beside those that were generated.
USER_FOLDER = "board"


def files_unchanged(folder: Path, manifest: FirmwareManifest) -> Check:
    """Tell which generated files differ from the manifest: what is checked must be what was generated."""
    differing = changed_files(folder, manifest)
    filled_in = [name for name in differing if name in manifest.board and not is_project(name)]
    projects = [name for name in differing if name in manifest.board and is_project(name)]
    added, user = added_files(folder, manifest), user_files(folder, manifest)
    built = _cmake_trees(folder, manifest)
    if fault := _fault(manifest, [name for name in differing if name not in manifest.board], added, user):
        return requirements.FILES.check(holds=False, text=fault)
    text = f"{len(manifest.files) - len(filled_in) - len(projects)} files compared"
    if projects:
        text += f"; you changed {', '.join(projects)}, whose generated parts are compared with a new generation"
    if filled_in:
        text += f"; you changed these files, which are not checked: {', '.join(filled_in)}"
    if user:
        text += f"; your files in {USER_FOLDER}/ are not checked: {and_more(user, MOST_NAMED)}"
    if objects := _objects(folder, manifest, built):
        text += f"; object files are not checked, so build them again: {and_more(objects, MOST_NAMED)}"
    if built:
        text += f"; CMake's build folders are not checked: {', '.join(sorted(tree.name for tree in built))}"
    return requirements.FILES.check(holds=True, text=text)


def _fault(manifest: FirmwareManifest, changed: list[str], added: list[str], user: list[str]) -> str:
    """Return the first fault in words, or an empty text."""
    claimed = [name for name in sorted(manifest.board) if not _may_be_filled_in(name, manifest)]
    if claimed:
        return f"the manifest lists {', '.join(claimed)} as board files of the user, but no target has such a file"
    if changed:
        return f"changed or missing: {', '.join(changed)}"
    if foreign := [name for name in added if _is_core(name)]:
        place = f"core/ holds only generated files; move your own files to {USER_FOLDER}/"
        return f"{', '.join(foreign)}: not generated, but {place}"
    unlisted = [name for name in manifest.files if _is_core(name) and name not in manifest.core]
    if unlisted or not manifest.core:
        return f"the manifest does not name {', '.join(unlisted) or 'any file of the core'}"
    generated = _names(manifest)
    if shadows := [name for name in added if is_taken_for(PurePosixPath(name).name, generated)]:
        return (
            f"{', '.join(shadows)}: not generated, but a compiler may take it for the generated file of the same name; "
            "rename it"
        )
    if others := [name for name in added if name not in user]:
        place = f"keep your own source and project files in {USER_FOLDER}/, beside core/, or outside the firmware"
        return f"the manifest does not name {', '.join(others)}; {place}"
    return ""


def changed_files(folder: Path, manifest: FirmwareManifest) -> list[str]:
    """Return the generated files that are missing or no longer as the manifest has them."""
    return [
        name
        for name, digest in manifest.files.items()
        if not (folder / name).is_file() or digest_of(folder / name) != digest
    ]


def differing_files(folder: Path, manifest: FirmwareManifest) -> dict[str, str]:
    """Return the SHA-256 of each file that was changed or added since it was generated: as it was verified."""
    names = sorted({*changed_files(folder, manifest), *added_files(folder, manifest)})
    return {name: digest_of(folder / name) for name in names if (folder / name).is_file()}


def added_files(folder: Path, manifest: FirmwareManifest) -> list[str]:
    """Return the files that were not generated and that a build may read, but for what CMake writes where it builds."""
    built, generated = _cmake_trees(folder, manifest), _names(manifest)
    found = [
        path
        for path in sorted(folder.rglob("*"))
        if (is_source(path) or is_taken_for(path.name, generated))
        and not (is_written_by_cmake(path) and built.intersection(path.parents))
    ]
    names = [path.relative_to(folder).as_posix() for path in found]
    return [name for name in names if name not in manifest.files]


def user_files(folder: Path, manifest: FirmwareManifest) -> list[str]:
    """Return the files of the user's own: those in the folder kept for them, in which nothing is generated."""
    found = [path for path in sorted((folder / USER_FOLDER).rglob("*")) if is_source(path)]
    names = [path.relative_to(folder).as_posix() for path in found]
    return [name for name in names if name not in manifest.files]


def _names(manifest: FirmwareManifest) -> set[str]:
    """Return the names of the generated files without their folders, in lower case."""
    return {PurePosixPath(name).name.casefold() for name in manifest.files}


def _objects(folder: Path, manifest: FirmwareManifest, trees: set[Path]) -> list[str]:
    """Return what a build has left outside of the folders that CMake builds in: make keeps it where it is newer."""
    found = [path for path in sorted(folder.rglob("*")) if is_built(path) and not trees.intersection(path.parents)]
    return [name for name in (path.relative_to(folder).as_posix() for path in found) if name not in manifest.files]


def _is_core(name: str) -> bool:
    path = PurePosixPath(name)
    return path.parent.as_posix() == "core" and path.suffix in (".c", ".h")


def _may_be_filled_in(name: str, manifest: FirmwareManifest) -> bool:
    """Tell whether a file can be its user's: listed, and in a target's folder, not of the core."""
    folder, slash, _ = name.partition("/")
    return bool(slash) and folder != "core" and name in manifest.files and name not in manifest.core


def _cmake_trees(folder: Path, manifest: FirmwareManifest) -> set[Path]:
    """Return the folders in which CMake has built, with makefiles and C of its own, and in which nothing is ours."""
    ours = {parent for name in manifest.files for parent in (folder / name).parents}
    return {path.parent for path in folder.rglob("CMakeCache.txt")} - ours - {folder}
