"""The transition and the other choices of design: what they promise, on the exact law and in the closed loop."""

import dataclasses
import json
import re
from fractions import Fraction
from itertools import pairwise

import pytest

from dzdesign.codegen.project import target_named
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import InputError
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions, options_of
from dzdesign.regeneration import regenerated
from dzdesign.verify.closed_loop.loop import RampSequence
from tests.support.paths import ROOT
from tests.support.synthetic import SHARED, needs_compiler

TRANSITION = options_of({"transition": "1 %"}, target_named("f28335").inputs())


@pytest.fixture(scope="module")
def with_transition(example_valve):
    return design(example_valve, TRANSITION)


def test_it_runs_from_the_certified_offset_to_the_opening_law_without_a_step(with_transition, example_valve):
    plain = design(example_valve, DesignOptions(transition=Fraction(0)))
    band, end = with_transition.zero_band_codes, with_transition.transition_end
    assert (band, end) == (19, 51)
    u_max = float(with_transition.u_max_V)
    for dp_code in range(0, 1100, 50):
        drives = [with_transition.drive(command, dp_code) for command in range(end + 3)]
        # Zero command: the same certified curve as without a transition, to within the nodes' rounding.
        assert float(abs(drives[0] - plain.drive(0, dp_code))) * u_max < 1e-3
        rises = [right - left for left, right in pairwise(drives)]
        assert not any(rises[:band]) and all(rise > 0 for rise in rises[band:])
        assert len(set(rises[band:end])) == 1 and len(set(rises[end:])) == 1  # two straight parts that meet
        # Beyond the transition the law goes on as a law of the opening threshold's beta, Eq. (18).
        for command in (end, end + 2, 2000, 4095):
            side, beta, share = with_transition.positive, with_transition.law_beta(dp_code), Fraction(command, 4095)
            law = (beta * side.drive_range_over_u_max - beta + 1) * share + beta * side.u_min0_over_u_max
            assert with_transition.drive(command, dp_code) == law


def test_the_transition_ends_at_or_above_the_opening_threshold_at_every_test(with_transition, example_valve):
    signals = with_transition.signals
    for test in example_valve.positive.tests:
        code = round(signals.dp_code(Fraction(repr(test.dp_MPa))))
        assert float(with_transition.drive(with_transition.transition_end, code)) * 10 > test.u_knee_rising_V


def test_a_valve_without_an_opening_branch_has_no_transition_unless_asked(example_valve):
    side = dataclasses.replace(example_valve.positive, opening_curve=None)
    plain = design(dataclasses.replace(example_valve, sides={"positive": side}))
    assert (plain.transition_codes, plain.zero_band_codes) == (0, 0)
    assert any("no transition, so no zero band" in line for line in plain.costs)


@pytest.mark.parametrize(
    ("signal", "band"),
    [("0..10 V x 0.3", 19), ("-10..10 V x 0.15 + 1.5 V", 34), ("4..20 mA on 150 ohm", 25)],
)
def test_the_gain_error_counts_as_far_as_zero_lies_up_the_converters_range(signal, band):
    from dzdesign.design.signal_text import command_error_of, command_signal, parse_signal
    from dzdesign.design.target_inputs import Converter

    command = command_signal(parse_signal(signal, "--command-signal"), Converter())
    assert command_error_of("", Converter(), command).zero_band_codes == band


@pytest.mark.parametrize(("name", "error"), [("f28335", (15, 30, 4)), ("f280049c", (5, 45, 4)), ("host", (15, 30, 4))])
def test_the_errors_are_those_of_the_targets_data_sheet(name, error):
    """SPRS439Q and SPRS945G, as the table of docs/concepts/residual.md has them."""
    converter = target_named(name).converter
    assert (converter.offset_codes, converter.gain_codes, converter.noise_codes) == error
    page = (ROOT / "docs" / "concepts" / "residual.md").read_text(encoding="utf-8")
    assert re.search(rf"`{name}` \| {error[0]} codes \| {error[1]} codes \| {error[2]} codes \|", page)


def test_a_declared_error_is_rounded_up_to_codes():
    from dzdesign.design.signal_text import command_error_of
    from dzdesign.design.signals import CommandSignal
    from dzdesign.design.target_inputs import Converter

    error = command_error_of("0.4 % + 0.1 %", Converter(), CommandSignal())
    assert (error.offset_codes, error.noise_codes) == (17, 5)  # 16.4 and 4.1 codes of 4095
    error = command_error_of("14.5 + 3.5 codes", Converter(), CommandSignal())
    assert (error.offset_codes, error.noise_codes) == (15, 4)


@pytest.mark.slow
@needs_compiler
def test_no_leak_and_one_per_cent_of_dead_zone_on_the_example(with_transition, example_folder, tmp_path):
    """The goal in the closed loop with hysteresis, PWM resolved: the plant is the one of the recordings."""
    from dzdesign.codegen.project import generate
    from dzdesign.verify.closed_loop.plant import read_plant
    from dzdesign.verify.verification import verify

    firmware = generate(with_transition, "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    plant = read_plant(example_folder / "plant.toml")
    again = regenerated(tmp_path / "fw")
    result = verify(tmp_path / "fw", plant, again=again, sequence=RampSequence(rest=1.0, ramp=40.0, top=1.0))
    assert result.holds, [check for check in result.evidence.checks if not check.holds]
    for loop in result.loops:
        assert loop.result.q_zero_L_min <= 1e-9
        assert loop.result.residual_opening <= 24 / 4095 + 0.008


@pytest.mark.slow
@needs_compiler
@pytest.mark.skipif(not SHARED.is_dir(), reason=f"the shared measurements are not at {SHARED}")
def test_no_leak_and_one_per_cent_of_dead_zone_on_valve_a(tmp_path, capsys):
    files = sorted(map(str, (SHARED / "valve_a").glob("*.csv.gz")))
    valve, firmware, evidence = (str(tmp_path / name) for name in ("valve.json", "firmware", "evidence"))
    assert main(["identify", *files, "--meter-lag", "0.1 s", "-o", valve]) == 0
    assert main(["codegen", valve, "-o", firmware]) == 0
    assert main(["verify", firmware, "-o", evidence, "--json"]) == 0
    out = capsys.readouterr().out
    document = json.loads(out[out.index("{\n") :])
    loops = document["closed_loop"]["pressures"]
    assert len(loops) == 6
    assert all(loop["residual_opening"] <= 24 / 4095 + 0.008 and loop["q_zero_L_min"] <= 1e-9 for loop in loops)


def test_an_edge_needs_the_opening_branch(example_valve, wording):
    side = dataclasses.replace(example_valve.positive, opening_curve=None)
    with pytest.raises(InputError) as caught:
        design(dataclasses.replace(example_valve, sides={"positive": side}), TRANSITION)
    wording("design: a transition without an opening branch", str(caught.value))


@pytest.mark.slow
def test_below_the_reference_beta_is_held_or_extended(example_valve):
    off = {"transition": Fraction(0)}
    held, extended = (design(example_valve, DesignOptions(below_dp0=below, **off)) for below in ("hold", "extend"))
    below, above = (round(held.signals.dp_code(Fraction(dp))) for dp in (Fraction(6, 10), Fraction(3)))
    assert held.beta(below) <= 1 < extended.beta(below)
    assert held.compare(0, above) == pytest.approx(extended.compare(0, above), abs=2)


def test_a_dither_stands_under_the_certified_bound_at_its_top(example_valve):
    plain = design(example_valve, DesignOptions(transition=Fraction(0)))
    dither = {"dither_Hz": 150.0, "dither_peak": Fraction(1, 100)}
    dithered = design(example_valve, DesignOptions(transition=Fraction(0), **dither))
    peak = dithered.drive_functions.dither_counts
    assert peak == 600
    for dp_code in range(150, 1000, 10):
        assert dithered.compare(0, dp_code) + peak <= plain.compare(0, dp_code) + 2


def test_both_signs_need_both_sides(example_valve, wording):
    from dzdesign.design.signal_text import command_signal, parse_signal
    from dzdesign.design.signals import Signals
    from dzdesign.design.target_inputs import Converter

    both = command_signal(parse_signal("-10..10 V x 0.15 + 1.5 V", "--command-signal"), Converter())
    with pytest.raises(InputError) as caught:
        design(example_valve, DesignOptions(signals=Signals(command=both)))
    wording("design: an untested side", str(caught.value))


def test_a_command_of_one_sign_needs_the_positive_side(example_valve, wording):
    with pytest.raises(InputError) as caught:
        design(dataclasses.replace(example_valve, sides={"negative": example_valve.positive}))
    wording("design: no positive side", str(caught.value))
