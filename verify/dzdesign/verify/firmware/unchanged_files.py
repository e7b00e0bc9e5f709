"""Whether the files of a firmware folder are those that were generated, and which files are the user's own."""

from pathlib import Path, PurePosixPath

from dzdesign.core.errors import and_more
from dzdesign.core.folder_contents import digest_of
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify import requirements
from dzdesign.verify.requirements import Check

#: User's files that a sentence names.
MOST_NAMED = 5
#: Folder of a firmware for files of the user's own, beside those that were generated.
USER_FOLDER = "board"
#: Endings of C, C++, assembly, libraries, linker files, scripts and projects: what a build of the target takes.
SOURCES = {
    ".c", ".h", ".cc", ".cpp", ".cxx", ".hh", ".hpp", ".hxx", ".inc", ".inl", ".s", ".asm", ".cla", ".lib", ".a",
    ".ld", ".lds", ".lcf", ".icf", ".sct", ".cmd", ".def", ".mk", ".cmake", ".ninja", ".bat", ".props", ".targets",
    ".projectspec", ".ccxml", ".gel", ".syscfg", ".ioc", ".uvprojx", ".ewp", ".vcxproj",
}  # fmt: skip
BUILD_FILES = {"makefile", "gnumakefile", "cmakelists.txt", ".project", ".cproject", ".ccsproject"}


def files_unchanged(folder: Path, manifest: FirmwareManifest) -> Check:
    """Tell which generated files differ from the manifest: what is checked must be what was generated."""
    differing = changed_files(folder, manifest)
    filled_in = [name for name in differing if name in manifest.board]
    user = user_files(folder, manifest)
    if fault := _fault(folder, manifest, [name for name in differing if name not in manifest.board]):
        return requirements.FILES.check(holds=False, text=fault)
    text = f"{len(manifest.files) - len(filled_in)} files compared"
    if filled_in:
        text += f"; you changed these files, which are not checked: {', '.join(filled_in)}"
    if user:
        text += f"; your files in {USER_FOLDER}/ are not checked: {and_more(user, MOST_NAMED)}"
    return requirements.FILES.check(holds=True, text=text)


def _fault(folder: Path, manifest: FirmwareManifest, changed: list[str]) -> str:
    """Return the first fault in words, or an empty text."""
    if changed:
        return f"changed or missing: {', '.join(changed)}"
    added, user = added_files(folder, manifest), user_files(folder, manifest)
    generated = {PurePosixPath(name).name.casefold() for name in manifest.files}
    if shadows := [name for name in added if PurePosixPath(name).name.casefold() in generated]:
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
    """Return the source and project files that were not generated, but for those in folders that CMake builds in."""
    ours = {parent for name in manifest.files for parent in (folder / name).parents}
    built = {path.parent for path in folder.rglob("CMakeCache.txt")} - ours
    found = [path for path in sorted(folder.rglob("*")) if _is_source(path) and not built.intersection(path.parents)]
    return [name for name in (path.relative_to(folder).as_posix() for path in found) if name not in manifest.files]


def user_files(folder: Path, manifest: FirmwareManifest) -> list[str]:
    """Return the files of the user's own: those in the folder kept for them, in which nothing is generated."""
    return [name for name in added_files(folder, manifest) if name.startswith(f"{USER_FOLDER}/")]


def _is_source(path: Path) -> bool:
    name = path.name.casefold()
    return path.is_file() and (PurePosixPath(name).suffix in SOURCES or name in BUILD_FILES)
