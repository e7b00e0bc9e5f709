"""Evidence is the same on processors whose linear algebra adds up otherwise: digits without a meaning are cut.

Two kernels of OpenBLAS stand for two processors; each runs in a process of its own, from recordings to evidence.
"""

import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.closed_loop.scene import DECIMALS, rounded_up, stored
from tests.support.evidence import pressure_result
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

KERNELS = ("Haswell", "Prescott")
RAMPS = sorted(
    path for dp in ("1", "5") for path in (ROOT / "examples/paper_valve/ramps").glob(f"ramp_dP{dp}_*.csv.gz")
)
WORK = """
import sys
from dzdesign.command_line.cli import main
from dzdesign.verify.closed_loop import against_cvodes
against_cvodes.WINDOW_S = 0.1
ramps = sys.argv[1:]
assert main(["identify", *ramps, "-o", "valve.json"]) == 0
assert main(["design", "valve.json", "-o", "compensator.json"]) == 0
assert main(["codegen", "compensator.json", "--target", "host", "-o", "firmware"]) == 0
assert main(["verify", "firmware", "-o", "evidence"]) in (0, 1)
"""


def kernel_of(name: str) -> str:
    """Return what OpenBLAS says that it runs, asked for a kernel; empty of another library."""
    environment = {**os.environ, "OPENBLAS_CORETYPE": name, "OPENBLAS_VERBOSE": "2"}
    done = subprocess.run(
        [sys.executable, "-c", "import numpy"], env=environment, capture_output=True, text=True, check=True
    )
    return done.stderr.strip()


def made(folder: Path, kernel: str, threads: int) -> dict[str, bytes]:
    """Return every file from recordings to evidence."""
    folder.mkdir()
    environment = {**os.environ, "OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": str(threads)}
    subprocess.run(
        [sys.executable, "-c", WORK, *map(str, RAMPS)], cwd=folder, env=environment, check=True, capture_output=True
    )
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
@needs_compiler
@pytest.mark.skipif(platform.machine().lower() not in ("x86_64", "amd64"), reason="kernels of x86 are compared")
def test_every_file_is_the_same_with_two_kernels(tmp_path):
    if kernel_of(KERNELS[0]) == kernel_of(KERNELS[1]):
        pytest.skip("NumPy's linear algebra here has one kernel, so there is nothing to compare")
    first, second = (made(tmp_path / kernel, kernel, threads) for threads, kernel in enumerate(KERNELS, start=1))
    assert len(first) > 10 and first.keys() == second.keys()
    assert [name for name, content in first.items() if second[name] != content] == []


def test_digits_without_a_meaning_are_cut():
    one = pressure_result(q_max_L_min=10.942599683573611, q_zero_L_min=0.93002, leak_L_min=0.93002)
    other = replace(one, q_max_L_min=10.942599683573631)
    assert one != other and stored(one) == stored(other)
    assert stored(one).q_max_L_min == round(one.q_max_L_min, DECIMALS)


@pytest.mark.parametrize("leak", [0.0, 0.1234567894, 0.1234567895, 0.1234567896])
@pytest.mark.parametrize("share", [0.0, 0.4, 0.999, 2.5, 1e6])
def test_a_leak_is_no_flow_and_a_flow_is_no_leak(leak, share):
    given = pressure_result(q_zero_L_min=leak + share * NO_FLOW_L_MIN, leak_L_min=leak)
    found = stored(given)
    assert (found.q_beyond_L_min > NO_FLOW_L_MIN) == (share > 1)
    assert abs(found.q_zero_L_min - given.q_zero_L_min) <= 2 * 10**-DECIMALS


@pytest.mark.parametrize(
    ("difference", "shown"), [(0.0, 0.0), (1.8e-13, 1e-9), (1.0000001e-9, 1e-9), (1.2e-9, 2e-9), (7.7e-7, 7.7e-7)]
)
def test_a_difference_is_rounded_up(difference, shown):
    assert rounded_up(difference) == shown
