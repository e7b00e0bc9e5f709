"""Recordings of many rows: thinned without moving a knee; a fault far down is found in its row."""

import tracemalloc

import numpy as np
import pytest

from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading import ramp_test
from dzdesign.identify.reading.ramp_files import ramp_file_bytes, read_ramp_file
from dzdesign.identify.reading.ramp_test import RampTest, thin
from tests.identify.reading.test_dirty_recordings import changed, jittered, spiked, staircase
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

LIMIT = 21_000


def long_ramp(**keywords) -> RampTest:
    return synthetic_ramp(1.0, Truth(**keywords), rate_Hz=1000.0, ramp_s=80)


def thinned(test: RampTest) -> RampTest:
    left = thin(np.stack([test.time, test.u, test.q, test.dp]))
    assert left.rows.shape[1] <= LIMIT and left.run == 9
    time, u, q, dp = (column.copy() for column in left.rows)
    return changed(test, time=time, u=u, q=q, dp=dp, run=left.run, rows_read=test.u.size)


def some(test: RampTest, name: str, share: float, values) -> RampTest:
    column = getattr(test, name).copy()
    hit = np.random.default_rng(4).choice(column.size, int(share * column.size), replace=False)
    column[hit] = np.random.default_rng(5).choice(values, hit.size)
    return changed(test, **{name: column})


def with_true_floor(test: RampTest) -> RampTest:
    """Read zero where the flow with its noise is below 1.2 L/min: near there, zeros and readings alternate."""
    return changed(test, q=np.where(test.q < 1.2 * L_MIN, 0.0, test.q))


def stamped(test: RampTest) -> RampTest:
    return changed(test, time=np.floor(test.time * 10) / 10, q=np.interp(test.time - 0.5, test.time, test.q))


CASES = {
    "plain": long_ramp,
    "spikes of flow": lambda: some(long_ramp(), "q", 0.01, [0.0, 80 * L_MIN]),
    "spikes of pressure": lambda: some(long_ramp(), "dp", 0.01, [1e4, 2e7]),
    "spikes of command": lambda: spiked("u", -3.0, 13.0)(long_ramp()),
    "floor before the noise": lambda: long_ramp(floor=1.2),
    "floor behind the noise": lambda: with_true_floor(long_ramp()),
    "floor and spikes": lambda: some(with_true_floor(long_ramp()), "q", 0.01, [0.0, 80 * L_MIN]),
    "jittered clock": lambda: jittered(long_ramp()),
    "stamps of 0.1 s and a lag": lambda: stamped(long_ramp()),
    "sag": lambda: long_ramp(sag=0.2),
    "coarse flow": lambda: (lambda test: changed(test, q=np.round(test.q / L_MIN / 0.1) * 0.1 * L_MIN))(long_ramp()),
}


WITHOUT_SPIKES = {name: long_ramp for name in CASES if name.startswith("spikes")}
WITHOUT_SPIKES["floor and spikes"] = CASES["floor behind the noise"]


@pytest.mark.parametrize("name", CASES)
def test_thinning_moves_no_knee(name, monkeypatch, wording):
    monkeypatch.setattr(ramp_test, "MOST_ROWS", LIMIT)
    test = CASES[name]()
    options = IdentifyOptions(meter_lag=0.5 if "lag" in name else 0.0)
    # Spikes leave no trace, so what is to be found is what the same recording gives without them.
    (full,) = identify([WITHOUT_SPIKES.get(name, CASES[name])()], options).positive.tests
    few = identify([thinned(test)], options)
    (found,) = few.positive.tests
    for branch in ("u_knee_rising_V", "u_knee_falling_V"):
        errors = np.hypot(full.u_knee_se_V, found.u_knee_se_V)  # of two lines, of which one has a ninth of the samples
        assert abs(getattr(found, branch) - getattr(full, branch)) < max(errors, 1e-4), branch
    assert 0.5 * full.u_knee_se_V < found.u_knee_se_V < 2 * full.u_knee_se_V
    assert found.q_max_L_min == pytest.approx(full.q_max_L_min, rel=2e-3)
    (warning,) = [warning for warning in few.warnings if warning.code == "thinned"]
    assert warning.source == test.source
    wording("long recordings: thinned", warning.text)


def test_a_staircase_keeps_its_levels(monkeypatch):
    monkeypatch.setattr(ramp_test, "MOST_ROWS", 2_000)
    test = staircase(long_ramp())  # 60 rows a level
    left = thin(np.stack([test.time, test.u, test.q, test.dp]))
    u = left.rows[1]
    assert left.run == 7 and np.abs(u - np.round(u, 1)).max() < 1e-12
    assert np.unique(np.round(u, 1)).size == 101


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_no_flow_between_zero_and_the_floor_is_made_up(noise, monkeypatch):
    monkeypatch.setattr(ramp_test, "MOST_ROWS", LIMIT)
    test = thinned(with_true_floor(long_ramp(noise=noise)))
    between = (test.q > 1e-3 * L_MIN) & (test.q < (1.2 - 1e-9) * L_MIN)
    assert not between.any() and (test.q == 0).any()


def test_means_of_all_rows_would_make_one_up(monkeypatch):
    """The check above, checked."""
    monkeypatch.setattr(ramp_test, "MOST_ROWS", LIMIT)
    monkeypatch.setattr(np, "partition", lambda runs, *_, axis: np.repeat(runs.mean(axis, keepdims=True), 9, axis))
    test = thinned(with_true_floor(long_ramp(noise=0.02)))
    assert np.any((test.q > 1e-3 * L_MIN) & (test.q < (1.2 - 1e-9) * L_MIN))


def test_a_sweep_faster_than_its_runs_is_not_smeared(monkeypatch):
    monkeypatch.setattr(ramp_test, "MOST_ROWS", 500)
    up = np.linspace(0, 10, 1000)
    u = np.tile(np.concatenate([up, up[::-1]]), 8)
    left = thin(np.stack([np.arange(u.size) / 100, u, u**3, np.full(u.size, 1e6)]))
    rows = left.rows
    assert rows.shape[1] <= 500 and left.run == 33
    np.testing.assert_allclose(rows[2], rows[1] ** 3, rtol=1e-4, atol=1e-5)  # on the curve, not on a chord of it


def test_below_the_limit_nothing_is_touched(monkeypatch):
    test = long_ramp()
    rows = np.stack([test.time, test.u, test.q, test.dp])
    left = thin(rows)
    np.testing.assert_array_equal(left.rows, rows)
    assert left.run == 1


def test_parts_that_are_thinned_one_after_the_other_make_no_difference(monkeypatch):
    monkeypatch.setattr(ramp_test, "MOST_ROWS", LIMIT)
    test = CASES["floor and spikes"]()
    rows = np.stack([test.time, test.u, test.q, test.dp])[:, :-5]
    at_once = thin(rows)
    monkeypatch.setattr(ramp_test, "PART", 77)
    np.testing.assert_array_equal(thin(rows).rows, at_once.rows)


def test_memory_is_a_few_times_the_file(tmp_path):
    """Of what Python and NumPy take; `benchmarks/identify/reading.py` measures the whole process."""
    test = long_ramp()
    columns = {"time_s": test.time, "u_V": test.u, "Q_Lmin": test.q / L_MIN, "dP_MPa": test.dp / 1e6}
    content = ramp_file_bytes(columns, (), compress=False)
    (tmp_path / "a.csv").write_bytes(content)
    read_ramp_file(tmp_path / "a.csv")  # what is imported stays
    tracemalloc.start()
    read_ramp_file(tmp_path / "a.csv")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5 * len(content)
