"""What an FMU refuses: calls at the wrong time, steps that are none, and what is no number."""

from math import inf, nan

import pytest
from fmpy.fmi1 import FMICallException

from tests.support.fmu_importer import Importer

STEP_S = 1 / 2500
REFUSED = (FMICallException,)


@pytest.fixture(scope="module", params=("dz_compensator", "dz_plant"))
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def path(fmu_folder, kind):
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
def test_a_step_that_is_none_is_refused_and_changes_nothing(path, point, size):
    with Importer(path) as one:
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
def test_times_that_are_none_are_refused(path, times):
    with Importer(path, begin=False) as one, pytest.raises(REFUSED):
        one.begin(**times)


@pytest.mark.parametrize("value", (nan, -inf))
def test_what_is_no_number_is_no_input(path, kind, value):
    name, output = ("p_A", "u_O") if kind == "dz_compensator" else ("supply", "Q")
    with Importer(path) as one:
        one.fmu.doStep(0.0, STEP_S)
        before = one.real(output)
        with pytest.raises(REFUSED):
            one.give(**{name: value})
        one.fmu.doStep(STEP_S, STEP_S)
        assert one.real(output) == before


@pytest.mark.parametrize("value", (-1, 65536))
def test_an_integer_outside_of_its_range_is_no_input(path, kind, value):
    with Importer(path) as one, pytest.raises(REFUSED):
        one.give_integers(**{"u_i_code" if kind == "dz_compensator" else "compare": value})


def test_before_initialization_nothing_is_computed(interface):
    path, kind, model_exchange = interface
    output, start = ("u_O", "u_i") if kind == "dz_compensator" else ("Q", "supply")
    with Importer(path, model_exchange, begin=False) as one:
        assert one.real(start) == (0.0 if kind == "dz_compensator" else 1.0)
        with pytest.raises(REFUSED):
            one.real(output)
        with pytest.raises(REFUSED):
            one.fmu.enterContinuousTimeMode() if model_exchange else one.fmu.doStep(0.0, STEP_S)
        one.begin()
        one.real(output)


def test_after_the_end_nothing_is_set(interface):
    path, kind, model_exchange = interface
    with Importer(path, model_exchange) as one:
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
