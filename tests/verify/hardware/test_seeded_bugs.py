"""Bugs in the files around the core, of both C2000 devices: each is found at the pins, by what it breaks.

The text is not compared: a folder would be what is generated, had the bug been in a template.
"""

from dataclasses import replace

import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.design.designing import design
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.design.signals import Signals
from dzdesign.verify.hardware.board_values import MAKEFILE, PROJECT_FILE, Board, read_board_values
from dzdesign.verify.hardware.checks import hardware_checks
from dzdesign.verify.hardware.model import Bench
from tests.support.core_variants import BOTH, variant
from tests.support.example_coil import SENSORS, two_with_current, with_current
from tests.support.golden_firmware import FULL, full_options, golden_compensator, golden_valve, write
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
ONE, BLOCK, TWO, (CURRENT, SUPPLY) = "one solenoid", "block form", "two solenoids", SENSORS
THREE = "three pressures"
#: Current control of two solenoids.
SHARED, EACH = "one shunt", "two shunts"
HARDWARE, MAIN, ISR, TELEMETRY = "dz_hardware.c", "main.c", "dz_isr.c", "dz_telemetry.c"
PROJECTS = f"{PROJECT_FILE} {MAKEFILE}"


def compensator_of(target, form):
    """A design of a form; with two solenoids with everything switched on."""
    if form == TWO:
        signals = Signals(command=BOTH, compare_max=target_named(target).compare_max)
        return design(golden_valve(FULL), full_options(signals=signals, negative_dp="wired"))
    if form in (SHARED, EACH):
        return two_with_current(target, shunts=1 + (form == EACH))
    if form == THREE:
        signals = replace(variant("three pressures").signals, compare_max=target_named(target).compare_max)
        sides = {name: replace(side, recorded_drop=None) for name, side in golden_valve(FULL).sides.items()}
        options = full_options(signals=signals, accept=("broken-sensor",))
        return design(replace(golden_valve(FULL), sides=sides), options)
    made = golden_compensator(target)
    return made if form in (ONE, BLOCK) else with_current(made, target_named(target), SENSORS[form])


def found_of(folder, target, form=ONE, edit=None, calibration="fixed", **board):
    """Generate a firmware with a bug into a folder, and return the text of each requirement that does not hold."""
    compensator = compensator_of(target, form)
    made = generate(compensator, target, calibration)
    texts = dict(made.files)
    files, old, new = edit or ("", "", "")
    for name in (f"{target}/{file}" for file in files.split()):
        assert old in texts[name], f"{old!r} is not in {name}"
        texts[name] = texts[name].replace(old, new)
    write(folder, texts)
    (folder / BLOCK_FILE).write_bytes(made.block)
    values = read_board_values(texts[f"{target}/dz_board.h"])
    assert values is not None and board.keys() <= values.keys()
    makefile, project = (texts[f"{target}/{name}"] for name in (MAKEFILE, PROJECT_FILE))
    built = Board(values={**values, **board}, projects=(makefile, project, project))
    checks = hardware_checks(lambda: Bench(folder, made.manifest, compensator, built))
    return {check.id: check.text for check in checks if not check.holds}


EXCHANGED = """control_current();
            { uint32_t a = loop.compare_a; loop.compare_a = loop.compare_b; loop.compare_b = a; }
"""
#: Form, file, what stands there, what somebody wrote instead, and the requirement that names it.
BUGS = {
    "f28335": {
        "third pressure on B's channel": (THREE, HARDWARE, "CONV04 = DZ_BOARD_PRESSURE_C",
                                          "CONV04 = DZ_BOARD_PRESSURE_B", "channels"),
        "the other side's pressure": (THREE, ISR, "p_c_adc = codes[DZ_SAMPLE_CODES - 1u]", "p_c_adc = codes[2]",
                                      "channels"),
        "B and C exchanged": (THREE, ISR, "state.p_b_adc, state.p_c_adc)",
                              "state.p_c_adc, state.p_b_adc)", "channels"),
        "pressures swapped": (ONE, HARDWARE, "codes[1] = AdcMirror.ADCRESULT2", "codes[1] = AdcMirror.ADCRESULT3",
                              "channels"),
        "left-justified result": (ONE, HARDWARE, "AdcMirror.", "AdcRegs.", "channels"),
        "sequencer not reset": (ONE, HARDWARE, "        AdcRegs.ADCTRL2.bit.RST_SEQ1 = 1u;\n        fin",
                                "        fin", "channels"),
        "first conversion used": (ONE, HARDWARE, "codes[0] = AdcMirror.ADCRESULT1",
                                  "codes[0] = AdcMirror.ADCRESULT0", "channels"),
        "watchdog missing": (ONE, HARDWARE, "    SysCtrlRegs.WDCR = DZ_WDCR_ENABLE;\n", "", "watchdog"),
        "watchdog interrupts": (ONE, HARDWARE, "SysCtrlRegs.SCSR = 0x0000u", "SysCtrlRegs.SCSR = 0x0002u", "watchdog"),
        "trip drives fully": (ONE, HARDWARE, "TZ_FORCE_LO", "TZ_FORCE_HI", "trip"),
        "trip input not selected": (ONE, HARDWARE, "    DZ_PWM_A.TZSEL.bit.DZ_TRIP",
                                    "    if (0) DZ_PWM_A.TZSEL.bit.DZ_TRIP", "trip"),
        "trip inverted": (ONE, HARDWARE, "DZ_TRIP_PIN != 0u)", "DZ_TRIP_PIN == 0u)", "trip"),
        "no force at compare 0": (ONE, HARDWARE, "(compare == 0u) ? DZ_FORCE_LOW : DZ_FORCE_NONE", "DZ_FORCE_NONE",
                                  "pwm"),
        "half the period": (ONE, HARDWARE, "TBPRD = DZ_PWM_TBPRD", "TBPRD = DZ_PWM_TBPRD / 2u", "pwm"),
        "polarity": (ONE, HARDWARE, "ZRO = AQ_SET;", "ZRO = AQ_CLEAR; DZ_PWM_A.AQCTLA.bit.PRD = AQ_SET;", "pwm"),
        "another pin": (ONE, HARDWARE, "GPAMUX1.bit.DZ_PWM_PIN = 1u", "GPAMUX1.bit.GPIO4 = 1u", "pwm"),
        "no main": (ONE, MAIN, "    dz_interrupt_init();", "    dz_interrupt_init()", "compiles"),
        "output not held low": (ONE, MAIN, "    dz_output_hold_low();", "", "trip"),
        "starts without the crystal": (ONE, HARDWARE, "faults |= DZ_FAULT_CLOCK;", "", "start"),
        "starts after the watchdog": (ONE, HARDWARE, "faults |= DZ_FAULT_WATCHDOG;", "", "start"),
        "samples lost unseen": (ONE, ISR, "state.fault |= DZ_FAULT_NO_SAMPLE;", "", "sample-loss"),
        "watchdog served by the interrupt": (ONE, HARDWARE, "    DZ_PWM_A.ETCLR.bit.INT = 1u;\n    Pie",
                                             "    ServiceDog();\n    DZ_PWM_A.ETCLR.bit.INT = 1u;\n    Pie",
                                             "watchdog"),
        "converter too fast": (ONE, "dz_hardware.h", "DZ_ADC_HISPCP 3u", "DZ_ADC_HISPCP 1u", "channels"),
        "not copied to RAM": (ONE, MAIN, "    MemCopy(&RamfuncsLoadStart, &RamfuncsLoadEnd, &RamfuncsRunStart);\n", "",
                              "rates"),
        "not acknowledged": (ONE, HARDWARE, "PieCtrlRegs.PIEACK.all = PIEACK_GROUP3;", "", "rates"),
        "samples too often": (ONE, HARDWARE, "SOCAPRD = ET_2ND", "SOCAPRD = ET_1ST", "rates"),
        "telemetry on no pin": (ONE, TELEMETRY, "DZ_SCI_MUX.bit.DZ_SCI_TX = DZ_SCI_FUNCTION",
                                "DZ_SCI_MUX.bit.DZ_SCI_TX = 0u", "telemetry"),
        "another fault": (ONE, ISR, "|= DZ_FAULT_TRIP_INPUT", "|= DZ_FAULT_CLOCK", "trip"),
        "faults exchanged": (ONE, "dz_hardware.h", "DZ_FAULT_WATCHDOG 0x0004u", "DZ_FAULT_WATCHDOG 0x0008u", "start"),
        "fault of the current": (CURRENT, ISR, "|= DZ_FAULT_NO_CURRENT", "|= DZ_FAULT_CURRENT", "sample-loss"),
        "released with the trip input low": (ONE, ISR, "(dz_trip_inputs_high() != 0u)", "(fresh != 0u)", "trip"),
        "pull-up at the PWM's pin": (ONE, HARDWARE, "GPAPUD.bit.DZ_PWM_PIN = 1u", "GPAPUD.bit.DZ_PWM_PIN = 0u",
                                     "start"),
        "trip needs a clock": (ONE, HARDWARE, "DZ_TRIP_QUALIFIER.bit.DZ_TRIP_PIN = 3u",
                               "DZ_TRIP_QUALIFIER.bit.DZ_TRIP_PIN = 0u", "trip"),
        "pins before the trip zone": (ONE, HARDWARE, "dz_output_hold_low(void)\n{",
                                      "dz_output_hold_low(void)\n{\n    dz_hardware_init();", "start"),
        "other groups acknowledged": (ONE, HARDWARE, "PIEACK.all = PIEACK_GROUP3", "PIEACK.bit.ACK3 = 1u", "rates"),
        "high at a halt": (ONE, HARDWARE, "FREE_SOFT = DZ_STOP_AT_PERIOD", "FREE_SOFT = 0u", "halt"),
        "runs on at a halt": (TWO, HARDWARE, "DZ_PWM_B.TBCTL.bit.FREE_SOFT = DZ_STOP_AT_PERIOD",
                              "DZ_PWM_B.TBCTL.bit.FREE_SOFT = 2u", "halt"),
        "frame with B for A": (ONE, TELEMETRY, "frame.p_a_adc = state.p_a_adc", "frame.p_a_adc = state.p_b_adc",
                               "telemetry"),
        "compare values exchanged": (TWO, TELEMETRY, "frame.compare_b = state.compare_b",
                                     "frame.compare_b = state.compare_a", "telemetry"),
        "baud registers exchanged": (ONE, TELEMETRY, "DZ_SCI_BRR >> 8;\n    DZ_SCI.SCILBAUD = DZ_SCI_BRR & 0xFFu",
                                     "DZ_SCI_BRR & 0xFFu;\n    DZ_SCI.SCILBAUD = DZ_SCI_BRR >> 8", "telemetry"),
        "one baud off": (ONE, "dz_telemetry.h", "DZ_SCI_BRR 80u", "DZ_SCI_BRR 78u", "telemetry"),
        "block taken under command": (BLOCK, "dz_active.c", "return reason;", "return 0u * reason;", "telemetry"),
        "erased while driven": (BLOCK, "dz_active.c", "(hold != 0u) && (dz_state.held != 0u)", "hold != 0u",
                                 "telemetry"),
        "loaded while driven": (BLOCK, ISR, "        force_output_low();\n        state.held = 1u;",
                                "        if (state.fault != 0u)\n            force_output_low();\n"
                                "        state.held = 1u;", "telemetry"),
        "flash not defined": (ONE, PROJECT_FILE, "--define=_FLASH", "", "compiles"),
        "flash defined by no project": (ONE, PROJECTS, "--define=_FLASH", "", "rates"),
        "both solenoids": (TWO, HARDWARE, "DZ_PWM_B.CMPA.half.CMPA = compare;\n    DZ_PWM_B.AQCSFRC",
                           "DZ_PWM_B.CMPA.half.CMPA = compare + 9u;\n    if (compare) DZ_PWM_B.AQCSFRC", "solenoids"),
        "B for A": (TWO, ISR, "dz_write_compare_b(drive.compare_b)", "dz_write_compare_b(drive.compare_a)",
                    "solenoids"),
        "current too early": (CURRENT, HARDWARE, "CMPA.half.CMPA = DZ_CURRENT_START", "CMPA.half.CMPA = 0u", "current"),
        "current of another channel": (CURRENT, "dz_hardware.h", "((channel) * 0x1111u)", "0x3332u", "channels"),
        "outputs exchanged": (EACH, HARDWARE, "DZ_PWM_A.CMPA.half.CMPA = compare;\n    DZ_PWM_A.AQCSFRC",
                              "DZ_PWM_B.CMPA.half.CMPA = compare;\n    DZ_PWM_B.AQCSFRC", "pwm"),
        "outputs exchanged by the interrupt": (EACH, ISR, "control_current();\n", EXCHANGED, "channels"),
        "the other shunt read": (EACH, HARDWARE, "(solenoid_b != 0u) ?", "(solenoid_b == 0u) ?", "channels"),
        "one shunt read for both": (EACH, HARDWARE, "(DZ_BOARD_CURRENT_B)", "(DZ_BOARD_CURRENT)", "channels"),
        "shunt not chosen again": (EACH, ISR, "    dz_select_current((uint16_t)(loop.on_b & 1u));\n    if (loop",
                                   "    if (loop", "channels"),
        "both outputs on": (SHARED, ISR, "dz_write_compare_b((uint16_t)loop.compare_b)",
                            "dz_write_compare_b((uint16_t)loop.compare)", "solenoids"),
        "the other one not held off": (SHARED, ISR, "dz_write_compare_b((uint16_t)loop.compare_b)",
                                       "dz_write_compare_b(drive.compare_b)", "solenoids"),
        "comparator not selected": (SUPPLY, HARDWARE, "    DZ_PWM_A.TZSEL.bit.DZ_OVER",
                                    "    if (0) DZ_PWM_A.TZSEL.bit.DZ_OVER", "trip"),
    },
    "f280049c": {
        "third pressure on B's channel": (THREE, HARDWARE, "DZ_CHANNEL(DZ_BOARD_PRESSURE_C)",
                                          "DZ_CHANNEL(DZ_BOARD_PRESSURE_B)", "channels"),
        "B and C exchanged": (THREE, ISR, "state.p_b_adc, state.p_c_adc)",
                              "state.p_c_adc, state.p_b_adc)", "channels"),
        "pressures swapped": (ONE, HARDWARE, "codes[1] = ADC_readResult(ADCARESULT_BASE, ADC_SOC_NUMBER2)",
                              "codes[1] = ADC_readResult(ADCARESULT_BASE, ADC_SOC_NUMBER3)", "channels"),
        "converter not awaited": (ONE, HARDWARE, "DEVICE_DELAY_US(1000);", "", "channels"),
        "X-BAR on another pin": (ONE, HARDWARE, "XBAR_INPUT1, DZ_BOARD_TRIP_GPIO",
                                 "XBAR_INPUT1, DZ_BOARD_TRIP_GPIO + 1", "trip"),
        "trip drives fully": (ONE, HARDWARE, "TZA, EPWM_TZ_ACTION_LOW", "TZA, EPWM_TZ_ACTION_HIGH", "trip"),
        "clock halved": (ONE, HARDWARE, "EPWM_CLOCK_DIVIDER_1", "EPWM_CLOCK_DIVIDER_2", "pwm"),
        "counts up and down": (ONE, HARDWARE, "EPWM_COUNTER_MODE_UP", "EPWM_COUNTER_MODE_UP_DOWN", "pwm"),
        "no force at compare 0": (ONE, HARDWARE, "(compare == 0u) ? EPWM_AQ_SW_OUTPUT_LOW : EPWM_AQ_SW_DISABLED",
                                  "EPWM_AQ_SW_DISABLED", "pwm"),
        "watchdog not started": (ONE, HARDWARE, "    SysCtl_enableWatchdog();\n", "", "watchdog"),
        "watchdog served by the loop": (ONE, MAIN, "if (ticks != ticks_seen)",
            "if ((ticks != ticks_seen) || (ticks_seen < 65535u))", "watchdog"),
        "another reference": (ONE, HARDWARE, "ADC_REFERENCE_3_3V", "ADC_REFERENCE_2_5V", "channels"),
        "watchdog served by the interrupt": (ONE, HARDWARE, "    Interrupt_clearACKGroup",
                                             "    SysCtl_serviceWatchdog();\n    Interrupt_clearACKGroup", "watchdog"),
        "samples too often": (ONE, HARDWARE, "EPWM_SOC_A, DZ_TICKS_PER_SAMPLE", "EPWM_SOC_A, 1u", "rates"),
        "enumerations swapped": (ONE, HARDWARE, "EPWM_TZ_ACTION_EVENT_TZA, EPWM_TZ_ACTION_LOW",
                                 "EPWM_TZ_ACTION_LOW, EPWM_TZ_ACTION_EVENT_TZA", "compiles"),
        "B not tripped": (TWO, HARDWARE, "EPWM_enableTripZoneSignals(DZ_PWM_B, EPWM_TZ_SIGNAL_OSHT1);", "", "trip"),
        "another fault": (ONE, ISR, "|= DZ_FAULT_NO_SAMPLE", "|= DZ_FAULT_CLOCK", "sample-loss"),
        "trip needs a clock": (ONE, HARDWARE, "GPIO_QUAL_ASYNC", "GPIO_QUAL_SYNC", "trip"),
        "pins before the trip zone": (TWO, HARDWARE, "dz_output_hold_low(void)\n{",
                                      "dz_output_hold_low(void)\n{\n    dz_hardware_init();", "start"),
        "flash defined by no project": (ONE, PROJECTS, "--define=_FLASH", "", "rates"),
        "a project's own board": (ONE, PROJECTS, "--define=_FLASH", "--define=_FLASH --define=DZ_BOARD_TRIP_GPIO=13",
                                  "trip"),
        "outputs exchanged by the interrupt": (SHARED, ISR, "control_current();\n", EXCHANGED, "channels"),
        "a shunt of the other channel": (EACH, HARDWARE, "DZ_CHANNEL(DZ_BOARD_CURRENT_B)",
                                         "DZ_CHANNEL(DZ_BOARD_CURRENT)", "channels"),
        "the other one not held off": (EACH, ISR, "dz_write_compare_b((uint16_t)loop.compare_b)",
                                       "dz_write_compare_b(drive.compare_b)", "solenoids"),
        "current started by the second output": (EACH, "dz_hardware.h", "DZ_BOARD_PWM_C), _SOCA",
                                                 "DZ_BOARD_PWM_B), _SOCA", "current"),
        "current without its own flag": (CURRENT, HARDWARE, "        clear_flag(ADC_INT_NUMBER2);", "", "sample-loss"),
    },
}  # fmt: skip


@pytest.mark.parametrize(("target", "bug"), [(target, bug) for target in BUGS for bug in BUGS[target]])
def test_a_bug_is_found_by_the_requirement_that_names_it(tmp_path, target, bug):
    form, *edit, named = BUGS[target][bug]
    found = found_of(tmp_path, target, form, tuple(edit), "block" if form == BLOCK else "fixed")
    print(found)
    assert f"hardware-{named}" in found


@pytest.mark.parametrize("target", BUGS)
@pytest.mark.parametrize("form", [ONE, TWO, CURRENT, SUPPLY])
@pytest.mark.parametrize("calibration", ["fixed", "block"])
def test_the_files_as_they_are_hold(tmp_path, target, form, calibration):
    assert found_of(tmp_path, target, form, calibration=calibration) == {}
