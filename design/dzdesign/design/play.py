"""The inverse play operator: by how much a falling command is driven lower than a rising one.

A valve with hysteresis is a play in its input: on the way back it waits until the drive has fallen by the play's width.
So on a falling command the drive goes ahead by that width, and the spool follows at once. What is taken begins with
the transition and is whole at its end: zero command has the certified offset, whatever the width. Over the command
the width is the recorded one: towards full command, where every ramp turns, the branches of real valves come together.
"""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import corners_of
from dzdesign.design.signals import SIDE_NAMES

#: Codes of travel over which the drive goes over to the other branch, behind those that noise may make.
PLAY_CODES = 8
#: Most segments of the width over the command.
SEGMENTS = 16
#: Shares of the largest flow at which the recorded branches are compared.
LEVELS = tuple(level / 100 for level in range(5, 100))
#: Share of command over whose end the width is carried on to full command.
LAST = 0.05


def with_play(compensator: Compensator) -> Compensator:
    """Return a compensator with a transition whose drive takes out the recorded hysteresis of its valve."""
    signals = compensator.signals
    longest = max(signals.command.span(sign) for sign in signals.signs)
    step = 1 << (-(-(longest + 1) // SEGMENTS) - 1).bit_length()
    nodes = [play_nodes(compensator, sign, step) if sign in signals.signs else () for sign in (1, -1)]
    if not all(any(nodes[0 if sign > 0 else 1]) for sign in signals.signs):
        raise InputError(
            "the opening threshold does not lie above the certified offset at every pressure, so no hysteresis can be "
            "taken out; leave out --hysteresis play"
        )
    functions = replace(
        compensator.drive_functions,
        play_counts=(nodes[0], nodes[1]),
        play_step_codes=step,
        play_codes=PLAY_CODES,
        play_noise_codes=compensator.command_error.noise_codes,
    )
    return replace(compensator, drive_functions=functions)


def play_nodes(compensator: Compensator, sign: int, step: int) -> tuple[int, ...]:
    """Return the hysteresis, the median a side's tests, at commands `step` codes apart, counts.

    It is never wider than what the transition spans: that would drive a falling command below the certified offset.
    """
    curves = [curve for curve in _recorded_widths(compensator, sign) if len(curve) > 1]
    if not curves:
        raise InputError(
            "--hysteresis play needs the valve's hysteresis, of which no test has both branches; record the falling "
            "branch too, or leave it out"
        )
    span = compensator.signals.command.span(sign)
    at = np.arange(span // step + 2) * step / span
    widths = np.median([_width_at(at, np.array(curve)) for curve in curves], axis=0)
    counts = np.round(widths / float(compensator.u_max_V) * compensator.signals.compare_max)
    return tuple(int(value) for value in np.clip(counts, 0, narrowest_transition(compensator, sign)))


def _recorded_widths(compensator: Compensator, sign: int) -> Iterator[list[tuple[float, float]]]:
    """Yield for each test the command of the law, a share, and how far the recorded branches lie apart there, V."""
    for test in compensator.valve.sides[SIDE_NAMES[sign]].tests:
        if test.u_knee_rising_V is None or test.u_knee_falling_V is None:
            continue
        opening, closing = test.recorded.opening, test.recorded.closing
        corners = corners_of(compensator, round(compensator.signals.dp_code(Fraction(repr(test.dp_MPa)))), sign)
        found = []
        for level in LEVELS:
            up, down = (each.command_at(level * test.recorded.q_max_L_min) for each in (opening, closing))
            if up is not None and down is not None:
                found.append((corners.command_at(up / float(compensator.u_max_V)), up - down))
        rising = [place for place, (left, right) in enumerate(pairwise(found)) if left[0] < right[0] < 1]
        yield [found[place] for place in rising]


def _width_at(share: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Return the width at commands from its (share, V): held below them, and carried on above as over their end."""
    known, width = curve.T
    near = known >= known[-1] - LAST
    slope = np.polyfit(known[near], width[near], 1)[0] if near.sum() > 1 else 0.0
    beyond = np.maximum(width[-1] + slope * (share - known[-1]), 0.0)
    widths: np.ndarray = np.where(share > known[-1], beyond, np.interp(share, known, width))
    return widths


def narrowest_transition(compensator: Compensator, sign: int) -> int:
    """Return the least distance of the opening law from the certified offset, counts: all pressures, rounded down."""
    law = compensator.side(sign)
    gap = min(upper - lower for upper, lower in zip(law.law_beta, law.beta, strict=True))
    return int(Fraction(gap, compensator.beta_denominator) * law.u_min0_over_u_max * compensator.signals.compare_max)
