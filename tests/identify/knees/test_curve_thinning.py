"""The recorded curve in valve.json: few points, its error as stated, what is hidden stays hidden."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.artefact_types import RuleError
from dzdesign.identify.identification import identify
from dzdesign.identify.knees import curve_thinning
from dzdesign.identify.knees.curve_thinning import TOLERANCE, evenly_spaced
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.recorded_curve import MOST_POINTS, MOST_SAMPLES, RecordedBranch, RecordedCurve
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp


def bent_ramp(dp_MPa, seed=0, **changes):
    """A ramp of a valve without a straight part: a soft edge, then a bend, then a plateau; and its truth."""
    ramp = synthetic_ramp(dp_MPa, Truth(noise=0.0), seed=seed)
    up = np.arange(ramp.u.size) < ramp.u.size // 2
    beyond = np.maximum(ramp.u - np.where(up, 4.0, 3.8), 0.0)
    true = np.minimum(1.5 * beyond**1.5 + 2.0 * beyond, 20.0)
    noise = 0.1 * np.random.default_rng([seed, 7]).standard_normal(true.size)
    return replace(ramp, q=(true + noise) * L_MIN, **changes), true


def means(u, q, up):
    """Mean command and flow of each branch in 200 bins of command, by NumPy's histogram alone."""
    for part in (up, ~up):
        count, edges = np.histogram(u[part], bins=200, range=(0, 10))
        total, _ = np.histogram(u[part], bins=edges, weights=q[part])
        yield (edges[:-1] + edges[1:]) / 2, total / np.maximum(count, 1)


def test_few_points_come_as_near_as_they_say():
    ramp, _ = bent_ramp(2.0)
    (test,) = identify([ramp]).positive.tests
    up = np.arange(ramp.u.size) < ramp.u.size // 2
    for branch, (u, q) in zip(test.recorded.branches, means(ramp.u, ramp.q / L_MIN, up), strict=True):
        assert 8 <= len(branch.u_V) <= MOST_POINTS
        assert branch.error_L_min <= 3 * TOLERANCE * test.recorded.q_max_L_min
        seen = u > branch.u_seen_V + 0.05
        assert np.abs(branch.flow_at(u) - q)[seen].max() <= branch.error_L_min + 0.05
        assert np.all(branch.flow_at(u[u < branch.u_seen_V - 0.05]) < test.noise_level_L_min)


def test_the_truth_is_nearer_to_the_curve_than_the_noise():
    ramp, true = bent_ramp(2.0, seed=4)
    (test,) = identify([ramp]).positive.tests
    up = np.arange(ramp.u.size) < ramp.u.size // 2
    for branch, part in zip(test.recorded.branches, (up, ~up), strict=True):
        part = part & (ramp.u > branch.u_seen_V)
        assert np.abs(branch.flow_at(ramp.u[part]) - true[part]).max() < 0.1


@pytest.mark.parametrize("zero_flow", [None, 0.4])
def test_points_stand_closer_only_about_a_flow_that_is_allowed_at_zero(zero_flow, monkeypatch):
    """Noise below zero is no such flow: without a declared one the tolerance is the same everywhere."""
    asked = []
    points = curve_thinning.fewest_points

    def noted(u, q, tolerance):
        asked.append((q / L_MIN, tolerance / L_MIN))
        return points(u, q, tolerance)

    monkeypatch.setattr(curve_thinning, "fewest_points", noted)
    ramp, _ = bent_ramp(2.0)
    (test,) = identify([ramp], IdentifyOptions(zero_flow=zero_flow and zero_flow * L_MIN)).positive.tests
    assert len(asked) == 2 and any(np.any(q < 0) for q, _ in asked)
    for q, tolerance in asked:
        near = q < 2 * (test.zero_flow_L_min or 0.0) if zero_flow else np.zeros(q.size, dtype=bool)
        assert np.all(tolerance[~near] == tolerance.max()) and tolerance.max() > 0.04
        assert np.all(tolerance[near] == pytest.approx(0.1 * (test.zero_flow_L_min or 0.0)))


def test_single_wrong_readings_leave_no_trace():
    clean, _ = bent_ramp(2.0, seed=2)
    q = clean.q.copy()
    q[np.random.default_rng(3).choice(q.size, 40, replace=False)] = 0.0
    found = [identify([ramp]).positive.tests[0].recorded for ramp in (clean, replace(clean, q=q))]
    u = np.linspace(4.3, 9.9, 500)
    for one, other in zip(found[0].branches, found[1].branches, strict=True):
        assert np.abs(one.flow_at(u) - other.flow_at(u)).max() < 0.1


def test_a_meter_with_a_floor_shows_no_edge_and_the_curve_has_none():
    """The readings jump from 0 to 0.6 L/min: the curve goes down to the knee instead, in a straight line."""
    (test,) = identify([synthetic_ramp(2.0, Truth(floor=0.6, noise=0.02))]).positive.tests
    for branch, knee in zip(test.recorded.branches, (5.4, 5.3), strict=True):
        assert branch.u_seen_V == pytest.approx(knee + 0.15, abs=0.03)
        assert branch.command_at(1e-6) == pytest.approx(knee, abs=0.03)


def test_the_supplys_sag_is_kept():
    ramp = synthetic_ramp(2.0, Truth(sag=0.3, noise=0.02))
    (test,) = identify([ramp]).positive.tests
    dp = np.array(test.recorded.dp_at_flow_MPa)
    at_full = 2.0 * (1 - 0.3 * (4.6 / 4.7) ** 2)  # this valve's falling branch begins with more flow than rising ends
    assert dp[0] == pytest.approx(2.0, abs=0.005) and dp[-1] == pytest.approx(at_full, abs=0.02)
    assert np.all(np.diff(dp) < 0)


def test_one_branch_stands_for_both():
    (test,) = identify([synthetic_ramp(1.0, Truth(), falling=False)]).positive.tests
    assert test.recorded.falling is None
    assert test.recorded.closing is test.recorded.opening is test.recorded.rising


def test_samples_are_readings_of_the_recording_spread_over_the_whole_branch():
    ramp, _ = bent_ramp(2.0)
    (test,) = identify([ramp]).positive.tests
    read = set(np.round(ramp.q / L_MIN, 3).tolist())
    for branch in test.recorded.branches:
        u, q = np.array(branch.samples.u_V), np.array(branch.samples.q_L_min)
        assert MOST_SAMPLES / 2 < u.size <= MOST_SAMPLES and np.all(np.diff(u) > 0)
        assert np.diff(u).max() < 2 * np.ptp(u) / MOST_SAMPLES  # none of the branch is left out
        assert all(min(abs(value - each) for each in read) < 0.01 for value in q)  # read, and not averaged
        assert np.std(q - branch.flow_at(u)) > 0.05  # they scatter as the meter does


def test_pace_and_sampling_are_those_of_the_recording():
    ramp, _ = bent_ramp(2.0)
    (test,) = identify([ramp]).positive.tests
    step = np.median(np.diff(ramp.time))
    assert test.conditions.sampling_Hz == pytest.approx(1 / step, rel=1e-3)
    pace = np.ptp(ramp.u) / (np.ptp(ramp.time) / 2)
    assert test.conditions.rate_V_s == pytest.approx(pace, rel=0.03)
    assert test.conditions.samples <= ramp.u.size


@pytest.mark.parametrize("commands", [[3.0], [1.0, 2.0], [2.0, 1.0, 1.0, 5.0], list(range(100))])
def test_evenly_spaced_samples_rise_and_reach_both_ends(commands):
    u = np.array(commands, dtype=float)
    kept = u[evenly_spaced(u)]
    assert kept[0] == u.min() and kept[-1] == u.max() and np.all(np.diff(kept) >= 0)


def branch(u=(0.0, 5.0, 10.0), q=(0.0, 0.0, 20.0)):
    return RecordedBranch(u_V=u, q_L_min=q, u_seen_V=5.1, error_L_min=0.0)


def test_where_a_flow_is_passed():
    assert branch().command_at(10.0) == pytest.approx(7.5)
    assert branch().command_at(0.0) == 0.0
    assert branch().command_at(20.1) is None
    assert branch().flow_at(np.array([-1.0, 6.0, 11.0])).tolist() == [0.0, 4.0, 20.0]


@pytest.mark.parametrize(
    ("make", "case"),
    [
        (lambda: branch(q=(0.0, 1.0)), "as many"),
        (lambda: branch(u=(0.0, 5.0, 5.0)), "rising"),
        (lambda: RecordedCurve(rising=None, falling=None, dp_at_flow_MPa=None), "a branch"),
        (lambda: RecordedCurve(rising=branch(), falling=None, dp_at_flow_MPa=(1.0, 0.9)), "steps"),
    ],
    ids=["as many", "rising", "a branch", "steps"],
)
def test_a_curve_that_is_none_is_refused(make, case, wording):
    with wording.refusal(RuleError):
        make()


def test_a_ramp_that_began_without_pressure_does_not_bend_the_curve(tmp_path):
    """Of two ramps the first began before the pump: the flow of its way up is brought to the usual pressure drop.

    The recording and its truth are of a plant that shares no code with the product.
    """
    import corpus

    from dzdesign.identify.reading.ramp_files import read_ramp_file

    (case,) = [case for case in corpus.cases() if case.name == "pump_on_in_ramp_1_of_2"]
    (test,) = identify([read_ramp_file(path) for path in corpus.write(case, 909, tmp_path)]).positive.tests
    valve, bench = case.benches[0].valve, case.benches[0]
    for branch, knee in zip(test.recorded.branches, valve.knees(test.dp_MPa, "positive"), strict=True):
        u = np.linspace(0.5, 9.9, 400)
        opening = np.clip(u - knee, 0, valve.stroke_V)
        true = valve.gain * opening * np.sqrt(test.dp_MPa / (1 + bench.sag * (opening / 4) ** 2))
        assert np.abs(branch.flow_at(u) - true).max() < 0.03 * true.max()
