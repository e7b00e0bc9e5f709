"""Boards of the user's own: what agrees with the declaration holds, and what does not is named."""

import re
import shutil
from pathlib import Path

import pytest

from dzdesign import api
from dzdesign.core.errors import InputError
from dzdesign.regeneration import regenerated
from dzdesign.verify.folder import read_compensator, read_firmware_manifest, reproduced
from dzdesign.verify.hardware.board_values import board_of, read_board_values
from dzdesign.verify.hardware.checks import hardware_checks
from dzdesign.verify.hardware.model import Bench
from tests.support.synthetic import needs_compiler

DESIGNS = {"f28335": {}, "f280049c": {}, "f28335, declared": {"crystal": "20 MHz", "channels": "A5 B7 A0"}}
USER_CODE = '#include <stdint.h>\n#include "dz_user.h"\nvoid other(void);\n'


@pytest.fixture(scope="module")
def folders(example_valve, tmp_path_factory):
    """A firmware of each of the designs."""
    place = tmp_path_factory.mktemp("boards")
    for name, given in DESIGNS.items():
        target = name.partition(",")[0]
        api.generate(api.design(example_valve, target=target, **given), output=place / name)
    return place


@pytest.fixture
def folder_of(folders, tmp_path):
    return lambda name: Path(shutil.copytree(folders / name, tmp_path / "fw"))


def change(folder, **values):
    """Change values of a board."""
    (path,) = folder.glob("*/dz_board.h")
    text = path.read_text("utf-8")
    for name, value in values.items():
        text, count = re.subn(rf"(#define DZ_BOARD_{name}) \d+", rf"\1 {value}", text)
        assert count == 1, name
    path.write_text(text, encoding="utf-8")


def found_in(folder, *, with_code=False):
    """Return what does not hold of a folder's hardware files, with the user's board."""
    manifest, again = read_firmware_manifest(folder), regenerated(folder)
    assert reproduced(folder, again).holds
    with again.written() as code:
        board = board_of(folder, code, manifest, with_code=with_code)
        assert board is not None
        checks = list(hardware_checks(lambda: Bench(code, manifest, read_compensator(folder), board)))
    return {check.id: check.text for check in checks if not check.holds}


HOLD = {
    "another module and pin": ("f28335", {"PWM": 5, "PWM_GPIO": 8}),
    "trip on TZ5": ("f28335", {"TZ": 5, "TRIP_GPIO": 16}),
    "SCI-B": ("f28335", {"SCI": 2, "SCI_TX_GPIO": 18, "SCI_RX_GPIO": 19}),
    "a slow watchdog": ("f28335", {"WDPS": 5}),
    "a short window": ("f28335", {"ACQ_PS": 7}),
    "hexadecimal": ("f28335", {"ACQ_PS": "0x07UL"}),
    "module 8": ("f280049c", {"PWM": 8, "PWM_GPIO": 14}),
    "trip on GPIO33": ("f280049c", {"TRIP_GPIO": 33}),
    "a long window": ("f280049c", {"WINDOW": 80}),
    "watchdog times 8": ("f280049c", {"WD_PRESCALE": 8}),
    "crystal and channels as declared": ("f28335, declared", {}),
}
WRONG = {
    "channels swapped": ("f28335, declared", {"PRESSURE_A": 0, "PRESSURE_B": 15}, "channels"),
    "a channel that is not declared": ("f280049c", {"COMMAND": 6}, "channels"),
    "another crystal": ("f28335", {"OSC_HZ": 60_000_000, "PLL_DIV": 5}, "pwm"),
    "a PLL that does not fit": ("f28335", {"PLL_DIV": 9}, "compiles"),
    "a pin of another module": ("f280049c", {"PWM_GPIO": 2}, "compiles"),
}


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("case", HOLD)
def test_a_board_that_agrees_with_the_declaration_holds(folder_of, case):
    name, values = HOLD[case]
    folder = folder_of(name)
    change(folder, **values)
    assert found_in(folder) == {}


@needs_compiler
@pytest.mark.parametrize("case", WRONG)
def test_a_board_that_does_not_is_named(folder_of, case):
    name, values, named = WRONG[case]
    folder = folder_of(name)
    change(folder, **values)
    found = found_in(folder)
    assert f"hardware-{named}" in found, found


@needs_compiler
def test_a_value_that_is_gone_is_named(folder_of):
    folder = folder_of("f280049c")
    path = folder / "f280049c/dz_board.h"
    path.write_text(re.sub(r"#ifndef DZ_BOARD_WINDOW\n.*\n#endif\n", "", path.read_text("utf-8")), encoding="utf-8")
    assert "DZ_BOARD_WINDOW" in found_in(folder)["hardware-compiles"]


def test_a_project_that_ccs_builds_in_place_is_no_foreign_code(folder_of):
    folder = folder_of("f28335")
    for name in ("Debug/makefile", "f28335/RAM/subdir_rules.mk", "f28335/FLASH/dz_hardware.obj", ".project",
     ".cproject",
                 "f28335/.ccsproject", "targetConfigs/TMS320F28335.ccxml", ".settings/org.prefs",
                  "f28335/build_RAM/a.asm"):  # fmt: skip
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("made by CCS")
    assert reproduced(folder, regenerated(folder)).holds
    (folder / "f28335/patch.c").write_text("int x;\n")
    assert reproduced(folder, regenerated(folder)).holds is False, "but this is"


@needs_compiler
@pytest.mark.parametrize(
    ("options", "named"),
    [
        ("--define=_FLASH --define=MINE", set()),
        ("--define=MINE", {"hardware-compiles"}),
        ("--define=_FLASH --define=DZ_BOARD_TRIP_GPIO=13", {"hardware-trip"}),
    ],
)
def test_a_project_of_the_users_builds_what_was_verified(folder_of, options, named):
    folder = folder_of("f280049c")
    path = folder / "f280049c/dzdesign.projectspec"
    path.write_text(path.read_text("utf-8").replace("--define=_FLASH", options), "utf-8")
    assert found_in(folder).keys() == named


@needs_compiler
@pytest.mark.slow
def test_code_of_the_user_runs_where_that_is_asked_for(folder_of):
    folder = folder_of("f280049c")
    (folder / "board/other.c").write_text(USER_CODE + "void other(void) {}\n")
    (folder / "board/dz_user.c").write_text(
        '#include "dz_user.h"\nvoid other(void);\nvoid dz_user_init(void) {}\nvoid dz_user_poll(void) { other(); }\n'
    )
    assert found_in(folder) == {} and found_in(folder, with_code=True) == {}
    (folder / "board/other.c").write_text(
        '#include "driverlib.h"\nvoid other(void) { EPWM_clearTripZoneFlag(EPWM1_BASE, 4u); }\n'
    )
    assert found_in(folder) == {}, "of code that is not run nothing is known"
    assert {"hardware-trip", "hardware-start"} <= found_in(folder, with_code=True).keys()
    (folder / "board/other.c").write_text(
        '#include "driverlib.h"\nvoid other(void)\n{\n    static unsigned long turns;\n'
        "    if (++turns == 8000u) { EPWM_forceTripZoneEvent(EPWM1_BASE, 4u); }\n}\n"
    )
    assert found_in(folder, with_code=True).keys() == {"hardware-channels"}, "only after a second"
    (folder / "board/other.c").write_text("void other(void) { for (;;) { } }\n")
    assert "did not end" in found_in(folder, with_code=True)["hardware-pwm"]


@needs_compiler
@pytest.mark.slow
def test_verify_says_what_of_the_board_it_did_not_try(folder_of):
    folder = folder_of("f280049c")
    change(folder, TRIP_GPIO=33)
    (folder / "board/other.c").write_text(USER_CODE)
    found = api.verify(folder)
    assert found.holds and found.evidence.changed_board_files == () and found.evidence.user_files == ("board/other.c",)
    from dzdesign.verify.verification import not_tried

    lines = not_tried(found.evidence)
    assert any("--board-code" in line for line in lines) and any("board/other.c" in line for line in lines)
    found = api.verify(folder, board_code=True)
    assert found.holds and found.evidence.user_files == ()
    assert not any("--board-code" in line for line in not_tried(found.evidence))


def test_the_option_is_for_a_device_that_is_modelled(example_valve, tmp_path):
    api.generate(api.design(example_valve, target="cortex-m4"), output=tmp_path / "fw")
    with pytest.raises(InputError, match="board_code"):
        api.verify(tmp_path / "fw", board_code=True)


@pytest.mark.parametrize(
    "text",
    [
        "#define DZ_BOARD_TZ 2\n",
        "#ifndef DZ_BOARD_TZ\n#define DZ_BOARD_TZ (1 + 1)\n#endif\n",
        "#ifndef DZ_BOARD_TZ\n#define DZ_BOARD_PWM 2\n#endif\n",
        "#ifndef DZ_BOARD_TZ\n#define DZ_BOARD_TZ 2\n#endif\nstatic int x;\n",
        "#ifndef DZ_BOARD_TZ\n#define DZ_BOARD_TZ 2\n#endif\n" * 2,
        '#include "other.h"\n',
    ],
)
def test_a_board_file_with_more_than_values_is_code(text):
    whole = "#ifndef DZ_BOARD_H\n#define DZ_BOARD_H\n{}\n#endif\n"
    assert read_board_values(whole.format("/* none */")) == {}
    assert read_board_values(whole.format(text)) is None


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("more", ["#define MY_LED_GPIO 34", "#define DZ_BOARD_LED A3"])
def test_a_board_file_that_is_not_read_is_not_checked_and_its_line_is_named(folder_of, more):
    """It would take every requirement of the device away, and with them the reason to believe in the folder."""
    folder = folder_of("f280049c")
    path = folder / "f280049c/dz_board.h"
    path.write_text(path.read_text("utf-8").replace("#define DZ_BOARD_H\n", f"#define DZ_BOARD_H\n{more}\n"), "utf-8")
    found = api.verify(folder)
    (check,) = [each for each in found.evidence.checks if each.id == "hardware-compiles"]
    assert not found.holds and check.holds is None and f"line 9, '{more}'" in check.text


@needs_compiler
def test_code_of_the_user_is_his_from_whatever_folder_he_calls(folder_of, monkeypatch):
    folder = folder_of("f28335")
    (folder / "board/dz_user.c").write_text("#error this is mine\n")
    monkeypatch.chdir(folder)
    assert "this is mine" in found_in(Path(), with_code=True)["hardware-compiles"]
    (folder / "board/dz_user.c").write_text(
        '#include "DSP28x_Project.h"\n#include "dz_user.h"\nvoid dz_user_init(void) {}\n'
        "void dz_user_poll(void) { GpioDataRegs.GPBTOGGLE.bit.GPIO34 = 1; }\n"
    )
    assert found_in(Path(), with_code=True) == {}


@needs_compiler
def test_what_differs_from_the_declaration_is_said(folder_of):
    folder = folder_of("f28335, declared")
    change(folder, PRESSURE_A=0, PRESSURE_B=15)
    assert re.search(r"; dz_board.h has PRESSURE_A 0, and declared is \w+;", found_in(folder)["hardware-channels"])
