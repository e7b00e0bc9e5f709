"""The FMUs in FMPy, a tool of somebody else's: valid, with the delay that each kind is said to have, and sources."""

import shutil

import fmpy
import pytest

from tests.support.fmu_importer import Importer

ZERO, FULL_V, STEP_S = 0.0, 10.0, 1 / 2500


@pytest.fixture(scope="module")
def path(fmu_folder):
    return fmu_folder / "dz_compensator.fmu"


def test_co_simulation_shows_an_input_after_the_step_that_it_was_given_for(path):
    with Importer(path) as one:
        before = one.integer("compare"), one.real("u_O")
        one.give(u_i=FULL_V, p_A=3.0, p_B=1.0)
        assert (one.integer("compare"), one.real("u_O")) == before
        one.fmu.doStep(0.0, STEP_S)
        after = one.integer("compare"), one.real("u_O")
        assert after[0] > before[0] and after[1] > before[1]
        one.give(u_i=ZERO)
        one.fmu.doStep(STEP_S, STEP_S)
        assert one.integer("compare") < after[0]


def test_model_exchange_shows_an_input_at_once(path):
    with Importer(path, model_exchange=True) as one:
        one.give(u_i=ZERO, p_A=3.0, p_B=1.0)
        before = one.integer("compare"), one.real("u_O")
        one.give(u_i=FULL_V)
        assert one.integer("compare") > before[0] and one.real("u_O") > before[1]
        one.fmu.enterContinuousTimeMode()
        full = one.integer("compare")
        one.give(u_i=ZERO)  # between events what is continuous follows, and what is discrete waits
        assert one.real("u_O") == before[1] and one.integer("compare") == full
        one.fmu.enterEventMode()
        assert one.integer("compare") == before[0]


@pytest.mark.slow
def test_the_sources_compile_again_and_give_the_same(path, tmp_path):
    if shutil.which("cmake") is None:
        pytest.skip("cmake not found")
    from fmpy.build import build_platform_binary

    folder = tmp_path / "unpacked"
    fmpy.extract(str(path), unzipdir=str(folder))
    shutil.rmtree(folder / "binaries")
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    how = {
        "stop_time": 0.02, "output_interval": STEP_S, "fmi_type": "CoSimulation",
        "start_values": {"u_i": 4.0, "p_A": 3.0, "p_B": 1.0}, "output": ["u_O", "compare_a"],
    }  # fmt: skip
    first, again = (fmpy.simulate_fmu(str(each), **how) for each in (path, folder))
    assert len(first) > 40
    for each in first.dtype.names:
        assert first[each] == pytest.approx(again[each], rel=1e-9, abs=1e-12)
