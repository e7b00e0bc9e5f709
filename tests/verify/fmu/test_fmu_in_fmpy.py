"""The FMUs in FMPy, a tool of somebody else's: valid, with the delay of each kind, and what they refuse."""

import shutil
from math import inf, nan

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

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


@pytest.mark.parametrize(
    ("name", "value"),
    (("m_e_kg", 0.0), ("L_c_H", 1e-9), ("overlap_mm", 3.0), ("K_a", float("nan")), ("preload_N", -1.0)),
)
def test_parameters_that_are_no_plant_end_the_initialization(fmu_folder, name, value):
    call = "Set(Real|Float64)" if value != value else "ExitInitializationMode"
    with pytest.raises(Exception, match=call):
        fmpy.simulate_fmu(str(fmu_folder / "dz_plant.fmu"), fmi_type="CoSimulation", stop_time=0.001,
                          output_interval=STEP_S, start_values={name: value})  # fmt: skip


def test_the_plant_is_held_at_its_stops(fmu_folder):
    time = np.array([0, 0.05, 0.05, 0.15, 0.15, 0.25])
    signal = np.array(
        list(zip(time, [0, 0, 10, 10, 0, 0.0], strict=True)), dtype=[("time", float), ("voltage", float)]
    )
    run = fmpy.simulate_fmu(
        str(fmu_folder / "dz_plant.fmu"), fmi_type="CoSimulation", stop_time=0.25, output_interval=1e-3, input=signal,
        start_values={"stroke_mm": 1.5, "hysteresis_V": 0.0, "supply": 3.0}, output=["x", "at_stop"],
    )  # fmt: skip
    assert set(run["at_stop"]) == {-1, 0, 1} and run["x"].max() == 1.5e-3 and run["x"][-1] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ("dz_compensator", "dz_plant"))
def test_the_sources_compile_again_and_give_the_same(fmu_folder, name, tmp_path):
    if shutil.which("cmake") is None:
        pytest.skip("cmake not found")
    from fmpy.build import build_platform_binary

    source = fmu_folder / f"{name}.fmu"
    folder = tmp_path / "unpacked"
    fmpy.extract(str(source), unzipdir=str(folder))
    shutil.rmtree(folder / "binaries")
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    how = {"stop_time": 0.02, "output_interval": STEP_S, "fmi_type": "CoSimulation"}
    how["start_values"] = {"u_i": 4.0, "p_A": 3.0, "p_B": 1.0} if name == "dz_compensator" else {"compare": 50000}
    output = ["u_O", "compare_a"] if name == "dz_compensator" else ["Q", "x"]
    first, again = (fmpy.simulate_fmu(str(each), output=output, **how) for each in (source, folder))
    assert len(first) > 40
    for each in first.dtype.names:
        assert first[each] == pytest.approx(again[each], rel=1e-9, abs=1e-12)


REFUSED = (FMICallException,)


@pytest.fixture(scope="module", params=("dz_compensator", "dz_plant"))
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def either(fmu_folder, kind):
    return fmu_folder / f"{kind}.fmu"


@pytest.fixture(params=(("dz_compensator", False), ("dz_compensator", True), ("dz_plant", False)))
def interface(fmu_folder, request):
    """Return an FMU, its kind, and whether it is for Model Exchange, which the plant does not offer."""
    kind, model_exchange = request.param
    return fmu_folder / f"{kind}.fmu", kind, model_exchange


@pytest.mark.parametrize(
    ("point", "size"),
    ((0.0, 0.0), (0.0, nan), (nan, STEP_S), (STEP_S, STEP_S)),
)
def test_a_step_that_is_none_is_refused_and_changes_nothing(either, point, size):
    with Importer(either) as one:
        with pytest.raises(REFUSED):
            one.fmu.doStep(point, size)
        one.fmu.doStep(0.0, STEP_S)
        with pytest.raises(REFUSED):
            one.fmu.doStep(0.0, STEP_S)
        one.fmu.doStep(STEP_S * (1 + 1e-9), STEP_S)  # times are rounded


@pytest.mark.parametrize(
    "times",
    (
        {"startTime": nan},
        {"startTime": 1.0, "stopTime": 0.0},
    ),
)
def test_times_that_are_none_are_refused(either, times):
    with Importer(either, begin=False) as one, pytest.raises(REFUSED):
        one.begin(**times)


@pytest.mark.parametrize("value", (nan, -inf))
def test_what_is_no_number_is_no_input(either, kind, value):
    name, output = ("p_A", "u_O") if kind == "dz_compensator" else ("supply", "Q")
    with Importer(either) as one:
        one.fmu.doStep(0.0, STEP_S)
        before = one.real(output)
        with pytest.raises(REFUSED):
            one.give(**{name: value})
        one.fmu.doStep(STEP_S, STEP_S)
        assert one.real(output) == before


@pytest.mark.parametrize("value", (-1, 65536))
def test_an_integer_outside_of_its_range_is_no_input(either, kind, value):
    with Importer(either) as one, pytest.raises(REFUSED):
        one.give_integers(**{"u_i_code" if kind == "dz_compensator" else "compare": value})


def test_before_initialization_nothing_is_computed(interface):
    either, kind, model_exchange = interface
    output, start = ("u_O", "u_i") if kind == "dz_compensator" else ("Q", "supply")
    with Importer(either, model_exchange, begin=False) as one:
        assert one.real(start) == (0.0 if kind == "dz_compensator" else 1.0)
        with pytest.raises(REFUSED):
            one.real(output)
        with pytest.raises(REFUSED):
            one.fmu.enterContinuousTimeMode() if model_exchange else one.fmu.doStep(0.0, STEP_S)
        one.begin()
        one.real(output)


def test_after_the_end_nothing_is_set(interface):
    either, kind, model_exchange = interface
    with Importer(either, model_exchange) as one:
        one.fmu.terminate()
        with pytest.raises(REFUSED):
            one.give(**{"u_i" if kind == "dz_compensator" else "supply": 1.0})
        if not model_exchange:
            with pytest.raises(REFUSED):
                one.fmu.doStep(0.0, STEP_S)


def test_between_events_what_is_discrete_stays(fmu_folder):
    with Importer(fmu_folder / "dz_compensator.fmu", model_exchange=True) as one:
        one.give_integers(u_i_code=1000)
        one.fmu.enterContinuousTimeMode()
        with pytest.raises(REFUSED):
            one.give_integers(u_i_code=2000)


@pytest.mark.parametrize("time", (nan, -1e30))
def test_a_time_that_is_none_is_refused(fmu_folder, time):
    with Importer(fmu_folder / "dz_compensator.fmu", model_exchange=True) as one:
        one.fmu.enterContinuousTimeMode()
        with pytest.raises(REFUSED):
            one.fmu.setTime(time)
