"""The generated F28335 firmware, built with the model of the device and run: what its tests share."""

import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from dzdesign.codegen.banner import Banner
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.codegen.project import target_files
from dzdesign.design.current.circuit import CurrentSensor
from tests.support.current_loops import current_texts
from tests.support.example_coil import with_current
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator

HERE = Path(__file__).parent / "f28335"
COMPILER = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc, gcc or clang) on the path")


def render_firmware(folder: Path, *signs: int, sensor: CurrentSensor | None = None) -> dict[str, Path]:
    """Write the target's files below `folder`, by the real renderer; output path to file. One sign by default.

    With a sensor of the current they control it, and its controller is the generated one.
    """
    compensator = golden_compensator("f28335", FULL if -1 in signs else GOLDENS)
    core = {}
    if sensor:
        compensator = with_current(compensator, TARGET, sensor)
        core = {f"f28335/{name}": text for name, text in current_texts(compensator.current_drive.loop).items()}
    written = {}
    for path, text in (target_files(compensator, TARGET, Banner(digest="1234567890abcdef")) | core).items():
        written[path] = folder / path
        written[path].parent.mkdir(parents=True, exist_ok=True)
        written[path].write_text(text, encoding="utf-8", newline="\n")
    return written


def build(firmware: dict[str, Path], *options: str) -> Path:
    """Compile the generated C with the device model; the warnings are errors."""
    folder = firmware["f28335/main.c"].parent
    program = folder / "driver"
    sources = [folder / name for name in ("dz_hardware.c", "dz_isr.c", "dz_telemetry.c", "dz_frame.c")]
    sources += [HERE / "device.c", HERE / "current.c", HERE / "driver.c", *folder.glob("dz_current.c")]
    command = [COMPILER, "-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", *options]
    command += [f"-I{folder}", f"-I{HERE}", *map(str, sources), "-lm", "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def run(program: Path, *words: str) -> list[str]:
    done = subprocess.run([program, *words], capture_output=True, text=True, check=True, timeout=20)
    return done.stdout.splitlines()


def registers(program: Path, *left_behind: str) -> dict[str, int]:
    lines = (line.split() for line in run(program, "registers", *left_behind))
    return {words[0]: int(words[1], 16) for words in lines if len(words) == 2}


def periods(program: Path, events: str, *start: str) -> list[dict]:
    """One dictionary a PWM period, numbers as integers."""
    ticks = []
    for line in run(program, "run", events, *start):
        if line.startswith("tick "):
            facts = dict(word.split("=", 1) for word in line.split()[1:])
            ticks.append({key: int(value) if value.isdigit() else value for key, value in facts.items()})
    assert len(ticks) == len(events)
    return ticks


def column(ticks: list[dict], key: str) -> list:
    return [tick[key] for tick in ticks]


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
        ("#define interrupt\n", "typedef interrupt void (*PINT)(void);\n"),
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
