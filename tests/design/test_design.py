"""The compensator's exactness and its certificate, argued again from the ramp tests."""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import RuleError, to_json_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.ceiling import offset_ceiling
from dzdesign.design.certificate import guarded_curve
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.drive_functions import DriveFunctions
from dzdesign.design.machine import allowance_of
from dzdesign.design.options import DesignOptions
from dzdesign.design.signals import CommandSignal, Signals
from dzdesign.identify.options import IdentifyOptions
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, signals_with_span, synthetic_ramp, with_side


def compensator_of(threshold_at, pressures=(0.5, 1.0, 2.0, 3.0, 5.0), law_name="paper", **options):
    tests = [synthetic_ramp(dp, Truth(knee_rising=threshold_at(dp), slope=4 * dp**0.5)) for dp in pressures]
    valve = identify(tests)
    return valve, design(valve, DesignOptions(law=law_name, **options))


THRESHOLDS = {
    "decreasing": lambda dp: 5.5 - 0.06 * dp,
    "convex": lambda dp: 5.0 + 0.5 / (1 + dp),
    "increasing": lambda dp: 5.0 + 0.06 * dp,
    "flat": lambda dp: 4.0,
}


@pytest.fixture(scope="module", params=THRESHOLDS)
def designed(request):
    threshold = THRESHOLDS[request.param]
    return (*compensator_of(threshold), threshold)


@pytest.mark.slow
def test_zero_command_stays_under_the_true_closing_threshold_at_every_pressure_code(designed):
    valve, compensator, threshold = designed
    low, high = valve.positive.valid_dp_MPa
    for code in range(compensator.signals.largest_difference(1) + 1):
        dp = float(compensator.signals.dp_MPa(code))
        if low <= dp <= high:
            drive = compensator.compare(0, code) / compensator.signals.compare_max * 10
            assert drive < threshold(dp) - 0.1


def test_beta_never_exceeds_one_up_to_the_reference(designed):
    valve, compensator, _ = designed
    code = int(compensator.signals.dp_code(Fraction(repr(valve.positive.reference.dp_MPa))))
    assert all(compensator.beta(each) <= 1 + Fraction(1, 1000) for each in range(code + 1))


def test_single_pressure_gives_a_constant_offset():
    _, compensator = compensator_of(lambda dp: 5.0, pressures=(1.0,))
    assert len(set(compensator.positive.beta)) == 1
    assert compensator.positive.certificate.dp_MPa[0] == compensator.positive.certificate.dp_MPa[1]


def test_law_paper_is_equation_18(example_compensator):
    # Written out here, independently of derivation: (beta kappa - beta + 1) x + beta u_min0.
    c = example_compensator
    for dp_code in (0, 205, 600, 1023, 3326):
        beta, share = c.law_beta(dp_code), Fraction(1234, 4095)
        side = c.positive
        expected = (beta * side.drive_range_over_u_max - beta + 1) * share + beta * side.u_min0_over_u_max
        assert c.drive(1234, dp_code) == expected


def test_law_target_keeps_the_gain(example_valve):
    c = design(example_valve, DesignOptions(law="target"))
    rises = {Fraction(4095, 4000) * (c.drive(4095, code) - c.drive(95, code)) for code in (0, 300, 1000)}
    assert rises == {c.positive.drive_range_over_u_max}


def test_halves_round_up():
    signals = Signals(command=CommandSignal(full_code=2), compare_max=1)
    _, compensator = compensator_of(lambda dp: 5.0, pressures=(1.0,), transition=Fraction(0))
    exact = with_side(
        dataclasses.replace(compensator, signals=signals, drive_functions=DriveFunctions(compare_limit=1)),
        drive_range_over_u_max=Fraction(1, 2),
        u_min0_over_u_max=Fraction(1, 4),
        beta=tuple(1 << 15 for _ in compensator.positive.beta),
    )
    # 1/4 + 1/4 = 1/2 of one count.
    assert exact.compare(1, 0) == 1


def test_failed_sensor_takes_the_smallest_beta(example_compensator):
    c = example_compensator
    assert c.beta(-c.reverse_codes) == c.beta(0)
    assert c.beta(-c.reverse_codes - 1) == min(c.beta(code) for code in range(c.signals.largest_difference(1) + 1))


def test_document_round_trip(example_compensator):
    text = to_json_bytes(example_compensator).decode()
    assert read_artefact(text.encode(), Compensator, "compensator.json") == example_compensator


def with_curve(side, **changes):
    """Return a side whose closing curve is changed."""
    curve = dataclasses.replace(side.certified["closing"], **changes)
    return dataclasses.replace(side, certified={**side.certified, "closing": curve})


def test_a_valve_file_that_contradicts_itself_is_refused(example_valve, wording):
    side = example_valve.positive
    higher = {"u_min0_V": side.curve.u_min0_V + 0.02, "offset_V": tuple(u + 0.02 for u in side.curve.offset_V)}
    with pytest.raises(RuleError) as caught:
        with_curve(side, **higher)
    wording("design: a valve that contradicts itself", str(caught.value))
    greedy = dataclasses.replace(guarded_curve(side, "closing", "hold"), offset_V=(Fraction(6), Fraction(6)))
    greedy = dataclasses.replace(greedy, dp_MPa=(greedy.dp_MPa[0], greedy.dp_MPa[-1]))
    with pytest.raises(RequirementError):
        offset_ceiling(greedy, Fraction(10), allowance_of(DesignOptions().signals))


def test_span_must_reach_the_tested_pressures(example_valve, wording):
    with pytest.raises(InputError) as caught:
        design(example_valve, DesignOptions(signals=signals_with_span(Fraction(4))))
    wording("design: a short span", str(caught.value))


def test_a_law_that_would_fall_with_command_is_refused():
    """Below dP0 of 3 MPa beta is 1.5, and a valve whose stroke takes next to no command leaves no gain there."""
    tests = [synthetic_ramp(dp, Truth(knee_rising=6.5 - 1.0 * dp, slope=4 * dp**0.5)) for dp in (0.5, 1.0, 3.0)]
    valve = identify(tests, IdentifyOptions(dp0=3e6))
    side = dataclasses.replace(valve.positive, k_x_max_over_u_max=2e-3)
    with pytest.raises(InputError, match="would fall with rising command"):
        design(dataclasses.replace(valve, sides={"positive": side}), DesignOptions(below_dp0="extend"))


def test_loss_against_the_certified_curve_is_small(example_valve, example_compensator):
    """The table gives away little: on average under a count of command noise, 5 mV."""
    side, c = example_valve.positive, example_compensator
    low, high = (round(float(c.signals.dp_code(Fraction(repr(dp))))) for dp in side.valid_dp_MPa)
    codes = np.arange(low, high + 1)
    table = np.array([float(c.drive(0, int(code))) for code in codes]) * 10
    dp = np.array([float(c.signals.dp_MPa(int(code))) for code in codes])
    curve, held = np.interp(dp, side.curve.offset_dp_MPa, side.curve.offset_V), side.curve.u_min0_V
    loss = np.minimum(curve, np.where(dp <= side.reference.dp_MPa, held, 99)) - table
    assert loss.min() > 0
    assert loss.mean() < 0.005


def test_full_command_gives_full_drive_at_the_reference(example_compensator):
    # The law starts below the knee; its travel is counted from there, so no flow is lost at the top.
    code = int(example_compensator.signals.dp_code(Fraction(1)))
    assert example_compensator.compare(4095, code) >= 59990


def test_a_valve_without_its_falling_branch_needs_a_word(wording):
    valve = identify([synthetic_ramp(dp, Truth(), falling=False) for dp in (1.0,)])
    with pytest.raises(InputError) as caught:
        design(valve)
    wording("design: no falling branch", str(caught.value))
    assert design(valve, DesignOptions(guard="opening")).positive.certificate.guard == "opening"
