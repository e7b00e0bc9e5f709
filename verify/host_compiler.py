"""The host's C compiler: C in, a loaded shared library out, named by its content so that no stale code can run."""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from dzdesign.core.artefacts import sha256_of
from dzdesign.core.errors import InputError, RequirementError

#: What the generated core must bear without a word.
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror")
TIMEOUT_S = 120


@cache
def _build_folder() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="dzdesign-", ignore_cleanup_errors=True)


def build_folder() -> Path:
    """Return the folder that everything is built in; it goes when the process ends."""
    return Path(_build_folder().name)


def find_compilers() -> tuple[str, ...]:
    """Return the C compilers on this machine, the one to use first: $CC, then cc, gcc, clang."""
    wanted = (os.environ.get("CC"), "cc", "gcc", "clang")
    found = {shutil.which(name): None for name in wanted if name and shutil.which(name)}
    return tuple(found)


def host_compiler() -> str:
    """Return the C compiler to use.

    Raises
    ------
    InputError
        If there is none, with what to do.
    """
    compilers = find_compilers()
    if not compilers:
        raise InputError(
            "no C compiler was found (tried $CC, cc, gcc, clang); install one, for example "
            "`apt install gcc`, `xcode-select --install`, or on Windows `winget install LLVM.LLVM`"
        )
    return compilers[0]


def _run(command: list[str], what: str) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RequirementError(f"{what} could not be compiled: {error}") from error
    if done.returncode:
        first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip()[:300])
        raise RequirementError(f"{what} does not compile: {first}")


def check_strictly(source: Path, compiler: str, options: Sequence[str] = ()) -> None:
    """Compile one file with every warning an error, and with further options.

    Raises
    ------
    RequirementError
        With the compiler's first complaint.
    """
    target = Path(_build_folder().name) / "strict.o"
    command = [compiler, *STRICT, "-O2", *options, "-c", str(source), "-o", str(target)]
    _run(command, f"{source.name} ({Path(compiler).name})")


def load_library(sources: Mapping[str, str], what: str, options: Sequence[str] = ()) -> ctypes.CDLL:
    """Compile C files together and load them.

    Parameters
    ----------
    sources : mapping
        File name to text; headers may be among them.
    what : str
        For messages.
    options : sequence of str
        Further options of the compiler.

    Returns
    -------
    ctypes.CDLL
    """
    compiler = host_compiler()
    key = sha256_of(
        "\0".join([compiler, *options, *(f"{name}\0{text}" for name, text in sorted(sources.items()))]).encode(
            errors="surrogateescape"
        )
    )
    folder = Path(_build_folder().name) / key[:32]
    library = folder / f"{key[:32]}{'.dll' if sys.platform == 'win32' else '.so'}"
    if not library.exists():
        folder.mkdir(exist_ok=True)
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="utf-8", errors="surrogateescape")
        units = [str(folder / name) for name in sources if name.endswith(".c")]
        position = [] if sys.platform == "win32" else ["-fPIC"]
        _run([compiler, "-std=c99", "-O2", *options, *position, "-shared", *units, "-o", str(library), "-lm"], what)
    try:
        return ctypes.CDLL(str(library))
    except OSError as error:
        raise RequirementError(f"{what} does not link: {str(error).rpartition(': ')[2]}") from error
