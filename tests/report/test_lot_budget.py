"""The budgets of a lot as one: every component of every valve, and what the certificates are of."""

import pytest

from dzdesign.batch.summary import lot_budget
from dzdesign.codegen.project import target_named
from dzdesign.design.designing import design
from dzdesign.design.option_texts import options_of
from dzdesign.report.lot.words import lot_budget_lines


def designed(valve, **texts):
    return design(valve, options_of(texts, target_named("f28335").inputs()))


@pytest.fixture(scope="module")
def lot(example_valve):
    return {
        "a": designed(example_valve, amplifier="1 %"),
        "b": designed(example_valve, amplifier="3 %", ageing="0.1 %"),
    }


def test_a_line_has_the_least_the_median_and_the_largest_of_all_valves(lot):
    budget = lot_budget(lot)
    lines = {line.component: line for line in budget.lines}
    for component, line in lines.items():
        of_valves = [one for each in lot.values() for one in each.positive.budget.lines if one.component == component]
        prices = [100 * one.price for one in of_valves]
        assert line.price_percent == pytest.approx((min(prices), sum(prices) / 2, max(prices)), abs=1e-5)
        assert line.contribution_mV == pytest.approx(max(max(one.contribution_mV) for one in of_valves), abs=1e-4)
    assert lines["ageing"].origin == ("default", "declared")
    assert lines["amplifier"].price_percent[2] > 2 * lines["amplifier"].price_percent[0]


def test_a_lot_without_a_machine_says_so_and_a_mixed_one_says_both(lot, example_compensator):
    bare = lot_budget({"a": example_compensator})
    assert "no machine was declared" in lot_budget_lines(bare)[0]
    (line,) = lot_budget_lines(lot_budget(lot))
    assert line == "The certificates cover the valve as recorded and the declared machine."
    mixed = lot_budget({**lot, "c": example_compensator})
    assert len(mixed.certified_of) == 2 and "of some valves" in lot_budget_lines(mixed)[0]
    assert lot_budget({}) is None and lot_budget_lines(None) == ()
