"""The F28335 folder: its numbers, and what of its C is its own, on a model of the device; test_c2000.py has the rest.

Oracle of the register values: technical reference manual of the TMS320x2833x (SPRUI07) with the set-up of
C2000Ware's F2833x examples.
"""

import itertools
import re
from dataclasses import replace

import pytest

from dzdesign.codegen.f28335.target import TARGET
from dzdesign.core.errors import DzdesignError
from tests.codegen.test_c2000 import (
    check_both_outputs,
    check_normal_running,
    check_second_missing_samples,
    check_zero_command,
    compare_of_sample,
    of_current_on,
)
from tests.support.c2000_devices import ONE, TWO, calls_of, column, run, running, texts_of
from tests.support.synthetic import needs_compiler

HARDWARE = "dz_hardware.c"
of_current = of_current_on("f28335")
PLAIN, SUPPLY = "supply unknown", "supply measured"
#: The resets of the sequencers in ADCTRL2 clear themselves.
START_VALUES = {
    "TBCTL": 0x0000, "TBPRD": 0xEA5F, "CMPCTL": 0x0000, "CMPB": 0x0BB8, "AQCTLA": 0x0012, "ETSEL": 0x090E,
    "ETPS": 0x0201, "TZSEL": 0x0100, "TZCTL": 0x0002, "ADCTRL1": 0x0F10, "ADCTRL2": 0x0100, "ADCTRL3": 0x00E2,
    "ADCMAXCONV": 0x0003, "ADCCHSELSEQ1": 0x2100, "HISPCP": 0x0003, "PLLCR": 0x000A,
    "LOSPCP": 0x0001, "SCICCR": 0x0007, "SCICTL1": 0x0022, "SCICTL2": 0x0000, "SCIHBAUD": 0x0000, "SCILBAUD": 0x0050,
    "SCIFFTX": 0xE000, "SCIFFRX": 0x0000, "SCIFFCT": 0x0000, "GPIO28_MUX": 1, "GPIO28_QUALIFIER": 3, "GPIO29_MUX": 1,
    "TBCLKSYNC": 1, "WDCR": 0x0028, "SCSR": 0, "GPIO0_MUX": 1, "GPIO0_PULLUP_OFF": 1, "GPIO12_MUX": 1,
    "PIEIER3": 1, "IER": 0x0004, "OST": 1, "CMPA": 0, "VECTOR_SET": 1,
}  # fmt: skip
#: Registers that nothing here uses, and that would change what the pin does.
LEFT_AT_ZERO = dict.fromkeys(
    ("CMPAHR", "TBPHS", "AQCTLB", "AQSFRC", "DBCTL", "PCCTL", "TZEINT", "HRCNFG"), 0
) | {"AQCSFRC": 1}  # fmt: skip
#: Of the second output, which only a command of both signs has; and of ePWM1 the pulse that keeps it in step.
SECOND_VALUES = {
    "SECOND_TBCTL": 0x0004, "SECOND_TBPRD": 0xEA5F, "SECOND_CMPCTL": 0, "SECOND_AQCTLA": 0x0012, "SECOND_ETSEL": 0,
    "SECOND_TZSEL": 0x0100, "SECOND_TZCTL": 0x0002, "SECOND_OST": 1, "GPIO2_MUX": 1, "GPIO2_PULLUP_OFF": 1,
    "SECOND_DBCTL": 0, "SECOND_PCCTL": 0, "SECOND_AQCTLB": 0, "SECOND_TZEINT": 0, "SECOND_HRCNFG": 0, "SECOND_CMPB": 0,
    "SECOND_ETPS": 0, "TBCTL": 0x0010,
}  # fmt: skip
#: What only a controlled current needs: left as a reset leaves them.
OF_CURRENT = ("ADCCHSELSEQ3", "ADCCHSELSEQ4", "GPIO13_MUX", "TRIGGER_CMPA", "TRIGGER_ETPS")
#: With current control: two sequencers, the counter of ePWM2, a later interrupt, two trip inputs.
CURRENT_VALUES = {
    "TBCTL": 0x0010, "CMPB": 0xC15C, "TZSEL": 0x0300, "ADCTRL1": 0x0F00, "ADCTRL2": 0x0101, "ADCCHSELSEQ3": 0x3333,
    "ADCCHSELSEQ4": 0x3333, "GPIO13_MUX": 1, "SECOND_TBCTL": 0x0004, "SECOND_TBPRD": 0x1D4B, "SECOND_CMPCTL": 0x0010,
    "TRIGGER_CMPA": 0x0DC8, "SECOND_ETSEL": 0xC000, "TRIGGER_ETPS": 0x1000, "SECOND_AQCTLA": 0, "GPIO2_MUX": 0,
}  # fmt: skip
#: And with the supply measured: one conversion more of the sample.
SUPPLY_VALUES = {"ADCMAXCONV": 0x0004, "ADCCHSELSEQ2": 0x0004}
#: What the registers hold by the form.
VALUES = {
    ONE: START_VALUES,
    TWO: START_VALUES | LEFT_AT_ZERO | SECOND_VALUES | dict.fromkeys(OF_CURRENT, 0),
    PLAIN: START_VALUES | CURRENT_VALUES,
    SUPPLY: START_VALUES | CURRENT_VALUES | SUPPLY_VALUES,
}


def registers(run_periods, *left_behind: str) -> dict[str, int]:
    """Return what the registers hold after the start of a firmware."""
    lines = (line.split() for line in run(*run_periods.args, "registers", *left_behind))
    return {words[0]: int(words[1], 16) for words in lines if len(words) == 2}


def check_values(go, expected: dict[str, int], *left_behind: str) -> None:
    found = registers(go, *left_behind)
    assert {name: found[name] for name in expected} == expected


def check_registers(go) -> None:
    check_values(go, START_VALUES)


def check_second_registers(go) -> None:
    check_values(go, VALUES[TWO])


def check_current_registers(go) -> None:
    check_values(go, VALUES[PLAIN])


@needs_compiler
@pytest.mark.parametrize("form", VALUES)
def test_registers_hold_what_the_manual_says(form):
    go = running("f28335", form)
    check_values(go, VALUES[form])
    if form == ONE:
        found = registers(go)
        assert {found[name] for name in SECOND_VALUES if name.startswith(("SECOND", "GPIO2_MUX"))} == {0, 0x83}, "reset"


def check_left_behind(go, expected: dict[str, int] = START_VALUES | LEFT_AT_ZERO) -> None:
    """After a load by the debugger registers hold what the last program left: only their own reset clears them."""
    for left_behind in ("0000", "FFFF", "A5A5"):
        check_values(go, expected, left_behind)


@needs_compiler
def test_registers_that_another_program_has_set_are_written():
    check_left_behind(running("f28335"))
    of_both = START_VALUES | LEFT_AT_ZERO | SECOND_VALUES
    check_left_behind(running("f28335", TWO), of_both)


def check_service(go) -> None:
    """The sequencer is reset after a finished sequence only; group 3, and only it, is acknowledged each time."""
    check_normal_running(go)
    ticks = go("." * 10)
    assert column(ticks, "pieack") == [4] * 10
    assert column(ticks, "resets") == [0, 1] * 5 and not any(column(ticks, "reset_busy"))


def check_late_sequence(go) -> None:
    """It is read on the next tick, and never reset while busy."""
    ticks = go("...l....")
    assert not any(column(ticks, "reset_busy"))
    assert column(ticks, "resets") == [0, 1, 0, 0, 1, 1, 0, 1]
    assert column(ticks, "cmpa")[3:5] == [compare_of_sample(1), compare_of_sample(2)]


def check_delays(go) -> None:
    """From each sample to what its value moves at the pin: as target.py derives and the README states, to a count."""
    ticks = go("f" * 12)
    assert set(column(ticks, "duty")[2:]) == {59_999}, "from the second sample on every period uses a sample's value"
    held = [tick["held"] for tick in ticks if tick["held"]]
    assert {later - earlier for earlier, later in itertools.pairwise(held)} == {2 * 60_000}, "1.25 kHz"
    delays = {"period": [], "edge": [], "last_edge": []}
    for sample, following in itertools.pairwise(held):
        uses = [tick for tick in ticks if tick["falls"] and sample < tick["begins"] <= following]
        assert len(uses) == 2, "a value stands for two periods"
        for key, end in (("period", uses[0]["begins"]), ("edge", uses[0]["falls"]), ("last_edge", uses[1]["falls"])):
            delays[key].append((end - sample) / int(TARGET.context["clock_mhz"]))
    for key, of_key in delays.items():
        assert max(of_key) == pytest.approx(float(TARGET.context[f"delay_to_{key}_us"]), abs=0.001), key


def check_drive_calls(go) -> None:
    """A tick each period, a sample where there is one, both from the release of the output on."""
    ticks = go("." * 9)
    assert column(ticks, "drive_ticks") == [0, 1, 2, 3, 4, 5, 6, 7, 8]
    assert column(ticks, "samples") == [0, 1, 1, 2, 2, 3, 3, 4, 4]


def check_delayed_start(go) -> None:
    """While the trip input is low the drive does not run: its ramps start with the output."""
    ticks = go("T.....t....")
    assert column(ticks, "drive_ticks") == [0] * 7 + [1, 2, 3, 4] and not any(column(ticks, "fault"))
    tripped = go("B..." + "x" * 10 + "......")[-1]
    assert (tripped["samples"], tripped["drive_ticks"]) == (0, 0), "and after a fault it is at rest"


CHECKS = (check_service, check_late_sequence, check_delays)


@needs_compiler
@pytest.mark.parametrize(("form", "checks"), [(ONE, CHECKS), (TWO, (*CHECKS, check_drive_calls, check_delayed_start))])
def test_firmware_on_the_device_model(form, checks):
    for check in checks:
        check(running("f28335", form))


@needs_compiler
def test_start_up_order_and_watchdog():
    before = ["DisableDog", "InitPll 10 2", "InitPeripheralClocks", "device_dint"]
    after = ["InitPieCtrl", "InitPieVectTable", "InitAdc", "ServiceDog", "device_eint", "ServiceDog",
             "without an interrupt:", "with one:", "ServiceDog", "services 3"]  # fmt: skip
    copied = ["MemCopy RamfuncsLoadStart RamfuncsLoadEnd RamfuncsRunStart", "InitFlash"]
    assert calls_of("f28335") == [*before, *after]
    assert calls_of("f28335", ONE, None, "-D_FLASH") == [*before, *copied, *after]


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "file", "old", "new", "check"),
    [
        (ONE, HARDWARE, "TBPRD = DZ_PWM_TBPRD", "TBPRD = DZ_PWM_TBPRD - 1u", check_registers),
        (ONE, HARDWARE, "TZA = TZ_FORCE_LO", "TZA = TZ_FORCE_HI", check_normal_running),
        (ONE, HARDWARE, "SOCAPRD = ET_2ND", "SOCAPRD = ET_1ST", check_delays),
        (ONE, HARDWARE, "INTSEL = ET_CTRU_CMPB", "INTSEL = ET_CTR_ZERO", check_normal_running),
        (ONE, HARDWARE, "DZ_PWM_A.TZFRC.bit.OST = 1u;", "", check_normal_running),
        (ONE, HARDWARE, "    EALLOW;\n    DZ_PWM_A.TZCTL", "    DZ_PWM_A.TZCTL", check_registers),
        (ONE, HARDWARE, "PieCtrlRegs.PIEACK.all = PIEACK_GROUP3;", "", check_normal_running),
        (ONE, HARDWARE, "PIEACK.all = PIEACK_GROUP3", "PIEACK.bit.ACK1 = 1u", check_service),
        (ONE, HARDWARE, "    DZ_PWM_A.ETCLR.bit.INT = 1u;\n    PieCtrl", "    PieCtrl", check_normal_running),
        (ONE, HARDWARE, "        AdcRegs.ADCTRL2.bit.RST_SEQ1 = 1u;", "", check_normal_running),
        (ONE, HARDWARE, "ADCRESULT1", "ADCRESULT2", check_normal_running),
        (ONE, HARDWARE, "CMPB = DZ_ISR_CMPB", "CMPB = 0u", check_delays),
        (ONE, HARDWARE, "INTPRD = ET_1ST", "INTPRD = ET_2ND", check_normal_running),
        (ONE, HARDWARE, "ACQ_PS = DZ_BOARD_ACQ_PS", "ACQ_PS = 0u", check_delays),
        (ONE, HARDWARE, "(compare == 0u) ? DZ_FORCE_LOW : DZ_FORCE_NONE", "DZ_FORCE_NONE", check_zero_command),
        (ONE, HARDWARE, "    clear_leftovers();\n", "    (void)clear_leftovers;\n", check_left_behind),
        (ONE, HARDWARE, "DZ_PWM_A.DBCTL.all = 0u;", "", check_left_behind),
        (ONE, HARDWARE, "    EALLOW;\n    DZ_PWM_A.HRCNFG", "    DZ_PWM_A.HRCNFG", check_left_behind),
        (ONE, "dz_telemetry.c", "    EALLOW;\n    SysCtrlRegs", "    SysCtrlRegs", check_registers),
        (TWO, HARDWARE, "DZ_PWM_B.TZFRC.bit.OST = 1u;", "", check_second_registers),
        (TWO, HARDWARE, "DZ_PWM_B.TZCTL.bit.TZA = TZ_FORCE_LO", "DZ_PWM_B.TZCTL.bit.TZA = 0u", check_both_outputs),
        (TWO, HARDWARE, "DZ_PWM_B.TZSEL.bit.DZ_TRIP_ONE_SHOT = TZ_ENABLE", "DZ_PWM_B.TZSEL.all = 0u",
         check_second_registers),
        (TWO, HARDWARE, "DZ_PWM_B.TBCTL.bit.PHSEN = TB_ENABLE;", "", check_both_outputs),
        (TWO, HARDWARE, "DZ_PWM_B.TZFRC.bit.OST = 1u;\n    EDIS;\n}\n\nvoid dz_un", "EDIS;\n}\n\nvoid dz_un",
         check_second_missing_samples),
        (TWO, HARDWARE, "DZ_PWM_B.TZCLR.bit.OST = 1u;", "", check_both_outputs),
        (TWO, "dz_isr.c", "dz_drive_tick(&drive);", "if (fresh) { dz_drive_tick(&drive); }", check_drive_calls),
        (TWO, "dz_isr.c", "            if (fresh != 0u)", "            if (fresh <= 1u)", check_drive_calls),
        (TWO, "dz_isr.c", "        if (state.released != 0u)", "        if (state.ticks != 0u)",
         check_delayed_start),
        (PLAIN, HARDWARE, "SOCBSEL = ET_CTRU_CMPA", "SOCBSEL = ET_CTR_ZERO", of_current("sampling")),
        (PLAIN, HARDWARE, "ETPS.bit.SOCBPRD = ET_1ST", "ETPS.bit.SOCBPRD = ET_2ND", of_current("sampling")),
        (PLAIN, HARDWARE, "DZ_PWM_B.TBPRD = DZ_CURRENT_TBPRD", "DZ_PWM_B.TBPRD = DZ_PWM_TBPRD",
         of_current("sampling")),
        (PLAIN, HARDWARE, "DZ_PWM_A.TBCTL.bit.SYNCOSEL = TB_CTR_ZERO;", "", of_current("sampling")),
        (PLAIN, HARDWARE, "CMPA.half.CMPA = DZ_CURRENT_START", "CMPA.half.CMPA = 0u", of_current("sampling")),
        (PLAIN, HARDWARE, "SHDWAMODE = CC_IMMEDIATE", "SHDWAMODE = CC_SHADOW", check_current_registers),
        (PLAIN, "dz_hardware.h", "#define DZ_ISR_CMPB 49500u", "#define DZ_ISR_CMPB 3000u", of_current("sampling")),
        (PLAIN, HARDWARE, "SEQ_CASC = 0u", "SEQ_CASC = 1u", of_current("sampling")),
        (PLAIN, HARDWARE, "AdcRegs.ADCTRL2.bit.EPWM_SOCB_SEQ2 = 1u;", "", of_current("start")),
        (PLAIN, "dz_hardware.h", "((channel) * 0x1111u)", "0x3332u", of_current("start")),
        (PLAIN, HARDWARE, "SEQ4.all = DZ_CURRENT_CHANNELS(DZ_BOARD_CURRENT)", "SEQ4.all = 0u", of_current("start")),
        (PLAIN, HARDWARE, "AdcMirror.ADCRESULT15", "AdcMirror.ADCRESULT0", of_current("start")),
        (PLAIN, HARDWARE, "CONV00 = DZ_BOARD_COMMAND", "CONV00 = 3u", check_current_registers),
        (PLAIN, HARDWARE, "TZA = TZ_FORCE_LO", "TZA = TZ_FORCE_HI", of_current("start")),
        (PLAIN, "dz_hardware.h", "DZ_CURRENT_REST_TICKS 97u", "DZ_CURRENT_REST_TICKS 1u", of_current("start")),
        (PLAIN, HARDWARE, "        AdcRegs.ADCST.bit.INT_SEQ2_CLR = 1u;", "", of_current("faults")),
        (PLAIN, HARDWARE, "TZSEL.bit.DZ_OVER_CURRENT_ONE_SHOT = TZ_ENABLE",
         "TZSEL.bit.DZ_OVER_CURRENT_ONE_SHOT = 0u", of_current("faults")),
        (PLAIN, HARDWARE, " && (GpioDataRegs.GPADAT.bit.DZ_OVER_CURRENT_PIN != 0u)", "",
         of_current("closed_comparator")),
    ],
)  # fmt: skip
def test_a_seeded_fault_is_caught(form, file, old, new, check):
    go = running("f28335", form, (file, old, new))
    with pytest.raises((AssertionError, ValueError)):
        check(go)


def test_numbers_follow_from_the_engineering_quantities():
    context = TARGET.context
    assert int(context["tbprd"]) == 150_000_000 // 2_500 - 1 == 59_999
    assert int(context["cmpb"]) == 150 * 20 == 3_000
    assert (context["wdflag_ms"], context["wdrst_us"]) == ("1.11", "17"), "(4 x 8192 + 512) and 512 periods of 30 MHz"
    assert TARGET.compare_max == 60_000 and TARGET.converter.code_max == 4_095
    assert (context["adcclk_mhz"], context["sequence_us"]) == ("12.5", "5.88")
    assert context["held_us"] == "2.84", "2.5 + 16 periods of 80 ns, and 17 of what is not used"
    # 400 - 2.84; 400 more less one count of 1/150 us; 400 more
    delays = [context[f"delay_to_{key}_us"] for key in ("period", "edge", "last_edge")]
    assert delays == ["397.16", "797.153", "1197.153"]
    assert (context["brr"], context["baud_real"], context["baud_error"]) == ("80", "115741", "+0.47")
    assert context["soca_prescale"] == "ET_2ND"


@pytest.mark.parametrize(
    "change",
    [
        {"context": {"tbprd": 59_999}},
        {"templates": {"../outside.c": "main.c.jinja"}},
        {"templates": {"/main.c": "main.c.jinja"}},
        {"compare_max": 70_000},
        {"name": "f28335 rev A"},
    ],
)
def test_a_plan_that_cannot_be_printed_is_refused(change):
    with pytest.raises(DzdesignError):
        replace(TARGET, **change)


def test_the_interrupt_has_no_part_in_the_telemetry_and_is_never_held_off():
    code = {
        name: re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        for name, text in texts_of("f28335").items()
        if name.endswith((".c", ".h"))
    }
    assert [name for name, text in code.items() if "SciaRegs" in text] == ["dz_telemetry.c"]
    assert {name for name, text in code.items() if "dz_telemetry_" in text} == {
        "main.c",
        "dz_telemetry.c",
        "dz_telemetry.h",
    }
    assert [name for name, text in code.items() if re.search(r"\bDINT\b", text)] == ["main.c"]
    assert code["main.c"].index("DINT") < code["main.c"].index("EINT") < code["main.c"].index("for (;;)")
    for name, text in code.items():  # a byte of the C28x has 16 bits, and its double 32 or 64
        assert not re.search(r"\b(u?int8_t|char|float|double|long)\b", text), name
