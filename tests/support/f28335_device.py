"""The generated F28335 firmware with the model of the device, where a test edits its files; TI's headers laid out."""

import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support.c2000_devices import run, texts_of, write
from tests.support.paths import DEVICES

__all__ = ["COMPILER", "HERE", "build", "c2000ware_stand_in", "needs_compiler", "render_firmware", "run"]
HERE = DEVICES / "f28335"
COMPILER = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc, gcc or clang) on the path")


def render_firmware(folder: Path) -> dict[str, Path]:
    """Write the target's files below `folder`; output path to file."""
    (folder / "f28335").mkdir(parents=True)
    write(texts_of("f28335"), folder / "f28335")
    return {f"f28335/{name}": folder / "f28335" / name for name in texts_of("f28335")}


def build(firmware: dict[str, Path], *options: str) -> Path:
    """Compile the generated C with the device model; the warnings are errors."""
    folder = firmware["f28335/main.c"].parent
    program = folder / "driver"
    sources = [folder / name for name in ("dz_hardware.c", "dz_isr.c", "dz_telemetry.c", "dz_frame.c")]
    sources += [HERE / "device.c", HERE / "current.c", HERE / "driver.c"]
    command = [COMPILER, "-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", *options]
    command += [f"-I{folder}", f"-I{HERE}", *map(str, sources), "-lm", "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def c2000ware_stand_in(ware: Path, projectspec: Path) -> Path:
    """Lay out the header of the device model as C2000Ware does, in the C28x compiler's own words, and return `ware`.

    It stands for TI's headers in what a check against them must cope with: `cregister`, `interrupt`, `asm()`, types
    that are 16 bits wide only on the device, and warnings.
    """
    device = ware / "device_support" / "f2833x"
    include, common = device / "headers" / "include", device / "common" / "include"
    for folder in (include, common):
        folder.mkdir(parents=True)
    text = (HERE / "DSP28x_Project.h").read_text(encoding="utf-8")
    for old, new in (
        ("#define __interrupt\n", "typedef interrupt void (*PINT)(void);\n"),
        ("typedef uint16_t Uint16;", "typedef unsigned int Uint16;"),
        ("#define SciaRegs (*device_scia())\nvolatile struct SCI_REGS *device_scia(void);",
         "extern volatile struct SCI_REGS SciaRegs;"),
        ("extern volatile unsigned int IER, IFR;", "extern cregister volatile unsigned int IER, IFR;"),
        ("    void (*EPWM1_INT)(void);", "    PINT EPWM1_INT;"),
        ("#define EALLOW device_eallow()", '#define EALLOW asm(" EALLOW")'),
        ("#define EDIS device_edis()", '#define EDIS asm(" EDIS")'),
        ("#define EINT device_eint()", '#define EINT asm(" clrc INTM")'),
        ("#define DINT device_dint()", '#define DINT asm(" setc INTM")'),
        ("void ServiceDog(void);",
         "void ServiceDog(void);\nstatic int unused(float32 x, far int *y) { return x > *y; }"),
    ):  # fmt: skip
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (include / "DSP2833x_Device.h").write_text(text, encoding="utf-8")
    (common / "DSP28x_Project.h").write_text('#include "DSP2833x_Device.h"\n', encoding="utf-8")
    for entry in ElementTree.parse(projectspec).iter("file"):
        if (path := entry.get("path")).startswith("C2000WARE_ROOT/"):
            (ware / path.partition("/")[2]).parent.mkdir(parents=True, exist_ok=True)
            (ware / path.partition("/")[2]).touch()
    return ware
