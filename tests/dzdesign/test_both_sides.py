"""A valve with two sides that is driven to one: said in the verdict, and what to type next is printed."""

import json
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.project import target_named
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.display import NOT_ASKED_FOR, NOT_CHECKED
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.design.pressure_inputs import not_covered
from dzdesign.identify.reading.ramp_files import ramp_file_bytes
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.requirements import MACHINE_CODE, RAMPS
from dzdesign.verify.verification import label_of_untried
from tests.support.evidence import ALWAYS, EVIDENCE
from tests.support.golden_firmware import FULL
from tests.support.synthetic import L_MIN, MPA, Truth, needs_compiler, synthetic_ramp

ONE_SIDE = "positive commands only: the negative side of this valve was identified and is not driven"


@pytest.fixture(scope="module")
def valve():
    return read_artefact((FULL / "valve.json").read_bytes(), ValveModel, "valve.json")


def designed(valve, **texts):
    return design(valve, options_of(texts, target_named("f28335").inputs()))


def test_a_verdict_says_what_it_does_not_cover(valve):
    both = {"command_signal": "-10..10 V x 0.12 + 1.5 V"}
    assert not_covered(designed(valve)) == (ONE_SIDE,)
    assert not_covered(designed(valve, **both)) == ()
    silent = replace(valve, sides={name: replace(side, recorded_drop=None) for name, side in valve.sides.items()})
    assert "was not recorded" in not_covered(designed(silent, **both))[0]
    assert "must switch" in not_covered(designed(valve, **both, negative_dp="wired"))[0]
    alone = replace(valve, sides={"positive": valve.positive})
    assert not_covered(designed(alone)) == ()


def test_it_stands_in_the_sentence():
    assert ONE_SIDE in replace(EVIDENCE, not_covered=(ONE_SIDE,)).reservation
    assert ONE_SIDE not in EVIDENCE.reservation


@pytest.mark.slow
@needs_compiler
def test_terminal_evidence_and_report_say_it(valve, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "valve.json").write_bytes(to_json_bytes(valve))
    one = ["--command-signal", "0..10 V x 0.3"]
    assert main(["design", "valve.json", *one, "--transition", "off", "-o", "compensator.json"]) == 0
    assert main(["codegen", "compensator.json", "--target", "f28335", "-o", "firmware"]) == 0
    capsys.readouterr()
    assert main(["verify", "firmware", "-o", "evidence"]) == 0
    assert f"; {ONE_SIDE}." in capsys.readouterr().out
    assert json.loads((tmp_path / "evidence/verification.json").read_text())["not_covered"] == [ONE_SIDE]
    head = (tmp_path / "evidence/report.html").read_text().partition('<dl class="numbers">')[0]
    assert ONE_SIDE in head


def recordings(folder, *, signed):
    """Write ramps of both sides from two sensors, A ahead at positive commands; B ahead at negative ones if signed."""
    for dp in (1.0, 3.0):
        for sign in (1, -1):
            test = synthetic_ramp(dp, Truth(), rate_Hz=10.0, seed=sign + 2)
            drop, low = test.dp / MPA, np.full(test.u.size, 0.5)
            ahead = sign > 0 or not signed
            columns = {
                "time_s": test.time, "u_V": sign * test.u, "Q_Lmin": sign * test.q / L_MIN,
                "pA_MPa": low + drop * ahead, "pB_MPa": low + drop * (not ahead),
            }  # fmt: skip
            (folder / f"ramp_{sign}_{dp:g}.csv").write_bytes(ramp_file_bytes(columns, (), compress=False))


@pytest.mark.parametrize("signed", [True, False])
def test_identify_says_the_direction_and_what_to_type_next(tmp_path, monkeypatch, capsys, signed):
    monkeypatch.chdir(tmp_path)
    recordings(tmp_path, signed=signed)
    assert main(["-v", "identify", "*.csv", "--meter-lag", "0.1 s", "--curve", "line"]) == 0
    out = capsys.readouterr().out
    drop = "pB_MPa - pA_MPa (recorded below zero)" if signed else "pA_MPa - pB_MPa"
    assert f"pressure drop at negative commands: {drop}\n" in out
    (command,) = [line for line in out.splitlines() if line.startswith("Next: ")]
    assert command == "Next: dzdesign design valve.json"
    assert main(["-v", "design", "valve.json"]) == 0
    way = "B minus A" if signed else "A minus B"
    assert f"negative commands: the pressure drop is {way}, as recorded" in " ".join(capsys.readouterr().out.split())
    assert main(["init", "*.csv"]) == 0
    options = (tmp_path / "dzdesign.toml").read_text()
    assert '\n# command-signal = "-10..10 V' in options and '\nnegative-dp = "recorded"\n' in options
    # As written, it is no contradiction to a command of one sign.
    assert main(["design", "valve.json", "--config", "dzdesign.toml"]) == 0


def test_what_nobody_asked_for_is_not_called_unchecked():
    assert {label_of_untried(each) for each in (RAMPS, MACHINE_CODE)} == {NOT_ASKED_FOR}
    assert {label_of_untried(each) for each in ALWAYS} == {NOT_CHECKED}
