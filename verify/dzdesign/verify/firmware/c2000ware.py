"""The whole f28335 firmware against a user's own C2000Ware headers, on the host: names, fields, types, prototypes.

TI's headers are C for a compiler with 16-bit `int` and words of its own. Their types can be given from outside
(DSP28_DATA_TYPES), and the words mean nothing to a syntax check; what is left is what the firmware relies on.
"""

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.scratch import scratch_folder
from dzdesign.verify.firmware.folder import read_firmware_manifest
from dzdesign.verify.requirements import C2000WARE, Check
from dzdesign.verify.toolchain.host_compiler import check_strictly, host_compiler

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


def check_against_c2000ware(folder: Path, ware: Path, say: Callable[[str], None] = lambda _: None) -> Check:
    """Compile every C file of a firmware folder for the f28335 against the headers of a C2000Ware folder.

    That holds if each compiles as RAM and as FLASH build, and every file of TI's that the project links is there. A
    folder that is none of its kind, and a machine without a C compiler, are an `InputError`.
    """
    manifest = read_firmware_manifest(folder)
    if manifest.target != TARGET:
        raise InputError(f"--c2000ware checks firmware for {TARGET}, and '{folder}' is for {manifest.target}")
    for headers in HEADERS:
        if not (ware / headers).is_dir():
            raise InputError(
                f"'{ware}' has no folder {headers}; expected the C2000Ware folder, the one with device_support, "
                "after --c2000ware"
            )
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
