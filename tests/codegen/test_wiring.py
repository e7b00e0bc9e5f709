"""What the targets' READMEs say of the wiring and the first power-up, against the signals' own text and the law.

Oracle of the volts and codes: the text of the signal, read by `parse_signal` and put through the target's converter;
the READMEs are printed from compensator.json, which keeps the codes only.
"""

import re
from fractions import Fraction
from pathlib import Path

import pytest

from dzdesign.codegen.project import target_named
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.options import arguments_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.design_choices import DesignChoices
from dzdesign.design.signal_text import command_signal, parse_signal
from dzdesign.design.target_inputs import Converter
from tests.support.golden_firmware import FULL, GOLDENS

C2000 = ("f28335", "f280049c")
BOTH = "-10..10 V x 0.15 + 1.5 V"
ROW = re.compile(r"^ *\| ([+-]?[\d.]+) V, [^|]*\| ([\d.]+) V \| (\d+) \|$", re.MULTILINE)


@pytest.fixture
def firmware(tmp_path):
    """Generate on the command line, from the goldens' valve of one sign or of both."""

    def generated(target: str, *options: str, both: bool = False) -> Path:
        valve = (FULL if both else GOLDENS) / "valve.json"
        folder, compensator = tmp_path / "firmware", str(tmp_path / "compensator.json")
        assert main(["design", str(valve), "--target", target, *options, "-o", compensator]) == 0
        assert main(["codegen", compensator, "--replace", "-o", str(folder)]) == 0
        return folder

    return generated


def readme(folder: Path, target: str) -> str:
    return (folder / target.replace("-", "_") / "README.md").read_text(encoding="utf-8")


def wiring_row(text: str, what: str) -> str:
    """The row of the wiring table that starts so."""
    return next(line for line in text.splitlines() if line.startswith(f"| {what}"))


def power_up(text: str) -> str:
    return text.split("## First power-up")[1]


def step(text: str, number: int) -> str:
    """One numbered step of the first power-up, its lines joined."""
    found = re.search(rf"^{number}\. .*?(?=^\d\. |^\*\*|\Z)", power_up(text), re.MULTILINE | re.DOTALL)
    return " ".join(found[0].split())


def compensator_of(folder: Path):
    return read_artefact((folder / "compensator.json").read_bytes(), Compensator, "compensator.json")


# --- the commands of the first power-up -----------------------------------------------------------------------

SIGNALS = {
    "3 V": ("f28335", "0..10 V x 0.3", False),
    "less than the range": ("f28335", "0..10 V x 0.25", False),
    "live zero": ("f28335", "4..20 mA on 150 ohm", False),
    "both signs": ("f28335", BOTH, True),
    "3.3 V, attenuator for 3 V": ("f280049c", "0..10 V x 0.3", False),
    "3.3 V, both signs": ("f280049c", "-10..10 V x 0.165 + 1.65 V", True),
}


@pytest.mark.slow
@pytest.mark.parametrize("polarity", ["normal", "inverted"])
@pytest.mark.parametrize("name", SIGNALS)
def test_the_codes_of_the_power_up_are_those_of_the_signal(firmware, name, polarity):
    target, signal, both = SIGNALS[name]
    folder = firmware(target, "--command-signal", signal, "--polarity", polarity, both=both)
    pin, adc = parse_signal(signal, "--command-signal"), target_named(target).inputs().converter
    rows = {Fraction(u_V): (float(volts), int(code)) for u_V, volts, code in ROW.findall(readme(folder, target))}
    assert sorted(rows) == [share * 10 for share in sorted(shares(both))]
    for share in shares(both):
        turned = share if polarity == "normal" else -share if both else 1 - share
        on_wire = turned * pin.high if both else pin.low + turned * (pin.high - pin.low)
        volts, code = rows[share * 10]
        assert volts == pytest.approx(float(pin.volts(on_wire)), abs=1.5 * float(adc.full_V / adc.levels))
        assert abs(code - adc.code(pin.volts(on_wire))) <= 1
    command = compensator_of(folder).signals.command
    assert rows[0][1] == command.zero_code and rows[10][1] == command.full_code
    ramp = step(readme(folder, target), 7)
    assert f"code {command.zero_code}" in ramp and f"code {command.full_code}" in ramp
    assert not both or f"code {command.negative_full_code}" in ramp


def shares(both: bool) -> list[Fraction]:
    positive = [Fraction(1, 10), Fraction(1, 2), Fraction(1)]
    return [Fraction(0), *positive] + ([-share for share in positive] if both else [])


@pytest.mark.slow
@pytest.mark.parametrize("target", C2000)
def test_zero_command_gives_what_the_law_gives(firmware, target):
    folder = firmware(target, "--command-signal", BOTH, both=True)
    compensator = compensator_of(folder)
    zero, said = compensator.signals.command.zero_code, step(readme(folder, target), 3)
    for sign, name in ((1, "a"), (-1, "b")):
        largest = compensator.signals.pair(sign).largest_difference
        values = [compensator.compare(zero, dp, sign) for dp in range(largest + 1)]
        assert f"`compare_{name}` is {min(values)} to {max(values)}" in said


BROKEN = [
    ("0..10 V x 0.3", "normal", False, "code 0: zero command"),
    ("0..10 V x 0.3", "inverted", False, "**Warning: 0 V at the command's pin is code 0: full command."),
    (BOTH, "normal", True, "**Warning: 0 V at the command's pin is code 0: full negative command."),
    (BOTH, "inverted", True, "**Warning: 0 V at the command's pin is code 0: full positive command."),
    ("-10..10 V x 0.12 + 1.5 V", "normal", True, "code 0, which is not valid: the valve is let go"),
    ("4..20 mA on 150 ohm", "inverted", False, "code 0, which is not valid: the valve is let go"),
]


def test_the_cortex_m4_warns_of_a_broken_wire_too(firmware):
    options = ("cortex-m4", "--command-signal")
    for signal, said in (("0..10 V x 0.3", 1), ("4..20 mA on 150 ohm", 0)):
        text = readme(firmware(*options, signal, "--polarity", "inverted"), "cortex-m4")
        assert text.count("0 V at the command's pin is code 0: full command. A broken wire opens the valve") == said


@pytest.mark.slow
@pytest.mark.parametrize("target", C2000)
@pytest.mark.parametrize(("signal", "polarity", "both", "said"), BROKEN)
def test_the_wiring_says_what_a_broken_wire_of_the_command_does(firmware, target, signal, polarity, both, said):
    folder = firmware(target, "--command-signal", signal, "--polarity", polarity, both=both)
    text = " ".join(readme(folder, target).split("## Wiring")[1].split("\n## ")[0].split())
    assert text.count("0 V at the command's pin is code 0") == 1 and said in text
    assert ("broken wire opens the valve" in text) == said.startswith("**")
    compensator = compensator_of(folder)
    driven = max(
        compensator.signals.command.from_zero(0, sign) / compensator.signals.command.span(sign)
        for sign in compensator.signals.signs
    )
    released = compensator.signals.command.valid_codes[0] > 0
    assert said.startswith("**") == (driven == 1 and not released)


# --- the wiring table -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("target", C2000)
def test_the_wiring_table_is_that_of_the_signals(firmware, target):
    options = ("--pressure-a", "4..20 mA on 149 ohm = 25 MPa", "--pressure-b", "0..3 V = 10 MPa")
    options += ("--accept", "broken-sensor")
    folder = firmware(target, *options, "--command-signal", "0..10 V x 0.25")
    text, signals = readme(folder, target), compensator_of(folder).signals
    row = wiring_row(text, "command")
    assert "zero = 0.000 V, full = 2.500 V" in row
    assert f"zero = 0, full = {signals.command.full_code}, valid 0..{signals.command.valid_codes[1]}" in row
    a, b = signals.pressure_a, signals.pressure_b
    row = wiring_row(text, "pressure A")
    assert row.startswith("| pressure A, 0 MPa to 25 MPa |") and "0 MPa = 0.596 V, 25 MPa = 2.980 V" in row
    assert "4-20 mA on a shunt of 149 ohm" in row
    low, high = a.valid_codes
    assert f"0 MPa = {a.zero_code}, 25 MPa = {a.full_code}, valid {low}..{high}" in row
    row = wiring_row(text, "pressure B")
    assert row.startswith("| pressure B, 0 MPa to 10 MPa |") and "0 MPa = 0.000 V, 10 MPa = 3.000 V" in row
    assert f"0 MPa = 0, 10 MPa = {b.full_code}, valid" in row and "shunt" not in row
    assert f"`p_a_adc` near {a.zero_code}, `p_b_adc` near 0" in step(text, 4)
    assert not re.search(r"\bratio\b|sensor output 0-", text)


# --- both signs -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("polarity", ["normal", "inverted"])
def test_the_ramp_through_the_zero_band_changes_pins_where_the_drive_does(firmware, polarity):
    options = ("--command-signal", BOTH, "--command-error", "2 % + 0.1 %", "--polarity", polarity)
    folder = firmware("f28335", *options, both=True)
    compensator = compensator_of(folder)
    window, zero = compensator.drive_functions.leave_zero_codes, compensator.signals.command.zero_code
    assert window == 41 + 3 + 3 + 1
    assert f"about zero, codes {zero - window} to {zero + window}" in step(readme(folder, "f28335"), 7)


# --- the other targets, and the command line ------------------------------------------------------------------


def test_the_cortex_m4_says_what_its_numbers_are_made_for(firmware):
    folder = firmware("cortex-m4", "--pressure-a", "4..20 mA on 150 ohm = 25 MPa")
    text = readme(folder, "cortex-m4")
    assert "range of 3 V, 12 bits" in text and "60000 counts" in text
    assert "20.0 %" in wiring_row(text, "pressure A") and "0 MPa = 819, 25 MPa = 4095" in wiring_row(text, "pressure A")
    assert "(uint32_t)compare * N / DZ_COMPARE_MAX" in text
    # What it advises for a reference of 3.3 V and an attenuator of 0.3 gives the codes of such a converter.
    advised = re.search(r'--command-signal "([^"]+)"', text)[1]
    there = command_signal(parse_signal("0..10 V x 0.3", "here"), Converter(full_V=Fraction(33, 10)))
    got = command_signal(parse_signal(advised, "here"), target_named("cortex-m4").inputs().converter)
    assert abs(got.full_code - there.full_code) <= 1 and got.zero_code == there.zero_code
    assert "`dzdesign design` knows it from the target" not in text


def test_the_help_of_design_states_no_default_that_a_target_changes():
    helps = {argument.name: argument.help for argument in arguments_of(DesignChoices)}
    for name in ("command_signal", "pressure_a", "pressure_b"):
        known = ("the converter's whole range)", "140 ohm for 3 V.", "as upstream)")
        assert any(words in helps[name] for words in known)
        assert not re.search(r"0\.\.3 V|x 0\.3\b", helps[name])
