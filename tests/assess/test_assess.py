"""`assess` against recordings whose every quantity is known, and against the closed loop's own dead zones."""

import json
import re
import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dzdesign.assess.assessing import assess
from dzdesign.assess.assessment import Assessment
from dzdesign.assess.flow_curves import MOST_POINTS, MOST_SAMPLES
from dzdesign.assess.options import AssessOptions
from dzdesign.assess.quantities import LIMITED, QUANTITIES, observed, parse_limits
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import RuleError, as_document, to_json_bytes
from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.reading.ramp_test import RampTest
from tests.support.bench_recordings import AFTER, BEFORE, L_MIN, Valve, record, write
from tests.support.paths import ROOT
from tests.support.synthetic import SHARED, needs_compiler

LEVEL = 1.0
#: Of full command, per volt.
PERCENT = 100 / 10
OPTIONS = AssessOptions(reading=IdentifyOptions(meter_lag=0.0), reading_flow=LEVEL * L_MIN)


def readings(before=BEFORE, after=AFTER, options=OPTIONS, **how):
    """Return the readings of both sets at 1 MPa."""
    found = assess([record(before, seed=1)], [record(after, seed=2, **how)], options).pressures[0]
    return {name: found.readings(name) for name in ("before", "after")}


def truth(valve: Valve) -> dict[str, float]:
    """Return the quantities of a straight valve at 1 MPa, by algebra, in their units."""
    return {
        "dead_zone_opening": (valve.opening + LEVEL / valve.gain) * PERCENT,
        "dead_zone_closing": (valve.closing + LEVEL / valve.gain) * PERCENT,
        "knee_opening": valve.opening * PERCENT,
        "knee_closing": valve.closing * PERCENT,
        "hysteresis": (valve.opening - valve.closing) * PERCENT,
        "gain": valve.gain,
        "flow_at_zero": 0.0,
        "largest_flow": valve.gain * (10 - valve.closing),
    }


#: Largest error: per cent of command, L/min per V, L/min.
TOLERANCES = {
    "dead_zone_opening": 0.1,
    "dead_zone_closing": 0.1,
    "knee_opening": 0.05,
    "knee_closing": 0.05,
    "hysteresis": 0.15,
    "gain": 0.01,
    "flow_at_zero": 0.03,
    "largest_flow": 0.9,  # of two branches that end at the same command the hysteresis parts the flow there
}
DIRTY = {
    "clean": {"noise": 0.0},
    "noisy": {"noise": 0.15},
    "12 bits": {"noise": 0.01, "bits": 12},
    "spikes": {"spikes": 0.01},
}


# known truth


@pytest.mark.parametrize("dirt", DIRTY)
def test_every_quantity_of_a_known_valve(dirt):
    valves = [replace(valve, **DIRTY[dirt]) for valve in (BEFORE, AFTER)]
    found = readings(*valves)
    for name, valve in zip(("before", "after"), valves, strict=True):
        for key, true in truth(valve).items():
            reading = found[name][key]
            allowed = max(TOLERANCES[key], 3.5 * (reading.se or 0.0))
            assert reading.value == pytest.approx(true, abs=allowed), (name, key)
            assert (reading.se or 0.0) < 2.5 * TOLERANCES[key], (name, key)


@pytest.mark.parametrize("memory", [0.0, 0.95])
def test_standard_errors_say_how_far_a_reading_scatters(memory):
    """Over 12 recordings with their own noise, white and slow; a chi-square of 12 is 0.2 to 2.6 times its mean."""
    noise = {"noise": 0.1, "memory": memory}
    before = record(replace(BEFORE, **noise), seed=99)
    found = [
        assess([before], [record(replace(AFTER, **noise), seed=seed)], OPTIONS).pressures[0].readings("after")
        for seed in range(12)
    ]
    for key in ("dead_zone_opening", "dead_zone_closing", "knee_opening", "gain", "flow_at_zero"):
        values = np.array([each[key].value for each in found])
        errors = np.array([each[key].se for each in found])
        ratio = np.sqrt(np.mean(((values - truth(AFTER)[key]) / errors) ** 2))
        assert 0.35 < ratio < 1.7, (key, ratio)


def test_linearity_of_a_parabola_is_two_thirds_of_its_height():
    """Of 4 A t (1 - t) the least-squares line is 2 A / 3; the largest departure, at the ends, as much."""
    bent = replace(AFTER, opening=0.0, closing=0.0, bow=1.5, noise=0.02)
    found = readings(after=bent)["after"]["linearity"]
    height = 1.5 * 0.8**2  # in the window of 10 to 90 %
    rated = BEFORE.gain * (10 - BEFORE.closing)
    assert found.value == pytest.approx(100 * 2 / 3 * height / rated, abs=0.1)
    whole = readings(after=bent, options=replace(OPTIONS, window=(0.0, 1.0)))["after"]["linearity"]
    assert whole.value == pytest.approx(100 * 2 / 3 * 1.5 / rated, abs=0.2)


def test_linearity_is_of_the_mean_of_both_branches():
    bent = replace(AFTER, opening=0.0, closing=0.0, bow=1.5, bow_back=-1.0, noise=0.02)
    assert readings(after=bent)["after"]["linearity"].value < 0.2


def test_hysteresis_is_where_the_branches_are_furthest_apart():
    """With unequal gains the width grows with the flow: at 90 % of the smaller branch's largest flow it is largest."""
    valve = replace(AFTER, gain_back=1.1)
    flow = 0.9 * valve.gain * (10 - valve.opening)
    width = valve.opening + flow / valve.gain - valve.closing - flow / (1.1 * valve.gain)
    reading = readings(after=valve)["after"]["hysteresis"]
    assert reading.value == pytest.approx(width * PERCENT, abs=0.2) and reading.where == "at 90% of the largest flow"


def test_linearity_before_is_that_of_a_dead_zone():
    u = np.linspace(1, 9, 801)
    mean = BEFORE.gain * (np.clip(u - BEFORE.opening, 0, None) + np.clip(u - BEFORE.closing, 0, None)) / 2
    departure = np.abs(mean - np.polyval(np.polyfit(u, mean, 1), u)).max()
    rated = BEFORE.gain * (10 - BEFORE.closing)
    for noise in (0.0, 0.15):  # of single readings the largest departure would grow with it
        found = readings(before=replace(BEFORE, noise=noise))["before"]["linearity"]
        assert found.value == pytest.approx(100 * departure / rated, abs=0.15)


def test_flows_grow_as_the_root_of_the_pressure_drop_and_thresholds_stay():
    found = assess([record(BEFORE, dp, seed=1) for dp in (1, 4)], [record(AFTER, dp, seed=2) for dp in (4, 1)], OPTIONS)
    assert [round(item.dp_MPa) for item in found.pressures] == [1, 4]
    low, high = (item.readings("after") for item in found.pressures)
    assert high["gain"].value == pytest.approx(2 * low["gain"].value, rel=5e-3)
    assert high["knee_opening"].value == pytest.approx(low["knee_opening"].value, abs=0.1)
    assert high["hysteresis"].value == pytest.approx(low["hysteresis"].value, abs=0.2)


def test_the_lag_of_the_meter_is_no_hysteresis_where_it_is_declared():
    lagging = [replace(valve, lag=0.5) for valve in (BEFORE, AFTER)]
    true = truth(AFTER)["hysteresis"]
    declared = readings(*lagging, options=replace(OPTIONS, reading=IdentifyOptions(meter_lag=0.5)))
    assert declared["after"]["hysteresis"].value == pytest.approx(true, abs=0.15)
    silent = replace(OPTIONS, reading=IdentifyOptions())
    found = assess([record(lagging[0], seed=1)], [record(lagging[1], seed=2)], silent)
    feigned = 2 * 0.1 * 0.5 * PERCENT  # twice the rate times the lag, over u_max
    assert found.pressures[0].readings("after")["hysteresis"].value == pytest.approx(true + feigned, abs=0.15)
    assert any(note.code == "lag-unknown" and "0.20%" in note.text for note in found.notes)


def test_repeated_ramps_are_one_test_and_know_more():
    once = readings()["after"]["gain"]
    after = [record(AFTER, seed=seed) for seed in range(2, 6)]
    found = assess([record(BEFORE, seed=1)], after, OPTIONS).pressures
    assert len(found) == 1 and len(found[0].after.ramps) == 4
    assert found[0].readings("after")["gain"].se == pytest.approx(once.se / 2, rel=0.3)


# what can't be seen


def test_over_compensation_is_seen_and_said():
    """1.6 L/min at zero command, as in Fig. 23 of the paper: no dead zone is left, and no knee among the commands."""
    found = readings(after=replace(AFTER, opening=-0.8, closing=-0.85))["after"]
    assert found["flow_at_zero"].value == pytest.approx(0.85 * AFTER.gain, rel=0.05)
    assert found["dead_zone_opening"].value == 0 and "at every command" in found["dead_zone_opening"].note
    knee = found["knee_opening"]
    assert knee.value is None and "below the lowest that was recorded" in knee.not_observable
    assert 0 <= knee.at_most < 0.1


def test_a_leak_at_zero_command_is_not_taken_for_the_meters_zero_error():
    found = readings(after=replace(AFTER, leak=0.4))["after"]["flow_at_zero"]
    assert found.value == pytest.approx(0.4, rel=0.05)
    found = assess([record(replace(BEFORE, leak=0.3), seed=1)], [record(AFTER, seed=2)], OPTIONS)
    (text,) = [note.text for note in found.notes if note.code == "meter-zero"]
    assert float(re.search(r"([+-][\d.]+) L/min flow without", text)[1]) == pytest.approx(0.3, abs=0.03)


def test_below_the_meters_floor_nothing_is_observable():
    floored = [replace(valve, floor=0.6) for valve in (BEFORE, AFTER)]
    reading = IdentifyOptions(meter_lag=0.0, meter_floor=0.6 * L_MIN)
    options = replace(OPTIONS, reading_flow=0.2 * L_MIN, reading=reading)
    found = readings(*floored, options=options)["after"]
    passed = (0.5 + 0.6 / 1.9) * PERCENT
    for key, bound in (("flow_at_zero", 0.6), ("dead_zone_opening", passed), ("onset_opening", passed)):
        assert found[key].value is None and "shows nothing below 0.6 L/min" in found[key].not_observable
        assert found[key].at_most == pytest.approx(bound, rel=0.02)
    by_itself = assess([record(floored[0], seed=1)], [record(floored[1], seed=2)])
    assert by_itself.meter.floor_L_min == pytest.approx(0.6, rel=0.25)


def test_an_onset_is_read_where_the_meter_has_no_floor_and_an_ideal_line_beside_every_reading():
    found = readings()
    for name, valve in (("before", BEFORE), ("after", AFTER)):
        assert found[name]["onset_opening"].value == pytest.approx(valve.opening * PERCENT, abs=0.7)
        assert found[name]["onset_closing"].value == pytest.approx(valve.closing * PERCENT, abs=0.7)
        assert found[name]["onset_opening"].value < found[name]["dead_zone_opening"].value
        largest = found[name]["largest_flow"].value
        assert found[name]["ideal_line"].value == pytest.approx(100 * LEVEL / largest, rel=1e-6)


def test_a_level_inside_the_noise_is_refused_as_a_dead_zone():
    found = readings(replace(BEFORE, noise=0.5), replace(AFTER, noise=0.5), replace(OPTIONS, reading_flow=0.05 * L_MIN))
    assert "does not stand out of the noise" in found["after"]["dead_zone_opening"].not_observable


@pytest.mark.parametrize(
    ("how", "missing", "why"),
    [
        ({"hold_s": 0.0}, {"flow_at_zero"}, "no recording holds zero command"),
        (
            {"falling": False},
            {"flow_at_zero", "dead_zone_closing", "onset_closing", "knee_closing", "hysteresis"},
            "no falling branch",
        ),
        ({"top": 8.0}, {"linearity"}, "do not cover the window"),
    ],
)
def test_what_a_recording_does_not_hold_is_not_observable(how, missing, why):
    after = readings(**how)["after"]
    hidden = {key for key, reading in after.items() if reading.value is None} - {"symmetry"}
    assert hidden == missing
    assert all(why in after[key].not_observable for key in missing)


def test_a_jump_past_the_straight_part_leaves_no_knee_but_a_dead_zone():
    """A meter that wakes up above half of the flow: `identify` refuses it, here the rest stands."""
    test = record(AFTER, seed=2)
    q = np.where(test.q < 0.6 * test.q.max(), 0.0, test.q)
    found = assess([record(BEFORE, seed=1)], [replace(test, q=q)], OPTIONS).pressures[0].readings("after")
    assert "the flow jumps" in found["knee_opening"].not_observable
    assert found["gain"].value is None
    assert found["dead_zone_opening"].value == pytest.approx(60, abs=8)


def test_a_reading_has_a_value_or_a_reason():
    for wrong in ({"value": None}, {"not_observable": "seen all the same"}):
        with pytest.raises(RuleError):
            replace(observed(1.0), **wrong)


# seeded faults of a compensator


@pytest.mark.parametrize(
    ("fault", "key", "limit"),
    [
        ({"opening": 1.2}, "dead_zone_opening", 0.12),
        ({"closing": 1.2, "opening": 1.2}, "dead_zone_closing", 0.12),
        ({"opening": 1.2}, "knee_opening", 0.1),
        ({"closing": -0.5}, "hysteresis", 0.05),
        ({"bump": 1.0}, "linearity", 0.02),
        ({"bow": 2.0}, "linearity", 0.02),
        ({"leak": 0.3}, "flow_at_zero", 0.1 * L_MIN),
        ({"gain": 1.8}, "largest_flow_loss", 0.05),
    ],
)
def test_a_seeded_fault_of_the_compensator_misses_its_limit_and_no_other_valve_does(fault, key, limit):
    options = replace(OPTIONS, limits={key: limit})
    before = record(BEFORE, seed=1)
    good = assess([before], [record(AFTER, seed=2)], options)
    bad = assess([before], [record(replace(AFTER, **fault), seed=2)], options)
    assert good.holds and not bad.holds
    assert "more than the limit" in bad.limits[0].text


def test_a_fault_at_one_pressure_drop_is_found_there():
    options = replace(OPTIONS, limits={"flow_at_zero": 0.1 * L_MIN})
    after = [record(AFTER, 1, seed=2), record(replace(AFTER, closing=-0.3), 5, seed=3)]
    found = assess([record(BEFORE, dp, seed=1) for dp in (1, 5)], after, options)
    assert [(result.place[-8:], result.holds) for result in found.limits] == [("1.00 MPa", True), ("5.00 MPa", False)]


def test_sets_that_were_swapped_are_seen_in_every_quantity():
    right, wrong = (
        assess([record(first, seed=1)], [record(second, seed=2)], OPTIONS).pressures[0].quantities
        for first, second in ((BEFORE, AFTER), (AFTER, BEFORE))
    )
    for key in ("dead_zone_opening", "knee_closing", "gain", "hysteresis"):
        assert np.sign(right[key].change.value) == -np.sign(wrong[key].change.value)


# pressures and sides


def test_a_pressure_drop_without_a_partner_is_said(wording):
    before = [record(BEFORE, dp, seed=1) for dp in (1, 2)]
    after = [record(AFTER, dp, seed=2) for dp in (1.015, 5)]
    found = assess(before, after, replace(OPTIONS, limits={"dead_zone_opening": 0.05}))
    assert [(bool(item.before), bool(item.after)) for item in found.pressures] == [
        (True, True), (True, False), (False, True),
    ]  # fmt: skip
    notes = [note for note in found.notes if note.code == "no-partner"]
    wording("assess notes: no partner", "\n".join(note.text for note in notes))
    assert len(notes) == 2
    # What was recorded with the compensator is checked, with or without a partner.
    assert [result.holds for result in found.limits] == [False, False]
    assert all(both.change is None for both in found.pressures[1].quantities.values())


def test_pressures_just_beyond_the_tolerance_are_no_partners(wording):
    with pytest.raises(InputError) as caught:
        assess([record(BEFORE, 1.0, seed=1)], [record(AFTER, 1.03, seed=2)], OPTIONS)
    wording("assess pressures: just beyond the tolerance", str(caught.value))


def both_sides(valve, negative, seed):
    return [record(valve, seed=seed), record(negative, seed=seed, sign=-1)]


def test_a_bipolar_valve_has_two_sides_and_a_symmetry():
    negative = replace(AFTER, gain=0.95 * AFTER.gain, opening=0.7)
    options = replace(OPTIONS, limits={"symmetry": 0.03})
    found = assess(both_sides(BEFORE, BEFORE, 1), both_sides(AFTER, negative, 2), options)
    assert [item.side for item in found.pressures] == ["positive", "negative"]
    positive = found.pressures[0].quantities["symmetry"]
    assert positive.after.value == pytest.approx(100 * (1 / 0.95 - 1), abs=0.4)
    assert positive.before.value == pytest.approx(0, abs=0.4)
    assert found.pressures[1].quantities["knee_opening"].after.value == pytest.approx(7, abs=0.1)
    assert [result.holds for result in found.limits] == [False]  # once, not once a side


def test_a_side_that_was_not_recorded_with_the_compensator_is_said():
    options = replace(OPTIONS, limits={"symmetry": 0.03})
    found = assess(both_sides(BEFORE, BEFORE, 1), [record(AFTER, seed=2)], options)
    assert any("negative commands at 1.00 MPa were recorded without" in note.text for note in found.notes)
    assert [result.holds for result in found.limits] == [None]
    assert "the negative side was not recorded" in found.limits[0].text


def test_one_recording_of_both_signs_reads_each_sides_own_hold():
    """Zero after closing: of the positive side before the valve goes negative, not after."""
    up, down = record(AFTER, seed=2), record(replace(AFTER, closing=-0.3), seed=3, sign=-1)
    one = replace(
        up,
        time=np.concatenate([up.time, up.time[-1] + 0.02 + down.time]),
        u=np.concatenate([up.u, down.u]),
        q=np.concatenate([up.q, down.q]),
        dp=np.concatenate([up.dp, down.dp]),
    )
    found = assess(both_sides(BEFORE, BEFORE, 1), [one], OPTIONS)
    zero = [item.quantities["flow_at_zero"].after.value for item in found.pressures]
    assert zero == pytest.approx([0.0, 0.3 * AFTER.gain], abs=0.03)


# the closed loop


@needs_compiler
@pytest.mark.slow
def test_the_dead_zones_of_the_closed_loop_are_found_in_its_records(example_compensator, firmware_folder):
    """The loop reads its records at 0.1 % of the largest flow; read at that, they must agree to 0.1 % of command."""
    from dzdesign.verify.closed_loop.loop import RampSequence
    from dzdesign.verify.closed_loop.plant import Plant
    from dzdesign.verify.closed_loop.ramps import FLOW_SHARE, compare_at_pressure
    from dzdesign.verify.closed_loop.scene import scenes_of

    scenes = scenes_of(firmware_folder, example_compensator, Plant())
    for scene in (scenes[1], scenes[-1]):
        compared = compare_at_pressure(scene, RampSequence(ramp=50.0))

        def recorded(run, digit):
            q = run.q_L_min * L_MIN
            return RampTest(
                source="loop", sha256=digit * 64, time=run.time, u=10 * run.command, q=q, dp=run.dp_MPa * 1e6
            )

        result = compared.result
        level = FLOW_SHARE * result.q_max_direct_L_min * L_MIN
        options = replace(OPTIONS, reading_flow=level)
        sets = ([recorded(compared.direct, "a")], [recorded(compared.compensated, "b")])
        item = assess(*sets, options).pressures[0]
        keys = ("dead_zone_opening", "dead_zone_closing")
        read = [item.readings(name)[key].value / 100 for name in ("before", "after") for key in keys]
        simulated = [
            result.dead_zone_opening, result.dead_zone_closing, result.residual_opening, result.residual_closing,
        ]  # fmt: skip
        assert read == pytest.approx(simulated, abs=1e-3)
        assert item.quantities["flow_at_zero"].after.value == pytest.approx(0.0, abs=1e-3)
        assert item.quantities["largest_flow"].after.value == pytest.approx(result.q_max_L_min, rel=5e-3)


# limits


def test_limits_are_read_with_their_units():
    assert parse_limits("dead_zone_opening = 5 %, hysteresis=0.3 V,flow-at-zero = 100 mL/min", 10.0) == pytest.approx(
        {"dead_zone_opening": 0.05, "hysteresis": 0.03, "flow_at_zero": 0.1 * L_MIN}
    )


@pytest.mark.parametrize(
    "text",
    [
        "dead_zone_openning = 5 %", "gain = 5 %", "hysteresis = 5", "hysteresis = 5 bar", "linearity = 1 V",
        "hysteresis = -1 %", "hysteresis", "hysteresis = 1 %, hysteresis = 2 %", " ",
    ],
)  # fmt: skip
def test_a_limit_that_can_not_be_read_is_refused(text, wording):
    with pytest.raises(InputError) as caught:
        parse_limits(text, 10.0)
    wording(f"assess limit: {text}", str(caught.value))


def test_every_limit_is_one_of_a_quantity_with_a_formula():
    assert set(LIMITED) ^ set(QUANTITIES) == {"largest_flow_loss", "gain", "largest_flow", "ideal_line"}
    assert all(item.formula and item.unit for item in (QUANTITIES | LIMITED).values())


def test_a_limit_on_what_is_not_observable_does_not_pass_but_a_bound_may():
    after = record(replace(AFTER, floor=0.6), seed=2)
    reading = IdentifyOptions(meter_lag=0.0, meter_floor=0.6 * L_MIN)
    for limit, holds in ((0.1, None), (0.7, True)):
        options = replace(OPTIONS, reading=reading, limits={"flow_at_zero": limit * L_MIN})
        found = assess([record(replace(BEFORE, floor=0.6), seed=1)], [after], options)
        assert [result.holds for result in found.limits] == [holds]
        assert found.holds is (holds is True)
    assert "at most 0.6 L/min" in found.limits[0].text


# the command line


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    """A folder with recordings at 1 and 4 MPa, before and after, as the working folder."""
    for dp in (1, 4):
        write(tmp_path / f"before_{dp}.csv", record(BEFORE, dp, seed=1))
        write(tmp_path / f"after_{dp}.csv", record(AFTER, dp, seed=2))
    monkeypatch.chdir(tmp_path)
    return tmp_path


SETS = ("before_*.csv", "--after", "after_*.csv", "--meter-lag", "0 s")


def run(capsys, *argv):
    """Run assess and return its status, stdout and stderr."""
    status = main(["-v", "assess", *argv])
    out, err = capsys.readouterr()
    return status, out, err


def test_the_command_fits_one_screen(bench, capsys):
    assert main(["assess", *SETS, "--limits", "hysteresis = 0.1 %, dead_zone_opening = 0.1 %"]) == 1
    out = capsys.readouterr().out
    assert len([row for line in out.splitlines() for row in textwrap.wrap(line, 78)]) <= 24
    assert "DOES NOT HOLD  dead zone" in out and "4 of 4 limits" in out


def test_the_command_prints_tables_formulas_and_writes_the_artefact(bench, capsys):
    status, out, _ = run(capsys, *SETS, "--reading-flow", "1 L/min")
    assert status == 0
    for words in ("Positive commands, at pressure drops in MPa", "no conformity", "No limits were given",
                  "Written: assessment.json"):  # fmt: skip
        assert words in out
    document = json.loads((bench / "assessment.json").read_text())
    (row,) = [line for line in out.splitlines() if "Dead zone at the reading flow, opening" in line]
    pairs = [item["quantities"]["dead_zone_opening"] for item in document["pressures"]]
    found = re.findall(r"(\S+) → (\S+)", row)
    assert len(found) == 2 and [tuple(map(float, pair)) for pair in found] == [
        tuple(pytest.approx(both[name]["value"], abs=0.06) for name in ("before", "after")) for both in pairs
    ]
    assert document["schema"] == "dzdesign.assessment/1" and document["tool"]["name"] == "dzdesign"
    assert [(one["set"], one["source"], len(one["sha256"])) for one in document["made_from"]] == [
        ("before", "before_1.csv", 64), ("before", "before_4.csv", 64),
        ("after", "after_1.csv", 64), ("after", "after_4.csv", 64),
    ]  # fmt: skip
    found = document["pressures"][0]["quantities"]["dead_zone_opening"]
    assert found["before"]["value"] == pytest.approx(56.5, abs=0.2)
    assert found["change"]["value"] == pytest.approx(found["after"]["value"] - found["before"]["value"])
    assert set(document["quantities"]) >= set(document["pressures"][0]["quantities"])
    assert all(item["formula"] for item in document["quantities"].values())


@pytest.mark.slow
def test_same_recordings_same_bytes(bench, capsys):
    argv = [*SETS, "--limits", "hysteresis = 4 %"]
    assert run(capsys, *argv)[0] == 0
    first = (bench / "assessment.json").read_bytes()
    assert run(capsys, *argv)[0] == 0
    assert (bench / "assessment.json").read_bytes() == first


def test_limits_in_the_file_of_options_decide_the_exit_status(bench, capsys):
    config = bench / "dzdesign.toml"
    for opening, status, words in (("12 %", 0, "Every limit holds."), ("6 %", 1, "DOES NOT HOLD  dead zone, opening")):
        config.write_text(f'meter-lag = "0 s"\nreading-flow = "1 L/min"\n[limits]\ndead_zone_opening = "{opening}"\n')
        found, out, _ = run(capsys, *SETS[:3], "--config", "dzdesign.toml")
        assert found == status and words in out
    assert "more than the limit of 6 %" in out and "DOES NOT HOLD: 2 of 2 limits" in out
    assert json.loads((bench / "assessment.json").read_text())["holds"] is False
    config.write_text('[limits]\ndead_zone_closeing = "5 %"\n')
    found, _, err = run(capsys, *SETS, "--config", "dzdesign.toml")
    assert found == 2 and "did you mean 'dead_zone_closing'" in err


def test_a_limit_that_is_not_checked_is_exit_status_1(bench, capsys):
    status, out, _ = run(capsys, *SETS, "--limits", "symmetry = 5 %")
    assert status == 1 and out.count("NOT CHECKED  symmetry") == 2


def test_over_compensation_is_printed_beside_a_dead_zone_of_none(bench, capsys):
    write(bench / "after_4.csv", record(replace(AFTER, opening=-0.5, closing=-0.6), 4, seed=2))
    status, out, _ = run(capsys, *SETS, "--limits", "dead_zone_opening = 9 %, flow_at_zero = 0.1 L/min")
    assert status == 1
    assert "dead zone, opening, AFTER at positive commands, 4.00 MPa: the flow lies above the level at every" in out
    assert "HOLDS  dead zone, opening, positive commands, 4.00 MPa: 0 %" in out
    assert "DOES NOT HOLD  flow at zero, positive commands, 4.00 MPa" in out


def test_of_one_branch_the_gain_says_so(bench, capsys):
    write(bench / "after_4.csv", record(AFTER, 4, seed=2, falling=False))
    assert "gain, AFTER at positive commands, 4.00 MPa: of one branch only: the other was not" in run(capsys, *SETS)[1]


def test_json_is_the_artefact(bench, capsys):
    status, out, _ = run(capsys, *SETS, "--json")
    assert status == 0 and out == (bench / "assessment.json").read_text()


def test_a_command_in_per_cent_and_columns_of_their_own(bench, capsys):
    write(bench / "after_1.csv", record(AFTER, 1, seed=2), per_cent=True)
    test = record(AFTER, 4, seed=2)
    output = 5.2 + 0.48 * test.u  # the compensator's, as `monitor` records it beside the command
    write(bench / "after_4.csv", test, header="time_s,u_V,dP_MPa,Q_Lmin,uO_V", extra=output)
    assert run(capsys, *SETS)[0] == 0
    for item in json.loads((bench / "assessment.json").read_text())["pressures"]:
        assert item["quantities"]["knee_opening"]["after"]["value"] == pytest.approx(5.0, abs=0.1)
    (bench / "after_1.csv").unlink()
    status, _, err = run(capsys, *SETS, "--after-columns", "u=uO_V")
    assert status == 2 and "the command runs from 5.20 to 10.00 V" in err


def test_columns_that_are_taken_from_those_before_are_said_and_their_own_named(bench, capsys):
    """Of the recordings before the file of options says the columns; those after have others."""
    for dp in (1, 4):
        write(bench / f"before_{dp}.csv", record(BEFORE, dp), header="Zeit_s,AO0_V,dP_MPa,Q_Lmin")
    (bench / "dz.toml").write_text('[columns]\ntime = "Zeit_s:s"\nu = "AO0_V"\n')
    status, _, err = run(capsys, *SETS, "--config", "dz.toml")
    assert status == 2 and "recordings after: columns as those before, by --columns or [columns]" in err
    assert "which --columns names for time" in err
    assert "read by the same --columns, or [columns], as those before: say theirs by --after-columns" in err
    status, _, err = run(capsys, *SETS, "--config", "dz.toml", "--after-columns", "u=AO0_V")
    assert status == 2 and "which --after-columns names for u" in err and "as those before" not in err
    assert run(capsys, *SETS, "--config", "dz.toml", "--after-columns", "u=u_V")[0] == 0


def test_a_dead_zone_that_stays_is_asked_about(bench, capsys):
    """The compensator was switched off, or a column holds the valve's drive in place of the command."""
    write(bench / "after_4.csv", record(BEFORE, 4, seed=9))
    status, out, _ = run(capsys, *SETS)
    assert status == 0 and "note [unchanged] after_4.csv" in out and "[unchanged] after_1.csv" not in out


def test_another_full_command_after(bench, capsys):
    test = record(AFTER, 4, seed=2)
    (bench / "after_1.csv").unlink()
    write(bench / "after_4.csv", replace(test, u=test.u / 2))
    assert run(capsys, *SETS, "--after-u-max", "5 V")[0] == 0
    *_, item = json.loads((bench / "assessment.json").read_text())["pressures"]
    assert item["quantities"]["knee_opening"]["after"]["value"] == pytest.approx(5.0, abs=0.1)
    assert item["quantities"]["gain"]["after"]["value"] == pytest.approx(2 * 2 * 1.9, rel=5e-3)


REFUSED = {
    "a copy": ["before_1.csv", "--after", "before_1.csv"],
    "nothing after": ["before_1.csv"],
    "no file": ["before_1.csv", "--after", "none_*.csv"],
    "no partner": ["before_1.csv", "--after", "after_4.csv"],
    "level's unit": [*SETS, "--reading-flow", "0.6"],
    "no level": [*SETS, "--reading-flow", "0 L/min"],
    "level too high": [*SETS, "--reading-flow", "100 %"],
    "window": [*SETS, "--linearity-window", "90-10"],
    "window's text": [*SETS, "--linearity-window", "wide"],
    "full command": [*SETS, "--after-u-max", "0 V"],
    "command too large": [*SETS, "--u-max", "5 V"],
    "limit": [*SETS, "--limits", "histeresis = 3 %"],
    "columns": [*SETS, "--after-columns", "u=AO0:V"],
    "output": [*SETS, "-o", "before_1.csv"],
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_one_sentence_and_touches_nothing(bench, capsys, case, wording):
    before = {path: path.read_bytes() for path in bench.iterdir()}
    status, out, err = run(capsys, *REFUSED[case])
    assert status == 2 and out == ""
    line = err.splitlines()[-1]
    assert line.startswith("dzdesign: ")
    wording(f"assess refused: {case}", line)
    assert {path: path.read_bytes() for path in bench.iterdir()} == before


def test_a_valve_that_stays_shut_with_the_compensator_is_refused(bench, capsys):
    write(bench / "after_1.csv", record(replace(AFTER, gain=0.0), 1, seed=2))
    status, _, err = run(capsys, *SETS)
    assert status == 2 and "does not show the valve opening" in err


def test_the_document_is_written_as_json_whatever_is_not_observable():
    found = assess([record(BEFORE, seed=1)], [record(AFTER, seed=2, falling=False, hold_s=0.0)], OPTIONS)
    content = to_json_bytes(found)
    assert read_artefact(content, Assessment, "assessment.json") == found
    zero = json.loads(content)["pressures"][0]["quantities"]["flow_at_zero"]
    assert zero["after"]["value"] is None and "falling branch" in zero["after"]["not_observable"]
    assert zero["change"] is None


@pytest.mark.skipif(not SHARED.is_dir(), reason=f"the shared measurements are not at {SHARED}")
def test_dead_zones_at_a_level_on_recordings_that_the_project_did_not_make():
    """Valve A has a dead zone, valve E next to none; the truth at 1 L/min is their simulation's, of true flow."""
    truth = json.loads((SHARED / "truth.json").read_text())
    names = {"before": ["A_dP1", "A_dP5"], "after": ["E_dP1", "E_dP5"]}
    folders = {"before": SHARED / "valve_a", "after": SHARED / "valve_e"}
    sets = [[read_ramp_file(folders[key] / f"{name}.csv.gz") for name in names[key]] for key in folders]
    reading = IdentifyOptions(meter_lag=0.125)  # 0.1 s of one bench, 0.15 s of the other: 2.5 mV
    found = assess(*sets, replace(OPTIONS, reading=reading, reading_flow=1.0 * L_MIN))
    for row, item in enumerate(found.pressures):
        for key in folders:
            readings = item.readings(key)
            known = truth[names[key][row]]["pos"]
            for direction, way in (("rising", "opening"), ("falling", "closing")):
                reading = readings[f"dead_zone_{way}"]
                assert reading.value / PERCENT == pytest.approx(known[f"u_{direction}_Q1.0"], abs=0.02), (key, row, way)
                assert reading.se / PERCENT < 0.02
            assert readings["largest_flow"].value == pytest.approx(known["Qmax_true"], rel=0.01)


@needs_compiler
def test_recordings_with_the_compensator_say_whose_and_the_pages_options_are_taken(
    firmware_folder, tmp_path, monkeypatch
):
    root = ROOT
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "--firmware", str(firmware_folder), "--dp", "1 MPa", "-o", "after"]) == 0
    manifest = json.loads((tmp_path / "after" / "manifest.json").read_text())
    assert manifest["simulated"] is True and len(manifest["made_from"][0]["sha256"]) == 64
    page = (root / "docs" / "before-after.md").read_text(encoding="utf-8")
    options = re.search(r"    (meter-lag = .*?)\n\n", page, re.DOTALL)[1]
    Path("options.toml").write_text(textwrap.dedent("    " + options))
    before = str(root / "examples" / "paper_valve" / "ramps" / "ramp_dP1_1.csv.gz")
    after = [str(path) for path in (tmp_path / "after").glob("*.gz")]
    assert len(after) == 1
    assert main(["assess", before, "--after", *after, "--config", "options.toml"]) in (0, 1)


@needs_compiler
def test_a_simulated_recording_with_the_compensator_needs_a_firmware(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "--firmware", "nowhere", "-o", "after"]) == 2
    assert "firmware manifest 'nowhere" in capsys.readouterr().err
    assert not (tmp_path / "after").exists()


def test_the_curves_of_both_sets_are_kept_with_samples_and_how_they_were_recorded():
    sets = {"before": (BEFORE, record(BEFORE, seed=1)), "after": (AFTER, record(AFTER, seed=2))}
    (item,) = assess([sets["before"][1]], [sets["after"][1]], OPTIONS).pressures
    for name, (valve, ramp) in sets.items():
        curve = getattr(item, name).curve
        for branch, threshold in ((curve.rising, valve.opening), (curve.falling, valve.closing)):
            at = (threshold + 2.0) * PERCENT
            flow = np.interp(at, branch.command_percent, branch.q_L_min)
            assert flow == pytest.approx(2.0 * valve.gain, rel=0.05)  # on the straight line of the valve
            assert len(branch.command_percent) <= MOST_POINTS
            assert MOST_SAMPLES / 2 < len(branch.sample_q_L_min) == len(branch.sample_command_percent) <= MOST_SAMPLES
        assert curve.conditions.sampling_Hz == pytest.approx(1 / np.median(np.diff(ramp.time)), rel=1e-3)
        assert len(to_json_bytes_of(curve)) < 6000


def to_json_bytes_of(curve) -> bytes:
    return to_json(as_document(curve)).encode()
