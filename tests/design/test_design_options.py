"""Options of `design` on the command line: what they cost is said, and what would do nothing, or harm, is refused."""

import json
import re
from pathlib import Path

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from tests.support.attacked_firmware import sealed
from tests.support.paths import GOLDENS_FULL

#: A valve with both sides.
BOTH_SIDES = GOLDENS_FULL / "valve.json"
BOTH_SIGNS = "--command-signal=-10..10 V x 0.15 + 1.5 V"


@pytest.fixture
def valve_file(example_valve, tmp_path) -> Path:
    path = tmp_path / "valve.json"
    path.write_bytes(to_json_bytes(example_valve))
    return path


@pytest.fixture
def run(tmp_path, capsys):
    """Return what the command says, its exit status and the compensator it wrote."""

    def call(valve: Path, *options: str):
        output = tmp_path / "compensator.json"
        status = main(["design", str(valve), *options, "-o", str(output)])
        said = capsys.readouterr()
        return status, said.out + said.err, json.loads(output.read_text()) if output.exists() else None

    return call


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--output-max", "40 %"], "the largest output is 40.0% of full drive, but the valve opens at"),
        (["--output-max", "0.0005 %"], "so nothing would ever flow"),
        (["--transition", "7 %"], "choose one of 3.14 % (128 codes) at most"),
        (["--ramp-up", "0.1 ms"], "a ramp takes 0.0001 s, expected 0 (none), or from one sample"),
        (["--dither", "1 kHz 1 %"], "the dither's frequency is 1000 Hz, expected 100 to 300 Hz"),
        (["--dither", "150 Hz"], "expected 'off', or a frequency in Hz and the wave's peak"),
        (["--dither", "150 Hz 0.0005 %"], "less than half a count of the PWM"),
        (["--transition", "0.03 %"], "a transition of 0.030% is 1 codes of the command"),
        (["--command-error", "15 + 9 codes", "--transition", "1 %"], "the noise's peak of 9; give --transition 1.563%"),
        (["--command-error", "500 + 4 codes"], "a zero band of 504 codes and a transition of 32 take 536"),
        (["--command-error", "15 + 0 codes"], "no converter is without noise"),
        (["--command-error", "15 codes"], "expected the offset and the noise's peak"),
        (["--command-error", "1/0 codes + 4 codes"], "expected the offset and the noise's peak"),
        (["--reading-flow", "1e9 L/min"], "expected at most 1e+06 L/min"),
        (["--negative-dp", "swapped"], "--negative-dp is for a command of both signs"),
        (["--ramp-down", "1 s / 2 s"], "the second time of --ramp-down is for a command of both signs"),
        (["--pressure-a", "0..3 V = 0 MPa"], "the sensor's span is 0 MPa"),
        (["--pressure-a", "0..3 V = 5.5 MPa", "--pressure-b", "0..3 V = 1500 MPa"], "MPa are too unlike"),
    ],
)
def test_what_would_do_nothing_or_harm_is_refused(valve_file, run, options, words):
    status, said, written = run(valve_file, *options)
    assert status == 2 and words in said and written is None


def test_the_drives_end_is_said_in_commands(valve_file, run):
    status, said, _ = run(valve_file, "--output-max", "90 %")
    assert status == 0 and re.search(r"90\.00% from \d+\.\d% on", said)


def test_the_peak_of_the_dither_is_said_to_be_in_the_tables_loss(valve_file, run):
    status, said, document = run(valve_file, "--dither", "300 Hz 1%")
    assert status == 0 and "of which 100.00 mV are the dither's peak" in said
    assert 100 <= 2500 / 2 / document["drive_functions"]["dither_ticks"] <= 300


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--polarity", "inverted"], "command that reads code 0 is taken for 100% of command"),
        (
            ["--pressure-a", "0..3 V", "--accept", "broken-sensor"],
            "of sensor A a broken wire and a reading above the span can't be told from a pressure",
        ),
        (["--pressure-b", "4..20 mA on 150 ohm = 25 MPa"], "of sensor B a reading above the span can't be told"),
    ],
)
def test_a_failure_that_the_codes_hide_is_said(valve_file, run, options, words):
    status, said, _ = run(valve_file, *options)
    assert status == 0 and words in said


def test_noise_at_the_end_of_a_signal_is_no_failure(valve_file, run):
    """A code below zero command let the valve go, and the spool would have hammered."""
    document = run(valve_file, "--command-signal", "0..10 V x 0.25 + 0.2 V")[2]
    command = document["signals"]["command"]
    low, high = command["valid_codes"]
    margin = (command["full_code"] - command["zero_code"]) / 20
    assert command["zero_code"] - low == pytest.approx(margin, abs=2)
    assert high - command["full_code"] == pytest.approx(margin, abs=2)


def test_a_side_that_is_left_out_is_named(run):
    assert "the valve's negative side is left out" in run(BOTH_SIDES)[1]
    status, said, _ = run(BOTH_SIDES, BOTH_SIGNS, "--command-error", "1.9 % + 1 code")
    assert status == 0 and "left out" not in said and "must pass zero by 2.05%" in said


def test_a_guard_that_one_side_lacks_is_refused_with_those_that_serve_both(run, tmp_path):
    document = json.loads(BOTH_SIDES.read_text())
    del document["sides"]["negative"]["certified"]["mean"]
    valve = tmp_path / "valve.json"
    valve.write_text(json.dumps(sealed(document)))
    status, said, _ = run(valve, BOTH_SIGNS, "--guard", "mean")
    assert status == 2 and "the negative side's ramp tests do not bound the mean threshold" in said
    assert "take --guard closing" in said


class TestEditedCompensators:
    """A compensator.json that was edited: nothing is generated that its certificate does not cover."""

    @pytest.fixture
    def refused(self, valve_file, run, tmp_path, capsys):
        def call(edit) -> str:
            document = run(valve_file)[2]
            edit(document)
            path = tmp_path / "edited.json"
            path.write_text(json.dumps(document))
            assert main(["codegen", str(path), "--target", "host", "-o", str(tmp_path / "fw")]) == 2
            assert not (tmp_path / "fw").exists()
            return capsys.readouterr().err

        return call

    @pytest.mark.parametrize("guard", ["closing */ int evil = 1; /*", "{x}", "{", "x"])
    def test_a_guard_that_is_none(self, refused, guard):
        def edit(document):
            document["sides"]["positive"]["certificate"]["guard"] = guard

        assert "expected 'closing', 'mean' or 'opening'" in refused(edit)


def test_a_key_that_is_there_twice_is_refused(valve_file, run):
    text = valve_file.read_text()
    valve_file.write_text(text.replace('"schema":', '"schema": "dzdesign.valve/0",\n  "schema":', 1))
    status, said, _ = run(valve_file)
    assert status == 2 and "the key 'schema' is there twice" in said
