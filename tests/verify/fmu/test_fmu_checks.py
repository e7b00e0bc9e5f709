"""The checks of FMUs hold of right ones and fail of wrong ones: description, law, drive, units, closed loop."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.outputs import fmu as room
from dzdesign.verify.outputs.fmu import (
    FMU_HOST,
    FmuCore,
    closed_loop_check,
    drive_check,
    input_results,
    physical_check,
    plant_of,
    unpacked,
)
from tests.support.golden_firmware import golden_compensator
from tests.support.host_fmus import PLANT, edited, fmus_of, plant_setting, repacked, with_binary


@pytest.fixture(scope="module")
def prepared(compensator):
    return {sign: PreparedInputs(ExactLaw(compensator, sign)).sample() for sign in (1, -1)}


@pytest.fixture(autouse=True)
def fewer_rows(monkeypatch):
    """Step fewer rows than `verify` does."""
    monkeypatch.setattr(room, "PHYSICAL_ROWS", 300)
    monkeypatch.setattr(room, "DRIVE_SAMPLES", 900)
    monkeypatch.setattr(room, "COURSE", room.COURSE[:5])


def sampled(fmu, sign, prepared):
    return FmuCore(fmu, sign, fmu.binary.read_bytes()).check(prepared[sign], FMU_HOST, sample=True)


def failed(check):
    return check.holds is False and check.text


def test_right_ones_hold(fmu, plant_fmu, compensator, prepared):
    assert fmu.problems == plant_fmu.problems == ()
    for sign in (1, -1):
        found = sampled(fmu, sign, prepared)
        assert found.faults == 0 and found.inputs > 5_000
    for check in (drive_check(fmu, compensator), physical_check(fmu, compensator)):
        assert check.holds is True, check.text


@pytest.mark.parametrize(
    ("name", "old", "new", "sign"),
    (
        ("dz_fmu.c", "(double)dz_comp(codes", "1.0 + (double)dz_comp(codes", 1),
        ("dz_fmu.c", "(double)dz_comp_negative(codes", "(double)dz_comp(codes", -1),
        ("dz_fmu.c", "(double)dz_status(codes", "1.0 + (double)dz_status(codes", 1),
        ("dz_fmu.c", "dz_beta(codes.a, codes.b) /", "dz_beta(codes.b, codes.a) /", 1),
        ("dz_comp.c", "return (uint16_t)(counts_of(", "return (uint16_t)((u == 4095u) ^ counts_of(", 1),
    ),
    ids=("law", "side", "status", "beta", "core"),
)
def test_a_wrong_law_behind_the_getters_is_found(fmu, prepared, tmp_path, name, old, new, sign):
    assert sampled(edited(fmu, tmp_path, name, old, new), sign, prepared).faults > 0


@pytest.mark.parametrize(
    ("check", "old", "new"),
    (
        (drive_check, "ticks_before(model, end);", "ticks_before(model, end + 1.0 / TICK_HZ);"),
        (drive_check, "ticks_before(model, end);", "ticks_before(model, end - 1.0 / TICK_HZ);"),
        (drive_check, "dz_drive_tick(&model->drive);", "dz_drive_tick(&model->drive); dz_drive_tick(&model->drive);"),
        (drive_check, "(double)model->drive.compare_b", "(double)model->drive.compare_a"),
        (drive_check, "(double)model->drive.status", "0.0"),
        (drive_check, "model->time + 2.0 * DUE_EARLY / TICK_HZ", "model->time - 2.0 * DUE_EARLY / TICK_HZ"),
        (drive_check, "return next_tick(model);", "return next_tick(model) + 0.5 / TICK_HZ;"),
        (physical_check, "value[V_U_I] / 10.0", "value[V_U_I] / 10.001"),
        (physical_check, "value[V_P_B] *", "1.0001 * value[V_P_B] *"),
        (physical_check, "(share < 0.0) ?", "(share > 0.0) ?"),
        (physical_check, "* (10.0 / 60000.0);", "* (10.0 / 65535.0);"),
    ),
)
def test_a_wrong_drive_or_scaling_is_found(fmu, compensator, tmp_path, check, old, new):
    assert failed(check(edited(fmu, tmp_path, "dz_fmu.c", old, new), compensator))


def test_the_coupled_fmus_run_as_the_closed_loop_also_with_a_fast_coil(fmu, plant_fmu, compensator, tmp_path):
    assert closed_loop_check(fmu, plant_fmu, PLANT, compensator).holds is True
    fast = edited(plant_fmu, tmp_path, "dz_fmu.c", "BEFORE_START, 0.04,", "BEFORE_START, 0.0004,")
    assert closed_loop_check(fmu, fast, replace(PLANT, L_c_H=0.0004), compensator).holds is True
    assert failed(closed_loop_check(fmu, fast, PLANT, compensator))


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
def test_a_wrong_plant_is_found(fmu, plant_fmu, compensator, tmp_path, old, new):
    found = closed_loop_check(fmu, edited(plant_fmu, tmp_path, "dz_fmu.c", old, new), PLANT, compensator)
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


def test_a_corrupted_binary_and_one_that_crashes_fail_every_check(fmu, compensator, prepared, tmp_path):
    crashing = ("dz_fmu.c", "    refresh(one);", "    *(volatile int *)0 = 1; refresh(one);")
    wrong = [
        with_binary(fmu, tmp_path / "short", fmu.binary.read_bytes()[:2000]),
        with_binary(fmu, tmp_path / "text", b"\x7fELF, no library"),
        edited(fmu, tmp_path / "crash", *crashing),
    ]
    for each in wrong:
        with pytest.raises(RequirementError):
            sampled(each, 1, prepared)
        assert failed(drive_check(each, compensator)) and failed(physical_check(each, compensator))
    assert "SIG" in drive_check(wrong[-1], compensator).text


def test_the_core_of_another_valve_is_found(fmu, compensator, prepared, tmp_path, monkeypatch):
    """As a binary alone its guid is another; as a whole FMU its answers are."""
    from dzdesign.codegen.fmu import files
    from tests.support.host_fmus import host_platforms

    monkeypatch.setattr(files, "PLATFORMS", host_platforms())
    path = tmp_path / "dz_compensator.fmu"
    other = golden_compensator("f28335")
    path.write_bytes(fmus_of(other, None).files[path.name])
    whole = unpacked(path, tmp_path)
    assert not whole.problems and sampled(whole, 1, prepared).faults > 0
    with pytest.raises(RequirementError, match="guid"):
        sampled(with_binary(fmu, tmp_path / "binary", whole.binary.read_bytes()), 1, prepared)


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


@pytest.mark.slow
def test_a_law_that_is_wrong_at_one_input_is_an_exact_law_that_does_not_hold(fmu, compensator, tmp_path):
    right = "return (uint16_t)(counts_of("
    wrong = edited(fmu, tmp_path, "dz_comp.c", right, right.replace("counts_of", "(u == 4095u) ^ counts_of"))
    found, tried = input_results(wrong, compensator)
    assert [check.holds for check in found if check.id == "exact-law"] == [False, True] and tried[0].wrong > 0
