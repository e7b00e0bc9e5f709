"""Several ramps in a recording, several recordings of a ramp: the answer is that of the samples, however they came."""

import dataclasses

import numpy as np
import pytest
from bench_plant import lagged, with_play
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import as_document, to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.splitting import nominal_dp, split_ramps
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import ValveModel
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, MPA, Truth, synthetic_ramp

laws = settings(
    max_examples=8, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
seeds = st.integers(0, 10**6)


def ramp(dp=1.0, seed=0, **keywords):
    truth = {"knee_rising": 5.5 - 0.06 * dp, "slope": 4 * dp**0.5, **keywords}
    return synthetic_ramp(dp, Truth(**truth), seed=seed, rate_Hz=20, ramp_s=60)


def rows(test: RampTest, part, source=None) -> RampTest:
    """Return some samples of a recording as a recording of their own."""
    columns = {name: getattr(test, name)[part].copy() for name in ("time", "u", "q", "dp")}
    return dataclasses.replace(test, source=source or test.source, **columns)


def one_after_another(*tests: RampTest, hold_s=3.0, source="all.csv") -> RampTest:
    """Return one recording of several, with a hold at zero after each, in which the pressure goes to the next one's."""
    columns = {name: [] for name in ("time", "u", "q", "dp")}
    clock = 0.0
    for test, following in zip(tests, [*tests[1:], tests[-1]], strict=True):
        n = int(hold_s * 20)
        half = [test.dp[-1]] * (n // 3) + [following.dp[0]] * (n - n // 3)
        columns["time"] += [test.time + clock, test.time[-1] + clock + (1 + np.arange(n)) / 20]
        columns["u"] += [test.u, np.zeros(n)]
        columns["q"] += [test.q, np.zeros(n)]
        columns["dp"] += [test.dp, np.array(half)]
        clock = columns["time"][-1][-1] + 0.05
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    return RampTest(source=source, sha256="1" * 64, **joined)


def thresholds(tests, options=None):
    side = identify(tests, options).positive
    return side.tests, np.array([(test.u_knee_rising_V, test.u_knee_falling_V) for test in side.tests])


def assert_same_within_error(before, after, share=1.0):
    (tests, known), (_, found) = thresholds(before), thresholds(after)
    assert found.shape == known.shape
    assert np.all(np.abs(found - known) <= share * np.array([[test.u_knee_se_V] for test in tests]))


class TestLaws:
    @pytest.mark.slow
    @laws
    @given(seed=seeds, order=st.permutations(range(4)))
    def test_the_order_of_files_does_not_matter(self, seed, order):
        tests = [ramp(1.0, seed), ramp(1.0, seed + 1), ramp(2.0, seed), ramp(4.0, seed)]
        tests = [dataclasses.replace(test, source=f"{number}.csv") for number, test in enumerate(tests)]
        assert to_json_bytes(identify([tests[index] for index in order])) == to_json_bytes(identify(tests))

    @pytest.mark.slow
    @laws
    @given(seed=seeds, at=st.floats(0.1, 0.9))
    def test_a_ramp_split_over_two_files(self, seed, at):
        whole = [ramp(1.0, seed, sag=0.1), ramp(3.0, seed, sag=0.1)]
        cut = int(at * whole[0].u.size)
        halves = [rows(whole[0], slice(None, cut), "a.csv"), rows(whole[0], slice(cut, None), "b.csv")]
        assert_same_within_error(whole, [*halves, whole[1]], 0.3)

    @laws
    @given(seed=seeds, share=st.floats(0.1, 3.0))
    def test_more_samples_inside_the_dead_zone(self, seed, share):
        test = ramp(1.0, seed)
        n = int(share * test.u.size)
        u = 3.0 * np.abs(np.sin(np.arange(n) / n * 3 * np.pi))
        q = np.random.default_rng(seed).normal(0, 0.08e-3 / 60, n)
        time = np.arange(n) / 20
        longer = dataclasses.replace(
            test,
            time=np.concatenate([time, test.time + time[-1] + 0.05]),
            u=np.concatenate([u, test.u]),
            q=np.concatenate([q, test.q]),
            dp=np.concatenate([np.full(n, test.dp[0]), test.dp]),
        )
        assert_same_within_error([test], [longer])


class TestSplitting:
    def test_ramps_of_one_recording_are_those_of_many(self):
        parts = [ramp(1.0, 1), ramp(1.0, 2), ramp(2.0, 3), ramp(4.0, 4)]
        assert_same_within_error(parts, [one_after_another(*parts)], 0.5)

    def test_what_is_pooled_is_said(self, tmp_path):
        recording = one_after_another(ramp(1.0, 1), ramp(2.0, 2), ramp(1.0, 3))
        other = dataclasses.replace(ramp(2.0, 4), source="b.csv")
        valve = identify([recording, other])
        low, high = as_document(valve)["sides"]["positive"]["tests"]
        assert low["source"] == "all.csv (ramps 1, 3)"
        assert low["ramps"] == ("all.csv (ramp 1, 0.0 to 121.0 s)", "all.csv (ramp 3, 244.0 to 368.9 s)")
        assert high["source"] == "all.csv (ramp 2, 121.0 to 243.9 s), b.csv"
        assert high["ramps"] == ("all.csv (ramp 2, 121.0 to 243.9 s)", "b.csv")
        assert [file.source for file in valve.made_from] == ["all.csv", "b.csv"]
        text = to_json_bytes(valve).decode()
        assert to_json_bytes(read_artefact(text.encode(), ValveModel, "valve.json")).decode() == text

    def test_the_cut_in_a_hold_is_where_the_pressure_steps(self):
        recording = one_after_another(ramp(1.0), ramp(2.0), ramp(3.0), hold_s=20)
        found = split_ramps(recording, 0.0)
        assert [round(part.dp / MPA, 3) for part in found] == [1.0, 2.0, 3.0]
        assert [np.ptp(part.test.dp) for part in found] == [0, 0, 0]

    def test_up_at_one_pressure_and_down_at_another(self):
        up, down = ramp(1.0), ramp(2.0)
        half = up.u.size // 2
        low, high = rows(up, slice(None, half)), rows(down, slice(half, None))
        columns = {name: np.concatenate([getattr(low, name), getattr(high, name)]) for name in ("time", "u", "q", "dp")}
        assert [round(part.dp / MPA, 3) for part in split_ramps(dataclasses.replace(up, **columns), 0.0)] == [1.0, 2.0]

    def test_the_jump_back_of_a_saw_tooth_is_no_branch(self):
        up = ramp(1.0, 1)
        up = rows(up, slice(None, up.u.size // 2))
        back = [8.0, 6.0, 4.0, 2.0, 1.0, 0.5]
        n = len(back)
        tooth = RampTest(
            source="tooth.csv",
            sha256="0" * 64,
            time=np.concatenate([up.time, up.time[-1] + (1 + np.arange(n)) / 20]),
            u=np.concatenate([up.u, back]),
            q=np.concatenate([up.q, np.zeros(n)]),
            dp=np.concatenate([up.dp, np.full(n, MPA)]),
        )
        valve = identify([one_after_another(tooth, tooth, tooth)])
        assert valve.positive.certificate.guard == "opening" and valve.positive.tests[0].u_knee_falling_V is None

    def test_a_shut_valve_is_not_hidden_by_a_good_recording(self, wording):
        shut = dataclasses.replace(ramp(1.0, 2, knee_rising=50.0), source="shut.csv")
        with wording.refusal(InputError):
            identify([ramp(1.0, 1), shut])

    def test_a_recording_without_pressure_may_hold_several_ramps(self):
        recording = dataclasses.replace(one_after_another(ramp(1.0, 1), ramp(1.0, 2)), dp=None)
        (test,) = identify([recording]).positive.tests
        assert len(test.ramps) == 2 and test.dp_MPa is None
        assert test.u_knee_rising_V == pytest.approx(5.44, abs=0.02)

    def test_a_lag_is_taken_out_across_all_ramps(self):
        recording = one_after_another(ramp(1.0, 1, noise=0.02), ramp(2.0, 2, noise=0.02))
        late = dataclasses.replace(recording, q=np.interp(recording.time - 0.5, recording.time, recording.q))
        tests, found = thresholds([late], IdentifyOptions(meter_lag=0.5))
        known = np.array([[5.5 - 0.06 * test.dp_MPa, 5.4 - 0.06 * test.dp_MPa] for test in tests])
        np.testing.assert_allclose(found, known, atol=0.01)


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_ramp_from_the_top_keeps_its_bottom(noise):
    """From full command to zero and back it is parted at zero, whatever noise the pressure has: an edge there stays."""
    test = ramp(knee_rising=0.45, hysteresis=0.3)
    half = test.u.size // 2
    turned = {name: np.roll(getattr(test, name), -half) for name in ("u", "q", "dp")}
    pressure = turned["dp"] * (1 + noise * np.random.default_rng(1).standard_normal(test.u.size))
    turned = dataclasses.replace(test, **{**turned, "dp": pressure})
    ramps = split_ramps(turned, lag=0.0)
    lowest = [min(branch.u.min() for branch in ramp.branches if branch) for ramp in ramps]
    assert max(lowest) < 0.02


UP = np.arange(0.2, 10.01, 0.2)
SHUFFLED = np.random.default_rng(5).permutation(UP)
OF_BOTH_SIGNS = np.ravel(np.column_stack([UP, -UP]))


def steps(levels, *, base=0.0, held_s=1.0, base_s=0.5, slew_s=0.0, rate_Hz=50.0, noise_V=0.0, sign=1, seed=0):
    """Return a recording of levels, each from the base if there is one; opening at 5.3, closing at 5.1 V."""
    visits = [(float(level), held_s) for level in levels]
    if base is not None:
        visits = [(base, base_s), *(part for visit in visits for part in (visit, (base, base_s)))]
    corners = [(0.0, visits[0][0])]
    for level, seconds in visits:
        clock = corners[-1][0] + max(slew_s, 1e-9)
        corners += [(clock, level), (clock + seconds, level)]
    time = np.arange(0, corners[-1][0], 1 / rate_Hz)
    u = np.interp(time, *np.array(corners).T)
    spool = with_play(u, 0.2)
    q = lagged(3 * np.sign(spool) * np.maximum(np.abs(spool) - 5.2, 0), 0.05 * rate_Hz)
    rng = np.random.default_rng(seed)
    read, shown = q + 0.05 * rng.standard_normal(u.size), u + noise_V * rng.standard_normal(u.size)
    columns = {"time": time, "u": sign * shown, "q": sign * read * L_MIN, "dp": np.full(u.size, 1.0 * MPA)}
    return RampTest(source=f"steps_{seed}.csv", sha256=f"{seed:064d}", **columns)


class TestStepsFromOneLevel:
    """A level belongs to the branch from whose side it was reached."""

    @staticmethod
    def sides_of(levels, **how):
        tests = [steps(levels, seed=seed, **how) for seed in (0, 1)]
        return identify(tests, IdentifyOptions(meter_lag=0.0)).sides

    @pytest.mark.parametrize(
        ("levels", "how"),
        [
            pytest.param(UP, {}, id="rising"),
            pytest.param(UP[::-1], {}, id="falling"),
            pytest.param(SHUFFLED, {}, id="in no order"),
            pytest.param(np.repeat(UP, 2), {}, id="each twice"),
            pytest.param(np.r_[UP, UP[::-1]], {}, id="up and down"),
            pytest.param(UP[15:], {"base": 3.0}, id="from 3 V"),
            pytest.param(UP[::-1], {"base_s": 0.1}, id="short visits of zero"),
            pytest.param(UP, {"held_s": 0.3, "base_s": 0.3}, id="short levels"),
            pytest.param(UP, {"rate_Hz": 10.0}, id="ten rows a level"),
            pytest.param(UP[::-1], {"slew_s": 0.3}, id="slewed"),
            pytest.param(UP, {"noise_V": 0.02}, id="noisy command"),
            pytest.param(UP[::-1], {"sign": -1}, id="negative"),
            pytest.param(OF_BOTH_SIGNS, {"base": None}, id="of both signs in turn"),
            pytest.param(OF_BOTH_SIGNS[::-1], {"base": None}, id="of both signs in turn, falling"),
        ],
    )
    def test_steps_up_are_openings(self, levels, how):
        sides = self.sides_of(levels, **how)
        assert len(sides) == 1 + (how.get("base", 0.0) is None)
        for side in sides.values():
            (test,) = side.tests
            assert test.u_knee_rising_V == pytest.approx(5.3, abs=0.015) and test.u_knee_falling_V is None
            assert 5.15 < test.u_guard_lower_V < 5.3 and side.certificate.guard == "opening"

    @pytest.mark.parametrize(
        ("levels", "how"),
        [
            pytest.param(UP[-2::-1], {}, id="falling"),
            pytest.param(UP[:-1], {"slew_s": 0.3}, id="rising, slewed"),
            pytest.param(SHUFFLED[SHUFFLED < 9.9], {}, id="in no order"),
            pytest.param(UP[:-1], {"base_s": 0.1}, id="short visits of full command"),
            pytest.param(UP[-2::-1], {"sign": -1}, id="negative"),
        ],
    )
    def test_steps_down_are_closings(self, levels, how):
        (side,) = self.sides_of(levels, base=10.0, **how).values()
        (test,) = side.tests
        assert test.u_knee_falling_V == pytest.approx(5.1, abs=0.015) and test.u_knee_rising_V is None
        assert 4.95 < test.u_guard_lower_V < 5.1

    @pytest.mark.parametrize(
        "levels",
        [
            pytest.param(SHUFFLED, id="in no order"),
            pytest.param(np.random.default_rng(6).permutation(OF_BOTH_SIGNS), id="of both signs"),
            pytest.param(np.ravel(np.column_stack([UP[2:], UP[:-2]])), id="two up, one down"),
        ],
    )
    def test_levels_reached_from_both_sides_are_refused(self, levels):
        with pytest.raises(InputError, match="follow in no order"):
            self.sides_of(levels, base=None)

    @pytest.mark.parametrize("base", [0.0, 10.0])
    def test_a_command_that_overshoots_shows_no_side(self, base):
        """The spool may have followed beyond the level, and come back to it."""
        test = steps(UP[:-1], base=base)
        ringing = np.convolve(np.diff(test.u, prepend=test.u[0]), 0.2 * np.array([0, 1, 1, 1, 1, 1]))[: test.u.size]
        with pytest.raises(InputError, match="follow in no order"):
            identify([dataclasses.replace(test, u=test.u + ringing)], IdentifyOptions(u_max=12.0))

    def test_a_staircase_whose_command_overshoots_is_one(self):
        test = steps(np.r_[UP, UP[::-1]], base=None)
        ringing = np.convolve(np.diff(test.u, prepend=test.u[0]), 0.3 * np.array([0, 1, 1, 1, 1, 1]))[: test.u.size]
        (found,) = identify([dataclasses.replace(test, u=test.u + ringing)]).positive.tests
        assert (found.u_knee_rising_V, found.u_knee_falling_V) == pytest.approx((5.3, 5.1), abs=0.015)

    def test_they_are_refused_with_the_way(self, wording):
        with wording.refusal(InputError):
            self.sides_of(SHUFFLED, base=None)

    def test_steps_in_no_order_at_two_pressures_are_refused(self, wording):
        low = steps(SHUFFLED)
        high = {"time": low.time + low.time[-1] + 0.02, "u": low.u, "q": 2**0.5 * low.q, "dp": 2 * low.dp}
        both = {name: np.concatenate([getattr(low, name), values]) for name, values in high.items()}
        with wording.refusal(InputError):
            identify([dataclasses.replace(low, **both)])

    def test_a_flow_that_does_not_settle_is_refused(self, wording):
        test = steps(UP)
        late = dataclasses.replace(test, q=lagged(test.q, 150.0))
        with wording.refusal(InputError):
            identify([late])

    def test_fewer_rows_than_a_level_needs_are_no_ramp(self):
        with pytest.raises(InputError):
            self.sides_of(UP, rate_Hz=8.0, held_s=0.6)

    def test_holds_of_slow_trapezoids_are_not_closings(self):
        (side,) = self.sides_of(np.arange(6, 10.1, 0.5), slew_s=10.0, held_s=5.0, base_s=5.0).values()
        (test,) = side.tests
        # At 1 V/s the lag of 50 ms, which is not taken out, opens 50 mV late and closes 50 mV early.
        assert (test.u_knee_rising_V, test.u_knee_falling_V) == pytest.approx((5.35, 5.05), abs=0.025)


@pytest.mark.parametrize("period_s", [12.0, 25.0, 40.0])
def test_the_level_of_a_slow_swing_is_not_where_the_zero_command_met_it(period_s):
    """Near zero a slow swing stays at its crest; its level is what it swings about, wherever the valve is shut."""
    test = ramp(dp=5.0)
    for phase in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        swing = 1 + 0.1 * np.sin(2 * np.pi * test.time / period_s + phase)
        swinging = dataclasses.replace(test, dp=test.dp * swing, q=test.q * swing**0.5)
        assert nominal_dp(swinging) == pytest.approx(5.0 * MPA, rel=0.035)
        assert [part.dp for part in split_ramps(swinging, 0.0)] == pytest.approx([5.0 * MPA], rel=0.035)
