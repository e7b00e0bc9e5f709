"""What a page prints of a valve: names of recordings that fit in a column, the meter's lag with its tolerance."""

from dataclasses import replace

import pytest

from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.identify.valve.left_out import LeftOut, left_out_in_words
from dzdesign.identify.valve.model import lag_in_words
from dzdesign.report.sections.valve import conditions_section
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
        (0.05, 0.05, ", uncertain by ± 0.05 s"),
        (0.02, 0.01, ", uncertain by 0.02 s longer or 0.01 s shorter"),
        (0.2, 0.0, ", uncertain by 0.2 s longer"),
        (0.0, 0.0, ""),
    ],
)
def test_the_lag_comes_with_its_tolerance(longer, shorter, words):
    assert lag_in_words(0.1, "declared", longer=longer, shorter=shorter) == f"lag 0.1 s (declared){words}"


def test_page_and_report_have_it(example_valve, capsys):
    print_valve(example_valve)
    words = example_valve.meter.lag_in_words()
    assert "±" in words or "longer" in words
    assert words in capsys.readouterr().out
    (table,) = conditions_section(example_valve, None).tables
    assert any(words in cell.text for row in table.rows for cell in row)


def test_many_parts_of_one_reason_share_a_line_of_the_log():
    part = LeftOut(recording="a.csv", from_s=0.0, to_s=0.1, reason="pressure", dp_MPa=(0.0, 0.2))
    single = replace(part, recording="b.csv", reason="partial", dp_MPa=None)
    parts = [replace(part, from_s=float(second), to_s=second + 0.1) for second in range(200)]
    assert list(left_out_in_words([*parts, single], AS_COMPUTED)) == [
        "'a.csv', 200 parts of 0.0 to 199.1 s left out: the pressure drop is not the ramp's (0 to 0.2 MPa)",
        "'b.csv', 0.0 to 0.1 s left out: the command stays below half of its largest",
    ]
    assert len(list(left_out_in_words(parts[:3], AS_COMPUTED))) == 3


def test_what_was_left_out_is_a_line_for_each_reason(example_valve, capsys):
    """Both sides of a recording name the same seconds, which count once; what the engineer left out is not said."""
    side = example_valve.positive
    stretches = [(4.0, "pressure"), (4.9, "pressure"), (9.0, "option"), (2.0, "partial")]
    parts = [
        LeftOut(recording=f"r{number}.csv", from_s=0.0, to_s=end, reason=reason, dp_MPa=None)
        for number, (end, reason) in enumerate(stretches)
    ]
    tests = (replace(side.tests[0], left_out=tuple(parts)), *side.tests[1:])
    one = replace(side, tests=tests)
    other = replace(side, tests=(replace(side.tests[0], left_out=(replace(parts[1], to_s=4.5),)), *side.tests[1:]))
    print_valve(replace(example_valve, sides={"positive": one, "negative": other}))
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("left out")]
    assert lines == [
        "left out of 2 recordings: up to 4.9 s, the pressure drop is not the ramp's (listed by -v)",
        "left out of 'r3.csv': 2.0 s, the command stays below half of its largest (listed by -v)",
    ]
