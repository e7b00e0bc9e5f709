"""The checks of FMUs hold of right ones and fail of wrong ones: law, drive, units, closed loop, files, description."""

import json
from dataclasses import asdict, replace
from types import SimpleNamespace

import pytest

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.fmu.binary_core import FmuCore
from dzdesign.verify.fmu.checks import drive_check, physical_check, plant_of
from dzdesign.verify.fmu.closed_loop import closed_loop_check
from dzdesign.verify.fmu.descriptions import file_faults, library_faults
from dzdesign.verify.fmu.fmu_file import read_fmu
from tests.support.golden_firmware import golden_compensator
from tests.support.host_fmus import PLANT, edited, with_binary, with_files


@pytest.fixture(scope="module")
def prepared(compensator):
    return {sign: PreparedInputs(ExactLaw(compensator, sign)).sample() for sign in (1, -1)}


@pytest.fixture(autouse=True)
def fewer_rows(monkeypatch):
    """Step fewer rows than `verify` does."""
    monkeypatch.setattr("dzdesign.verify.fmu.checks.PHYSICAL_ROWS", 300)
    monkeypatch.setattr("dzdesign.verify.fmu.checks.DRIVE_SAMPLES", 900)


@pytest.mark.parametrize("sign", (1, -1))
def test_the_law_behind_the_getters_is_the_exact_one(fmu, prepared, sign):
    found = FmuCore(fmu, sign, fmu.binary_here()).check(prepared[sign], sample=True)
    assert found.faults == 0 and found.inputs > 5_000


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
def test_a_wrong_law_behind_the_getters_is_found(fmu, prepared, name, old, new, sign):
    found = FmuCore(fmu, sign, edited(fmu, name, old, new)).check(prepared[sign], sample=True)
    assert found.faults > 0


def test_a_binary_of_another_token_is_refused_and_found(fmu, prepared, compensator):
    other = edited(fmu, "dz_fmu.c", fmu.token, fmu.token[:-2] + "0}")
    with pytest.raises(RequirementError, match="token"):
        FmuCore(fmu, 1, other).check(prepared[1], sample=True)
    takes_any = edited(fmu, "dz_fmu.c", "!same_text(", "0 && !same_text(")
    assert drive_check(fmu, takes_any, compensator).holds is False


PRINTS = """
#include <stdio.h>
#include <stdlib.h>
#define TALK {0}
#include "fmi2Functions.h"
"""
LINES = r'do { printf("1 2 3 0 0 0 0 0 0 0 0 0 0 0 0 0 0\\n0 0\\nend\\n"); fflush(stdout); } while (0)'


@pytest.mark.parametrize("ends", (False, True))
def test_a_binary_that_prints_or_ends_the_program_says_nothing_by_it(fmu, prepared, compensator, ends):
    """What it prints is neither taken for results nor disturbs them; of a program that it ends there are none."""
    talk = LINES.replace("while (0)", "while (exit(0), 0)") if ends else LINES
    with_talk = PRINTS.replace("{0}", talk)
    source = fmu.files["sources/dz_fmu.c"].decode().replace('#include "fmi2Functions.h"\n', with_talk, 1)
    source = source.replace("refresh(one);   ", "TALK; refresh(one);", 1)
    source = source.replace("refusal = take_step(", "TALK; refusal = take_step(")
    made = edited(with_files(fmu, {"sources/dz_fmu.c": source.encode()}), "dz_fmu.c", "TALK", "TALK")
    if not ends:
        assert FmuCore(fmu, 1, made).check(prepared[1], sample=True).faults == 0
        assert drive_check(fmu, made, compensator).holds is True
        return
    with pytest.raises(RequirementError, match="before its results were whole"):
        FmuCore(fmu, 1, made).check(prepared[1], sample=True)
    found = drive_check(fmu, made, compensator)
    assert found.holds is False and "whole" in found.text


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ("if (!(size > 0.0)) {", "if (size < 0.0) {"),
        ("(late >= -SAME_TIME_S)", "(late <= 1.0 || late > 0.0)"),
        ("if (!((late >=", "if (0 && !((late >="),
        ("value >= described[reference].least", "value >= -1e999"),
        ("value <= described[reference].largest", "value <= 1e999"),
    ),
)
def test_a_binary_that_takes_what_is_no_step_or_number_is_found(fmu, compensator, old, new):
    found = drive_check(fmu, edited(fmu, "dz_fmu.c", old, new), compensator)
    assert found.holds is False and "the binary takes" in found.text


def test_the_drive_and_the_delay_of_a_step_are_those_of_the_model(fmu, compensator):
    assert drive_check(fmu, fmu.binary_here(), compensator).holds is True


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ("ticks_before(model, end);", "ticks_before(model, end + 1.0 / TICK_HZ);"),
        ("ticks_before(model, end);", "ticks_before(model, end - 1.0 / TICK_HZ);"),
        ("dz_drive_tick(&model->drive);", "dz_drive_tick(&model->drive); dz_drive_tick(&model->drive);"),
        ("(double)model->drive.compare_b", "(double)model->drive.compare_a"),
        ("(double)model->drive.status", "0.0"),
    ),
    ids=("early", "late", "twice", "side", "status"),
)
def test_a_wrong_drive_is_found(fmu, compensator, old, new):
    assert drive_check(fmu, edited(fmu, "dz_fmu.c", old, new), compensator).holds is False


def test_volts_and_pressures_are_read_as_an_ideal_converter_does(fmu, compensator):
    assert physical_check(fmu, fmu.binary_here(), compensator).holds is True


@pytest.mark.parametrize(
    ("old", "new"),
    (("value[V_U_I] / 10.0", "value[V_U_I] / 10.001"), ("value[V_P_B] *", "1.0001 * value[V_P_B] *"),
     ("(share < 0.0) ?", "(share > 0.0) ?")),
    ids=("command", "pressure", "side"),
)  # fmt: skip
def test_a_wrong_scaling_is_found(fmu, compensator, old, new):
    assert physical_check(fmu, edited(fmu, "dz_fmu.c", old, new), compensator).holds is False


def test_the_coupled_fmus_run_as_the_closed_loop(fmu, plant_fmu, compensator):
    assert closed_loop_check(fmu, plant_fmu, asdict(PLANT), compensator).holds is True


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
def test_a_wrong_plant_is_found(fmu, plant_fmu, compensator, old, new):
    wrong = with_binary(plant_fmu, edited(plant_fmu, "dz_fmu.c", old, new))
    found = closed_loop_check(fmu, wrong, asdict(PLANT), compensator)
    assert found.holds is False and "flows differ" in found.text


def test_a_coil_that_is_fast_beside_a_step_is_exact_too(fmu, plant_fmu, compensator):
    fast = with_binary(plant_fmu, edited(plant_fmu, "dz_fmu.c", "BEFORE_START, 0.04,", "BEFORE_START, 0.0004,"))
    assert closed_loop_check(fmu, fast, {**asdict(PLANT), "L_c_H": 0.0004}, compensator).holds is True


def faults_of(fmu, compensator):
    found = list(file_faults(fmu, compensator, sha256_of(to_json_bytes(compensator))))
    return [fault for fault in found if not fault.startswith("binaries/")]  # those of other machines


def test_files_and_manifest_agree(fmu, plant_fmu, compensator):
    assert not faults_of(fmu, compensator) and not faults_of(plant_fmu, compensator)


@pytest.mark.parametrize("path", ("sources/dz_fmu.c", "modelDescription.xml", "extra/dzdesign/compensator.json"))
def test_a_changed_file_is_found(fmu, compensator, path):
    assert any(path in fault for fault in faults_of(with_files(fmu, {path: fmu.files[path] + b" "}), compensator))


def test_an_added_file_another_compensator_and_a_missing_platform_are_found(fmu, compensator):
    assert faults_of(with_files(fmu, {"resources/other.txt": b""}), compensator)
    assert any("compensator.json is another" in fault for fault in faults_of(fmu, golden_compensator("host")))
    for key, other in (("token", "{0}"), ("compensator_json", "0" * 64)):
        wrong = replace(fmu, manifest={**fmu.manifest, key: other})
        assert any(key in fault for fault in faults_of(wrong, compensator))
    missing = list(file_faults(fmu, compensator, sha256_of(to_json_bytes(compensator))))
    assert any("win64" in fault for fault in missing)


def test_no_library_is_needed_and_one_that_is_needed_is_found(fmu, plant_fmu):
    assert not list(library_faults(fmu)) and not list(library_faults(plant_fmu))
    assert list(library_faults(with_binary(fmu, edited(fmu, "dz_fmu.c", "", "", "-Wl,--no-as-needed"))))
    assert list(library_faults(with_binary(fmu, b"\x7fELF")))


def test_what_is_no_fmu_is_refused(tmp_path):
    path = tmp_path / "dz_compensator.fmu"
    path.write_bytes(b"PK")
    with pytest.raises(InputError, match="no FMU"):
        read_fmu(path)


@pytest.mark.parametrize("text", ("{", "[]", '{"K_b": 1}', '{"K_a": "x"}', '{"K_a": -1}'))
def test_a_setting_that_is_no_plant_is_refused(text):
    with pytest.raises(InputError, match="plant"):
        plant_of(SimpleNamespace(settings={"plant": text}))


def test_the_manifest_of_an_fmu_names_compiler_and_compensator(fmu, compensator):
    manifest = json.loads(fmu.files["extra/dzdesign/manifest.json"])
    assert manifest["compensator_json"] == sha256_of(to_json_bytes(compensator))
    assert manifest["compiler"].startswith("ziglang ")
