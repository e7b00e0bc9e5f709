"""What an FMU refuses: calls at the wrong time, steps that are none, and what is no number."""

from math import inf, nan

import pytest
from fmpy.fmi1 import FMICallException

from tests.support.fmu_importer import Importer

STEP_S = 1 / 2500
REFUSED = (FMICallException,)


@pytest.fixture(scope="module")
def path(fmu_folder):
    return fmu_folder / "dz_compensator.fmu"


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
def test_what_is_no_number_is_no_input(path, value):
    with Importer(path) as one:
        one.fmu.doStep(0.0, STEP_S)
        before = one.real("u_O")
        with pytest.raises(REFUSED):
            one.give(p_A=value)
        one.fmu.doStep(STEP_S, STEP_S)
        assert one.real("u_O") == before


@pytest.mark.parametrize("value", (-1, 65536))
def test_an_integer_outside_of_its_range_is_no_input(path, value):
    with Importer(path) as one, pytest.raises(REFUSED):
        one.give_integers(u_i_code=value)


@pytest.mark.parametrize("model_exchange", (False, True))
def test_before_initialization_nothing_is_computed(path, model_exchange):
    with Importer(path, model_exchange, begin=False) as one:
        assert one.real("u_i") == 0.0
        with pytest.raises(REFUSED):
            one.real("u_O")
        with pytest.raises(REFUSED):
            one.fmu.enterContinuousTimeMode() if model_exchange else one.fmu.doStep(0.0, STEP_S)
        one.begin()
        one.real("u_O")


@pytest.mark.parametrize("model_exchange", (False, True))
def test_after_the_end_nothing_is_set(path, model_exchange):
    with Importer(path, model_exchange) as one:
        one.fmu.terminate()
        with pytest.raises(REFUSED):
            one.give(u_i=1.0)
        if not model_exchange:
            with pytest.raises(REFUSED):
                one.fmu.doStep(0.0, STEP_S)


def test_between_events_what_is_discrete_stays(path):
    with Importer(path, model_exchange=True) as one:
        one.give_integers(u_i_code=1000)
        one.fmu.enterContinuousTimeMode()
        with pytest.raises(REFUSED):
            one.give_integers(u_i_code=2000)


@pytest.mark.parametrize("time", (nan, -1e30))
def test_a_time_that_is_none_is_refused(path, time):
    with Importer(path, model_exchange=True) as one:
        one.fmu.enterContinuousTimeMode()
        with pytest.raises(REFUSED):
            one.fmu.setTime(time)
