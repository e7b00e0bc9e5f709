"""The user's headers and linker files: they may not change what the generated C means, which includes them."""

import re
from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

from dzdesign.core.artefact_files import read_bytes
from dzdesign.verify.firmware.build_inputs import SOURCES

#: Texts are kept: what looks like a comment in one is none.
COMMENT = re.compile(r"""("(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')|/\*.*?\*/|//[^\n]*""", re.DOTALL)
#: A line that goes on, as C and its trigraphs write it.
CONTINUED = re.compile(r"(?:\\|\?\?/)[ \t]*\r?\n")
HASH, BLANK = r"^[^\S\n]*(?:#|%:|\?\?=)[^\S\n]*", r"[^\S\n]*"
MACRO = re.compile(rf"{HASH}(?:define|undef){BLANK}(\w+)", re.MULTILINE)
INCLUDE = re.compile(rf"{HASH}(?:include_next|include|import){BLANK}([^\n]*)", re.MULTILINE)
INCLUDED_SCRIPT = re.compile(r"\bINCLUDE\s+(\S+)")
NAME = re.compile(r"[A-Za-z_]\w*")
FUNCTION = re.compile(r"\b(dz_\w+)\s*\(")
#: A symbol that a linker file gives an address, over that of the C code; its name may stand in quotes.
ASSIGNED = re.compile(r"\b(\w+)\"?\s*(?:[-+*/&|]|<<|>>)?=(?!=)")
#: A file that a linker file has linked beside those of the command.
LINKED = re.compile(r"\b(?:INPUT|GROUP|STARTUP|AS_NEEDED)\s*\(([^)]*)\)")
#: Where a linker file lets a program begin, what it leaves out, and what it gives no place in memory or does not load.
ENTERED = re.compile(r"\bENTRY\s*\(\s*\"?([^\s\")]+)\"?\s*\)")
LEFT_OUT = re.compile(r"(/DISCARD/\s*|\(\s*(?:NOLOAD|DSECT|COPY|INFO|OVERLAY)\s*\)\s*):[^{]*\{([^}]*)\}")
#: There a pattern of files with its patterns of sections, once exceptions and sorting are taken out.
EXCEPT = re.compile(r"EXCLUDE_FILE\s*\([^)]*\)")
SORTED = re.compile(r"\b(?:SORT\w*|KEEP)\s*\(((?:[^()]|\([^()]*\))*)\)")
OF_FILES = re.compile(r"([^\s()]*)\s*\(([^()]*)\)")
#: A function of C or a label of assembly; the one that a reset leads to.
DEFINED, RESET = re.compile(r"\b(\w+)\s*\([^;{}()]*\)\s*\{|^\s*(\w+):", re.MULTILINE), "dz_reset"
#: Sections that a compiler may put generated code and constants in, one for each name.
WITH_CODE = (".text", ".rodata", ".data", ".vectors")
#: How the members of the structs behind it are laid out.
PACKED = re.compile(rf"(?:{HASH}pragma|_Pragma\s*\(\s*\"){BLANK}(?:\w+{BLANK})?pack\s*\(([^)]*)\)", re.MULTILINE)
UNPACKED = ("", "pop")
LINKER_FILES = {".ld", ".lds", ".lcf", ".icf", ".sct", ".cmd"}
QUOTES = "\"'"
C_FILES = {".c", ".s", ".asm"}


def interference(folder: Path, names: list[str], generated: Mapping[str, str], board: frozenset[str]) -> Iterator[str]:
    """Yield in which file of the user's something stands that changes what the generated C means or where it lies.

    `names` are the user's files, `generated` the texts of all that codegen makes and `board` those of them that are for
    the user to fill in: what was generated there may stay. The core's C includes no file of the user's. A C file of the
    user's is compiled by itself, and what it does is not looked at, but for what it includes.
    """
    code = {name: _without_comments(text) for name, text in generated.items() if name.endswith((".c", ".h"))}
    reached = {name for name in code if name not in board and not (name.startswith("core/") and name.endswith(".c"))}
    used = {word for name in reached for word in NAME.findall(code[name])}
    functions = {word for text in code.values() for word in FUNCTION.findall(text)}
    words = {word for text in code.values() for word in NAME.findall(text)}
    sections = {*WITH_CODE, *(f"{kind}.{word}" for kind in WITH_CODE for word in words)}
    entries = {word for name in names for word in _entries(folder / name, generated.get(name))}
    for name in names:
        path = folder / name
        if not path.is_file():
            continue
        text = _without_comments(_text_of(path))
        before = _without_comments(generated.get(name, ""))
        yield from (f"{name} {fault}" for fault in _faults(path, text, before, used, functions))
        if path.suffix.lower() in LINKER_FILES:
            yield from (f"{name} {fault}" for fault in _unplaced(text, sections, entries))
        yield from (f"{name} includes {found}" for found in _odd_includes(path, text, folder))


def _text_of(path: Path) -> str:
    """Return a file's text, its lines ended alike; one that no person writes, so large is it, is refused."""
    text = read_bytes(path, "file of the firmware").decode(errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _faults(path: Path, text: str, before: str, used: set[str], functions: set[str]) -> Iterator[str]:
    """Yield what a file of the user's changes."""
    ending = path.suffix.lower()
    if ending in LINKER_FILES:
        for word in sorted({*ASSIGNED.findall(text)} & functions - {*ASSIGNED.findall(before)}):
            yield f"gives {word} another address"
        for word in re.split(r"[\s,]+", " ".join(LINKED.findall(text))):
            if word and (path.parent / word.strip(QUOTES)).is_file():
                yield f"links {word.strip(QUOTES)}, which no check has looked at; have it built from a C file in board/"
        return
    if ending in C_FILES:
        return
    packed = [found.strip() for found in PACKED.findall(text)]
    if packed and packed[-1] not in UNPACKED:
        yield f"leaves pack({packed[-1]}) in force, under which structs of the generated C lie otherwise; end with pop"
    macros = {*MACRO.findall(text)} - {*MACRO.findall(before)}
    for word in sorted(macros & used):
        yield f"makes {word}, which the generated C uses, a macro"
    for word in sorted({*NAME.findall(text)} & functions - {*NAME.findall(before)} - macros):
        yield f"has {word}, a function of the generated C; call it from a C file"


def _unplaced(text: str, sections: Iterable[str], entries: set[str]) -> Iterator[str]:
    """Yield what a linker file leaves out of the program or does not load of generated C, and an odd entry of it."""
    for kind, body in LEFT_OUT.findall(text):
        plain = SORTED.sub(r"\1", SORTED.sub(r"\1", EXCEPT.sub(" ", body)))
        patterns = [word for files, words in OF_FILES.findall(plain) if ".a" not in files for word in words.split()]
        found = next((word.strip(QUOTES) for word in patterns if _matches(word.strip(QUOTES), sections)), "")
        if found:
            yield f"{'discards' if 'DISCARD' in kind else 'does not load'} {found}, in which generated code may lie"
    for word in ENTERED.findall(text):
        if word not in entries:
            yield f"enters at {word}, which no start-up file in the firmware defines; put yours into board/"


def _matches(pattern: str, sections: Iterable[str]) -> bool:
    return any(fnmatchcase(section, pattern) for section in sections)


def _entries(path: Path, before: str | None) -> Iterator[str]:
    """Yield the functions of a C or assembly file of the user's; of one as generated only that of a reset."""
    if path.suffix.lower() in C_FILES and path.is_file():
        text = _text_of(path)
        defined = DEFINED.findall(_without_comments(text))
        yield from (name for pair in defined for name in pair if name and (text != before or name == RESET))


def _odd_includes(path: Path, text: str, folder: Path) -> Iterator[str]:
    """Yield what is included of the firmware's folder and is not looked at here, by its ending or by a macro."""
    places = {path.parent, folder, *(place for place in folder.iterdir() if place.is_dir())}
    if path.suffix.lower() in LINKER_FILES:
        words = [f'"{word.strip(QUOTES)}"' for word in INCLUDED_SCRIPT.findall(text)]
    else:
        words = INCLUDE.findall(text)
    for word in words:
        if word[:1] not in ('"', "<"):
            yield f"by the macro {word.strip()[:40]}, which is not followed; write the header's name"
            continue
        name = word[1:].partition('"' if word[0] == '"' else ">")[0]
        if any((place / name).is_file() for place in places) and PurePosixPath(name).suffix.lower() not in SOURCES:
            yield f"{name}, which is no header by its ending"


def _without_comments(text: str) -> str:
    return COMMENT.sub(lambda found: found[1] or " ", CONTINUED.sub("", text))
