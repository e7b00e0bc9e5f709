"""What is said of pressure drops that can't be true: a flow against them, one stuck sensor, a number typed in."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.data_quality.catalogue import catalogue
from dzdesign.identify.data_quality.pressures import about_mixtures
from dzdesign.identify.options import IdentifyOptions
from tests.support.repeatable_valves import REPEATABLE, identify
from tests.support.synthetic import MPA, Truth, synthetic_ramp

#: Bounds of a mixture lie volts below its knees; at this confidence they are below zero.
CERTAIN = IdentifyOptions(confidence=0.999999)


def ramp(dp_MPa, *, said=None, exponent=0.5, source=None, **changes):
    """A ramp whose flow gain grows with a power of its pressure drop; `said`: the one in its column or declared."""
    grows = dp_MPa**exponent
    truth = Truth(knee_rising=5.5 - 0.05 * dp_MPa, slope=4 * grows, saturation=100 * grows)
    test = synthetic_ramp(dp_MPa, replace(truth, **changes), seed=round(10 * dp_MPa), rate_Hz=25.0)
    says = dp_MPa if said is None else said
    return replace(test, source=source or f"ramp_dP{says:g}.csv", dp=np.full(test.u.size, says * MPA))


def piece(test, name, kept):
    return replace(test, source=name, **{key: getattr(test, key)[kept] for key in ("time", "u", "q", "dp")})


def scattering(test, seed=0):
    noise = np.random.default_rng(seed).standard_normal(test.u.size)
    return replace(test, dp=np.round(test.dp / MPA + 0.01 * noise, 4) * MPA)


def warned(tests, code, options=REPEATABLE):
    return [warning for warning in identify(tests, options).warnings if warning.code == code]


class TestFlowAgainstPressure:
    @pytest.mark.parametrize("pressures", [(0.5, 1), (0.5, 1, 2), (0.5, 1, 2, 3)])
    def test_less_flow_at_more_pressure_is_said_of_the_right_recording(self, pressures):
        tests = [ramp(dp, said=5.0 if dp == 0.5 else None) for dp in pressures]
        (warning,) = warned(tests, "flow-contradicts-dp")
        assert warning.source == "ramp_dP5.csv" and "L/min a volt at 5 MPa, expected about 8.9" in warning.text
        assert "assigned to wrong pressure drops, so the certificate may not hold" in warning.text

    def test_a_unit_that_is_wrong_by_ten_is_said_though_the_flow_rises(self):
        (warning,) = warned([ramp(1), ramp(2, said=20.0)], "flow-contradicts-dp")
        assert "at 20 MPa, expected about 17.9" in warning.text
        (warning,) = warned([ramp(0.5), ramp(20, said=2.0)], "flow-contradicts-dp")
        assert "ramp_dP" in warning.source

    def test_two_that_were_swapped_are_said(self):
        (warning,) = warned([ramp(1, said=2.0), ramp(2, said=1.0)], "flow-contradicts-dp")
        said = f"{warning.source}: {warning.text}"
        assert "ramp_dP1.csv" in said and "ramp_dP2.csv" in said

    @pytest.mark.parametrize("pressures", [(6, 8, 10), (6, 10), (1, 2, 5), (3, 3.5, 4.5)])
    def test_a_flow_that_does_not_grow_is_said(self, pressures, wording):
        """A gauge at the supply, or a valve that compensates its pressure."""
        (warning,) = warned([ramp(2, said=dp, source=f"{dp}.csv") for dp in pressures], "flow-contradicts-dp")
        if pressures == (6, 8, 10):
            wording("pressures: a flow that does not grow", warning.text)

    @pytest.mark.parametrize("exponent", [0.3, 0.5, 0.6])
    @pytest.mark.parametrize("pressures", [(1, 2, 5), (6, 8, 10), (6, 10), (5, 6)])
    def test_valves_as_they_are_are_not_blamed(self, exponent, pressures):
        assert not warned([ramp(dp, exponent=exponent) for dp in pressures], "flow-contradicts-dp")

    def test_pressures_too_near_for_a_growth_are_not_compared(self):
        assert not warned([ramp(5, exponent=0.0), ramp(6, exponent=0.0)], "flow-contradicts-dp")

    def test_a_supply_at_its_limit_is_not_blamed(self):
        assert not warned([ramp(dp, saturation=9.0) for dp in (0.5, 1, 2, 5)], "flow-contradicts-dp")

    def test_neighbours_are_not_compared(self):
        assert not warned([ramp(2), ramp(1.5, said=2.2)], "flow-contradicts-dp")

    def test_it_stands_high(self):
        order = list(catalogue())
        assert order.index("flow-contradicts-dp") < order.index("pressure-stuck")

    @pytest.mark.parametrize("sign", [1, -1])
    def test_recordings_taken_as_one_test_are_named(self, sign):
        tests = [ramp(0.5, said=5.0, source="Rampe_0_5MPa.txt"), ramp(1), ramp(5, source="Rampe_5MPa.txt")]
        tests = [replace(test, u=sign * test.u, q=sign * test.q, dp_is_declared=True) for test in tests]
        words = (
            r"taken as one test, at 5 MPa, differ in their flow at 10 V: "
            r"12\.\d L/min in 'Rampe_0_5MPa.txt', 4\d\.\d L/min in 'Rampe_5MPa.txt'"
        )
        with pytest.raises(InputError, match="not above zero.*it may be that recordings that are " + words):
            identify(tests, CERTAIN)
        (warning,) = warned(tests, "flow-contradicts-dp")
        assert re.search(words, warning.text)

    def test_a_side_that_is_missing_for_that_reason_says_it(self):
        mixed = [ramp(0.5, said=5.0, source="a.csv"), ramp(1, source="b.csv"), ramp(5, source="c.csv")]
        tests = [ramp(1), *(replace(test, u=-test.u, q=-test.q) for test in mixed)]
        (warning,) = warned(tests, "side-refused", CERTAIN)
        assert "it may be that recordings that are taken as one test, at 5 MPa" in warning.text

    def test_recordings_of_one_test_that_differ_are_said_where_nothing_is_refused(self):
        mixed = [ramp(1), ramp(4, source="a.csv"), ramp(2.2, said=4.0, source="b.csv"), ramp(4, source="c.csv")]
        (warning, *_) = warned(mixed, "flow-contradicts-dp")
        assert "at 4 MPa, differ in their flow" in warning.text and "'b.csv'" in warning.text

    def test_a_repeated_ramp_on_a_weak_supply_is_no_mixture(self):
        """Half of the pressure drop is gone at full command: less flows, as the sensor says."""
        strong = synthetic_ramp(2, Truth(), rate_Hz=25.0, source="strong.csv")
        weak = synthetic_ramp(2, Truth(sag=0.6), rate_Hz=25.0, source="weak.csv")
        assert weak.q.max() < 0.7 * strong.q.max()
        assert not warned([strong, weak], "flow-contradicts-dp")

    def test_pieces_of_a_ramp_are_no_mixture(self):
        whole = ramp(1)
        pieces = [piece(whole, "low.csv", whole.u < 7), piece(whole, "high.csv", whole.u > 4)]
        assert not warned([whole, *pieces], "flow-contradicts-dp")

    def test_a_piece_that_ends_where_the_valve_hardly_opens_shows_no_flow_to_compare(self):
        """Just above the knee hysteresis alone makes the flows of rising and falling pieces differ."""
        whole = ramp(1)
        up = np.arange(whole.u.size) < whole.u.size // 2
        low = whole.u < 5.7
        halves = [piece(whole, "up.csv", low & up), piece(whole, "down.csv", low & ~up)]
        assert list(about_mixtures(halves)) and not list(about_mixtures([whole, *halves]))


class TestOneStuckRecording:
    def test_a_number_beside_a_sensor_that_scatters(self, wording):
        tests = [scattering(ramp(1)), ramp(2, said=3.8, source="b.csv"), scattering(ramp(5))]
        (warning,) = warned(tests, "pressure-stuck")
        assert warning.source == "b.csv"
        wording.of_test(warning.text)
        assert not warned(tests, "declared-pressure")

    def test_the_name_tells_it_too(self, wording):
        tests = [ramp(1, source="ramp_1MPa.csv"), ramp(2, said=3.8, source="ramp_2MPa.csv")]
        (warning,) = warned(tests, "pressure-stuck")
        assert warning.source == "ramp_2MPa.csv"
        wording.of_test(warning.text)
        assert [item.source for item in warned(tests, "declared-pressure")] == ["ramp_1MPa.csv"]

    @pytest.mark.parametrize("name", ["ramp_2_5MPa.csv", "ramp_5_2MPa.csv", "ramp_2MPa.csv"])
    def test_a_name_that_may_agree_is_no_contradiction(self, name):
        assert not warned([ramp(1), ramp(2, source=name)], "pressure-stuck")

    def test_a_coarse_sensor_between_two_steps_is_not_blamed(self):
        """Its last digit flickers where a level ends, and stands still elsewhere."""
        flickers = ramp(1)
        flickers = replace(flickers, dp=flickers.dp + 0.05 * MPA * (np.arange(flickers.u.size) % 3 == 0))
        assert not warned([flickers, ramp(2)], "pressure-stuck")

    def test_a_declared_one_is_not_blamed(self):
        assert not warned([scattering(ramp(1)), replace(ramp(2), dp_is_declared=True)], "pressure-stuck")


class TestTypedPressure:
    def test_one_number_everywhere_is_no_measurement(self, wording):
        found = warned([ramp(1), ramp(4)], "declared-pressure")
        assert [item.source for item in found] == ["ramp_dP1.csv", "ramp_dP4.csv"]
        wording.of_test(found[1].text)

    def test_what_scatters_or_sags_was_measured(self):
        assert not warned([scattering(ramp(1)), scattering(ramp(4))], "declared-pressure")
        assert not warned([ramp(1, sag=0.0), synthetic_ramp(4, Truth(sag=0.2, slope=8.0))], "declared-pressure")

    def test_no_number_changes(self):
        """Words only: what is identified is the same to the last bit."""
        typed, declared = ([replace(ramp(dp), dp_is_declared=how) for dp in (1, 4)] for how in (False, True))
        sides = [identify(tests).positive for tests in (typed, declared)]
        origin = [{test.dp_from for test in side.tests} for side in sides]
        assert origin == [{None}, {"declared"}]
        one, other = (replace(side, tests=tuple(replace(test, dp_from=None) for test in side.tests)) for side in sides)
        assert one == other


def test_the_order_of_files_changes_no_word():
    tests = [ramp(1, source="ramp_1MPa.csv"), ramp(1, source="y"), ramp(0.4, said=6.0, source="z")]
    tests += [ramp(2, said=3.8, source="ramp_2MPa.csv"), ramp(2.5, said=3.8, source="x")]
    assert identify(tests).warnings == identify(tests[::-1]).warnings
