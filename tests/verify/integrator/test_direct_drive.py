"""The wave about a direct command, of ramps that were recorded under the drive's dither: any other one is seen."""

from dataclasses import replace

import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.dither import Dither
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.verify.closed_loop import loop as native_loop
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.integrator import comparison
from dzdesign.verify.integrator.compiled_calls import compiled_core
from dzdesign.verify.integrator.direct_drive import unlike_direct_values
from dzdesign.verify.integrator.windows import course_of, windows_of
from tests.support.synthetic import needs_compiler
from tests.verify.integrator.test_native_plant import holds, text

pytestmark = [needs_compiler, pytest.mark.slow]
DITHER, SHORT_S = "150 Hz 1 %", 0.1


@pytest.fixture(scope="module")
def dithered(example_valve, tmp_path_factory):
    """A firmware with a dither, of the example's valve as if it had been recorded under it."""
    folder = tmp_path_factory.mktemp("dithered")
    valve = replace(example_valve, dithered=Dither(frequency_Hz=150.0, peak=0.01))
    made = design(valve, options_of({"dither": DITHER}, target_named("f28335").inputs()))
    firmware = generate(made, "f28335")
    write_folder(folder, firmware.files, firmware.manifest)
    return folder, made


@pytest.fixture
def step(dithered, example_folder, monkeypatch):
    """Return the window of the step; its native loop is compiled in little time."""
    monkeypatch.setattr(native_loop, "FLOATING", ("-O0", "-ffp-contract=off"))

    def made():
        folder, compensator = dithered
        windows = windows_of(scenes_of(folder, compensator, read_plant(example_folder / "plant.toml")))
        window = next(each for each in windows if each.kind == "step")
        return replace(window, seconds=SHORT_S), compiled_core(folder, None)

    return made


def unlike(window, library):
    course = course_of(window).by_period()
    run = window.loop.run(course.command, course.supply_MPa, "compensated", periods_per_record=1)
    return unlike_direct_values(window, library, course, run)


def wave(change):
    """Give the native loop another wave: height in counts, periods of half of it, whether the plant has it in it."""

    def fault(monkeypatch):
        right = native_loop.ClosedLoop.wave
        monkeypatch.setattr(native_loop.ClosedLoop, "wave", lambda loop: change(*right(loop)))

    return fault


FAULTS = {
    "half the height": wave(lambda counts, ticks, known: (counts // 2, ticks, known)),
    "another period": wave(lambda counts, ticks, known: (counts, ticks + 1, known)),
    "none": wave(lambda *_: (0, 1, False)),
    "another phase": text("loop.c", "k * task->every + j, plant->counts", "k * task->every + j + 1, plant->counts"),
    "one at zero command": text("loop.c", "(direct == 0) || (task->wave == 0)", "task->wave == 0"),
    "past the PWM's range": text("loop.c", "((compare > counts) ? counts : compare)", "compare"),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_another_wave_is_seen(fault, step, monkeypatch):
    """Seeded: with none at all the plant was within 1e-5 as before, for the compensated drive alone was compared."""
    fault(monkeypatch)
    assert unlike(*step()) > 0


def test_that_of_the_drive_holds_and_the_requirement_notices_none(step, monkeypatch):
    window, library = step()
    assert window.loop.has_dither and holds(comparison.compare(window, library))
    FAULTS["none"](monkeypatch)
    assert holds(comparison.compare(window, library)) is False
