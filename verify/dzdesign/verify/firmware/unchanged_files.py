"""Whether the files of a firmware folder are those that were generated, and which files are the user's own."""

from pathlib import Path, PurePosixPath

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import and_more
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify import requirements
from dzdesign.verify.requirements import Check

#: User's files that a sentence names.
MOST_NAMED = 5
#: Endings of C, C++, assembly, of what they include, of linker files and of projects.
SOURCES = {
    ".c", ".h", ".cc", ".cpp", ".cxx", ".hh", ".hpp", ".hxx", ".inc", ".inl", ".s", ".sx", ".asm", ".ld", ".lds",
    ".lcf", ".cmd", ".icf", ".sct", ".def", ".mk", ".mak", ".cmake", ".projectspec", ".ccxml", ".gel", ".syscfg",
    ".ioc", ".uvprojx", ".ewp", ".cproj", ".vcxproj",
}  # fmt: skip
#: Folder of a firmware for files of the user's own, beside those that were generated.
USER_FOLDER = "board"
#: Endings of precompiled headers, files or folders: a compiler takes one in place of the header beside it.
PRECOMPILED = (".gch", ".pch", ".pcm")
#: What CMake writes where it builds: makefiles or projects, scripts, exports, and C that names the compiler.
CMAKE_FILES = {"makefile", "cmakeccompilerid.c", "cmakecxxcompilerid.cpp"}
CMAKE_ENDINGS = {".cmake", ".vcxproj", ".def"}
BUILD_FILES = {"makefile", "gnumakefile", "cmakelists.txt", "meson.build", ".project", ".cproject", ".ccsproject"}


def files_unchanged(folder: Path, manifest: FirmwareManifest) -> Check:
    """Tell which generated files differ from the manifest: what is checked must be what was generated."""
    differing = changed_files(folder, manifest)
    filled_in = [name for name in differing if name in manifest.board]
    added, user = added_files(folder, manifest), user_files(folder, manifest)
    built = _cmake_trees(folder, manifest)
    if fault := _fault(manifest, [name for name in differing if name not in filled_in], added, user):
        return requirements.FILES.check(holds=False, text=fault)
    text = f"{len(manifest.files) - len(filled_in)} files as generated"
    if filled_in:
        text += f"; yours, changed, and not checked: {', '.join(filled_in)}"
    if user:
        text += f"; yours, in {USER_FOLDER}/, and not checked: {and_more(user, MOST_NAMED)}"
    if built:
        text += f"; built by CMake, and not checked: {', '.join(sorted(tree.name for tree in built))}"
    return requirements.FILES.check(holds=True, text=text)


def _fault(manifest: FirmwareManifest, changed: list[str], added: list[str], user: list[str]) -> str:
    """Return the first fault in words, or an empty text."""
    claimed = [name for name in sorted(manifest.board) if not _may_be_filled_in(name, manifest)]
    if claimed:
        return f"the manifest calls {', '.join(claimed)} the user's to fill in, which is none of a target's files"
    if changed:
        return f"changed or missing: {', '.join(changed)}"
    if foreign := [name for name in added if _is_core(name)]:
        place = f"core/ is the compensator alone, keep files of your own in {USER_FOLDER}/"
        return f"{', '.join(foreign)}: not generated; {place}"
    unlisted = [name for name in manifest.files if _is_core(name) and name not in manifest.core]
    if unlisted or not manifest.core:
        return f"the manifest does not name {', '.join(unlisted) or 'any file of the core'}"
    generated = {PurePosixPath(name).name for name in manifest.files}
    if shadows := [name for name in added if _header_of(PurePosixPath(name).name) in generated]:
        return f"{', '.join(shadows)}: not generated, but named as a generated file, for which it may be taken"
    if others := [name for name in added if name not in user]:
        place = f"keep source and project files of your own in {USER_FOLDER}/, beside core/, or outside"
        return f"the manifest does not name {', '.join(others)}; {place}"
    return ""


def changed_files(folder: Path, manifest: FirmwareManifest) -> list[str]:
    """Return the generated files that are missing or no longer as the manifest has them."""
    return [
        name
        for name, digest in manifest.files.items()
        if not (folder / name).is_file() or sha256_of((folder / name).read_bytes()) != digest
    ]


def added_files(folder: Path, manifest: FirmwareManifest) -> list[str]:
    """Return the source and project files that were not generated, but for what CMake writes where it builds."""
    built = _cmake_trees(folder, manifest)
    found = [
        path
        for path in sorted(folder.rglob("*"))
        if _is_source(path) and not (_is_written_by_cmake(path) and built.intersection(path.parents))
    ]
    names = [path.relative_to(folder).as_posix() for path in found]
    return [name for name in names if name not in manifest.files]


def user_files(folder: Path, manifest: FirmwareManifest) -> list[str]:
    """Return the files of the user's own: those in the folder kept for them, in which nothing is generated."""
    found = [path for path in sorted((folder / USER_FOLDER).rglob("*")) if _is_source(path)]
    names = [path.relative_to(folder).as_posix() for path in found]
    return [name for name in names if name not in manifest.files]


def _header_of(name: str) -> str:
    """Return the name under which a compiler looks for a file: a precompiled header's is the header's."""
    for ending in PRECOMPILED:
        name = name.removesuffix(ending)
    return name


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


def _is_written_by_cmake(path: Path) -> bool:
    """Tell whether CMake writes such a file; a header is none, so whoever has one there put it there."""
    return path.name.lower() in CMAKE_FILES or path.suffix.lower() in CMAKE_ENDINGS


def _is_source(path: Path) -> bool:
    """Tell whether a compiler, a linker or a build reads a file; what they write may lie about."""
    if path.name.lower().endswith(PRECOMPILED):
        return True
    return path.is_file() and (path.suffix.lower() in SOURCES or path.name.lower() in BUILD_FILES)
