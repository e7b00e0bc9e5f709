"""The compiled drive against its model, tick by tick: outputs and state, over corners and random samples."""

import copy
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import cycle, product, repeat
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.exact_drive import STEP_UNIT, DriveModel
from dzdesign.verify.requirements import DRIVE, Check
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import HOST, PROGRAMS, block_of, bound_files

#: Of programs/drive.c: samples and ticks of each; codes, what is put, states; what was found.
CHECK = Function("dz_check_drive", ("int32_t", "int32_t", "in", "in", "in", "both"))
#: Codes of the command and of each pressure.
Codes = tuple[int, ...]
SEED, SAMPLES = 11, 3000
#: A ramp that is not put anywhere; share of the samples before which it is.
STAYS, PUT_SHARE = -(2**31), 0.04
#: A command that no converter gives.
INVALID = 65535
#: The dragged point of a play is put as a number from this on; beyond the transition so far apart are the commands.
PLAYED_SHIFTED, PLAYED_STRIDE = 8192, 61
FIELDS = ("compare_a", "compare_b", "status", "law", "side", "ticks", "at_rest", "rising", "played", "ramped")
#: And what is remembered of faults: of the pressures, with a third one, for each side.
MEMORIES = {2: ("commands", "pressures"), 3: ("commands", "pressures[0]", "pressures[1]")}
#: Up to so many samples of debounce every state is tried; beyond that those about the ends.
EVERY_UP_TO = 40
#: Sound and faulty samples that are remembered of each channel: the command, then the pressures.
Memory = tuple[int, ...]
#: Most samples at zero command in a row among the random ones, for an interlock that waits for them.
MOST_AT_ZERO = 60


class Sample(NamedTuple):
    """Codes of a sample, and what is put before it: the ramp's place, a `state_word` and the memory of faults."""

    codes: Codes
    place: int = STAYS
    word: int = STAYS
    memory: Memory | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveCheck:
    """What running the drive beside its model found."""

    ticks: int
    faults: int
    first_wrong: str | None


def drive_samples(compensator: Compensator, seed: int, count: int) -> list[Codes]:
    """Return codes of random samples, corners, steps from end to end, and noise about zero, one after the other."""
    rng = np.random.default_rng(seed)
    signals = compensator.signals
    zero, window = signals.command.zero_code, max(compensator.drive_functions.leave_zero_codes, 4)
    low, high = signals.command.valid_codes
    corners = [0, low, high, signals.code_max, signals.code_max + 1, 65535, zero, signals.command.full_code]
    corners += [max(zero + sign * (window + step), 0) for sign in (1, -1) for step in (-1, 0, 1)]
    valid_pressures = [sensor.valid_codes for sensor in signals.pressures.values()]
    middle = [sum(codes) // 2 for codes in valid_pressures]
    at_zero = [(zero, *middle)] * min(compensator.drive_functions.fault_samples, MOST_AT_ZERO)
    made: list[Codes] = list(at_zero)
    while len(made) < count:
        kind = int(rng.integers(7))
        length = int(rng.integers(1, 900 if kind == 5 else 60))
        held, corner = int(rng.integers(low, high + 1)), int(rng.choice(corners))
        for _ in range(length):
            near = min(max(held + int(rng.integers(-3, 4)), low), high)
            about_zero = max(zero + int(rng.integers(-2 * window, 2 * window + 1)), 0)
            anything = int(rng.integers(0, 65536)) if rng.random() < 0.02 else int(rng.integers(low, high + 1))
            end = held if held % 2 else (low, high)[held // 2 % 2]
            command = (anything, int(rng.choice(corners)), held, about_zero, near, end, corner)[kind]
            sound = rng.random() < 0.9
            pressures = [int(rng.integers(least, most + 1)) for least, most in valid_pressures]
            if not sound:
                pressures = [int(code) for code in rng.choice([0, 700, 4014, 4095, 4096, 65535], len(pressures))]
            made.append((command, *pressures))
        if rng.random() < 0.7:
            made += at_zero
    return made[:count]


def ramp_places(compensator: Compensator, seed: int, count: int) -> list[int]:
    """Return where the ramp is put before each sample, in codes over `STEP_UNIT`; `STAYS` where it goes on by itself.

    A slow ramp would need minutes of samples from end to end. Its state is one number, so it is put anywhere.
    """
    rng = np.random.default_rng([seed, 1])
    functions, signals = compensator.drive_functions, compensator.signals
    if not any(functions.ramp_up + functions.ramp_down):
        return [STAYS] * count
    high = signals.command.span(1)
    low = -signals.command.span(-1) if len(signals.signs) == 2 else 0
    ends = (low * STEP_UNIT, high * STEP_UNIT)

    def place() -> int:
        return int(rng.choice(ends) if rng.random() < 0.2 else rng.integers(*ends))

    return [place() if rng.random() < PUT_SHARE else STAYS for _ in range(count)]


def every_state(compensator: Compensator, used: Memory) -> list[Sample]:
    """Return every valid command from every state of rest and side, both channels being `used`.

    The ramp is put where the command is, so that it does not hold it back. After a command that is not valid the drive
    must be at rest, so one is tried from each state too, and a command between the ends of the zero band behind it.
    With a play every command of the zero band and the transition, and some beyond, come from every direction of travel,
    the dragged point wherever the noise may leave it.
    """
    command, functions = compensator.signals.command, compensator.drive_functions
    bipolar = len(compensator.signals.signs) == 2
    if not compensator.zero_band_codes and not bipolar:
        return []
    low, high = command.valid_codes
    between = command.zero_code + command.direction(1) * (compensator.zero_band_codes + 1)
    whole = functions.play_codes if functions.has_play else 0
    asked = []
    for side, rest in product((-1, 0, 1) if bipolar else (1,), (0, 1) if compensator.zero_band_codes else (0,)):
        word = state_word(side, rest, whole)
        asked += [(code, word) for code in (*range(low, high + 1), INVALID)] + [(between, STAYS)]
        if not functions.has_play or not side or rest:
            continue
        strays = functions.play_noise_codes + 1
        end = compensator.transition_end + strays
        places = {*range(end), *range(end, command.span(side), PLAYED_STRIDE), command.span(side)}
        for away, rising, stray in product(sorted(places), range(whole + 1), (-strays, 0, strays)):
            played = max(away + stray, 0)
            code = command.zero_code + command.direction(side) * away
            asked.append((code, state_word(side, rest, rising, played)))
    return [_with_pressures(compensator, code, word, index, used) for index, (code, word) in enumerate(asked)]


def _with_pressures(compensator: Compensator, code: int, word: int, index: int, used: Memory) -> Sample:
    """Return a command with valid pressures, ever others, and the ramp's place beside the state."""
    signals, functions = compensator.signals, compensator.drive_functions
    ends = [sensor.valid_codes for sensor in signals.pressures.values()]
    pressures = [
        low + index * stride % (high - low + 1) for (low, high), stride in zip(ends, (1001, 619, 787), strict=False)
    ]
    away = signals.command.direction(1) * (code - signals.command.zero_code)
    place = away if len(signals.signs) == 2 else max(away, 0)
    ramped = functions.has_ramp and code != INVALID
    return Sample((code, *pressures), place * STEP_UNIT if ramped else STAYS, word, None if word == STAYS else used)


def state_word(side: int, rest: int, rising: int = 0, played: int = 0) -> int:
    """Return a driven side, -1 to 1, whether the drive is at rest, and the play's travel and point in one number."""
    return rest | side + 1 << 1 | rising << 3 | played + PLAYED_SHIFTED << 9


def state_of(word: int) -> tuple[int, int, bool, int]:
    """Return the travel, the side, whether at rest and the point of a `state_word`."""
    return word >> 3 & 63, (word >> 1 & 3) - 1, bool(word & 1), (word >> 9) - PLAYED_SHIFTED


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


def tried_pressures(compensator: Compensator) -> list[tuple[int, ...]]:
    """Return codes of the pressures on either side of every border of the pressures' machine."""
    sensors = compensator.signals.pressures
    middle = {name: sum(sensor.valid_codes) // 2 for name, sensor in sensors.items()}
    made = {tuple(middle.values()), (65535,) * len(sensors), (0,) * len(sensors)}
    for name, sensor in sensors.items():
        low, high = sensor.valid_codes
        for code in (0, low - 1, low, high, high + 1, 65535):
            made.add(tuple((middle | {name: code}).values()))
    # The plausible difference ends within these codes, whatever the sensors' weights and the side.
    reverse = compensator.reverse_codes
    for sign in compensator.signals.signs:
        pair = compensator.signals.pair(sign)
        ahead, behind = pair.names
        for code in range(pair.ahead.valid_codes[0], pair.ahead.valid_codes[1] + 1):
            if abs(pair.difference(code, middle[behind]) + reverse) <= 1:
                made.add(tuple((middle | {ahead: code}).values()))
    return sorted(codes for codes in made if min(codes) >= 0)


def every_memory(compensator: Compensator) -> Iterator[Sample]:
    """Yield samples, each with the memory that it meets.

    Every memory of one channel meets every border of its inputs, the other channel being used, waited for or about to
    be used; after an invalid command the next must wait, so one of each follows it.
    """
    signals, needed = compensator.signals, compensator.drive_functions.fault_samples
    others, word = [(needed, 0), (0, 0), (needed - 1, 0)], state_word(signals.signs[-1], 0)
    commands, pressures = tried_commands(compensator), tried_pressures(compensator)
    sound = next(codes for codes in pressures if _is_sound(compensator, codes))
    # With a third pressure both sides' memories by turns, and of the other one by turns what the channels may hold.
    idle = cycle(others) if len(signals.pressures) > 2 else repeat(())
    for (memory, other), code in product(product(memories(compensator), others), commands):
        yield Sample((code, *sound), word=word, memory=(*memory, *other, *next(idle)))
    for (memory, other), codes in product(product(memories(compensator), others), pressures):
        for command in (signals.command.full_code, signals.command.zero_code):
            yield Sample((command, *codes), word=word, memory=(*other, *memory, *next(idle)))
            if len(signals.pressures) > 2:
                yield Sample((command, *codes), word=word, memory=(*other, *next(idle), *memory))


def _is_sound(compensator: Compensator, codes: tuple[int, ...]) -> bool:
    signals = compensator.signals
    sound = dict(zip(signals.pressures, codes, strict=True))
    valid = all(
        sensor.valid_codes[0] <= code <= sensor.valid_codes[1]
        for sensor, code in zip(signals.pressures.values(), codes, strict=True)
    )
    pair = signals.pair(1)
    return valid and pair.difference(*(sound[name] for name in pair.names)) >= 0


class PreparedDrive:
    """Samples, and what the model says after every tick."""

    def __init__(self, compensator: Compensator, seed: int = SEED, count: int = SAMPLES) -> None:
        signals, needed = compensator.signals, compensator.drive_functions.fault_samples
        used = (needed, 0) * len(MEMORIES[len(signals.pressures)])
        drawn = zip(drive_samples(compensator, seed, count), ramp_places(compensator, seed, count), strict=True)
        states_put, memories_put = every_state(compensator, used), list(every_memory(compensator))
        samples = [*(Sample(*each) for each in drawn), *states_put, *memories_put]
        self.samples = [each.codes for each in samples]
        #: How many of the samples are taken from a state that was put: every command, from each; and of how many the
        #: memory of faults is.
        self.put, self.memories = len(states_put), len(memories_put)
        self.ticks_per_sample = signals.tick_Hz // signals.sample_Hz
        model = DriveModel(compensator)
        states = [model.state]
        for each in (None, *samples):  # some PWM periods go by before the first sample
            if each:
                _put(model, each)
                model.sample(*each.codes)
            for _ in range(self.ticks_per_sample):
                model.tick()
                states.append(model.state)
        self.codes, self.states = np.array(self.samples, dtype="<u2"), np.array(states, dtype="<i4")
        #: What is put before each sample, as programs/drive.c has it.
        nothing = (STAYS,) * len(used)
        self.puts = np.array([(each.place, each.word, *(each.memory or nothing)) for each in samples], dtype="<i4")
        names = MEMORIES[len(signals.pressures)]
        self.fields = (*FIELDS, *(f"{kind}_{name}" for kind in ("valid", "faulty") for name in names))


def _put(model: DriveModel, sample: Sample) -> None:
    """Put the model into the state that a sample begins with."""
    if sample.place != STAYS:
        model.position = Fraction(sample.place, STEP_UNIT)
    if sample.word != STAYS:
        model.rising, model.side, model.at_rest, model.played = state_of(sample.word)
    if sample.memory:
        channels = (model.commands, *model.pressures.values())
        for channel, sound, faulty in zip(channels, sample.memory[::2], sample.memory[1::2], strict=False):
            channel.sound, channel.faulty = sound, faulty


class CompiledDrive:
    """The drive and the law's sides, compiled as they stand in the firmware."""

    def __init__(self, folder: Path) -> None:
        self.sources = {path.name: path.read_bytes() for path in sorted((folder / "core").glob("*.[ch]"))}
        self._bound = {name: text.encode() for name, text in bound_files(block_of(folder)).items()}

    def edited(self, name: str, text: bytes) -> "CompiledDrive":
        """Return the drive with another text in one of its files."""
        other = copy.copy(self)
        other.sources = {**self.sources, name: text}
        return other

    def objects(self) -> list[Path]:
        """Return the objects, each compiled by itself."""
        sources = {**self._bound, **self.sources}
        headers = {name: text for name, text in sources.items() if name.endswith(".h")}
        return [
            HOST.compile(name, {**headers, name: text}, HOST.core_flags, f"the firmware's {name}")
            for name, text in sources.items()
            if name.endswith(".c")
        ]

    def check(self, prepared: PreparedDrive) -> DriveCheck:
        """Run the drive beside its model; a drive that does not compile, crashes or hangs is a `RequirementError`."""
        main = {name: text for name, text in {**self._bound, **self.sources}.items() if name.endswith(".h")}
        main["drive.c"] = (PROGRAMS / "drive.c").read_bytes()
        objects = [*self.objects(), HOST.compile("drive.c", main, HOST.check_flags, "the check of the drive")]
        found = np.zeros(4, dtype="<i4")
        CompiledLibrary({}, [CHECK], "the drive", objects=objects).call(
            CHECK.name, len(prepared.samples), prepared.ticks_per_sample, prepared.codes, prepared.puts,
            prepared.states, found,
        )  # fmt: skip
        ticks, wrong, tick, field = found.tolist()
        words = None
        if wrong:
            sample = (tick - 1) // prepared.ticks_per_sample - 1
            when = f"sample {sample} with codes {prepared.samples[sample]}" if sample >= 0 else "before any sample"
            words = f"{prepared.fields[field]} after {tick} PWM periods, {when}"
        return DriveCheck(ticks=ticks, faults=wrong, first_wrong=words)


def drive_follows(folder: Path, compensator: Compensator) -> Check:
    """Tell whether the drive around the law does what its model in rational numbers does."""
    prepared = PreparedDrive(compensator)
    try:
        found = CompiledDrive(folder).check(prepared)
    except RequirementError as error:
        return DRIVE.check(holds=False, text=str(error))
    text = f"outputs and state compared after each of {found.ticks} PWM periods: {len(prepared.samples)} samples of "
    text += f"corner values, steps, noise and random codes (seed {SEED})"
    text += f", {prepared.put} of them for every valid command from every rest and side state" if prepared.put else ""
    text += f", {prepared.memories} for the limits of the inputs from every fault state"
    text += f"; {found.faults} wrong"
    text += f" ({found.first_wrong})" if found.faults else ""
    return DRIVE.check(holds=found.faults == 0, text=text)
