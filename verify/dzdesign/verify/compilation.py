"""Whether the firmware's C compiles: the core strictly, and the files that its user filled in."""

import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.processes import find_program
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify import requirements
from dzdesign.verify.folder import USER_FOLDER, changed_board_files, user_files
from dzdesign.verify.requirements import Check
from dzdesign.verify.toolchain.host_compiler import (
    STRICT,
    build_folder,
    check_strictly,
    find_compilers,
    first_error,
    name_of,
    run_compiler,
)  # fmt: skip
from dzdesign.verify.toolchain.int_width import typed
from dzdesign.verify.toolchain.machines import CORTEX_M4

#: Compiler and options of a target whose board files can be compiled without a vendor's library.
COMPILERS = {"cortex-m4": (CORTEX_M4.compiler, *CORTEX_M4.core_flags)}
#: Targets whose int has 32 bits.
WIDE_INT = ("host", "cortex-m4")
#: How a compiler says that a header lies elsewhere: where, only its user knows.
ELSEWHERE = re.compile(r"error: (\S+): No such file or directory")


def compiles_strictly(folder: Path, manifest: FirmwareManifest) -> Check:
    """Tell whether every compiler on this machine takes the core with every warning an error."""
    compilers = find_compilers()
    try:
        for compiler in compilers:
            for name in manifest.core:
                if name.endswith(".c"):
                    check_strictly(folder / name, compiler)
    except RequirementError as error:
        return requirements.COMPILES.check(holds=False, text=str(error))
    names = ", ".join(sorted({name_of(compiler) for compiler in compilers}))
    return requirements.COMPILES.check(holds=True, text=f"{' '.join(STRICT)}: {names}")


def fits_target_int(folder: Path, manifest: FirmwareManifest) -> Check:
    """Tell whether the C computes the same with an int of 16 bits: the core, which is one for all targets, and for a
    target with such an int all that was generated.
    """
    sources = {Path(name).name: (folder / name).read_bytes() for name in manifest.files if name.endswith((".c", ".h"))}
    generated = manifest.core if manifest.target in WIDE_INT else set(manifest.files) - set(manifest.board)
    names = sorted(Path(name).name for name in generated if name.endswith(".c"))
    try:
        files = [typed(sources, name) for name in names]
    except RequirementError as error:
        return requirements.INT_WIDTH.check(holds=False, text=str(error))
    found, operations = [each for file in files for each in file.findings], sum(file.operations for file in files)
    text = f"{operations} operations in {', '.join(names)}, each with an int of 16 and of 32 bits: the same results"
    if found:
        text = found[0] + (f", and {len(found) - 1} more" if len(found) > 1 else "")
    return requirements.INT_WIDTH.check(holds=not found, text=text)


def check_include(include: Sequence[Path], manifest: FirmwareManifest) -> None:
    """Refuse folders of headers that are none, or of a target whose board files are not compiled here."""
    for place in include:
        if not place.is_dir():
            raise InputError(f"--include: '{place}' is not a folder, expected one with headers; check the name")
    if include and manifest.target not in COMPILERS:
        raise InputError(
            f"--include is for the board files of {', '.join(COMPILERS)}, and this firmware is for "
            f"{manifest.target}, whose board files are not compiled here; leave it out"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardCompiled:
    """Whether the user's board files compile: a check, or why it was not tried; neither where nothing was changed."""

    checks: tuple[Check, ...] = ()
    not_compiled: str = ""


def board_compiles(folder: Path, manifest: FirmwareManifest, include: Sequence[Path] = ()) -> BoardCompiled:
    """Compile the target's C together with the board files that were changed, and the user's own; nothing is linked."""
    compiler, *options = COMPILERS.get(manifest.target, ("",))
    changed = changed_board_files(folder, manifest)
    if not changed or not compiler:
        return BoardCompiled()
    if not find_program(compiler):
        return BoardCompiled(not_compiled=f"{compiler} is not on the path; install it, then `verify`")
    place = (folder / changed[0]).parent
    sources = sorted(name for name in manifest.files if (folder / name).parent == place and name.endswith(".c"))
    user_sources = [name for name in user_files(folder, manifest.files) if name.endswith(".c")]
    sources += user_sources
    # Warnings in headers of a vendor are no concern here: -isystem.
    folders = [f"-I{folder / 'core'}", f"-I{place}", "-iquote", str(folder / USER_FOLDER)]
    folders += [word for path in include for word in ("-isystem", str(path))]
    for source in (name for name in sources if (folder / name).is_file()):
        command = [compiler, *options, *folders, "-c", str(folder / source), "-o", str(build_folder() / "board.o")]
        try:
            done = run_compiler(command)
        except (OSError, subprocess.TimeoutExpired) as error:
            return BoardCompiled(
                not_compiled=f"{compiler} did not run on {source} ({type(error).__name__}); then `verify`"
            )
        if done.returncode and (lost := ELSEWHERE.search(done.stderr)):
            given = f" nor in {', '.join(map(str, include))}" if include else ""
            return BoardCompiled(
                not_compiled=f"{lost[1]}, which {source} includes, was not found in the firmware{given}; "
                "`verify --include DIR` with the folder in which it lies"
            )
        if done.returncode:
            text = f"{first_error(done.stderr)} ({Path(compiler).name})"
            return BoardCompiled(checks=(requirements.BOARD_FILES.check(holds=False, text=text),))
    added = f" and {', '.join(user_sources)}" if user_sources else ""
    text = f"each file compiles, with your changes in {', '.join(changed)}{added} ({Path(compiler).name}); they are "
    text += "not linked, and their behaviour is not checked"
    return BoardCompiled(checks=(requirements.BOARD_FILES.check(holds=True, text=text),))
