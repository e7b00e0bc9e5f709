"""Current control through `design` and `codegen`: options, compensator.json, the projects for host and cortex-m4."""

import subprocess
from dataclasses import replace
from math import ceil, log

import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.verify.toolchain.machines import CORTEX_M4
from tests.codegen.test_goldens import host_selftest
from tests.support.designs import CURRENT, MEASURED, designed, options
from tests.support.example_coil import COIL, SENSORS, example_loop
from tests.support.synthetic import needs_compiler


@pytest.fixture(scope="module", params=SENSORS)
def controlled(request, example_valve) -> Compensator:
    """The example's compensator with current control, without and with the supply measured."""
    return designed(example_valve, "cortex-m4", **(CURRENT if request.param == "supply unknown" else MEASURED))


def test_the_words_are_the_declared_coil():
    plain, measured = (options(**texts).current for texts in (CURRENT, MEASURED))
    assert plain.circuit == COIL == measured.circuit
    assert [plain.sensor, measured.sensor] == list(SENSORS.values())
    ranged = options(**CURRENT | {"coil": "2 + 0.3 ohm x 0.8..1.2, 0.01 H x 0.6..1.1"}).current.circuit
    assert (ranged.resistance_ohm, ranged.series_ohm, ranged.inductance_H) == (2.0, 0.3, 0.01)
    assert (ranged.resistance_factors, ranged.inductance_factors) == ((0.8, 1.2), (0.6, 1.1))


def test_without_a_word_the_drive_is_by_duty(example_compensator):
    assert options().current is None and example_compensator.current_drive is None
    assert not [path for path in generate(example_compensator, "f28335").files if "dz_current" in path]


BOTH = {"command_signal": "-10..10 V x 0.15 + 1.5 V"}
EACH = {"current_signal": f"{CURRENT['current_signal']} each"}


@pytest.mark.parametrize("texts", [BOTH, BOTH | EACH], ids=["one shunt", "two shunts"])
def test_a_command_of_both_signs_has_two_solenoids(texts):
    """The loop is that of one solenoid, with the same margins: one solenoid at a time is driven."""
    one, two = options(**CURRENT).current_drive(), options(**CURRENT | texts).current_drive()
    assert (one.loop.two, two.loop.two, two.loop.shunts) == (False, True, 1 + (texts != BOTH))
    assert replace(two, loop=one.loop) == one
    assert replace(two.loop, held_ticks=0, shunts=1) == one.loop and two.loop.held_ticks == two.rest_ticks
    assert two.decayed_A == pytest.approx(0.02)
    # The longest time constant, from 1.2 times the rated current to a fiftieth of it: the diode brakes.
    tau, diode_A = 0.04 * 1.5 / (3.5 * 0.75 + 0.5), 0.7 / (3.5 * 0.75 + 0.5)
    assert two.change_s == pytest.approx(tau * log((1.2 + diode_A) / (0.02 + diode_A)) + 5 / 2500)


def test_a_shunt_for_each_of_one_solenoid_is_refused():
    with pytest.raises(InputError, match="each"):
        options(**CURRENT | EACH)


def test_compensator_json_keeps_the_drive(controlled):
    assert read_artefact(to_json_bytes(controlled), Compensator, "compensator.json") == controlled
    name = "supply unknown" if controlled.current_drive.loop.supply is None else "supply measured"
    assert controlled.current_drive.loop == example_loop(name)
    assert controlled.current_drive.phase_margin_deg >= 45 and controlled.current_drive.overshoot <= 0.1


def test_the_law_of_the_recording_is_the_same_with_either_drive(controlled, example_valve):
    """A controlled current has an error, and so a machine: the law differs by that alone."""
    alike = dict(current_drive=None, options=None, target=None, costs=())
    of_recording = design(example_valve, replace(options("cortex-m4", **CURRENT), machine=None))
    assert replace(of_recording, **alike) == replace(designed(example_valve, "cortex-m4"), **alike)
    assert controlled.machine.drive == "current" and controlled.positive.beta < of_recording.positive.beta


@needs_compiler
@pytest.mark.parametrize(
    "target",
    [
        "host",
        pytest.param("cortex-m4", marks=pytest.mark.skipif(bool(CORTEX_M4.missing()), reason=CORTEX_M4.missing())),
    ],
)
def test_the_project_builds_without_a_warning_and_its_selftest_holds(controlled, target, tmp_path):
    """On the Cortex-M4 real interrupts must write what dz_current_tick() gives, from the offset's calibration on."""
    firmware = generate(controlled, target)
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    folder = tmp_path / "fw" / target.replace("-", "_")
    if target == "host":
        assert len(host_selftest(folder, "cc")) == 3
        return
    command = ["make", "-C", str(folder), "check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    printed = done.stdout + done.stderr
    assert done.returncode == 0, printed
    assert "warning" not in printed
    assert "197 interrupts, compare values of dz_current_tick()" in printed


def test_a_target_without_current_control_is_refused(controlled):
    without = replace(target_named("host"), current_sampling=None)
    with pytest.raises(InputError, match="--drive"):
        options_of(CURRENT, without.inputs())
    with pytest.raises(InputError, match="--drive"):
        without.check_current_control(controlled.current_drive.sampling)


def test_a_target_that_samples_at_other_times_is_refused(controlled):
    """The loop's delays and the sum of the codes are those of the target that it was designed for."""
    with pytest.raises(InputError, match="16 samples"):
        generate(replace(controlled, target=None, options=None), "f28335")


@pytest.mark.parametrize("target", ["f28335", "f280049c"])
@pytest.mark.parametrize("texts", [CURRENT, MEASURED], ids=SENSORS)
def test_the_c2000_targets_control_the_current_with_their_own_sampling(example_valve, target, texts):
    made = designed(example_valve, target, **texts)
    drive, ours = made.current_drive, target_named(target).current_sampling
    assert (drive.sampling, drive.loop.samples) == (ours, ours.samples) and (ours.samples, ours.before) == (8, 7)
    assert drive.phase_margin_deg >= 45 and drive.overshoot <= 0.1
    assert read_artefact(to_json_bytes(made), Compensator, "compensator.json") == made
    files = generate(made, target).files
    assert f"DZ_CURRENT_SAMPLES {ours.samples}u" in files["core/dz_calibration.h"]
    assert f"DZ_CURRENT_REST_TICKS {drive.rest_ticks}u" in files[f"{target}/dz_hardware.h"]
    for name in (f"{target}/dzdesign.projectspec", f"{target}/Makefile"):
        assert "dz_current.c" in files[name] and "dz_current.h" in files[name]
    # A library on a PC takes the loop of any target.
    assert f"DZ_CURRENT_SAMPLES {ours.samples}u" in generate(made, "host").files["core/dz_calibration.h"]


def test_the_current_has_died_away_when_its_offset_is_taken(controlled):
    """From the current of a short to nothing, at the largest L/R: the diode's voltage ends it in finite time."""
    drive = controlled.current_drive
    ohm, henry, current, diode = 3.5 * 0.75 + 0.5, 0.04 * 1.5, 1.45 * 1.0, 0.7
    seconds = henry / ohm * log(1 + current * ohm / diode)
    assert drive.rest_ticks == ceil(seconds * 2500) == 97
