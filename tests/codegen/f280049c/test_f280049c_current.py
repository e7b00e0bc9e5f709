"""Current control on the F280049C: its calls of DriverLib, its sampling, its start and its faults, on a model."""

from functools import partial

import pytest

from dzdesign.codegen.f280049c.target import TARGET
from tests.codegen.f280049c.test_f280049c_target import build, periods, render, run
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
from tests.support.synthetic import needs_compiler

BOARD = board_of(apart=5_000, half=20_000, full_V=3.3)


def rows(program, events: str) -> list[dict]:
    """One dictionary a PWM period."""
    facts = periods(program, events)
    return [dict(zip(facts, values, strict=True)) for values in zip(*facts.values(), strict=True)]


@pytest.fixture
def firmware(tmp_path):
    return render(tmp_path, 1, sensor=SENSORS["supply unknown"])


@pytest.fixture
def measured(tmp_path):
    return render(tmp_path, 1, sensor=SENSORS["supply measured"])


def check_calls(go, _board) -> None:
    said = run(*go.args, "calls")
    for call in (
        "EPWM_setCounterCompareValue EPWM1_BASE EPWM_COUNTER_COMPARE_B 33000",
        "EPWM_setSyncOutPulseMode EPWM1_BASE EPWM_SYNC_OUT_PULSE_ON_COUNTER_ZERO",
        "EPWM_setTimeBasePeriod EPWM2_BASE 4999",
        "EPWM_setPhaseShift EPWM2_BASE 0",
        "EPWM_enablePhaseShiftLoad EPWM2_BASE",
        "EPWM_setCounterCompareValue EPWM2_BASE EPWM_COUNTER_COMPARE_A 2450",
        "EPWM_setADCTriggerSource EPWM2_BASE EPWM_SOC_A EPWM_SOC_TBCTR_U_CMPA",
        "EPWM_enableTripZoneSignals EPWM1_BASE EPWM_TZ_SIGNAL_OSHT2",
        "XBAR_setInputPin XBAR_INPUT2 13",
        "ADC_setSOCPriority ADCA_BASE ADC_PRI_THRU_SOC7_HIPRI",
        "ADC_setBurstModeConfig ADCA_BASE ADC_TRIGGER_EPWM2_SOCA 1",
        "ADC_setInterruptSource ADCA_BASE ADC_INT_NUMBER1 2",
        "ADC_setInterruptSource ADCA_BASE ADC_INT_NUMBER2 15",
        *(f"ADC_setupSOC ADCA_BASE {n} ADC_TRIGGER_SW_ONLY ADC_CH_ADCIN3 50" for n in range(8, 16)),
    ):
        assert said.count(call) == 1, call
    assert not [call for call in said if call.startswith("GPIO_setPinConfig GPIO_2_")], "ePWM2 drives no pin"


def check_supply_calls(go, _board) -> None:
    said = run(*go.args, "calls")
    assert "ADC_setupSOC ADCA_BASE 3 ADC_TRIGGER_EPWM1_SOCA ADC_CH_ADCIN4 50" in said
    assert "ADC_setInterruptSource ADCA_BASE ADC_INT_NUMBER1 3" in said


@needs_compiler
@pytest.mark.parametrize("check", [check_calls, *CHECKS])
def test_current_control_on_the_model(firmware, check):
    check(partial(rows, build(firmware)), BOARD)


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("check", [check_supply_calls, *CHECKS])
def test_current_control_with_the_supply_measured(measured, check):
    check(partial(rows, build(measured)), BOARD)


@needs_compiler
@pytest.mark.parametrize(
    ("file", "old", "new", "check"),
    [
        # Triggers.
        ("dz_hardware.c", "EPWM_SOC_TBCTR_U_CMPA", "EPWM_SOC_TBCTR_ZERO", check_sampling),
        ("dz_hardware.c", "EPWM2_BASE, EPWM_SOC_A, 1u", "EPWM2_BASE, EPWM_SOC_A, 2u", check_sampling),
        ("dz_hardware.c", "    EPWM_enablePhaseShiftLoad(EPWM2_BASE);\n", "", check_sampling),
        ("dz_hardware.c", "EPWM2_BASE, DZ_CURRENT_TBPRD", "EPWM2_BASE, DZ_PWM_TBPRD", check_sampling),
        ("dz_hardware.c", "ADC_TRIGGER_EPWM2_SOCA, 1u", "ADC_TRIGGER_EPWM1_SOCA, 1u", check_sampling),
        ("dz_hardware.c", "    ADC_enableBurstMode(ADCA_BASE);\n", "", check_sampling),
        ("dz_hardware.h", "#define DZ_ISR_CMPB 33000u", "#define DZ_ISR_CMPB 2000u", check_sampling),
        # Order of the channels.
        ("dz_hardware.c", "ADC_SOC_NUMBER11, ADC_TRIGGER_SW_ONLY, ADC_CH_ADCIN3",
         "ADC_SOC_NUMBER11, ADC_TRIGGER_SW_ONLY, ADC_CH_ADCIN2", check_start),
        ("dz_isr.c", "ADC_readResult(ADCARESULT_BASE, ADC_SOC_NUMBER15)",
         "ADC_readResult(ADCARESULT_BASE, ADC_SOC_NUMBER0)", check_start),
        # The offset with the output on, or while a current still flows.
        ("dz_hardware.c", "EPWM_TZ_ACTION_LOW", "EPWM_TZ_ACTION_HIGH", check_start),
        ("dz_hardware.h", "DZ_CURRENT_REST_TICKS 97u", "DZ_CURRENT_REST_TICKS 1u", check_start),
        ("dz_isr.c", "(loop.faults == 0u) &&", "", check_start),
        # Faults.
        ("dz_isr.c", "        dz_state.fault |= DZ_FAULT_NO_CURRENT;", "", check_faults),
        ("dz_isr.c", "    if (loop.faults != 0u)\n", "    if (loop.faults == 0xFFFFu)\n", check_faults),
        ("dz_hardware.c", "    XBAR_setInputPin(XBAR_INPUT2, DZ_OVER_CURRENT_PIN);", "", check_faults),
        ("dz_isr.c", "((loop.faults & DZ_CURRENT_SENSOR) != 0u)", "(loop.faults == 0xFFFFu)", check_wrong_sensor),
        ("dz_isr.c", " && (GPIO_readPin(DZ_OVER_CURRENT_PIN) != 0u))", ")", check_closed_comparator),
        ("dz_isr.c", "drive.compare_a, dz_state.current_sum", "drive.compare_a, dz_state.u_adc", check_control),
        ("dz_isr.c", "write_compare_a(dz_state.compare_a)", "write_compare_a(drive.compare_a)", check_control),
    ],
)  # fmt: skip
def test_a_seeded_fault_is_caught(firmware, file, old, new, check):
    source = firmware / file
    text = source.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    source.write_text(text.replace(old, new), encoding="utf-8")
    program = build(firmware)
    with pytest.raises((AssertionError, ValueError)):
        check(partial(rows, program), BOARD)


def test_the_interrupt_is_behind_its_codes_and_leaves_time():
    context = TARGET.context
    start, apart, at = int(context["current_start"]), int(context["current_tbprd"]) + 1, int(context["current_cmpb"])
    assert start + 50 == apart // 2 == 2500
    assert start + 6 * apart + 50 + 24 < at < start + 7 * apart
    assert int(context["current_rest_cycles"]) == 40_000 - at == 7_000
