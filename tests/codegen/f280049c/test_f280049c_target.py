"""The F280049C folder: its numbers, its project files, and its C run on a model behind a stand-in for DriverLib.

Oracle of names, argument order and argument types: epwm.h, adc.h, sysctl.h, gpio.h, xbar.h and interrupt.h of
C2000Ware's DriverLib for the F28004x; of the zero-duty case: SPRAAI1.
"""

import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import pytest

from dzdesign.codegen import c2000
from dzdesign.codegen.banner import Banner
from dzdesign.codegen.f280049c import target as f280049c
from dzdesign.codegen.f280049c.target import TARGET
from dzdesign.codegen.project import target_files
from dzdesign.core.errors import DzdesignError
from dzdesign.design.current.circuit import CurrentSensor
from dzdesign.verify.toolchain.host_compiler import STRICT, host_compiler
from tests.support.current_loops import current_texts
from tests.support.example_coil import with_current
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator
from tests.support.paths import DEVICES
from tests.support.synthetic import needs_compiler

HERE = DEVICES / "f280049c"
TIMEOUT = int(TARGET.context["sample_timeout_ticks"])


@pytest.fixture
def firmware(tmp_path) -> Path:
    return render(tmp_path, 1)


@pytest.fixture
def bipolar(tmp_path) -> Path:
    return render(tmp_path, 1, -1)


def render(tmp_path: Path, *signs: int, sensor: CurrentSensor | None = None) -> Path:
    """Write the target's folder, by the real renderer; with a sensor of the current its controller is there too."""
    compensator = golden_compensator("f280049c", FULL if -1 in signs else GOLDENS)
    core = {}
    if sensor:
        compensator = with_current(compensator, TARGET, sensor)
        core = {f"f280049c/{name}": text for name, text in current_texts(compensator.current_drive.loop).items()}
    for path, text in (target_files(compensator, TARGET, Banner(digest="0" * 64)) | core).items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(text, encoding="utf-8", newline="\n")
    return tmp_path / "f280049c"


def build(firmware: Path) -> Path:
    """Compile the generated C with the model; a call that does not fit the stand-in's types is an error."""
    sources = [firmware / "dz_hardware.c", firmware / "dz_isr.c"]
    sources += [HERE / name for name in ("device.c", "driver.c", "dz_comp.c")]
    sources += firmware.glob("dz_current.c")
    command = [host_compiler(), *STRICT, "-Wenum-conversion", f"-I{firmware}", f"-I{HERE}", *map(str, sources)]
    done = subprocess.run(
        [*command, "-lm", "-o", str(firmware / "driver")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return firmware / "driver"


def run(program: Path, *words: str) -> list[str]:
    done = subprocess.run([program, *words], capture_output=True, text=True, check=True, timeout=20)
    return done.stdout.splitlines()


def periods(program: Path, events: str, *start: str) -> dict[str, list]:
    """The driver's facts, one list a fact with one value a period."""
    ticks = [dict(word.split("=", 1) for word in line.split()[1:]) for line in run(program, "run", events, *start)]
    assert len(ticks) == len(events)
    return {key: [int(tick[key]) if tick[key].isdigit() else tick[key] for tick in ticks] for key in ticks[0]}


def check_set_up(program: Path) -> None:
    calls = run(program, "calls")
    said = set(calls)
    for call in (
        "EPWM_setTimeBasePeriod EPWM1_BASE 39999",
        "EPWM_setClockPrescaler EPWM1_BASE EPWM_CLOCK_DIVIDER_1 EPWM_HSCLOCK_DIVIDER_1",
        "EPWM_setTimeBaseCounterMode EPWM1_BASE EPWM_COUNTER_MODE_UP",
        "EPWM_setCounterCompareShadowLoadMode EPWM1_BASE EPWM_COUNTER_COMPARE_A EPWM_COMP_LOAD_ON_CNTR_ZERO",
        "EPWM_setCounterCompareValue EPWM1_BASE EPWM_COUNTER_COMPARE_B 2000",
        "EPWM_setADCTriggerEventPrescale EPWM1_BASE EPWM_SOC_A 2",
        "EPWM_setInterruptEventCount EPWM1_BASE 1",
        "ADC_setupSOC ADCA_BASE 0 ADC_TRIGGER_EPWM1_SOCA ADC_CH_ADCIN0 50",
        "ADC_setupSOC ADCA_BASE 1 ADC_TRIGGER_EPWM1_SOCA ADC_CH_ADCIN1 50",
        "ADC_setupSOC ADCA_BASE 2 ADC_TRIGGER_EPWM1_SOCA ADC_CH_ADCIN2 50",
        "ADC_setVREF ADCA_BASE ADC_REFERENCE_INTERNAL ADC_REFERENCE_3_3V",
        "SysCtl_setWatchdogMode SYSCTL_WD_MODE_RESET",
        "Interrupt_register INT_EPWM1",
    ):
        assert call in said, call


def check_order(program: Path) -> None:
    """The output is tripped before anything can drive it, and the interrupt comes last."""
    calls = run(program, "calls")
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


def check_normal_running(program: Path) -> None:
    """Ten periods from power-up: a sample on every second one; the stand-in core tells the order of its arguments."""
    ticks = periods(program, "." * 10)
    assert ticks["served"] == [1] * 10, "one interrupt a period"
    held = [0] + [100 * n + 10 * 1 + 100 * 2 for n in (1, 1, 2, 2, 3, 3, 4, 4, 5)]
    assert ticks["cmpa"] == held, "written with the sample, held on the tick between"
    assert ticks["output"] == ["low"] * 2 + ["pwm"] * 8 and ticks["duty"][2:] == held[1:-1], "one period later"
    assert ticks["without"] == [1, 0] * 5 and not any(ticks["fault"])


def check_trip_on_missing_samples(program: Path) -> None:
    ticks = periods(program, "...." + "x" * 10 + "....")
    tripped = ticks["fault"].index(1)
    assert tripped == 3 + TIMEOUT, "the last sample came with the fourth period"
    assert ticks["output"][tripped + 1 :] == ["low"] * (len(ticks["output"]) - tripped - 1)
    assert set(ticks["fault"][tripped:]) == {1}, "latched, though samples come again"


def check_zero_command(program: Path) -> None:
    ticks = periods(program, "....z.....n...")
    assert ticks["output"][6:12] == ["low"] * 6 and ticks["output"][-1] == "pwm"


CHECKS = [check_set_up, check_order, check_normal_running, check_trip_on_missing_samples, check_zero_command]


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("check", CHECKS)
def test_firmware_on_the_model(firmware, check):
    check(build(firmware))


def check_both_outputs(program: Path) -> None:
    """A drives, then B, then A; never both; a fault ends both at once, and they stay low."""
    ticks = periods(program, "....B.....A.....")
    assert all(a == 0 or b == 0 for a, b in zip(ticks["duty"], ticks["duty_b"], strict=True))
    assert ticks["duty_b"] == [0] * 6 + [100 * n + 210 for n in (3, 3, 4, 4, 5, 5)] + [0] * 4 and ticks["duty"][-1]
    tripped = periods(program, "....B...T.t.....")
    assert not any(tripped["duty"][8:] + tripped["duty_b"][8:]) and set(tripped["tripped_b"][8:]) == {1}


def check_second_trip_on_missing_samples(program: Path) -> None:
    ticks = periods(program, "B..." + "x" * 10 + "....")
    tripped = ticks["fault"].index(1)
    assert any(ticks["duty_b"][:tripped]) and not any(ticks["duty"] + ticks["duty_b"][tripped + 1 :])
    assert set(ticks["tripped_b"][tripped:]) == {1}


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("check", [*CHECKS, check_both_outputs, check_second_trip_on_missing_samples])
def test_firmware_of_two_solenoids_on_the_model(bipolar, check):
    check(build(bipolar))


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    ("file", "old", "new", "check"),
    [
        ("dz_isr.c", "    EPWM_forceTripZoneEvent(EPWM2_BASE, EPWM_TZ_FORCE_EVENT_OST);", "",
         check_second_trip_on_missing_samples),
        ("dz_isr.c", "EPWM_clearTripZoneFlag(EPWM2_BASE, EPWM_TZ_FLAG_OST);", "", check_both_outputs),
        ("dz_isr.c", "write_compare_b(drive.compare_b)", "write_compare_b(drive.compare_a)", check_both_outputs),
        ("dz_hardware.c", "EPWM_enableTripZoneSignals(EPWM2_BASE, EPWM_TZ_SIGNAL_OSHT1);", "",
         check_both_outputs),
    ],
)  # fmt: skip
def test_a_seeded_fault_of_the_second_output_is_caught(bipolar, file, old, new, check):
    source = bipolar / file
    before, found, after = source.read_text(encoding="utf-8").partition(old)
    assert found
    source.write_text(before + new + after, encoding="utf-8")
    program = build(bipolar)
    with pytest.raises((AssertionError, ValueError)):
        check(program)


@needs_compiler
def test_trip_pin_latches_in_use_and_delays_the_start(firmware):
    program = build(firmware)
    in_use = periods(program, "....T.t.....")
    assert set(in_use["output"][4:]) == {"low"} and set(in_use["fault"][4:]) == {2}
    at_start = periods(program, "T.....t....")
    assert at_start["output"] == ["low"] * 8 + ["pwm"] * 3 and not any(at_start["fault"])


@needs_compiler
def test_what_is_no_sample_never_releases_the_output(firmware):
    program = build(firmware)
    for events, start, fault in (("." * 12, "W", 4), ("." * 12, "C", 8), ("h" * 12, "", 1), ("b" * 12, "", 1)):
        ticks = periods(program, events, *([start] if start else []))
        assert set(ticks["output"]) == {"low"} and ticks["fault"][-1] == fault, (events, start)


@needs_compiler
def test_watchdog_is_served_only_if_the_interrupt_ran(firmware):
    assert run(build(firmware), "watchdog") == ["0", "1"]


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    ("file", "old", "new", "check"),
    [
        ("dz_hardware.c", "setTimeBasePeriod(EPWM1_BASE, DZ_PWM_TBPRD)", "setTimeBasePeriod(EPWM1_BASE, 9u)", 0),
        ("dz_hardware.c", "EPWM_TZ_ACTION_LOW", "EPWM_TZ_ACTION_HIGH", 1),
        ("dz_hardware.c", "EPWM_forceTripZoneEvent(EPWM1_BASE, EPWM_TZ_FORCE_EVENT_OST);", "", 1),
        ("dz_hardware.c", "XBAR_INPUT1, DZ_TRIP_PIN", "XBAR_INPUT1, DZ_PWM_PIN", 1),
        ("main.c", "    dz_output_hold_low();", "", 1),
        ("dz_hardware.c", "EPWM_INT_TBCTR_U_CMPB", "EPWM_INT_TBCTR_ZERO", 2),
        ("dz_hardware.c", "EPWM_SOC_A, DZ_TICKS_PER_SAMPLE", "EPWM_SOC_A, 1u", 2),
        ("dz_hardware.c", "ADC_INT_NUMBER1, ADC_SOC_NUMBER2", "ADC_INT_NUMBER1, ADC_SOC_NUMBER0", 2),
        ("dz_hardware.c", "ADC_CH_ADCIN1", "ADC_CH_ADCIN2", 2),
        ("dz_hardware.c", "DEVICE_DELAY_US(1000);", "", 2),
        ("dz_isr.c", "ADC_clearInterruptStatus(ADCA_BASE, ADC_INT_NUMBER1);", "", 2),
        ("dz_isr.c", "EPWM_clearEventTriggerInterruptFlag(EPWM1_BASE);", "", 2),
        ("dz_isr.c", "Interrupt_clearACKGroup(INTERRUPT_ACK_GROUP3);", "", 2),
        ("dz_isr.c", "dz_state.fault |= DZ_FAULT_NO_SAMPLE;", "", 3),
        ("dz_isr.c", "    EPWM_forceTripZoneEvent(EPWM1_BASE, EPWM_TZ_FORCE_EVENT_OST);\n", "    return;\n", 3),
        ("dz_isr.c", "(compare == 0u) ? EPWM_AQ_SW_OUTPUT_LOW : EPWM_AQ_SW_DISABLED", "EPWM_AQ_SW_DISABLED", 4),
    ],
)
def test_a_seeded_fault_is_caught(firmware, file, old, new, check):
    source = firmware / file
    before, found, after = source.read_text(encoding="utf-8").partition(old)
    assert found
    source.write_text(before + new + after, encoding="utf-8")
    program = build(firmware)
    with pytest.raises((AssertionError, ValueError)):
        CHECKS[check](program)


@needs_compiler
def test_arguments_in_a_wrong_order_do_not_compile(firmware):
    source = firmware / "dz_hardware.c"
    text = source.read_text(encoding="utf-8")
    right, wrong = "EPWM_TZ_ACTION_EVENT_TZA, EPWM_TZ_ACTION_LOW", "EPWM_TZ_ACTION_LOW, EPWM_TZ_ACTION_EVENT_TZA"
    assert right in text
    source.write_text(text.replace(right, wrong), encoding="utf-8")
    with pytest.raises(AssertionError, match="enum"):
        build(firmware)


def test_numbers_follow_from_the_engineering_quantities():
    context = TARGET.context
    assert int(context["tbprd"]) == 100_000_000 // 2_500 - 1 == 39_999
    assert TARGET.compare_max == 40_000 and TARGET.converter.code_max == 4_095
    assert int(context["cmpb"]) == 100 * 20 and context["adcclk_mhz"] == "50"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("PWM_HZ", 2_501),
        ("PWM_HZ", 1_250),
        ("SAMPLE_HZ", 100),
        ("SAMPLE_TIMEOUT_S", Fraction(1, 2_500)),
        ("ADC_DIVIDER", 1),
        ("WINDOW_SYSCLKS", 5),
        ("WINDOW_SYSCLKS", 500),
        ("WATCHDOG_COUNTS", 256),
    ],
)
def test_a_quantity_that_does_not_fit_is_refused(monkeypatch, name, value, wording):
    for module in (c2000, f280049c):
        monkeypatch.setattr(module, name, value, raising=False)
    with wording.refusal(DzdesignError):
        f280049c.timing()
        f280049c.converter()


def test_projectspec_links_with_the_options_and_library_of_the_makefile(firmware):
    make = (firmware / "Makefile").read_text(encoding="utf-8")
    options = re.search(r"^LFLAGS := (.*) --warn_sections", make, re.MULTILINE)[1].split()
    assert "--rom_model" in options and "--library=libc.a" in make
    project = ElementTree.parse(firmware / "dzdesign.projectspec").getroot().find("project")
    for configuration in project.findall("configuration"):
        assert configuration.get("linkerBuildOptions").split() == [*options, "--library=libc.a"]


def test_projectspec_and_makefile_name_the_same_files(firmware):
    project = ElementTree.parse(firmware / "dzdesign.projectspec").getroot().find("project")
    assert project.get("device") == "TMS320F280049C" and project.get("outputFormat") == "ELF"
    files = [entry.get("path") for entry in project.findall("file")]
    assert {entry.get("action") for entry in project.findall("file")} == {"link"}
    ours = {Path(path).name for path in files if not path.startswith("C2000WARE_ROOT/")}
    core_files = {"dz_comp.c", "dz_comp.h", "dz_drive.c", "dz_drive.h", "dz_calibration.h", "dz_valve.h"}
    assert ours == {path.name for path in firmware.iterdir()} - {"Makefile", "dzdesign.projectspec"} | core_files
    make = shutil.which("make") or pytest.skip("no make on the path")
    core = firmware.parent / "core"
    core.mkdir()
    for name in core_files:
        (core / name).touch()
    linked = set()
    for kind in ("RAM", "FLASH"):
        command = [make, "-n", "CGT=cgt", "C2000WARE=ware", f"BUILD={kind}"]
        done = subprocess.run(command, cwd=firmware, capture_output=True, text=True, check=True)
        assert ("--define=_FLASH" in done.stdout) == (kind == "FLASH")
        linked |= {word for word in done.stdout.split() if word.startswith("ware/")}
    in_ccs = {path.replace("C2000WARE_ROOT", "ware") for path in files if path.startswith("C2000WARE_ROOT/")}
    assert linked == {path for path in in_ccs if not path.endswith(".ccxml")}
    for options in project.findall("configuration"):
        assert TARGET.context["compiler_options"] in options.get("compilerBuildOptions")
