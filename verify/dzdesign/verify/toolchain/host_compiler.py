"""The host's C compiler: C in, programs out, named by their content so that no stale code can run.

Where a machine has no compiler, Zig's serves: a clang with its own headers and linker, in the wheel `ziglang`.
"""

import importlib.util
import logging
import os
import shlex
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock

import platformdirs

from dzdesign.core.documents import sha256_of_octets
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.placing import process_folder
from dzdesign.core.processes import find_program, run_program

#: What the generated core must bear without a word.
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror")
#: The first program for another system takes a minute or more: Zig builds its C library.
TIMEOUT_S = 300
#: What `zig cc` must be told to be a compiler as others are: not to write debug information (it holds the folder's
#: name, so that equal sources gave unequal objects), to compile for every processor of the kind and not for this one,
#: and to build no traps into what is undefined (it does so where it is not told to optimize).
LIKE_OTHERS = ("-g0", "-mcpu=baseline", "-fno-sanitize=undefined")
#: Variables by which gcc and clang take other headers or options than those of the command.
REDIRECTING = ("CPATH", "C_INCLUDE_PATH", "CCC_OVERRIDE_OPTIONS")

logger = logging.getLogger(__name__)


def build_folder() -> Path:
    """Return the folder that everything is built in; it goes when the process ends."""
    return process_folder()


def find_compilers() -> tuple[str, ...]:
    """Return the C compilers on this machine, the one to use first: $CC, then cc, gcc, clang; where none is, Zig.

    Each as a person would write it: a path, or with $CC words such as ``ccache gcc``.
    """
    wanted = (_found(name) for name in (os.environ.get("CC"), "cc", "gcc", "clang") if name)
    if (named := os.environ.get("CC")) and not _found(named):
        raise InputError(f"$CC is {named!r}, and there is no such program; correct or unset it")
    found = tuple(dict.fromkeys(compiler for compiler in wanted if compiler))
    return found or ((zig,) if (zig := find_zig()) else ())


def _found(name: str) -> str | None:
    """Return the path of a program, or several words as they are if the first one is a program."""
    path = find_program(name)
    try:
        words = [] if path else shlex.split(name, posix=os.name != "nt")
    except ValueError as error:
        raise InputError(f"$CC is {name!r}, which is no compiler's command ({error}); correct or unset it") from error
    return path or (name if len(words) > 1 and find_program(words[0]) else None)


def find_zig() -> str | None:
    """Return Zig's program, of the path or of the package `ziglang`, or None."""
    path = find_program("zig")
    spec = None if path else importlib.util.find_spec("ziglang")
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        path = path or find_program("zig", [folder])
    return path


def words_of(compiler: str) -> tuple[str, ...]:
    """Return how a command with a compiler begins.

    Examples
    --------
    >>> words_of("/opt/zig/zig")
    ('/opt/zig/zig', 'cc', '-g0', '-mcpu=baseline', '-fno-sanitize=undefined')
    """
    words = (compiler,) if find_program(compiler) else tuple(shlex.split(compiler, posix=os.name != "nt"))
    if Path(words[-1]).stem == "zig":
        return (*words, "cc", *LIKE_OTHERS)
    return (*words, *LIKE_OTHERS) if [Path(word).stem for word in words[-2:]] == ["zig", "cc"] else words


def environment() -> dict[str, str]:
    """Return the environment of a compiler: Zig keeps its C library in the user's cache, and what it builds with ours.

    Without a home it would refuse to work; with ours for all it would build the C library at every start, for seconds.
    What would have the same command compile other C is left out.
    """
    kept = platformdirs.user_cache_path("dzdesign", appauthor=False) / "zig"
    try:
        kept.mkdir(parents=True, exist_ok=True)
        may_write = os.access(kept, os.W_OK)
    except OSError:
        may_write = False
    ours = {
        "ZIG_GLOBAL_CACHE_DIR": str(kept if may_write else build_folder() / "zig"),
        "ZIG_LOCAL_CACHE_DIR": str(build_folder() / "zig"),
    }
    others = {name: value for name, value in os.environ.items() if name not in REDIRECTING}
    return {**ours, **others, "TMPDIR": str(build_folder())}  # what a compiler that is killed leaves goes with ours


def host_compiler() -> str:
    """Return the C compiler to use; where there is none, or $CC is none, an `InputError` says what to do."""
    compilers = find_compilers()
    if not compilers:
        raise InputError(
            "no C compiler was found (tried $CC, cc, gcc, clang, zig); install one, for example "
            "`pip install ziglang` into this environment, `apt install gcc`, `xcode-select --install`, or on "
            "Windows `winget install LLVM.LLVM`; `dzdesign doctor` says what is there"
        )
    return compilers[0]


def run_compiler(command: Sequence[str], folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a compiler, and log the command; whoever calls decides what one means that can't be run or does not end."""
    begin = time.perf_counter()
    done = run_program(command, cwd=folder, timeout=TIMEOUT_S, env=environment())
    logger.debug("%s (%.3f s)", shlex.join(command), time.perf_counter() - begin)
    return done


def first_error(messages: str) -> str:
    """Return the first complaint in what a compiler or linker wrote."""
    lines = messages.splitlines()
    first = (line for line in lines if "error" in line or "undefined reference" in line)
    return next(first, messages.strip()[:300])


def build(command: Sequence[str], what: str, folder: Path | None = None) -> None:
    """Compile or link; the compiler's first complaint is a `RequirementError`."""
    try:
        done = run_compiler(command, folder)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RequirementError(f"{what} could not be compiled: {error}") from error
    if done.returncode:
        raise RequirementError(f"{what} does not compile: {first_error(done.stderr)}")


def name_of(compiler: str) -> str:
    """Return a compiler as a person calls it: without its folder, but with the words that $CC adds."""
    return Path(compiler).name if find_program(compiler) else compiler


def check_strictly(source: Path, compiler: str, options: Sequence[str] = ()) -> None:
    """Compile one file with every warning an error, and with further options."""
    target = build_folder() / "strict.o"
    command = [*words_of(compiler), *STRICT, "-O2", *options, "-c", str(source), "-o", str(target)]
    build(command, f"{source.name} ({name_of(compiler)})")


_guard = Lock()
_locks: dict[Path, Lock] = {}


def alone(file: Path) -> Lock:
    """Return the lock of a file: mutants are built side by side, and share what is the same."""
    with _guard:
        return _locks.setdefault(file, Lock())


def built(name: str, command: Sequence[str], sources: Mapping[str, bytes], what: str) -> Path:
    """Return the file `name` that a command makes beside `sources`, made once, in a folder named by all of it.

    The command names no output; a file that is there is whole.
    """
    parts = [part for source in sorted(sources.items()) for part in (source[0].encode(), source[1])]
    folder = build_folder() / sha256_of_octets(b"\0".join([*parts, *map(os.fsencode, command), name.encode()]))[:32]
    with alone(folder):
        if not (folder / name).exists():
            folder.mkdir(exist_ok=True)
            for each, text in sources.items():
                (folder / each).write_bytes(text)
            build([*command, "-o", f"new-{name}"], what, folder)
            if not (folder / f"new-{name}").is_file():
                raise RequirementError(
                    f"{what} was not compiled: `{shlex.join(command[:2])} ...` ended well and wrote nothing; set $CC "
                    "to a C compiler, without options by which it does not compile or link"
                )
            (folder / f"new-{name}").replace(folder / name)
    return folder / name
