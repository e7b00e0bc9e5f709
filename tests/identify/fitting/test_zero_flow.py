"""A declared flow at zero: true flows of worn valves of a plant of its own, and what each part of the bound is for."""

import math
from dataclasses import replace

import numpy as np
import pytest
import worn_valves
from recorded_ramps import L_MIN
from worn_valves import PRESSURES_MPa, Worn, examine

from dzdesign.core.errors import InputError
from dzdesign.identify.fitting import zero_flow
from dzdesign.identify.identification import identify
from dzdesign.identify.knees.readings_at_rest import RestFlows
from dzdesign.identify.options import IdentifyOptions
from dzdesign.stages.identify import IdentifyArguments, identify_options

#: The measured worn spool: 0.3 L/min in the overlap at 5 MPa.
WORN = Worn(
    edge_V=5.4, edge_V_MPa=-0.04, wear=0.3, length_V=0.9, rest=0.0, oil=0.0, scatter_V=4e-3, noise=0.05, ramp_s=40.0,
    repeats=2, lag=0.0, zero=0.0, floor=0.0, zero_flow=0.35,
)  # fmt: skip


def recordings(valve, *, pressures=PRESSURES_MPa, seed=1):
    rng = np.random.default_rng(seed)
    order = rng.permutation(np.repeat(pressures, valve.repeats)).tolist()
    return [worn_valves._ramp(valve, dp, f"ramp{at}.csv", 300.0 * at, rng) for at, dp in enumerate(order)]


def identified(valve, *, declared=True, pressures=PRESSURES_MPa, **options):
    flow = valve.zero_flow * L_MIN if declared else None
    chosen = IdentifyOptions(meter_lag=valve.lag, zero_flow=flow, **options)
    return identify(recordings(valve, pressures=pressures), chosen)


def bounds(model):
    return np.array([test.u_guard_lower_V for test in model.positive.tests])


def true_flows(valve, model):
    """Return the flow at the bounds, L/min."""
    at = zip([test.dp_MPa for test in model.positive.tests], bounds(model), strict=True)
    return np.array([float(valve.flow(dp, np.array(bound))) for dp, bound in at])


def warning(model):
    (found,) = [each for each in model.warnings if each.code == "zero-flow"]
    return found


@pytest.mark.parametrize("guard", ["closing", "opening"])
def test_a_worn_valve_loses_little_command_and_passes_no_more_than_was_declared(guard):
    found = [examine(WORN, guard, np.random.default_rng([16, seed])) for seed in range(3)]
    assert max(each.excess for each in found) <= 1
    assert all(each.declared == 1 for each in found)
    assert max(each.lost for each in found) < 2.5 < 8 < min(each.lost_before for each in found)


def test_the_negative_side_has_one_of_its_own():
    tests = recordings(WORN)
    turned = [replace(test, u=-test.u, q=-test.q) for test in tests]
    options = IdentifyOptions(meter_lag=0.0, zero_flow=WORN.zero_flow * L_MIN)
    both = [identify(each, options).sides for each in (tests, turned)]
    positive, negative = both[0]["positive"], both[1]["negative"]
    assert negative.certificate.zero_flow_L_min == pytest.approx(0.35)
    assert negative.curve.u_lower_V == pytest.approx(positive.curve.u_lower_V, abs=1e-6)


class TestWhatCounts:
    """Each part of the sum, by what happens without it."""

    def test_a_leak_at_rest(self, monkeypatch):
        valve = replace(WORN, wear=0.6, length_V=3.0, rest=0.04, zero_flow=0.65)
        sound = identified(valve)
        assert true_flows(valve, sound).max() <= valve.zero_flow
        monkeypatch.setattr(zero_flow, "largest_at_rest", lambda group, options: [0.0] * len(group.tests))
        assert true_flows(valve, identified(valve)).max() > valve.zero_flow

    def test_a_leak_that_a_floor_hides_at_low_pressure_drops(self, monkeypatch):
        """Zeros there are no readings: a straight line through them would take the rest for the meter's zero."""
        rng = np.random.default_rng([1616, 4, 48])
        valve = worn_valves.floored(rng)
        assert examine(valve, "closing", rng).excess <= 1
        found = RestFlows.passed_by_the_valve
        monkeypatch.setattr(
            RestFlows, "passed_by_the_valve", lambda rest, *at: found(replace(rest, least=math.inf), *at)
        )
        rng = np.random.default_rng([1616, 4, 48])
        assert examine(worn_valves.floored(rng), "closing", rng).excess > 1

    def test_what_a_meters_floor_hides(self, monkeypatch):
        valve = replace(WORN, floor=0.3, zero_flow=0.5)
        sound = identified(valve, meter_floor=0.3 * L_MIN)
        assert true_flows(valve, sound).max() <= valve.zero_flow
        readings = zero_flow._readings
        monkeypatch.setattr(zero_flow, "_readings", lambda shape, floor: readings(shape, 0.0))
        assert np.all(bounds(identified(valve, meter_floor=0.3 * L_MIN)) >= bounds(sound))
        assert np.any(bounds(identified(valve, meter_floor=0.3 * L_MIN)) > bounds(sound) + 0.005)

    def test_oil_that_leaks_unlike_from_ramp_to_ramp(self, monkeypatch):
        valve = replace(WORN, oil=0.2, wear=0.6, length_V=3.0, repeats=3, zero_flow=0.6, noise=0.02)
        lowered = bounds(identified(valve))
        monkeypatch.setattr(zero_flow, "_scatter", lambda tests, options: 0.0)
        assert (bounds(identified(valve)) - lowered)[-1] > 0.1

    def test_the_declared_zero_error(self):
        assert np.all(bounds(identified(WORN, meter_zero=0.1 * L_MIN)) < bounds(identified(WORN)))

    def test_the_noise(self, monkeypatch):
        lowered = bounds(identified(WORN))
        monkeypatch.setattr(zero_flow, "student_errors", lambda options, count: 0.0)
        assert np.all(bounds(identified(WORN)) > lowered)

    def test_the_scatter_from_ramp_to_ramp(self):
        wide, narrow = (bounds(identified(replace(WORN, repeats=1), repeatability=sd)) for sd in (5e-3, 5e-4))
        assert np.all(wide < narrow - 0.05)


class TestWhatCannotBePromised:
    def test_a_leak_that_no_compensator_stops_is_said_with_its_flows(self):
        valve = replace(WORN, rest=0.06, zero_flow=0.2)
        model = identified(valve)
        allowed = [test.zero_flow_L_min for test in model.positive.tests]
        at_rest = [float(valve.flow(dp, np.array(0.0))) for dp in PRESSURES_MPa]
        assert all(most > rest for most, rest in zip(allowed, at_rest, strict=True))
        assert allowed[-1] > 0.5 > at_rest[-1] > 0.3
        assert np.all(true_flows(valve, model) <= allowed)
        assert "leaks" in warning(model).text and f"{allowed[-1]:.3g} L/min" in warning(model).text
        # The first growth beyond the leak is guarded, not the first flow.
        assert bounds(model)[0] > bounds(identified(valve, declared=False))[0]

    def test_less_than_the_recordings_resolve(self):
        model = identified(replace(WORN, zero_flow=0.02))
        side = model.positive
        assert side.zero_flow_L_min == pytest.approx(side.certificate.level_L_min, rel=0.05)
        assert side.certificate.zero_flow_L_min == pytest.approx(0.02)
        assert "less than the recordings resolve" in warning(model).text

    def test_at_one_pressure_a_reading_at_rest_counts_as_a_leak(self):
        valve = replace(WORN, zero=0.3)
        several, one = identified(valve), identified(valve, pressures=(5.0,))
        assert several.positive.zero_flow_L_min == pytest.approx(0.35)
        assert one.positive.zero_flow_L_min > 0.4
        assert "one pressure drop" in warning(one).text

    def test_what_is_kept_says_nothing(self):
        model = identified(WORN)
        assert not [each for each in model.warnings if each.code == "zero-flow"]
        assert identified(WORN, declared=False).positive.zero_flow_L_min is None

    def test_a_flow_of_an_open_valve_is_refused(self):
        with pytest.raises(InputError, match=r"a flow at zero of 3 L/min is declared"):
            identified(replace(WORN, zero_flow=3.0))

    @pytest.mark.parametrize("flow", [0.0, -1e-6])
    def test_none_at_all_is_refused(self, flow):
        with pytest.raises(InputError, match="zero_flow"):
            IdentifyOptions(zero_flow=flow)


def test_the_option_takes_any_unit_of_flow():
    assert identify_options(IdentifyArguments(["a.csv"], zero_flow="100 mL/min")).zero_flow == pytest.approx(0.1 / 6e4)
    assert identify_options(IdentifyArguments(["a.csv"])).zero_flow is None


def test_between_the_tests_the_allowed_flow_runs_straight():
    side = identified(replace(WORN, rest=0.06, zero_flow=0.2, repeats=1), pressures=(1.0, 5.0)).positive
    low, high = (test.zero_flow_L_min for test in side.tests)
    assert side.zero_flow_at(3.0) == pytest.approx((low + high) / 2, rel=1e-3)
    assert side.zero_flow_at(9.0) == high
