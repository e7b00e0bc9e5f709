"""Binaries of an FMU for every platform, compiled by ziglang from one machine; they need no library."""

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from dzdesign.codegen.fmu.description import SOURCE
from dzdesign.core.errors import MissingToolError
from dzdesign.core.processes.running import run_program
from dzdesign.core.scratch import scratch_folder

#: As in the checked core: no contraction to fused products, so that every processor gives the same digits.
FLAGS = (
    "-O2", "-std=c99", "-shared", "-fPIC", "-nostdlib", "-g0", "-s", "-fvisibility=hidden", "-ffp-contract=off",
    "-fno-sanitize=all", "-fno-stack-protector", "-Wall", "-Wextra", "-Werror",
)  # fmt: skip
#: Of ziglang: 0.13 wants a library's entry point of every DLL.
OLDEST = (0, 17)
#: Folder with an empty stdlib.h, which the standard's headers include and need nothing of.
NO_LIBRARY = "no_library"
#: Seconds; the first compilation for a platform fills ziglang's cache.
LONGEST_S = 300
#: Variables by which the compiler takes other headers or options than those of the command.
REDIRECTING = ("CPATH", "C_INCLUDE_PATH", "CCC_OVERRIDE_OPTIONS")
#: Compilers side by side.
WORKERS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Platform:
    """Where an FMU runs: ziglang's name of it, the folder of its binary, and that one's ending."""

    triple: str
    folder: str
    ending: str


#: FMI 2.0.4 (2.3) takes the names of FMI 3 for all processors but those of the PC.
PLATFORMS = (
    Platform(triple="x86_64-linux-gnu", folder="linux64", ending="so"),
    Platform(triple="aarch64-linux-gnu", folder="aarch64-linux", ending="so"),
    Platform(triple="x86_64-windows-gnu", folder="win64", ending="dll"),
    Platform(triple="x86_64-macos", folder="darwin64", ending="dylib"),
    Platform(triple="aarch64-macos", folder="aarch64-darwin", ending="dylib"),
)  # fmt: skip


def ziglang_version() -> str:
    """Return the version of ziglang; without it the `MissingToolError` says how to install it."""
    return _version()


@cache
def _version() -> str:
    if find_spec("ziglang") is None:
        raise MissingToolError(
            'binaries of an FMU are compiled by ziglang, which is not installed; run `pip install "ziglang>=0.17"`'
        )
    found = version("ziglang")
    if tuple(int(part) for part in re.findall(r"\d+", found)[:2]) < OLDEST:
        raise MissingToolError(
            f"ziglang {found} can't link the FMUs' binaries without a library, expected {OLDEST[0]}.{OLDEST[1]} or "
            'later; run `pip install --upgrade "ziglang>=0.17"`'
        )
    return found


def binaries_of(identifier: str, sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """Compile the sources for every platform; path in the FMU to bytes."""
    ziglang_version()
    with scratch_folder() as folder, ThreadPoolExecutor(WORKERS) as pool:
        for name, content in sources.items():
            (folder / name).write_bytes(content)
        (folder / NO_LIBRARY).mkdir()
        (folder / NO_LIBRARY / "stdlib.h").write_bytes(b"")
        compiled = pool.map(lambda platform: _compiled(folder, identifier, platform), PLATFORMS)
        return {
            f"binaries/{platform.folder}/{identifier}.{platform.ending}": content
            for platform, content in zip(PLATFORMS, compiled, strict=True)
        }


def _compiled(folder: Path, identifier: str, platform: Platform) -> bytes:
    """Compile for one platform, in a folder of its own, so that its names are the same each time."""
    made = folder / platform.triple
    made.mkdir()
    name = f"{identifier}.{platform.ending}"
    named = {
        "so": (f"-Wl,-soname,{name}", "-Wl,-z,noexecstack"),
        "dll": ("-Wl,--no-entry",),
        "dylib": (f"-Wl,-install_name,@rpath/{name}",),
    }
    command = [
        sys.executable, "-P", "-m", "ziglang", "cc", "-target", platform.triple, *FLAGS,
        *named[platform.ending], "-I.", "-isystem", NO_LIBRARY, SOURCE, "-o", f"{platform.triple}/{name}",
    ]  # fmt: skip
    try:
        done = run_program(
            command, cwd=folder, timeout=LONGEST_S,
            env={name: value for name, value in os.environ.items() if name not in REDIRECTING},
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise MissingToolError(f"ziglang can't compile the FMU for {platform.triple}: {error}") from error
    if done.returncode:
        said = " ".join(done.stderr.split())[:400]
        raise MissingToolError(f"ziglang can't compile the FMU for {platform.triple}: {said}")
    return (made / name).read_bytes()
