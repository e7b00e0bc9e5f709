"""Two threads of a notebook or a server identify at once: each gets what it would have got alone.

In a process of its own: what goes wrong here ends in a fault of memory, not in an exception.
"""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from dzdesign.identify.identification import identify
from tests.support.paths import ROOT
from tests.support.synthetic import Truth, synthetic_ramp

THREADS, RUNS = 4, 32


def bounds(seed):
    tests = [synthetic_ramp(dp, Truth(), seed=seed) for dp in (1.0, 3.0, 5.0)]
    return tuple(test.u_guard_lower_V for test in identify(tests).positive.tests)


def main():
    alone = [bounds(seed) for seed in range(3)]
    with ThreadPoolExecutor(THREADS) as pool:
        together = list(pool.map(bounds, [run % 3 for run in range(RUNS)]))
    assert together == [alone[run % 3] for run in range(RUNS)]


@pytest.mark.slow
def test_threads_do_not_disturb_one_another():
    command = [sys.executable, "-m", "tests.identify.test_threads"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, f"{done.returncode}: {done.stderr[-500:]}"


if __name__ == "__main__":
    main()
