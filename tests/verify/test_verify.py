"""The checkers are checked: faults seeded in the C, in the law and in the design must be seen."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from dzdesign.core.artefact_files import write_folder
from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.ramps import dead_zone
from dzdesign.verify.closed_loop.scene import scenes_of
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.folder import (
    Regenerated,
    check_firmware_inside,
    read_compensator,
    read_firmware_manifest,
    reproduced,
)
from tests.support.attacked_firmware import add, edit
from tests.support.evidence import verify
from tests.support.synthetic import needs_compiler, with_side

pytestmark = needs_compiler

QUICK = RampSequence(rest=0.5, ramp=4.0, top=0.5)


def test_an_offset_above_the_bound_is_over_compensation(example_compensator, tmp_path):
    """A wrong design, rightly coded: the C equals its law, and the law is refused."""
    from dzdesign.codegen.project import generate

    raised = tuple(min(numerator + 60, 32768) for numerator in example_compensator.positive.beta)
    greedy = with_side(example_compensator, beta=raised)
    firmware = generate(greedy, "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    result = check_all_inputs(tmp_path / "fw")
    assert result.wrong == 0
    assert result.over_compensated > 0 and not result.holds


def fault_of(folder, manifest):
    """What is wrong with the folder, of which every generated file is as it lies there; empty if nothing is."""
    check = reproduced(folder, Regenerated(files={name: (folder / name).read_bytes() for name in manifest.files}))
    return "" if check.holds else check.text


@pytest.mark.parametrize(
    "name",
    ["core/my.c", "core/board/adc.c", "f28335/extra.c", "more/extra.CPP", "f28335/x.asm", "F28335.cmd",
     "f28335/my.projectspec", "my.mk"],
)  # fmt: skip
def test_source_and_project_files_that_were_added_are_refused(firmware_folder, name):
    manifest = read_firmware_manifest(firmware_folder)
    for built in ("f28335/main.o", "f28335/firmware.out", "f28335/firmware.map"):
        (firmware_folder / built).write_text("")
    assert fault_of(firmware_folder, manifest) == ""
    add(firmware_folder, name)
    assert fault_of(firmware_folder, manifest).startswith(f"not generated: {name}; keep your own")


def test_what_cmake_built_may_stay_where_nothing_of_ours_is(firmware_folder, wording):
    manifest = read_firmware_manifest(firmware_folder)
    for name in ("build/CMakeCache.txt", "build/Makefile", "build/CMakeFiles/3.30/CMakeCCompilerId.c"):
        add(firmware_folder, name)
    assert fault_of(firmware_folder, manifest) == ""
    for name in ("f28335/CMakeCache.txt", "f28335/extra.c", "CMakeCache.txt"):
        (firmware_folder / name).write_text("")
    wording.of_test(fault_of(firmware_folder, manifest))


def test_a_manifest_that_names_no_file_is_no_evidence(firmware_folder, wording):
    manifest = json.loads((firmware_folder / "manifest.json").read_text())
    (firmware_folder / "manifest.json").write_text(to_json(manifest | {"files": {}, "core": []}))
    with wording.refusal(InputError):
        verify(firmware_folder, sequence=QUICK)


def test_a_core_that_does_not_compile_fails_the_verification(firmware_folder):
    edit(firmware_folder, "core/dz_comp.c", "const uint64_t sum = ((whole", "const uint64_t sum = ((whale")
    result = verify(firmware_folder, sequence=QUICK)
    assert not result.holds and result.evidence.inputs == ()


class TestPlant:
    def test_current_settles_where_equations_19_to_21_say(self):
        plant = Plant()
        run = ClosedLoop(plant).run(np.full(200, 0.6), 1.0)
        force = plant.force_per_volt * 6.0
        # Eq. (23) at rest, with the edge open: spring, preload, pressure and flow force against the solenoid.
        opening = (
            (force - plant.preload_N + plant.pressure_force_N_MPa * run.dp_MPa[-1])
            - (plant.K_et_N_m * plant.overlap_mm * 1e-3)
            - plant.force_per_volt * plant.hysteresis_V / 2
        )
        opening /= plant.K_et_N_m + plant.flow_force_N_mm_MPa * 1e3 * run.dp_MPa[-1]
        flow = plant.C_d_W_mm * 1e-3 * opening * np.sqrt(2 * run.dp_MPa[-1] * 1e6 / plant.rho_kg_m3) * 6e4
        assert run.q_L_min[-1] == pytest.approx(flow, rel=2e-3)

    def test_a_coil_too_fast_to_follow_is_refused(self, wording):
        with wording.refusal(InputError):
            Plant(L_c_H=1e-6)

    def test_hysteresis_is_the_width_of_the_play(self):
        plant = Plant(hysteresis_V=0.3)
        run = ClosedLoop(plant).run(RampSequence(rest=1, ramp=50, top=1).command(), 1.0)
        width = dead_zone(run, 0.02, rising=True) - dead_zone(run, 0.02, rising=False)
        assert width * 10 == pytest.approx(0.3, abs=0.02)


@pytest.mark.slow
def test_what_could_not_be_checked_is_not_passed(tmp_path):
    """Rising ramps alone: where the valve closes is not known, so zero command after closing is not checked."""
    from dzdesign.codegen.project import generate
    from dzdesign.design.designing import design
    from dzdesign.design.options import DesignOptions
    from dzdesign.identify.identification import identify
    from tests.support.synthetic import Truth, synthetic_ramp

    valve = identify([synthetic_ramp(1.0, Truth(), falling=False)])
    firmware = generate(design(valve, DesignOptions(guard="opening")), "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    result = verify(tmp_path / "fw", sequence=QUICK)
    assert [check.holds for check in result.evidence.checks if "zero command in" in check.name] == [None]
    assert not result.holds and result.evidence.holds is False


@pytest.mark.slow
def test_a_span_that_ends_at_the_tested_pressure_can_be_verified(example_valve, tmp_path):
    from dzdesign.codegen.project import generate, target_named
    from dzdesign.design.designing import design
    from dzdesign.design.options import options_of

    options = options_of({"pressure_span": "5.1 MPa"}, target_named("f28335").inputs())
    firmware = generate(design(example_valve, options), "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    scenes = scenes_of(tmp_path / "fw", read_compensator(tmp_path / "fw"), None)
    assert len(scenes) > 1 and all(scene.back_MPa >= 0 for scene in scenes)


@pytest.fixture
def folder(tmp_path):
    for name in ("compensator.json", "core/dz_comp.c", "board/my.c"):
        add(tmp_path, name)
    return tmp_path


@pytest.mark.parametrize("name", ["core/dz_comp.c", "board/my.c"])
def test_a_file_without_permission_is_refused(folder, monkeypatch, name):
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: allowed(path, mode) and not str(path).endswith(name))
    with pytest.raises(InputError, match=f"{name}' can't be read"):
        check_firmware_inside(folder)


def test_a_folder_without_permission_is_refused_and_not_passed_over(folder, monkeypatch):
    listed = os.scandir

    def scandir(path):
        if str(path).endswith("board"):
            raise PermissionError(13, "Permission denied", str(path))
        return listed(path)

    monkeypatch.setattr(os, "scandir", scandir)
    with pytest.raises(InputError, match="board' can't be read: Permission denied"):
        check_firmware_inside(folder)


@pytest.mark.skipif(os.name != "posix", reason="names are bytes")
@pytest.mark.parametrize("place", ["core", "board"])
def test_a_name_that_is_no_text_is_refused(folder, place):
    try:
        (folder / place / os.fsdecode(b"my\xff.c")).touch()
    except OSError:
        pytest.skip("this file system takes no such name")
    with pytest.raises(InputError, match=r"my\?\.c' has a name that is no text"):
        check_firmware_inside(folder)


def enlarge(path: Path, octets: int = 1 << 40) -> None:
    """Make a file huge that takes no room on the disk."""
    with open(path, "r+b" if path.exists() else "xb") as file:
        file.truncate(octets)


@pytest.mark.skipif(os.name == "nt", reason="such a file takes room there")
@pytest.mark.parametrize("name", ["compensator.json", "f28335/more.h"])
def test_a_file_larger_than_any_of_dzdesign_is_refused_before_it_is_read(firmware_folder, tmp_path, name):
    folder = tmp_path / "enlarged"
    shutil.copytree(firmware_folder, folder)
    enlarge(folder / name, 1 << 29)
    with pytest.raises(InputError, match=f"{name}.* is larger than 16 MiB"):
        read_firmware_manifest(folder)
