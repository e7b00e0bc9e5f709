"""Does a position loop around the valve hunt? The largest gain at which it comes to rest, with this law on this valve.

A proportional controller reads the position at each sample of the drive; its command reaches the law a delay later. The
law's drive moves the spool with a lag of first order, the spool has play, and beyond the overlap its flow moves a
piston:

    e = -x,  u = K e (limited to full command),  spool s' = (drive(u) - s)/lag,  play p follows s within the width,
    x' = (|p| - overlap)+ sign(p), over the flow at full command

K is the velocity gain, 1/s: how fast the piston moves for an error of position, over that error, along an ideal line.
Between two samples the drive is constant, so spool, play and flow are known in closed form: the map from one sample to
the next is exact, and piecewise affine in the states but for the instant at which an edge opens or closes. An offset
that lies above the threshold cycles at any gain: about zero the valve is never shut.
"""

from dataclasses import dataclass, replace
from functools import cache
from math import atan, ceil, floor, hypot, inf, log10, pi

import numpy as np
from scipy.optimize import brentq

from dzdesign.design.compensator import Compensator, LargestGain
from dzdesign.design.costs_at_tests import LawCorners, corners_of
from dzdesign.design.design_choices import LOOP, read_position_loop

#: Commands from which the loop is let go, over full; and shares of the recorded hysteresis that small cycles may have.
STARTS = np.array([0.01, 0.03, 0.1, 0.3, 1.0])
PLAYS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
#: Gains that are tried, over that at which a linear loop swings; then the first that cycles is refined.
GAINS = np.geomspace(0.05, 4.0, 40)
REFINED = 12
#: Periods of the linear loop's swing that are looked at, and of them the share at the end in which a loop must rest.
PERIODS, LAST = 40, 0.25
#: A loop whose swing falls by less in a quarter of the time is said to cycle.
DECAY = 0.98
#: Of a sample: a delay that is a whole number of them but for its last bits is not one more.
SAME_SAMPLE = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Swinging:
    """A loop to be let go: lag and delay in s, samples a second, the law at one pressure drop and the valve's knees.

    Drives and commands are shares of full.
    """

    lag_s: float
    delay_s: float
    sample_Hz: float
    law: LawCorners
    opens: float
    closes: float

    @property
    def linear_gain(self) -> float:
        """The velocity gain at which the loop with an ideal line would swing, 1/s."""
        return self.swing_rad_s * hypot(1.0, self.swing_rad_s * self.lag_s)

    @property
    def late_s(self) -> float:
        """Delay of the command, s; one that is held until the next is half a sample late."""
        return self.delay_s + 0.5 / self.sample_Hz

    @property
    def swing_rad_s(self) -> float:
        """Rate at which a linear loop swings: lag and delay take the quarter of a turn that the piston leaves."""
        quarter = pi / 2
        rate = brentq(lambda rate: atan(rate * self.lag_s) + rate * self.late_s - quarter, 0, quarter / self.late_s)
        return float(rate)

    def rests(self, gains: np.ndarray) -> np.ndarray:
        """Tell of each velocity gain, (N,), whether the loop comes to rest from every start and with every play."""
        gain = gains[:, None, None]
        width = (PLAYS * max(self.opens - self.closes, 0.0))[None, None, :]
        gain, start, width = np.broadcast_arrays(gain, STARTS[None, :, None], width)
        loop = _Loop(self, gain, start / gain, width)
        steps = ceil(PERIODS * 2 * pi / self.swing_rad_s * self.sample_Hz)
        before, last = np.zeros(gain.shape), np.zeros(gain.shape)
        crossed, was = np.zeros(gain.shape, dtype=int), np.ones(gain.shape)
        for step in range(steps):
            loop.step()
            if step >= steps * (1 - LAST):
                np.maximum(last, np.abs(loop.x), out=last)
                now = np.sign(loop.x)
                crossed += now == -was
                was = np.where(now == 0, was, now)
            elif step >= steps * (1 - 2 * LAST):
                np.maximum(before, np.abs(loop.x), out=before)
                was = np.sign(loop.x)
        cycles = (crossed > 1) & (last > DECAY * before)
        return np.asarray(~cycles.any(axis=(1, 2)))


class _Loop:
    """Many loops side by side, each with its gain, start and play; one call of `step` is one sample."""

    def __init__(self, of: Swinging, gain: np.ndarray, x: np.ndarray, width: np.ndarray) -> None:
        self.of, self.gain, self.x, self.width = of, gain, x, width
        self.spool, self.play, self.side = np.zeros(x.shape), np.zeros(x.shape), np.ones(x.shape)
        late = max(round(of.delay_s * of.sample_Hz), 0)
        self._past = [x] * (late + 1)
        self._overlap = of.opens - width / 2
        self._span_s = 1 / of.sample_Hz
        self._kept = float(np.exp(-self._span_s / of.lag_s))

    def _drive(self) -> np.ndarray:
        """Return the drive of the command that arrives now, signed; about zero the last side keeps its offset."""
        law = self.of.law
        command = np.clip(self.gain * self._past[0], -1, 1)
        sign = np.sign(command)
        self.side = np.where((sign != self.side) & (np.abs(command) > law.leaves), sign, self.side)
        along = np.where(sign == self.side, np.abs(command), 0.0)
        corners = np.array([law.zero_band, max(law.end, law.zero_band + 1e-12), 1.0])
        drives = np.array([law.offset, law.at_end if law.end else law.offset, law.full])
        signed: np.ndarray = self.side * np.interp(along, corners, drives)
        return signed

    def step(self) -> None:
        """Advance by a sample."""
        drive = self._drive()
        # By symmetry every spool is seen to rise.
        way = np.where(drive >= self.spool, 1.0, -1.0)
        begins, aims, play = way * self.spool, way * drive, way * self.play
        low, high = begins - self.width / 2, aims - self.width / 2
        overlap = self._overlap
        ahead = np.maximum(play - overlap, 0) * self._span_s + self._above(low, high, np.maximum(overlap, play))
        behind = self._above(-low, -high, overlap) - self._above(-low, -high, np.maximum(overlap, -play))
        ends = aims + (begins - aims) * self._kept
        self.spool, self.play = way * ends, way * np.maximum(play, ends - self.width / 2)
        flow: np.ndarray = way * (ahead - behind) / (self.of.law.full - self.of.opens)
        self.x = self.x - flow
        self._past = [*self._past[1:], self.x]

    def _above(self, begins: np.ndarray, aims: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Return the area over a sample by which an exponential from `begins` towards `aims` lies above a level."""
        lag = self.of.lag_s
        first, aim = begins - level, aims - level
        last = aim + (first - aim) * self._kept
        whole = aim * self._span_s + (first - aim) * lag * (1 - self._kept)
        crosses = (first > 0) != (last > 0)
        ratio = np.where(crosses, (first - aim) / np.where(crosses, -aim, 1.0), 1.0)
        until = aim * lag * np.log(ratio) + (first - aim) * lag * (1 - 1 / ratio)
        area: np.ndarray = np.where(crosses, np.where(first > 0, until, whole - until), np.where(last > 0, whole, 0.0))
        return area


@cache
def largest_gain(loop: Swinging, most: float = inf) -> float:
    """Return the largest velocity gain up to which the loop comes to rest, 1/s; 0 if it never does.

    Of a loop that comes to rest up to `most` it is no less than that.
    """
    tried = GAINS * loop.linear_gain
    tried = tried[: np.searchsorted(tried, most) + 1]
    rests = loop.rests(tried)
    if rests.all():
        return float(tried[-1])
    first = int(np.argmin(rests))
    if first == 0:
        return 0.0
    finer = np.geomspace(tried[first - 1], tried[first], REFINED)
    return float(finer[max(int(np.argmin([*loop.rests(finer[1:-1]), False])), 0)])


def largest_gains(compensator: Compensator, lag_s: float, delay_s: float) -> tuple[LargestGain, ...]:
    """Return the largest gain of each side: the least of its tests.

    What the interrupt writes counts from the next PWM period on, and a command waits for a sample: the delay is
    rounded up to whole samples.
    """
    found, signals = [], compensator.signals
    late_s = ceil((delay_s + 1 / signals.tick_Hz) * signals.sample_Hz - SAME_SAMPLE) / signals.sample_Hz
    for sign in compensator.signals.signs:
        gains: list[tuple[float, float, float]] = []
        for test in compensator.valve.side(sign).tests:
            opens, closes = test.u_knee_rising_V, test.u_knee_falling_V
            if opens is None and closes is None:
                continue
            knees = [knee / float(compensator.u_max_V) for knee in (opens, closes) if knee is not None]
            law = corners_of(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign)
            loop = Swinging(
                lag_s=lag_s, delay_s=late_s, sample_Hz=signals.sample_Hz, law=law,
                opens=max(knees), closes=min(knees),
            )  # fmt: skip
            least = min((gain for gain, *_ in gains), default=inf)
            gains.append((largest_gain(loop, least), test.dp_MPa or 0.0, loop.linear_gain))
        if gains:
            gain, dp_MPa, linear = min(gains)
            found.append(LargestGain(side=compensator.valve.side_name(sign), dp_MPa=dp_MPa, gain=gain, linear=linear))
    return tuple(found)


def with_largest_gains(compensator: Compensator) -> Compensator:
    """Return a compensator with the largest gain of each side in it, for the loop that its options state."""
    return replace(compensator, position_loop=largest_gains(compensator, *_loop_of(compensator)))


def _loop_of(compensator: Compensator) -> tuple[float, float]:
    """Return lag and delay of the loop that the options of a compensator state, s."""
    options = compensator.options or {}
    return read_position_loop(options.get("position_loop") or LOOP, "--position-loop")[:2]


def in_words(compensator: Compensator) -> list[str]:
    """Return what the largest gains are, a line each; nothing of a valve without a knee."""
    lag_s, delay_s = _loop_of(compensator)
    gains = compensator.position_loop
    if gains is None:  # a lot's setting, which is no design of one valve
        gains = largest_gains(compensator, lag_s, delay_s)
    units = compensator.valve.recorded_units
    lines = []
    for each in gains:
        at = units.text(each.dp_MPa, ".2f MPa")
        lines.append(
            f"position loop (P) around the {each.side} side, lag {1e3 * lag_s:g} ms, delay {1e3 * delay_s:g} ms: it "
            f"comes to rest up to a velocity gain of {rounded_down(each.gain)}/s (a valve without dead zone: "
            f"{rounded_down(each.linear)}/s), at {at}, with any play up to the recorded hysteresis"
        )
    return lines


def rounded_down(gain: float) -> str:
    """Return a number with two digits, rounded to the safe side."""
    if gain <= 0:
        return "0"
    step = 10.0 ** (floor(log10(gain)) - 1)
    return f"{floor(gain / step) * step:g}"
