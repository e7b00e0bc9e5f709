"""Every bound is computed again from the numbers beside it: an edit of one is found without a recording."""

import json
import math
from copy import deepcopy
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtrit

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import as_document, to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.firmware import recomputed_bounds
from dzdesign.verify.firmware.recomputed_bounds import bounds_follow, student
from tests.support.synthetic import Truth, synthetic_ramp

PRESSURES = (0.5, 1.0, 2.0, 3.0, 5.0)
PREMISES = ("line", "smooth", "monotone")
#: Numbers of a guard's curve that its bounds are made of, and of what they rest on.
OF_CURVE = ("u_threshold_V", "u_lower_V")
OF_ERRORS = ("noise_se_V", "ramp_sd_V", "ramp_noise_V", "degrees_of_freedom", "drift_V", "uneven_V", "budget_V")
OF_BASIS = ("confidence", "level_L_min")


def ramp_of(dp_MPa):
    return synthetic_ramp(dp_MPa, Truth(knee_rising=5.5 - 0.06 * dp_MPa, slope=4 * dp_MPa**0.5), ramp_s=40.0)


def check_of(valve):
    return bounds_follow(SimpleNamespace(valve=valve))


def as_read(document):
    return read_artefact(json.dumps(document).encode(), ValveModel, "valve.json")


@pytest.fixture(scope="module")
def valves(example_tests):
    """The example under each premise."""
    found = {curve: identify(example_tests, IdentifyOptions(curve=curve)) for curve in PREMISES}
    return {name: json.loads(to_json_bytes(valve)) for name, valve in found.items()}


@pytest.mark.parametrize("premise", PREMISES)
def test_bounds_that_were_not_edited_follow(valves, premise):
    check = check_of(as_read(valves[premise]))
    assert check.holds, check.text


@pytest.mark.parametrize(
    "options",
    [
        {"repeatability": 1e-3, "curve": "line"},
        {"repeatability": 1e-3},
        {"confidence": 0.9},
        {"zero_flow": 2e-5},
        {"meter_lag": 0.1, "curvature": 2e-14},
        {"meter_zero": 1e-6, "curve": "monotone"},
    ],
    ids=str,
)
def test_bounds_follow_with_every_kind_of_error_and_budget(options):
    valve = identify([ramp_of(dp) for dp in PRESSURES], IdentifyOptions(**options))
    check = check_of(valve)
    assert check.holds, check.text


def test_the_bound_of_a_single_test_follows():
    assert check_of(identify([ramp_of(1.0)])).holds


def numbers_in(value, path=()):
    """Yield the places of all numbers."""
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from numbers_in(item, (*path, key))
    elif isinstance(value, float | int) and not isinstance(value, bool):
        yield path


def edited(document, path, change):
    document = deepcopy(document)
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = change(place[path[-1]])
    return document


def by_a_quarter(number):
    return number + max(abs(number) / 4, 1e-3)


def is_caught(document):
    """Tell whether a valve.json is refused by its reader, or by the bounds."""
    try:
        return check_of(as_read(document)).holds is False
    except InputError:
        return True


@pytest.mark.parametrize("premise", PREMISES)
def test_an_edit_of_a_single_number_is_caught(valves, premise):
    """Of all thresholds, bounds, errors, budgets and covariances; but one that changes no bound by a microvolt."""
    side = ("sides", "positive")
    curve, basis = (*side, "certified", "closing"), (*side, "certificate")
    whole = valves[premise]["sides"]["positive"]
    places = [
        (*curve, *path)
        for path in numbers_in(whole["certified"]["closing"])
        if path[0] in OF_CURVE or (path[0] == "errors" and path[1] in (*OF_ERRORS, "covariance")) or path[0] == "above"
    ]
    places += [(*basis, name) for name in OF_BASIS]
    places += [(*basis, "repeatability", name) for name in ("sd_V", "degrees_of_freedom", "drift_V", "drift_se_V")]
    slipped = [path for path in places if not is_caught(edited(valves[premise], path, by_a_quarter))]
    assert len(places) > 60
    assert [path[3:] for path in slipped] == []


def test_a_bound_raised_a_tenth_of_a_millivolt_is_named_with_its_place_and_what_follows(valves):
    document = valves["monotone"]
    path = ("sides", "positive", "certified", "opening", "u_lower_V", 2)
    check = check_of(as_read(edited(document, path, lambda bound: bound + 1e-4)))
    assert check.holds is False and check.id == "bounds"
    assert "sides.positive.certified.opening.u_lower_V[2]" in check.text and "0.100" not in check.text


def test_a_confidence_that_is_only_stated_is_caught(valves):
    path = ("sides", "positive", "certificate", "confidence")
    for premise in PREMISES:
        assert is_caught(edited(valves[premise], path, lambda _: 0.999))


ORIGIN = {
    "a tenth of the pressure": (("recorded_units", "pressure", "factor"), 0.1, "recorded_units.pressure.factor is 0.1"),
    "bar that are MPa": (("recorded_units", "pressure", "unit"), "bar", "factor is 1, but 10"),
    "no unit of pressure": (("recorded_units", "pressure", "unit"), "\u041cPa", "no unit of pressure"),
    "another flow": (("recorded_units", "flow", "factor"), 60.0, "recorded_units.flow.factor is 60"),
    "another command": (("recorded_units", "command", "factor"), 2.0, "recorded_units.command.factor is 2"),
    "a zero elsewhere": (("recorded_units", "command", "at_zero"), 4.0, "recorded_units.command.at_zero is 4"),
    "no recordings": (("made_from",), [], "which is no file of made_from"),
    "another confidence asked for": (("options", "texts", "confidence"), "0.9999", "confidence is 0.9999, but 0.99"),
}  # fmt: skip


@pytest.mark.parametrize("edit", ORIGIN)
def test_what_is_said_of_the_recordings_fits_the_valve(valves, edit):
    """Units with another factor show every number as another one: '0.05 to 0.5 MPa' of what was tested to 5 MPa."""
    path, value, named = ORIGIN[edit]
    document = deepcopy(valves["monotone"])
    document["options"] = {"texts": {"confidence": "0.990"}, "tables": {}, "lists": {}}
    assert check_of(as_read(document)).holds
    check = check_of(as_read(edited(document, path, lambda _: value)))
    assert check.holds is False and named in check.text


def test_a_bound_that_is_no_number_does_not_hold(valves, monkeypatch):
    valve = as_read(valves["monotone"])

    def of(curve, *_):
        band = np.array(curve.above.band_V if curve.above else ())
        return SimpleNamespace(lower=np.full(len(curve.u_lower_V), np.nan), band=band, most=1.0, most_above=1.0)

    monkeypatch.setattr(recomputed_bounds.RecomputedBounds, "of", of)
    assert check_of(valve).holds is False


def test_a_budget_traded_for_a_bound_is_taken_as_stated(valves):
    """Without the recordings two numbers that fit each other can't be told from measured ones: that is what --ramps is
    for."""
    document = valves["monotone"]
    place = ("sides", "positive", "certified", "opening")
    document = edited(document, (*place, "u_lower_V", 2), lambda bound: bound + 1e-3)
    document = edited(document, (*place, "errors", "budget_V", 2), lambda budget: budget - 1e-3)
    assert not is_caught(document)


@pytest.mark.parametrize("degrees", [1.0, 2.0, 5.5, 14.0, 300.0, 9e5, 1e7, math.inf])
@pytest.mark.parametrize("tail", [0.3, 0.01, 1e-3, 1e-4])
def test_students_quantile_is_that_of_another_routine(degrees, tail):
    expected = stdtrit(min(degrees, 1e9), 1 - tail)
    assert student(degrees, tail) == pytest.approx(expected, rel=2e-6)


def test_the_reader_refuses_errors_that_are_not_one_a_test(example_valve):
    document = json.loads(json.dumps(as_document(example_valve)))
    path = ("sides", "positive", "certified", "closing", "errors", "budget_V")
    with pytest.raises(InputError, match="budgets"):
        as_read(edited(document, path, lambda budget: budget[1:]))
