"""Costs of a declared machine, and what was not declared, in words."""

from fractions import Fraction

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import last_opening
from dzdesign.design.law_corners import corners_of
from dzdesign.design.machine.bench_current import premise_of_bench_current
from dzdesign.design.machine.colder_coil import colder_coil_in_words
from dzdesign.design.signals import SIDE_NAMES


def machine_costs(compensator: Compensator, sign: int) -> list[str]:
    """Return the lines of one side; the premises of the machine stand with positive commands."""
    machine, budget = compensator.machine, compensator.side(sign).budget
    if machine is None or budget is None:
        return [colder_coil_in_words(compensator, sign)]
    units = compensator.valve.recorded_units.of_side(SIDE_NAMES[sign])
    taken = [
        threshold - ceiling for threshold, ceiling in zip(budget.threshold_V, budget.ceiling_V, strict=True)
    ]
    lines = [
        f"the budget takes {units.text(1e3 * max(taken), '.0f mV')} from the threshold at most "
        f"({max(taken) / float(compensator.u_max_V):.2%} of command); the largest part: {budget.largest.component}, "
        f"{budget.largest.price:.2%}"
    ]
    lines += _other_end(compensator, sign)
    lines += _jump(compensator, sign)
    drive = compensator.current_drive
    if drive is not None and sign > 0:
        premise = premise_of_bench_current(compensator.valve, drive.circuit.rated_A, machine.bench_full_A)
        lines += [premise] if premise else []
    return lines


def _other_end(compensator: Compensator, sign: int) -> list[str]:
    """Say how long the dead zone is on the machine that opens last, which the transition does not reach."""
    if compensator.machine is None:
        return []
    factor = float(compensator.machine.largest_factor)
    tests = compensator.valve.sides[SIDE_NAMES[sign]].tests
    found = [share for test in tests if (share := last_opening(compensator, test, sign)) is not None]
    if not found:
        return []
    words = f"at the other end of the machine the threshold is {factor:.3f} times the bench's: "
    if max(found) > 1:
        words += "the valve does not open at any command; control the current, or declare narrower ranges"
    else:
        words += f"the dead zone on opening is there up to {max(found):.2%} of command"
    return [words]


def _jump(compensator: Compensator, sign: int) -> list[str]:
    """Say what the transition's end passes on the machine that opens earliest; nothing without a transition."""
    if compensator.machine is None or not compensator.transition_codes:
        return []
    factor, found = float(compensator.machine.least_factor), []
    for test in compensator.valve.sides[SIDE_NAMES[sign]].tests:
        dp_code = round(compensator.signals.dp_code(Fraction(repr(test.dp_MPa))))
        at_end_V = corners_of(compensator, dp_code, sign).at_end * float(compensator.u_max_V)
        found.append(float(test.recorded.opening.flow_at(np.array([at_end_V / factor]))[0]))
    share = compensator.transition_end / compensator.signals.command.span(sign)
    flow = compensator.valve.recorded_units.text(max(found), ".2f L/min")
    return [
        f"the transition ends at the bench's opening threshold: on the machine that opens earliest ({factor:.3f} times "
        f"the bench's threshold) a command of {share:.2%} passes up to {flow}; --transition off does without that jump"
    ]
