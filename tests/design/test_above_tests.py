"""Above the highest tested pressure drop: what each `--above` drives at zero command, on truths of the test's own."""

from fractions import Fraction

import numpy as np
import pytest

from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.exhaustive.all_inputs import check_above
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import differences
from tests.support.designs import designed
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp

TESTED = (1.0, 2.0, 3.5, 5.0)
#: Declared, V/MPa²; and a bend of the truth at the tests, a third of it.
M, BEND = 6e-3, 2e-3


def threshold_V(dp_MPa: float, bend_V_MPa2: float = BEND, *, rising: bool = False) -> float:
    """Return the truth: it bends upwards at the tests, and above the last one by as much as is asked."""
    last = TESTED[-1]
    inside = min(dp_MPa, last)
    value = 5.6 - 0.06 * inside + BEND / 2 * inside**2
    beyond = dp_MPa - inside
    value += (-0.06 + BEND * last) * beyond + bend_V_MPa2 / 2 * beyond**2
    return 10.8 - value if rising else value


@pytest.fixture(scope="module", params=["line", "smooth", "monotone"])
def valve(request):
    """A valve under each premise; that of the line is straight."""
    straight = request.param == "line"
    truths = {dp: 5.6 - 0.05 * dp if straight else threshold_V(dp) for dp in TESTED}
    ramps = [synthetic_ramp(dp, Truth(knee_rising=u, slope=4 * dp**0.5, noise=0.02)) for dp, u in truths.items()]
    curvature = M * 1e-12 if request.param == "smooth" else None
    return identify(ramps, IdentifyOptions(meter_lag=0.0, curve=request.param, curvature=curvature))


@pytest.fixture(scope="module")
def made(valve):
    """Its designs, by what is chosen above the tests."""
    return {above: designed(valve, above=above) for above in ("hold", "lower", "release")}


def at_zero_V(compensator, dp_MPa: float) -> float:
    """Return the drive at zero command and a pressure drop, as the firmware rounds it: `verify` runs the C of it."""
    sensor = compensator.signals.pressure_a
    per_MPa = (sensor.full_code - sensor.zero_code) / float(sensor.span_MPa)
    compare = compensator.compare(compensator.signals.command.zero_code, int(dp_MPa * per_MPa))
    return compare / compensator.signals.compare_max * float(compensator.u_max_V)


def closing_V(valve, dp_MPa: float, bend: float) -> float:
    """Return the truth of the closing knee under the valve's premise."""
    curve = valve.positive.certified["closing"]
    hysteresis = threshold_V(5.0) - curve.u_threshold_V[-1]
    if curve.premise == "line":
        return 5.6 - 0.05 * dp_MPa + bend / 2 * max(dp_MPa - 5.0, 0.0) ** 2 - (5.35 - curve.u_threshold_V[-1])
    return threshold_V(dp_MPa, bend) - hysteresis


def lines(compensator, begin: str) -> list[str]:
    return [each for each in compensator.costs if each.startswith(begin)]


class TestDrive:
    @pytest.mark.parametrize("choice", ["lower", "release"])
    def test_within_the_premise_no_drive_lies_above_the_truth(self, valve, made, choice):
        curve = valve.positive.certified["closing"]
        # Of a threshold that is known to run one way nothing is certified; straight on is what it is continued by.
        assert curve.above.certified == (curve.premise != "monotone")
        for bend in {"line": (0.0,), "smooth": (0.0, M, -M), "monotone": (0.0,)}[curve.premise]:
            for dp in (5.1, 6.0, 8.0, 10.0, 15.0, 18.5):
                assert at_zero_V(made[choice], dp) <= max(closing_V(valve, dp, bend), 0.0) + 1e-4, (bend, dp)

    def test_held_it_lies_above_a_falling_truth(self, valve, made):
        assert at_zero_V(made["hold"], 15.0) > closing_V(valve, 15.0, 0.0)

    def test_what_is_beyond_the_premise_is_outside_the_promise_and_said(self, valve, made):
        premise, (line,) = valve.positive.certified["closing"].premise, lines(made["lower"], "above")
        if premise == "monotone":
            assert "Not certified" in line
        else:
            assert at_zero_V(made["lower"], 10.0) > closing_V(valve, 10.0, -30 * M)
            assert "certified if" in line and ("curvature at most M" in line or "straight" in line)

    def test_the_tests_keep_their_offset(self, made):
        for dp in TESTED:
            code = round(made["hold"].signals.pair(1).dp_code(Fraction(dp)))
            offsets = [float(each.beta(code) * each.positive.u_min0_over_u_max) for each in made.values()]
            assert min(offsets) > max(offsets) - 1e-3

    def test_let_go_nothing_but_one_unit_is_left_two_segments_above_the_tests(self, made):
        released = made["release"]
        side, pair = released.positive, released.signals.pair(1)
        node = round(pair.dp_code(Fraction(5))) // released.beta_step_codes + 2
        assert set(side.beta[node:]) == {1} and side.beta[node - 1] > 1 and min(side.transition_beta) > 1
        assert side.certificate.released_from_MPa == pair.dp_MPa(node * released.beta_step_codes)


def test_of_one_test_the_offset_is_held_and_said_to_be():
    valve = identify([synthetic_ramp(1.0, Truth())], IdentifyOptions(meter_lag=0.0))
    made = designed(valve)
    assert valve.positive.certified["closing"].above is None
    assert len(set(made.positive.beta)) == 1 and made.positive.certificate.released_from_MPa is None
    (line,) = lines(made, "above")
    assert "a single test gives no slope" in line and "nothing is certified" in line
    assert min(designed(valve, above="release").positive.beta) == 1


def test_a_rising_threshold_known_to_run_one_way_is_certified_where_it_is_held():
    ramps = [synthetic_ramp(dp, Truth(knee_rising=threshold_V(dp, rising=True), slope=4 * dp**0.5, noise=0.02))
             for dp in TESTED]  # fmt: skip
    valve = identify(ramps, IdentifyOptions(meter_lag=0.0, curve="monotone"))
    made = designed(valve)
    assert valve.positive.trend == "increasing" and valve.positive.certified["closing"].above.certified
    assert float(made.positive.certificate.holds_to_MPa) > 19 and made.positive.certificate.released_from_MPa is None
    (line,) = lines(made, "below")
    assert "possible" in line


@pytest.fixture(scope="module")
def lowered():
    """A compensator under a declared curvature, without a transition."""
    ramps = [synthetic_ramp(dp, Truth(knee_rising=threshold_V(dp), slope=4 * dp**0.5, noise=0.02)) for dp in TESTED]
    valve = identify(ramps, IdentifyOptions(meter_lag=0.0, curve="smooth", curvature=M * 1e-12))
    return designed(valve, transition="off")


class TestFaults:
    """Seeded: each is found by the one check that is there for it."""

    def drives(self, compensator):
        exact = ExactLaw(compensator)
        found = differences(exact)
        drive = [exact.compare_value(exact.zero, exact.corners(exact.betas(int(dp)))) for dp in found.values]
        return exact, found, np.array(drive)

    def test_its_own_drive_passes(self, lowered):
        found = check_above(*self.drives(lowered))
        assert found.over_compensated + found.rising + found.not_released == 0
        assert found.certified_to_MPa > 8 and 0 < found.smallest_margin_V < 1e-2 and found.codes > 1000

    def test_a_drive_above_the_continued_bound(self, lowered):
        exact, found, drive = self.drives(lowered)
        dp = found.values * float(exact.ahead.per_code_MPa)
        drive[(dp > 7) & (dp < 7.1)] += 60
        assert check_above(exact, found, drive).over_compensated > 0

    def test_an_offset_that_is_not_let_go(self, lowered):
        released = designed(lowered.valve, transition="off", above="release")
        exact, found, drive = self.drives(released)
        drive[-3:] = 5
        assert check_above(exact, found, drive).not_released > 0
