"""The folder of a firmware or of another output as it is given, and whether it holds what is generated now.

`reproduced` is the one check of text. The front door designs and generates again and hands the result over as a value,
for this room imports nothing of the generator. What is compiled and run afterwards is that text, in its own folder.
"""

import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import zip_longest
from pathlib import Path, PurePosixPath

from dzdesign.core.artefact_files import MANIFEST_NAME, check_inside, digest_of, manifest_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import MOST_RECORDING, family_of, read_bytes, reason_of
from dzdesign.core.errors import InputError, and_more, quoted
from dzdesign.core.placing import scratch_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest
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
#: What TI's CCS makes of a project that is built in place, and what our makefile builds in: no code of anybody's.
CCS_FOLDERS = {
    "debug",
    "release",
    "ram",
    "flash",
    ".settings",
    ".launches",
    "targetconfigs",
    "build_ram",
    "build_flash",
}
CCS_FILES = {".project", ".cproject", ".ccsproject"}
#: Files that a sentence names, and characters of a line that it shows.
MOST_NAMED, SHOWN = 3, 50
AGAIN = "make the folder again with `dzdesign codegen`, or write a target for code of your own"


def read_firmware_manifest(folder: Path) -> FirmwareManifest:
    """Return the manifest of a firmware folder.

    What is read, compiled and run afterwards are the files that it names, and C: each must be a file in this folder.
    """
    path = folder / MANIFEST_NAME
    if folder.is_file() or (folder.is_dir() and not path.exists()):
        found = "is a file" if folder.is_file() else f"has no {MANIFEST_NAME}"
        raise InputError(f"'{folder}' {found}, expected the firmware folder that `dzdesign codegen` writes; name that")
    manifest = read_artefact(read_bytes(path, "firmware manifest"), FirmwareManifest, str(path))
    check_inside(folder, [*manifest.files, *manifest.core], f"'{path}'")
    check_firmware_inside(folder)
    return manifest


def _check_readable(folder: Path) -> None:
    def refuse(error: OSError) -> None:
        if isinstance(error, FileNotFoundError):
            return  # said by what reads a file of it
        raise InputError(f"'{error.filename}' can't be read: {reason_of(error)}; change who may read it") from error

    for place, _, names in os.walk(folder, onerror=refuse):
        for name in names:
            path = os.path.join(place, name)
            if any("\ud800" <= letter <= "\udfff" for letter in name):
                raise InputError(f"'{quotable(path)}' has a name that is no text in UTF-8; rename it, or take it away")
            if os.path.exists(path) and not os.access(path, os.R_OK):
                raise InputError(f"'{path}' can't be read: no permission; change who may read it")
            if os.path.isfile(path) and os.path.getsize(path) > MOST_RECORDING:  # each is hashed
                raise InputError(f"'{path}' is larger than {MOST_RECORDING >> 20} MiB; take it out of the firmware")


def quotable(path: str) -> str:
    """Return a name with a mark for each byte that is no text."""
    return path.encode(errors="replace").decode()


def read_compensator(folder: Path) -> Compensator:
    """Return the compensator of a firmware folder."""
    path = folder / "compensator.json"
    return _compensator(read_bytes(path, "compensator of the firmware"), str(path))


@lru_cache(maxsize=1)
def _compensator(content: bytes, source: str) -> Compensator:
    """Read a compensator once for all checks of a firmware; nothing changes one."""
    return read_artefact(content, Compensator, source)


def check_firmware_inside(folder: Path) -> None:
    """Refuse a firmware folder whose C is not in it, or with a link: a build follows it, and no check looks behind.

    Refused is too what can't be read, here and now, and a name that no text can hold: nothing could be said of it.
    """
    _check_readable(folder)
    found = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*.[ch]"))]
    check_inside(folder, ["compensator.json", *found], f"'{folder}'")
    home = os.path.realpath(folder)
    for path in sorted(folder.rglob("*")):
        if os.path.realpath(path) != os.path.join(home, path.relative_to(folder)):  # also a junction of Windows
            raise InputError(f"'{path}' is a link, expected files and folders; replace it by what it points to")


def holds_output(folder: Path) -> bool:
    """Tell whether a folder is that of an output, and not of a C firmware or of nothing of ours."""
    manifest = manifest_of(Path(folder))
    return manifest is not None and family_of(manifest["schema"]) == family_of(schema_of(OutputManifest))


def read_output_manifest(folder: Path) -> OutputManifest:
    """Return the manifest of an output's folder; every file that it names must be one in this folder."""
    path = folder / MANIFEST_NAME
    manifest = read_artefact(read_bytes(path, "manifest of the output"), OutputManifest, str(path))
    check_inside(folder, manifest.files, f"'{path}'")
    check_firmware_inside(folder)
    return manifest


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


def as_generated(again: Regenerated | None, same: Check | None) -> bool:
    """Tell whether more of a folder is tried than its text: if that is what is generated now, or was not compared."""
    return again is None or (bool(again.files) and (same is None or same.holds is not False))


def reproduced(folder: Path, again: Regenerated | None) -> Check:
    """Tell whether a folder holds what is generated now; of what does not, the first difference.

    Where the same text was generated from numbers of which nobody knows whether they follow, it is not checked, nor
    where nothing was generated to compare it with.
    """
    if again is None:
        return REPRODUCED.check(holds=None, text="nothing was generated to compare the folder with")
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
    """Return the source files that were not generated, but for what CMake and CCS make where they build."""
    ours = {parent for name in generated for parent in (folder / name).parents}
    built = {path.parent for path in folder.rglob("CMakeCache.txt")} - ours
    with_ccs = any(PurePosixPath(name).suffix == ".projectspec" for name in generated)
    built |= {path for path in folder.rglob("*") if with_ccs and path.name.casefold() in CCS_FOLDERS} - ours
    found = [path for path in sorted(folder.rglob("*")) if _is_source(path) and not built.intersection(path.parents)]
    found = [path for path in found if not (with_ccs and path.name.casefold() in CCS_FILES)]
    return [name for name in (path.relative_to(folder).as_posix() for path in found) if name not in generated]


def _is_source(path: Path) -> bool:
    name = path.name.casefold()
    return path.is_file() and (PurePosixPath(name).suffix in SOURCES or name in BUILD_FILES)
