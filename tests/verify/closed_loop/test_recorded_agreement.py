"""A recorded curve that is not that of its test's thresholds is told from one that is."""

from copy import deepcopy

import numpy as np
import pytest

from dzdesign.core.artefact_types import RuleError
from dzdesign.verify.closed_loop.recorded_agreement import check_recorded
from tests.identify.valve.test_valve_agrees import read, side_of, valve_json


@pytest.fixture(scope="module")
def smooth():
    return valve_json(curve="smooth")


def contradicted(document):
    valve = read(document)
    with pytest.raises(RuleError) as caught:
        check_recorded(valve.positive, valve.u_max_V)
    return str(caught.value)


@pytest.mark.parametrize("premise", ["line", "smooth", "monotone"])
def test_what_identify_writes_agrees(premise):
    valve = read(valve_json(curve=premise))
    check_recorded(valve.positive, valve.u_max_V)


class TestRecordedCurve:
    @pytest.mark.parametrize("branch", ["rising", "falling"])
    @pytest.mark.parametrize("shift", [-0.3, 0.3])
    def test_a_curve_that_begins_elsewhere_is_refused(self, smooth, branch, shift):
        document = deepcopy(smooth)
        recorded = side_of(document)["tests"][2]["recorded"][branch]
        recorded["u_V"] = [u + shift for u in recorded["u_V"]]
        recorded["u_seen_V"] += shift
        text = contradicted(document)
        assert "begins at" in text or "straight to zero" in text

    def test_a_curve_that_is_shifted_where_flow_is_seen_alone_is_refused(self, smooth):
        document = deepcopy(smooth)
        recorded = side_of(document)["tests"][2]["recorded"]["falling"]
        first, onset, *seen = recorded["u_V"]
        recorded["u_V"] = [first, onset, *[u + 0.3 for u in seen]]
        recorded["u_seen_V"] += 0.3
        assert "straight" in contradicted(document)

    def test_a_first_flow_that_is_none_of_the_curve_is_refused(self, smooth):
        document = deepcopy(smooth)
        side_of(document)["tests"][2]["recorded"]["falling"]["u_seen_V"] += 0.4
        assert "u_seen_V" in contradicted(document)

    def test_a_curve_that_is_less_steep_about_its_knee_is_refused(self, smooth):
        document = deepcopy(smooth)
        test = side_of(document)["tests"][2]
        for branch in ("rising", "falling"):
            recorded = test["recorded"][branch]
            flow = np.array(recorded["q_L_min"])
            recorded["q_L_min"] = np.minimum(flow, test["noise_level_L_min"] + 0.8 * flow).tolist()
        assert "slope" in contradicted(document)

    def test_a_curve_that_never_comes_to_its_straight_part_is_refused(self, smooth):
        document = deepcopy(smooth)
        recorded = side_of(document)["tests"][2]["recorded"]["falling"]
        recorded["q_L_min"] = [min(flow, 0.1) for flow in recorded["q_L_min"]]
        recorded["error_L_min"] = 1.0
        assert "straight part" in contradicted(document)
