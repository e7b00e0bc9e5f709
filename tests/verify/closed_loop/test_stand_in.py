"""The stand-in plant: it is the recordings, it says where they show nothing, and what is seeded into it is seen."""

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from stand_in_flow import LIMIT, RECORDINGS, largest_miss, misses, plant_bins, recorded_bins, valve_of

from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.identify.identification import identify
from dzdesign.verify.closed_loop import loop as loop_module
from dzdesign.verify.closed_loop.dead_zone import compare_at_pressure
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.loop_checks import no_flow_at_zero, stand_in_is_the_recording
from dzdesign.verify.closed_loop.stand_in import StandIn, stand_in_of
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary
from tests.support.evidence import verify
from tests.support.synthetic import SHARED, Truth, needs_compiler, synthetic_ramp, with_side

pytestmark = needs_compiler
QUICK = RampSequence(rest=0.5, ramp=10.0, top=0.5)
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the shared measurements are not at hand")


def with_tests(side, change):
    """The side with other tests: `change` makes a test of each and its place."""
    found = [change(test, place) for place, test in enumerate(side.tests)]
    return replace(side, tests=tuple(found))


def swapped_branches(side):
    def swap(test, _):
        both = replace(test.recorded, rising=test.recorded.falling, falling=test.recorded.rising)
        return replace(test, recorded=both)

    return with_tests(side, swap)


def reversed_pressures(side):
    return with_tests(side, lambda test, place: replace(test, recorded=side.tests[-1 - place].recorded))


def scaled(side, by=1.05):
    def larger(branch):
        return replace(branch, q_L_min=tuple(by * flow for flow in branch.q_L_min))

    def scale(test, _):
        curve = test.recorded
        return replace(test, recorded=replace(curve, rising=larger(curve.rising), falling=larger(curve.falling)))

    return with_tests(side, scale)


def moved(side, by_V):
    """Every recorded flow at commands so much lower: a valve that opens and closes sooner."""

    def lower(branch):
        u = (branch.u_V[0], *(command - by_V for command in branch.u_V[1:]))
        return replace(branch, u_V=u, u_seen_V=branch.u_seen_V - by_V)

    def move(test, _):
        curve = test.recorded
        return replace(test, recorded=replace(curve, rising=lower(curve.rising), falling=lower(curve.falling)))

    return with_tests(side, move)


@pytest.fixture(scope="module")
def stand_in(example_valve):
    return stand_in_of(example_valve.positive, example_valve.u_max_V)


@pytest.fixture(scope="module")
def firmware(example_compensator, tmp_path_factory):
    from dzdesign.codegen.project import generate

    folder = tmp_path_factory.mktemp("stand_in") / "fw"
    made = generate(example_compensator, "f28335")
    write_folder(folder, made.files, made.manifest)
    return folder


# --- it is the recordings -------------------------------------------------------------------------------------------


def test_its_mean_flow_is_that_of_the_raw_recordings(example_valve):
    found = list(misses(example_valve, RECORDINGS["the example"]))
    assert len(found) == 6
    assert max(miss for _, miss, _ in found) <= LIMIT, found


@pytest.mark.slow
@needs_shared
@pytest.mark.parametrize("name", ["valve_a", "valve_e"])
def test_its_mean_flow_is_that_of_recordings_from_elsewhere(name):
    valve = valve_of(SHARED / name)
    found = list(misses(valve, SHARED / name))
    assert len(found) == 6
    assert max(miss for _, miss, _ in found) <= LIMIT, found
    # Faults, seeded into a part that all pressures share: every one of them shows.
    for fault in (swapped_branches, reversed_pressures, scaled):
        loop = ClosedLoop(stand_in_of(fault(valve.positive), valve.u_max_V))
        assert max(miss for _, miss, _ in misses(valve, SHARED / name, loop)) > LIMIT, fault.__name__


@pytest.mark.parametrize("fault", [swapped_branches, reversed_pressures, scaled])
def test_a_fault_in_the_characteristic_is_seen_beside_the_raw_recordings(example_valve, fault):
    loop = ClosedLoop(stand_in_of(fault(example_valve.positive), example_valve.u_max_V))
    found = misses(example_valve, RECORDINGS["the example"], loop)
    assert max(miss for _, miss, _ in found) > LIMIT


@pytest.mark.parametrize("fault", [swapped_branches, reversed_pressures, scaled])
def test_verify_itself_sees_a_stand_in_that_is_not_the_recording(
    example_valve, firmware, example_compensator, fault, wording
):
    """What the evidence holds tells it: the flow is compared with valve.json by code that shares no table with it."""

    def checked(side):
        loop = ClosedLoop(stand_in_of(side, example_valve.u_max_V), firmware, example_compensator)
        results = [
            compare_at_pressure(loop, test.dp_MPa, 1.0, QUICK, reading_flow_L_min=0.6, recorded=test.recorded).result
            for test in (example_valve.positive.tests[0], example_valve.positive.tests[-1])
        ]
        return stand_in_is_the_recording(results, example_valve)

    assert checked(example_valve.positive).holds
    wrong = checked(fault(example_valve.positive))
    assert wrong.holds is False
    wording.of_test(wrong.text)


@pytest.mark.parametrize("shift_V", [-0.3, 0.3])
def test_a_recorded_curve_that_is_not_that_of_the_thresholds_is_no_stand_in(
    example_valve, firmware, example_compensator, shift_V
):
    """The loop takes valve.json's curve as the valve, and its flow is that curve's: only the thresholds tell."""
    side = example_valve.positive
    *others, last = side.tests
    falling = last.recorded.falling
    moved = replace(falling, u_V=tuple(u + shift_V for u in falling.u_V), u_seen_V=falling.u_seen_V + shift_V)
    tests = (*others, replace(last, recorded=replace(last.recorded, falling=moved)))
    shifted = replace(example_valve, sides={"positive": replace(side, tests=tests)})
    loop = ClosedLoop(stand_in_of(shifted.positive, shifted.u_max_V), firmware, example_compensator)
    run = compare_at_pressure(loop, last.dp_MPa, 1.0, QUICK, reading_flow_L_min=0.6, recorded=tests[-1].recorded).result
    assert run.flow_miss < LIMIT
    check = stand_in_is_the_recording([run], shifted)
    assert check.holds is False and last.source in check.text


class _Tests:
    """What a stand-in reads of a `SideModel`."""

    def __init__(self, tests):
        self.tests = tests


def left_out(valve, place):
    """The stand-in of the two tests beside one of them, beside the raw recordings of that one."""
    tests = (valve.positive.tests[place - 1], valve.positive.tests[place + 1])
    loop = ClosedLoop(StandIn(side=_Tests(tests), dynamics=stand_in_of(valve.positive, valve.u_max_V).dynamics))
    test = valve.positive.tests[place]
    recorded = recorded_bins([RECORDINGS["the example"] / name for name in test.source.split(", ")])
    return largest_miss(plant_bins(loop, test.dp_MPa, valve.meter.floor_L_min), recorded)[0]


@pytest.mark.parametrize("place", [1, 2, 3, 4])
def test_between_two_tests_it_comes_near_a_recording_that_it_never_saw(example_valve, place):
    assert left_out(example_valve, place) < 0.03


def test_between_two_tests_the_threshold_runs_straight_and_not_the_other_way_round(example_valve, monkeypatch):
    """At a quarter of the way from 1 to 5 MPa; the interpolation turned round in the C is seen."""
    tests = (example_valve.positive.tests[1], example_valve.positive.tests[-1])
    made = StandIn(side=_Tests(tests), dynamics=stand_in_of(example_valve.positive, 10.0).dynamics)
    low, high = (test.dp_MPa for test in tests)
    seen = [test.recorded.rising.u_seen_V for test in tests]
    shares = [test.noise_level_L_min / test.recorded.q_max_L_min for test in tests]

    def first_seen():
        run = ClosedLoop(made).run(RampSequence(rest=0.5, ramp=60.0, top=0.5).command(), low + (high - low) / 4)
        flows = run.q_mean_L_min / run.q_mean_L_min.max()
        return 10 * float(run.command[np.argmax(flows >= 0.75 * shares[0] + 0.25 * shares[1])])

    assert first_seen() == pytest.approx(0.75 * seen[0] + 0.25 * seen[1], abs=0.01)

    def turned_round(sources, *rest):
        right = "plant->share_above = fmin(fmax((dp - low) / (high - low), 0.0), 1.0);"
        assert right in sources["plant_curve.h"]
        wrong = right.replace("(dp - low)", "(high - dp)")
        return CompiledLibrary(sources | {"plant_curve.h": sources["plant_curve.h"].replace(right, wrong)}, *rest)

    monkeypatch.setattr(loop_module, "CompiledLibrary", turned_round)
    assert first_seen() < 0.75 * seen[0] + 0.25 * seen[1] - 0.08


def test_at_a_test_it_does_not_jump(stand_in):
    """A pressure drop just below a test's and one just above it give the test's flow."""
    loop, command = ClosedLoop(stand_in), QUICK.command()
    for test in stand_in.side.tests:
        flows = [loop.run(command, by * test.dp_MPa).q_mean_L_min for by in (1 - 1e-9, 1.0, 1 + 1e-9)]
        assert np.abs(flows[1] - flows[0]).max() < 1e-5 and np.abs(flows[2] - flows[1]).max() < 1e-5


def test_beyond_the_tests_the_flow_goes_with_the_root_of_the_pressure_drop(stand_in):
    loop, command, last = ClosedLoop(stand_in), QUICK.command(), stand_in.side.tests[-1].dp_MPa
    at, beyond = (loop.run(command, dp).q_mean_L_min.max() for dp in (last, 2.25 * last))
    # The threshold runs on, and the characteristic above it is stretched: its end is met to 1e-5.
    assert beyond == pytest.approx(1.5 * at, rel=1e-5)


def test_oil_of_another_density_scales_the_flow(stand_in):
    command = QUICK.command()
    usual, thin = (ClosedLoop(one).run(command, 1.0).q_mean_L_min.max() for one in (stand_in, _with_oil(stand_in)))
    assert thin == pytest.approx(2 * usual, rel=1e-9)


def _with_oil(stand_in):
    return stand_in.with_oil(1.0, 0.25)


# --- hysteresis -----------------------------------------------------------------------------------------------------


def test_inner_loops_stay_between_the_branches_and_their_ends_are_flat(stand_in):
    """The play in numbers, in NumPy alone: slow triangles of every size about the threshold and far above it."""
    test = stand_in.side.tests[2]
    curve = test.recorded
    corners = [0.0, 0.60, 0.54, 0.57, 0.53, 0.70, 0.685, 0.695, 0.40, 0.62, 0.0]
    command = np.concatenate([np.linspace(a, b, 2000) for a, b in pairwise(corners)])
    found = ClosedLoop(stand_in).run(command, test.dp_MPa).q_mean_L_min
    state, expected = 0.0, []
    for u in 10 * command:
        opening = float(np.interp(u, curve.rising.u_V, curve.rising.q_L_min))
        closing = float(np.interp(u, curve.falling.u_V, curve.falling.q_L_min))
        state = max(opening, min(closing, state))
        expected.append(state)
    # The ramps of 10 s and less lag by some millivolts.
    assert np.abs(found - np.array(expected)).max() < 0.01 * curve.q_max_L_min


def test_the_pulses_ripple_is_no_command(stand_in):
    """At a standing command the mean position is the command to 0.2 mV, at every duty."""
    loop = ClosedLoop(stand_in)
    steep = max(test.slope_L_min_V for test in stand_in.side.tests)
    test = stand_in.side.tests[-1]
    for share in (0.56, 0.6, 0.75, 0.9):
        command = np.concatenate([np.linspace(0, share, 2000), np.full(50, share)])  # a step would overshoot
        found = loop.run(command, test.dp_MPa).q_mean_L_min[-1]
        expected = float(test.recorded.rising.flow_at(np.array([10 * share]))[0])
        assert abs(found - expected) < 2e-4 * steep


# --- what the recordings don't show ---------------------------------------------------------------------------------


def test_below_the_noise_level_no_flow_is_none(firmware, example_compensator, wording):
    found = verify(firmware, sequence=QUICK)
    results = [loop.result for loop in found.loops]
    assert found.evidence.closed_loop.plant is None and len(results) == 6
    levels = {round(test.dp_MPa, 6): test.noise_level_L_min for test in example_compensator.valve.positive.tests}
    for result in results:
        assert result.unseen_below_L_min == pytest.approx(levels[round(result.dp_MPa, 6)])
        assert result.in_words(result.q_zero_L_min, AS_COMPUTED) == f"below {result.unseen_below_L_min:.2f}"
        assert result.in_words(result.q_max_L_min, AS_COMPUTED) == f"{result.q_max_L_min:.2f}"
    (check,) = [check for check in found.evidence.checks if check.id == "zero-flow"]
    assert check.holds and "0 L/min" not in check.text.replace("0.65 L/min", "")
    wording.of_test(check.text)


def test_it_is_no_sharper_than_the_recording(example_valve):
    """Where the first flow is seen the curve has the noise level, and it comes to none at the onset or the knee."""
    for test in example_valve.positive.tests:
        for name in ("rising", "falling"):
            branch = getattr(test.recorded, name)
            level, seen = test.noise_level_L_min, branch.u_seen_V
            assert float(branch.flow_at(np.array([seen]))[0]) == pytest.approx(level, abs=1e-3)
            assert np.all(np.array(branch.q_L_min)[np.array(branch.u_V) > seen] >= 0.9 * level)
            flowing = branch.command_at(1e-6)
            onset, knee = getattr(test, f"u_onset_{name}_V"), getattr(test, f"u_knee_{name}_V")
            assert flowing <= min(onset, knee) + 0.01 < seen


@pytest.mark.parametrize(("by_V", "part"), [(0.06, "by extrapolation"), (0.4, "at most")])
def test_a_valve_that_closes_sooner_leaks_in_the_loop(
    example_valve, firmware, example_compensator, by_V, part, wording
):
    """Seeded over-compensation: below what the recordings show it is told by their first flows, above it is seen."""
    loop = ClosedLoop(stand_in_of(moved(example_valve.positive, by_V), 10.0), firmware, example_compensator)
    results = [
        compare_at_pressure(loop, test.dp_MPa, 1.0, QUICK, reading_flow_L_min=0.6, recorded=test.recorded).result
        for test in example_valve.positive.tests[-1:]
    ]
    check = no_flow_at_zero(results, example_compensator, plant_given=False)
    assert check.holds is False and part in check.text
    wording.of_test(check.text)


@pytest.mark.slow
def test_a_law_that_over_compensates_leaks_in_the_loop_without_a_plant(example_compensator, tmp_path):
    from dzdesign.codegen.project import generate

    leaky = with_side(example_compensator, u_min0_over_u_max=Fraction(55, 100))
    made = generate(leaky, "f28335")
    write_folder(tmp_path / "fw", made.files, made.manifest)
    failed = {check.id for check in verify(tmp_path / "fw", sequence=QUICK).evidence.checks if check.holds is False}
    assert {"zero-flow", "zero-flow-after-scenarios"} <= failed


@pytest.fixture(scope="module")
def leaking_valve():
    """Two pressures, a leak of 0.4 and 1.2 L/min through the overlap."""

    def leaking(dp_MPa):
        ramp, hold = synthetic_ramp(dp_MPa, Truth(noise=0.02), seed=3), np.zeros(1000)
        q = np.concatenate([hold, ramp.q, hold]) + 0.4e-3 / 60 * dp_MPa
        q += 0.02e-3 / 60 * np.random.default_rng(5).standard_normal(q.size)
        u, dp = (np.concatenate([[a[0]] * 1000, a, [a[-1]] * 1000]) for a in (ramp.u, ramp.dp))
        return replace(ramp, time=np.arange(q.size) / 50.0, u=u, dp=dp, q=q)

    return identify([leaking(1.0), leaking(3.0)])


def test_a_leak_that_was_seen_flows_at_zero_command(leaking_valve):
    assert leaking_valve.positive.tests[0].leak_L_min == pytest.approx(0.4, abs=0.02)
    loop = ClosedLoop(stand_in_of(leaking_valve.positive, 10.0))
    for dp_MPa, leak in ((1.0, 0.4), (3.0, 1.2)):
        run = loop.run(np.zeros(50), dp_MPa)
        assert run.q_mean_L_min[-1] == pytest.approx(loop.leak_L_min(dp_MPa), rel=1e-12)
        assert loop.leak_L_min(dp_MPa) == pytest.approx(leak, abs=0.03)


@pytest.mark.slow
def test_a_leak_that_no_compensator_can_stop_is_said_and_is_no_failure(leaking_valve, tmp_path, wording):
    from dzdesign.codegen.project import generate, target_named
    from dzdesign.design.designing import design
    from dzdesign.design.options import options_of

    compensator = design(leaking_valve, options_of({}, target_named("f28335").inputs()))
    made = generate(compensator, "f28335")
    write_folder(tmp_path / "fw", made.files, made.manifest)
    found = verify(tmp_path / "fw", sequence=QUICK)
    checks = {check.id: check for check in found.evidence.checks}
    assert checks["zero-flow"].holds and checks["zero-flow-after-scenarios"].holds
    assert "which no compensator can stop" in checks["zero-flow"].text
    leak = found.loops[-1].result.leak_L_min
    assert leak == pytest.approx(1.2, abs=0.03) and found.loops[-1].result.q_zero_L_min == pytest.approx(leak)
    assert found.loops[-1].result.dead_zone_opening > 0.5, "a leak is no onset"


def test_a_side_without_pressure_drops_has_no_stand_in(wording):
    ramp = replace(synthetic_ramp(1.0, Truth()), dp=None)
    with wording.refusal(InputError):
        stand_in_of(identify([ramp]).positive, 10.0)


def test_recordings_at_several_pressures_have_load_steps(firmware, example_compensator):
    scenes = scenes_of(firmware, example_compensator, None)
    dp = [test.dp_MPa for test in example_compensator.valve.positive.tests]
    assert [scene.dp_MPa for scene in scenes] == dp
    assert all(scene.tested_MPa == (dp[0], dp[-1]) for scene in scenes)


@pytest.mark.slow
@needs_shared
@pytest.mark.parametrize("name", ["valve_a", "valve_e"])
def test_the_truth_behind_recordings_from_elsewhere(name):
    """Where the true flow passes 1 L/min the curve does, to the lag of the meter and 0.2 % of command."""
    import json

    truth = json.loads((SHARED / "truth.json").read_text())
    for test in valve_of(SHARED / name).positive.tests:
        known = truth[test.source.removesuffix(".csv.gz")]["pos"]
        lag_V = 0.1 * truth[test.source.removesuffix(".csv.gz")]["meter_lag_s"]
        for branch, sign in (("rising", 1), ("falling", -1)):
            found = getattr(test.recorded, branch).command_at(1.0)
            assert abs(found - sign * lag_V - known[f"u_{branch}_Q1.0"]) < 0.02, (test.source, branch)
