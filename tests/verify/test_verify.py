"""The checkers are checked: faults seeded in the C, in the law and in the design must be seen."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.core.artefact_files import to_json, write_folder
from dzdesign.core.errors import InputError
from dzdesign.regeneration import regenerated
from dzdesign.verify.closed_loop import motion
from dzdesign.verify.closed_loop.dead_zone import dead_zone
from dzdesign.verify.closed_loop.loop import PERIODS_PER_RECORD, ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.firmware.compensator_checks import certificate_follows
from dzdesign.verify.firmware.folder import read_firmware_manifest
from dzdesign.verify.firmware.unchanged_files import files_unchanged
from dzdesign.verify.verification import verify
from tests.support import plant_oracle
from tests.support.plant_oracle import Oracle
from tests.support.synthetic import needs_compiler, with_side

pytestmark = needs_compiler

QUICK = RampSequence(rest=0.5, ramp=4.0, top=0.5)


def mutate(folder, pattern: str, replacement, file: str = "dz_comp.c") -> None:
    """Change one place of the generated core."""
    source = folder / "core" / file
    text = source.read_text()
    changed, count = re.subn(pattern, replacement, text, count=1)
    assert count == 1 and changed != text, pattern
    source.write_text(changed)


def test_the_generated_core_equals_the_law_on_every_input(firmware_folder):
    result = check_all_inputs(firmware_folder)
    assert result.holds
    assert result.inputs == 4096 * (2 * 3326 + 1)
    assert result.wrong == 0 and result.largest_error == 0


def one_more(match: re.Match) -> str:
    return match.group(1) + str(int(match.group(2)) + 1) + match.group(3)


def one_less(match: re.Match) -> str:
    return match.group(1) + str(int(match.group(2)) - 1) + match.group(3)


VALVE = "dz_valve.h"
FAULTS = {
    "slope": (r"(\.slope = UINT32_C\()(\d+)(\))", one_more, VALVE),
    "offset": (r"(\.offset = UINT32_C\()(\d+)(\))", one_more, VALVE),
    "half": (r"(\.half = \{UINT32_C\(\d+\), UINT32_C\()(\d+)(\))",
             lambda m: m.group(1) + str(int(m.group(2)) * 2) + m.group(3), VALVE),
    "reciprocal": (r"(\.reciprocal = UINT32_C\()(\d+)(\))",
                   lambda m: m.group(1) + str(int(m.group(2)) - 200) + m.group(3), VALVE),
    "shift": (r"(\.reciprocal_shift = )(\d+)(u)", one_less, VALVE),
    "a node of the law": (r"(\.nodes = \{\n *\{UINT32_C\()(\d+)(\))", one_more, VALVE),
    # A few units, of which there are 4 million in beta = 1, change no compare value: no fault at all.
    "fallback": (r"(\{UINT32_C\(\d+\), UINT32_C\()(\d+)(\)\}, /\* pressures)",
                 lambda m: m.group(1) + str(int(m.group(2)) + 10_000) + m.group(3), VALVE),
    "distance of the nodes": (r"left = DZ_BETA_STEP - past", "left = (DZ_BETA_STEP - 1u) - past", "dz_comp.c"),
    "reverse": (r"(\.reverse = UINT32_C\()(\d+)(\))",
                lambda m: m.group(1) + str(int(m.group(2)) + 4096) + m.group(3), VALVE),
    "command's end": (r"(\.command_high = )(\d+)(u)", one_less, VALVE),
    "pressure's end": (r"(\.a_high = )(\d+)(u)", one_less, VALVE),
    "p_b not looked at": (r"\(block->b_high - p_b\) \|\n", "0u |\n", "dz_comp.c"),
    "depends on one pressure": (r"\(p_b \* block->weight_b\)", "((p_b & 4094u) * block->weight_b)", "dz_comp.c"),
    "command let go too late": (r"beta\)\) & ~let_go", "beta)) & 65535u", "dz_comp.c"),
    "status": (r"\(a >> 31\) \* DZ_STATUS_PRESSURE_A", "(b >> 31) * DZ_STATUS_PRESSURE_A", "dz_comp.c"),
    "status's difference": (r"below_zero\(a \| b\)", "below_zero(a)", "dz_comp.c"),
    "end of the tests": (r"(\.tested_to = UINT32_C\()(\d+)(\))",
                         lambda m: m.group(1) + str(int(m.group(2)) + 4096) + m.group(3), VALVE),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_seeded_fault_in_the_c_is_found(firmware_folder, fault):
    mutate(firmware_folder, *FAULTS[fault])
    assert not check_all_inputs(firmware_folder).holds


def test_a_missing_limit_is_found_where_the_law_reaches_full_drive(example_compensator, tmp_path):
    from dzdesign.codegen.project import generate

    long_stroke = with_side(example_compensator, drive_range_over_u_max=Fraction(3, 4))
    firmware = generate(long_stroke, "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    assert check_all_inputs(tmp_path / "fw").holds
    mutate(tmp_path / "fw", r"at_most\(sum, side->quotient_limit\)", "sum")
    assert not check_all_inputs(tmp_path / "fw").holds


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


def test_a_certificate_that_says_too_much_is_found(example_compensator, wording):
    """What the header promises beyond the tests is no property of the machine code, so no input shows it."""
    honest = certificate_follows(example_compensator)
    certificate = replace(example_compensator.positive.certificate, dp_MPa=(Fraction(0), Fraction(20)))
    boastful = certificate_follows(with_side(example_compensator, certificate=certificate))
    assert honest.holds and not boastful.holds
    wording.of_test(boastful.text)


@pytest.mark.slow
@pytest.mark.usefixtures("each_core_once")
def test_a_changed_file_fails_the_verification(firmware_folder):
    readme = firmware_folder / "f28335" / "README.md"
    readme.write_text(readme.read_text() + "\n")
    result = verify(firmware_folder, sequence=QUICK)
    assert [check.name for check in result.evidence.checks if not check.holds] == ["the generated files are unchanged"]


@pytest.mark.parametrize(
    "name",
    ["core/my.c", "f28335/extra.c", "more/extra.CPP", "f28335/x.asm", "F28335.cmd", "f28335/my.projectspec", "my.mk"],
)
def test_source_and_project_files_that_were_added_are_refused(firmware_folder, name, wording):
    manifest = read_firmware_manifest(firmware_folder)
    for built in ("f28335/main.o", "f28335/firmware.out", "f28335/firmware.map"):
        (firmware_folder / built).write_text("")
    assert files_unchanged(firmware_folder, manifest).holds
    (firmware_folder / name).parent.mkdir(exist_ok=True)
    (firmware_folder / name).write_text("")
    added = files_unchanged(firmware_folder, manifest)
    assert added.holds is False
    wording.of_test(added.text)


def test_a_file_whose_line_was_taken_from_the_manifest_is_refused(firmware_folder, wording):
    manifest = read_firmware_manifest(firmware_folder)
    files = {name: digest for name, digest in manifest.files.items() if name != "f28335/dz_isr.c"}
    wording.of_test(files_unchanged(firmware_folder, replace(manifest, files=files)).text)


def test_what_cmake_built_may_stay_where_nothing_of_ours_is(firmware_folder, wording):
    manifest = read_firmware_manifest(firmware_folder)
    for name in ("build/CMakeCache.txt", "build/Makefile", "build/CMakeFiles/3.30/CMakeCCompilerId.c"):
        (firmware_folder / name).parent.mkdir(parents=True, exist_ok=True)
        (firmware_folder / name).write_text("")
    built = files_unchanged(firmware_folder, manifest)
    assert built.holds
    wording.of_test(built.text)
    for name in ("f28335/CMakeCache.txt", "f28335/extra.c", "CMakeCache.txt"):
        (firmware_folder / name).write_text("")
    wording.of_test(files_unchanged(firmware_folder, manifest).text)


@pytest.mark.skipif(shutil.which("cmake") is None, reason="no CMake")
def test_a_true_build_of_cmake_is_no_foreign_source(example_compensator, tmp_path, wording):
    from dzdesign.codegen.project import generate

    firmware = generate(example_compensator, "host")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    subprocess.run(["cmake", "-S", "host", "-B", "host/build"], cwd=tmp_path / "fw", check=True, capture_output=True)
    found = files_unchanged(tmp_path / "fw", read_firmware_manifest(tmp_path / "fw"))
    assert found.holds
    wording.of_test(found.text)


def test_a_header_that_may_be_taken_for_ours_is_said(firmware_folder, wording):
    manifest = read_firmware_manifest(firmware_folder)
    (firmware_folder / "f28335" / "dz_comp.h").write_text("#define DZ_COMPARE_MAX 1u\n")  # goes before core's
    shadowed = files_unchanged(firmware_folder, manifest)
    assert shadowed.holds is False
    wording.of_test(shadowed.text)


@pytest.mark.usefixtures("each_core_once")
def test_a_manifest_that_names_no_file_is_no_evidence(firmware_folder, wording):
    manifest = json.loads((firmware_folder / "manifest.json").read_text())
    (firmware_folder / "manifest.json").write_text(to_json(manifest | {"files": {}, "core": []}))
    with wording.refusal(InputError):
        verify(firmware_folder, sequence=QUICK)
    (firmware_folder / "manifest.json").write_text(to_json(manifest | {"files": {}}))
    result = verify(firmware_folder, sequence=QUICK)
    assert "the generated files are unchanged" in {check.name for check in result.evidence.checks if not check.holds}


def test_a_core_that_does_not_compile_fails_the_verification(firmware_folder):
    mutate(firmware_folder, r"const uint64_t sum = law\b", "const uint64_t sum = lav")
    result = verify(firmware_folder, sequence=QUICK)
    assert not result.holds and result.evidence.inputs == ()


def test_reference_agrees_with_the_compensator_at_random(example_compensator):
    exact = ExactLaw(example_compensator)
    rng = np.random.default_rng(3)
    codes = [int(code) for code in rng.integers(-3326, 3327, 40)]
    for code in codes:
        corners = exact.corners(exact.betas(code))
        for command in (*range(0, 4095, 97), 4095):
            assert exact.compare_value(command, corners) == example_compensator.compare(command, code)


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

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "plant",
        [Plant(), Plant(hysteresis_V=0.0, droop_MPa_L_min2=0.0), Plant(preload_N=10.0, stroke_mm=0.8, m_e_kg=0.1)],
        ids=["default", "without play and droop", "heavy, with a short stroke"],
    )
    def test_motion_agrees_with_the_oracle(self, plant):
        """A ramp, then jumps of the duty: lift-off, landings at both stops, and the edge, to 1e-5 of the stroke."""
        shares = np.concatenate([np.linspace(0, 1, 12), np.random.default_rng(1).random(12)])
        duties = np.repeat(np.round(shares * 60000) / 60000, PERIODS_PER_RECORD)
        exact = Oracle(plant, 2.0).periods(np.concatenate([[0.0], duties[:-1]]))  # a compare value acts a period later
        found = ClosedLoop(plant).run(shares, 2.0).position_mm
        assert np.abs(found - exact[PERIODS_PER_RECORD - 1 :: PERIODS_PER_RECORD]).max() <= 1e-5 * plant.stroke_mm
        assert exact.max() > 0.8 * plant.stroke_mm and exact.min() == 0
        assert exact.max() == plant.stroke_mm or plant.stroke_mm > 0.8  # the short stroke comes to its upper stop

    @pytest.mark.parametrize("more", [{}, {"hysteresis_V": 0.0, "stroke_mm": 0.8, "m_e_kg": 0.3}], ids=["", "landings"])
    def test_linear_motion_is_exact(self, monkeypatch, more):
        """Where nothing depends on the position, to 1e-12 of the stroke, stops included."""
        monkeypatch.setattr(plant_oracle, "TIGHT", {"method": "DOP853", "rtol": 3e-14})
        plant = Plant(flow_force_N_mm_MPa=0.0, droop_MPa_L_min2=0.0, **more)
        shares = np.concatenate([np.linspace(0.3, 1, 4), np.random.default_rng(1).random(6)])
        duties = np.repeat(np.round(shares * 60000) / 60000, PERIODS_PER_RECORD)
        exact = Oracle(plant, 2.0).periods(np.concatenate([[0.0], duties[:-1]]))
        found = ClosedLoop(plant).run(shares, 2.0).position_mm
        assert np.abs(found - exact[PERIODS_PER_RECORD - 1 :: PERIODS_PER_RECORD]).max() <= 1e-12 * plant.stroke_mm

    @pytest.mark.parametrize(
        ("plant", "duties", "supply_MPa"),
        [
            (
                Plant(
                    u_max_V=13.0184225,
                    K_a=5.13313101,
                    K_fi_V_A=10.6339839,
                    R_c_ohm=3.61000547,
                    r_p_ohm=0.639944054,
                    L_c_H=0.0401199382,
                    K_i_N_A=59.6140517,
                    m_e_kg=0.0456444092,
                    B_e_N_s_m=43.3947293,
                    K_et_N_m=16216.3978,
                    preload_N=20.5834646,
                    pressure_force_N_MPa=0.320103101,
                    flow_force_N_mm_MPa=0.0,
                    overlap_mm=0.345229887,
                    stroke_mm=2.773709,
                    hysteresis_V=0.136883972,
                    C_d_W_mm=3.36906601,
                    rho_kg_m3=1080.42707,
                    droop_MPa_L_min2=0.0,
                ),
                np.array([0.138949, 0.293584, 0.448112, 0.602411, 0.15639, 0.309957, 0.463005]),
                2.0,
            ),
            (
                Plant(overlap_mm=0.0, pressure_force_N_MPa=3.0, K_et_N_m=8500.0, B_e_N_s_m=0.0, C_d_W_mm=17.0),
                np.ones(40),
                13.9,
            ),
        ],
        ids=["there and back within a period", "the edge at the stop"],
    )
    def test_motion_near_a_stop_agrees_with_the_oracle(self, plant, duties, supply_MPa):
        """Duties that jump from period to period about the lift-off, where a landing and the edge are close."""
        exact = Oracle(plant, supply_MPa).periods(np.concatenate([[0.0], duties[:-1]]))
        found = ClosedLoop(plant).run(duties, supply_MPa, periods_per_record=1).position_mm
        assert np.abs(found - exact).max() <= 1e-5 * plant.stroke_mm
        assert exact.max() > 0

    def test_response_over_a_period_is_the_matrix_exponential(self):
        from scipy.linalg import expm

        numbers = motion.numbers_of(Plant(), 750)
        driven = np.zeros((5, 5))
        driven[0, 0], driven[0, 4] = -1000.0, 1000.0  # Eqs. (19)-(21): 100 A/s a volt, at 10 V
        driven[1, 2], driven[2, :3], driven[3, 0] = 1.0, [1000.0, -250000.0, -750.0], 1.0
        for count in (0, 1, 511, 512, 777, 1500):
            coarse, row = numbers.coarse[count // motion.FINE], numbers.fine[count % motion.FINE]
            i_i, q_i, x_i, x_x, x_v, v_i, v_x, v_v = row[:8]
            free = [[i_i, 0, 0, 0], [x_i, x_x, x_v, 0], [v_i, v_x, v_v, 0], [q_i, 0, 0, 1]]
            exact = expm(driven * 400e-6 * count / 1500)[:4, 4]
            assert np.array(free) @ coarse + row[8:] == pytest.approx(exact, rel=1e-12, abs=1e-20)

    def test_a_coil_too_fast_to_follow_is_refused(self, wording):
        with wording.refusal(InputError):
            Plant(L_c_H=1e-6)

    def test_hysteresis_is_the_width_of_the_play(self):
        plant = Plant(hysteresis_V=0.3)
        run = ClosedLoop(plant).run(RampSequence(rest=1, ramp=50, top=1).command(), 1.0)
        width = dead_zone(run, 0.02, rising=True) - dead_zone(run, 0.02, rising=False)
        assert width * 10 == pytest.approx(0.3, abs=0.02)


@pytest.mark.slow
def test_closed_loop_removes_the_dead_zone_and_without_beta_leaks(firmware_folder, example_folder):
    from dzdesign.verify.closed_loop.plant import read_plant

    result = verify(firmware_folder, read_plant(example_folder / "plant.toml"), sequence=QUICK)
    assert result.with_checks(regenerated(firmware_folder)).holds
    for loop in result.loops:
        # The quick ramp lags by some tens of millivolts.
        assert loop.result.dead_zone_opening > 0.5
        assert loop.result.residual_opening < 0.085
        assert loop.result.q_zero_L_min == 0
    at_highest = result.loops[-1].result
    assert at_highest.q_zero_without_beta_L_min > 0.3


@pytest.mark.slow
def test_a_law_without_its_guard_leaks_in_the_loop(example_compensator, example_folder, tmp_path):
    """The closed loop sees over-compensation on its own: an offset of the opening threshold, at every pressure."""
    from dzdesign.codegen.project import generate
    from dzdesign.verify.closed_loop.plant import read_plant

    leaky = with_side(example_compensator, u_min0_over_u_max=Fraction(55, 100))
    firmware = generate(leaky, "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    result = verify(tmp_path / "fw", read_plant(example_folder / "plant.toml"), sequence=QUICK)
    failed = {check.name for check in result.evidence.checks if not check.holds}
    assert "no flow at zero command in the closed loop" in failed


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
    from dzdesign.design.option_texts import options_of

    options = options_of({"pressure_span": "5.1 MPa"}, target_named("f28335").inputs())
    firmware = generate(design(example_valve, options), "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    assert verify(tmp_path / "fw", sequence=QUICK).with_checks(regenerated(tmp_path / "fw")).holds
