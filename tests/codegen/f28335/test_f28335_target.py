"""The F28335 folder: its numbers, its project files, and its C run on a model of the device.

Oracle of the register values: technical reference manual of the TMS320x2833x (SPRUI07) with the set-up of
C2000Ware's F2833x examples; of the zero-duty case: SPRAAI1.
"""

import itertools
import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import pytest

from dzdesign.codegen import c2000
from dzdesign.codegen.f28335 import target as f28335
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.core.errors import DzdesignError
from tests.support.f28335_device import build, column, needs_compiler, periods, registers, render_firmware, run

START_VALUES = {
    "TBCTL": 0x0000, "TBPRD": 0xEA5F, "CMPCTL": 0x0000, "CMPB": 0x0BB8, "AQCTLA": 0x0012, "ETSEL": 0x090E,
    "ETPS": 0x0201, "TZSEL": 0x0100, "TZCTL": 0x0002, "ADCTRL1": 0x0F10, "ADCTRL2": 0x4100, "ADCTRL3": 0x00E2,
    "ADCMAXCONV": 0x0002, "ADCCHSELSEQ1": 0x0210, "HISPCP": 0x0003, "PLLCR": 0x000A,
    "LOSPCP": 0x0001, "SCICCR": 0x0007, "SCICTL1": 0x0022, "SCICTL2": 0x0000, "SCIHBAUD": 0x0000, "SCILBAUD": 0x0050,
    "SCIFFTX": 0xE000, "SCIFFRX": 0x0000, "SCIFFCT": 0x0000, "GPIO28_MUX": 1, "GPIO28_QUALIFIER": 3, "GPIO29_MUX": 1,
    "TBCLKSYNC": 1, "WDCR": 0x0028, "SCSR": 0, "GPIO0_MUX": 1, "GPIO0_PULLUP_OFF": 1, "GPIO12_MUX": 1,
    "PIEIER3": 1, "IER": 0x0004, "OST": 1, "CMPA": 0, "VECTOR_SET": 1,
}  # fmt: skip

#: Registers that nothing here uses, and that would change what the pin does.
LEFT_AT_ZERO = dict.fromkeys(
    ("CMPAHR", "TBPHS", "AQCTLB", "AQSFRC", "DBCTL", "PCCTL", "TZEINT", "HRCNFG"), 0
) | {"AQCSFRC": 1}  # fmt: skip
SECOND_AT_ZERO = (
    "SECOND_DBCTL", "SECOND_PCCTL", "SECOND_AQCTLB", "SECOND_TZEINT", "SECOND_HRCNFG", "SECOND_CMPB", "SECOND_ETPS",
)  # fmt: skip
#: What only a controlled current needs: left as a reset leaves them.
OF_CURRENT = ("ADCCHSELSEQ3", "ADCCHSELSEQ4", "GPIO13_MUX", "TRIGGER_CMPA", "TRIGGER_ETPS")

#: Of the second output, which only a command of both signs has.
SECOND_VALUES = {
    "SECOND_TBCTL": 0x0004, "SECOND_TBPRD": 0xEA5F, "SECOND_CMPCTL": 0, "SECOND_AQCTLA": 0x0012, "SECOND_ETSEL": 0,
    "SECOND_TZSEL": 0x0100, "SECOND_TZCTL": 0x0002, "SECOND_OST": 1, "GPIO2_MUX": 1, "GPIO2_PULLUP_OFF": 1,
}  # fmt: skip


@pytest.fixture
def firmware(tmp_path):
    return render_firmware(tmp_path)


@pytest.fixture
def bipolar(tmp_path):
    return render_firmware(tmp_path / "bipolar", 1, -1)


def compare_of_sample(n: int) -> int:
    """The stand-in core of tests/f28335 on the codes of the n-th sample: 100 n, 1, 2."""
    return 100 * n + 10 * 1 + 100 * 2


def check_normal_running(program: Path) -> None:
    """Ten periods from power-up, samples on every second one."""
    ticks = periods(program, "." * 10)
    assert column(ticks, "served") == [1] * 10, "one interrupt a period"
    assert column(ticks, "pieack") == [4] * 10, "group 3, and only it, is acknowledged each time"
    assert column(ticks, "resets") == [0, 1] * 5, "the sequencer is reset after a finished sequence only"
    assert column(ticks, "without") == [1, 0] * 5 and not any(column(ticks, "reset_busy"))
    assert column(ticks, "output")[:2] == ["low", "low"], "nothing leaves before the first sample"
    assert ticks[0]["forced"] == 1 and ticks[0]["released"] == 0
    held = [0] + [compare_of_sample(n) for n in (1, 1, 2, 2, 3, 3, 4, 4, 5)]
    assert column(ticks, "cmpa") == held, "written with the sample, held on the tick between"
    assert column(ticks, "duty")[2:] == held[1:-1], "the pin follows one period later"
    assert not any(column(ticks, "fault"))


def check_registers(program: Path) -> None:
    found = registers(program)
    assert {name: found[name] for name in START_VALUES} == START_VALUES
    assert {found[name] for name in SECOND_VALUES} == {0, 0x0083}, "the second output is left as a reset leaves it"


def check_left_behind(program: Path, *second: dict[str, int]) -> None:
    """After a load by the debugger registers hold what the last program left: only their own reset clears them."""
    expected = START_VALUES | LEFT_AT_ZERO
    for values in second:
        expected |= values
    for left_behind in ("0000", "FFFF", "A5A5"):
        found = registers(program, left_behind)
        assert {name: found[name] for name in expected} == expected


def check_second_left_behind(program: Path) -> None:
    check_left_behind(program, SECOND_VALUES, dict.fromkeys(SECOND_AT_ZERO, 0), {"TBCTL": 0x0010})


@needs_compiler
def test_registers_that_another_program_has_set_are_written(firmware, bipolar):
    check_left_behind(build(firmware))
    check_second_left_behind(build(bipolar))


def check_emulation_stop(program: Path) -> None:
    """Released outputs stop with the pin low; while the trip zone holds them the register is as it was set up."""
    ticks = periods(program, "." * 6)
    assert column(ticks, "free_soft") == column(ticks, "released")
    assert column(ticks, "free_soft")[-1] == 1


def check_trip_on_missing_samples(program: Path) -> None:
    ticks = periods(program, "...." + "x" * 10 + "......")
    limit = int(TARGET.context["sample_timeout_ticks"])
    assert 1 in column(ticks, "fault")
    tripped = column(ticks, "fault").index(1)
    assert ticks[tripped]["without"] == limit
    # The last sample came with the fourth period; the time-out counts from there.
    assert tripped == 3 + limit
    assert column(ticks, "output")[tripped + 1 :] == ["low"] * (len(ticks) - tripped - 1)
    assert {tick["fault"] for tick in ticks[tripped:]} == {1}, "latched, though samples come again"
    assert column(ticks, "served") == [1] * len(ticks)


def check_zero_command(program: Path) -> None:
    ticks = periods(program, "....z.....n...")
    assert column(ticks, "output")[6:12] == ["low"] * 6, "zero command is a pin that stays low"
    assert ticks[-1]["output"] == "pwm"


def worst_delays_us(program: Path) -> dict[str, float]:
    """From each sample to what its value moves at the pin, with the latest falling edge there is, 59999."""
    counts_in_us = int(TARGET.context["sysclkout_mhz"])
    ticks = periods(program, "f" * 12)
    assert set(column(ticks, "duty")[2:]) == {59_999}, "from the second sample on every period uses a sample's value"
    held = [tick["held"] for tick in ticks if tick["held"]]
    to_period, to_edge, to_last_edge = [], [], []
    for index, sample in enumerate(held[:-1]):
        uses = [tick for tick in ticks if tick["falls"] and held[index] < tick["begins"] <= held[index + 1]]
        assert len(uses) == 2, "a value stands for two periods"
        to_period.append(uses[0]["begins"] - sample)
        to_edge.append(uses[0]["falls"] - sample)
        to_last_edge.append(uses[1]["falls"] - sample)
    rate = {later - earlier for earlier, later in itertools.pairwise(held)}
    assert rate == {2 * 60_000}, "1.25 kHz"
    worst = {"period": max(to_period), "edge": max(to_edge), "last_edge": max(to_last_edge)}
    return {key: counts / counts_in_us for key, counts in worst.items()}


def check_delays(program: Path) -> None:
    """What the model measures is what target.py derives and the README states, to a count of SYSCLKOUT."""
    measured = worst_delays_us(program)
    print(f"worst delay from the command's sample, in us: {measured}")
    for key, value in measured.items():
        assert value == pytest.approx(float(TARGET.context[f"delay_to_{key}_us"]), abs=0.001), key


def test_numbers_follow_from_the_engineering_quantities():
    context = TARGET.context
    assert int(context["tbprd"]) == 150_000_000 // 2_500 - 1 == 59_999
    assert int(context["cmpb"]) == 150 * 20 == 3_000
    assert (context["wdflag_ms"], context["wdrst_us"]) == ("1.11", "17"), "(4 x 8192 + 512) and 512 periods of 30 MHz"
    assert TARGET.compare_max == 60_000 and TARGET.converter.code_max == 4_095
    assert (context["adcclk_mhz"], context["sequence_us"]) == ("12.5", "4.52")
    assert context["held_us"] == "1.48", "2.5 + 16 periods of 80 ns"
    # 400 - 1.48; 400 more less one count of 1/150 us; 400 more
    delays = [context[f"delay_to_{key}_us"] for key in ("period", "edge", "last_edge")]
    assert delays == ["398.52", "798.513", "1198.513"]
    assert (context["brr"], context["baud_real"], context["baud_error"]) == ("80", "115741", "+0.47")
    assert context["soca_prescale"] == "ET_2ND"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("PWM_HZ", 2_501),
        ("PWM_HZ", 2_000),
        ("SAMPLE_HZ", 500),
        ("SAMPLE_TIMEOUT_S", Fraction(1, 2_500)),
        ("ADCCLK_MAX_HZ", 20_000_000),
        ("ISR_DELAY_S", Fraction(6, 10**6)),
        ("LOSPCP", 7),
        ("LSPCLK_MAX_HZ", 70_000_000),
        ("LINK", replace(f28335.LINK, frame_ticks=5)),
        ("LINK", replace(f28335.LINK, frame_ticks=24)),
        ("LINK", replace(f28335.LINK, baud=1_000_000)),
        ("FRAME_CYCLES", 16_000),
    ],
)
def test_a_quantity_that_does_not_fit_is_refused(monkeypatch, name, value, wording):
    for module in (c2000, f28335):
        monkeypatch.setattr(module, name, value, raising=False)
    with wording.refusal(DzdesignError):
        f28335.timing()
        f28335.converter()
        f28335.serial_line()


@pytest.mark.parametrize(
    "change",
    [
        {"context": {"tbprd": 59_999}},
        {"context": {"banner": "x"}},
        {"templates": {"../outside.c": "main.c.jinja"}},
        {"templates": {"/main.c": "main.c.jinja"}},
        {"compare_max": 70_000},
        {"name": "f28335 rev A"},
    ],
)
def test_a_plan_that_cannot_be_printed_is_refused(change):
    with pytest.raises(DzdesignError):
        replace(TARGET, **change)


def test_every_file_carries_the_banner_and_no_path_of_this_machine(firmware):
    for path, file in firmware.items():
        text = file.read_text(encoding="utf-8")
        assert ("1234567890abcdef" in "\n".join(text.splitlines()[:4])) is (path not in TARGET.board), path
        assert "{{" not in text and "/work" not in text and "/tmp" not in text, path
        assert text.isascii() and text.endswith("\n") and "\t\t" not in text, path


def test_constants_fit_the_16_bit_int_of_the_c28x(firmware):
    header = firmware["f28335/dz_hardware.h"].read_text(encoding="utf-8").splitlines()
    values = [words[2] for line in header if line.startswith("#define") and len(words := line.split()) > 2]
    assert len(values) > 10 and all(value.endswith("u") and int(value[:-1], 0) <= 0xFFFF for value in values)


@pytest.mark.parametrize("signs", [(1,), (1, -1)])
def test_projectspec_and_makefile_name_the_same_files(signs, tmp_path):
    firmware = render_firmware(tmp_path, *signs)
    project = ElementTree.parse(firmware["f28335/dzdesign.projectspec"]).getroot().find("project")
    assert project.get("device") == "TMS320F28335" and project.get("outputFormat") == "COFF"
    assert [entry.get("name") for entry in project.findall("configuration")] == ["RAM", "FLASH"]
    files = [entry.get("path") for entry in project.findall("file")]
    assert all(entry.get("action") == "link" for entry in project.findall("file"))
    ours = {Path(path).name for path in files if not path.startswith("C2000WARE_ROOT/")}
    generated = {Path(path).name for path in firmware} - {"Makefile", "dzdesign.projectspec"}
    core_files = {"dz_comp.c", "dz_comp.h", "dz_drive.c", "dz_drive.h", "dz_calibration.h", "dz_valve.h"}
    assert ours == generated | core_files

    make = shutil.which("make") or pytest.skip("no make on the path")
    core = firmware["f28335/Makefile"].parent.parent / "core"
    core.mkdir()
    for name in core_files:
        (core / name).touch()
    our_sources = {path for path in files if path.endswith(".c") and not path.startswith("C2000WARE_ROOT/")}
    for configuration in project.findall("configuration"):
        kind = configuration.get("name")
        command = [make, "-n", "CGT=cgt", "C2000WARE=ware", f"BUILD={kind}"]
        done = subprocess.run(command, cwd=core.parent / "f28335", capture_output=True, text=True, check=True)
        call = next(line for line in done.stdout.splitlines() if line.startswith("cgt/bin/cl2000"))
        compiling, linking = (half.split() for half in call.split("--run_linker"))
        assert {word for word in compiling if word.endswith(".c") and not word.startswith("ware/")} == our_sources
        in_ccs = {
            entry.get("path").replace("C2000WARE_ROOT", "ware")
            for entry in project.findall("file")
            if entry.get("path").startswith("C2000WARE_ROOT/") and entry.get("applicableConfigurations", kind) == kind
        }
        linked = {word for word in (*compiling, *linking) if word.startswith("ware/")}
        assert linked == {path for path in in_ccs if not path.endswith(".ccxml")}, kind
        options = {word for word in compiling if word.startswith("-") and not re.match("-I|--include|--obj", word)}
        assert options == {w for w in configuration.get("compilerBuildOptions").split() if not w.startswith("-I")}
        assert ("--define=_FLASH" in options) == (kind == "FLASH")
        assert set(configuration.get("linkerBuildOptions").split()) <= set(linking)


def test_the_interrupt_has_no_part_in_the_telemetry_and_is_never_held_off(firmware):
    code = {
        Path(path).name: re.sub(r"/\*.*?\*/", "", file.read_text(encoding="utf-8"), flags=re.DOTALL)
        for path, file in firmware.items()
        if path.endswith((".c", ".h"))
    }
    assert [name for name, text in code.items() if "SciaRegs" in text] == ["dz_telemetry.c"]
    assert [name for name, text in code.items() if "dz_telemetry_" in text] == [
        "main.c",
        "dz_telemetry.c",
        "dz_telemetry.h",
    ]
    assert [name for name, text in code.items() if re.search(r"\bDINT\b", text)] == ["main.c"]
    assert code["main.c"].index("DINT") < code["main.c"].index("EINT") < code["main.c"].index("for (;;)")
    for name, text in code.items():  # a byte of the C28x has 16 bits, and its double 32 or 64
        assert not re.search(r"\b(u?int8_t|char|float|double|long)\b", text), name


def test_makefile_says_what_is_missing(firmware):
    make = shutil.which("make") or pytest.skip("no make on the path")
    folder = firmware["f28335/Makefile"].parent
    for words, said in (((), "Set CGT"), (("CGT=c", "C2000WARE=w", "BUILD=ROM"), "RAM or FLASH")):
        done = subprocess.run([make, "-n", *words], cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode != 0 and said in done.stderr


CHECKS = [
    check_registers, check_normal_running, check_trip_on_missing_samples, check_zero_command, check_delays,
    check_emulation_stop, check_left_behind,
]  # fmt: skip


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("check", CHECKS)
def test_firmware_on_the_device_model(firmware, check):
    check(build(firmware))


def check_second_registers(program: Path) -> None:
    """ePWM1 differs from that of one solenoid by the pulse that keeps ePWM2 in step."""
    found = registers(program)
    zeros = dict.fromkeys((*SECOND_AT_ZERO, *OF_CURRENT), 0)
    assert found == START_VALUES | SECOND_VALUES | LEFT_AT_ZERO | zeros | {"TBCTL": 0x0010}


def check_drive_calls(program: Path) -> None:
    """A tick each period, a sample where there is one, both from the release of the output on."""
    ticks = periods(program, "." * 9)
    assert column(ticks, "drive_ticks") == [0, 1, 2, 3, 4, 5, 6, 7, 8]
    assert column(ticks, "samples") == [0, 1, 1, 2, 2, 3, 3, 4, 4]


def check_both_outputs(program: Path) -> None:
    """A drives, then B, then A; in no period both; a fault ends both at once, and they stay low."""
    ticks = periods(program, "....B.....A.....")
    assert all(tick["duty"] == 0 or tick["duty_b"] == 0 for tick in ticks)
    assert any(column(ticks, "duty")[:6]) and any(column(ticks, "duty")[-4:])
    of_b = [compare_of_sample(n) for n in (3, 3, 4, 4, 5, 5)]
    assert column(ticks, "duty_b") == [0] * 6 + of_b + [0] * 4
    for start in ("....", "....B..."):
        tripped = periods(program, start + "T.t.....")
        after = tripped[len(start) :]
        assert {(tick["duty"], tick["duty_b"]) for tick in after} == {(0, 0)}
        assert {(tick["fault"], tick["forced"], tick["forced_b"], tick["cmpa"], tick["cmpb"]) for tick in after} == {
            (2, 1, 1, 0, 0)
        }


def check_second_trip_on_missing_samples(program: Path) -> None:
    ticks = periods(program, "B..." + "x" * 10 + "......")
    tripped = column(ticks, "fault").index(1)
    assert any(column(ticks, "duty_b")[:tripped])
    for tick in ticks[tripped + 1 :]:
        assert (tick["duty"], tick["duty_b"], tick["forced"], tick["forced_b"]) == (0, 0, 1, 1)
        assert (tick["samples"], tick["drive_ticks"]) == (0, 0), "the drive is at rest"


def check_delayed_start(program: Path) -> None:
    """While the trip input is low the drive does not run: its ramps start with the output."""
    ticks = periods(program, "T.....t....")
    assert column(ticks, "drive_ticks") == [0] * 7 + [1, 2, 3, 4] and not any(column(ticks, "fault"))


BIPOLAR_CHECKS = [
    check_second_registers, check_drive_calls, check_both_outputs, check_second_trip_on_missing_samples,
    check_delayed_start, check_second_left_behind,
]  # fmt: skip


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("check", [*CHECKS[1:-1], *BIPOLAR_CHECKS])
def test_firmware_of_two_solenoids_on_the_device_model(bipolar, check):
    check(build(bipolar))


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    ("file", "old", "new", "check"),
    [
        ("dz_hardware.c", "EPwm2Regs.TZFRC.bit.OST = 1u;", "", check_second_registers),
        ("dz_hardware.c", "EPwm2Regs.TZCTL.bit.TZA = TZ_FORCE_LO", "EPwm2Regs.TZCTL.bit.TZA = 0u", check_both_outputs),
        ("dz_hardware.c", "EPwm2Regs.TZSEL.bit.OSHT1 = TZ_ENABLE", "EPwm2Regs.TZSEL.all = 0u", check_second_registers),
        ("dz_hardware.c", "EPwm2Regs.TBCTL.bit.PHSEN = TB_ENABLE;", "", check_both_outputs),
        ("dz_isr.c", "EPwm2Regs.TZFRC.bit.OST = 1u;", "", check_second_trip_on_missing_samples),
        ("dz_isr.c", "EPwm2Regs.TZCLR.bit.OST = 1u;", "", check_both_outputs),
        ("dz_isr.c", "write_compare_b(drive.compare_b);", "", check_both_outputs),
        ("dz_isr.c", "write_compare_b(0u);", "", check_both_outputs),
        ("dz_isr.c", "write_compare_b(drive.compare_b)", "write_compare_b(drive.compare_a)", check_both_outputs),
        ("dz_isr.c", "dz_drive_tick(&drive);", "if (fresh) { dz_drive_tick(&drive); }", check_drive_calls),
        ("dz_isr.c", "            if (fresh != 0u)", "            if (fresh <= 1u)", check_drive_calls),
        ("dz_isr.c", "if (dz_state.released != 0u)", "if (dz_state.ticks != 0u)", check_delayed_start),
    ],
)
def test_a_seeded_fault_of_the_second_output_is_caught(bipolar, file, old, new, check):
    source = bipolar[f"f28335/{file}"]
    before, found, after = source.read_text(encoding="utf-8").partition(old)
    assert found
    source.write_text(before + new + after, encoding="utf-8")
    program = build(bipolar)
    with pytest.raises((AssertionError, ValueError)):
        check(program)


@needs_compiler
def test_late_sequence_is_read_on_the_next_tick_and_never_reset_while_busy(firmware):
    ticks = periods(build(firmware), "...l....")
    assert not any(column(ticks, "reset_busy"))
    assert column(ticks, "resets") == [0, 1, 0, 0, 1, 1, 0, 1]
    assert column(ticks, "cmpa")[3:5] == [compare_of_sample(1), compare_of_sample(2)]


@needs_compiler
def test_trip_input_latches_in_use_and_delays_the_start(firmware):
    program = build(firmware)
    in_use = periods(program, "....T.t.....")
    assert set(column(in_use, "output")[4:]) == {"low"} and {tick["fault"] for tick in in_use[4:]} == {2}
    at_start = periods(program, "T.....t....")
    assert column(at_start, "output") == ["low"] * 8 + ["pwm"] * 3 and not any(column(at_start, "fault"))


@needs_compiler
@pytest.mark.parametrize(("cause", "fault"), [("W", 4), ("C", 8)])
def test_bad_start_keeps_the_output_low(firmware, cause, fault):
    ticks = periods(build(firmware), "." * 12, cause)
    assert {(tick["output"], tick["fault"]) for tick in ticks} == {("low", fault)}
    # Codes above 12 bits are no sample: a converter that gives only such never releases the output.
    ticks = periods(firmware["f28335/main.c"].parent / "driver", "h" * 12)
    assert set(column(ticks, "output")) == {"low"} and ticks[-1]["fault"] == 1


@needs_compiler
def test_start_up_order_and_watchdog(firmware):
    after = ["InitPieCtrl", "InitPieVectTable", "InitAdc", "ServiceDog", "EINT", "ServiceDog",
             "without an interrupt:", "with one:", "ServiceDog"]  # fmt: skip
    assert run(build(firmware), "main") == ["InitSysCtrl", "DINT", *after]
    assert run(build(firmware, "-D_FLASH"), "main") == ["InitSysCtrl", "DINT", "MemCopy", "InitFlash", *after]


@needs_compiler
@pytest.mark.parametrize(
    ("file", "old", "new", "check"),
    [
        ("dz_hardware.c", "TBPRD = DZ_PWM_TBPRD", "TBPRD = DZ_PWM_TBPRD - 1u", check_registers),
        ("dz_hardware.c", "TZA = TZ_FORCE_LO", "TZA = TZ_FORCE_HI", check_normal_running),
        ("dz_hardware.c", "SOCAPRD = ET_2ND", "SOCAPRD = ET_1ST", check_normal_running),
        ("dz_hardware.c", "INTSEL = ET_CTRU_CMPB", "INTSEL = ET_CTR_ZERO", check_normal_running),
        ("dz_hardware.c", "EPwm1Regs.TZFRC.bit.OST = 1u;", "", check_normal_running),
        ("dz_hardware.c", "    EALLOW;\n    EPwm1Regs.TZCTL", "    EPwm1Regs.TZCTL", check_registers),
        ("dz_isr.c", "PieCtrlRegs.PIEACK.all = PIEACK_GROUP3;", "", check_normal_running),
        ("dz_isr.c", "PIEACK.all = PIEACK_GROUP3", "PIEACK.bit.ACK1 = 1u", check_normal_running),
        ("dz_isr.c", "EPwm1Regs.ETCLR.bit.INT = 1u;", "", check_normal_running),
        ("dz_isr.c", "AdcRegs.ADCTRL2.bit.RST_SEQ1 = 1u;", "", check_normal_running),
        ("dz_isr.c", "ADCRESULT1", "ADCRESULT2", check_normal_running),
        ("dz_isr.c", "dz_state.fault |= DZ_FAULT_NO_SAMPLE;", "", check_trip_on_missing_samples),
        ("dz_isr.c", "if (fresh != 0u)", "if (fresh > 1u)", check_normal_running),
        ("dz_hardware.c", "CMPB = DZ_ISR_CMPB", "CMPB = 0u", check_normal_running),
        ("dz_hardware.c", "CMPB = DZ_ISR_CMPB", "CMPB = 0u", check_delays),
        ("dz_hardware.c", "INTPRD = ET_1ST", "INTPRD = ET_2ND", check_normal_running),
        ("dz_hardware.c", "INTPRD = ET_1ST", "INTPRD = 0u", check_normal_running),
        ("dz_hardware.c", "ACQ_PS = DZ_ADC_ACQ_PS", "ACQ_PS = 0u", check_delays),
        ("dz_hardware.c", "SOCAPRD = ET_2ND", "SOCAPRD = ET_1ST", check_delays),
        ("dz_isr.c", "    write_compare_a(drive.compare_a);", "", check_delays),
        ("dz_telemetry.c", "LOSPCP.all = DZ_SCI_LOSPCP", "LOSPCP.all = 2u", check_registers),
        ("dz_telemetry.c", "    EALLOW;\n    SysCtrlRegs", "    SysCtrlRegs", check_registers),
        ("dz_telemetry.c", "GPAMUX2.bit.GPIO29 = 1u", "GPAMUX2.bit.GPIO29 = 2u", check_registers),
        ("dz_isr.c", "(compare == 0u) ? DZ_FORCE_LOW : DZ_FORCE_NONE", "DZ_FORCE_NONE", check_zero_command),
        ("dz_isr.c", "EPwm1Regs.TBCTL.bit.FREE_SOFT = DZ_STOP_AT_PERIOD;", "", check_emulation_stop),
        ("dz_hardware.c", "    clear_leftovers();\n", "    (void)clear_leftovers;\n", check_left_behind),
        ("dz_hardware.c", "EPwm1Regs.DBCTL.all = 0u;", "", check_left_behind),
        ("dz_hardware.c", "    EALLOW;\n    EPwm1Regs.HRCNFG", "    EPwm1Regs.HRCNFG", check_left_behind),
    ],
)
def test_a_seeded_fault_is_caught(firmware, file, old, new, check):
    source = firmware[f"f28335/{file}"]
    before, found, after = source.read_text(encoding="utf-8").partition(old)
    assert found
    source.write_text(before + new + after, encoding="utf-8")
    program = build(firmware)
    with pytest.raises(AssertionError):
        check(program)
