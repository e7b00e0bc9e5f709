"""The plant that judges the product: it shares no code with it, and does what it says."""

import ast
from pathlib import Path

import bench_plant
import numpy as np
import pytest
from bench_plant import commanded, duration, hold, lagged, ramp, staircase, that_sticks, with_play

FOLDER = Path(bench_plant.__file__).parent
#: What makes recordings, and what it may take of the product: the container in which it hands them over.
PLANTS = {"bench_plant.py": set()}
PLANTS |= {f"recordings/{name}.py": set() for name in ("bench_loggers", "corpus_plant", "four_port_plant")}
CONTAINER = {"dzdesign.identify.reading.ramp_test"}
PLANTS |= {"recorded_ramps.py": CONTAINER, "series_bench.py": CONTAINER, "bench_model.py": CONTAINER}


def of_the_product(text: str) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return {name for name in found if name.split(".")[0] == "dzdesign"}


@pytest.mark.parametrize("name", PLANTS)
def test_plants_share_no_code_with_the_product(name):
    text = (FOLDER / name).read_text(encoding="utf-8")
    assert of_the_product(text) == PLANTS[name]
    seeded = text + "\n\ndef seeded():\n    from dzdesign.identify.ramps import splitting\n"
    assert of_the_product(seeded) != PLANTS[name]


def test_command_passes_through_its_segments():
    command = (*ramp(10.0, before=2.0, at_top=1.0, after=3.0), hold(1.0, 2.5))
    time, u = commanded(command, 100.0)
    assert duration(command) == pytest.approx(27.0) and time.size == 2700
    at = dict(zip(np.round(time, 2).tolist(), u.tolist(), strict=True))
    found = [at[when] for when in (0.0, 1.99, 7.0, 12.5, 18.0, 24.0, 26.5)]
    assert found == pytest.approx([0, 0, 5, 10, 5, 0, 2.5], abs=1e-9)
    levels = [start for _, start, _ in staircase(2.5, 1.0)]
    assert levels == [0, 2.5, 5, 7.5, 10, 10, 7.5, 5, 2.5, 0]


def test_spool_with_play_follows_half_a_play_late():
    u = np.concatenate([np.linspace(0, 10, 1001), np.linspace(10, 0, 1001)])
    spool = with_play(u, 0.5)
    assert spool[500] == pytest.approx(u[500] - 0.25) and spool[1500] == pytest.approx(u[1500] + 0.25)
    assert with_play(u[:1], 0.5).tolist() == [0.0] and with_play(u[:1], 0.5, begins=-0.2).tolist() == [-0.2]


def test_spool_that_sticks_jumps_by_its_breakaway():
    u = np.linspace(0, 10, 10001)
    jumps = np.diff(that_sticks(u, 0.15, np.random.default_rng(1)))
    jumps = jumps[jumps > 0]
    assert jumps.size > 50 and 0.119 < jumps.min() < jumps.max() < 0.182 and np.ptp(jumps) > 0.04


def test_lag_of_a_ramp_is_the_ramp_so_many_samples_late():
    ramp_of_flow = 3.0 + 0.01 * np.arange(2000)
    late = lagged(ramp_of_flow, 20.0)
    assert late[0] == 3.0 and late[-1] == pytest.approx(ramp_of_flow[-1] - 0.01 * 19.5, rel=1e-3)
