"""The compensator's exactness, its certificate and its transition, argued again from the ramp tests and in the loop."""

import dataclasses
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import RuleError
from dzdesign.core.errors import InputError
from dzdesign.design.costs_at_tests import read_dead_zone
from dzdesign.design.designing import design
from dzdesign.design.drive_functions import DriveFunctions
from dzdesign.design.signals import CommandSignal, Signals
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.recorded_curve import RecordedBranch, RecordedCurve
from dzdesign.regeneration import regenerated
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.verification import Asked, verify
from tests.support.designs import designed as designed_for
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp, with_side


def compensator_of(threshold_at, pressures=(0.5, 1.0, 2.0, 3.0, 5.0), law_name="paper", **options):
    tests = [synthetic_ramp(dp, Truth(knee_rising=threshold_at(dp), slope=4 * dp**0.5)) for dp in pressures]
    valve = identify(tests)
    return valve, designed_for(valve, law=law_name, **options)


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


def test_zero_command_stays_under_the_true_closing_threshold_at_every_pressure_code(designed):
    valve, compensator, threshold = designed
    low, high = valve.positive.valid_dp_MPa
    for code in range(compensator.signals.pair(1).largest_difference + 1):
        dp = float(compensator.signals.pair(1).dp_MPa(code))
        if low <= dp <= high:
            drive = compensator.compare(0, code) / compensator.signals.compare_max * 10
            assert drive < threshold(dp) - 0.1


def test_beta_never_exceeds_one_up_to_the_reference(designed):
    valve, compensator, _ = designed
    code = int(compensator.signals.pair(1).dp_code(Fraction(repr(valve.positive.reference.dp_MPa))))
    assert all(compensator.beta(each) <= 1 + Fraction(1, 1000) for each in range(code + 1))


def test_law_paper_is_equation_18(example_compensator):
    # Written out here, independently of derivation: (beta kappa - beta + 1) x + beta u_min0.
    c = example_compensator
    for dp_code in (0, 205, 600, 1023, 3326):
        beta, share = c.law_beta(dp_code), Fraction(1234, 4095)
        side = c.positive
        expected = (beta * side.drive_range_over_u_max - beta + 1) * share + beta * side.u_min0_over_u_max
        assert c.drive(1234, dp_code) == expected


def test_law_target_keeps_the_gain(example_valve):
    c = designed_for(example_valve, law="target")
    rises = {Fraction(4095, 4000) * (c.drive(4095, code) - c.drive(95, code)) for code in (0, 300, 1000)}
    assert rises == {c.positive.drive_range_over_u_max}


def test_halves_round_up():
    signals = Signals(command=CommandSignal(full_code=2), compare_max=1)
    _, compensator = compensator_of(lambda dp: 5.0, pressures=(1.0,), transition="off")
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
    assert c.beta(-c.reverse_codes - 1) == min(c.beta(code) for code in range(c.signals.pair(1).largest_difference + 1))


def with_curve(side, **changes):
    """Return a side whose closing curve is changed."""
    curve = dataclasses.replace(side.certified["closing"], **changes)
    return dataclasses.replace(side, certified={**side.certified, "closing": curve})


def test_a_valve_file_that_contradicts_itself_is_refused(example_valve, wording):
    side = example_valve.positive
    higher = {"u_min0_V": side.curve.u_min0_V + 0.02, "offset_V": tuple(u + 0.02 for u in side.curve.offset_V)}
    with wording.refusal(RuleError, "design: a valve that contradicts itself"):
        with_curve(side, **higher)


def test_a_law_that_would_fall_with_command_is_refused():
    """Below dP0 of 3 MPa beta is 1.5, and a valve whose stroke takes next to no command leaves no gain there."""
    tests = [synthetic_ramp(dp, Truth(knee_rising=6.5 - 1.0 * dp, slope=4 * dp**0.5)) for dp in (0.5, 1.0, 3.0)]
    valve = identify(tests, IdentifyOptions(dp0=3e6))
    jump = RecordedBranch(u_V=(3.4, 3.5), q_L_min=(0.0, 9.0), u_seen_V=3.4, error_L_min=0.0)
    recorded = RecordedCurve(rising=jump, falling=None, dp_at_flow_MPa=None)
    jumping = tuple(dataclasses.replace(test, recorded=recorded) for test in valve.positive.tests)
    side = dataclasses.replace(valve.positive, k_x_max_over_u_max=2e-3, tests=jumping)
    with pytest.raises(InputError, match="would fall with rising command"):
        designed_for(dataclasses.replace(valve, sides={"positive": side}), below_dp0="extend")


@pytest.mark.parametrize("bend", [0.87, 0.95])
def test_a_curved_flow_is_driven_to_its_end(bend):
    """A flow that bends away from its line, without a stop, ends below k x_max."""

    def bent(test):
        branch = test.recorded.rising
        knee, full = test.u_knee_rising_V, branch.u_V[-1]
        share = [min(max((u - knee) / (full - knee), 0.0), 1.0) for u in branch.u_V]
        flows = tuple(q * (1 - (1 - bend) * part) for q, part in zip(branch.q_L_min, share, strict=True))
        curve = dataclasses.replace(test.recorded, rising=dataclasses.replace(branch, q_L_min=flows))
        return dataclasses.replace(test, recorded=curve)

    tests = [synthetic_ramp(dp, Truth(knee_rising=5.5 - 0.05 * dp, slope=4 * dp**0.5)) for dp in (1.0, 3.0, 5.0)]
    valve = identify(tests, IdentifyOptions())
    side = valve.positive
    curved = dataclasses.replace(
        side, k_x_max_over_u_max=bend * side.k_x_max_over_u_max, tests=tuple(map(bent, side.tests))
    )
    compensator = designed_for(dataclasses.replace(valve, sides={"positive": curved}))
    for test in curved.tests:
        full = float(compensator.drive(compensator.signals.code_max, compensator.signals.pair(1).code_at(test.dp_MPa)))
        flow = test.recorded.rising.flow_at(10 * full)
        assert flow >= 0.975 * max(test.recorded.rising.q_L_min)


def test_loss_against_the_certified_curve_is_small(example_valve, example_compensator):
    """The table gives away little: on average under a count of command noise, 5 mV."""
    side, c = example_valve.positive, example_compensator
    low, high = (round(float(c.signals.pair(1).dp_code(Fraction(repr(dp))))) for dp in side.valid_dp_MPa)
    codes = np.arange(low, high + 1)
    table = np.array([float(c.drive(0, int(code))) for code in codes]) * 10
    dp = np.array([float(c.signals.pair(1).dp_MPa(int(code))) for code in codes])
    curve, held = np.interp(dp, side.curve.offset_dp_MPa, side.curve.offset_V), side.curve.u_min0_V
    loss = np.minimum(curve, np.where(dp <= side.reference.dp_MPa, held, 99)) - table
    assert loss.min() > 0
    assert loss.mean() < 0.005


def test_full_command_gives_full_drive_at_the_reference(example_compensator):
    # The law starts below the knee; its travel is counted from there, so no flow is lost at the top.
    code = int(example_compensator.signals.pair(1).dp_code(Fraction(1)))
    assert example_compensator.compare(4095, code) >= 59990


def test_a_valve_without_its_falling_branch_needs_a_word(wording):
    valve = identify([synthetic_ramp(dp, Truth(), falling=False) for dp in (1.0,)])
    with wording.refusal(InputError, "design: no falling branch"):
        design(valve)
    assert designed_for(valve, guard="opening").positive.certificate.guard == "opening"


@pytest.fixture(scope="module")
def with_transition(example_valve):
    return designed_for(example_valve, transition="1 %")


def test_it_runs_from_the_certified_offset_to_the_opening_law_without_a_step(with_transition, example_valve):
    plain = designed_for(example_valve, transition="off")
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
        code = round(signals.pair(1).dp_code(Fraction(repr(test.dp_MPa))))
        assert float(with_transition.drive(with_transition.transition_end, code)) * 10 > test.u_knee_rising_V


@pytest.mark.slow
@needs_compiler
def test_the_closed_loop_has_no_leak_one_per_cent_of_dead_zone_and_reads_what_design_says(example_valve, tmp_path):
    """The goal with hysteresis, PWM resolved, on the recorded characteristic.

    Two ways to the reading: the law turned round at the recorded threshold, and the generated C driving the flow.
    """
    compensator = designed_for(example_valve, transition="1 %", reading_flow="0.8 L/min")
    firmware = generate(compensator, "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    again = regenerated(tmp_path / "fw")
    found = verify(tmp_path / "fw", Asked(sequence=RampSequence(rest=0.5, ramp=40.0, top=0.5)), again)
    assert found.holds, [check for check in found.evidence.checks if not check.holds]
    for test, loop in zip(example_valve.positive.tests, found.loops, strict=True):
        result, said = loop.result, read_dead_zone(compensator, test)
        assert result.q_zero_L_min <= 1e-9 and result.residual_opening <= 24 / 4095 + 0.008
        assert result.reading_flow_L_min == 0.8 and result.ideal_line == pytest.approx(0.8 / result.q_max_L_min)
        assert result.reading_opening == pytest.approx(said["opening"], abs=2e-3)
        assert result.reading_closing == pytest.approx(said["closing"], abs=2e-3)
        assert result.residual_opening < result.reading_opening < result.reading_opening_without


@pytest.mark.parametrize("curve", [None, "line", "monotone"])
def test_between_two_pressures_a_premise_must_be_declared(curve):
    ramps = [synthetic_ramp(dp, Truth(knee_rising=5.5 - 0.05 * dp, slope=4 * dp**0.5)) for dp in (1.0, 5.0)]
    valve = identify(ramps, IdentifyOptions(meter_lag=0.0, curve=curve))
    both = valve.positive.curve
    for dp, low in zip(both.dp_MPa, both.u_lower_V, strict=True):
        # Of one that runs one way both tests have the lower bound: behind the first it may fall at once.
        assert 5.2 - 0.05 * (5.0 if curve == "monotone" else dp) < low < 5.4 - 0.05 * dp
    if curve:
        assert design(valve).positive.certificate.smallest_margin_V >= 0
        return
    assert both.premise == "none" and both.bound().at(Fraction(3)) is None and both.above is None
    with pytest.raises(InputError, match=r"line leaves a dead zone of .* %, monotone leaves a dead zone of .* %"):
        design(valve)
