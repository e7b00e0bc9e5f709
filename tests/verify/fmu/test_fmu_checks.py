"""The checks of FMUs hold of right ones and fail of wrong ones: description, law, drive, units, closed loop."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from dzdesign.core.errors import InputError
from dzdesign.verify.outputs import fmu as room
from dzdesign.verify.outputs.fmu import (
    closed_loop_check,
    drive_check,
    law_check,
    physical_check,
    plant_of,
    unpacked,
)
from tests.support.golden_firmware import golden_compensator
from tests.support.host_fmus import PLANT, edited, fmus_of, plant_setting, repacked, with_binary


@pytest.fixture(scope="module")
def firmware(fmu, tmp_path_factory):
    """The core of the FMU, where a loop finds it."""
    folder = tmp_path_factory.mktemp("core")
    shutil.copytree(fmu.folder / "sources", folder / "core")
    return folder


@pytest.fixture(autouse=True)
def fewer_rows(monkeypatch):
    """Step fewer rows than `verify` does."""
    monkeypatch.setattr(room, "PHYSICAL_ROWS", 300)
    monkeypatch.setattr(room, "DRIVE_SAMPLES", 900)
    monkeypatch.setattr(room, "COURSE", room.COURSE[:5])


def failed(check):
    return check.holds is False and check.text


def test_right_ones_hold(fmu, plant_fmu, compensator):
    assert fmu.problems == plant_fmu.problems == ()
    for check in (law_check(fmu, compensator), drive_check(fmu, compensator), physical_check(fmu, compensator)):
        assert check.holds is True, check.text


@pytest.mark.parametrize(
    ("check", "name", "old", "new"),
    [
        # Outputs that stay as they were: between events, of a step, after a reset.
        (physical_check, "dz_fmu.c", "    one->changed = 1;\n    return 1;",
         "    one->changed = one->phase != CONTINUOUS;\n    return 1;"),
        (law_check, "dz_fmu.c", "    ticks_before(model, end);\n    model_outputs(model, 1);",
         "    ticks_before(model, end);"),
        (drive_check, "dz_fmu.c", "    dz_drive_init(&model->drive);\n}",
         "    if (!model->drive.valid_pressures)\n    dz_drive_init(&model->drive);\n}"),
        # A wrong law behind the getters.
        (law_check, "dz_fmu.c", "(double)dz_comp(codes", "1.0 + (double)dz_comp(codes"),
        (law_check, "dz_fmu.c", "(double)dz_comp_negative(codes", "(double)dz_comp(codes"),
        (law_check, "dz_fmu.c", "(double)dz_status(codes", "1.0 + (double)dz_status(codes"),
        (law_check, "dz_fmu.c", "dz_beta(codes.a, codes.b) /", "dz_beta(codes.b, codes.a) /"),
        (law_check, "dz_comp.c", "return (uint16_t)(counts_of(", "return (uint16_t)((u == 4095u) ^ counts_of("),
        # A wrong drive or scaling.
        (drive_check, "dz_fmu.c", "ticks_before(model, end);", "ticks_before(model, end + 1.0 / TICK_HZ);"),
        (drive_check, "dz_fmu.c", "ticks_before(model, end);", "ticks_before(model, end - 1.0 / TICK_HZ);"),
        (drive_check, "dz_fmu.c", "dz_drive_tick(&model->drive);",
         "dz_drive_tick(&model->drive); dz_drive_tick(&model->drive);"),
        (drive_check, "dz_fmu.c", "(double)model->drive.compare_b", "(double)model->drive.compare_a"),
        (drive_check, "dz_fmu.c", "(double)model->drive.status", "0.0"),
        (drive_check, "dz_fmu.c", "model->time + 2.0 * DUE_EARLY / TICK_HZ",
         "model->time - 2.0 * DUE_EARLY / TICK_HZ"),
        (drive_check, "dz_fmu.c", "return next_tick(model);", "return next_tick(model) + 0.5 / TICK_HZ;"),
        (physical_check, "dz_fmu.c", "value[V_U_I] / 10.0", "value[V_U_I] / 10.001"),
        (physical_check, "dz_fmu.c", "value[V_P_B] *", "1.0001 * value[V_P_B] *"),
        (physical_check, "dz_fmu.c", "(share < 0.0) ?", "(share > 0.0) ?"),
        (physical_check, "dz_fmu.c", "* (10.0 / 60000.0);", "* (10.0 / 65535.0);"),
    ],
)  # fmt: skip
def test_a_wrong_compensator_is_found(fmu, compensator, tmp_path, check, name, old, new):
    assert failed(check(edited(fmu, tmp_path, name, old, new), compensator))


def test_the_coupled_fmus_run_as_the_closed_loop_also_with_a_fast_coil(
    fmu, plant_fmu, compensator, firmware, tmp_path
):
    assert closed_loop_check(fmu, plant_fmu, PLANT, compensator, firmware).holds is True
    fast = edited(plant_fmu, tmp_path, "dz_fmu.c", "BEFORE_START, 0.04,", "BEFORE_START, 0.0004,")
    assert closed_loop_check(fmu, fast, replace(PLANT, L_c_H=0.0004), compensator, firmware).holds is True
    assert failed(closed_loop_check(fmu, fast, PLANT, compensator, firmware))


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ("- value[V_K_ET_N_M] * x -", "- 1.0005 * value[V_K_ET_N_M] * x -"),
        ("value[V_K_I_N_A] * (model->played_A - mean)", "value[V_K_I_N_A] * 0.0 * (model->played_A - mean)"),
        ("smaller(larger(model->value[V_COMPARE] / COUNTS, 0.0), 1.0);", "0.999 * model->value[V_COMPARE] / COUNTS;"),
        ("value[V_PRESSURE_FORCE_N_MPA] * dp", "value[V_PRESSURE_FORCE_N_MPA] * value[V_SUPPLY]"),
        ("term *= -share /", "term *= -1.002 * share /"),
        ("on ? model->value[V_U_MAX_V] : 0.0", "on ? 0.0 : model->value[V_U_MAX_V]"),
    ),
    ids=("spring", "play", "duty", "droop", "coil", "phase"),
)
def test_a_wrong_plant_is_found(fmu, plant_fmu, compensator, firmware, tmp_path, old, new):
    found = closed_loop_check(fmu, edited(plant_fmu, tmp_path, "dz_fmu.c", old, new), PLANT, compensator, firmware)
    assert "flows differ" in failed(found)


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ('name="u_O" valueReference="8" causality="output"', 'name="u_O" valueReference="8" causality="input"'),
        ('name="p_A" valueReference="2" causality="input"', 'name="p_A" valueReference="2" causality="output"'),
        ('causality="parameter" variability="fixed"', 'causality="input" variability="fixed"'),
        ('unit="MPa"', 'unit="kPa"'),
        ("<ModelExchange", "<ScheduledExecution"),
        ("</fmiModelDescription>", ""),
    ),
)
def test_a_wrong_description_is_a_problem(fmu_folder, tmp_path, old, new):
    path = Path(shutil.copy(fmu_folder / "dz_compensator.fmu", tmp_path))

    def change(files):
        text = files["modelDescription.xml"].decode()
        assert old in text, old
        files["modelDescription.xml"] = text.replace(old, new, 1).encode()

    repacked(path, change)
    assert unpacked(path, tmp_path / "here").problems


@pytest.mark.parametrize("content", (b"PK", b""))
def test_what_is_no_fmu_has_problems(tmp_path, content):
    path = tmp_path / "dz_compensator.fmu"
    path.write_bytes(content)
    assert unpacked(path, tmp_path / "here").problems


def test_a_corrupted_binary_and_one_that_crashes_fail_every_check(fmu, compensator, tmp_path):
    crashing = ("dz_fmu.c", "    refresh(one);", "    *(volatile int *)0 = 1; refresh(one);")
    wrong = [
        with_binary(fmu, tmp_path / "short", fmu.binary.read_bytes()[:2000]),
        with_binary(fmu, tmp_path / "text", b"\x7fELF, no library"),
        edited(fmu, tmp_path / "crash", *crashing),
    ]
    for each in wrong:
        assert all(failed(check(each, compensator)) for check in (law_check, drive_check, physical_check))
    assert "SIG" in drive_check(wrong[-1], compensator).text


def test_the_core_of_another_valve_is_found(fmu, compensator, tmp_path, monkeypatch):
    """As a binary alone its guid is another; as a whole FMU its answers are."""
    from dzdesign.codegen.fmu import files
    from tests.support.host_fmus import host_platforms

    monkeypatch.setattr(files, "PLATFORMS", host_platforms())
    path = tmp_path / "dz_compensator.fmu"
    other = golden_compensator("f28335")
    path.write_bytes(fmus_of(other, None).files[path.name])
    whole = unpacked(path, tmp_path)
    assert not whole.problems and failed(physical_check(whole, compensator))
    assert failed(law_check(with_binary(fmu, tmp_path / "binary", whole.binary.read_bytes()), compensator))


def test_without_fmpy_an_fmu_could_not_be_checked(fmu_folder, compensator, monkeypatch):
    monkeypatch.setattr(room, "find_spec", lambda name: None)
    manifest = SimpleNamespace(settings={"plant": plant_setting()})
    (found,) = room.checks(fmu_folder, manifest, compensator, print).checks
    assert found.holds is None and "pip install" in found.text


@pytest.mark.slow
def test_the_checks_of_a_folder(fmu_folder, fmu, compensator, monkeypatch):
    manifest = SimpleNamespace(settings={"plant": plant_setting()})
    found = room.checks(fmu_folder, manifest, compensator, lambda text: None)
    assert all(check.holds for check in found.checks) and {"fmu-valid", "exact-law", "fmu-closed-loop"} <= {
        check.id for check in found.checks
    }
    assert sum(each.inputs for each in found.inputs) > 4e7 and not sum(each.wrong for each in found.inputs)
    monkeypatch.setattr(room, "unpacked", lambda path, place: replace(fmu, binary=None))
    assert [check.holds for check in room.checks(fmu_folder, manifest, compensator, print).checks] == [True, None]


@pytest.mark.parametrize("text", ("{", "[]", '{"K_b": 1}', '{"K_a": "x"}', '{"K_a": -1}'))
def test_a_setting_that_is_no_plant_is_refused(text):
    with pytest.raises(InputError, match="plant"):
        plant_of(SimpleNamespace(settings={"plant": text}))
