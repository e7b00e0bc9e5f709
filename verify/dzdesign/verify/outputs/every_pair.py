"""Every input of a program, such as a function block, and what comes of it beside the exact law.

The law comes as straight parts along the command, in whole numbers, for each pressure drop; its outputs are made by
additions alone, of many pressure drops at once. What a block remembers, the driven side and whether the command counts
as zero, is followed here from its description. Commands and pressures are arrays that broadcast against each other.
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
from dzdesign.verify.exhaustive.exact_law import PRESSURES
from dzdesign.verify.outputs.exact_block import ExactBlock

#: Inputs by name -> outputs and what is remembered, by name.
Program = Callable[[Mapping[str, np.ndarray]], Mapping[str, np.ndarray]]
#: The driven side and whether the command counts as zero, as a call begins.
State = tuple[np.ndarray, np.ndarray]
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

    def rows(self, pressures: Pressures) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows of the law that pressures ask for, and what the status says of all of them."""
        exact, ends = self.exact, self.exact.numbers
        failed = {name: (each < ends[name].low) | (each > ends[name].high) for name, each in pressures.items()}
        ahead, behind = (np.asarray(pressures[name], np.int64) for name in exact.pair)
        drop, sound = self.drop(ahead, behind), ~(failed[exact.pair[0]] | failed[exact.pair[1]])
        below, above = sound & (drop < -exact.reverse), sound & (drop > exact.tested_to)
        status = sum((PRESSURES[name] * each for name, each in failed.items()), start=8 * below + 16 * above)
        last = len(self.table) - 1
        return np.where(sound & ~below, np.clip(drop + self.exact.reverse, 0, last), last), status

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


#: Outputs of one side at all commands that are known beforehand, (commands, pressures).
Known = tuple[_Law, np.ndarray] | None


class EveryPair:
    """A program, ready to be tried; one of a single side that remembers nothing has no states."""

    def __init__(
        self, compensator: Compensator, interface: str, signs: Sequence[int], *, remembers: bool, at_once: int = AT_ONCE
    ) -> None:
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
        self.at_once = at_once
        self.low, self.high = (0, first.code_max) if self.of_codes else PLC_PRESSURES

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
            state, law = (np.array(side), np.array(rest == 1)), self.laws[-1 if side < 0 else 0]
            found.append(self._all(partial(self._at_zero_command, program, law, b, state), pieces))
        random = np.random.default_rng(SEED)
        commands = np.arange(self.exact.commands[0], self.exact.commands[1] + 1, STRIDE)
        sample = random.integers(low, high + 1, (2, SAMPLE))
        spaces = len({frozenset(law.exact.pair) for law in self.laws})
        at_zero = replace(reduce(Tried.and_then, found), pairs=spaces * found[0].pairs)
        return [at_zero, *(self._swept(program, law, commands, *sample) for law in self.laws)]

    def _at_zero_command(self, program: Program, law: _Law, b: np.ndarray, state: State, a: np.ndarray) -> Tried:
        return self._judged(program, np.array(self.exact.command_zero), self.with_other(law, a, b), state)

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
        each = [self._judged(program, grid[0], given, (np.array(side), np.array(rest == 1)))
                for side, rest in self.states]  # fmt: skip
        return reduce(Tried.and_then, each)

    def at_zero(self, program: Program, place: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the outputs at zero command with one side driven."""
        sign, given = self.laws[place].exact.sign, self.with_other(self.laws[place], a, b)
        found = program(self._given(np.array(self.exact.command_zero), given, (np.array(sign), np.array(True))))
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
            known = law.outputs(law.rows(given)[0])
            rows = max(self.at_once // a[piece].size, 1)
            for begin in range(0, command.size, rows):
                some = slice(begin, begin + rows)
                state = (states[some, :1], states[some, 1:] == 1)
                found = found.and_then(self._judged(program, command[some, None], given, state, (law, known)))
            return found

        return replace(self._all(tried, pieces), pairs=commands.size * a.size)

    @staticmethod
    def _all(work: Callable[[Piece], Tried], pieces: Sequence[Piece]) -> Tried:
        """Do pieces of some work side by side, and add up what they found, in their order."""
        with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
            found = list(pool.map(work, pieces))
        return reduce(Tried.and_then, found)

    def _given(self, command: np.ndarray, pressures: Pressures, state: State) -> dict[str, np.ndarray]:
        given = {"command": command, **{f"pressure_{name.lower()}": each for name, each in pressures.items()}}
        given |= {"side": state[0]} if self.both else {}
        given = {name: each.astype(np.int64) for name, each in given.items()}
        return given | ({"at_rest": state[1]} if self.rests else {})

    def _judged(
        self, program: Program, command: np.ndarray, pressures: Pressures, state: State, known: Known = None
    ) -> Tried:
        """Give a program some inputs, and compare all that it gives."""
        found, expected = (
            program(self._given(command, pressures, state)),
            self._expected(command, pressures, state, known),
        )
        shape = np.broadcast_shapes(command.shape, *(each.shape for each in pressures.values()))
        names = ["output_a", "output_b"][: len(self.laws)]
        differs = {name: np.broadcast_to(found[name] != expected[name], shape) for name in expected if name in found}
        wrong, first = np.logical_or.reduce([differs[name] for name in names]), ""
        if wrong.any():
            at = np.unravel_index(int(wrong.argmax()), shape)
            name = next(name for name in names if differs[name][at])
            all_of = (command, found[name], expected[name], *pressures.values())
            asked, gave, must, *told = [int(np.broadcast_to(each, shape)[at]) for each in all_of]
            first = f"command {asked}, pressures {' and '.join(map(str, told))}: {gave}, expected {must}"
        digest = blake2b(digest_size=8)
        for name in names:
            digest.update(np.ascontiguousarray(np.broadcast_to(found[name], shape), dtype="<i4").tobytes())
        counts = {name: int(each.sum()) for name, each in differs.items()}
        return Tried(
            pairs=wrong.size,
            calls=wrong.size,
            wrong=int(wrong.sum()),
            wrong_status=counts["status"] + counts.get("beta", 0),
            wrong_state=counts.get("side", 0) + counts.get("at_rest", 0),
            first_wrong=first,
            outputs_hash=digest.hexdigest(),
        )

    def _expected(self, command: np.ndarray, pressures: Pressures, state: State, known: Known) -> dict[str, np.ndarray]:
        """Return what a program must give; without `known` only zero command can be asked for."""
        side, rest = state
        first, last = self.laws[0].exact, self.laws[-1].exact
        sound = (command >= first.commands[0]) & (command <= first.commands[1])
        away = np.where(sound, first.along * (command - first.command_zero), 0)
        if self.both:
            side = np.where(away > first.leave_zero, 1, np.where(-away > last.leave_zero, -1, side))
            side = np.where(sound, side, 0)
        negative = (side < 0) if self.both else np.zeros_like(sound)
        towards = np.clip(np.where(negative, -away, away), 0, np.where(negative, last.span, first.span))
        if self.rests:
            zero_band = np.where(negative, last.zero_band, first.zero_band)
            leave_zero = np.where(negative, last.leave_zero, first.leave_zero)
            rest = (towards <= zero_band) | (rest & (towards <= leave_zero))
            towards = np.where(rest, 0, towards)
        driven = sound & (side != 0)
        outputs, statuses, betas = [], [], []
        for law in self.laws:
            rows, status = law.rows(pressures)
            if known is not None and known[0] is law:
                value = known[1][towards[:, 0]]
            else:
                value = np.where(towards == 0, law.at_zero[rows], -1)  # never asked for
            mine = driven & (negative == (law.exact.sign < 0)) if self.both else driven
            outputs.append(np.where(mine, value, 0))
            statuses.append(status)
            betas.append(law.exact.shown_betas[rows])
        status = np.where(negative, statuses[-1], statuses[0]) + ~sound
        expected = {"output_a": outputs[0], "status": status, "beta": betas[0]}
        expected |= {"output_b": outputs[1], "side": side} if self.both else {}
        return expected | ({"at_rest": rest} if self.rests else {})
