"""Both drives of both C2000 targets against TI's own headers: ``make bench-c2000ware C2000WARE=FOLDER``.

The F28335's set-up runs on TI's bit-fields, and leaves the documented register values.
"""

import os
import subprocess
from pathlib import Path

import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.firmware_manifest import Calibration
from dzdesign.verify.toolchain.host_compiler import host_compiler
from tests.codegen.f28335.test_f28335 import PLAIN, START_VALUES, SUPPLY, VALUES
from tests.support.c2000ware import HEADERS, PRELUDE, check_against_c2000ware
from tests.support.example_coil import SENSORS, with_current
from tests.support.golden_firmware import golden_compensator

#: TI's headers are the user's own: without them this is a mistake of the call, not a test that was skipped.
WARE = Path(os.environ.get("DZDESIGN_C2000WARE", ""))
if not (WARE / HEADERS[0]).is_dir():
    pytest.exit(f"DZDESIGN_C2000WARE names no C2000Ware folder: '{WARE / HEADERS[0]}' is missing", returncode=2)
SENSOR_OF = {"duty": None, "current": SENSORS["supply unknown"], "current, supply": SENSORS["supply measured"]}
EXPECTED = {
    "duty": START_VALUES,
    "current": VALUES[PLAIN],
    "current, supply": VALUES[SUPPLY],
}
#: Ours in the tests, TI's in C.
REGISTERS = {
    "TBCTL": "EPwm1Regs.TBCTL.all", "TBPRD": "EPwm1Regs.TBPRD", "CMPCTL": "EPwm1Regs.CMPCTL.all",
    "CMPB": "EPwm1Regs.CMPB", "AQCTLA": "EPwm1Regs.AQCTLA.all", "ETSEL": "EPwm1Regs.ETSEL.all",
    "ETPS": "EPwm1Regs.ETPS.all", "TZSEL": "EPwm1Regs.TZSEL.all", "TZCTL": "EPwm1Regs.TZCTL.all",
    "ADCTRL1": "AdcRegs.ADCTRL1.all", "ADCTRL2": "AdcRegs.ADCTRL2.all", "ADCTRL3": "AdcRegs.ADCTRL3.all",
    "ADCMAXCONV": "AdcRegs.ADCMAXCONV.all", "ADCCHSELSEQ1": "AdcRegs.ADCCHSELSEQ1.all",
    "ADCCHSELSEQ3": "AdcRegs.ADCCHSELSEQ3.all", "ADCCHSELSEQ4": "AdcRegs.ADCCHSELSEQ4.all",
    "HISPCP": "SysCtrlRegs.HISPCP.all", "SECOND_TBCTL": "EPwm2Regs.TBCTL.all", "SECOND_TBPRD": "EPwm2Regs.TBPRD",
    "SECOND_CMPCTL": "EPwm2Regs.CMPCTL.all", "TRIGGER_CMPA": "EPwm2Regs.CMPA.half.CMPA",
    "SECOND_ETSEL": "EPwm2Regs.ETSEL.all", "TRIGGER_ETPS": "EPwm2Regs.ETPS.all",
    "GPIO13_MUX": "GpioCtrlRegs.GPAMUX1.bit.GPIO13",
}  # fmt: skip
RESETS = 0x4040
#: DriverLib has no octets, so its `uint8_t` has another name than the host's.
DRIVERLIB_PRELUDE = """\
#include <stdbool.h>
#include <stdint.h>
#define __TMS320C28XX__ 1
#define __interrupt
#define __cregister
#define __byte(array, index) (*(array))
#define __byte_peripheral_32(address) (*(address))
#define uint8_t driverlib_uint8_t
#define int8_t driverlib_int8_t
#define asm(text) ((void)0)
#define __asm(text) ((void)0)
"""


def firmware(folder: Path, target: str, drive: str, calibration: Calibration = "fixed") -> Path:
    """Write a target's whole firmware."""
    compensator = golden_compensator(target)
    if sensor := SENSOR_OF[drive]:
        compensator = with_current(compensator, target_named(target), sensor)
    made = generate(compensator, target, calibration=calibration)
    write_folder(folder / "fw", made.contents, made.manifest)
    return folder / "fw"


@pytest.mark.parametrize("calibration", ["fixed", "block"])
@pytest.mark.parametrize("drive", SENSOR_OF)
def test_the_f28335_compiles_against_them(drive, calibration, tmp_path):
    assert check_against_c2000ware(firmware(tmp_path, "f28335", drive, calibration), WARE) == ""


@pytest.mark.parametrize("calibration", ["fixed", "block"])
@pytest.mark.parametrize("drive", SENSOR_OF)
def test_the_f280049c_compiles_against_them(drive, calibration, tmp_path):
    folder = firmware(tmp_path, "f280049c", drive, calibration)
    (tmp_path / "prelude.h").write_text(DRIVERLIB_PRELUDE, encoding="utf-8")
    headers = ("driverlib/f28004x/driverlib", "device_support/f28004x/common/include")
    command = [host_compiler(), "-std=gnu99", "-fsyntax-only", "-Wall", "-Werror", "-include", tmp_path / "prelude.h"]
    command += [f"-I{folder / name}" for name in ("core", "f280049c")]
    command += [word for name in headers for word in ("-isystem", WARE / name)]
    for source in folder.rglob("*.c"):
        done = subprocess.run([*map(str, command), str(source)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("drive", SENSOR_OF)
def test_the_set_up_leaves_the_documented_values_in_their_registers(drive, tmp_path):
    folder = firmware(tmp_path, "f28335", drive) / "f28335"
    shown = "".join(f'    printf("{name} %04X\\n", (unsigned){register});\n' for name, register in REGISTERS.items())
    (tmp_path / "prelude.h").write_text(PRELUDE, encoding="utf-8")
    (tmp_path / "show.c").write_text(
        "#include <stdio.h>\n#include <string.h>\n"
        '#include "DSP28x_Project.h"\n#include "dz_hardware.h"\n#include "dz_isr.h"\n'
        "volatile struct EPWM_REGS EPwm1Regs, EPwm2Regs;\nvolatile struct ADC_REGS AdcRegs;\n"
        "volatile struct ADC_RESULT_MIRROR_REGS AdcMirror;\nvolatile struct GPIO_DATA_REGS GpioDataRegs;\n"
        "volatile struct SYS_CTRL_REGS SysCtrlRegs;\nvolatile struct GPIO_CTRL_REGS GpioCtrlRegs;\n"
        "volatile struct PIE_CTRL_REGS PieCtrlRegs;\nvolatile struct PIE_VECT_TABLE PieVectTable;\n"
        "volatile unsigned int IER;\n"
        "void ServiceDog(void) {}\n__interrupt void dz_isr(void) {}\n"
        "int main(void)\n{\n    memset((void *)&EPwm1Regs, 0xA5, sizeof EPwm1Regs);\n"
        "    AdcRegs.ADCTRL3.all = 0x00E0u; /* as InitAdc() leaves it */\n"
        "    dz_output_hold_low();\n    dz_hardware_init();\n" + shown + "    return 0;\n}\n",
        encoding="utf-8",
    )
    command = [host_compiler(), "-std=gnu99", "-w", "-include", tmp_path / "prelude.h", f"-I{folder}"]
    command += [f"-I{folder.parent / 'core'}", *(f"-I{WARE / name}" for name in HEADERS)]
    command += [tmp_path / "show.c", folder / "dz_hardware.c", "-o", tmp_path / "show"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    printed = subprocess.run([tmp_path / "show"], capture_output=True, text=True, check=True).stdout
    found = {name: int(value, 16) for name, value in (line.split() for line in printed.splitlines())}
    found["ADCTRL2"] &= ~RESETS  # of the sequencers, which a device clears by itself
    assert found == {name: EXPECTED[drive].get(name, 0) for name in REGISTERS}
