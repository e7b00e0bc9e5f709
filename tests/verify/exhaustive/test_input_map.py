"""What is drawn at zero command says what the check of every input counts, whatever holds between the tests."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.exhaustive import all_inputs
from dzdesign.verify.exhaustive.all_inputs import map_inputs
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.exhaustive.zero_command import guarded_bounds, zero_command_margins
from tests.conftest import default_options


def answers_at_zero(prepared):
    exact, found = prepared.exact, prepared.differences
    return np.array([exact.compare_value(exact.zero, exact.corners(exact.betas(int(dp)))) for dp in found.values])


@pytest.mark.parametrize("premise", ["monotone", "line", "smooth"])
@pytest.mark.parametrize("lowered_V", [0.0, 0.01], ids=["as certified", "a bound that is exceeded"])
def test_the_drawn_bound_is_that_of_the_check(example_tests, monkeypatch, premise, lowered_V):
    valve = identify(example_tests, IdentifyOptions(curve=premise))
    compensator = design(valve, default_options())
    bounds = guarded_bounds(compensator, 1)
    assert valve.positive.curve.premise == premise
    lowered = replace(bounds, u_lower_V=tuple(bound - lowered_V for bound in bounds.u_lower_V))
    monkeypatch.setattr(all_inputs, "guarded_bounds", lambda *_: lowered)

    prepared = PreparedInputs(ExactLaw(compensator, 1))
    at_zero = answers_at_zero(prepared)
    drawn = map_inputs(prepared, at_zero)["zero_command_positive.csv"]
    margin = drawn["bound_V"] - drawn["drive_V"]
    (expected,) = zero_command_margins(prepared.exact, prepared.differences, at_zero, [lowered])
    assert margin.min() == pytest.approx(float(expected.margin_V), abs=1.1e-5)  # as rounded to be stored
    assert int((margin < 0).sum()) == expected.exceeded
    assert bool(expected.exceeded) == bool(lowered_V)
