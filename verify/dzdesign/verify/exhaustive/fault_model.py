"""What a drive remembers of the faults of its inputs, from what is asked of it: no code of the generated C.

A fault acts from its first sample on. It is over with the declared number of sound samples in a row, the last of which
is used again. Where faults are latched, the declared number of faulty samples, with no such row between them, stays.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

from dzdesign.design.compensator import Compensator

#: Bits of the drive's status.
WAITING, HELD, LATCHED = 32, 64, 128
#: Up to so many samples of debounce every state is tried; beyond that those about the ends.
EVERY_UP_TO = 40
#: Sound and faulty samples that are remembered of the command, then of the pressures.
Memory = tuple[int, int, int, int]


@dataclass
class FaultMemory:
    """The memory of one channel: the command, or the pressures together."""

    #: Declared: samples of debounce, and whether faults are latched.
    needed: int
    latches: bool
    #: Sound samples in a row up to now, no more than needed; and faulty ones since the channel was last used.
    sound: int
    faulty: int = 0

    @property
    def usable(self) -> bool:
        """Whether the channel is used."""
        return self.sound == self.needed

    @property
    def is_latched(self) -> bool:
        """Whether only a reset helps."""
        return self.latches and self.faulty == self.needed

    def take(self, *, fault: bool, unwanted: bool = False) -> None:
        """Take a sample; one that is sound but `unwanted` is not a fault, and ends a row of sound ones like one."""
        if fault and self.latches and self.faulty < self.needed:
            self.faulty += 1
        if fault or unwanted or self.is_latched:
            self.sound = 0
        elif self.sound < self.needed:
            self.sound += 1
        if self.usable:
            self.faulty = 0


def command_counts_as_zero(compensator: Compensator, away: int) -> bool:
    """Tell whether the interlock takes a command, in codes from zero, for zero command; of one sign below zero too."""
    codes = compensator.drive_functions.interlock_codes
    distance = abs(away) if len(compensator.signals.signs) == 2 else away
    return codes is None or distance <= codes


def memories(compensator: Compensator) -> Iterator[tuple[int, int]]:
    """Yield what a channel may remember, (sound, faulty): all of it, of a long debounce all about the ends."""
    functions = compensator.drive_functions
    needed = functions.fault_samples
    counts = list(range(needed + 1))
    if needed > EVERY_UP_TO:
        counts = [*range(4), needed // 2, *range(needed - 3, needed + 1)]
    faulty = counts if functions.fault_latch else [0]
    for sound, faults in product(counts, faulty):
        if sound < needed or not faults:  # of a channel that is used no fault is remembered
            yield sound, faults


def tried_commands(compensator: Compensator) -> list[int]:
    """Return codes on either side of every border of the command's machine: valid or not, zero or not."""
    command, codes = compensator.signals.command, compensator.drive_functions.interlock_codes or 0
    low, high = command.valid_codes
    made = {0, low, low - 1, high, high + 1, command.zero_code, command.full_code, compensator.signals.code_max, 65535}
    for sign in (1, -1):
        made |= {command.zero_code + sign * (codes + step) for step in (-1, 0, 1)}
    return sorted(code for code in made if 0 <= code <= 65535)


def tried_pressures(compensator: Compensator) -> list[tuple[int, int]]:
    """Return pairs of pressure codes on either side of every border of the pressures' machine."""
    a, b = compensator.signals.pressure_a, compensator.signals.pressure_b
    middle = (sum(a.valid_codes) // 2, sum(b.valid_codes) // 2)
    made = {middle, (65535, 65535), (0, 0)}
    for place, sensor in enumerate((a, b)):
        low, high = sensor.valid_codes
        for code in (0, low - 1, low, high, high + 1, 65535):
            made.add((code, middle[1]) if place == 0 else (middle[0], code))
    # The plausible difference ends within these codes, whatever the sensors' weights and the side.
    reverse = compensator.reverse_codes
    for sign in compensator.signals.signs:
        for code in range(a.valid_codes[0], a.valid_codes[1] + 1):
            if abs(compensator.signals.difference(code, middle[1], sign) + reverse) <= 1:
                made.add((code, middle[1]))
    return sorted(pair for pair in made if min(pair) >= 0)


def every_memory(compensator: Compensator) -> Iterator[tuple[tuple[int, int, int], Memory]]:
    """Yield samples, (command, pressures), each with the memory that it meets: sound and faulty of both channels.

    Every memory of one channel meets every border of its inputs, the other channel being used, waited for or about to
    be used; after an invalid command the next must wait, so one of each follows it.
    """
    needed, zero = compensator.drive_functions.fault_samples, compensator.signals.command.zero_code
    full = compensator.signals.command.full_code
    others = [(needed, 0), (0, 0), (needed - 1, 0)]
    commands, pressures = tried_commands(compensator), tried_pressures(compensator)
    sound = next(pair for pair in pressures if _is_sound(compensator, pair))
    for (memory, other), code in product(product(memories(compensator), others), commands):
        yield (code, *sound), (*memory, *other)
    for (memory, other), pair in product(product(memories(compensator), others), pressures):
        yield (full, *pair), (*other, *memory)
        yield (zero, *pair), (*other, *memory)


def _is_sound(compensator: Compensator, pair: tuple[int, int]) -> bool:
    signals = compensator.signals
    sensors = (signals.pressure_a, signals.pressure_b)
    valid = all(
        sensor.valid_codes[0] <= code <= sensor.valid_codes[1] for sensor, code in zip(sensors, pair, strict=True)
    )
    return valid and all(signals.difference(*pair, sign) >= 0 for sign in signals.signs[:1])
