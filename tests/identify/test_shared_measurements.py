"""The whole pipeline on ramp tests that the project did not make; skipped where they are not at hand."""

import json

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from tests.support.synthetic import SHARED, needs_compiler

pytestmark = pytest.mark.skipif(
    not SHARED.is_dir(), reason=f"the shared measurements are not at {SHARED} (set DZDESIGN_SHARED_DATA)"
)
#: 0.3 % of 10 V.
KNEE_TOLERANCE_V = 0.03
#: Every code of command with every difference of the pressure codes that are valid, 688 to 4014.
INPUTS = 4096 * (2 * (4014 - 688) + 1)


@pytest.fixture(scope="module", params=["a", "e"])
def artefacts(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(f"valve_{request.param}")
    ramps = sorted(str(path) for path in (SHARED / f"valve_{request.param}").glob("*.csv.gz"))
    assert len(ramps) == 6
    # One ramp at each pressure drop: with the scatter that is assumed then, valve E's trend of 20 mV would be none.
    assert main(["identify", *ramps, "--repeatability", "0 %", "-o", str(folder / "valve.json")]) == 0
    return folder


@pytest.mark.slow
def test_knees_of_both_branches_at_every_pressure(artefacts):
    truth = json.loads((SHARED / "truth.json").read_text())
    valve = json.loads((artefacts / "valve.json").read_text())
    tests = valve["sides"]["positive"]["tests"]
    assert len(tests) == 6
    for test in tests:
        known = truth[test["source"].removesuffix(".csv.gz")]["pos"]
        for branch in ("rising", "falling"):
            error = test[f"u_knee_{branch}_V"] - known[f"u_knee_{branch}_15_50pct"]
            assert abs(error) <= KNEE_TOLERANCE_V, (test["source"], branch, error)
        assert test["q_max_L_min"] == pytest.approx(known["Qmax_true"], rel=0.02)
    assert valve["sides"]["positive"]["trend"] == "decreasing"
    assert valve["sides"]["positive"]["reference"]["dp_MPa"] == pytest.approx(1, abs=0.02)


@pytest.mark.slow
@needs_compiler
def test_firmware_from_them_is_verified(artefacts, capsys):
    assert main(["design", str(artefacts / "valve.json"), "-o", str(artefacts / "compensator.json")]) == 0
    assert main(["codegen", str(artefacts / "compensator.json"), "-o", str(artefacts / "fw")]) == 0
    assert main(["verify", str(artefacts / "fw"), "-o", str(artefacts / "evidence")]) == 0
    evidence = json.loads((artefacts / "evidence" / "verification.json").read_text())
    assert [(each["inputs"], each["wrong"]) for each in evidence["inputs"]] == [(INPUTS, 0)]
    assert f"{INPUTS} inputs checked, 0 wrong" in capsys.readouterr().out


def test_offset_passes_no_flow_that_the_meter_could_see(artefacts):
    """At the certified offset, on the closing branch, the true flow is below the meter's floor at every pressure."""
    truth = json.loads((SHARED / "truth.json").read_text())
    side = json.loads((artefacts / "valve.json").read_text())["sides"]["positive"]
    certified = side["certified"]["closing"]
    for test in side["tests"]:
        known = truth[test["source"].removesuffix(".csv.gz")]["pos"]
        offset = np.interp(test["dp_MPa"], certified["offset_dp_MPa"], certified["offset_V"])
        assert offset < known["u_falling_Q0.6"]


@pytest.mark.parametrize("valve", ["a", "e"])
def test_offset_passes_no_more_than_a_declared_flow(valve, tmp_path):
    """The command that truly passes 1 L/min on closing is met, and the bound lies under it."""
    truth = json.loads((SHARED / "truth.json").read_text())
    ramps = sorted(str(path) for path in (SHARED / f"valve_{valve}").glob("*.csv.gz"))
    options = ["--repeatability", "0 %", "--zero-flow", "1000 mL/min", "--meter-lag", "0.1 s"]
    assert main(["identify", *ramps, *options, "-o", str(tmp_path / "valve.json")]) == 0
    side = json.loads((tmp_path / "valve.json").read_text())["sides"]["positive"]
    for test in side["tests"]:
        known = truth[test["source"].removesuffix(".csv.gz")]["pos"]["u_falling_Q1.0"]
        assert test["zero_flow_L_min"] == 1.0
        assert test["u_guard_V"] == pytest.approx(known, abs=0.015)
        # Of E at 0.5 MPa the line errs by 7.5 mV, at 5 MPa by 3.3 mV, and with no scatter that is the whole of it.
        assert known - 0.22 < test["u_guard_lower_V"] < known


def test_measured_valve_without_pressure_is_one_pressure_and_says_so(tmp_path, capsys):
    path = tmp_path / "valve.json"
    assert main(["-v", "identify", str(SHARED / "real" / "pvp_psol.csv"), "-o", str(path)]) == 0
    bracket = json.loads((SHARED / "real" / "brackets.json").read_text())["pvp_psol.csv"]
    valve = json.loads(path.read_text())
    (test,) = valve["sides"]["positive"]["tests"]
    for branch in ("rising", "falling"):
        assert abs(test[f"u_knee_{branch}_V"] - bracket[f"linear_knee_10_50pct_{branch}"]) <= 0.1
    assert test["dp_MPa"] is None and valve["sides"]["positive"]["trend"] is None
    assert "a certified interval are unknown" in capsys.readouterr().out
    # At its bound of the closing threshold the meter saw less than half a per cent of the largest flow.
    u, q = np.loadtxt(SHARED / "real" / "pvp_psol.csv", delimiter=",", skiprows=1, usecols=(1, 2)).T
    falling = np.arange(u.size) > np.argmax(u)
    assert q[falling & (u <= test["u_guard_lower_V"])].max() < 0.005 * bracket["Qmax"]
    assert main(["design", str(path), "-o", str(tmp_path / "compensator.json")]) == 2
    assert "without a pressure drop" in capsys.readouterr().err
    assert not (tmp_path / "compensator.json").exists()
