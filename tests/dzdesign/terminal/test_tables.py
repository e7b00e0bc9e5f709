"""What a page prints of a valve: names of recordings that fit in a column, the meter's lag with its tolerance."""

import pytest

from dzdesign.identify.valve.model import lag_in_words
from dzdesign.report.sections.valve import valve_sections
from dzdesign.terminal.tables import print_valve, short_source


@pytest.mark.parametrize(
    ("names", "short"),
    [
        (["ramp_dP1_1.csv", "ramp_dP1_2.csv"], "ramp_dP1_{1,2}.csv"),
        (["run_09.csv", "run_10.csv", "run_11.csv"], "run_{09,10,11}.csv"),  # no number is cut in two
        (["p1.csv", "p1_again.csv"], "p{1,1_again}.csv"),
        (["a.csv", "b.csv"], "a.csv, b.csv"),
        (["r_x.csv", "r_xx.csv"], "r_x.csv, r_xx.csv"),
        (["r.csv"], "r.csv"),
        (["r.csv (ramp 1, 0.0 to 3.0 s)", "r.csv (ramp 2, 3.0 to 6.0 s)"], "as it is"),
        ([f"r{place}.csv" for place in range(9)], "r{0,1,2,3,4,5,...}.csv"),
        (["monday morning at 3 MPa.csv", "monday evening, still warm.csv"], "as it is"),
    ],
)
def test_names_of_one_test_are_shortened(names, short):
    assert short_source("as it is" if short == "as it is" else ", ".join(names), names) == short


@pytest.mark.parametrize(
    ("longer", "shorter", "words"),
    [
        (0.05, 0.05, "0.1 s ± 0.05 s"),
        (0.02, 0.01, "0.1 s, at most 0.02 s longer or 0.01 s shorter"),
        (0.2, 0.0, "0.1 s, at most 0.2 s longer"),
        (0.0, 0.0, "0.1 s"),
    ],
)
def test_the_lag_comes_with_its_tolerance(longer, shorter, words):
    assert lag_in_words(0.1, "declared", longer=longer, shorter=shorter) == f"lag taken as {words} (declared)"


def test_page_and_report_have_it(example_valve, capsys):
    print_valve(example_valve)
    words = example_valve.meter.lag_in_words()
    assert "±" in words or "at most" in words
    assert words in capsys.readouterr().out
    assert any(words in str(line) for line in valve_sections(example_valve, None)["data"].lines)
