"""Both C2000 boards on the models of their devices: the interrupt, which they share, and what builds their projects.

Oracle of the zero-duty case: SPRAAI1.
"""

import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import pytest

from dzdesign.codegen import c2000
from dzdesign.codegen.f28335 import target as f28335
from dzdesign.codegen.f280049c import target as f280049c
from dzdesign.core.errors import DzdesignError
from tests.support import current_checks
from tests.support.c2000_devices import BOARDS, DIGEST, ONE, TWO, column, running, texts_of, write
from tests.support.example_coil import SENSORS
from tests.support.synthetic import needs_compiler

MODULES = {"f28335": f28335, "f280049c": f280049c}
CURRENT_BOARDS = {
    "f28335": current_checks.board_of(apart=7_500, half=30_000, full_V=3.0),
    "f280049c": current_checks.board_of(apart=5_000, half=20_000, full_V=3.3),
}
PLAIN, SUPPLY = SENSORS
TIMEOUT = int(f28335.TARGET.context["sample_timeout_ticks"])


def of_current_on(board: str):
    """Return what gives a check of current control by its name, for a board."""
    return lambda name: lambda go: getattr(current_checks, f"check_{name}")(go, CURRENT_BOARDS[board])


of_current = of_current_on("f280049c")


def compare_of_sample(n: int) -> int:
    """The stand-in cores on the codes of the n-th sample: 100 n, 1, 2."""
    return 100 * n + 10 * 1 + 100 * 2


def check_normal_running(run) -> None:
    """Ten periods from power-up, samples on every second one; the stand-in core tells the order of its arguments."""
    ticks = run("." * 10)
    assert column(ticks, "served") == [1] * 10, "one interrupt a period"
    assert column(ticks, "without") == [1, 0] * 5 and not any(column(ticks, "fault"))
    assert column(ticks, "output") == ["low"] * 2 + ["pwm"] * 8, "nothing leaves before the first sample"
    assert ticks[0]["forced"] == 1 and ticks[0]["released"] == 0
    held = [0] + [compare_of_sample(n) for n in (1, 1, 2, 2, 3, 3, 4, 4, 5)]
    assert column(ticks, "cmpa") == held, "written with the sample, held on the tick between"
    assert column(ticks, "duty")[2:] == held[1:-1], "the pin follows one period later"


def check_missing_samples(run) -> None:
    ticks = run("...." + "x" * 10 + "......")
    tripped = column(ticks, "fault").index(1)
    assert tripped == 3 + TIMEOUT and ticks[tripped]["without"] == TIMEOUT, "the last one came with the fourth period"
    after = ticks[tripped + 1 :]
    assert {(tick["output"], tick["forced"], tick["fault"]) for tick in after} == {("low", 1, 1)}, (
        "though they come again"
    )
    assert column(ticks, "served") == [1] * len(ticks)


def check_zero_command(run) -> None:
    ticks = run("....z.....n...")
    assert column(ticks, "output")[6:12] == ["low"] * 6, "zero command is a pin that stays low"
    assert ticks[-1]["output"] == "pwm"


def check_trip_input(run) -> None:
    """It latches in use, and delays the start."""
    in_use = run("....T.t.....")[4:]
    assert {(tick["output"], tick["fault"]) for tick in in_use} == {("low", 2)}
    at_start = run("T.....t....")
    assert column(at_start, "output") == ["low"] * 8 + ["pwm"] * 3 and not any(column(at_start, "fault"))


def check_bad_start(run) -> None:
    """After a watchdog reset, without crystal, and where codes above 12 bits are no sample."""
    for events, start, fault in (("." * 12, ("W",), 4), ("." * 12, ("C",), 8), ("h" * 12, (), 1)):
        ticks = run(events, *start)
        assert set(column(ticks, "output")) == {"low"} and ticks[-1]["fault"] == fault, (events, start)


def check_both_outputs(run) -> None:
    """A drives, then B, then A; in no period both; a fault ends both at once, and they stay low."""
    ticks = run("....B.....A.....")
    assert all(tick["duty"] == 0 or tick["duty_b"] == 0 for tick in ticks)
    assert any(column(ticks, "duty")[:6]) and any(column(ticks, "duty")[-4:])
    assert column(ticks, "duty_b") == [0] * 6 + [compare_of_sample(n) for n in (3, 3, 4, 4, 5, 5)] + [0] * 4
    for start in ("....", "....B..."):
        after = run(start + "T.t.....")[len(start) :]
        facts = ("duty", "duty_b", "fault", "forced", "forced_b", "cmpa", "cmpb")
        assert {tuple(tick[fact] for fact in facts) for tick in after} == {(0, 0, 2, 1, 1, 0, 0)}


def check_second_missing_samples(run) -> None:
    ticks = run("B..." + "x" * 10 + "......")
    tripped = column(ticks, "fault").index(1)
    assert any(column(ticks, "duty_b")[:tripped])
    facts = ("duty", "duty_b", "forced", "forced_b")
    assert {tuple(tick[fact] for fact in facts) for tick in ticks[tripped + 1 :]} == {(0, 0, 1, 1)}


CHECKS = (check_normal_running, check_missing_samples, check_zero_command, check_trip_input, check_bad_start)
BOTH_CHECKS = (check_both_outputs, check_second_missing_samples)
FORMS = [(ONE, check) for check in CHECKS] + [(TWO, check) for check in CHECKS + BOTH_CHECKS]


@needs_compiler
@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize(("form", "check"), FORMS)
def test_the_interrupt_on_the_device_model(board, form, check):
    check(running(board, form))


@needs_compiler
@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("check", current_checks.CHECKS)
def test_current_control_on_the_device_model(board, sensor, check):
    check(running(board, sensor), CURRENT_BOARDS[board])


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "old", "new", "check"),
    [
        (ONE, "    dz_interrupt_done();\n", "", check_normal_running),
        (ONE, "state.fault |= DZ_FAULT_NO_SAMPLE;", "", check_missing_samples),
        (ONE, "if (fresh != 0u)", "if (fresh > 1u)", check_normal_running),
        (ONE, "    dz_write_compare_a(drive.compare_a);", "", check_normal_running),
        (ONE, "    dz_trip_output();\n", "", check_missing_samples),
        (ONE, "codes[at] <= DZ_ADC_CODE_MAX", "codes[at] != 0x0BADu", check_bad_start),
        (ONE, "(dz_output_tripped() != 0u)", "(dz_output_tripped() > 1u)", check_trip_input),
        (ONE, " && (dz_trip_inputs_high() != 0u)", "", check_trip_input),
        (ONE, "    state.fault = faults;", "    (void)faults;", check_bad_start),
        (ONE, "state.p_a_adc = codes[1]", "state.p_a_adc = codes[2]", check_normal_running),
        (TWO, "            dz_write_compare_b(drive.compare_b);", "", check_both_outputs),
        (TWO, "    dz_write_compare_b(0u);", "", check_both_outputs),
        (TWO, "dz_write_compare_b(drive.compare_b)", "dz_write_compare_b(drive.compare_a)", check_both_outputs),
        (PLAIN, "(loop.faults == 0u) &&", "", of_current("start")),
        (PLAIN, "            state.fault |= DZ_FAULT_NO_CURRENT;", "", of_current("faults")),
        (PLAIN, "    if (loop.faults != 0u)\n", "    if (loop.faults == 0xFFFFu)\n", of_current("faults")),
        (PLAIN, "(loop.faults > DZ_CURRENT_NO_OFFSET)", "(loop.faults == 0xFFFFu)", of_current("wrong_sensor")),
        (PLAIN, " && (dz_trip_inputs_high() != 0u)", "", of_current("closed_comparator")),
        (PLAIN, "drive.compare_a, state.current_sum", "drive.compare_a, state.u_adc", of_current("control")),
        (PLAIN, "_compare_a((uint16_t)loop.compare)", "_compare_a(drive.compare_a)", of_current("control")),
        (PLAIN, "rest_ticks < DZ_CURRENT_REST_TICKS", "rest_ticks < 1u", of_current("start")),
    ],
)
def test_a_seeded_fault_of_the_interrupt_is_caught(form, old, new, check):
    run = running("f280049c" if form == PLAIN else "f28335", form, ("dz_isr.c", old, new))
    with pytest.raises((AssertionError, ValueError)):
        check(run)


@pytest.mark.parametrize(
    ("board", "name", "value"),
    [
        *((board, "PWM_HZ", 2_501) for board in BOARDS),
        *((board, "SAMPLE_TIMEOUT_S", Fraction(1, 2_500)) for board in BOARDS),
        ("f28335", "PWM_HZ", 2_000),
        ("f28335", "SAMPLE_HZ", 500),
        ("f28335", "CRYSTAL_LEAST_HZ", 40_000_000),
        ("f28335", "ISR_DELAY_S", Fraction(6, 10**6)),
        ("f28335", "LOSPCP", 7),
        ("f28335", "LSPCLK_MAX_HZ", 70_000_000),
        ("f28335", "LINK.frame_ticks", 5),
        ("f28335", "LINK.frame_ticks", 24),
        ("f28335", "LINK.baud", 1_000_000),
        ("f28335", "FRAME_CYCLES", 16_000),
        ("f280049c", "PWM_HZ", 1_250),
        ("f280049c", "SAMPLE_HZ", 100),
        ("f280049c", "ADC_DIVIDER", 1),
        ("f280049c", "WINDOW_SYSCLKS", 5),
        ("f280049c", "WINDOW_SYSCLKS", 500),
        ("f280049c", "WATCHDOG_COUNTS", 256),
    ],
)
def test_a_quantity_that_does_not_fit_is_refused(monkeypatch, board, name, value, wording):
    module = MODULES[board]
    name, _, field = name.partition(".")
    if field:
        value = module.LINK.__class__(**{"tick_Hz": 2_500, "frame_ticks": 25, "baud": 115_200} | {field: value})
    for each in (c2000, module):
        monkeypatch.setattr(each, name, value, raising=False)
    with wording.refusal(DzdesignError):
        module.on_board()


@pytest.mark.parametrize(("board", "held", "result"), [("f28335", 222, 48), ("f280049c", 50, 24)])
def test_the_interrupt_is_behind_its_codes_and_leaves_time(board, held, result):
    context, period = MODULES[board].TARGET.context, MODULES[board].TARGET.compare_max
    start, apart, at = int(context["current_start"]), int(context["current_tbprd"]) + 1, int(context["current_cmpb"])
    assert start + held == apart // 2 == period // 16, "in counts of the clock"
    assert start + 6 * apart + held + result < at < start + 7 * apart
    assert int(context["current_rest_cycles"]) == period - at


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("form", [ONE, TWO])
def test_every_file_carries_the_banner_and_no_path_of_this_machine(board, form):
    texts = texts_of(board, form)
    for name, text in texts.items():
        board_file = name in {path.rpartition("/")[2] for path in MODULES[board].TARGET.board}
        assert (DIGEST in "\n".join(text.splitlines()[:4])) is not board_file, name
        assert "{{" not in text and "/work" not in text and "/tmp" not in text, name
        assert text.isascii() and text.endswith("\n") and "\t\t" not in text, name
    lines = [line.split() for line in texts["dz_hardware.h"].splitlines() if line.startswith("#define")]
    values = [words[2] for words in lines if len(words) > 2 and words[1] != "DZ_SYSCLK_HZ" and words[2][0].isdigit()]
    assert len(values) > 8 and all(each.endswith("u") and int(each[:-1], 0) <= 0xFFFF for each in values), "16-bit int"


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("form", [ONE, TWO])
def test_projectspec_and_makefile_name_the_same_files_and_options(board, form, tmp_path):
    texts, make = texts_of(board, form), shutil.which("make") or pytest.skip("no make on the path")
    project = ElementTree.fromstring(texts["dzdesign.projectspec"]).find("project")
    assert project.get("device") == f"TMS320{board.upper()}"
    assert [entry.get("name") for entry in project.findall("configuration")] == ["RAM", "FLASH"]
    entries = project.findall("file")
    assert {entry.get("action") for entry in entries} == {"link"}
    paths = [entry.get("path") for entry in entries]
    ours = {Path(path).name for path in paths if not path.startswith("C2000WARE_ROOT/")}
    core_files = {"dz_comp.c", "dz_comp.h", "dz_drive.c", "dz_drive.h", "dz_calibration.h", "dz_valve.h"}
    assert ours == texts.keys() - {"Makefile", "dzdesign.projectspec"} | core_files

    (tmp_path / board).mkdir()
    (tmp_path / "core").mkdir()
    (tmp_path / "board").mkdir()
    write({name: text for name, text in texts.items() if name != "dz_user.c"}, tmp_path / board)
    write({"dz_user.c": texts["dz_user.c"]}, tmp_path / "board")
    write(dict.fromkeys(core_files, ""), tmp_path / "core")

    def dry_run(*words: str) -> subprocess.CompletedProcess:
        return subprocess.run([make, "-n", *words], cwd=tmp_path / board, capture_output=True, text=True, check=False)

    our_sources = {path for path in paths if path.endswith(".c") and not path.startswith("C2000WARE_ROOT/")}
    for configuration in project.findall("configuration"):
        kind = configuration.get("name")
        said = dry_run("CGT=cgt", "C2000WARE=ware", f"BUILD={kind}").stdout.replace("\\\n", " ")
        call = next(line for line in said.splitlines() if line.startswith("cgt/bin/cl2000"))
        compiling, linking = (half.split() for half in call.split("--run_linker"))
        assert {word for word in compiling if word.endswith(".c") and not word.startswith("ware/")} == our_sources
        in_ccs = {
            entry.get("path").replace("C2000WARE_ROOT", "ware")
            for entry in entries
            if entry.get("path").startswith("C2000WARE_ROOT/") and entry.get("applicableConfigurations", kind) == kind
        }
        linked = {word for word in (*compiling, *linking) if word.startswith("ware/")}
        assert linked == {path for path in in_ccs if not path.endswith(".ccxml")}, kind
        options = {word for word in compiling if word.startswith("-") and not re.match("-I|--include|--obj", word)}
        assert options == {w for w in configuration.get("compilerBuildOptions").split() if not w.startswith("-I")}
        assert ("--define=_FLASH" in options) == (kind == "FLASH")
        assert set(configuration.get("linkerBuildOptions").split()) <= set(linking)
    for words, missing in (((), "Set CGT"), (("CGT=c", "C2000WARE=w", "BUILD=ROM"), "RAM or FLASH")):
        done = dry_run(*words)
        assert done.returncode != 0 and missing in done.stderr
