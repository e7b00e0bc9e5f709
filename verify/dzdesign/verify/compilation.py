"""Whether the firmware's C compiles: the core strictly, the files that its user filled in, all with TI's headers.

TI's headers are C for a compiler with 16-bit `int` and words of its own. Their types can be given from outside
(DSP28_DATA_TYPES), and the words mean nothing to a syntax check; what is left is what the firmware relies on.
"""

import re
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.processes.programs import find_program
from dzdesign.core.scratch import scratch_folder
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify import requirements
from dzdesign.verify.folder import USER_FOLDER, changed_board_files, read_firmware_manifest, user_files
from dzdesign.verify.requirements import C2000WARE, Check
from dzdesign.verify.toolchain.host_compiler import (
    STRICT,
    build_folder,
    check_strictly,
    find_compilers,
    first_error,
    host_compiler,
    keeps_warnings,
    name_of,
    run_compiler,
)  # fmt: skip
from dzdesign.verify.toolchain.machines import CORTEX_M4

#: Compiler and options of a target whose board files can be compiled without a vendor's library.
COMPILERS = {"cortex-m4": (CORTEX_M4.compiler, *CORTEX_M4.core_flags)}
#: How a compiler says that a header lies elsewhere: where, only its user knows.
ELSEWHERE = re.compile(r"error: (\S+): No such file or directory")
#: Of C2000Ware.
TARGET = "f28335"
DEVICE = "device_support/f2833x"
HEADERS = (f"{DEVICE}/headers/include", f"{DEVICE}/common/include")
PROJECT, WARE_ROOT = f"{TARGET}/dzdesign.projectspec", "C2000WARE_ROOT/"
#: RAM and FLASH build.
BUILDS = ((), ("-D_FLASH",))
#: Read before all else: what the C28x compiler knows by itself, and the widths of its types.
PRELUDE = """\
#include <stdint.h>
#define DSP28_DATA_TYPES
typedef int16_t int16;
typedef int32_t int32;
typedef int64_t int64;
typedef uint16_t Uint16;
typedef uint32_t Uint32;
typedef uint64_t Uint64;
typedef float float32;
typedef long double float64;
#define interrupt
#define __interrupt
#define cregister
#define far
#define near
#define ioport
#define asm(text) ((void)0)
"""


def compiles_strictly(folder: Path, manifest: FirmwareManifest) -> Check:
    """Tell whether every compiler on this machine takes the core with every warning an error."""
    compilers = find_compilers()
    if silent := [name_of(compiler) for compiler in compilers if keeps_warnings(compiler)]:
        text = f"{silent[0]} takes C that these options must refuse, so what it says of the core means nothing"
        return requirements.COMPILES.check(holds=None, text=f"{text}; take options such as -w out of $CC")
    try:
        for compiler in compilers:
            for name in manifest.core:
                if name.endswith(".c"):
                    check_strictly(folder / name, compiler)
    except RequirementError as error:
        return requirements.COMPILES.check(holds=False, text=str(error))
    names = ", ".join(sorted({name_of(compiler) for compiler in compilers}))
    return requirements.COMPILES.check(holds=True, text=f"{' '.join(STRICT)}: {names}")


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


def check_ware(folder: Path, manifest: FirmwareManifest, ware: Path) -> None:
    """Refuse a folder that is not C2000Ware's, and a firmware for another target."""
    if manifest.target != TARGET:
        raise InputError(f"--c2000ware checks firmware for {TARGET}, and '{folder}' is for {manifest.target}")
    for headers in HEADERS:
        if not (ware / headers).is_dir():
            raise InputError(
                f"'{ware}' has no folder {headers}; expected the C2000Ware folder, the one with device_support, "
                "after --c2000ware"
            )


def check_against_c2000ware(folder: Path, ware: Path, say: Callable[[str], None] = lambda _: None) -> Check:
    """Compile every C file of a firmware folder for the f28335 against the headers of a C2000Ware folder.

    That holds if each compiles as RAM and as FLASH build, and every file of TI's that the project links is there. What
    is refused is that of `check_ware`.
    """
    manifest = read_firmware_manifest(folder)
    check_ware(folder, manifest, ware)
    compiler = host_compiler()
    say(f"compiling the firmware against {ware}")
    sources = sorted(folder / name for name in manifest.files if name.endswith(".c"))
    try:
        with scratch_folder() as temporary:
            prelude = temporary / "prelude.h"
            prelude.write_text(PRELUDE, encoding="utf-8")
            options = ["-include", str(prelude), f"-I{folder / 'core'}", f"-I{folder / TARGET}"]
            for headers in HEADERS:  # TI's headers are not ours to warn about
                options += ["-isystem", str(ware / headers)]
            for build in BUILDS:
                for source in sources:
                    check_strictly(source, compiler, (*options, *build))
        missing = [name for name in _linked_files(folder) if not (ware / name).is_file()]
    except RequirementError as error:
        return C2000WARE.check(holds=False, text=str(error))
    if missing:
        return C2000WARE.check(holds=False, text=f"{ware} lacks {', '.join(missing)}, which the project links")
    return C2000WARE.check(holds=True, text=f"compiled {len(sources)} files against {ware}, as RAM and as FLASH build")


def _linked_files(folder: Path) -> list[str]:
    """Return the files of C2000Ware that the project links, relative to it."""
    try:
        files = ElementTree.fromstring(read_bytes(folder / PROJECT, "project file")).iter("file")
    except ElementTree.ParseError as error:
        raise RequirementError(f"{PROJECT} is not XML: {error}") from error
    paths = [entry.get("path", "") for entry in files]
    return [path.removeprefix(WARE_ROOT) for path in paths if path.startswith(WARE_ROOT)]
