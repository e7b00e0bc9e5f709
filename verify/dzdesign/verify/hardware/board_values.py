"""What of a board is the user's: dz_board.h as numbers, in one strict form; anything else is code of the user's."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dzdesign.core.errors import RequirementError, quoted
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify.folder import changed_board_files, user_files

BOARD_FILE = "dz_board.h"
#: What builds a target's firmware to run from flash, in one way or the other.
PROJECT_FILE, MAKEFILE = "dzdesign.projectspec", "Makefile"
#: Characters of a line that are shown.
SHOWN = 60

COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
VALUE = re.compile(
    r"\s*#ifndef (DZ_BOARD_\w+)\s*\n\s*#define \1\s+\(?(0[xX][0-9a-fA-F]+|\d+)[uU]?[lL]{0,2}\)?\s*\n\s*#endif", re.ASCII
)
DEFINE = re.compile(r"--define=(\w+)(?:=(\w+))?")
FLASH_BUILD = re.compile(r'<configuration name="FLASH" compilerBuildOptions="([^"]*)"')
WHOLE = re.compile(r"\s*#ifndef DZ_BOARD_H\s*\n\s*#define DZ_BOARD_H\s*\n(.*)#endif\s*", re.ASCII | re.DOTALL)


def read_board_values(text: str) -> Mapping[str, int] | None:
    """Return the values of a board by their names, without DZ_BOARD_; None where more than values stands there.

    Examples
    --------
    >>> text = "#ifndef DZ_BOARD_H\\n#define DZ_BOARD_H\\n{}#endif\\n"
    >>> read_board_values(text.format("#ifndef DZ_BOARD_TZ\\n#define DZ_BOARD_TZ 2u /* TZ2 */\\n#endif\\n"))
    {'TZ': 2}
    >>> read_board_values(text.format("int x;\\n")) is None
    True
    """
    plain = COMMENT.sub(" ", text.replace("\r\n", "\n"))
    whole = WHOLE.fullmatch(plain)
    if whole is None or VALUE.sub("", whole[1]).strip():
        return None
    found = [
        (name.removeprefix("DZ_BOARD_"), int(number, 0 if "x" in number.lower() else 10))
        for name, number in VALUE.findall(whole[1])
    ]
    return dict(found) if len(dict(found)) == len(found) else None


def beside_values(text: str) -> str:
    """Return the first line of a board's file that is more than a value, with its number.

    Examples
    --------
    >>> beside_values("#ifndef DZ_BOARD_H\\n#define DZ_BOARD_H\\n#define LED 34\\n#endif\\n")
    "line 3, '#define LED 34'"
    """
    plain = COMMENT.sub(lambda found: " " + "\n" * found[0].count("\n"), text.replace("\r\n", "\n"))
    value = re.compile(VALUE.pattern.lstrip("\\s*"), re.ASCII)
    plain = value.sub(lambda found: "\n" * found[0].count("\n"), plain)
    for number, line in enumerate(plain.splitlines(), start=1):
        if line.strip() and not re.fullmatch(r"\s*#(?:ifndef DZ_BOARD_\w+|define DZ_BOARD_H|endif)\s*", line):
            return f"line {number}, {quoted(line.strip()[:SHOWN])}"
    return "its first lines"


def defines_of(options: str) -> dict[str, str]:
    """Return what options of TI's compiler define.

    Examples
    --------
    >>> defines_of("-O2 --define=_FLASH --define=LARGE_MODEL=1")
    {'_FLASH': '1', 'LARGE_MODEL': '1'}
    """
    return {name: value or "1" for name, value in DEFINE.findall(options)}


def project_defines(makefile: str, project: str, own: str) -> dict[str, str]:
    """Return what the user's project file defines to run from flash: what both generated ones do, and more of his.

    Else it is a `RequirementError`.
    """
    of_makefile = defines_of(makefile)
    generated, of_own = (defines_of(" ".join(FLASH_BUILD.findall(text))) for text in (project, own))
    if generated != of_makefile or of_makefile.items() - of_own.items():
        there = of_own if generated == of_makefile else generated
        raise RequirementError(
            f"for FLASH {PROJECT_FILE} defines {', '.join(there) or 'nothing'}, "
            f"and {MAKEFILE} {', '.join(of_makefile) or 'nothing'}"
        )
    return of_own


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """The user's part of a firmware, as far as it is compiled and run."""

    values: Mapping[str, int]
    #: Texts of the makefile, the generated project file and the user's.
    projects: tuple[str, str, str]
    #: Names that the generated dz_board.h has, and the user's has not.
    lacking: tuple[str, ...] = ()
    #: The user's code to compile, by the generated file in whose place it stands.
    code: Mapping[Path, Path] = field(default_factory=dict)
    #: Names in the folder of what is taken from it.
    taken: tuple[str, ...] = ()


def board_of(folder: Path, code: Path, manifest: FirmwareManifest, *, with_code: bool) -> Board | None:
    """Return the board of a firmware folder, its C where that is asked for; None where there is no board without it.

    What is not taken from the folder is that of `code`, as it is generated now.
    """
    changed, header = changed_board_files(folder, manifest), f"{manifest.target}/{BOARD_FILE}"
    made, values = (
        read_board_values((place / header).read_text(encoding="utf-8", errors="replace"))
        for place in (code, folder if header in changed else code)
    )
    names = [*changed, *user_files(folder, manifest.files)]
    names = [name for name in names if name != header and name.endswith((".c", ".h"))]
    if made is None or values is None or (names and not with_code and code == folder):
        return None
    taken, project = names if with_code else [], f"{manifest.target}/{PROJECT_FILE}"
    places = (code / manifest.target / MAKEFILE, code / project, (folder if project in changed else code) / project)
    makefile, generated, own = (path.read_text(encoding="utf-8", errors="replace") for path in places)
    return Board(
        values=values,
        projects=(makefile, generated, own),
        lacking=tuple(sorted(made.keys() - values.keys())),
        code={code / name: (folder / name).resolve() for name in taken},
        taken=(*([header] if header in changed else []), *taken),
    )
