"""A position loop around the compiled firmware and its valve: does it come to rest at a stated gain?

`design` states the largest gain of such a loop from the law in straight parts and a valve of straight flow. Here the
law is the compiled C, with its codes, its rates and its memory. The valve's flow is the recorded one, moved by a spool
with the stated lag. A flow moves the piston as it does for `design`: the flow that a line from the knee, as steep as
the recorded flow, has at full command makes a speed of one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, exp, pi

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import corners_of
from dzdesign.design.position_loop import (
    DECAY,
    LAST,
    PERIODS,
    PLAYS,
    SAME_SAMPLE,
    STARTS,
    Swinging,
    largest_gains,
    rounded_down,
)  # fmt: skip
from dzdesign.verify.closed_loop.loop import PARTS, ClosedLoop
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.closed_loop.stand_in import StandIn, stand_in_of
from dzdesign.verify.requirements import POSITION_LOOP, Check

#: Positive commands, then negative ones.
SIGNS = (1, -1)
#: Share of the gain that `design` states at which a loop is tried where none is given.
KEPT = 0.8


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionLoop:
    """Lag of the valve and delay of the loop, s, and its velocity gain, 1/s; None: `KEPT` of what `design` states."""

    lag_s: float
    delay_s: float
    gain: float | None


def comes_to_rest(asked: PositionLoop, scenes: Sequence[Scene]) -> Check:
    """Let the loop go from several errors, with several plays, at every tested pressure drop.

    Raises
    ------
    InputError
        If the firmware drives one solenoid: it moves a piston one way.
    """
    compensator = scenes[0].compensator
    loops = {scene.sign: scene.loop for scene in scenes}
    if len(loops) == 1:
        raise InputError(
            "--position-loop is for a firmware of two solenoids: a command of one sign moves a piston one way; leave "
            "it out, or design with a command of both signs"
        )
    stated = min(each.gain for each in largest_gains(compensator, asked.lag_s, asked.delay_s))
    gain = KEPT * stated if asked.gain is None else asked.gain
    if not gain:
        return POSITION_LOOP.check(holds=False, text="`design` states that it cycles at any gain")
    tried, cycling = 0, list[tuple[float, float, float]]()
    for dp_MPa in sorted({scene.dp_MPa for scene in scenes}):
        for play, position_s in _released(asked, gain, compensator, loops, dp_MPa):
            tried += 1
            if (swing := _swing(position_s)) is not None:
                cycling.append((gain * swing, dp_MPa, play))
    units = compensator.valve.recorded_units
    limit = f"`design` states rest up to {rounded_down(stated)}/s"
    if not cycling:
        text = f"at {gain:g}/s the piston comes to rest in all {tried} runs; {limit}"
        return POSITION_LOOP.check(holds=True, text=text)
    widest, dp_MPa, play = max(cycling)
    text = (
        f"at {gain:g}/s the piston cycles in {len(cycling)} of {tried} runs, by {widest:.2%} of command at most "
        f"(at {units.text(dp_MPa, '.2f MPa')}, with {play:.0%} of the recorded hysteresis); {limit}"
    )
    return POSITION_LOOP.check(holds=False, text=text)


def _released(
    asked: PositionLoop, gain: float, compensator: Compensator, loops: dict[int, ClosedLoop], dp_MPa: float
) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the share of the recorded hysteresis, and the piston's position at each sample, s: its speed is one."""
    valve, signals = compensator.valve, compensator.signals
    stands = [stand_in_of(valve.side(sign), valve.u_max_V) for sign in SIGNS]
    samples = ceil(PERIODS * 2 * pi / _swinging(asked, compensator, dp_MPa, 1).swing_rad_s * signals.sample_Hz)
    part_s = PWM_PERIOD_S / PARTS
    moves = [part_s / _straight_flow_L_min(asked, compensator, stand, dp_MPa, sign)
             for stand, sign in zip(stands, SIGNS, strict=True)]  # fmt: skip
    for play in PLAYS:
        sides = [stand.with_hysteresis(float(play)) for stand in stands]
        for start in STARTS:
            numbers = [
                float(start) / gain, gain, ceil(asked.delay_s * signals.sample_Hz - SAME_SAMPLE),
                exp(-part_s / asked.lag_s), *moves,
            ]  # fmt: skip
            yield float(play), loops[1].release(loops[-1], sides, samples, numbers, dp_MPa)


def _swinging(asked: PositionLoop, compensator: Compensator, dp_MPa: float, sign: int) -> Swinging:
    """Return the loop as `design` has it, at the test of a side that is nearest to a pressure drop."""
    test = min(compensator.valve.side(sign).tests, key=lambda each: abs((each.dp_MPa or 0.0) - dp_MPa))
    knees = [knee / compensator.valve.u_max_V for knee in (test.u_knee_rising_V, test.u_knee_falling_V) if knee]
    law = corners_of(compensator, compensator.signals.pair(sign).code_at(dp_MPa), sign)
    return Swinging(
        lag_s=asked.lag_s, delay_s=asked.delay_s, sample_Hz=compensator.signals.sample_Hz, law=law,
        opens=max(knees), closes=min(knees),
    )  # fmt: skip


def _straight_flow_L_min(
    asked: PositionLoop, compensator: Compensator, stand: StandIn, dp_MPa: float, sign: int
) -> float:
    """Return the flow at the drive of full command on the line from the knee."""
    loop = _swinging(asked, compensator, dp_MPa, sign)
    test = min(stand.side.tests, key=lambda each: abs((each.dp_MPa or 0.0) - dp_MPa))
    steep = test.slope_L_min_V * (dp_MPa / (test.dp_MPa or dp_MPa)) ** 0.5
    return float(steep * (loop.law.full - loop.opens) * compensator.valve.u_max_V)


def _swing(position_s: np.ndarray) -> float | None:
    """Return by how much a piston still swings, about zero and no less than before; None of one that does not."""
    quarter = int(position_s.size * LAST)
    before, last = position_s[-2 * quarter : -quarter], position_s[-quarter:]
    signs = np.sign(last)[last != 0]
    crossed = int(np.sum(signs[1:] != signs[:-1]))
    swing = float(np.abs(last).max())
    return swing if crossed > 1 and swing > DECAY * float(np.abs(before).max()) else None
