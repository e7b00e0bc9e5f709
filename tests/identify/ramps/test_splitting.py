"""Several ramps in a recording, several recordings of a ramp: the answer is that of the samples, however they came."""

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import as_document, to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.splitting import split_ramps
from dzdesign.identify.reading.ramp_files import ramp_file_bytes, read_ramp_file
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import ValveModel
from tests.support.repeatable_valves import identify
from tests.support.synthetic import MPA, Truth, synthetic_ramp

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
    @given(seed=seeds)
    def test_a_repeated_test(self, seed):
        once, twice = [ramp(1.0, seed)], [ramp(1.0, seed), ramp(1.0, seed + 1)]
        (before,), (after,) = thresholds(once)[0], thresholds(twice)[0]
        # Half of the data are the same; so is half of the error.
        assert abs(after.u_knee_rising_V - before.u_knee_rising_V) < 2.5 * before.u_knee_se_V
        assert abs(after.u_knee_rising_V - 5.44) < 4.5 * after.u_knee_se_V

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

    @laws
    @given(
        seed=seeds,
        units=st.sampled_from([("s", "V", "MPa", "Lmin"), ("ms", "mV", "bar", "m3/h"), ("min", "V", "psi", "mL/min")]),
    )
    def test_the_unit_of_a_column_does_not_matter(self, seed, units, tmp_path):
        from dzdesign.core.units import si_factor

        test = ramp(1.0, seed)
        kinds = ("time", "voltage", "pressure", "flow")
        names = ("time", "u", "dP", "Q")
        arrays = (test.time, test.u, test.dp, test.q)
        lines = [",".join(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True))]
        scaled = [array / si_factor(unit, kind) for array, unit, kind in zip(arrays, units, kinds, strict=True)]
        lines += [",".join(f"{value:.12g}" for value in row) for row in zip(*scaled, strict=True)]
        (tmp_path / "ramp.csv").write_text("\n".join(lines))
        assert_same_within_error([test], [read_ramp_file(tmp_path / "ramp.csv")], 1e-4)


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

    def test_repeating_shrinks_the_error(self):
        once = thresholds([ramp(1.0, 1)])[0][0].u_knee_se_V
        many = thresholds([one_after_another(*(ramp(1.0, seed) for seed in range(9)))])[0][0].u_knee_se_V
        assert many == pytest.approx(once / 3, rel=0.4)

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

    def test_written_recording_reads_back_as_many_tests(self, tmp_path):
        recording = one_after_another(ramp(1.0, 1), ramp(2.0, 2))
        arrays = (recording.time, recording.u, recording.dp / MPA, recording.q * 6e4)
        columns = dict(zip(("time_s", "u_V", "dP_MPa", "Q_Lmin"), arrays, strict=True))
        (tmp_path / "all.csv").write_bytes(ramp_file_bytes(columns, (), compress=False))
        assert len(identify([read_ramp_file(tmp_path / "all.csv")]).positive.tests) == 2


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
