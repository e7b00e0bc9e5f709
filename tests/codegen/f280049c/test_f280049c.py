"""The F280049C folder: what of its C is its own, on a model behind a stand-in of DriverLib.

test_c2000.py has the rest.

Oracle of names, argument order and argument types: epwm.h, adc.h, sysctl.h, gpio.h, xbar.h and interrupt.h of
C2000Ware's DriverLib for the F28004x.
"""

import pytest

from dzdesign.codegen.f280049c.target import TARGET
from tests.codegen.test_c2000 import (
    check_both_outputs,
    check_normal_running,
    check_second_missing_samples,
    check_zero_command,
    of_current_on,
)
from tests.support.c2000_devices import ONE, TWO, calls_of, column, program, running
from tests.support.example_coil import SENSORS
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
HARDWARE = "dz_hardware.c"
of_current = of_current_on("f280049c")
PLAIN, SUPPLY = SENSORS
#: What the set-up calls by the form.
CALLS = {
    ONE: (
        "EPWM_setTimeBasePeriod EPWM1_BASE 39999",
        "EPWM_setClockPrescaler EPWM1_BASE EPWM_CLOCK_DIVIDER_1 EPWM_HSCLOCK_DIVIDER_1",
        "EPWM_setTimeBaseCounterMode EPWM1_BASE EPWM_COUNTER_MODE_UP",
        "EPWM_setCounterCompareShadowLoadMode EPWM1_BASE EPWM_COUNTER_COMPARE_A EPWM_COMP_LOAD_ON_CNTR_ZERO",
        "EPWM_setCounterCompareValue EPWM1_BASE EPWM_COUNTER_COMPARE_B 2000",
        "EPWM_setADCTriggerEventPrescale EPWM1_BASE EPWM_SOC_A 2",
        "EPWM_setInterruptEventCount EPWM1_BASE 1",
        *(f"ADC_setupSOC ADCA_BASE ADC_SOC_NUMBER{n + 1} ADC_TRIGGER_EPWM1_SOCA ADC_CH_ADCIN{n} 50" for n in range(3)),
        "ADC_setVREF ADCA_BASE ADC_REFERENCE_INTERNAL ADC_REFERENCE_3_3V",
        "SysCtl_setWatchdogMode SYSCTL_WD_MODE_RESET",
        "Interrupt_register INT_EPWM1 dz_isr",
    ),
    PLAIN: (
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
        "ADC_setInterruptSource ADCA_BASE ADC_INT_NUMBER1 ADC_SOC_NUMBER3",
        "ADC_setInterruptSource ADCA_BASE ADC_INT_NUMBER2 ADC_SOC_NUMBER15",
        *(f"ADC_setupSOC ADCA_BASE ADC_SOC_NUMBER{n} ADC_TRIGGER_SW_ONLY ADC_CH_ADCIN3 50" for n in range(8, 16)),
    ),
    SUPPLY: (
        "ADC_setupSOC ADCA_BASE ADC_SOC_NUMBER4 ADC_TRIGGER_EPWM1_SOCA ADC_CH_ADCIN4 50",
        "ADC_setInterruptSource ADCA_BASE ADC_INT_NUMBER1 ADC_SOC_NUMBER4",
    ),
}


def check_set_up(go, form: str = ONE) -> None:
    calls = calls_of(*go.of)
    assert [call for call in CALLS[form] if call not in calls] == []
    drives_second = [call for call in calls if call.startswith("GPIO_setPinConfig GPIO_2_")]
    assert form == ONE or not drives_second, "with current control ePWM2 drives no pin"


def check_order(go) -> None:
    """The output is tripped before anything can drive it, and the interrupt comes last."""
    calls = calls_of(*go.of)
    at = calls.index
    trip = max(i for i, call in enumerate(calls[: at("device_eint")]) if call.startswith("EPWM_forceTripZoneEvent"))
    listened = at("EPWM_enableTripZoneSignals EPWM1_BASE EPWM_TZ_SIGNAL_OSHT1")
    assert at("XBAR_setInputPin XBAR_INPUT1 12") < listened < trip
    assert at("EPWM_setTripZoneAction EPWM1_BASE EPWM_TZ_ACTION_EVENT_TZA EPWM_TZ_ACTION_LOW") < trip
    driving = ("EPWM_setActionQualifierAction", "GPIO_", "SysCtl_enablePeripheral", "EPWM_setTimeBase")
    assert all(index > trip for index, call in enumerate(calls) if call.startswith(driving))
    stopped = at("SysCtl_disablePeripheral SYSCTL_PERIPH_CLK_TBCLKSYNC")
    started = at("SysCtl_enablePeripheral SYSCTL_PERIPH_CLK_TBCLKSYNC")
    set_up = [index for index, call in enumerate(calls[: at("device_eint")]) if call.startswith("EPWM_set")]
    assert all(stopped < index < started for index in set_up if index > trip)
    assert trip < at("GPIO_setPinConfig GPIO_0_EPWM1_A") < started
    assert started < at("Interrupt_enable INT_EPWM1") < at("device_eint")
    assert at("SysCtl_setWatchdogMode SYSCTL_WD_MODE_RESET") < at("SysCtl_enableWatchdog") < at("device_eint")


@pytest.mark.parametrize("form", [ONE, TWO, *SENSORS])
def test_the_set_up_calls_driverlib_as_it_documents_and_in_this_order(form):
    go = running("f280049c", form)
    check_set_up(go, ONE if form == TWO else form)
    check_order(go)


def test_a_busy_converter_gives_no_sample_and_the_watchdog_is_served_only_if_the_interrupt_ran():
    ticks = running("f280049c")("b" * 12)
    assert set(column(ticks, "output")) == {"low"} and ticks[-1]["fault"] == 1
    turns = calls_of("f280049c")
    without, with_one = turns.index("without an interrupt:"), turns.index("with one:")
    assert "SysCtl_serviceWatchdog" not in turns[without:with_one] and "SysCtl_serviceWatchdog" in turns[with_one:]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "file", "old", "new", "check"),
    [
        (ONE, HARDWARE, "TimeBasePeriod(DZ_PWM_A, DZ_PWM_TBPRD)", "TimeBasePeriod(DZ_PWM_A, 9u)", check_set_up),
        (ONE, HARDWARE, "EPWM_TZ_ACTION_LOW", "EPWM_TZ_ACTION_HIGH", check_order),
        (ONE, HARDWARE, "EPWM_forceTripZoneEvent(DZ_PWM_A, EPWM_TZ_FORCE_EVENT_OST);", "", check_order),
        (ONE, HARDWARE, "XBAR_INPUT1, DZ_BOARD_TRIP_GPIO", "XBAR_INPUT1, DZ_BOARD_PWM_GPIO", check_order),
        (ONE, "main.c", "    dz_output_hold_low();", "", check_order),
        (ONE, HARDWARE, "EPWM_INT_TBCTR_U_CMPB", "EPWM_INT_TBCTR_ZERO", check_normal_running),
        (ONE, HARDWARE, "EPWM_SOC_A, DZ_TICKS_PER_SAMPLE", "EPWM_SOC_A, 1u", check_normal_running),
        (ONE, HARDWARE, "DZ_BOARD_PRESSURE_A)", "DZ_BOARD_PRESSURE_B)", check_normal_running),
        (ONE, HARDWARE, "DEVICE_DELAY_US(1000);", "", check_normal_running),
        (ONE, HARDWARE, "        clear_flag(ADC_INT_NUMBER1);", "", check_normal_running),
        (ONE, HARDWARE, "    EPWM_clearEventTriggerInterruptFlag(DZ_PWM_A);\n    Interrupt", "    Interrupt",
         check_normal_running),
        (ONE, HARDWARE, "Interrupt_clearACKGroup(INTERRUPT_ACK_GROUP3);", "", check_normal_running),
        (ONE, HARDWARE, "(compare == 0u) ? EPWM_AQ_SW_OUTPUT_LOW : EPWM_AQ_SW_DISABLED", "EPWM_AQ_SW_DISABLED",
         check_zero_command),
        (TWO, HARDWARE, "    EPWM_forceTripZoneEvent(DZ_PWM_B, EPWM_TZ_FORCE_EVENT_OST);\n}\n\nvoid dz_untrip",
         "}\n\nvoid dz_untrip", check_second_missing_samples),
        (TWO, HARDWARE, "EPWM_clearTripZoneFlag(DZ_PWM_B, EPWM_TZ_FLAG_OST);", "", check_both_outputs),
        (TWO, HARDWARE, "EPWM_enableTripZoneSignals(DZ_PWM_B, EPWM_TZ_SIGNAL_OSHT1);", "", check_both_outputs),
        (PLAIN, HARDWARE, "EPWM_SOC_TBCTR_U_CMPA", "EPWM_SOC_TBCTR_ZERO", of_current("sampling")),
        (PLAIN, HARDWARE, "DZ_PWM_B, EPWM_SOC_A, 1u", "DZ_PWM_B, EPWM_SOC_A, 2u", of_current("sampling")),
        (PLAIN, HARDWARE, "    EPWM_enablePhaseShiftLoad(DZ_PWM_B);\n", "", of_current("sampling")),
        (PLAIN, HARDWARE, "DZ_PWM_B, DZ_CURRENT_TBPRD", "DZ_PWM_B, DZ_PWM_TBPRD", of_current("sampling")),
        (PLAIN, HARDWARE, "DZ_CURRENT_TRIGGER, 1u", "DZ_PWM_TRIGGER, 1u", of_current("sampling")),
        (PLAIN, HARDWARE, "    ADC_enableBurstMode(ADCA_BASE);\n", "", of_current("sampling")),
        (PLAIN, "dz_hardware.h", "#define DZ_ISR_CMPB 33000u", "#define DZ_ISR_CMPB 2000u", of_current("sampling")),
        (PLAIN, HARDWARE, "ADC_SOC_NUMBER11, ADC_TRIGGER_SW_ONLY, DZ_CHANNEL(DZ_BOARD_CURRENT)",
         "ADC_SOC_NUMBER11, ADC_TRIGGER_SW_ONLY, DZ_CHANNEL(DZ_BOARD_COMMAND)", of_current("start")),
        (PLAIN, HARDWARE, "ADC_readResult(ADCARESULT_BASE, ADC_SOC_NUMBER15)",
         "ADC_readResult(ADCARESULT_BASE, ADC_SOC_NUMBER0)", of_current("start")),
        (PLAIN, HARDWARE, "        clear_flag(ADC_INT_NUMBER2);", "", of_current("faults")),
        (PLAIN, HARDWARE, "EPWM_TZ_ACTION_LOW", "EPWM_TZ_ACTION_HIGH", of_current("start")),
        (PLAIN, HARDWARE, "    XBAR_setInputPin(XBAR_INPUT2, DZ_BOARD_OVER_CURRENT_GPIO);", "", of_current("faults")),
        (PLAIN, HARDWARE, " && (GPIO_readPin(DZ_BOARD_OVER_CURRENT_GPIO) != 0u)", "", of_current("closed_comparator")),
    ],
)  # fmt: skip
def test_a_seeded_fault_is_caught(form, file, old, new, check):
    go = running("f280049c", form, (file, old, new))
    with pytest.raises((AssertionError, ValueError)):
        check(go)


def test_arguments_in_a_wrong_order_do_not_compile():
    right, wrong = "EPWM_TZ_ACTION_EVENT_TZA, EPWM_TZ_ACTION_LOW", "EPWM_TZ_ACTION_LOW, EPWM_TZ_ACTION_EVENT_TZA"
    with pytest.raises(AssertionError, match="enum"):
        program("f280049c", ONE, (HARDWARE, right, wrong))


def test_numbers_follow_from_the_engineering_quantities():
    context = TARGET.context
    assert int(context["tbprd"]) == 100_000_000 // 2_500 - 1 == 39_999
    assert TARGET.compare_max == 40_000 and TARGET.converter.code_max == 4_095
    assert int(context["cmpb"]) == 100 * 20 and context["adcclk_mhz"] == "50"
