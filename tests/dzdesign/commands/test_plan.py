"""`dzdesign plan`: the page, JSON and exit status, the premises of a pilot series, and what is refused."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from planned_bench import PlannedBench

from dzdesign import api
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions

#: Few candidates, so that a plan takes no second.
QUICK = ["--dp-range", "1..5 MPa", "--ramp-times", "20 s", "--budget", "10 min"]


def planned(capsys, *argv):
    """Run the command; return its status and its JSON."""
    status = main(["-q", "plan", *argv, "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.fixture(scope="module")
def pilot():
    tests = PlannedBench().record([1, 5] * 4, 20.0, 20.0, np.random.default_rng(3))
    return identify(tests, IdentifyOptions(meter_lag=0.1))


def test_the_page_says_what_to_record_and_what_comes_of_it(capsys):
    assert main(["-q", "plan", *QUICK]) == 0
    page = capsys.readouterr().out
    order = re.search(r"^order \(random, seed 1\): (.*) MPa$", page, re.MULTILINE)
    ramps = [float(value) for value in order[1].split(", ")]
    assert f"series of {len(ramps)} ramps" in page and ramps[0] == ramps[-1]
    assert "0 to 10 V in 20 s and back in 20 s, at 100 Hz" in page
    for row in ("plan", "twice the time", "no repeats"):
        assert re.search(rf"^  {row} ", page, re.MULTILINE), row
    assert "noise 0.15 L/min (assumed)" in page and "note: assumed, so check them:" in page


def test_json_has_the_same_and_its_numbers_fit_together(capsys):
    status, plan = planned(capsys, *QUICK, "--noise", "0.3 L/min", "--meter-zero", "0.1 L/min")
    chosen = plan["chosen"]
    shares = [value for key, value in chosen.items() if key.startswith("of_")]
    assert status == 0 and chosen["loss_mV"] == pytest.approx(sum(shares), abs=0.2) and chosen["of_meter_zero_mV"] > 10
    assert len(plan["order_MPa"]) == chosen["ramps"] and set(plan["order_MPa"]) == set(chosen["pressure_drops_MPa"])
    assert chosen["duration_min"] == pytest.approx(chosen["ramps"]) and chosen["repeatability"] == "repeats"
    assert {row["name"]: row["repeatability"] for row in plan["alternatives"]}["no repeats"] == "declared"
    origins = {each["name"]: each["origin"] for each in plan["premises"]}
    assert origins["noise"] == "given" and origins["repeatability"] == "assumed"


@pytest.mark.slow
def test_a_loss_out_of_reach_is_exit_status_1_and_says_what_is_largest(capsys):
    status, plan = planned(capsys, *QUICK, "--loss", "20 mV")
    assert status == 1 and plan["reached"] is False
    assert any("scatter from ramp to ramp" in note for note in plan["notes"])
    status, plan = planned(capsys, *QUICK, "--loss", "1 V")
    assert status == 0 and plan["reached"] and plan["chosen"]["loss_mV"] < 1000 and plan["wanted_mV"] == 1000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--dead-zone", "3 %"], "no positive offset can be certified"),
        (["--threshold-change", "0.3 %", "--repeatability", "1 %"], "find the direction"),
    ],
    ids=["nothing certified", "trend not found"],
)
def test_what_should_be_known_is_noted(capsys, options, words):
    _, plan = planned(capsys, *QUICK, *options)
    assert any(words in note for note in plan["notes"]), plan["notes"]


@pytest.mark.slow
def test_a_pilot_replaces_the_assumptions_and_options_replace_the_pilots(capsys, pilot, tmp_path):
    path = tmp_path / "pilot.json"
    path.write_bytes(to_json_bytes(pilot))
    options = ["--ramp-times", "20 s", "--budget", "10 min"]
    _, plan = planned(capsys, str(path), *options)
    assert {each["origin"] for each in plan["premises"]} == {"pilot series"} and plan["notes"] == []
    assert plan["chosen"]["pressure_drops_MPa"][0] == 1 and plan["chosen"]["pressure_drops_MPa"][-1] == 5
    _, better = planned(capsys, str(path), *options, "--repeatability", "0.01 %")
    origins = {each["name"]: each["origin"] for each in better["premises"]}
    assert origins["repeatability"] == "given" and origins["noise"] == "pilot series"
    assert better["chosen"]["loss_mV"] < plan["chosen"]["loss_mV"]
    _, wider = planned(capsys, str(path), *options, "--dp-range", "1..10 MPa")
    assert any("the pilot series ran from 1.00 to 5.00 MPa" in note for note in wider["notes"])


def test_a_threshold_that_rises_is_planned_as_one_that_falls(capsys):
    """What the steps of the staircase cost is the same either way."""
    _, falls = planned(capsys, *QUICK, "--threshold-change", "3 %")
    _, rises = planned(capsys, *QUICK, "--threshold-change=-3%")
    assert {each["name"]: each["value"] for each in rises["premises"]}["threshold"] == "50 to 53 % of 10 V"
    assert rises["chosen"]["of_staircase_mV"] == pytest.approx(falls["chosen"]["of_staircase_mV"], rel=1e-3)
    assert rises["chosen"]["loss_mV"] == pytest.approx(falls["chosen"]["loss_mV"], rel=0.1)


def test_the_side_of_a_pilot(pilot, wording):
    half = tuple(replace(test, q_max_L_min=test.q_max_L_min / 2) for test in pilot.positive.tests)
    both = replace(pilot, sides={"positive": pilot.positive, "negative": replace(pilot.positive, tests=half)})
    known = {"ramp_times": "20 s", "budget": "10 min"}
    flows = {side: api.plan(both, side=side, **known).premises[1].value for side in (None, "positive", "negative")}
    assert flows[None] == flows["positive"]
    positive, negative = (float(flows[side].split()[0]) for side in ("positive", "negative"))
    assert negative == pytest.approx(positive / 2, rel=0.01)
    with wording.refusal(InputError, "plan: a side that the pilot lacks"):
        api.plan(pilot, side="negative")


def test_a_pilot_with_too_few_repeats_leaves_the_repeatability_assumed():
    tests = PlannedBench().record([1, 5], 20.0, 20.0, np.random.default_rng(3))
    plan = api.plan(identify(tests, IdentifyOptions()), ramp_times="20 s", budget="10 min")
    assumed = [each.name for each in plan.premises if each.origin == "assumed"]
    assert assumed == ["repeatability", "meter lag"] and "check them: repeatability, meter lag" in plan.notes[0]


def test_the_api_takes_the_result_of_identify_and_shows_the_page(pilot):
    plan = api.plan(pilot, ramp_times="20 s", budget="10 min")
    assert repr(plan) == f"<Test series of {plan.chosen.ramps} ramps, {plan.chosen.duration_min:g} min>"
    assert "Predicted loss (mV)" in str(plan) and "Predicted loss (mV)" in plan._repr_html_()


def test_options_of_a_file(capsys, tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text('dp-range = "2 MPa"\nnoise = "0.3 L/min"\nramp-times = "20 s"\nseed = "7"\n')
    _, plan = planned(capsys, "--config", str(path))
    assert plan["chosen"]["pressure_drops_MPa"] == [2] and plan["seed"] == 7
    assert {each["name"]: each["value"] for each in plan["premises"]}["noise"] == "0.3 L/min"


@pytest.mark.parametrize(
    "options",
    [
        {"dp_range": "5..1 MPa"},
        {"dp_range": "1..5"},
        {"dead_zone": "50"},
        {"threshold_change": "60 %"},
        {"budget": "1 min"},
        {"repeatability": "20 %"},
        {"pause": "-1 s"},
        {"side": "negative"},
        {"threshold_change": "-51 %"},
        {"threshold_change": "2"},
    ],
    ids=lambda options: " ".join(f"{name} {value}" for name, value in options.items()),
)
def test_a_wrong_option_is_refused(options, wording):
    with pytest.raises(InputError) as caught:
        api.plan(**options)
    wording(f"plan option: {options}", str(caught.value))


def test_an_option_that_the_pilot_answers_is_refused(pilot, wording):
    with wording.refusal(InputError, "plan: an option that the pilot answers"):
        api.plan(pilot, max_flow="10 L/min")


def test_a_pilot_without_a_pressure_drop_is_refused(wording):
    test = PlannedBench().record([1], 20.0, 20.0, np.random.default_rng(3))[0]
    unknown = type(test)(source=test.source, sha256=test.sha256, time=test.time, u=test.u, q=test.q, dp=None)
    with wording.refusal(InputError, "plan: a pilot without a pressure drop"):
        api.plan(identify([unknown]))
