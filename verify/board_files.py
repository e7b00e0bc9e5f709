"""The files of a firmware that its user fills in: which of them were changed, and whether they compile."""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dzdesign.core.artefacts import sha256_of
from dzdesign.verify.checks import Check
from dzdesign.verify.host_compiler import build_folder, run_compiler
from dzdesign.verify.machines import CORTEX_M4

COMPILES = "your board files compile"
#: Compiler and options of a target whose board files can be compiled without a vendor's library.
COMPILERS = {"cortex-m4": (CORTEX_M4.compiler, *CORTEX_M4.core_flags)}
#: How a compiler says that a header lies elsewhere: with which options it is found only its user knows.
ELSEWHERE = "No such file or directory"


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardFile:
    """A file that the user fills in: its name in the firmware folder, and whether it is no longer as generated."""

    name: str
    changed: bool


def board_files(folder: Path, manifest: dict[str, Any]) -> tuple[BoardFile, ...]:
    """Return the files that the manifest calls the user's.

    Parameters
    ----------
    folder : Path
        Of the firmware.
    manifest : dict
        Of `read_firmware_manifest`.
    """
    return tuple(
        BoardFile(
            name=name,
            changed=not (folder / name).is_file() or sha256_of((folder / name).read_bytes()) != manifest["files"][name],
        )
        for name in sorted(set(manifest.get("board", ())) & manifest["files"].keys())
    )


def board_compiles(folder: Path, manifest: dict[str, Any]) -> list[Check]:
    """Compile the target's C together with the board files that were changed.

    Parameters
    ----------
    folder : Path
        Of the firmware.
    manifest : dict
        Of `read_firmware_manifest`.

    Returns
    -------
    list of Check
        None where nothing was changed, the compiler is not there, or a header lies elsewhere, so that nobody can tell.
    """
    compiler, *options = COMPILERS.get(manifest.get("target", ""), ("",))
    changed = [each.name for each in board_files(folder, manifest) if each.changed]
    if not changed or not compiler or not shutil.which(compiler):
        return []
    place = (folder / changed[0]).parent
    sources = sorted(name for name in manifest["files"] if (folder / name).parent == place and name.endswith(".c"))
    folders = [f"-I{folder / 'core'}", f"-I{place}"]
    for source in (name for name in sources if (folder / name).is_file()):
        command = [compiler, *options, *folders, "-c", str(folder / source), "-o", str(build_folder() / "board.o")]
        try:
            done = run_compiler(command)
        except (OSError, subprocess.TimeoutExpired):
            return []
        if done.returncode and ELSEWHERE in done.stderr:
            return []
        if done.returncode:
            first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip()[:300])
            return [Check(name=COMPILES, holds=False, text=f"{first} ({Path(compiler).name})")]
    text = f"with {', '.join(changed)} as you changed them ({Path(compiler).name}); what they do is not checked"
    return [Check(name=COMPILES, holds=True, text=text)]
