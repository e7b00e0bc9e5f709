"""Every input of a program, such as a function block, and what comes of it beside the exact law.

The law comes as straight parts along the command, in whole numbers, for each pressure drop; its outputs are made by
additions alone, of many pressure drops at once. What a block remembers, the driven side, whether the command counts as
zero and good cycles in a row, is followed here from its description. Inputs are arrays that broadcast against each
other.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import partial, reduce
from hashlib import blake2b
from typing import TypeVar

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.exact_drive import HELD, WAITING, FaultMemory
from dzdesign.verify.exhaustive.exact_law import PRESSURES
from dzdesign.verify.outputs.exact_block import ExactBlock

#: Inputs by name -> outputs and what is remembered, by name.
Program = Callable[[Mapping[str, np.ndarray]], Mapping[str, np.ndarray]]
#: What is remembered as a call begins, and whether the block is enabled, by the names of the variables.
State = Mapping[str, np.ndarray]
#: Pressures by the names of their inputs.
Pressures = Mapping[str, np.ndarray]
Piece = TypeVar("Piece")
#: Pressures of a PLC, 0.1 bar, whose differences are tried with every command, and those tried at zero command.
PLC_PRESSURES, PLC_AROUND = (0, 4000), (-300, 4300)
#: Pressure drops whose law is made at once, inputs that a program is given at once, and processors that share them.
PIECE, AT_ONCE, SIDE_BY_SIDE = 256, 1 << 17, min(os.cpu_count() or 1, 4)
#: Pressures that are tried with commands of all sizes: how many pairs, every which command, and the seed.
SAMPLE, STRIDE, SEED = 256, 7, 61131
#: Spreads the pairs of pressures that pressure drops are tried with: 2^16 over the golden ratio.
SPREAD = 40503
ENDS = (-(2**31), 2**31 - 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """What came of a set of inputs."""

    #: Inputs, and calls from all states that each was tried from.
    pairs: int = 0
    calls: int = 0
    wrong: int = 0
    wrong_status: int = 0
    wrong_state: int = 0
    first_wrong: str = ""
    outputs_hash: str = ""

    def and_then(self, other: "Tried") -> "Tried":
        """Return this and what came next."""
        sums = {each.name: getattr(self, each.name) + getattr(other, each.name) for each in fields(self)[:5]}
        digest = blake2b((self.outputs_hash + other.outputs_hash).encode(), digest_size=8).hexdigest()
        return Tried(**sums, first_wrong=self.first_wrong or other.first_wrong, outputs_hash=digest)


class _Law:
    """The exact law of one side over all pressure drops."""

    def __init__(self, exact: ExactBlock) -> None:
        self.exact = exact
        ahead, behind = exact.sensors
        largest = int(self.drop(np.array(ahead.high), np.array(behind.low)))
        self.table = exact.table(range(-exact.reverse, largest + 1))
        self.at_zero = np.clip(self.table[:, 0, 2], 0, exact.compare_limit)

    def drop(self, ahead: np.ndarray, behind: np.ndarray) -> np.ndarray:
        """Return the pressure drop of two pressures, rounded down."""
        (first, second), (of_ahead, of_behind) = self.exact.sensors, self.exact.weights
        weighted = (ahead - first.zero) * of_ahead - (behind - second.zero) * of_behind
        drops: np.ndarray = np.floor_divide(weighted, self.exact.unit)
        return drops

    def rows(self, pressures: Pressures) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the rows of the law that pressures ask for, what the status says of all, and whether any is sound."""
        exact, ends = self.exact, self.exact.numbers
        failed = {name: (each < ends[name].low) | (each > ends[name].high) for name, each in pressures.items()}
        ahead, behind = (np.asarray(pressures[name], np.int64) for name in exact.pair)
        drop, sound = self.drop(ahead, behind), ~(failed[exact.pair[0]] | failed[exact.pair[1]])
        below, above = sound & (drop < -exact.reverse), sound & (drop > exact.tested_to)
        status = sum((PRESSURES[name] * each for name, each in failed.items()), start=8 * below + 16 * above)
        last = len(self.table) - 1
        return np.where(sound & ~below, np.clip(drop + self.exact.reverse, 0, last), last), status, sound

    def outputs(self, rows: np.ndarray) -> np.ndarray:
        """Return the outputs at every command from zero to full, (commands, rows)."""
        found = np.empty((self.exact.span + 1, rows.size), dtype=np.int32)
        for part in self.table[rows].transpose(1, 2, 0):
            first, last, whole, rest, step, step_rest, common = part.copy()
            for command in range(int(first[0]), int(last[0]) + 1):
                np.clip(whole, 0, self.exact.compare_limit, out=found[command], casting="unsafe")
                rest += step_rest
                carried = rest >= common
                rest -= common * carried
                whole += step + carried
        return found

    def pressures(self, drops: range, low: int, high: int) -> tuple[np.ndarray, np.ndarray]:
        """Return two pressures for each drop, valid ones where any make it; none for a drop that none make."""
        (first, second), found = self.exact.sensors, []
        for drop in drops:
            for a_from, a_to, b_from, b_to in ((first.low, first.high, second.low, second.high), (low, high) * 2):
                b = np.arange(b_from, b_to + 1)
                weighted = (b - second.zero) * self.exact.weights[1]
                a = first.zero + drop - np.floor_divide(-weighted, self.exact.unit)
                makes = np.flatnonzero((a >= a_from) & (a <= a_to) & (self.drop(a, b) == drop))
                if makes.size:
                    place = makes[drop * SPREAD % makes.size]
                    found.append((a[place], b[place]))
                    break
        a, b = np.array(found).T
        return a, b


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """Outputs at all commands that are known beforehand."""

    #: Of a side by its place: (commands, pressures), the last column of pressures that can't be right.
    outputs: Mapping[int, np.ndarray]
    #: Column of each of the inputs' pressures; None: they are the columns in their order, those that can't be right are
    #: the only ones that are not used, and each row has one command.
    columns: np.ndarray | None = None

    def at(self, place: int, towards: np.ndarray, held: np.ndarray) -> np.ndarray:
        """Return the outputs of a side at commands towards the driven one, of pressures that are used or `held`."""
        outputs = self.outputs[place]
        last, towards = outputs.shape[1] - 1, np.minimum(towards, len(outputs) - 1)
        if self.columns is None:
            found: np.ndarray = outputs[towards[:, 0], :last]
        else:
            found = outputs[towards, np.where(held, last, self.columns)]
        return found


class EveryPair:
    """A program, ready to be tried; one of a single side that remembers nothing has no states."""

    def __init__(
        self, compensator: Compensator, interface: str, signs: Sequence[int], *, remembers: bool, cycles: int = 0,
        at_once: int = AT_ONCE,
    ) -> None:  # fmt: skip
        self.laws = [_Law(ExactBlock(compensator, sign, interface)) for sign in signs]
        self.both, self.remembers, first = len(signs) == 2, remembers, self.laws[0].exact
        self.exact, self.of_codes = first, interface == "codes"
        #: Inputs, in the order of their names where there are two sides.
        read = [name for law in self.laws for name in law.exact.pair]
        self.inputs = sorted(set(read)) if self.both else read
        self.rests = remembers and first.transition_end > 0
        #: What may be remembered: driven side and whether at rest; a new instance's first.
        sides, rests = (0, 1, -1) if self.both else (1,), (1, 0) if self.rests else (1,)
        self.states = [(side, rest) for side in sides for rest in rests]
        #: Good cycles in a row that end a fault, 0 for a block that judges each by itself; and what counts them.
        self.cycles, self.interlock = cycles, cycles > 0 and first.interlock is not None
        self.three = len(self.inputs) > 2
        of_pressures = [f"valid_{law.exact.side}" for law in self.laws] if self.three else ["valid_pressures"]
        self.counts = ["valid_commands", *of_pressures] if cycles else []
        self.at_once = at_once
        self.low, self.high = (0, first.code_max) if self.of_codes else PLC_PRESSURES

    def first(self) -> dict[str, int | bool]:
        """Return what a new block remembers: with an interlock zero command must be seen first."""
        first: dict[str, int | bool] = {"side": 0} if self.both else {}
        first |= {"at_rest": True} if self.rests else {}
        return first | {name: 0 if name == "valid_commands" and self.interlock else self.cycles for name in self.counts}

    def state(self, side: np.ndarray, rest: np.ndarray) -> dict[str, np.ndarray]:
        """Return a state of an enabled block that remembers no fault."""
        state = {"side": side} if self.both else {}
        state |= {"at_rest": rest == 1} if self.rests else {}
        state |= {"enable": np.array(True)} if self.interlock else {}
        return state | {name: np.array(self.cycles) for name in self.counts}

    def every_command(self, program: Program, place: int, drops: range | None = None) -> Tried:
        """Try every command of one side at every difference of pressures, or at some."""
        law = self.laws[place]
        ends = [abs(int(law.drop(np.array(x), np.array(y)))) + 1
                for x, y in ((self.low, self.high), (self.high, self.low))]  # fmt: skip
        reach = max(ends) if self.of_codes else self.high
        first, second = law.pressures(range(-reach, reach + 1) if drops is None else drops, self.low, self.high)
        commands = np.arange(self.exact.commands[0], self.exact.commands[1] + 1)
        return self._swept(program, law, commands, first, second)

    def every_pressure(self, program: Program, step: int = 1) -> list[Tried]:
        """Try every pair of a side's pressures at zero command, and a sample of them at commands of all sizes."""
        low, high = (self.low, self.high) if self.of_codes else PLC_AROUND
        b, found = np.arange(low, high + 1), []
        for side, rest in self.states:
            stride = step if rest else 17 * step
            rows = max(self.at_once // b.size, 1)
            of_a = np.arange(low, high + 1, stride)
            pieces = [of_a[begin : begin + rows, None] for begin in range(0, of_a.size, rows)]
            state, law = self.state(np.array(side), np.array(rest)), self.laws[-1 if side < 0 else 0]
            found.append(self._all(partial(self._at_zero_command, program, law, b, state), pieces))
        random = np.random.default_rng(SEED)
        commands = np.arange(self.exact.commands[0], self.exact.commands[1] + 1, STRIDE)
        sample = random.integers(low, high + 1, (2, SAMPLE))
        spaces = len({frozenset(law.exact.pair) for law in self.laws})
        at_zero = replace(reduce(Tried.and_then, found), pairs=spaces * found[0].pairs)
        return [at_zero, *(self._swept(program, law, commands, *sample) for law in self.laws)]

    def _at_zero_command(self, program: Program, law: _Law, b: np.ndarray, state: State, a: np.ndarray) -> Tried:
        return self.judged(program, np.array(self.exact.command_zero), self.with_other(law, a, b), state)

    def with_other(self, law: _Law, ahead: np.ndarray, behind: np.ndarray) -> Pressures:
        """Return a side's pressures, and beside them any of the input that it does not read, if there is one."""
        known = dict(zip(law.exact.pair, (ahead, behind), strict=True))
        any_of = self.low + (SPREAD * behind + 257 * ahead) % (self.high - self.low + 1)
        return {name: known.get(name, any_of) for name in self.inputs}

    def extremes(self, program: Program) -> Tried:
        """Try the ends of what is valid and of the inputs' type, in all combinations and from every state."""
        first = self.exact
        ends = ENDS if self.remembers else (0, 65535)
        low, high = first.commands
        commands = [first.command_zero, *(each for each in (*ends, low - 1, high + 1) if not low <= each <= high)]
        pressures = [
            [*ends, 0, *(end + off for end in (sensor.low, sensor.high) for off in (-1, 0, 1))]
            for sensor in (first.numbers[name] for name in self.inputs)
        ]
        grid = np.array(np.meshgrid(commands, *pressures)).reshape(1 + len(pressures), -1)
        grid = grid[:, (grid >= ends[0]).all(axis=0)]
        given = dict(zip(self.inputs, grid[1:], strict=True))
        each = [self.judged(program, grid[0], given, self.state(np.array(side), np.array(rest)))
                for side, rest in self.states]  # fmt: skip
        return reduce(Tried.and_then, each)

    def at_zero(self, program: Program, place: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the outputs at zero command with one side driven."""
        sign, given = self.laws[place].exact.sign, self.with_other(self.laws[place], a, b)
        state = self.state(np.array(sign), np.array(1))
        found = program(self.given(np.array(self.exact.command_zero), given, state))
        return np.broadcast_to(found["output_b" if self.both and sign < 0 else "output_a"], a.shape)

    def _swept(self, program: Program, law: _Law, commands: np.ndarray, a: np.ndarray, b: np.ndarray) -> Tried:
        """Try commands of one side at pairs of pressures: near zero from every state, elsewhere from one in turn."""
        towards = law.exact.along * (commands - self.exact.command_zero)
        if self.both:
            commands, towards = commands[towards >= 0], towards[towards >= 0]
        near = commands[np.abs(towards) <= law.exact.leave_zero + 1] if len(self.states) > 1 else commands[:0]
        command = np.concatenate([commands, np.repeat(near, len(self.states))])
        states = np.resize(np.array(self.states), (command.size, 2))
        states[commands.size :] = np.tile(self.states, (near.size, 1))
        pieces = [slice(begin, begin + PIECE) for begin in range(0, a.size, PIECE)]

        def tried(piece: slice) -> Tried:
            given, found = self.with_other(law, a[piece], b[piece]), Tried()
            known = Known(outputs={self.laws.index(law): self.outputs(law, given)})
            rows = max(self.at_once // a[piece].size, 1)
            for begin in range(0, command.size, rows):
                some = slice(begin, begin + rows)
                state = self.state(states[some, :1], states[some, 1:])
                found = found.and_then(self.judged(program, command[some, None], given, state, known))
            return found

        return replace(self._all(tried, pieces), pairs=commands.size * a.size)

    @staticmethod
    def _all(work: Callable[[Piece], Tried], pieces: Sequence[Piece]) -> Tried:
        """Do pieces of some work side by side, and add up what they found, in their order."""
        with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
            found = list(pool.map(work, pieces))
        return reduce(Tried.and_then, found)

    @staticmethod
    def outputs(law: _Law, pressures: Pressures) -> np.ndarray:
        """Return the outputs of a side at every command and some pressures, last of those that can't be right."""
        return law.outputs(np.append(law.rows(pressures)[0], len(law.table) - 1))

    @staticmethod
    def given(command: np.ndarray, pressures: Pressures, state: State) -> dict[str, np.ndarray]:
        """Return the inputs of a program, by the names of its variables."""
        given = {"command": command, **{f"pressure_{name.lower()}": each for name, each in pressures.items()}, **state}
        return {name: each if each.dtype == bool else each.astype(np.int64) for name, each in given.items()}

    def judged(
        self, program: Program, command: np.ndarray, pressures: Pressures, state: State, known: Known | None = None
    ) -> Tried:
        """Give a program some inputs, and compare all that it gives."""
        found = program(self.given(command, pressures, state))
        expected = self.expected(command, pressures, state, known)
        return self.compared(found, expected, command, pressures)

    def compared(
        self, found: Mapping[str, np.ndarray], expected: Mapping[str, np.ndarray], command: np.ndarray,
        pressures: Pressures,
    ) -> Tried:  # fmt: skip
        """Compare what a program gave with what it must give."""
        shape = np.broadcast_shapes(command.shape, *(each.shape for each in pressures.values()))
        names = ["output_a", "output_b"][: len(self.laws)]
        differs = {name: np.broadcast_to(found[name] != expected[name], shape) for name in expected if name in found}
        wrong, first = np.logical_or.reduce([differs[name] for name in names]), ""
        if name := next((name for name, each in differs.items() if each.any()), ""):
            at = np.unravel_index(int(differs[name].argmax()), shape)
            all_of = (command, found[name], expected[name], *pressures.values())
            asked, gave, must, *told = [int(np.broadcast_to(each, shape)[at]) for each in all_of]
            first = f"command {asked}, pressures {' and '.join(map(str, told))}: {name} {gave}, expected {must}"
        digest = blake2b(digest_size=8)
        for name in names:
            digest.update(np.ascontiguousarray(np.broadcast_to(found[name], shape), dtype="<i4").tobytes())
        counts = {name: int(each.sum()) for name, each in differs.items()}
        return Tried(
            pairs=wrong.size,
            calls=wrong.size,
            wrong=int(wrong.sum()),
            wrong_status=counts["status"] + counts.get("beta", 0),
            wrong_state=sum(counts.get(name, 0) for name in ("side", "at_rest", *self.counts)),
            first_wrong=first,
            outputs_hash=digest.hexdigest(),
        )

    def expected(
        self, command: np.ndarray, pressures: Pressures, state: State, known: Known | None
    ) -> dict[str, np.ndarray]:
        """Return what a program must give; without `known` only zero command can be asked for."""
        first, last = self.laws[0].exact, self.laws[-1].exact
        sound = (command >= first.commands[0]) & (command <= first.commands[1])
        asked = first.along * (command - first.command_zero)
        followed, counts = self._followed(sound, asked, state) if self.cycles else (sound, {})
        away = np.where(followed, asked, 0)
        expected: dict[str, np.ndarray] = {}
        negative = np.zeros_like(followed)
        if self.both:
            side = np.where(away > first.leave_zero, 1, np.where(-away > last.leave_zero, -1, state["side"]))
            expected["side"] = np.where(followed, side, 0)
            negative = expected["side"] < 0
        towards = np.clip(np.where(negative, -away, away), 0, np.where(negative, last.span, first.span))
        if self.rests:
            zero_band = np.where(negative, last.zero_band, first.zero_band)
            leave_zero = np.where(negative, last.leave_zero, first.leave_zero)
            expected["at_rest"] = (towards <= zero_band) | (state["at_rest"] & (towards <= leave_zero))
            towards = np.where(expected["at_rest"], 0, towards)
        driven = followed & ((expected["side"] != 0) if self.both else True)
        rows, statuses, sounds = zip(*(law.rows(pressures) for law in self.laws), strict=True)
        held = [row == len(law.table) - 1 for row, law in zip(rows, self.laws, strict=True)]
        status = np.where(negative, statuses[-1], statuses[0]) + ~sound
        if self.cycles:
            held, of_pressures = self._held(held, [~each for each in sounds], negative, state)
            counts |= of_pressures
            status = status + WAITING * ~followed + HELD * np.where(negative, held[-1], held[0])
        for place, law in enumerate(self.laws):
            if known is not None and place in known.outputs:
                value = known.at(place, towards, held[place])
            else:
                value = np.where(towards == 0, law.at_zero[np.where(held[place], -1, rows[place])], -1)  # never asked
            mine = driven & (negative == (law.exact.sign < 0)) if self.both else driven
            expected["output_b" if place else "output_a"] = np.where(mine, value, 0)
        return expected | counts | {"status": status, "beta": self.laws[0].exact.shown_betas[rows[0]]}

    def _followed(
        self, sound: np.ndarray, asked: np.ndarray, state: State
    ) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return whether a command is followed, and the count of good ones: the drive's memory of the command."""
        memory, unwanted = FaultMemory(self.cycles, False, state["valid_commands"]), np.array(False)
        ends = [law.exact.interlock for law in self.laws]
        if self.interlock and ends[0] is not None and ends[-1] is not None:
            zero = (asked <= ends[0]) & ((-asked <= ends[-1]) if self.both else True)
            unwanted = ~state["enable"] | (~zero & ~memory.usable)
        memory.take(fault=~sound, unwanted=unwanted)
        return memory.usable, {"valid_commands": memory.sound}

    def _held(
        self, failed: Sequence[np.ndarray], unsound: Sequence[np.ndarray], negative: np.ndarray, state: State
    ) -> tuple[list[np.ndarray], dict[str, np.ndarray]]:
        """Return whether each side's pressures are not used, and their counts: the drive's memory of the pressures."""
        faults = [np.where(negative, failed[-1], failed[0])]
        if self.three:  # of the side that is not driven only the sensors count
            drives = (~negative, negative)
            faults = [np.where(own, *each) for own, each in zip(drives, zip(failed, unsound, strict=True), strict=True)]
        memories = [FaultMemory(self.cycles, False, state[name]) for name in self.counts[1:]]
        for memory, fault in zip(memories, faults, strict=True):
            memory.take(fault=fault)
        held = [~memories[min(place, len(memories) - 1)].usable for place in range(len(self.laws))]
        return held, {name: memory.sound for name, memory in zip(self.counts[1:], memories, strict=True)}
