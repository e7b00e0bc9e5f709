"""What is drawn at zero command says what the check of every input counts, whatever holds between the tests."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.exhaustive import input_map
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.input_map import map_inputs
from dzdesign.verify.exhaustive.test_vectors import differences
from dzdesign.verify.exhaustive.zero_command import guarded_bounds, zero_command_margins
from tests.conftest import default_options
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


def counted(compensator, bounds):
    exact = ExactLaw(compensator)
    found = differences(exact)
    at_zero = np.array([exact.compare_value(exact.zero, exact.corners(exact.betas(int(dp)))) for dp in found.values])
    return zero_command_margins(exact, found, at_zero, [bounds])[0]


@pytest.mark.parametrize("premise", ["monotone", "line", "smooth"])
@pytest.mark.parametrize("lowered_V", [0.0, 0.01], ids=["as certified", "a bound that is exceeded"])
def test_the_drawn_bound_is_that_of_the_check(example_tests, tmp_path, monkeypatch, premise, lowered_V):
    valve = identify(example_tests, IdentifyOptions(curve=premise))
    compensator = design(valve, default_options())
    firmware = generate(compensator, "f28335")
    write_folder(tmp_path / "firmware", firmware.files, firmware.manifest)
    bounds = guarded_bounds(compensator, 1)
    assert bounds.premise == premise
    lowered = replace(bounds, u_lower_V=tuple(bound - lowered_V for bound in bounds.u_lower_V))
    monkeypatch.setattr(input_map, "guarded_bounds", lambda *_: lowered)

    drawn = np.array(map_inputs(tmp_path / "firmware", compensator).zero_command)
    margin = drawn[:, 3] - drawn[:, 2]
    expected = counted(compensator, lowered)
    assert margin.min() == pytest.approx(float(expected.margin_V), abs=1e-9)
    assert int((margin < 0).sum()) == expected.exceeded
    assert bool(expected.exceeded) == bool(lowered_V)
