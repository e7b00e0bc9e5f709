"""Options of `design`: what a text becomes; what it costs is said, and what would do nothing, or harm, is refused."""

import dataclasses
import json
import re
from fractions import Fraction

import pytest

from dzdesign.codegen.project import target_named
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.designing import design
from dzdesign.design.signal_text import command_error_of
from dzdesign.design.signals import CommandSignal
from dzdesign.design.target_inputs import Converter
from dzdesign.identify.valve.model import ValveModel
from tests.support.attacked_firmware import sealed
from tests.support.designs import BOTH_SIGNS, CURRENT, MACHINES, designed, options
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.paths import ROOT

DUTY, AMPLIFIER = MACHINES["duty"], MACHINES["amplifier"]

REFUSED = [
    ({"output_max": "40 %"}, "the largest output is 40.0% of full drive, but the valve opens at"),
    ({"output_max": "0.0005 %"}, "so nothing would ever flow"),
    ({"output_max": "0 %"}, "expected more than 0, up to 100%"),
    ({"transition": "7 %"}, "choose one of 3.14 % (128 codes) at most"),
    ({"transition": "20 %"}, "--transition is '20 %', expected 0 to 10%"),
    ({"transition": "0.03 %"}, "a transition of 0.030% is 1 codes of the command"),
    ({"ramp_up": "0.1 ms"}, "a ramp takes 0.0001 s, expected 0 (none), or from one sample"),
    ({"ramp_up": "1e4 s"}, "a ramp takes 10000 s"),
    ({"dither": "1 kHz 1 %"}, "the dither's frequency is 1000 Hz, expected 100 to 300 Hz"),
    ({"dither": "150 Hz"}, "expected 'off', or a frequency in Hz and the wave's peak"),
    ({"dither": "150 Hz 0 %"}, "a dither needs both"),
    ({"dither": "150 Hz 0.0005 %"}, "less than half a count of the PWM"),
    ({"command_error": "15 + 9 codes", "transition": "1 %"}, "the noise's peak of 9; give --transition 1.563%"),
    ({"command_error": "500 + 4 codes"}, "a zero band of 504 codes and a transition of 32 take 536"),
    ({"command_error": "15 + 0 codes"}, "no converter is without noise"),
    ({"command_error": "15 codes"}, "expected the offset and the noise's peak"),
    ({"command_error": "1/0 codes + 4 codes"}, "expected the offset and the noise's peak"),
    ({"reading_flow": "1e9 L/min"}, "expected at most 1e+06 L/min"),
    ({"reading_flow": "0 L/min"}, "expected more than zero"),
    ({"pressure_a": "0..3 V = 0 MPa"}, "the sensor's span is 0 MPa"),
    ({"pressure_a": "0..3 V = 5.5 MPa", "pressure_b": "0..3 V = 1500 MPa"}, "MPa are too unlike"),
    ({"command_signal": "0..5 V x 0.6 = 0..5 V"}, "stands for 5 V"),
    ({"guard": "closed"}, "did you mean 'closing'"),
    ({"below_dp0": "hod"}, "did you mean 'hold'"),
    # A declared machine: contradictions, and ranges that are none.
    ({"coil_temperature": "-20..80 degC"}, "--supply"),
    ({"supply": "18..32 V"}, "--coil-temperature"),
    ({"bench_coil": "20 degC"}, "--coil-temperature"),
    ({"bench_supply": "24 V"}, "--supply"),
    ({"oil": "0.2 %"}, "--oil"),
    ({"pressure_error": "0.1 %"}, "--pressure-error"),
    ({"current_error": "1 %"}, "--drive current"),
    ({"bench_current": "1 A"}, "--drive current"),
    (CURRENT | AMPLIFIER, "--amplifier"),
    (CURRENT | {"coil_temperature": "-20..80 degC"}, "--coil-temperature"),
    (CURRENT | {"bench_supply": "24 V"}, "--bench-supply"),
    (CURRENT | {"bench_current": "0 A"}, "--bench-current"),
    (CURRENT | {"supply": "24 V"}, "--supply"),
    (CURRENT | {"bench_current": "0.96 A +- 5 %"}, "--rated-current"),
    (DUTY | {"coil_temperature": "80..-20 degC"}, "--coil-temperature"),
    (DUTY | {"coil_temperature": "20"}, "--coil-temperature"),
    (DUTY | {"coil_temperature": "-300..80 degC"}, "temperature"),
    (DUTY | {"supply": "9..32 V"}, "--bench-supply"),
    (DUTY | {"supply": "0..32 V"}, "--supply"),
    (DUTY | {"bench_coil": "0..20 degC"}, "--bench-coil"),
    ({"amplifier": "60 %"}, "--amplifier"),
    ({"amplifier": "1"}, "--amplifier"),
    (AMPLIFIER | {"pressure_converter": "15 codes"}, "--pressure-converter"),
    (AMPLIFIER | {"pressure_error": "0.1 % / 1 % / 2 % / 3 %"}, "--pressure-error"),
    (AMPLIFIER | {"bench_pressure_error": "-1 MPa"}, "--bench-pressure-error"),
    # Debounce, latch and interlock.
    ({"fault_debounce": "0 samples"}, "--fault-debounce is 0 samples, expected 1 to 10000"),
    ({"fault_debounce": "9 s"}, "--fault-debounce is 11250 samples, expected 1 to 10000"),
    ({"fault_debounce": "-4 ms"}, "--fault-debounce is -5 samples, expected 1 to 10000"),
    ({"fault_debounce": "5"}, "--fault-debounce is '5', expected '5 samples' or a time"),
    ({"fault_debounce": "2.5 samples"}, "--fault-debounce is '2.5 samples', expected '5 samples' or a time"),
    ({"fault_latch": "yes"}, "--fault-latch is 'yes', expected on or off"),
    ({"interlock": "1"}, "--interlock is '1', expected on or off"),
    # A controlled current.
    (CURRENT | {"drive": "curent"}, "--drive"),
    (CURRENT | {"drive": "duty"}, "--coil"),
    (CURRENT | {"coil": ""}, "--coil"),
    (CURRENT | {"coil": "3.5 ohm"}, "--coil"),
    (CURRENT | {"coil": "3.5 V 40 mH"}, "--coil"),
    (CURRENT | {"coil": "0 ohm 40 mH"}, "--coil"),
    (CURRENT | {"supply": "32..18 V"}, "--supply"),
    (CURRENT | {"rated_current": "1"}, "--rated-current"),
    (CURRENT | {"current_signal": "0..1.2 A on 4 ohm"}, "4"),
    (CURRENT | {"current_signal": "0..1.1 A on 2 ohm + 0.15 V"}, "which ends at 1.1 A, expected 1.2 A or more"),
    (CURRENT | {"current_signal": "0..1.2 A on 2 ohm + 0.15 V = 0..2.4 A"}, "--current-signal"),
    (CURRENT | {"current_signal": "0..1.2 V x 2 + 0.15 V"}, "--current-signal"),
    (CURRENT | {"supply_signal": "0..24 V x 0.075"}, "--supply-signal"),
]


@pytest.mark.parametrize(("texts", "words"), REFUSED)
def test_what_would_do_nothing_or_harm_is_refused(example_valve, texts, words):
    with pytest.raises(InputError) as refused:
        designed(example_valve, **texts)
    assert words in str(refused.value)


SAID = [
    ({"dither": "300 Hz 1%"}, "of which 100.00 mV are the dither's peak"),
    ({"polarity": "inverted"}, "command that reads code 0 is taken for 100% of command"),
    (
        {"pressure_a": "0..3 V", "accept": "broken-sensor"},
        "of sensor A a broken wire and a reading above the span can't be told from a pressure",
    ),
    ({"pressure_b": "4..20 mA on 150 ohm = 25 MPa"}, "of sensor B a reading above the span can't be told"),
]


@pytest.mark.parametrize(("texts", "words"), SAID)
def test_what_an_option_costs_or_hides_is_said(example_valve, texts, words):
    assert any(words in line for line in designed(example_valve, **texts).costs)


def test_the_command_line_refuses_and_writes_nothing(example_valve, tmp_path, capsys):
    """What only a command of both signs has a use for, a key that is there twice; and the drive's end is printed."""
    path, output = tmp_path / "valve.json", tmp_path / "compensator.json"
    path.write_bytes(to_json_bytes(example_valve))
    for given, words in (
        (("--negative-dp", "B-A"), "--negative-dp is for a command of both signs"),
        (("--ramp-down", "1 s / 2 s"), "the second time of --ramp-down is for a command of both signs"),
    ):
        assert main(["design", str(path), *given, "-o", str(output)]) == 2
        assert words in capsys.readouterr().err and not output.exists()
    assert main(["-v", "design", str(path), "--output-max", "90 %", "-o", str(output)]) == 0
    assert re.search(r"90\.00 from \d+\.\d % on", capsys.readouterr().out)
    path.write_text(path.read_text().replace('"schema":', '"schema": "dzdesign.valve/0",\n  "schema":', 1))
    assert main(["design", str(path), "-o", str(output)]) == 2
    assert "the key 'schema' is there twice" in capsys.readouterr().err


def test_a_side_that_is_left_out_is_named():
    valve = golden_valve(FULL)
    assert any("the valve's negative side is left out" in line for line in designed(valve).costs)
    both = designed(valve, command_signal=BOTH_SIGNS, command_error="1.9 % + 1 code").costs
    assert not any("left out" in line for line in both) and any("must pass zero by 2.05%" in line for line in both)


def test_a_guard_that_one_side_lacks_is_refused_with_those_that_serve_both():
    document = json.loads(to_json_bytes(golden_valve(FULL)))
    del document["sides"]["negative"]["certified"]["mean"]
    valve = read_artefact(json.dumps(sealed(document)).encode(), ValveModel, "valve.json")
    with pytest.raises(InputError, match=r"negative side's ramp tests do not bound the mean .* take --guard closing"):
        designed(valve, command_signal=BOTH_SIGNS, guard="mean")


@pytest.mark.parametrize("guard", ["closing */ int evil = 1; /*", "{x}", "x"])
def test_a_guard_that_is_none_is_refused_in_a_file(example_compensator, tmp_path, capsys, guard):
    document = json.loads(to_json_bytes(example_compensator))
    document["sides"]["positive"]["certificate"]["guard"] = guard
    path = tmp_path / "edited.json"
    path.write_text(json.dumps(document))
    assert main(["codegen", str(path), "--target", "host", "-o", str(tmp_path / "fw")]) == 2
    assert "'sides.positive.certificate.guard' is" in capsys.readouterr().err and not (tmp_path / "fw").exists()


def test_the_integers_of_the_drive_functions():
    found = options(
        command_signal=BOTH_SIGNS, transition="1 %", ramp_up="0.5 s / 0.8 s", dither="150 Hz 1 %", output_max="90 %"
    )
    functions = found.drive_functions(found.transition_codes())
    assert found.transition_codes() == 16  # 1 % of 2047 codes is 20: the power of two below
    # 0.5 s are 625 samples: 2047 codes * 65536 / 625; of negative commands 2048 codes in 1000.
    assert functions.ramp_up == (round(2047 * 65536 / 625), round(2048 * 65536 / 1000))
    assert functions.ramp_down == (0, 0)
    assert (functions.dither_counts, functions.dither_ticks) == (600, 8)  # 2500 Hz / 16 = 156 Hz
    # Of the F28335's converter: 15 codes of offset, half of 30 of the gain, 4 of noise; from rest 5 more.
    assert (found.error.zero_band_codes, functions.leave_zero_codes) == (34, 39)
    assert (functions.compare_limit, options().drive_functions(32).leave_zero_codes) == (54000, 24)
    assert options().drive_functions(0).leave_zero_codes == 0  # one sign has no other solenoid
    watched = options(fault_debounce="4.1 ms", fault_latch="on", interlock="off")
    assert (watched.fault_samples, watched.fault_latch, watched.interlock) == (6, True, False)
    assert (options().fault_samples, options(fault_debounce="1 sample").fault_samples) == (5, 1)


@pytest.mark.parametrize(("signal", "band"), [("0..10 V x 0.3", 19), (BOTH_SIGNS, 34), ("4..20 mA on 150 ohm", 25)])
def test_the_gain_error_counts_as_far_as_zero_lies_up_the_converters_range(signal, band):
    assert options(command_signal=signal).error.zero_band_codes == band


@pytest.mark.parametrize(("name", "error"), [("f28335", (15, 30, 4)), ("f280049c", (5, 45, 4)), ("host", (15, 30, 4))])
def test_the_errors_are_those_of_the_targets_data_sheet(name, error):
    """SPRS439Q and SPRS945G, as the table of docs/concepts/residual.md has them."""
    converter = target_named(name).converter
    assert (converter.offset_codes, converter.gain_codes, converter.noise_codes) == error
    page = (ROOT / "docs" / "concepts" / "residual.md").read_text(encoding="utf-8")
    assert re.search(rf"`{name}` \| {error[0]} codes \| {error[1]} codes \| {error[2]} codes \|", page)


@pytest.mark.parametrize(("text", "codes"), [("0.4 % + 0.1 %", (17, 5)), ("14.5 + 3.5 codes", (15, 4))])
def test_a_declared_error_is_rounded_up_to_codes(text, codes):
    error = command_error_of(text, Converter(), CommandSignal())
    assert (error.offset_codes, error.noise_codes) == codes  # of 4095: 16.4 and 4.1 codes


def test_the_words_of_a_machine_are_the_declared_numbers():
    machine = options(
        coil_temperature="-4 .. 176 °F", bench_coil="25 C", supply="9..16 V", pressure_error="0.1 % / 0.05 MPa",
        bench_pressure_error="0.3 bar", pressure_converter="2 + 5 + 1 codes", oil="0.3 %",
    ).machine  # fmt: skip
    assert machine.coil_temperature_C == (-20.0, 80.0) and machine.bench_coil_C == 25.0
    assert machine.supply_V == (9.0, 16.0) and machine.bench_supply_V == 12.0
    assert (machine.pressure_error_a_MPa, machine.pressure_error_b_MPa) == (0.02, 0.05)
    assert machine.bench_pressure_error_MPa == 0.03 and machine.oil_error == 0.003
    assert (machine.pressure_offset_codes, machine.pressure_gain_codes, machine.pressure_noise_codes) == (2, 5, 1)
    assert set(machine.defaults) == {"bench_supply_V", "ageing_error"}


def test_a_valve_that_lacks_what_is_asked_for_is_refused(example_valve, wording):
    without_opening = dataclasses.replace(example_valve.positive, opening_curve=None)
    with wording.refusal(InputError, "design: a transition without an opening branch"):
        designed(dataclasses.replace(example_valve, sides={"positive": without_opening}), transition="1 %")
    with wording.refusal(InputError, "design: an untested side"):
        designed(example_valve, command_signal=BOTH_SIGNS)
    with wording.refusal(InputError, "design: an untested positive side"):
        negative = dataclasses.replace(example_valve, sides={"negative": example_valve.positive})
        designed(negative, command_signal=BOTH_SIGNS)
    with wording.refusal(InputError, "design: a short span"):
        designed(example_valve, pressure_span="4 MPa")


def test_a_valve_without_an_opening_branch_has_no_transition_unless_asked(example_valve):
    side = dataclasses.replace(example_valve.positive, opening_curve=None)
    plain = design(dataclasses.replace(example_valve, sides={"positive": side}))
    assert (plain.transition_codes, plain.zero_band_codes) == (0, 0)
    assert any("no transition, so no zero band" in line for line in plain.costs)


def test_below_the_reference_beta_is_held_or_extended(example_valve):
    held, extended = (designed(example_valve, below_dp0=below, transition="off") for below in ("hold", "extend"))
    below, above = (round(held.signals.pair(1).dp_code(dp)) for dp in (Fraction(6, 10), Fraction(3)))
    assert held.beta(below) <= 1 < extended.beta(below)
    assert held.compare(0, above) == pytest.approx(extended.compare(0, above), abs=2)
