"""Recordings as benches give them: the knees stay where the valve's are, whatever the logger did to the samples."""

import dataclasses

import numpy as np
import pytest

from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.command import lagged_command
from dzdesign.identify.reading.ramp_files import ramp_file_bytes, read_ramp_file
from dzdesign.identify.reading.ramp_test import RampTest
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

RATE_HZ = 50
KNEES = (5.4, 5.3)


def clean(seed=1, **keywords) -> RampTest:
    return synthetic_ramp(1.0, Truth(**keywords), seed=seed, rate_Hz=RATE_HZ, ramp_s=60)


def changed(test: RampTest, **columns) -> RampTest:
    return dataclasses.replace(test, **columns)


def with_holds(test: RampTest, before_s=5.0, top_s=3.0, after_s=8.0) -> RampTest:
    """Hold at zero, at full command and at zero again."""
    top = test.u.size // 2
    index = np.concatenate(
        [
            np.zeros(int(before_s * RATE_HZ), dtype=int),
            np.arange(top),
            np.full(int(top_s * RATE_HZ), top),
            np.arange(top, test.u.size),
            np.full(int(after_s * RATE_HZ), test.u.size - 1),
        ]
    )
    noise = np.random.default_rng(5).normal(0, 0.08 * L_MIN, index.size)
    held = np.concatenate([[False], np.diff(index) == 0])
    q = np.where(held, np.where(test.u[index] > 5, 18.4 * L_MIN, 0) + noise, test.q[index])
    return changed(test, time=np.arange(index.size) / RATE_HZ, u=test.u[index], q=q, dp=test.dp[index])


def jittered(test: RampTest) -> RampTest:
    """Sample at uneven times: the clock says so, and the command is where it is at that time."""
    time = np.sort(test.time + np.random.default_rng(2).uniform(-0.4, 0.4, test.time.size) / RATE_HZ)
    return changed(test, **{name: np.interp(time, test.time, getattr(test, name)) for name in ("u", "q")}, time=time)


def with_lost_rows(test: RampTest) -> RampTest:
    """Lose one row in twenty, and half a second now and then."""
    rng = np.random.default_rng(3)
    kept = rng.random(test.u.size) > 0.05
    for start in rng.integers(0, test.u.size - 25, 8):
        kept[start : start + 25] = False
    return changed(test, **{name: getattr(test, name)[kept].copy() for name in ("time", "u", "q", "dp")})


def spiked(name: str, low: float, high: float):
    """Return a function that puts single spikes in a column."""

    def spike(test: RampTest) -> RampTest:
        rng = np.random.default_rng(4)
        values = getattr(test, name).copy()
        hit = rng.choice(values.size // 3, values.size // 300, replace=False) * 3
        values[hit] = rng.choice([low, high], hit.size)
        return changed(test, **{name: values})

    return spike


def of_12_bit(test: RampTest) -> RampTest:
    """Convert every column in 4096 steps of a bipolar span."""

    def convert(values, span):
        return np.round(values / (2 * span / 4096)) * (2 * span / 4096)

    return changed(test, u=convert(test.u, 10), q=convert(test.q, 60 * L_MIN), dp=convert(test.dp, 10e6))


def staircase(test: RampTest) -> RampTest:
    """Step the command by 0.1 V and hold it; the flow follows with a lag of 50 ms."""
    up = np.repeat(np.linspace(0, 10, 101), 60)
    u = np.concatenate([up, up[::-1]])
    knee = np.where(np.arange(u.size) < up.size, *KNEES)
    still = np.clip(4 * (u - knee), 0, None)
    q = np.empty_like(still)
    value = 0.0
    for index, target in enumerate(still):
        value += (target - value) * (1 - np.exp(-1 / (0.05 * RATE_HZ)))
        q[index] = value
    q += np.random.default_rng(6).normal(0, 0.08, u.size)
    return changed(test, time=np.arange(u.size) / RATE_HZ, u=u, q=q * L_MIN, dp=np.full(u.size, 1e6))


def filling(test: RampTest, after_s=8.0) -> RampTest:
    """Let hoses and meter fill before the command moves: 8 L/min, dying away with 1 s."""
    held = with_holds(test, after_s=after_s)
    surge = np.where(held.time < 5, 8 * np.exp(-held.time / 1.0), 0) * L_MIN
    return changed(held, q=held.q + surge)


DIRT = {
    "jittered clock": jittered,
    "lost rows": with_lost_rows,
    "spikes of flow": spiked("q", 0.0, 80 * L_MIN),
    "spikes of command": spiked("u", -3.0, 13.0),
    "spikes of pressure": spiked("dp", 1e4, 2e7),
    "12 bit": of_12_bit,
    "holds": with_holds,
    "staircase": staircase,
    "fill transient": filling,
    "fill transient without a hold after": lambda test: filling(test, after_s=0),
    "all at once": lambda test: of_12_bit(spiked("q", 0.0, 80 * L_MIN)(with_lost_rows(jittered(filling(test))))),
}


@pytest.mark.parametrize("name", DIRT)
def test_the_knees_are_those_of_the_valve(name):
    valve = identify([DIRT[name](clean())])
    (test,) = valve.positive.tests
    found = test.u_knee_rising_V, test.u_knee_falling_V
    assert found == pytest.approx(KNEES, abs=max(4.5 * test.u_knee_se_V, 0.012))
    assert test.q_max_L_min == pytest.approx(18.6, rel=0.02)  # 18.4 rising, 18.8 falling
    assert valve.positive.curve.u_min0_V < KNEES[1]
    assert valve.positive.curve.u_min0_V > KNEES[1] - (0.35 if name == "staircase" else 0.15)
    assert "meter-zero" not in {warning.code for warning in valve.warnings}


def test_a_zero_error_is_found_behind_a_fill_transient(wording):
    test = filling(clean())
    valve = identify([changed(test, q=test.q + 0.4 * L_MIN)])
    (warning,) = [warning for warning in valve.warnings if warning.code == "meter-zero"]
    wording.of_test(warning.text)
    assert valve.positive.tests[0].u_knee_rising_V == pytest.approx(5.4, abs=0.02)


@pytest.mark.parametrize("stamp_s", [0.1, 1.0])
def test_stamps_that_repeat_and_a_lag(stamp_s):
    test = with_holds(clean(noise=0.02))
    late = changed(test, q=np.interp(test.time - 0.5, test.time, test.q))
    coarse = changed(late, time=np.floor(late.time / stamp_s + 1e-9) * stamp_s)
    exact, found = (identify([each], IdentifyOptions(meter_lag=0.5)).positive.tests[0] for each in (late, coarse))
    assert found.u_knee_rising_V == pytest.approx(exact.u_knee_rising_V, abs=1e-3)
    assert found.u_knee_falling_V == pytest.approx(exact.u_knee_falling_V, abs=1e-3)


def test_stamps_are_not_spread_over_lost_rows():
    time = np.array([0.0, 0.0, 1.0, 1.0, 9.0, 9.0, 10.0, 10.0])
    u = np.array([0.0, 0.5, 1.0, 1.5, 9.0, 9.5, 10.0, 10.5])
    np.testing.assert_allclose(lagged_command(time, u, 0.5), [0, 0, 0.5, 1.0, 8.5, 9.0, 9.5, 10.0], atol=0.01)


def test_flow_of_a_command_that_was_not_recorded_is_left_out():
    # A recording that starts in the middle of the ramp: the first readings belong to commands before it.
    test = clean(noise=0.02)
    late = changed(test, q=np.interp(test.time - 2.0, test.time, test.q))
    start = int(0.34 * test.u.size)
    part = changed(late, **{name: getattr(late, name)[start:].copy() for name in ("time", "u", "q", "dp")})
    found = identify([part], IdentifyOptions(meter_lag=2.0)).positive.tests[0]
    assert found.u_knee_falling_V == pytest.approx(5.3, abs=0.01)


@pytest.fixture
def written(tmp_path):
    def written(test: RampTest, spoil=lambda lines: lines):
        columns = {"time_s": test.time, "u_V": test.u, "dP_MPa": test.dp / 1e6, "Q_Lmin": test.q / L_MIN}
        lines = ramp_file_bytes(columns, (), compress=False).decode().splitlines()
        path = tmp_path / "ramp.csv"
        path.write_text("\n".join(spoil(lines)))
        return path

    return written


def test_blank_cells_and_a_clock_that_jitters_back(written):
    test = clean()
    rng = np.random.default_rng(9)
    shaken = changed(test, time=test.time + rng.uniform(-0.6, 0.6, test.time.size) / RATE_HZ)
    assert np.any(np.diff(shaken.time) < 0)

    def blank(lines):
        rows = [line.split(",") for line in lines]
        for row in rng.choice(np.arange(1, len(rows)), len(rows) // 10):
            rows[row][rng.integers(4)] = ""
        return [",".join(row) for row in rows]

    read = read_ramp_file(written(shaken, blank))
    assert np.all(np.diff(read.time) >= 0) and read.u.size < test.u.size
    (found,) = identify([read], IdentifyOptions(meter_lag=0.001)).positive.tests
    assert (found.u_knee_rising_V, found.u_knee_falling_V) == pytest.approx(KNEES, abs=0.012)
