"""How far the straight part reaches, asked of all branches together; and what a table of few levels tells."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.knees import linear_region as straight_part
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.knees.profile import crossing, flow_at_top, largest_flow, smooth_profile
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.branches import Branch
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

PRESSURES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)
DECLARED = IdentifyOptions(meter_lag=0.0)


def ramps(bend=0.0, odd=None, noise=0.15):
    """Ramp tests of a valve whose flow bends down by a share of itself at full command; `odd` bends alone."""
    tests = []
    for dp in PRESSURES:
        test = synthetic_ramp(dp, Truth(slope=3 * dp**0.5, noise=noise), seed=3)
        share = np.clip(test.u - 5.4, 0, None) / 4.6
        mine = bend if odd is None or odd == dp else 0.0
        tests.append(replace(test, q=test.q * (1 - mine * share)))
    return tests


def windows(tests):
    return [shape.line.window for item in describe_tests(tests, DECLARED).tests for shape in item.shapes]


def test_a_straight_valve_is_straight_to_the_top_and_down_to_the_first_flow():
    found = windows(ramps())
    assert [high for _, high in found].count(0.98) >= 11
    assert [low < 0.12 for low, _ in found].count(True) >= 11


@pytest.mark.slow
def test_a_bend_too_slight_for_one_branch_stops_all():
    tests = ramps(bend=0.006)
    alone = [windows([test])[0][1] for test in tests]
    together = [high for _, high in windows(tests)]
    assert max(together) < 0.98 <= max(alone)
    for test in identify(tests, DECLARED).positive.tests:
        assert test.u_knee_rising_V == pytest.approx(5.4, abs=0.01)


def test_an_odd_branch_stops_alone():
    found = windows(ramps(bend=0.4, odd=2.0))
    odd = 2 * PRESSURES.index(2.0)
    assert max(high for _, high in found[odd : odd + 2]) < 0.98
    assert [high for _, high in found].count(0.98) >= 9


def test_without_the_question_a_bent_valve_loses_its_knee(monkeypatch):
    monkeypatch.setattr(straight_part, "STRAIGHT", 1e9)
    monkeypatch.setattr(straight_part, "ALONE", 1e9)
    monkeypatch.setattr(straight_part, "LARGEST_SHIFT", 1.0)
    monkeypatch.setattr("dzdesign.identify.knees.linear_region.LARGEST_SHIFT", 1.0)
    found = identify(ramps(bend=0.2), DECLARED).positive.tests
    assert min(test.u_knee_rising_V for test in found) < 5.4 - 0.05


def test_drop_outs_do_not_move_a_crossing():
    u = np.linspace(0, 10, 1001)
    y = np.clip(u - 5, 0, None)
    spoiled = y.copy()
    spoiled[900:904] = 0.0  # four bins in a row without flow, far above
    spoiled[100] = 3.0
    assert crossing(u, spoiled, 1.0) == pytest.approx(crossing(u, y, 1.0)) == pytest.approx(6.0, abs=0.01)


def test_drop_outs_do_not_lower_the_flow_at_full_command():
    """Two runs of zeros, each as long as two bins, near the end; and one that the ramp's last bins are."""
    u = np.linspace(0.0, 10.0, 1000)
    flow = np.maximum(u - 5.0, 0.0) + 0.01 * np.random.default_rng(4).standard_normal(u.size)
    for lost in ((970, 974, 985, 989), (996, 1000)):
        y = flow.copy()
        for start, stop in zip(lost[::2], lost[1::2], strict=True):
            y[start:stop] = 0.0
        assert flow_at_top(u, y) == pytest.approx(5.0, abs=0.02)


def test_the_largest_flow_is_that_which_flowed_where_the_valve_has_play():
    """Falling, the spool stands still over the play: a line through the top of that branch ends above the flow."""
    up, play = np.linspace(0.0, 10.0, 5000), 0.15
    down = up[::-1]
    spool_down = np.minimum(down + play, 10.0)
    rising, falling = (np.clip(3.0 * (spool - 5.0), 0.0, None) for spool in (up, spool_down))
    branches = (Branch(rising=True, u=up, q=rising, dp=None), Branch(rising=False, u=down, q=falling, dp=None))
    assert flow_at_top(*smooth_profile(down, falling, 10.0)) > 15.2  # the fault that this is about
    assert largest_flow(branches, 10.0) == pytest.approx(15.0, abs=0.01)
    assert largest_flow((None, branches[1]), 10.0) >= 15.0


class TestTables:
    @staticmethod
    def table(step=0.4, knee=5.5, noise=0.0, hold=1):
        u = np.repeat(np.arange(0, 10 + step / 2, step), hold)
        u = np.concatenate([u, u[::-1]])
        q = np.minimum(np.clip(u - knee, 0, None) * 12, 10.0) + noise * np.random.default_rng(1).standard_normal(u.size)
        test = synthetic_ramp(1.0, Truth())
        return replace(
            test, time=np.arange(u.size, dtype=float), u=u, q=q * L_MIN, dp=np.full(u.size, 1e6), source="table.csv"
        )

    def test_few_levels_tell_no_threshold(self):
        with pytest.raises(InputError, match=r"only \d samples lie between 12% and 50% of the largest flow"):
            identify([self.table()], DECLARED)

    def test_finer_levels_do(self):
        (test,) = identify([self.table(step=0.05)], DECLARED).positive.tests
        assert test.u_knee_rising_V == pytest.approx(5.5, abs=0.01)
        assert test.u_knee_se_V < 0.05
