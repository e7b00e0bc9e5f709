"""Both forms of the core, both sides of a valve, with a transition and sensors of unlike scaling: on every input."""

import dataclasses
from fractions import Fraction

import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.design.signal_text import command_signal, parse_signal, pressure_signal
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from tests.support.synthetic import needs_compiler


@pytest.fixture(scope="module")
def two_sided(example_valve):
    """The example's valve with both sides: the thresholds of the negative one lie a fifth of a volt lower."""
    side = example_valve.positive
    lower = {
        name: dataclasses.replace(
            curve,
            u_min0_V=curve.u_min0_V - 0.2,
            offset_V=tuple(offset - 0.2 for offset in curve.offset_V),
            u_lower_V=tuple(bound - 0.2 for bound in curve.u_lower_V),
            u_threshold_V=tuple(threshold - 0.2 for threshold in curve.u_threshold_V),
            above=dataclasses.replace(curve.above, u_lower_V=tuple(bound - 0.2 for bound in curve.above.u_lower_V)),
        )
        for name, curve in side.certified.items()
    }
    opening = dataclasses.replace(side.opening_curve, u_V=tuple(u - 0.2 for u in side.opening_curve.u_V))
    tests = tuple(
        dataclasses.replace(test, u_guard_V=test.u_guard_V - 0.2, u_guard_lower_V=test.u_guard_lower_V - 0.2)
        for test in side.tests
    )
    negative = dataclasses.replace(side, certified=lower, opening_curve=opening, tests=tests)
    return dataclasses.replace(example_valve, sides={"positive": side, "negative": negative})


def firmware_folder(compensator, target: str, folder):
    firmware = generate(compensator, target)
    write_folder(folder, firmware.files, firmware.manifest)
    return folder


@pytest.mark.slow
@needs_compiler
def test_the_narrow_form_equals_the_law_on_every_input(example_compensator, tmp_path):
    result = check_all_inputs(firmware_folder(example_compensator, "avr", tmp_path / "fw"))
    # Every command at each difference of two sound pressures, 688 to 4014.
    assert result.holds and result.inputs == 4096 * (2 * (4014 - 688) + 1)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("target", ["host", "avr"])
def test_two_sides_with_a_transition_and_unlike_sensors_equal_the_law_on_every_input(two_sided, target, tmp_path):
    converter = Converter()
    signals = Signals(
        command=command_signal(parse_signal("-10..10 V x 0.15 + 1.5 V", "--command-signal"), converter),
        pressure_a=pressure_signal(
            parse_signal("4..20 mA on 149 ohm = 25 MPa", "--pressure-a"), converter, Fraction(20)
        ),
        pressure_b=pressure_signal(parse_signal("0.5..4.5 V x 0.6 = 16 MPa", "--pressure-b"), converter, Fraction(20)),
        swapped=True,
    )
    compensator = design(two_sided, DesignOptions(signals=signals, transition=Fraction(1, 100)))
    folder = firmware_folder(compensator, target, tmp_path / "fw")
    for sign in (1, -1):
        result = check_all_inputs(folder, sign)
        assert result.holds, result
        assert result.inputs > 22_000_000 and result.smallest_margin_V >= 0
