"""Dead zones read at a stated flow: in the words of `design`, in the closed loop, beside an ideal line."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import InputError
from dzdesign.design.costs_at_tests import read_dead_zone, remaining_dead_zone
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.identify.valve.reading_flow import dead_zone_at, default_reading_flow, ideal_line
from dzdesign.verify.closed_loop.loop import RampSequence
from tests.conftest import default_options
from tests.support.evidence import verify
from tests.support.synthetic import needs_compiler


def test_an_ideal_line_is_read_where_the_paper_says():
    """0.6 L/min of 15.2 and of 26 L/min."""
    assert 100 * ideal_line(0.6, 15.2) == pytest.approx(3.95, abs=0.005)
    assert 100 * ideal_line(0.6, 26.0) == pytest.approx(2.3, abs=0.01)
    assert ideal_line(0.6, 0.5) == 1.0 and ideal_line(0.6, 0.0) == 1.0


def test_a_ramp_is_read_going_up_where_a_flow_comes_and_going_down_where_it_ends():
    command = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, 0, 101)])
    flows = np.concatenate([np.maximum(np.linspace(0, 1, 101) - 0.5, 0), np.maximum(np.linspace(1, 0, 101) - 0.3, 0)])
    assert dead_zone_at(0.1, command, flows, rising=True) == pytest.approx(0.61, abs=0.011)
    assert dead_zone_at(0.1, command, flows, rising=False) == pytest.approx(0.41, abs=0.011)
    assert dead_zone_at(0.9, command, flows, rising=True) == 1.0
    with pytest.raises(InputError):
        dead_zone_at(0.1, command, flows[1:], rising=True)


def test_the_default_is_the_meters_floor_and_without_one_what_the_recordings_resolve(example_valve):
    assert default_reading_flow(example_valve) == example_valve.meter.floor_L_min > 0.5
    without = replace(example_valve, meter=replace(example_valve.meter, floor_L_min=0.0))
    levels = [test.noise_level_L_min for test in example_valve.positive.tests]
    assert default_reading_flow(without) == max(levels)


def test_design_takes_it_and_keeps_it(example_valve):
    compensator = design(example_valve, replace(default_options(), reading_flow_L_min=1.5))
    assert compensator.reading_flow_L_min == 1.5
    assert all("read at 1.50 L/min" in line for line in compensator.costs if "offset" in line and " MPa: " in line)


@pytest.mark.parametrize(("share", "told"), [(0.5, True), (1.0, False), (2.0, False)])
def test_a_reading_where_nothing_was_recorded_is_said_to_be_none(example_valve, share, told):
    flow = share * default_reading_flow(example_valve)
    compensator = design(example_valve, replace(default_options(), reading_flow_L_min=flow))
    assert any("not all of the recordings show a flow" in line for line in compensator.costs) == told


@pytest.mark.parametrize("flow", [0.0, -1.0])
def test_no_flow_is_none_to_read_at(flow, wording):
    with wording.refusal(InputError):
        DesignOptions(reading_flow_L_min=flow)


def test_a_reading_lies_beyond_the_onset_and_grows_with_the_flow(example_compensator):
    for test in example_compensator.valve.positive.tests:
        found = []
        for flow in (0.7, 1.5, 6.0):
            read = read_dead_zone(replace(example_compensator, reading_flow_L_min=flow), test)
            assert read["closing"] < read["opening"]
            found.append(read["opening"])
        assert remaining_dead_zone(example_compensator, test)["opening"] <= found[0] < found[1] < found[2]
    beyond = replace(example_compensator, reading_flow_L_min=100.0)
    assert read_dead_zone(beyond, example_compensator.valve.positive.tests[0]) == {}


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("transition", ["off", "1 %"])
def test_design_says_what_the_closed_loop_reads(example_valve, tmp_path, transition):
    """Two ways: the law turned round at the recorded threshold, and the generated C driving the recorded flow."""
    from dzdesign.codegen.project import generate, target_named
    from dzdesign.design.options import options_of

    options = options_of({"transition": transition, "reading_flow": "0.8 L/min"}, target_named("f28335").inputs())
    compensator = design(example_valve, options)
    firmware = generate(compensator, "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    found = verify(tmp_path / "fw", sequence=RampSequence(rest=0.5, ramp=40.0, top=0.5))
    for test, loop in zip(example_valve.positive.tests, found.loops, strict=True):
        result, said = loop.result, read_dead_zone(compensator, test)
        assert result.reading_flow_L_min == 0.8
        assert result.reading_opening == pytest.approx(said["opening"], abs=2e-3)
        assert result.reading_closing == pytest.approx(said["closing"], abs=2e-3)
        assert result.ideal_line == pytest.approx(0.8 / result.q_max_L_min)
        assert result.residual_opening < result.reading_opening < result.reading_opening_without
