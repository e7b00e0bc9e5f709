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


class TestProof:
    """A bound is what its ramps and multipliers prove, and no more."""

    def edited(self, document, **changes):
        found = deepcopy(document)
        side_of(found)["certified"]["closing"]["proof"] |= changes
        return found

    @pytest.fixture
    def proof(self, smooth):
        return side_of(smooth)["certified"]["closing"]["proof"]

    @pytest.mark.parametrize("place", [0, 7, -1])
    def test_a_bound_that_is_raised_is_refused(self, smooth, place):
        document = deepcopy(smooth)
        side_of(document)["certified"]["closing"]["bound_V"][place] += 1e-5
        assert "prove" in refused(document)

    @pytest.mark.parametrize("change", [-2e-5, 0.0])
    def test_a_ramp_that_is_moved_moves_it(self, smooth, proof, change):
        ramps = deepcopy(proof["ramps"])
        for ramp in ramps:
            ramp["u_V"] += change
        document = self.edited(smooth, ramps=ramps)
        if change:
            assert "prove" in refused(document)
        else:
            read(document)

    def test_a_smaller_critical_value_proves_more_than_it_may(self, smooth, proof):
        """That is the one number a reader can't recompute without drawing: the seed is in the code."""
        read(self.edited(smooth, floor=proof["floor"] - 0.1))
        assert "prove" in refused(self.edited(smooth, floor=proof["floor"] + 0.1))

    def test_a_row_that_is_missing_proves_nothing(self, smooth, proof):
        states = deepcopy(proof["states"])
        states[0]["multipliers"][3] = ""
        assert "proof" in refused(self.edited(smooth, states=states))

    @pytest.mark.parametrize("edit", [lambda text: text.replace(":0.", ":0.0"), lambda _: "9999:1", lambda _: "0:-1"])
    def test_a_multiplier_that_is_edited_proves_nothing(self, smooth, proof, edit):
        """They are what is read: no solver finds them anew."""
        states = deepcopy(proof["states"])
        states[0]["multipliers"] = [edit(each) for each in states[0]["multipliers"]]
        said = refused(self.edited(smooth, states=states))
        assert "proof" in said or "multipliers" in said

    @pytest.mark.parametrize("edit", [{"roof": None}, {"unlike_knot": 1000}])
    def test_a_proof_of_another_shape_is_refused(self, smooth, edit):
        """Seeded: an IndexError and a ZeroDivisionError."""
        assert "not those of its ramps" in refused(self.edited(smooth, **edit))

    def test_a_state_that_is_missing_is_refused(self, smooth, proof):
        states = [proof["states"][0] | {"multipliers": proof["states"][0]["multipliers"][1:]}]
        assert "states and nodes" in refused(self.edited(smooth, states=states))


class TestAboveTheTests:
    """The bound above the last test begins there and falls."""

    def edited(self, document, **changes):
        found = deepcopy(document)
        side_of(found)["certified"]["closing"]["above"] |= changes
        return found

    @pytest.fixture
    def above(self, smooth):
        return side_of(smooth)["certified"]["closing"]["above"]

    def test_a_bound_that_rises_is_refused(self, smooth, above):
        raised = list(above["u_lower_V"])
        raised[3] = raised[2] + 1e-3
        assert "not rise" in refused(self.edited(smooth, u_lower_V=raised))

    def test_of_a_falling_threshold_that_only_runs_one_way_nothing_is_certified(self):
        assert not side_of(valve_json(curve="monotone"))["certified"]["closing"]["above"]["certified"]
