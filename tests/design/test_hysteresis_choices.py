"""The table of what each way with the hysteresis leaves."""

from dzdesign.codegen.project import DEFAULT_TARGET, target_named
from dzdesign.design.designing import design
from dzdesign.design.hysteresis_choices import hysteresis_choices
from dzdesign.design.option_texts import options_of
from dzdesign.terminal.choices_table import print_choices


def choices(valve, **texts):
    return hysteresis_choices(design(valve, options_of(texts, target_named(DEFAULT_TARGET).inputs())))


def test_a_reading_flow_that_a_test_never_comes_to_leaves_no_worst_of_all_tests(example_valve):
    largest = [test.q_max_L_min for test in example_valve.positive.tests]
    within = choices(example_valve, reading_flow="1 L/min")
    assert all(each.reading is not None for each in within if not each.refused)
    beyond = choices(example_valve, reading_flow=f"{(min(largest) + max(largest)) / 2} L/min")
    made = [each for each in beyond if not each.refused]
    assert made and all(each.reading is None and each.onset is not None for each in made)


def test_what_the_sweeps_cannot_tell_of_a_play_is_said_where_it_is_recommended(example_valve, capsys):
    found = choices(example_valve)
    assert "play" in next(each.given for each in found if each.recommended)
    print_choices(found)
    assert "small loop" in capsys.readouterr().out
    print_choices([each for each in found if "play" not in each.given])
    assert "small loop" not in capsys.readouterr().out
