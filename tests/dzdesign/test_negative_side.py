"""A valve that was tested with negative commands alone: commands from zero to full drive its negative side."""

import gzip
import json
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.pressure_inputs import not_covered, signals_in_words
from dzdesign.identify.valve.model import ValveModel
from tests.support.golden_firmware import FULL
from tests.support.synthetic import needs_compiler

DRIVEN = "commands from zero to full drive the valve's negative side: its positive one was not tested"


def negated(content):
    """Return a simulated recording with command and flow of the other sign."""
    head, rows = [], []
    for line in gzip.decompress(content).decode().splitlines():
        (rows if line[0] in "-0123456789" else head).append(line)
    table = np.array([row.split(",") for row in rows], dtype=float)
    names = head[-1].split(",")
    table[:, [names.index("u_V"), names.index("Q_Lmin")]] *= -1
    return "\n".join([*head, *(",".join(f"{value:.4f}" for value in row) for row in table)]) + "\n"


@pytest.fixture(scope="module")
def valve():
    both = read_artefact((FULL / "valve.json").read_bytes(), ValveModel, "valve.json")
    return replace(both, sides={"negative": both.sides["negative"]})


def test_its_law_is_that_of_the_negative_side(valve):
    compensator = design(valve)
    assert compensator.positive is None and compensator.side() == compensator.negative
    assert not compensator.two_sided and compensator.certified_of
    assert not_covered(compensator) == (DRIVEN,)
    assert "4095 is -10 V" in signals_in_words(compensator)[0]
    again = read_artefact(to_json_bytes(compensator), Compensator, "compensator.json")
    assert again == compensator
    # The same law as that of a valve of which this is the positive side.
    mirrored = design(replace(valve, sides={"positive": valve.sides["negative"]}))
    assert compensator.negative == mirrored.positive


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("target", ["host", "f28335"])
def test_simulated_negative_commands_alone_go_to_verified_firmware(tmp_path, monkeypatch, capsys, target):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "--ramp-time", "20 s", "--dp", "1 MPa", "--dp", "4 MPa", "-o", "ramps"]) == 0
    for file in (tmp_path / "ramps").glob("*.csv.gz"):
        (tmp_path / file.stem).write_text(negated(file.read_bytes()))
    assert main(["identify", "*.csv", "--meter-lag", "0.1 s", "--curve", "line", "-o", "valve.json"]) == 0
    assert list(json.loads((tmp_path / "valve.json").read_text())["sides"]) == ["negative"]
    assert main(["design", "valve.json", "--target", target, "-o", "compensator.json"]) == 0
    assert main(["codegen", "compensator.json", "--target", target, "-o", "firmware"]) == 0
    capsys.readouterr()
    assert main(["verify", "firmware", "--ramps", "*.csv", "-o", "evidence"]) == 0
    assert DRIVEN in " ".join(capsys.readouterr().out.split())
    evidence = json.loads((tmp_path / "evidence/verification.json").read_text())
    assert [each["side"] for each in evidence["inputs"]] == ["negative"]
    assert {each["side"] for each in evidence["closed_loop"]["pressures"]} == {"negative"}
    assert all(each["wrong"] == each["over_compensated"] == 0 for each in evidence["inputs"])
    assert "drive the valve's negative side" in (tmp_path / "firmware/core/dz_valve.h").read_text()


def test_what_it_is_not_made_for_is_refused(valve, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "valve.json").write_bytes(to_json_bytes(valve))
    assert main(["design", "valve.json", "--command-signal", "-10..10 V x 0.12 + 1.5 V"]) == 2
    assert "the valve's positive side was not tested" in capsys.readouterr().err
    assert main(["design", "valve.json", "-o", "compensator.json"]) == 0
    assert main(["codegen", "compensator.json", "--target", "amplifier", "--device", "csv", "-o", "setting"]) == 2
    assert "an amplifier's setting is that of positive commands" in capsys.readouterr().err
