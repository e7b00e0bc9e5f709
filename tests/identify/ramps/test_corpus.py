"""Recordings as benches make them, with the truth beside them: some of the benchmark's corpus, and what it can miss."""

from dataclasses import replace

import corpus
import numpy as np
import pytest
from corpus import cases, fault_of, write

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps import command, splitting
from dzdesign.identify.reading.ramp_files import read_ramp_file

SEED = 909
CASES = {case.name: case for case in cases()}
#: One of each kind, the hardest of it.
CHOSEN = (
    "noise_20mV", "pump_1.5s", "pump_long_hold", "first_dp_negative", "drift_up", "repeats_mixed", "dip_first_hold",
    "bipolar_two_files", "bipolar_unsigned_flow", "top_sagging", "rest_pump_off_between", "exercise_before_the_pump",
    "pump_on_at_4V", "pump_off_at_8V", "pump_on_in_ramp_1_of_2", "top_hold_pump", "teeth_levels", "rate_10Hz",
)  # fmt: skip


@pytest.mark.parametrize("name", CHOSEN)
def test_it_is_read_as_it_was_run(name, tmp_path):
    assert fault_of(CASES[name], SEED, tmp_path) == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CASES.keys() - set(CHOSEN)))
def test_so_is_every_other(name, tmp_path):
    assert fault_of(CASES[name], SEED, tmp_path) == ""


def test_the_corpus_is_what_was_asked_for():
    assert len(CASES) == len(cases()) >= 40 and len({case.kind for case in CASES.values()}) >= 12


def found_of(name, tmp_path, **changes):
    case = replace(CASES[name], **changes)
    return identify([read_ramp_file(path) for path in write(case, SEED, tmp_path)], IdentifyOptions(**case.options))


class TestWhatIsLeftOut:
    """The record says it, with its times: they are those of the bench."""

    @pytest.mark.parametrize(
        ("name", "reason", "start", "end"),
        [
            ("pump_1.5s", "pressure", 0.0, 1.5 + 1.2),
            ("rest_pump_off_between", "pressure", 49.0, 69.0 + 1.6),
            ("dip_first_hold", "pressure", 1.5, 2.0),
            ("pump_off_at_2V", "pressure", 76.0 + 0.35, 87.0),
            ("jog_before", "partial", 0.0, 7.5),
            ("exercise_before_the_pump", "no-pressure", 0.0, 15.0),
        ],
    )
    def test_a_rest_and_a_moving_pressure(self, name, reason, start, end, tmp_path):
        (test,) = found_of(name, tmp_path).positive.tests
        part = test.left_out[0]
        assert (part.recording, part.reason) == (f"{name}_1.csv", reason)
        assert (part.from_s, part.to_s) == (pytest.approx(start, abs=0.3), pytest.approx(end, abs=0.3))

    @pytest.mark.parametrize("name", ["noise_20mV", "drift_up", "repeats_same", "bipolar_noisy", "top_hold_long"])
    def test_of_a_steady_supply_nothing(self, name, tmp_path):
        sides = found_of(name, tmp_path).sides.values()
        assert not any(test.left_out for side in sides for test in side.tests)

    def test_it_goes_with_the_ramp_that_follows(self, tmp_path):
        tests = found_of("rest_levels_between", tmp_path).positive.tests
        assert [[part.to_s for part in test.left_out] for test in tests] == [
            [],
            [pytest.approx(59, abs=1.5)],
            [pytest.approx(136, abs=1.5)],
        ]
        assert tests[1].left_out[0].dp_MPa == (pytest.approx(1.02, abs=0.02), pytest.approx(1.96, abs=0.02))

    def test_the_hold_of_a_ramp_is_kept(self, tmp_path):
        (path,) = write(CASES["noise_1mV"], SEED, tmp_path)
        test = read_ramp_file(path)
        (ramp,) = splitting.split_ramps(test, 0.0)
        assert ramp.test.time.size == test.time.size and ramp.left_out == ()


def test_a_ramp_is_named_with_its_times(tmp_path):
    tests = found_of("repeats_series", tmp_path).positive.tests
    assert [test.ramps for test in tests][1] == ("repeats_series_1.csv (ramp 2, 47.3 to 93.0 s)",)


def test_a_ramp_whose_valve_stays_shut_under_pressure_is_refused_by_name(tmp_path):
    """It is no exercise: the supply was on, the command full, and the meter saw nothing."""

    def unplugged(rows):
        rows = rows.copy()
        rows[3, rows[0] > 47.0] = np.random.default_rng(1).normal(0, 0.1, np.count_nonzero(rows[0] > 47.0))
        return rows

    supply = corpus.levels((0, 1.0), (46.0, 2.0))
    bench = replace(CASES["repeats_same"].benches[0], command=2 * corpus.ramp(20.0), supply=supply)
    fault = fault_of(replace(CASES["repeats_same"], benches=(bench,), edit=unplugged), SEED, tmp_path)
    assert fault.startswith("refused") and "(ramp 2, 4" in fault and "to 94.0 s)" in fault


@pytest.mark.parametrize("name", ["teeth_noisy", "pump_on_at_7V", "pump_off_at_8V", "bipolar_noisy"])
def test_a_declared_lag_needs_no_second_branch(name, tmp_path):
    assert found_of(name, tmp_path, options={"meter_lag": 0.01}).meter.lag_is == "declared"


class TestSeededFaults:
    """Without what puts it right each kind of case is refused or misread again, so the corpus sees it."""

    def faults(self, names, tmp_path):
        return [bool(fault_of(CASES[name], SEED, tmp_path)) for name in names]

    def test_holds_taken_for_sweeps(self, monkeypatch, tmp_path):
        monkeypatch.setattr(command, "_holds", lambda u, turn: False)
        (test,) = found_of("noise_20mV", tmp_path).positive.tests
        assert [part.reason for part in test.left_out] == ["partial"]
        monkeypatch.setattr(splitting, "why_no_ramp", lambda levels, reach: [None] * len(levels))
        assert all(self.faults(["drift_up"], tmp_path))

    def test_pressures_not_looked_at(self, monkeypatch, tmp_path):
        monkeypatch.setattr(splitting, "off_level", lambda test, *_: np.zeros(test.u.size, dtype=bool))
        assert all(self.faults(["pump_long_hold", "rest_pump_off_after", "pump_on_at_7V"], tmp_path))

    def test_exercises_taken_for_ramps(self, monkeypatch, tmp_path):
        monkeypatch.setattr(splitting, "why_no_ramp", lambda levels, reach: [None] * len(levels))
        assert all(self.faults(["exercise_before_the_pump"], tmp_path))

    def test_a_truth_that_is_another(self, tmp_path):
        case = CASES["noise_1mV"]
        other = replace(case.benches[0], valve=replace(case.benches[0].valve, knee_V=4.62))
        assert fault_of(case, SEED, tmp_path) == "" and fault_of(replace(case, benches=(other,)), SEED, tmp_path) == ""
        wrong = replace(case, edit=lambda rows: rows * np.array([1.0, 1.005, 1.0, 1.0])[:, None])
        assert fault_of(wrong, SEED, tmp_path).startswith("misread")
