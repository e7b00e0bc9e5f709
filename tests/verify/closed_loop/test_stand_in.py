"""The stand-in plant: it is the recordings, it says where they show nothing, and what is seeded into it is seen."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from stand_in_flow import LIMIT, RECORDINGS, largest_miss, misses, plant_bins, recorded_bins, valve_of

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.closed_loop import loop as loop_module
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.loop_checks import no_flow_at_zero, plant_is_the_valve, stand_in_is_the_recording
from dzdesign.verify.closed_loop.ramps import compare_at_pressure
from dzdesign.verify.closed_loop.stand_in import StandIn, stand_in_of
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary
from tests.support.designs import designed, written
from tests.support.evidence import pressure_result, verify
from tests.support.synthetic import SHARED, Truth, needs_compiler, synthetic_ramp

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
def direct(stand_in):
    """The stand-in without a compensator, compiled once."""
    return ClosedLoop(stand_in)


def compared(scene, side):
    """What the ramps of a scene show with a side's recorded curve in place of its own."""
    loop = scene.loop.with_plant(stand_in_of(side, scene.compensator.valve.u_max_V))
    return compare_at_pressure(replace(scene, loop=loop), QUICK).result


# --- it is the recordings ---


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
def test_verify_itself_sees_a_stand_in_that_is_not_the_recording(example_valve, scenes, fault, wording):
    """What the evidence holds tells it: the flow is compared with valve.json by code that shares no table with it."""

    def checked(side):
        return stand_in_is_the_recording([compared(scene, side) for scene in (scenes[0], scenes[-1])], example_valve)

    assert checked(example_valve.positive).holds
    wrong = checked(fault(example_valve.positive))
    assert wrong.holds is False
    wording.of_test(wrong.text)


@pytest.mark.parametrize("branch", ["rising", "falling"])
@pytest.mark.parametrize("shift_V", [-0.3, 0.3])
def test_a_recorded_curve_that_is_not_that_of_the_thresholds_is_no_stand_in(example_valve, scenes, branch, shift_V):
    """The loop takes valve.json's curve as the valve, and its flow is that curve's: only the thresholds tell."""
    side = example_valve.positive
    *others, last = side.tests
    curve = getattr(last.recorded, branch)
    moved = replace(curve, u_V=tuple(u + shift_V for u in curve.u_V), u_seen_V=curve.u_seen_V + shift_V)
    tests = (*others, replace(last, recorded=replace(last.recorded, **{branch: moved})))
    shifted = replace(example_valve, sides={"positive": replace(side, tests=tests)})
    compensator = replace(scenes[-1].compensator, valve=shifted)
    run = compared(replace(scenes[-1], compensator=compensator), shifted.positive)
    assert run.flow_miss < LIMIT or (branch, shift_V) == ("rising", 0.3), "whose end is cut"
    check = stand_in_is_the_recording([run], shifted)
    assert check.holds is False and last.source in check.text


# --- a plant of the user's own opens and closes where the valve does ---


def at_the_thresholds(valve, **off_V):
    """What a ramp of a plant shows that opens and closes where the first test does, but for so many volts."""
    test = valve.positive.tests[0]
    shares = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    found = {f"dead_zone_{name}": (at + off_V.get(name, 0.0)) / valve.u_max_V for name, at in shares.items()}
    return pressure_result(dp_MPa=test.dp_MPa, **found)


@pytest.mark.parametrize(
    ("off_V", "holds", "stands_in"),
    [
        ({}, True, True),
        ({"opening": 0.29, "closing": 0.29}, True, False),
        ({"opening": 0.31}, False, False),
        ({"opening": -0.31}, False, False),
        ({"closing": 0.31}, False, False),
        ({"closing": -0.9}, True, False),
        ({"opening": 0.12}, True, False),
        ({"closing": -0.12}, True, False),
        ({"opening": -0.1, "closing": 0.1}, True, True),
    ],
    ids=str,
)
def test_where_it_opens_and_closes_is_compared(example_valve, off_V, holds, stands_in):
    """A plant that closes at a larger command would show no flow where the valve still passes some; else it may be.

    What stands in for the valve must be it, to less, either way.
    """
    ramp = at_the_thresholds(example_valve, **off_V)
    check = plant_is_the_valve([ramp], example_valve)
    assert check.holds is holds
    assert ("closes 0.31 V above" in check.text) == ("closing" in off_V and not holds)
    assert stand_in_is_the_recording([ramp], example_valve).holds is stands_in


def test_a_flow_that_departs_is_said_with_command_pressure_drop_and_recording(example_valve, wording):
    test = example_valve.positive.tests[2]
    ramps = [
        pressure_result(
            dp_MPa=each.dp_MPa, flow_miss=0.12 if each is test else 0.01, flow_miss_at=0.935,
            dead_zone_opening=each.u_knee_rising_V / 10, dead_zone_closing=each.u_knee_falling_V / 10,
        )
        for each in example_valve.positive.tests
    ]  # fmt: skip
    check = stand_in_is_the_recording(ramps, example_valve)
    assert check.holds is False and f"'{test.source}'" in check.text
    wording("stand in: a dent in the recorded flow", check.text)
    both = replace(example_valve, sides={side: example_valve.positive for side in ("positive", "negative")})
    negative = [replace(ramp, side="negative") for ramp in ramps]
    assert "negative side" in stand_in_is_the_recording(negative, both).text


# --- between the tests and beyond them ---


class _Tests:
    """What a stand-in reads of a `SideModel`."""

    def __init__(self, tests):
        self.tests = tests


@pytest.mark.parametrize("place", [1, 2, 3, 4])
def test_between_two_tests_it_comes_near_a_recording_that_it_never_saw(example_valve, stand_in, direct, place):
    """The stand-in of the two tests beside one of them, beside the raw recordings of that one."""
    beside, test = (stand_in.side.tests[place - 1], stand_in.side.tests[place + 1]), stand_in.side.tests[place]
    loop = direct.with_plant(replace(stand_in, side=_Tests(beside)))
    recorded = recorded_bins([RECORDINGS["the example"] / name for name in test.source.split(", ")])
    assert largest_miss(plant_bins(loop, test.dp_MPa, example_valve.meter.floor_L_min), recorded)[0] < 0.03


def test_between_two_tests_the_threshold_runs_straight_and_not_the_other_way_round(stand_in, monkeypatch):
    """At a quarter of the way from 1 to 5 MPa; the interpolation turned round in the C is seen."""
    tests = (stand_in.side.tests[1], stand_in.side.tests[-1])
    made = StandIn(side=_Tests(tests), dynamics=stand_in.dynamics)
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


def test_at_a_test_it_does_not_jump_and_beyond_them_the_flow_goes_with_the_root_of_the_pressure_drop(stand_in, direct):
    """A pressure drop just below a test's and one just above it give the test's flow."""
    command = QUICK.command()
    for test in stand_in.side.tests:
        flows = [direct.run(command, by * test.dp_MPa).q_mean_L_min for by in (1 - 1e-9, 1.0, 1 + 1e-9)]
        assert np.abs(flows[1] - flows[0]).max() < 1e-5 and np.abs(flows[2] - flows[1]).max() < 1e-5
    # Beyond them the threshold runs on, and the characteristic above it is stretched: its end is met to 1e-5.
    beyond = direct.run(command, 2.25 * test.dp_MPa).q_mean_L_min.max()
    assert beyond == pytest.approx(1.5 * flows[1].max(), rel=1e-5)
    thin = direct.with_plant(stand_in.with_oil(1.0, 0.25)).run(command, test.dp_MPa).q_mean_L_min.max()
    assert thin == pytest.approx(2 * flows[1].max(), rel=1e-9), "oil of another density scales the flow"


# --- hysteresis ---


def test_inner_loops_stay_between_the_branches_and_their_ends_are_flat(stand_in, direct):
    """The play in numbers, in NumPy alone: slow triangles of every size about the threshold and far above it."""
    test = stand_in.side.tests[2]
    curve = test.recorded
    corners = [0.0, 0.60, 0.54, 0.57, 0.53, 0.70, 0.685, 0.695, 0.40, 0.62, 0.0]
    command = np.concatenate([np.linspace(a, b, 2000) for a, b in pairwise(corners)])
    found = direct.run(command, test.dp_MPa).q_mean_L_min
    state, expected = 0.0, []
    for u in 10 * command:
        opening = float(np.interp(u, curve.rising.u_V, curve.rising.q_L_min))
        closing = float(np.interp(u, curve.falling.u_V, curve.falling.q_L_min))
        state = max(opening, min(closing, state))
        expected.append(state)
    # The ramps of 10 s and less lag by some millivolts.
    assert np.abs(found - np.array(expected)).max() < 0.01 * curve.q_max_L_min


def test_the_pulses_ripple_is_no_command(stand_in, direct):
    """At a standing command the mean position is the command to 0.2 mV, at every duty."""
    steep = max(test.slope_L_min_V for test in stand_in.side.tests)
    test = stand_in.side.tests[-1]
    for share in (0.56, 0.6, 0.75, 0.9):
        command = np.concatenate([np.linspace(0, share, 2000), np.full(50, share)])  # a step would overshoot
        found = direct.run(command, test.dp_MPa).q_mean_L_min[-1]
        expected = float(test.recorded.rising.flow_at(np.array([10 * share]))[0])
        assert abs(found - expected) < 2e-4 * steep


# --- what the recordings don't show ---


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
def test_a_valve_that_closes_sooner_leaks_in_the_loop(example_valve, scenes, by_V, part, wording):
    """Seeded over-compensation: below what the recordings show it is told by their first flows, above it is seen."""
    results = [compared(scenes[-1], moved(example_valve.positive, by_V))]
    check = no_flow_at_zero(results, scenes[-1].compensator, plant_given=False)
    assert check.holds is False and part in check.text
    wording.of_test(check.text)


@pytest.fixture(scope="module")
def leaking_valve():
    """Two pressures, a leak of 0.4 and 1.2 L/min through the overlap."""

    def leaking(dp_MPa):
        ramp, hold = synthetic_ramp(dp_MPa, Truth(noise=0.02), seed=3), np.zeros(1000)
        q = np.concatenate([hold, ramp.q, hold]) + 0.4e-3 / 60 * dp_MPa
        q += 0.02e-3 / 60 * np.random.default_rng(5).standard_normal(q.size)
        u, dp = (np.concatenate([[a[0]] * 1000, a, [a[-1]] * 1000]) for a in (ramp.u, ramp.dp))
        return replace(ramp, time=np.arange(q.size) / 50.0, u=u, dp=dp, q=q)

    return identify([leaking(1.0), leaking(3.0)], IdentifyOptions(curve="line"))


def test_a_leak_that_was_seen_flows_at_zero_command(leaking_valve, direct):
    assert leaking_valve.positive.tests[0].leak_L_min == pytest.approx(0.4, abs=0.02)
    loop = direct.with_plant(stand_in_of(leaking_valve.positive, 10.0))
    for dp_MPa, leak in ((1.0, 0.4), (3.0, 1.2)):
        run = loop.run(np.zeros(50), dp_MPa)
        assert run.q_mean_L_min[-1] == pytest.approx(loop.leak_L_min(dp_MPa), rel=1e-12)
        assert loop.leak_L_min(dp_MPa) == pytest.approx(leak, abs=0.03)


@pytest.mark.slow
def test_a_leak_that_no_compensator_can_stop_is_said_and_is_no_failure(leaking_valve, tmp_path, wording):
    found = verify(written(designed(leaking_valve), tmp_path / "fw"), sequence=QUICK)
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
