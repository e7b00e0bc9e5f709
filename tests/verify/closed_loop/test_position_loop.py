"""A position loop around the compiled firmware: at rest below what `design` states, cycling above, and with a fault."""

import json

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError
from dzdesign.design.design_choices import read_position_loop
from dzdesign.design.position_loop import largest_gains
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.position_loop import PositionLoop, comes_to_rest
from dzdesign.verify.closed_loop.scene import scenes_of
from tests.support.designs import BOTH_SIGNS, designed, replaced, written
from tests.support.golden_firmware import FULL
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
LOOPS = [(0.02, 0.002), (0.05, 0.01), (0.01, 0.001)]


@pytest.fixture(scope="module")
def compensator():
    valve = read_artefact((FULL / "valve.json").read_bytes(), ValveModel, "valve.json")
    return designed(valve, command_signal=BOTH_SIGNS)


@pytest.fixture(scope="module")
def two_sided(compensator, tmp_path_factory):
    return scenes_of(written(compensator, tmp_path_factory.mktemp("two") / "firmware"), compensator, None)


@pytest.mark.parametrize(("lag_s", "delay_s"), LOOPS)
def test_it_rests_below_the_stated_gain_and_cycles_well_above(two_sided, compensator, lag_s, delay_s):
    stated = min(each.gain for each in largest_gains(compensator, lag_s, delay_s))
    below, above, unsaid = (
        comes_to_rest(PositionLoop(lag_s=lag_s, delay_s=delay_s, gain=gain), two_sided)
        for gain in (0.8 * stated, 1.6 * stated, None)
    )
    assert below.id == "position-loop" and below.holds and unsaid.holds and "`design` states rest up to" in below.text
    assert above.holds is False and "cycles in" in above.text


def test_an_offset_above_the_threshold_is_seen_to_cycle(two_sided, compensator, tmp_path):
    """3 % of full drive on top of what is written to the PWM."""
    counts = 3 * compensator.signals.compare_max // 100
    right = "(drive->side {} 0) ? (uint16_t)compare : 0u;"
    wrong = right.replace("compare", f"(compare + {counts})")
    edit = replaced(*((right.format(way), wrong.format(way)) for way in "<>"))
    folder = written(compensator, tmp_path / "firmware", edit=edit, of="core/dz_drive.c")
    asked = PositionLoop(lag_s=0.02, delay_s=0.002, gain=200.0)
    assert comes_to_rest(asked, two_sided).holds
    assert comes_to_rest(asked, scenes_of(folder, compensator, None)).holds is False


@pytest.mark.slow
def test_a_gain_that_cycles_does_not_hold_and_one_solenoid_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    valve = str(FULL / "valve.json")
    for name, more in (("two", []), ("one", ["--command-signal", "0..10 V x 0.3"])):
        assert main(["design", valve, *more, "--target", "host", "-o", f"{name}.json"]) == 0
        assert main(["codegen", f"{name}.json", "--target", "host", "-o", name]) == 0
    capsys.readouterr()
    for gain, status in (("250/s", 0), ("1600 1/s", 1)):
        assert main(["verify", "two", "--position-loop", f"20 ms, 2 ms, {gain}", "-o", f"evidence{status}"]) == status
        checks = json.loads((tmp_path / f"evidence{status}/verification.json").read_text())["checks"]
        (check,) = [each for each in checks if each["id"] == "position-loop"]
        assert check["holds"] == (status == 0)
    capsys.readouterr()
    assert main(["verify", "one", "--position-loop", "20 ms, 2 ms, 250/s"]) == 2
    assert "a command of one sign moves a piston one way" in capsys.readouterr().err


def test_lag_delay_and_gain_have_units():
    assert read_position_loop("0.02 s, 2 ms, 300/s", "--position-loop") == (0.02, 0.002, 300.0)
    assert read_position_loop("20 ms, 2 ms, 300 1/s", "--position-loop")[2] == 300.0
    assert read_position_loop("20 ms, 2 ms", "--position-loop")[2] is None
    for text in ("20 ms, 2 ms, 300", "20 ms, 2 ms, 0/s", "20 ms, 2 ms, -3/s", "20 ms, 2 ms, 3/s, 1"):
        with pytest.raises(InputError, match="--position-loop"):
            read_position_loop(text, "--position-loop")
