"""Ports, units and staircases as loggers write them: `corpus_units.py` of the benchmarks, and that its faults show."""

from dataclasses import replace

import corpus_units
import numpy as np
import pytest

from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.identify import identification
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.knees import meter
from dzdesign.identify.ramps import splitting
from dzdesign.identify.ramps.staircases import find_staircase
from dzdesign.identify.reading import columns, ramp_files, scaling
from dzdesign.identify.reading.metering_edge import MeteringEdge, metering_edge

CASES = {case.name: case for case in corpus_units.cases()}


@pytest.mark.parametrize("name", CASES)
def test_a_recording_is_read_as_it_is(name, tmp_path):
    assert not corpus_units.fault_of(CASES[name], tmp_path)


@pytest.mark.parametrize("name", ["ports_1", "both_0", "all_asked"])
def test_working_ports_in_silence_are_seen(name, tmp_path, monkeypatch):
    """The fault that this was written for: pA - pB wherever both stand, whatever stands beside them."""

    def in_silence(quantities) -> MeteringEdge:
        return metering_edge({"pA", "pB"} if {"pA", "pB"} <= set(quantities) else quantities)

    for module in (columns, ramp_files):
        monkeypatch.setattr(module, "metering_edge", in_silence)
    assert corpus_units.fault_of(CASES[name], tmp_path)


@pytest.mark.parametrize("name", ["stairs_2", "stairs_8", "stairs_10", "stairs_12"])
def test_a_staircase_taken_for_a_ramp_is_seen(name, tmp_path, monkeypatch):
    monkeypatch.setattr(splitting, "find_staircase", lambda *_: None)
    assert corpus_units.fault_of(CASES[name], tmp_path)


def test_a_floor_that_levels_hide_is_seen(tmp_path, monkeypatch):
    monkeypatch.setattr(meter, "floor_of_levels", lambda *_: 0.0)
    assert "a floor of 0 L/min" in corpus_units.fault_of(CASES["stairs_7"], tmp_path)


def forget_the_units(monkeypatch):
    monkeypatch.setattr(identification, "units_of", lambda tests: AS_COMPUTED)


def take_a_gallon_for_the_imperial_one(monkeypatch):
    monkeypatch.setattr(scaling, "L_MIN", L_MIN * 3.785411784 / 4.54609)


def forget_what_is_zero(monkeypatch):
    found = scaling._command_unit
    monkeypatch.setattr(scaling, "_command_unit", lambda *args: replace(found(*args), at_zero=0.0))


def forget_that_a_reading_falls_on_the_negative_side(monkeypatch):
    monkeypatch.setattr(RecordedUnits, "of_side", lambda self, side: self)


def read_a_signal_as_its_column(monkeypatch):
    read = scaling.read_signal_range
    monkeypatch.setattr(scaling, "read_signal_range", lambda *of, **more: None if of[1] == "u" else read(*of, **more))


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        (forget_the_units, "ports_2"),
        (forget_the_units, "unit_5"),
        (take_a_gallon_for_the_imperial_one, "unit_1"),
        (forget_what_is_zero, "unit_3"),
        (forget_that_a_reading_falls_on_the_negative_side, "bipolar_0"),
        (read_a_signal_as_its_column, "unit_8"),
    ],
)
def test_numbers_in_a_wrong_unit_are_seen(fault, name, tmp_path, monkeypatch):
    fault(monkeypatch)
    assert "misread" in corpus_units.fault_of(CASES[name], tmp_path)


def test_a_ramp_in_coarse_steps_is_no_staircase():
    """Its flow goes on through each step: taken for levels, the last quarter of each would lie off its command."""
    rows = corpus_units.bench(corpus_units.ramp(100.0), seed=114, command_noise=0.0)
    u = np.round(rows["u"] / 0.05) * 0.05
    assert find_staircase(u, rows["Q"]) is None
    steps = corpus_units.bench(corpus_units.staircase(0.25, 3.0), seed=1, rise_s=0.2)
    found = find_staircase(steps["u"], steps["Q"])
    assert found is not None and 0.5 < found.settled.mean() < 0.95
    np.testing.assert_allclose(found.u[found.settled] / 0.25, np.round(found.u[found.settled] / 0.25), atol=0.02)


@pytest.mark.parametrize(
    ("recorded", "positive", "negative"),
    [
        ("dP pP pA pB pT", ("dP",), ("dP",)),
        ("pA pB", ("pA", "pB"), ("pA", "pB")),
        ("pP pA", ("pP", "pA"), None),
        ("pP pB", None, ("pP", "pB")),
        ("pP pA pB", ("pP", "pA"), ("pP", "pB")),
        ("pA pB pT", ("pB", "pT"), ("pA", "pT")),
        ("pP pA pT", ("pP", "pA"), ("pA", "pT")),
        ("pP pT", None, None),
        ("pT", None, None),
    ],
)
def test_the_edge_follows_from_the_ports(recorded, positive, negative):
    edge = metering_edge(recorded.split())
    assert (edge.positive, edge.negative, edge.ambiguous) == (positive, negative, False)


def test_four_ports_are_ambiguous():
    assert metering_edge(["pP", "pA", "pB", "pT"]).ambiguous


def test_noise_about_zero_does_not_turn_the_valve_round():
    """At rest before a side is swept its own edge counts, whatever the noise says of the command's sign."""
    u = np.array([0.01, -0.02, 0.01, 5.0, 0.02, -0.01, -5.0, 0.01, -0.01])
    data = {"pP": np.full(u.size, 3.0), "pA": np.full(u.size, 1.0), "pB": np.full(u.size, 2.0)}
    drop = metering_edge(data).drop(data, u, 10.0)
    np.testing.assert_array_equal(drop, [2, 2, 2, 2, 1, 1, 1, 1, 1])
