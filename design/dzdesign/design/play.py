"""The inverse play operator: by how much a falling command is driven lower than a rising one.

A valve with hysteresis is a play in its input: on the way back it waits until the drive has fallen by the play's width.
So on a falling command the drive goes ahead by that width, and the spool follows at once. What is taken away begins with
the transition and is whole at its end: zero command has the certified offset, whatever the width.
"""

from dataclasses import replace
from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.side_model import SideModel

#: Codes of travel over which the drive goes over to the other branch, behind those that noise may make.
PLAY_CODES = 8


def with_play(compensator: Compensator) -> Compensator:
    """Return a compensator with a transition whose drive takes out the hysteresis of its valve's knees."""
    functions = compensator.drive_functions
    counts = [play_counts(compensator, sign) if sign in compensator.signals.signs else 0 for sign in (1, -1)]
    if not any(counts):
        raise InputError(
            "the opening threshold does not lie above the certified offset at every pressure, so no hysteresis can be "
            "taken out; leave out --hysteresis play"
        )
    functions = replace(
        functions,
        play_counts=(counts[0], counts[1]),
        play_codes=PLAY_CODES,
        play_noise_codes=compensator.command_error.noise_codes,
    )
    return replace(compensator, drive_functions=functions)


def play_counts(compensator: Compensator, sign: int) -> int:
    """Return the mean hysteresis of a side's knees in counts; refuse one wider than what the transition spans.

    A wider one would drive a falling command below the certified offset: more dead zone, and no longer the law.
    """
    side = compensator.valve.sides[SIDE_NAMES[sign]]
    width_V = mean_hysteresis_V(side)
    if width_V is None:
        raise InputError(
            "--hysteresis play needs the valve's hysteresis, of which no test has both branches; record the falling "
            "branch too, or leave it out"
        )
    if width_V <= 0:
        raise InputError(f"the {SIDE_NAMES[sign]} side shows no hysteresis, so there is none to take out; leave out play")
    counts = round(Fraction(repr(width_V)) / compensator.u_max_V * compensator.signals.compare_max)
    return min(counts, narrowest_transition(compensator, sign))


def mean_hysteresis_V(side: SideModel) -> float | None:
    """Return how far the knees of opening and closing lie apart, on average over the tests with both branches, V."""
    widths = [
        test.u_knee_rising_V - test.u_knee_falling_V
        for test in side.tests
        if test.u_knee_rising_V is not None and test.u_knee_falling_V is not None
    ]
    return sum(widths) / len(widths) if widths else None


def narrowest_transition(compensator: Compensator, sign: int) -> int:
    """Return the least distance of the opening law from the certified offset over all pressures, counts, rounded down."""
    law = compensator.side(sign)
    gap = min(upper - lower for upper, lower in zip(law.law_beta, law.beta, strict=True))
    return int(Fraction(gap, compensator.beta_denominator) * law.u_min0_over_u_max * compensator.signals.compare_max)

