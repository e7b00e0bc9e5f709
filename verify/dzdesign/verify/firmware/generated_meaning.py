"""Whether the generated C means the same with the user's headers as with those that codegen makes.

Each generated C file that a header of the user's may reach is compiled twice, with the makefile's options: where it
stands, and beside pristine headers. All tokens that come of generated files, as the preprocessor leaves them, must be
the same, and so must the code and the symbols of the objects: an attribute, a type or a pragma leaves no other trace.
"""

import posixpath
import re
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path, PurePosixPath

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.programs import find_program
from dzdesign.verify.firmware.compilation import COMPILERS, ELSEWHERE
from dzdesign.verify.firmware.object_code import ObjectCode, read_object
from dzdesign.verify.firmware.unchanged_files import USER_FOLDER
from dzdesign.verify.toolchain.host_compiler import build_folder, first_error, run_compiler

#: Where the preprocessor says of which line the next one comes.
MARKER = re.compile(r'# (\d+) "((?:[^"\\]|\\.)*)"')
INCLUDED = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|\w+|\S')
#: A macro of a board file that the user may give another value: a number by itself, which reads and sets nothing.
VALUE = re.compile(r"^#define (\w+) (\S.*)$", re.MULTILINE)
NUMBER = re.compile(r"(?:0[xX][0-9a-fA-F]+|\d+)[uUlL]*|uint(?:16|32)_t|unsigned|int|long|<<|>>|[-+*/%()~&|^]|\s+")
#: In such a number a cast to a pointer, which would read memory.
POINTER = re.compile(r"\*\s*\)")
#: Stands before the value of a macro.
PROBE = "dz_value_of_this_macro"
#: Headers of the user's that a sentence names.
MOST_NAMED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class MeaningCompared:
    """What the user's headers change, or why that was not compared; neither where they change nothing."""

    faults: tuple[str, ...] = ()
    not_compared: str = ""
    #: C files that were compared.
    compared: tuple[str, ...] = ()


class _NotCompared(Exception):
    """The compiler did not run, or lacks a header."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Token:
    text: str
    file: str
    line: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tree:
    """A firmware on disk, and how a C file of it is compiled."""

    root: Path
    #: The target's folder, in which the makefile stands.
    place: str
    command: tuple[str, ...]

    def run(self, source: str, *options: str) -> str:
        """Run the compiler on a C file, as make does in the target's folder; what the C code lacks is an error."""
        name = source if Path(source).is_absolute() else posixpath.relpath(source, self.place)
        try:
            done = run_compiler([*self.command, *options, name], self.root / self.place)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise _NotCompared(f"{self.command[0]} did not run on {source} ({type(error).__name__})") from error
        if done.returncode and (lost := ELSEWHERE.search(done.stderr)):
            raise _NotCompared(
                f"{lost[1]}, which your headers let {PurePosixPath(source).name} include, was not found, and may "
                "change what that file means; `verify --include DIR` with the folder in which it lies"
            )
        if done.returncode:
            raise RequirementError(f"{source} does not compile with your headers: {first_error(done.stderr)}")
        return done.stdout

    def tokens(self, source: str) -> list[_Token]:
        """Return what the preprocessor leaves of a C file and all that it includes."""
        found, file, line = [], source, 1
        for text in self.run(source, "-E").splitlines():
            if marker := MARKER.match(text):
                line, file = int(marker[1]), posixpath.normpath(posixpath.join(self.place, marker[2]))
                continue
            found += [_Token(text=word, file=file, line=line) for word in TOKEN.findall(text)]
            line += 1
        return found

    def object_code(self, source: str) -> ObjectCode:
        """Return the object of a C file."""
        with tempfile.TemporaryDirectory(dir=build_folder()) as folder:
            target = Path(folder) / "generated.o"
            self.run(source, "-c", "-o", str(target))
            return read_object(target.read_bytes())


def compare_meaning(
    folder: Path, target: str, generated: Mapping[str, str], board: frozenset[str], include: Sequence[Path] = ()
) -> MeaningCompared:
    """Compile each generated C file that the user's headers reach with them and without them.

    `generated` are the texts of all that codegen makes, `board` the names of those among them that the user may fill
    in, and `include` folders of headers beside. Only of a target whose board files can be compiled here.
    """
    compiler, *options = COMPILERS.get(target, ("",))
    code = {name: text for name, text in generated.items() if name.endswith((".c", ".h"))}
    headers = sorted(name for name in board if name.endswith(".h"))
    changed = [name for name in headers if _text_of(folder / name) != code[name]]
    sources = [name for name in sorted(code.keys() - board) if name.endswith(".c")]
    if not include:
        reached = {PurePosixPath(name).name for name in changed}
        sources = [name for name in sources if reached & _included(name, code)]
    if not compiler or not headers or not sources:
        return MeaningCompared()
    if not find_program(compiler):
        text = f"{compiler} is not on the path, so nothing tells whether your headers change what the generated C means"
        return MeaningCompared(not_compared=f"{text}; install it, then `verify`")
    place = posixpath.dirname(headers[0])
    folders = ("-I../core", "-I.", "-iquote", f"../{USER_FOLDER}")
    command = (compiler, *options, *folders)
    theirs = tuple(word for path in include for word in ("-isystem", str(path.resolve())))
    users = _Tree(root=folder, place=place, command=(*command, *theirs))
    ours = frozenset(code.keys() - board)
    try:
        pristine = tuple((code | _with_values(users, {name: code[name] for name in changed})).items())
        faults = [
            fault
            for source in sources
            for fault in _faults(users, source, ours, _pristine(source, pristine, place, command))
        ]
    except _NotCompared as error:
        return MeaningCompared(not_compared=str(error))
    except RequirementError as error:
        return MeaningCompared(faults=(str(error),))
    return MeaningCompared(faults=tuple(faults), compared=tuple(sources))


@cache
def _pristine(
    source: str, code: tuple[tuple[str, str], ...], place: str, command: tuple[str, ...]
) -> tuple[list[_Token], ObjectCode]:
    """Return tokens and object of a generated C file among generated files alone."""
    with tempfile.TemporaryDirectory(dir=build_folder()) as folder:
        for name, text in code:
            path = Path(folder) / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="")
        tree = _Tree(root=Path(folder), place=place, command=command)
        return tree.tokens(source), tree.object_code(source)


def _faults(
    users: _Tree, source: str, ours: frozenset[str], pristine: tuple[list[_Token], ObjectCode]
) -> Iterator[str]:
    """Yield what of one C file is otherwise with the user's headers: that it does not compile is one fault."""
    try:
        yield from _differences(users, source, ours, pristine)
    except RequirementError as error:
        yield str(error)


def _differences(
    users: _Tree, source: str, ours: frozenset[str], pristine: tuple[list[_Token], ObjectCode]
) -> Iterator[str]:
    """Yield the first token that is another one, or else a name whose code is."""
    tokens, usual = users.tokens(source), {each.file for each in pristine[0] if Path(each.file).is_absolute()}
    expected, found = ([each for each in some if each.file in ours] for some in (pristine[0], tokens))
    theirs = dict.fromkeys(each.file for each in tokens if each.file not in ours | usual)
    named = ", ".join([*theirs][:MOST_NAMED]) or "your headers"
    for before, now in zip(expected, found, strict=False):
        if (before.text, before.file) != (now.text, now.file):
            place = f"{before.file} line {before.line} of {source}"
            yield f"{place} reads '{now.text[:40]}' in place of '{before.text[:40]}' with {named}"
            return
    if len(expected) != len(found):
        first = max(expected, found, key=len)[min(len(expected), len(found))]
        how = "cut" if len(found) < len(expected) else "added"
        yield f"{first.file} line {first.line} of {source}: '{first.text[:40]}' is {how} with {named}"
        return
    names = sorted(pristine[1].differences(users.object_code(source)), key=lambda name: name.startswith("."))
    if names:
        name = names[0] if not names[0].startswith(".") else names[0].rpartition(".")[2]
        line = next((each.line for each in expected if each.file == source and each.text == name), 1)
        yield f"{source} line {line}, {name}: compiles to other code or to another symbol with {named}"


def _with_values(users: _Tree, headers: Mapping[str, str]) -> dict[str, str]:
    """Return the headers with the values that the user gave their macros; each must be a number."""
    given = dict(headers)
    for header, text in headers.items():
        for name, _ in VALUE.findall(text):
            with tempfile.TemporaryDirectory(dir=build_folder()) as folder:
                probe = Path(folder) / "value.c"
                probe.write_text(f'#include "{posixpath.basename(header)}"\n{PROBE} {name}\n', encoding="utf-8")
                value = users.run(str(probe), "-E", "-P").rpartition(PROBE)[2].strip()
            if NUMBER.sub("", value) or POINTER.search(value) or not value:
                raise RequirementError(f"{header} has '{value[:40]}' for {name}, expected a number")
            given[header] = re.sub(rf"(?m)^#define {name} .*$", f"#define {name} {value}", given[header])
    return given


def _included(name: str, code: Mapping[str, str]) -> set[str]:
    """Return the names, without folders, of all that a generated file includes, by itself or by another one."""
    by_name = {PurePosixPath(each).name: text for each, text in code.items()}
    found: set[str] = set()
    left = [PurePosixPath(name).name]
    while left:
        more = {*INCLUDED.findall(by_name.get(left.pop(), ""))} - found
        found |= more
        left += more
    return found


def _text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
