"""A valve of three recorded ports, its current controlled by the F280049C, in closed loop with its own plant."""

import gzip
import json

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import remaining_dead_zone
from tests.support.designs import CURRENT
from tests.support.synthetic import needs_compiler

#: A plant of nobody's, whose stop lies beyond full command at every pressure drop.
PLANT = """\
preload_N = 20.0
pressure_force_N_MPa = 0.5
overlap_mm = 0.35
stroke_mm = 3.0
hysteresis_V = 0.2
K_et_N_m = 16000.0
C_d_W_mm = 2.8
droop_MPa_L_min2 = 2e-4
flow_force_N_mm_MPa = 1.0
"""
#: Pressure behind the edge, and of the port that is open to the tank; MPa.
BEHIND, OPEN = 1.0, 0.4
SAME_DEAD_ZONE = 0.003


def recorded_ports(folder):
    """Write each simulated ramp twice, as one of P to A and, mirrored, of P to B; columns are the ports' pressures."""
    for path in (folder / "ramps").glob("*.csv.gz"):
        rows = [line for line in gzip.decompress(path.read_bytes()).decode().splitlines() if line[0] in "-0123456789"]
        time, u, drop, flow = np.array([row.split(",") for row in rows], dtype=float).T
        for sign, name in ((1, "to_a"), (-1, "to_b")):
            ports = [np.full(time.size, BEHIND), np.full(time.size, OPEN)][::sign]
            table = np.column_stack([time, sign * u, BEHIND + drop, *ports, sign * flow])
            lines = ["time_s,u_V,pP_MPa,pA_MPa,pB_MPa,Q_Lmin", *(",".join(f"{x:.4f}" for x in row) for row in table)]
            (folder / f"{name}_{path.name.partition('.')[0]}.csv").write_text("\n".join(lines) + "\n")


@pytest.mark.slow
@needs_compiler
def test_three_ports_and_a_current_hold_with_the_plant_of_the_recordings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plant.toml").write_text(PLANT)
    drops = [word for dp in (1, 3, 5) for word in ("--dp", f"{dp} MPa")]
    assert main(["simulate", "--plant", "plant.toml", "--ramp-time", "40 s", *drops, "-o", "ramps"]) == 0
    recorded_ports(tmp_path)
    assert main(["identify", "*.csv", "--meter-lag", "0.1 s", "-o", "valve.json"]) == 0
    current = [word for name, text in CURRENT.items() for word in (f"--{name.replace('_', '-')}", text)]
    assert main(["design", "valve.json", "--target", "f280049c", *current, "-o", "compensator.json"]) == 0
    assert main(["codegen", "compensator.json", "--target", "f280049c", "-o", "firmware"]) == 0
    assert main(["verify", "firmware", "--plant", "plant.toml", "--ramps", "*.csv", "-o", "evidence"]) == 0
    compensator = read_artefact((tmp_path / "compensator.json").read_bytes(), Compensator, "compensator.json")
    assert compensator.signals.negative_pair == "AC" and compensator.current_drive is not None
    found = json.loads((tmp_path / "evidence/verification.json").read_text())["closed_loop"]["pressures"]
    assert [each["side"] for each in found].count("negative") == 3 == len(found) / 2
    for each in found:
        assert each["q_zero_L_min"] == each["leak_L_min"] == 0.0
        sign = compensator.valve.sign_of(each["side"])
        tests = {round(test.dp_MPa, 2): test for test in compensator.valve.side(sign).tests}
        stated = remaining_dead_zone(compensator, tests[round(each["dp_MPa"], 2)], sign)["opening"]
        assert abs(each["residual_opening"] - stated) < SAME_DEAD_ZONE
