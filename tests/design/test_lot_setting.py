"""One setting for many valves: certified for each, the valve's own where all are alike, refused where there is none."""

import pytest

from dzdesign.core.errors import InputError
from dzdesign.design.ceiling import offset_ceiling
from dzdesign.design.certificate import guarded_curve
from dzdesign.design.lot_setting import lot_setting
from dzdesign.design.machine import allowance_of
from dzdesign.identify.options import IdentifyOptions
from tests.support.designs import BOTH_SIGNS, designed
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp


def valve(knee, pressures=(1.0, 2.5, 5.0), *, seed=0, curve=None):
    tests = [synthetic_ramp(dp, Truth(knee_rising=knee(dp)), seed=seed, rate_Hz=10.0, ramp_s=60.0) for dp in pressures]
    return identify(tests, IdentifyOptions(curve=curve))


@pytest.fixture(scope="module")
def falling():
    return designed(valve(lambda dp: 5.5 - 0.06 * dp))


@pytest.fixture(scope="module")
def rising():
    return designed(valve(lambda dp: 5.1 + 0.05 * dp, seed=1))


def highest_over(common, each, label="positive", sign=1):
    """Return by how much the common offset exceeds a valve's own exact ceiling, at worst, over u_max."""
    own = each
    curve = guarded_curve(each.valve.sides[label], own.side(sign).certificate.guard, own.below_dp0)
    limit = offset_ceiling(curve, own.u_max_V, allowance_of(own.signals, sign=sign)).limit
    u_min0 = common.side(sign).u_min0_over_u_max
    return max(common.beta(code, sign) * u_min0 - top for code, top in enumerate(limit))


@pytest.mark.slow
def test_valves_of_opposite_trends_have_one_setting_under_both(falling, rising):
    common = lot_setting({"falling": falling, "rising": rising})
    assert set(common.binding) == {"falling", "rising"}
    assert all(highest_over(common.compensator, each) <= 0 for each in (falling, rising))
    assert highest_over(falling, rising) > 0 and highest_over(rising, falling) > 0  # neither own one would do


def test_of_valves_that_are_alike_it_is_their_own(falling):
    common = lot_setting({"a": falling, "b": falling}).compensator
    off = designed(falling.valve, transition="off")
    assert common.positive == off.positive and not common.transition_codes


@pytest.mark.slow
def test_both_signs():
    each = designed(golden_valve(FULL), transition="off", command_signal=BOTH_SIGNS)
    common = lot_setting({"a": each, "b": each}).compensator
    assert (common.positive, common.negative) == (each.positive, each.negative)
    assert highest_over(common, each, "negative", -1) <= 0


@pytest.mark.slow
def test_what_has_no_common_setting_is_told_why(falling, rising, wording):
    low, high = (
        designed(valve(lambda dp: 5.4 - 0.05 * dp, pressures, curve="line")) for pressures in ((0.5, 1.0), (2.0, 4.0))
    )
    with_transition = designed(falling.valve, transition="2 %")
    for what, batch in {
        "no common pressure drop": {"low": low, "high": high},
        "one valve": {"low": low},
        "another law": {"a": falling, "b": designed(rising.valve, law="target")},
        "a transition": {"a": with_transition, "b": with_transition},
    }.items():
        with wording.refusal(InputError, f"a lot setting: {what}"):
            lot_setting(batch)
