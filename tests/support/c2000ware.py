"""The C of a firmware for the f28335 against C2000Ware's headers: a check of its templates.

TI's headers are C for a compiler with 16-bit `int` and words of its own. Their types can be given from outside
(DSP28_DATA_TYPES), and the words mean nothing to a syntax check; what is left is what the firmware relies on.
"""

from pathlib import Path
from xml.etree import ElementTree

from dzdesign.core.errors import RequirementError
from dzdesign.core.placing import scratch_folder
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


def check_against_c2000ware(folder: Path, ware: Path) -> str:
    """Return what is wrong with a firmware for the f28335 against the headers of a C2000Ware folder; else nothing.

    Every C file is compiled as RAM and as FLASH build, and every file of TI's that the project links must be there.
    """
    sources = sorted(folder.rglob("*.c"))
    with scratch_folder() as temporary:
        prelude = temporary / "prelude.h"
        prelude.write_text(PRELUDE, encoding="utf-8")
        options = ["-include", str(prelude), f"-I{folder / 'core'}", f"-I{folder / TARGET}"]
        for headers in HEADERS:  # TI's headers are not ours to warn about
            options += ["-isystem", str(ware / headers)]
        try:
            for build in BUILDS:
                for source in sources:
                    check_strictly(source, host_compiler(), (*options, *build))
        except RequirementError as error:
            return str(error)
    files = ElementTree.fromstring((folder / PROJECT).read_bytes()).iter("file")
    linked = [path.removeprefix(WARE_ROOT) for entry in files if (path := entry.get("path", "")).startswith(WARE_ROOT)]
    missing = [name for name in linked if not (ware / name).is_file()]
    return f"{ware} lacks {', '.join(missing)}, which the project links" if missing else ""
