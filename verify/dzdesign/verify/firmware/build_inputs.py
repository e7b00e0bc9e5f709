"""Which files a compiler, a linker or a build reads, and for which of ours a build may take another file."""

from collections.abc import Set
from pathlib import Path, PurePosixPath

#: Endings of C, C++, assembly, of what they include or are made from, of libraries, linker files, scripts and projects.
SOURCES = {
    ".c", ".h", ".cc", ".cpp", ".cxx", ".c++", ".hh", ".hpp", ".hxx", ".h++", ".inc", ".inl", ".ipp", ".tcc", ".s",
    ".sx", ".sa", ".asm", ".cla", ".y", ".l", ".w", ".ch", ".web", ".lib", ".a", ".ld", ".lds", ".lcf", ".cmd", ".opt",
    ".icf", ".sct", ".def", ".mk", ".mak", ".cmake", ".ninja", ".bazel", ".props", ".targets", ".rsp", ".bat",
    ".i", ".ii", ".ino", ".pde", ".tpp", ".ll", ".gas",
    ".projectspec", ".ccxml", ".gel", ".syscfg", ".ioc", ".uvprojx", ".ewp", ".cproj", ".vcxproj",
}  # fmt: skip
BUILD_FILES = {
    "makefile", "gnumakefile", "cmakelists.txt", "cmakepresets.json", "cmakeuserpresets.json", "meson.build",
    "sconstruct", "platformio.ini", "xmake.lua", "premake5.lua", "module.modulemap",
    ".project", ".cproject", ".ccsproject",
}  # fmt: skip
#: Endings of precompiled headers, files or folders: a compiler takes one in place of the header beside it.
PRECOMPILED = (".gch", ".pch", ".pcm")
#: What GNU make makes a file from by itself, even a makefile: a script, and a file under version control.
MADE_FROM = (".sh", ",v")
#: Files that no build reads may be called alike anywhere.
DOCUMENTS = {".md", ".json"}
#: Endings of what a build writes, and what make keeps where it is newer than its sources.
BUILT = {".o", ".obj", ".out", ".elf", ".hex", ".bin", ".exe", ".dll", ".so", ".dylib"}
#: What CMake writes where it builds: makefiles or projects, scripts, exports, libraries, and C that names the compiler.
CMAKE_FILES = {"makefile", "cmakeccompilerid.c", "cmakecxxcompilerid.cpp"}
CMAKE_ENDINGS = {".cmake", ".ninja", ".vcxproj", ".def", ".lib", ".a"}


def is_source(path: Path) -> bool:
    """Tell whether a compiler, a linker or a build reads a file; what they write may lie about."""
    name = _as_windows_has_it(path.name)
    if name.endswith(PRECOMPILED):
        return True
    return path.is_file() and (PurePosixPath(name).suffix in SOURCES or name in BUILD_FILES)


def is_taken_for(name: str, generated: Set[str]) -> bool:
    """Tell whether a build may take a file for one of those generated, or make that one from it.

    Names are without folders, those generated in lower case: Windows and macOS take no account of it.

    Examples
    --------
    >>> is_taken_for("Makefile.sh", {"makefile"}), is_taken_for("DZ_COMP.H", {"dz_comp.h"})
    (True, True)
    """
    found = _as_windows_has_it(name)
    for ending in (*PRECOMPILED, *MADE_FROM):
        found = found.removesuffix(ending)
    found = found if found in generated else found.removeprefix("s.")  # of SCCS
    return found in generated and PurePosixPath(found).suffix not in DOCUMENTS


def is_built(path: Path) -> bool:
    """Tell whether a file is what a build writes."""
    return path.suffix.lower() in BUILT and path.is_file()


def is_written_by_cmake(path: Path) -> bool:
    """Tell whether CMake writes such a file; a header is none, so whoever has one there put it there."""
    return path.name.lower() in CMAKE_FILES or path.suffix.lower() in CMAKE_ENDINGS


def _as_windows_has_it(name: str) -> str:
    """Return a name as a system has it that takes no account of case, and of points and blanks at the end."""
    return name.casefold().rstrip(" .")
