"""Copies of a recording are found by their samples, and two true repeats of a quiet bench are none."""

from collections.abc import Callable

import numpy as np
import pytest

from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.series import find_copy

RATE = 50
#: Steps of a 12-bit converter: 60 L/min, 20 V and 10 MPa.
TWELVE_BITS = {"dq": 60 / 4096, "du": 20 / 4096, "ddp": 10 / 4096}
Columns = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def recorded(
    rng: np.random.Generator,
    *,
    scatter: float = 0.005,
    noise: float = 0.1,
    dq: float = 0.01,
    du: float = 1e-4,
    ddp: float = 1e-3,
    ramps: int = 1,
    seconds: float = 30.0,
) -> Columns:
    """Return time (s), command (V), flow (L/min) and pressure drop (MPa) of ramps to both sides, rounded."""
    up = np.linspace(0, 10, int(seconds * RATE))
    rest = np.zeros(2 * RATE)
    u = np.concatenate([rest, *([up, up[::-1], rest, -up, -up[::-1], rest] * ramps)])
    falling = np.gradient(np.abs(u)) < 0
    beyond = np.maximum(np.abs(u) - (4.0 + rng.normal(0, scatter) - 0.2 * falling), 0)
    q = np.sign(u) * beyond * 7 + noise * rng.normal(size=u.size)
    dp = 2.0 + 0.1 * noise * rng.normal(size=u.size)
    u = u + 0.02 * noise * rng.normal(size=u.size)
    return np.arange(u.size) / RATE, rounded(u, du), rounded(q, dq), rounded(dp, ddp)


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    return np.round(np.round(values / step) * step, 6)


def ramp_test(name: str, columns: Columns) -> RampTest:
    time, u, q, dp = columns
    return RampTest(source=name, sha256=name, time=time, u=u, q=q * L_MIN, dp=dp * MPA)


def every(step: int, start: int = 0) -> Callable[[Columns], Columns]:
    return lambda columns: tuple(column[start::step] for column in columns)


def cut(columns: Columns, start: float = 34.0, end: float = 66.0) -> Columns:
    """Return a falling branch and nothing else, on a clock of its own."""
    inside = (columns[0] > start) & (columns[0] < end)
    time, *rest = (column[inside] for column in columns)
    return (time - time[0], *rest)


def coarser(columns: Columns) -> Columns:
    time, u, q, dp = columns
    return time, rounded(u, 0.01), rounded(q, 0.1), rounded(dp, 0.01)


def other_units(columns: Columns) -> Columns:
    """Return it by way of m3/h with three decimals and psi with one."""
    time, u, q, dp = columns
    return time, u, np.round(q * 0.06, 3) / 0.06, np.round(dp * 145.0377, 1) / 145.0377


def without_spike(columns: Columns) -> Columns:
    time, u, q, dp = (column.copy() for column in columns)
    q[1000] = 99.0
    return time, u, q, dp


COPIES: dict[str, Callable[[Columns], Columns]] = {
    "same": lambda columns: columns,
    "other origin of time": lambda columns: (columns[0] + 1234.5678, *columns[1:]),
    "fewer decimals": coarser,
    "other units": other_units,
    "every 5th row": every(5),
    "every 20th row from the 3rd": every(20, 3),
    "a part": cut,
    "a part, fewer decimals, every 3rd row": lambda columns: every(3)(coarser(cut(columns))),
    "a spike": without_spike,
    "rows lost": lambda columns: tuple(np.delete(column, slice(700, 720)) for column in columns),
}


@pytest.mark.parametrize("bench", [{}, {"noise": 0.0, **TWELVE_BITS}, {"ramps": 3}], ids=["noisy", "quiet", "3 ramps"])
@pytest.mark.parametrize("name", COPIES)
def test_a_copy_is_found_whichever_stands_first(name, bench):
    first = recorded(np.random.default_rng(1), **bench)
    one, other = ramp_test("one", first), ramp_test("other", COPIES[name](first))
    another = ramp_test("another", recorded(np.random.default_rng(2), **bench))
    for tests in ([one, another, other], [other, another, one]):
        found = find_copy(tests)
        assert found is not None and (found.one, found.other) == (0, 2)
        assert found.compared - 1 <= found.agree <= found.compared and found.compared > 40


@pytest.mark.parametrize(
    "bench",
    [
        {"noise": 0.0, **TWELVE_BITS},
        {"noise": 0.3 * 60 / 4096, **TWELVE_BITS},
        {"noise": 0.0, "dq": 0.5, "du": 20 / 4096, "ddp": 0.1},
        {"noise": 0.0, "dq": 0.1, "seconds": 5.0},
        {},
    ],
    ids=["no noise", "a third of a step", "steps of 0.5 L/min", "five seconds", "noisy"],
)
def test_repeats_of_a_bench_of_twelve_bits_are_no_copies(bench):
    """Thresholds scatter by 0.05 % of full command: 60 pairs, none of them taken for copies."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        assert find_copy([ramp_test(str(number), recorded(rng, **bench)) for number in range(3)]) is None, seed


def test_repeats_that_were_written_with_unlike_decimals_are_no_copies():
    quiet = {"noise": 0.0, **TWELVE_BITS}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        tests = [recorded(rng, **quiet), recorded(rng, **{**quiet, "dq": 0.1})]
        assert find_copy([ramp_test(str(number), columns) for number, columns in enumerate(tests)]) is None, seed


def test_a_few_coarse_readings_that_agree_say_nothing():
    """A table of ten levels in steps of 1 L/min: a repeat may well have the same numbers."""
    time, u, q, dp = every(100)(recorded(np.random.default_rng(4), noise=0.0, dq=1.0))
    assert find_copy([ramp_test("one", (time, u, q, dp)), ramp_test("other", (time, u, q, dp))]) is None


def test_a_second_run_of_a_simulation_without_noise_is_no_repeat():
    one, other = (recorded(np.random.default_rng(5), noise=0.0, scatter=0.0) for _ in range(2))
    assert find_copy([ramp_test("one", one), ramp_test("other", other)]) is not None


def test_the_same_ramp_at_another_level_pressure_drop_is_no_copy():
    """A unit or a sign that is wrong in one of two files is for another refusal to say."""
    time, u, q, dp = recorded(np.random.default_rng(6), noise=0.0)
    for other in (-dp, 10 * dp):
        assert find_copy([ramp_test("one", (time, u, q, dp)), ramp_test("other", (time, u, q, other))]) is None
