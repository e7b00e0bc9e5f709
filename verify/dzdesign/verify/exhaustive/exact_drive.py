"""What the firmware's drive must do, in rational numbers from the compensator: no code of the generated C.

Written from what the drive functions are asked for, not from the template: the command is a position in codes that the
ramps hold back, it counts as zero until it leaves the zero band, the side changes where it does so on the other side,
the dither is a square wave about the law. A fault of an input acts from its first sample on, and is over with the
declared number of sound samples in a row, the last of which is used again. Where faults are latched, the declared
number of faulty samples, with no such row between them, stays.

Each side has the two pressures of its own edge. With a third pressure these differ, and each side has a memory of its
own: of the side that is driven what is wrong with its pressures and their difference counts, of the other one only
whether each of its pressures is a sound signal.
"""

from dataclasses import dataclass, field
from fractions import Fraction
from math import floor
from typing import Any

from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.exact_law import PRESSURES

#: Seconds and steps of a ramp are held as codes over this.
STEP_UNIT = 65536
#: Bits of the drive's status.
WAITING, HELD, LATCHED = 32, 64, 128


@dataclass
class FaultMemory:
    """The memory of one channel, the command or the pressures together: numbers, or arrays of many drives."""

    #: Declared: samples of debounce, and whether faults are latched.
    needed: int
    latches: bool
    #: Sound samples in a row up to now, no more than needed; and faulty ones since the channel was last used.
    sound: Any
    faulty: Any = 0

    @property
    def usable(self) -> Any:
        """Whether the channel is used."""
        return self.sound == self.needed

    @property
    def is_latched(self) -> Any:
        """Whether only a reset helps."""
        return self.latches & (self.faulty == self.needed)

    def take(self, *, fault: Any, unwanted: Any = False) -> None:
        """Take a sample; one that is sound but `unwanted` is not a fault, and ends a row of sound ones like one."""
        self.faulty = self.faulty + (fault & self.latches & (self.faulty < self.needed))
        ended = fault | unwanted | self.is_latched
        self.sound = (self.sound + (self.sound < self.needed)) * (1 - ended)
        self.faulty = self.faulty * (1 - self.usable)


def command_counts_as_zero(compensator: Compensator, away: int) -> bool:
    """Tell whether the interlock takes a command, in codes from zero, for zero command; of one sign below zero too."""
    codes = compensator.drive_functions.interlock_codes
    distance = abs(away) if len(compensator.signals.signs) == 2 else away
    return codes is None or distance <= codes


@dataclass
class DriveModel:
    """One drive: state, and what it puts out after each tick."""

    compensator: Compensator
    compare_a: int = 0
    compare_b: int = 0
    status: int = 0
    #: The law's compare value.
    law: int = 0
    #: The driven side: 1, -1; 0: neither.
    side: int = 0
    #: The place in the dither's wave.
    tick_of_wave: int = 0
    #: Whether the command counts as zero.
    at_rest: bool = False
    #: Of the play: the command without its noise, in codes from zero, and how far it counts as rising.
    played: int = 0
    rising: int = 0
    #: Command after the ramps, in codes from zero; positive commands above zero.
    position: Fraction = field(default_factory=Fraction)

    def __post_init__(self) -> None:
        self.both = len(self.compensator.signals.signs) == 2
        self.has_rest = self.compensator.zero_band_codes > 0
        self.side, self.at_rest = 0 if self.both else 1, self.has_rest
        functions = self.compensator.drive_functions
        needed, latches = functions.fault_samples, functions.fault_latch
        #: What is remembered of the faults of the command and of the pressures: with an interlock a reset is one.
        self.commands = FaultMemory(needed, latches, needed if functions.interlock_codes is None else 0)
        both = FaultMemory(needed, latches, needed)
        signals = self.compensator.signals
        three = signals.pressure_c is not None
        self.pairs = {sign: signals.pair(sign) for sign in signals.signs}
        #: Of each side the last whole difference of codes that stands for no more than its last test.
        self.last_drop = {
            sign: floor(self.compensator.side(sign).certificate.dp_MPa[1] / pair.ahead.per_code_MPa)
            for sign, pair in self.pairs.items()
        }
        self.pressures = {1: both, -1: FaultMemory(needed, latches, needed) if three else both}
        self._turn_at_zero()

    def sample(self, command: int, *pressures: int) -> None:
        """Take new codes, of the command and of each pressure."""
        self._codes = dict(zip(PRESSURES, pressures, strict=False))
        signals, functions = self.compensator.signals, self.compensator.drive_functions
        low, high = signals.command.valid_codes
        away = signals.command.direction(1) * (command - signals.command.zero_code)
        early = not self.commands.usable and not command_counts_as_zero(self.compensator, away)
        self.commands.take(fault=not low <= command <= high, unwanted=early)
        if not self.commands.usable:
            self._watch(command, 1)
            self.law, self.side, self.position = 0, 0 if self.both else 1, Fraction(0)
            self.at_rest = self.has_rest
            self._turn_at_zero()
            return
        if any(functions.ramp_up + functions.ramp_down):
            self._ramp(away)
            away = int(self.position)  # towards zero: never more command than the ramp has reached
        driven = self.side
        if self.both and abs(away) > functions.leave_zero_codes:
            self.side = 1 if away > 0 else -1
        if self.has_rest:
            away = self._past_rest(away)
        if self.at_rest or self.side != driven:
            self._turn_at_zero()
        code = signals.command.zero_code + signals.command.direction(1) * away
        self._watch(command, self.side or 1)
        self.law = self._law(code) if self.side else 0
        if functions.has_play and self.side and not self.at_rest:
            self.law = max(self.law - floor(self._lowered_by_play(away * self.side)), 0)

    def _turn_at_zero(self) -> None:
        """Forget the travel: from zero command on, what comes is a rise."""
        functions = self.compensator.drive_functions
        self.played, self.rising = 0, functions.play_codes if functions.has_play else 0

    def _lowered_by_play(self, towards: int) -> Fraction:
        """Return by how many counts the law is lowered, for a command of so many codes towards full.

        The play operator drags a point along that stays within the noise's peak of the command; its travel, held to the
        play's codes, says how far the command rises. Of the valve's hysteresis, whole counts of it straight
        between the nodes, a falling command takes the share of the transition that lies behind it.
        """
        functions, compensator = self.compensator.drive_functions, self.compensator
        before = self.played
        if abs(towards - self.played) > functions.play_noise_codes:
            self.played = towards - functions.play_noise_codes * (1 if towards > self.played else -1)
        self.rising = min(max(self.rising + self.played - before, 0), functions.play_codes)
        nodes = functions.play_counts[0 if self.side > 0 else 1]
        place = Fraction(min(max(towards, 0), compensator.signals.command.span(self.side)), functions.play_step_codes)
        left, right = nodes[floor(place)], nodes[floor(place) + 1]
        width = floor(left + (right - left) * (place - floor(place)))
        past = min(max(towards - compensator.zero_band_codes, 0), compensator.transition_codes)
        falling = Fraction(functions.play_codes - self.rising, functions.play_codes)
        return width * falling * Fraction(past, compensator.transition_codes)

    def _past_rest(self, away: int) -> int:
        """Return the command that counts: it leaves its rest beyond the band's outer end, and comes back at its inner.

        Driven to the other side, or not yet to any, a command is nearer to rest than any code of the band.
        """
        towards = away * (self.side or 1)
        if towards > self.compensator.drive_functions.leave_zero_codes:
            self.at_rest = False
        if towards <= self.compensator.zero_band_codes:
            self.at_rest = True
        return 0 if self.at_rest else away

    def _ramp(self, asked: int) -> None:
        """Move towards what is asked, within the step of the side and the direction, and stop at zero on the way."""
        functions = self.compensator.drive_functions
        goal = Fraction(asked)
        if self.position * goal < 0:
            goal = Fraction(0)
        negative = self.position < 0 or (self.position == 0 and goal < 0)
        if not self.both:
            goal, negative = max(goal, Fraction(0)), False
        limits = functions.ramp_up if abs(goal) > abs(self.position) else functions.ramp_down
        step = Fraction(limits[int(negative)], STEP_UNIT)
        way = goal - self.position
        if step and abs(way) > step:
            way = step if way > 0 else -step
        self.position += way

    def _watch(self, command: int, sign: int) -> None:
        """Take the pressures' part of a sample, and say what is wrong with all of it."""
        low, high = self.compensator.signals.command.valid_codes
        own, other = self.pressures[sign], self.pressures[-sign]
        unsound = self._unsound(sign)
        reversed_, above = (False, False) if unsound else self._drop_is_odd(sign)
        own.take(fault=bool(unsound) or reversed_)
        if other is not own:
            idle = self._unsound(-sign)
            other.take(fault=bool(idle))
            unsound |= idle
        latched = self.commands.is_latched or own.is_latched
        waits, held = not self.commands.usable, not own.usable
        self.status = (not low <= command <= high) + sum(PRESSURES[name] for name in unsound) + 8 * reversed_
        self.status += 16 * above + WAITING * waits + HELD * held + LATCHED * latched

    def _unsound(self, sign: int) -> set[str]:
        """Return the pressures of a side whose codes no sound signal makes."""
        signals = self.compensator.signals
        ends = {name: signals.pressures[name].valid_codes for name in self.pairs[sign].names}
        return {name for name, (low, high) in ends.items() if not low <= self._codes[name] <= high}

    def _drop(self, sign: int) -> int:
        """Return the pressure drop of a side, in codes."""
        pair = self.pairs[sign]
        return pair.difference(*(self._codes[name] for name in pair.names))

    def _drop_is_odd(self, sign: int) -> tuple[bool, bool]:
        """Tell whether the drop of sound pressures is too far below zero, and whether it lies above the tests."""
        drop = self._drop(sign)
        return drop < -self.compensator.reverse_codes, drop > self.last_drop[sign]

    def _law(self, code: int) -> int:
        failed = -self.compensator.reverse_codes - 1
        usable = self.pressures[self.side].usable and not self._unsound(self.side)
        return self.compensator.compare(code, self._drop(self.side) if usable else failed, self.side)

    def tick(self) -> None:
        """Go one PWM period on."""
        functions = self.compensator.drive_functions
        compare = self.law
        if functions.dither_counts:
            self.tick_of_wave = (self.tick_of_wave + 1) % (2 * functions.dither_ticks)
            if compare:
                up = self.tick_of_wave < functions.dither_ticks
                compare += functions.dither_counts if up else -functions.dither_counts
        compare = min(max(compare, 0), functions.compare_limit)
        self.compare_a, self.compare_b = (compare, 0) if self.side > 0 else (0, compare if self.side < 0 else 0)

    @property
    def outputs(self) -> tuple[int, int, int]:
        """Compare values of both solenoids and the status word."""
        return self.compare_a, self.compare_b, self.status

    @property
    def state(self) -> tuple[int, ...]:
        """Everything that `struct dz_drive` holds, in its order."""
        ramped = self.position * STEP_UNIT
        play = (self.rising, self.played)
        pressures = list({id(each): each for each in self.pressures.values()}.values())
        faults = (self.commands.sound, *(each.sound for each in pressures))
        faults += (self.commands.faulty, *(each.faulty for each in pressures))
        return (*self.outputs, self.law, self.side, self.tick_of_wave, int(self.at_rest), *play, int(ramped), *faults)
