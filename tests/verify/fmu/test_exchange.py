"""Model Exchange of FMUs against the exact models: right ones hold, and each seeded fault is found."""

from dataclasses import asdict

import pytest

from dzdesign.verify.fmu import exchange
from dzdesign.verify.fmu.exchange import compensator_exchange_check, plant_exchange_check, starts_check
from tests.support.host_fmus import PLANT, edited


@pytest.fixture(autouse=True)
def fewer_samples(monkeypatch):
    """Run fewer samples than `verify` does."""
    monkeypatch.setattr(exchange, "SAMPLES", 300)
    monkeypatch.setattr(exchange, "STATES", 60)


def test_right_ones_hold(fmu, plant_fmu, compensator):
    for each in (fmu, plant_fmu):
        found = starts_check(each, each.binary_here())
        assert found.holds is True, found
    found = compensator_exchange_check(fmu, fmu.binary_here(), compensator)
    assert found.holds is True, found
    found = plant_exchange_check(plant_fmu, plant_fmu.binary_here(), asdict(PLANT), compensator)
    assert found.holds is True, found


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ("* (10.0 / 60000.0);", "* (10.0 / 65535.0);"),
        ("* (10.0 / 60000.0);", "* (-10.0 / 60000.0);"),
        ("model->time + 2.0 * DUE_EARLY / TICK_HZ", "model->time - 2.0 * DUE_EARLY / TICK_HZ"),
        ("*time = next_tick(model);", "*time = next_tick(model) + 0.5 / TICK_HZ;"),
        ("model_outputs(&one->model, one->phase != CONTINUOUS);", "model_outputs(&one->model, 0);"),
    ),
    ids=("scale", "sign", "late", "next event", "discrete"),
)
def test_a_wrong_compensator_is_found(fmu, compensator, old, new):
    assert compensator_exchange_check(fmu, edited(fmu, "dz_fmu.c", old, new), compensator).holds is False


@pytest.mark.parametrize(
    ("old", "new"),
    (
        ("coil_rate(model) * (settled", "1.001 * coil_rate(model) * (settled"),
        ("value[V_DER_V] = (model->stop == 0) ?", "value[V_DER_V] = 1 ?"),
        ("- value[V_B_E_N_S_M] * value[V_V])", "+ value[V_B_E_N_S_M] * value[V_V])"),
        ("value[V_P_AHEAD] = value[V_BACK_PRESSURE] + value[V_DP];", "value[V_P_AHEAD] = value[V_DP];"),
        ("value[V_DP] = drop_MPa(model, conducted);", "value[V_DP] = value[V_SUPPLY];"),
        ("(model->stop < 0) ? pull_N(model) :", "(model->stop < 0) ? 1.0 :"),
        ("(int)-away : 0", "0 : 0"),
        ("            value[V_V] = 0.0;\n", "            value[V_V] = -speed;\n"),
        ("indicators[2] = x -", "indicators[2] = -x +"),
        ("    model->played_A = smaller(larger(model->played_A, current", "    (void)smaller(larger(0.0, current"),
        ("return (before != value[V_X]) || (speed != value[V_V]);", "return 0;"),
    ),
    ids=("coil", "held", "damping", "pressure", "droop", "lets go", "stop", "bounce", "edge", "play", "changed"),
)
def test_a_wrong_plant_is_found(plant_fmu, compensator, old, new):
    wrong = edited(plant_fmu, "dz_fmu.c", old, new)
    assert plant_exchange_check(plant_fmu, wrong, asdict(PLANT), compensator).holds is False


def test_another_first_value_is_found(fmu, plant_fmu):
    assert starts_check(fmu, edited(fmu, "dz_fmu.c", "ALWAYS, 0.0,", "ALWAYS, 1.0,")).holds is False
    slow = edited(plant_fmu, "dz_fmu.c", "BEFORE_START, 0.04,", "BEFORE_START, 0.05,")
    assert starts_check(plant_fmu, slow).holds is False
