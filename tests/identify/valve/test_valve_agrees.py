"""What in valve.json follows from the rest of it is recomputed: an estimated M, a straight line, the premise."""

import json
from copy import deepcopy

import pytest

from dzdesign.core.artefact_reading import read_artefact, rounded
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import DECIMALS, ValveModel
from tests.support.attacked_firmware import sealed
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp

TESTED = (0.5, 1.0, 2.0, 3.5, 5.0)


def valve_json(**options):
    """Return valve.json of a straight valve with hysteresis, as a document."""
    ramps = [synthetic_ramp(dp, Truth(), seed=seed) for seed, dp in enumerate(TESTED)]
    valve = identify(ramps, IdentifyOptions(meter_lag=0.0, **options))
    return json.loads(to_json_bytes(rounded(valve, DECIMALS)))


@pytest.fixture(scope="module")
def smooth():
    return valve_json(curve="smooth")


def read(document):
    return read_artefact(json.dumps(sealed(document)).encode(), ValveModel, "valve.json")


def side_of(document):
    return document["sides"]["positive"]


def refused(document):
    with pytest.raises(InputError) as caught:
        read(document)
    return str(caught.value)


@pytest.mark.parametrize("premise", ["line", "smooth", "monotone"])
def test_what_identify_writes_is_read(premise):
    document = valve_json(curve=premise)
    assert side_of(document)["certified"]["closing"]["premise"] == premise
    read(document)


def test_ramps_that_tell_a_drift_too_may_have_less_than_one_degree_of_freedom(smooth):
    """With a drift in the model each ramp gives less than one; the largest scatter may be of two ramps alone."""
    document = deepcopy(smooth)
    side_of(document)["certificate"]["repeatability"] |= {"origin": "repeats", "degrees_of_freedom": 0.9}
    assert read(document).positive.certificate.repeatability.degrees_of_freedom == 0.9

class TestPremise:
    def test_an_estimated_curvature_is_recomputed(self, smooth):
        document = deepcopy(smooth)
        curve = side_of(document)["certified"]["closing"]
        assert max(curve["curvature_V_MPa2"]) > 0
        above = curve["above"]
        start = above["slope_from_MPa"]
        bends = [above["curvature_V_MPa2"] / 2 * (dp - above["dp_MPa"][0]) * (dp - start) for dp in above["dp_MPa"]]
        curve["curvature_V_MPa2"] = [0.0] * 4
        assert "estimated" in refused(document)
        curve["curvature_is"] = "declared"
        assert "above the tests" in refused(document)
        above["curvature_V_MPa2"] = 0.0
        above["u_lower_V"] = [lower + bend for lower, bend in zip(above["u_lower_V"], bends, strict=True)]
        read(document)  # what was declared stands in no recording

    def test_a_declared_curvature_is_one(self, smooth):
        document = deepcopy(smooth)
        curve = side_of(document)["certified"]["closing"]
        curve |= {"curvature_V_MPa2": [1.0, 1.0, 0.0, 1.0], "curvature_is": "declared"}
        assert "one and the same" in refused(document)

    def test_a_line_is_straight(self, smooth):
        document = deepcopy(smooth)
        curve = side_of(document)["certified"]["closing"]
        curve |= {"premise": "line", "curvature_V_MPa2": [0.0] * 4, "curvature_is": None}
        for check in curve["premises"]:
            check["lack_of_fit_p"] = 0.5
        assert "straight line" in refused(document)

    @pytest.mark.parametrize("p_value", [0.009, 0.02])
    def test_a_premise_that_the_tests_refuse_is_not_taken(self, smooth, p_value):
        document = deepcopy(smooth)
        for check in side_of(document)["certified"]["closing"]["premises"]:
            check["lack_of_fit_p"] = p_value
        if p_value < 0.01:
            assert "refuse" in refused(document)
        else:
            read(document)

    def test_a_premise_that_was_never_tried_is_refused(self, smooth):
        document = deepcopy(smooth)
        side_of(document)["certified"]["closing"]["premises"] = []
        assert "allow" in refused(document)


class TestAboveTheTests:
    """The bound above the last test follows from the thresholds, the band and M."""

    def edited(self, document, **changes):
        found = deepcopy(document)
        side_of(found)["certified"]["closing"]["above"] |= changes
        return found

    @pytest.fixture
    def above(self, smooth):
        return side_of(smooth)["certified"]["closing"]["above"]

    @pytest.mark.parametrize("place", [1, 3])
    def test_a_bound_that_is_raised_is_refused(self, smooth, above, place):
        raised = list(above["u_lower_V"])
        raised[place] += 1e-3
        assert "follows from the thresholds" in refused(self.edited(smooth, u_lower_V=raised))

    def test_so_is_one_that_begins_above_the_last_test(self, smooth, above):
        raised = [above["u_lower_V"][0] + 1e-3, *above["u_lower_V"][1:]]
        assert "begin at the last test" in refused(self.edited(smooth, u_lower_V=raised))

    def test_a_smaller_estimated_curvature_is_refused(self, smooth, above):
        assert "estimated" in refused(self.edited(smooth, curvature_V_MPa2=above["curvature_V_MPa2"] / 2))

    def test_a_band_that_shrinks_is_refused(self, smooth, above):
        band, lower = list(above["band_V"]), list(above["u_lower_V"])
        taken = band[4] / 2
        band[4], lower[4] = band[4] - taken, lower[4] + taken
        assert "faster and faster" in refused(self.edited(smooth, band_V=band, u_lower_V=lower))

    def test_a_slope_from_no_test_is_refused(self, smooth):
        assert "expected a test" in refused(self.edited(smooth, slope_from_MPa=1.7))

    def test_what_the_tests_refuse_is_not_certified(self, smooth):
        assert "refuse" in refused(self.edited(smooth, lack_of_fit_p=0.001))

    def test_a_bound_that_is_missing_is_refused(self, smooth):
        found = deepcopy(smooth)
        side_of(found)["certified"]["closing"]["above"] = None
        assert "above the tests" in refused(found)

    def test_a_falling_threshold_that_only_runs_one_way_is_never_certified(self):
        document = valve_json(curve="monotone")
        above = side_of(document)["certified"]["closing"]["above"]
        assert not above["certified"]
        above["certified"] = True
        assert "only known to run one way" in refused(document)
