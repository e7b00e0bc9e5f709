"""Both sides of a bipolar valve, the meter's lag from two ramp rates, and what the quality gate says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import UNSET

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import as_document
from dzdesign.design.designing import design
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import ramp_file_bytes
from dzdesign.identify.valve.recorded_drop import DropColumns, RecordedDrop
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, MPA, Truth, synthetic_ramp

PRESSURES = (1.0, 2.0, 4.0)


def bipolar(dp, positive, negative, *, signed_flow=True, signed_dp=False):
    """One recording: up and down on the positive side, then on the negative one."""
    up, down = synthetic_ramp(dp, positive), synthetic_ramp(dp, negative, seed=7)
    step = up.time[1] - up.time[0]
    return replace(
        up,
        source=f"bipolar_{dp:g}.csv",
        time=np.concatenate([up.time, up.time[-1] + step + down.time]),
        u=np.concatenate([up.u, -down.u]),
        q=np.concatenate([up.q, -down.q if signed_flow else down.q]),
        dp=np.concatenate([up.dp, -down.dp if signed_dp else down.dp]),
    )


@pytest.fixture(scope="module")
def recordings():
    return [
        bipolar(dp, Truth(knee_rising=5.5 - 0.05 * dp), Truth(knee_rising=3.0 + 0.04 * dp, slope=2.5))
        for dp in PRESSURES
    ]


@pytest.fixture(scope="module")
def valve(recordings):
    return identify(recordings, IdentifyOptions(meter_lag=0.0))


class TestSides:
    def test_each_side_has_its_own_thresholds_and_trend(self, valve):
        assert list(valve.sides) == ["positive", "negative"]
        for side, sign, start in ((valve.sides["positive"], -0.05, 5.5), (valve.sides["negative"], 0.04, 3.0)):
            assert side.trend == ("decreasing" if sign < 0 else "increasing")
            for test, dp in zip(side.tests, PRESSURES, strict=True):
                assert test.u_knee_rising_V == pytest.approx(start + sign * dp, abs=6e-3)
                assert test.u_knee_falling_V == pytest.approx(start + sign * dp - 0.1, abs=6e-3)
                assert test.u_guard_lower_V < start + sign * dp - 0.1
        assert valve.sides["negative"].tests[0].slope_L_min_V == pytest.approx(2.5, rel=0.01)

    def test_one_side_does_not_move_the_other(self, valve):
        alone = identify(
            [synthetic_ramp(dp, Truth(knee_rising=5.5 - 0.05 * dp)) for dp in PRESSURES], IdentifyOptions(meter_lag=0.0)
        )
        for one, other in zip(alone.positive.tests, valve.positive.tests, strict=True):
            assert one.u_knee_rising_V == pytest.approx(other.u_knee_rising_V, abs=1e-4)

    @pytest.mark.parametrize("signed_flow", [True, False])
    @pytest.mark.parametrize("signed_dp", [True, False])
    def test_flow_and_pressure_may_change_sign_with_the_side(self, valve, signed_flow, signed_dp):
        truths = Truth(knee_rising=5.45), Truth(knee_rising=3.04, slope=2.5)
        test = bipolar(1.0, *truths, signed_flow=signed_flow, signed_dp=signed_dp)
        found = identify([test], IdentifyOptions(meter_lag=0.0)).sides["negative"].tests[0]
        assert found.dp_MPa == pytest.approx(1.0)
        assert found.u_knee_rising_V == pytest.approx(3.04, abs=6e-3)

    def test_sides_in_files_of_their_own(self):
        tests = [synthetic_ramp(1.0, Truth(knee_rising=5.4)), synthetic_ramp(2.0, Truth(knee_rising=5.3))]
        mirrored = [replace(test, source=f"minus_{test.source}", u=-test.u, q=-test.q) for test in tests]
        both = identify([*mirrored, *tests])
        assert [test.source for test in both.sides["negative"].tests] == [test.source for test in mirrored]
        assert both.sides["negative"].reference.u_min_V == pytest.approx(both.positive.reference.u_min_V, abs=1e-6)
        assert both.sides["negative"].curve.u_min0_V == pytest.approx(both.positive.curve.u_min0_V, abs=1e-6)

    def test_what_both_sides_give_is_warned_about_once_and_else_the_side_is_named(self):
        tests = [synthetic_ramp(1.0, Truth(knee_rising=5.4)), synthetic_ramp(2.0, Truth(knee_rising=5.3))]
        mirrored = [replace(test, source=f"minus_{test.source}", u=-test.u, q=-test.q) for test in tests]
        one = {warning.text for warning in identify(tests).warnings}
        two = identify([*mirrored, *tests]).warnings
        both = [each.text for each in two if not each.source]
        assert both and {text.removeprefix("both sides: ") for text in both} <= one
        unlike = [each.text for each in identify([*tests, mirrored[0]]).warnings]
        assert {text.partition(" side")[0] for text in unlike} == {"both", "positive", "negative"}

    def test_a_side_without_data_is_said_to_be_missing(self, valve):
        assert valve.untested_sides == ()
        test = synthetic_ramp(1.0, Truth())
        assert identify([test]).untested_sides == ("negative",)
        only_negative = identify([replace(test, u=-test.u, q=-test.q)])
        assert only_negative.untested_sides == ("positive",)
        assert design(only_negative).valve.side_name(1) == "negative"

    def test_a_side_that_never_opens_is_missing_with_the_reason(self, wording):
        test = bipolar(1.0, Truth(), Truth(knee_rising=20.0))
        found = identify([test])
        assert list(found.sides) == ["positive"]
        (warning,) = [warning for warning in found.warnings if warning.code == "side-refused"]
        wording.of_test(warning.text)

    @pytest.mark.slow
    def test_the_command_prints_both(self, recordings, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        for test in recordings:
            columns = {"time_s": test.time, "u_V": test.u, "dP_MPa": test.dp / MPA, "Q_Lmin": test.q / L_MIN}
            Path(test.source).write_bytes(ramp_file_bytes(columns, (), compress=False))
        assert main(["identify", *(test.source for test in recordings)]) == 0
        out = capsys.readouterr().out
        assert "  positive " in out and "  negative " in out
        assert set(json.loads(Path("valve.json").read_text())["sides"]) == {"positive", "negative"}
        assert main(["design", "valve.json"]) == 0


def delayed(test, lag):
    """What a meter with a first-order lag shows of a recording."""
    from scipy.signal import lfilter

    pole = np.exp(-(test.time[1] - test.time[0]) / lag)
    return replace(test, q=lfilter([1 - pole], [1, -pole], test.q - test.q[0]) + test.q[0])


def two_rates(lag, noise=0.08, seconds=(100.0, 20.0)):
    return [
        delayed(
            synthetic_ramp(dp, Truth(noise=noise), ramp_s=ramp_s, seed=int(ramp_s), source=f"{dp:g}_{ramp_s:g}"), lag
        )
        for dp in PRESSURES
        for ramp_s in seconds
    ]


class TestLag:
    @pytest.mark.slow
    @pytest.mark.parametrize("lag", [0.05, 0.1, 0.5])
    def test_two_rates_tell_the_lag_from_hysteresis(self, lag):
        valve = identify(two_rates(lag))
        assert (valve.meter.lag_is, valve.meter.lag_s) == ("identified", pytest.approx(lag, abs=0.012, rel=0.05))
        for test in valve.positive.tests:
            assert test.u_knee_rising_V == pytest.approx(5.4, abs=5e-3)
            assert test.u_knee_falling_V == pytest.approx(5.3, abs=5e-3)
            assert test.u_guard_lower_V < 5.3

    def test_what_two_rates_show_beside_a_declared_lag_is_kept(self):
        for declared in (0.1, 0.02):
            meter = identify(two_rates(0.1), IdentifyOptions(meter_lag=declared)).meter
            assert meter.left_by_rates_s == pytest.approx(0.1 - declared, abs=4 * meter.left_by_rates_se_s)
            assert 0 < meter.left_by_rates_se_s < 0.02
        one = identify(two_rates(0.1, seconds=(100.0,)), IdentifyOptions(meter_lag=0.1)).meter
        assert one.left_by_rates_s is one.left_by_rates_se_s is UNSET

    def test_no_lag_is_found_where_there_is_none(self):
        valve = identify(two_rates(1e-6))
        assert valve.meter.lag_s == pytest.approx(0.0, abs=0.01)

    def test_one_rate_does_not_tell(self, wording):
        tests = two_rates(0.1, seconds=(100.0,))
        valve = identify(tests)
        assert (valve.meter.lag_is, valve.meter.lag_s) == ("unknown", 0.0)
        (warning,) = [warning for warning in valve.warnings if warning.code == "lag-unknown"]
        wording.of_test(warning.text)
        hysteresis = [test.u_knee_rising_V - test.u_knee_falling_V for test in valve.positive.tests]
        assert np.mean(hysteresis) == pytest.approx(0.1 + 2 * 0.1 * 0.1, abs=5e-3)


def codes(valve):
    return {warning.code for warning in valve.warnings}


class TestQualityGate:
    def test_noise_that_hides_the_knee_is_said(self):
        quiet, loud = (identify([synthetic_ramp(1.0, Truth(noise=noise), ramp_s=20.0)]) for noise in (0.05, 2.0))
        assert "noise" in codes(loud) and "noise" not in codes(quiet)

    def test_a_pressure_that_sags_by_more_than_a_third_is_said(self):
        assert "pressure-sag" in codes(identify([synthetic_ramp(1.0, Truth(sag=0.4))]))
        assert "pressure-sag" not in codes(identify([synthetic_ramp(1.0, Truth(sag=0.2))]))

    def test_what_the_meter_hides_is_said_beside_the_threshold(self):
        test = synthetic_ramp(1.0, Truth(floor=0.6), falling=False)
        row = as_document(identify([test], IdentifyOptions(meter_floor=0.6 * L_MIN)))["sides"]["positive"]["tests"][0]
        assert "nothing below 0.60 L/min" in row["not_observable"]["u_onset_rising_V"]
        assert row["not_observable"]["u_knee_falling_V"] == "there is no falling branch"
        assert 0 < row["u_onset_rising_se_V"] < 0.05
        assert row["u_knee_falling_V"] is None and row["u_onset_falling_se_V"] is None

    def test_flat_is_what_the_engineer_says(self):
        tests = [synthetic_ramp(dp, Truth(knee_rising=5.4 - 0.01 * dp, noise=0.02)) for dp in PRESSURES]
        assert identify(tests).positive.trend == "decreasing"
        flat = identify(tests, IdentifyOptions(flat_below=5e-3)).positive
        assert flat.trend == "flat" and np.ptp(flat.curve.offset_V) == 0 and flat.trend_p < 0.01
        assert max(flat.curve.offset_V) <= min(test.u_guard_lower_V for test in flat.tests)


def test_the_pressure_of_a_side_is_read_where_it_is_shut(recordings):
    for test in identify(recordings).sides["negative"].tests:
        assert test.dp_MPa * MPA == pytest.approx(MPA * round(test.dp_MPa))


TWO_SENSORS = DropColumns(quantities=("pA", "pB"), labels=("Druck A", "Druck B"))
OF_THE_EDGE = DropColumns(quantities=("pP", "pB"), labels=("Druck P", "Druck B"))


class TestDirectionOfThePressureDrop:
    """Recorded below zero at negative commands: the drop of a side is positive, and its direction is not lost."""

    def side(self, columns=TWO_SENSORS, **changes):
        recorded = {"dp_from": ((TWO_SENSORS,), (columns,)), "signed_dp": True} | changes
        signed, dp_from = recorded["signed_dp"], recorded["dp_from"]
        tests = [replace(bipolar(dp, Truth(), Truth(), signed_dp=signed), dp_from=dp_from) for dp in (1.0, 2.0)]
        return identify(tests, IdentifyOptions(meter_lag=0.0)).sides

    @pytest.mark.parametrize(("signed_dp", "sign", "words"), [
        (True, -1, "Druck B - Druck A"), (False, 1, "Druck A - Druck B"),
    ])  # fmt: skip
    def test_it_is_kept_with_each_side(self, signed_dp, sign, words):
        sides = self.side(signed_dp=signed_dp)
        assert sides["positive"].recorded_drop == RecordedDrop(columns=(TWO_SENSORS,), sign=1)
        found = sides["negative"]
        assert found.recorded_drop == RecordedDrop(columns=(TWO_SENSORS,), sign=sign)
        assert {test.dp_from for test in found.tests} == {words}
        assert [test.dp_MPa for test in found.tests] == pytest.approx([1.0, 2.0])

    def test_a_signed_column_is_said_to_be_reversed(self):
        dp = DropColumns(quantities=("dP",), labels=("dP_MPa",))
        assert {test.dp_from for test in self.side(dp)["negative"].tests} == {"-(dP_MPa)"}

    def test_the_drop_of_an_edge_s_own_ports_has_no_sign_to_change(self, wording):
        tests = [replace(bipolar(1.0, Truth(), Truth(), signed_dp=True), dp_from=((), (OF_THE_EDGE,)))]
        found = identify(tests)
        (warning,) = [warning for warning in found.warnings if warning.code == "side-refused"]
        assert list(found.sides) == ["positive"]
        wording.of_test(warning.text)

    def test_two_directions_on_one_side_are_refused(self, wording):
        tests = [bipolar(dp, Truth(), Truth(), signed_dp=dp == 1.0) for dp in (1.0, 2.0)]
        found = identify(tests)
        (warning,) = [warning for warning in found.warnings if warning.code == "side-refused"]
        assert list(found.sides) == ["positive"]
        wording.of_test(warning.text)

    def test_two_directions_in_one_recording_are_refused(self, wording):
        one, other = (bipolar(dp, Truth(), Truth(), signed_dp=True) for dp in (1.0, 2.0))
        joined = {name: np.concatenate([getattr(one, name)] * 2 + [getattr(other, name)]) for name in ("u", "q", "dp")}
        joined["dp"][2 * one.dp.size :] = np.abs(other.dp)
        time = np.arange(joined["u"].size) * (one.time[1] - one.time[0])
        found = identify([replace(one, time=time, **joined)])
        (warning,) = [warning for warning in found.warnings if warning.code == "side-refused"]
        wording.of_test(warning.text)


class TestOneMeterForBothSides:
    """What the meter does is said once, with its own sign."""

    TRUTHS = (Truth(slope=4.0), Truth(knee_rising=5.0, slope=3.0))

    def warnings(self, code, zero=0.0, **recorded):
        tests = [bipolar(dp, *self.TRUTHS, **recorded) for dp in PRESSURES]
        found = identify([replace(test, q=test.q + zero * L_MIN) for test in tests])
        return [warning for warning in found.warnings if warning.code == code]

    @pytest.mark.parametrize("zero", [-0.3, 0.3])
    def test_a_zero_error_is_said_once(self, zero, wording):
        (warning,) = self.warnings("meter-zero", zero)
        assert warning.source is None
        wording(f"flow meter: zero error of {zero:+.1f} on both sides", warning.text)

    def test_a_flow_without_sign_is_said_once(self, wording):
        (warning,) = self.warnings("unsigned-flow", signed_flow=False)
        wording("flow meter: no sign at negative commands", warning.text)
        assert not self.warnings("unsigned-flow")
