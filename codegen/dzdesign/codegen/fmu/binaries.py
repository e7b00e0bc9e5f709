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

from dzdesign.codegen.fmu.description import SOURCE, Fmi
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
    """Where an FMU runs: ziglang's name of it, the folders of the binaries in FMI 2 and 3, and their ending."""

    triple: str
    folders: Mapping[Fmi, str]
    ending: str


#: FMI 2 has no names for processors but those of the PC.
PLATFORMS = (
    Platform(triple="x86_64-linux-gnu", folders={2: "linux64", 3: "x86_64-linux"}, ending="so"),
    Platform(triple="aarch64-linux-gnu", folders={3: "aarch64-linux"}, ending="so"),
    Platform(triple="x86_64-windows-gnu", folders={2: "win64", 3: "x86_64-windows"}, ending="dll"),
    Platform(triple="x86_64-macos", folders={2: "darwin64", 3: "x86_64-darwin"}, ending="dylib"),
    Platform(triple="aarch64-macos", folders={3: "aarch64-darwin"}, ending="dylib"),
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


def binaries_of(identifier: str, fmi: Fmi, sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """Compile the sources for every platform of a version of FMI; path in the FMU to bytes."""
    ziglang_version()
    wanted = [each for each in PLATFORMS if fmi in each.folders]
    with scratch_folder() as folder, ThreadPoolExecutor(WORKERS) as pool:
        for name, content in sources.items():
            (folder / name).write_bytes(content)
        (folder / NO_LIBRARY).mkdir()
        (folder / NO_LIBRARY / "stdlib.h").write_bytes(b"")
        compiled = pool.map(lambda platform: _compiled(folder, identifier, platform), wanted)
        return {
            f"binaries/{platform.folders[fmi]}/{identifier}.{platform.ending}": content
            for platform, content in zip(wanted, compiled, strict=True)
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
