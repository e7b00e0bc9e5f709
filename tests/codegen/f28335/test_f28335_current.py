"""Current control on the F28335: its registers, its sampling, its start and its faults, on a model of the device.

Oracle of the register values: technical reference manual of the TMS320x2833x (SPRUI07).
"""

import re
from functools import partial

import pytest

from dzdesign.codegen.f28335.target import TARGET
from tests.codegen.f28335.test_f28335_target import START_VALUES
from tests.support.current_checks import (
    CHECKS,
    board_of,
    check_closed_comparator,
    check_control,
    check_faults,
    check_sampling,
    check_start,
    check_wrong_sensor,
)
from tests.support.example_coil import SENSORS
from tests.support.f28335_device import build, needs_compiler, periods, registers, render_firmware

#: What differs from the set-up for a duty: two sequencers, the counter of ePWM2, a later interrupt, two trip inputs.
CURRENT_VALUES = {
    "TBCTL": 0x0010, "CMPB": 0xC15C, "TZSEL": 0x0300, "ADCTRL1": 0x0F00, "ADCTRL2": 0x4141, "ADCCHSELSEQ3": 0x3333,
    "ADCCHSELSEQ4": 0x3333, "GPIO13_MUX": 1, "SECOND_TBCTL": 0x0004, "SECOND_TBPRD": 0x1D4B, "SECOND_CMPCTL": 0x0010,
    "TRIGGER_CMPA": 0x0DC8, "SECOND_ETSEL": 0xC000, "TRIGGER_ETPS": 0x1000, "SECOND_AQCTLA": 0, "GPIO2_MUX": 0,
}  # fmt: skip
#: And with the supply measured: a fourth conversion of the sample.
SUPPLY_VALUES = {"ADCMAXCONV": 0x0003, "ADCCHSELSEQ1": 0x4210}
BOARD = board_of(apart=7_500, half=30_000, full_V=3.0)


@pytest.fixture
def firmware(tmp_path):
    return render_firmware(tmp_path, sensor=SENSORS["supply unknown"])


@pytest.fixture
def measured(tmp_path):
    return render_firmware(tmp_path, sensor=SENSORS["supply measured"])


def check_registers(run, _board) -> None:
    found = registers(*run.args)
    expected = START_VALUES | CURRENT_VALUES
    assert {name: found[name] for name in expected} == expected


def check_supply_registers(run, _board) -> None:
    found = registers(*run.args)
    expected = START_VALUES | CURRENT_VALUES | SUPPLY_VALUES
    assert {name: found[name] for name in expected} == expected


@needs_compiler
@pytest.mark.parametrize("check", [check_registers, *CHECKS])
def test_current_control_on_the_device_model(firmware, check):
    check(partial(periods, build(firmware)), BOARD)


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("check", [check_supply_registers, *CHECKS])
def test_current_control_with_the_supply_measured(measured, check):
    check(partial(periods, build(measured)), BOARD)


@needs_compiler
@pytest.mark.parametrize(
    ("file", "old", "new", "check"),
    [
        # Triggers.
        ("dz_hardware.c", "SOCBSEL = ET_CTRU_CMPA", "SOCBSEL = ET_CTR_ZERO", check_sampling),
        ("dz_hardware.c", "ETPS.bit.SOCBPRD = ET_1ST", "ETPS.bit.SOCBPRD = ET_2ND", check_sampling),
        ("dz_hardware.c", "EPwm2Regs.TBPRD = DZ_CURRENT_TBPRD", "EPwm2Regs.TBPRD = DZ_PWM_TBPRD", check_sampling),
        ("dz_hardware.c", "EPwm2Regs.TBCTL.bit.PHSEN = TB_ENABLE;", "", check_sampling),
        ("dz_hardware.c", "EPwm1Regs.TBCTL.bit.SYNCOSEL = TB_CTR_ZERO;", "", check_sampling),
        ("dz_hardware.c", "CMPA.half.CMPA = DZ_CURRENT_START", "CMPA.half.CMPA = 0u", check_sampling),
        ("dz_hardware.c", "SHDWAMODE = CC_IMMEDIATE", "SHDWAMODE = CC_SHADOW", check_registers),
        ("dz_hardware.h", "#define DZ_ISR_CMPB 49500u", "#define DZ_ISR_CMPB 3000u", check_sampling),
        ("dz_hardware.c", "SEQ_CASC = 0u", "SEQ_CASC = 1u", check_sampling),
        ("dz_hardware.c", "AdcRegs.ADCTRL2.bit.EPWM_SOCB_SEQ2 = 1u;", "", check_start),
        # Order of the channels.
        ("dz_hardware.h", "DZ_CURRENT_CHANNELS 0x3333u", "DZ_CURRENT_CHANNELS 0x3332u", check_start),
        ("dz_hardware.c", "ADCCHSELSEQ4.all = DZ_CURRENT_CHANNELS", "ADCCHSELSEQ4.all = 0u", check_start),
        ("dz_isr.c", "AdcMirror.ADCRESULT15", "AdcMirror.ADCRESULT0", check_start),
        ("dz_hardware.c", "CONV00 = 0u", "CONV00 = 3u", check_registers),
        # The offset with the output on, or while a current still flows.
        ("dz_hardware.c", "TZA = TZ_FORCE_LO", "TZA = TZ_FORCE_HI", check_start),
        ("dz_hardware.h", "DZ_CURRENT_REST_TICKS 97u", "DZ_CURRENT_REST_TICKS 1u", check_start),
        ("dz_isr.c", "(loop.faults == 0u) &&", "", check_start),
        # Faults.
        ("dz_isr.c", "        dz_state.fault |= DZ_FAULT_NO_CURRENT;", "", check_faults),
        ("dz_isr.c", "    if (loop.faults != 0u)\n", "    if (loop.faults == 0xFFFFu)\n", check_faults),
        ("dz_isr.c", "AdcRegs.ADCST.bit.INT_SEQ2_CLR = 1u;", "", check_faults),
        ("dz_hardware.c", "TZSEL.bit.OSHT2 = TZ_ENABLE", "TZSEL.bit.OSHT2 = 0u", check_faults),
        ("dz_isr.c", "((loop.faults & DZ_CURRENT_SENSOR) != 0u)", "(loop.faults == 0xFFFFu)", check_wrong_sensor),
        (
            "dz_isr.c", " && (GpioDataRegs.GPADAT.bit.GPIO13 != 0u))", ")", check_closed_comparator,
        ),
        ("dz_isr.c", "drive.compare_a, dz_state.current_sum", "drive.compare_a, dz_state.u_adc", check_control),
        ("dz_isr.c", "write_compare_a(dz_state.compare_a)", "write_compare_a(drive.compare_a)", check_control),
    ],
)  # fmt: skip
def test_a_seeded_fault_is_caught(firmware, file, old, new, check):
    source = firmware[f"f28335/{file}"]
    text = source.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    source.write_text(text.replace(old, new), encoding="utf-8")
    program = build(firmware, "-Wno-unused-function")
    with pytest.raises((AssertionError, ValueError)):
        check(partial(periods, program), BOARD)


def test_the_interrupt_is_behind_its_codes_and_leaves_time():
    context = TARGET.context
    start, apart, at = int(context["current_start"]), int(context["current_tbprd"]) + 1, int(context["current_cmpb"])
    held = 222  # 1.48 us at 150 MHz
    assert start + held == apart // 2 == 3750
    assert start + 6 * apart + held + 48 < at < start + 7 * apart
    assert int(context["current_rest_cycles"]) == 60_000 - at == 10_500


def test_the_table_of_registers_is_that_of_the_readme(measured):
    readme = measured["f28335/README.md"].read_text(encoding="utf-8")
    stated = dict(re.findall(r"\| `([A-Za-z0-9.]+)` \| ([0-9A-F]{4}) \|", readme))
    found = {
        "EPwm1Regs.TBCTL": "TBCTL", "EPwm1Regs.TBPRD": "TBPRD", "EPwm1Regs.CMPCTL": "CMPCTL", "EPwm1Regs.CMPB": "CMPB",
        "EPwm1Regs.AQCTLA": "AQCTLA", "EPwm1Regs.ETSEL": "ETSEL", "EPwm1Regs.ETPS": "ETPS", "EPwm1Regs.TZSEL": "TZSEL",
        "EPwm1Regs.TZCTL": "TZCTL", "EPwm2Regs.TBCTL": "SECOND_TBCTL", "EPwm2Regs.TBPRD": "SECOND_TBPRD",
        "EPwm2Regs.CMPCTL": "SECOND_CMPCTL", "EPwm2Regs.CMPA": "TRIGGER_CMPA", "EPwm2Regs.ETSEL": "SECOND_ETSEL",
        "EPwm2Regs.ETPS": "TRIGGER_ETPS", "ADCTRL1": "ADCTRL1", "ADCTRL2": "ADCTRL2", "ADCTRL3": "ADCTRL3",
        "ADCMAXCONV": "ADCMAXCONV", "ADCCHSELSEQ1": "ADCCHSELSEQ1", "ADCCHSELSEQ3": "ADCCHSELSEQ3",
        "ADCCHSELSEQ4": "ADCCHSELSEQ4", "HISPCP": "HISPCP", "PLLCR": "PLLCR",
    }  # fmt: skip
    expected = START_VALUES | CURRENT_VALUES | SUPPLY_VALUES
    assert stated == {register: f"{expected[name]:04X}" for register, name in found.items()}
