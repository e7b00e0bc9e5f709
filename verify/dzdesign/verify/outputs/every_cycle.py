"""A function block that counts cycles, tried from every count, and over long sequences of cycles.

Each call is compared with the drive's memory of faults, which `every_pair` follows for each input. Counts multiply the
states, so they are tried at the borders of the inputs alone; the law at all inputs is tried with no fault remembered.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from dzdesign.verify.outputs.every_pair import ENDS, SEED, EveryPair, Known, Program, Tried
from dzdesign.verify.requirements import DEBOUNCE, Check

#: Up to so many combinations of counts are all tried; of more, each count at all its values up to so many of these.
MOST_COMBINATIONS, MOST_VALUES = 700, 100
#: Sequences side by side; cycles of each, in debounce times, and their limits.
SEQUENCES, DEBOUNCE_TIMES, FEWEST_CYCLES, MOST_CYCLES = 192, 10, 1500, 6000
#: Sound pressures that sequences take, beside those at the borders.
SOUND_PRESSURES = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Inputs at the borders of what is valid and of what the interlock takes for zero."""

    commands: np.ndarray
    #: By the name of its input; all of one length.
    pressures: Mapping[str, np.ndarray]


def check_cycles(program: Program, every: EveryPair) -> Check:
    """Try a block from every count, and over sequences of cycles from a new instance on."""
    grid = _grid(every)
    counts, tried = _counts(every)
    from_counts = _from_counts(program, every, grid, counts)
    in_sequence, cycles, returns = _in_sequences(program, every, grid)
    found = from_counts.and_then(in_sequence)
    wrong = found.wrong + found.wrong_status + found.wrong_state
    first = f" ({found.first_wrong})" if found.first_wrong else ""
    text = (
        f"{from_counts.calls} calls at the borders of the inputs from {tried}; {SEQUENCES} random sequences of "
        f"{cycles} cycles, in which a command is followed again {returns} times (seed {SEED}); {wrong} wrong{first}"
    )
    return DEBOUNCE.check(holds=wrong == 0, text=text)


def _counts(every: EveryPair) -> tuple[list[tuple[int, ...]], str]:
    """Return the combinations of counts that are tried, and say which these are."""
    cycles, number = every.cycles, len(every.counts)
    if (cycles + 1) ** number <= MOST_COMBINATIONS:
        return list(product(range(cycles + 1), repeat=number)), f"all counts of 0 to {cycles}"
    values, told = list(range(cycles + 1)), f"each count of 0 to {cycles}"
    if cycles > MOST_VALUES:
        values = [0, 1, 2, cycles // 2, cycles - 2, cycles - 1, cycles]
        told = f"{', '.join(map(str, values))} of each count"
    others = (0, cycles - 1, cycles)
    found = {each for place in range(number)
             for each in product(*(values if i == place else others for i in range(number)))}  # fmt: skip
    return sorted(found), f"{told}, the others at {', '.join(map(str, others))}"


def _grid(every: EveryPair) -> Grid:
    first = every.exact
    low, high = first.commands
    offsets = [0, *ENDS, low - 1, low, high, high + 1]
    borders = {first.command_zero, *offsets}
    for law in every.laws:
        exact = law.exact
        for away in (exact.interlock or 0, exact.zero_band, exact.leave_zero, exact.transition_end, exact.span):
            borders |= {first.command_zero + exact.along * (away + step) for step in (-1, 0, 1)}
    zeros = {name: each.zero for name, each in first.numbers.items() if name in every.inputs}
    tried = [zeros]
    for name in zeros:
        sensor = first.numbers[name]
        ends = (*ENDS, sensor.low - 1, sensor.low, sensor.high, sensor.high + 1)
        tried += [zeros | {name: end} for end in ends]
    for law in every.laws:
        ahead, behind = law.exact.pair
        numbers = np.arange(law.exact.sensors[1].low, law.exact.sensors[1].high + 1)
        drops = law.drop(np.array(zeros[ahead]), numbers)
        for drop in (-law.exact.reverse, -law.exact.reverse - 1):
            tried += [zeros | {behind: int(each)} for each in numbers[drops == drop][:1]]
    pressures = {name: np.array([each[name] for each in tried]) for name in every.inputs}
    return Grid(commands=np.array(sorted(borders)), pressures=pressures)


def _outputs(every: EveryPair, pressures: Mapping[str, np.ndarray]) -> dict[int, np.ndarray]:
    return {place: every.outputs(law, pressures) for place, law in enumerate(every.laws)}


def _from_counts(program: Program, every: EveryPair, grid: Grid, counts: Sequence[tuple[int, ...]]) -> Tried:
    """Try combinations of counts, with each side, rest and enable, at every command and pressure of a grid."""
    size = next(iter(grid.pressures.values())).size
    known, found = Known(outputs=_outputs(every, grid.pressures), columns=np.arange(size)), Tried()
    enables = (True, False) if every.interlock else (True,)
    rows = np.array([(*state, enable, *each) for state, enable, each in product(every.states, enables, counts)])
    at_once = max(every.at_once // (grid.commands.size * size), 1)
    for begin in range(0, len(rows), at_once):
        some = np.repeat(rows[begin : begin + at_once], grid.commands.size, axis=0)
        command = np.tile(grid.commands, some.shape[0] // grid.commands.size)[:, None]
        side, rest, enable, *of_counts = some.T[:, :, None]
        state = every.state(side, rest) | dict(zip(every.counts, of_counts, strict=True))
        state |= {"enable": enable == 1} if every.interlock else {}
        found = found.and_then(every.judged(program, command, grid.pressures, state, known))
    return found


class _Held:
    """One kind of value for each sequence, held for some cycles: a few, a debounce time, or longer."""

    def __init__(self, random: np.random.Generator, cycles: int, chances: Sequence[float]) -> None:
        self.random, self.cycles, self.chances = random, cycles, chances
        self.kinds, self.left = np.zeros(SEQUENCES, np.int64), np.zeros(SEQUENCES, np.int64)

    def next(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the kind of each sequence's value, and whether it is a new one."""
        new = self.left == 0
        lengths = self.random.choice([1, 2, self.cycles, self.cycles + 1, 0], SEQUENCES)
        longer = self.random.integers(1, 3 * self.cycles + 10, SEQUENCES)
        self.left = np.where(new, np.where(lengths > 0, lengths, longer), self.left) - 1
        kinds = self.random.choice(len(self.chances), SEQUENCES, p=self.chances)
        self.kinds = np.where(new, kinds, self.kinds)
        return self.kinds, new


def _in_sequences(program: Program, every: EveryPair, grid: Grid) -> tuple[Tried, int, int]:
    """Try sequences of cycles from a new block on, its own state and the model's going on by themselves.

    Returns what was found, the cycles of each sequence, and how often a command is followed again.
    """
    random = np.random.default_rng(SEED)
    cycles = min(max(DEBOUNCE_TIMES * every.cycles, FEWEST_CYCLES), MOST_CYCLES)
    pools = {}
    for name, values in grid.pressures.items():
        sensor = every.exact.numbers[name]
        pools[name] = np.append(random.integers(sensor.low, sensor.high + 1, SOUND_PRESSURES), values)
    size = next(iter(pools.values())).size
    commands, pressures = _Held(random, every.cycles, (0.5, 0.3, 0.2)), _Held(random, every.cycles, (0.6, 0.4))
    enabled = _Held(random, every.cycles, (0.9, 0.1))
    low, high = every.exact.commands
    command, columns = np.zeros(SEQUENCES, np.int64), np.zeros(SEQUENCES, np.int64)
    outputs = _outputs(every, pools)
    first = {name: np.full(SEQUENCES, value) for name, value in every.first().items()}
    own, model = first, first
    found, returns, followed = Tried(), 0, np.ones(SEQUENCES, bool)
    for _ in range(cycles):
        kinds, new = commands.next()
        drawn = [np.full(SEQUENCES, every.exact.command_zero), random.integers(low, high + 1, SEQUENCES),
                 random.choice(grid.commands, SEQUENCES)]  # fmt: skip
        command = np.where(new, np.choose(kinds, drawn), command)
        kinds, new = pressures.next()
        drawn = [random.integers(0, SOUND_PRESSURES, SEQUENCES), random.integers(SOUND_PRESSURES, size, SEQUENCES)]
        columns = np.where(new, np.choose(kinds, drawn), columns)
        enable = {"enable": enabled.next()[0] == 0} if every.interlock else {}
        given = {name: values[columns] for name, values in pools.items()}
        gave = program(every.given(command, given, own | enable))
        must = every.expected(command, given, model | enable, Known(outputs=outputs, columns=columns))
        found = found.and_then(every.compared(gave, must, command, given))
        own = {name: np.broadcast_to(gave[name], SEQUENCES) for name in first}
        model = {name: np.broadcast_to(must[name], SEQUENCES) for name in first}
        before, followed = followed, model["valid_commands"] == every.cycles
        returns += int((followed & ~before).sum())
    return found, cycles, returns
