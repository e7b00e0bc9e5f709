"""Evidence of the closed loop: the same on processors that add up otherwise, and judged by the declared zero flow.

Two kernels of OpenBLAS stand for two processors; each runs in a process of its own, from recordings to evidence.
"""

import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.report.sections.closed_loop import scenarios_table
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, RampSequence
from dzdesign.verify.closed_loop.loop_checks import no_flow_at_zero
from dzdesign.verify.closed_loop.scene import DECIMALS, rounded_up, stored
from tests.identify.fitting.test_zero_flow import L_MIN, WORN, recordings
from tests.support.evidence import pressure_result, verify
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
assert main(["identify", *ramps, "--curve", "line", "-o", "valve.json"]) == 0
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


QUICK = RampSequence(rest=1.0, ramp=10.0, top=0.5)


@pytest.fixture(scope="module")
def compensator():
    worn = replace(WORN, repeats=1)
    options = IdentifyOptions(meter_lag=0.0, zero_flow=0.35 * L_MIN, repeatability=5e-4, curve="monotone")
    return design(identify(recordings(worn, pressures=(1.0, 3.0, 5.0)), options))


@pytest.fixture(scope="module")
def verified(compensator, tmp_path_factory):
    folder = tmp_path_factory.mktemp("worn") / "fw"
    made = generate(compensator, "host")
    write_folder(folder, made.files, made.manifest)
    return verify(folder, sequence=QUICK), made


def test_what_was_declared_is_required_and_said(verified, compensator):
    found, made = verified
    results = [loop.result for loop in found.loops]
    assert all(each.allowed_at_zero_L_min == pytest.approx(0.35) for each in results)
    # The worn edge does leak there: without the declaration this is a failure.
    assert max(each.q_zero_L_min for each in results) > 0.18
    for name in ("zero-flow", "zero-flow-after-scenarios"):
        (check,) = [check for check in found.evidence.checks if check.id == name]
        assert check.holds and "0.35 L/min" in check.text and "declared" in check.name
    # A worn edge leaks the more the higher the pressure; of a threshold that is taken as monotone alone nothing bounds
    # that above the tests, and the certificate ends with them.
    above = [each for each in found.evidence.scenarios if "above the tests" in each.name]
    assert {each.not_required for each in above} == {"not certified above 5.00 MPa"}
    assert any(found.startswith("not certified above 5.00 MPa: ") for found in check.not_required)
    header = " ".join(made.files["core/dz_valve.h"].replace(" * ", " ").split())
    assert "up to 0.35 L/min may flow, a leak included: the declared zero flow" in header
    assert compensator.positive.certificate.zero_flow_L_min == pytest.approx(0.35)


@pytest.mark.parametrize(("flow", "allowed", "leak", "holds"), [
    (0.35, 0.35, 0.0, True),
    (0.36, 0.35, 0.0, False),
    (0.36, 0.35, 0.36, True),  # what no compensator can stop is no failure of it
    (0.36, 0.35, 0.30, False),
    (0.10, None, 0.0, False),
    (0.10, None, 0.10, True),
])  # fmt: skip
def test_the_flow_at_zero_is_judged_by_what_is_allowed(verified, compensator, flow, allowed, leak, holds):
    result = replace(
        verified[0].loops[0].result, q_zero_L_min=flow, allowed_at_zero_L_min=allowed, leak_L_min=leak,
        unseen_below_L_min=None,
    )  # fmt: skip
    check = no_flow_at_zero([result], compensator, plant_given=True)
    assert check.holds is holds
    assert ("declared" in check.name) == (allowed is not None)


def test_the_report_says_what_is_allowed_in_place_of_shut(verified):
    scenarios = verified[0].evidence.scenarios
    table = scenarios_table(scenarios, scenarios, RecordedUnits())
    required = {row[-1].text for row in table.rows if not row[-1].text.endswith(": not required")}
    assert required == {"0.35 L/min at most"}
    bare = [replace(each, allowed_at_zero_L_min=None) for each in scenarios]
    assert "shut" in {row[-1].text for row in scenarios_table(bare, bare, RecordedUnits()).rows}
