"""The one check of text: a folder against what is generated now from its compensator.json.

The front door designs and generates again and hands the result over as a value, for this room imports nothing of the
generator. What is compiled and run afterwards is that text, in a folder of its own.
"""

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path, PurePosixPath

from dzdesign.core.errors import and_more, quoted
from dzdesign.core.folder_contents import digest_of
from dzdesign.core.scratch import scratch_folder
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify.requirements import REPRODUCED, Check

#: Folder of a firmware for files of the user's own, beside those that were generated.
USER_FOLDER = "board"
#: Endings of what is compared octet for octet; anything else is text, of which a checkout may rewrite line endings.
BINARY = {".fmu", ".bin", ".hex"}
#: Endings of C, C++, assembly, libraries, linker files, scripts and projects: what a build of the target takes. Then
#: those of the other outputs.
SOURCES = {
    ".c", ".h", ".cc", ".cpp", ".cxx", ".hh", ".hpp", ".hxx", ".inc", ".inl", ".s", ".asm", ".cla", ".lib", ".a",
    ".ld", ".lds", ".lcf", ".icf", ".sct", ".cmd", ".def", ".mk", ".cmake", ".ninja", ".bat", ".props", ".targets",
    ".projectspec", ".ccxml", ".gel", ".syscfg", ".ioc", ".uvprojx", ".ewp", ".vcxproj",
    ".st", ".xml", ".tcpou", ".m", ".p", ".mexa64", ".mexw64", ".mexmaci64", ".mexmaca64", ".fmu",
}  # fmt: skip
BUILD_FILES = {"makefile", "gnumakefile", "cmakelists.txt", ".project", ".cproject", ".ccsproject"}
#: Files that a sentence names, and characters of a line that it shows.
MOST_NAMED, SHOWN = 3, 50
AGAIN = "make the folder again with `dzdesign codegen`, or write a target for code of your own"


@dataclass(frozen=True, slots=True, kw_only=True)
class Regenerated:
    """A firmware or another output as it is generated now, and what is wrong with its numbers."""

    #: Path to content, the manifest among them; empty where none was generated.
    files: Mapping[str, bytes] = field(default_factory=dict)
    #: Those that are their user's to fill in.
    board: frozenset[str] = frozenset()
    #: What does not follow in words, or why that is not known.
    fault: str = ""
    unknown: str = ""

    @contextmanager
    def written(self) -> Iterator[Path]:
        """Give a folder with the text that is compiled and run."""
        with scratch_folder() as scratch:
            for name, content in self.files.items():
                path = scratch / "code" / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
            yield scratch / "code"


def reproduced(folder: Path, again: Regenerated) -> Check:
    """Tell whether a folder holds what is generated now; of what does not, the first difference.

    Where the same text was generated from numbers of which nobody knows whether they follow, it is not checked.
    """
    if again.fault:
        return REPRODUCED.check(holds=False, text=again.fault)
    if not again.files:
        return REPRODUCED.check(holds=None, text=again.unknown)
    compared = sorted(again.files.keys() - again.board, key=lambda name: (name != "compensator.json", name))
    changed = [name for name in compared if _differs(folder / name, again.files[name])]
    if changed:
        first = changed[0]
        found = f"{first}{_place(folder / first, again.files[first])}"
        more = f"; {and_more(changed[1:], MOST_NAMED)} {'differ' if changed[2:] else 'differs'} too" * bool(changed[1:])
        return REPRODUCED.check(holds=False, text=f"{found}{more}; {AGAIN}")
    if fault := _added_fault(folder, again.files):
        return REPRODUCED.check(holds=False, text=fault)
    if again.unknown:
        return REPRODUCED.check(holds=None, text=again.unknown)
    text = f"designed and generated again: {len(compared)} files are the same, line by line"
    return REPRODUCED.check(holds=True, text=text)


def differing_files(folder: Path, manifest: FirmwareManifest) -> dict[str, str]:
    """Return the SHA-256 of each file that was changed or added since it was generated: as it was verified."""
    there = {name: _digest(folder / name) for name in (*manifest.files, *added_files(folder, manifest.files))}
    return {name: digest for name, digest in sorted(there.items()) if digest not in ("", manifest.files.get(name))}


def _digest(path: Path) -> str:
    return digest_of(path) if path.is_file() else ""


def changed_board_files(folder: Path, manifest: FirmwareManifest) -> tuple[str, ...]:
    """Return the files that the user fills in and that are no longer as generated."""
    return tuple(name for name in differing_files(folder, manifest) if name in manifest.board)


def user_files(folder: Path, generated: Collection[str]) -> tuple[str, ...]:
    """Return the source files of the user's own: those in the folder kept for them, in which nothing is generated."""
    return tuple(name for name in added_files(folder, generated) if name.startswith(f"{USER_FOLDER}/"))


def _differs(path: Path, generated: bytes) -> bool:
    return not path.is_file() or _content(path, path.read_bytes()) != _content(path, generated)


def _content(path: Path, content: bytes) -> bytes:
    return content if path.suffix in BINARY else content.replace(b"\r\n", b"\n")


def _place(path: Path, generated: bytes) -> str:
    """Say where a file differs, and how."""
    if not path.is_file():
        return " is missing"
    if path.suffix in BINARY:
        pairs = enumerate(zip_longest(path.read_bytes(), generated))
        return f" differs from octet {next(place for place, (one, other) in pairs if one != other)} on"
    lines = [_content(path, each).decode(errors="replace").split("\n") for each in (path.read_bytes(), generated)]
    rows = enumerate(zip_longest(*lines), start=1)
    number, (there, expected) = next((number, row) for number, row in rows if row[0] != row[1])
    return f", line {number} is {_words(there)}, generated now: {_words(expected)}"


def _words(line: str | None) -> str:
    if line is None:
        return "missing"
    return quoted(line.strip()[:SHOWN]) if line.strip() else "blank"


def _added_fault(folder: Path, generated: Collection[str]) -> str:
    """Return what is wrong with the source files that were not generated, or an empty text."""
    names = {PurePosixPath(name).name.casefold() for name in generated}
    added, own = added_files(folder, generated), user_files(folder, generated)
    if shadows := [name for name in added if PurePosixPath(name).name.casefold() in names]:
        return (
            f"{', '.join(shadows)}: not generated, but a compiler may take it for the generated file of the same name; "
            "rename it"
        )
    if others := [name for name in added if name not in own]:
        place = f"keep your own source and project files in {USER_FOLDER}/, beside core/, or outside the folder"
        return f"not generated: {and_more(others, MOST_NAMED)}; {place}"
    return ""


def added_files(folder: Path, generated: Collection[str]) -> list[str]:
    """Return the source files that were not generated, but for those in folders that CMake builds in."""
    ours = {parent for name in generated for parent in (folder / name).parents}
    built = {path.parent for path in folder.rglob("CMakeCache.txt")} - ours
    found = [path for path in sorted(folder.rglob("*")) if _is_source(path) and not built.intersection(path.parents)]
    return [name for name in (path.relative_to(folder).as_posix() for path in found) if name not in generated]


def _is_source(path: Path) -> bool:
    name = path.name.casefold()
    return path.is_file() and (PurePosixPath(name).suffix in SOURCES or name in BUILD_FILES)
