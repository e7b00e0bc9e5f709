"""Every input of a function block, tried with its text turned into C, and a sample of them read by NumPy."""

import ctypes
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.verify.structured_text.evaluator import Evaluator
from dzdesign.verify.structured_text.exact_block import ExactBlock, Sensor
from dzdesign.verify.structured_text.syntax import RANGES, FunctionBlock, Kind, Place
from dzdesign.verify.structured_text.to_c import HEADER, block_in_c, place_of
from dzdesign.verify.toolchain.host_compiler import load_library

PROGRAM = Path(__file__).parent / "programs" / "every_pair.c"
#: Pressures of a PLC, 0.1 bar, whose differences are tried with every command, and those tried at zero command.
PLC_PRESSURES, PLC_AROUND = (0, 4000), (-300, 4300)
#: Inputs that NumPy's reading is compared on, and the seed that draws them.
SAMPLE, SEED = 20_000, 61131
#: A piece of the work, in pressure drops or pressures.
PIECE = 64
SIDE_FIELDS = (
    "sign", "along", "span", "zero_band", "has_rest", "leave_zero", "limit", "turn", "reverse", "tested_to",
    "first_drop", "drops",
)  # fmt: skip
RESULT_FIELDS = ("pairs", "calls", "wrong", "wrong_status", "wrong_state")


def _integers(*names: str) -> list[tuple[str, type]]:
    return [(name, ctypes.c_int64) for name in names]


class _Side(ctypes.Structure):
    _fields_ = [*_integers(*SIDE_FIELDS), ("parts", ctypes.c_void_p)]


class _Sensor(ctypes.Structure):
    _fields_ = _integers("low", "high", "zero", "weight")


class _Setup(ctypes.Structure):
    _fields_ = [
        *_integers("sides", "command_zero", "command_low", "command_high", "unit"),
        ("a", _Sensor), ("b", _Sensor), ("side", _Side * 2),
    ]  # fmt: skip


class _Faults(ctypes.Structure):
    _fields_ = _integers("count", "first")


class _Result(ctypes.Structure):
    _fields_ = [
        *_integers(*RESULT_FIELDS), ("faults", _Faults),
        *_integers("command", "pressure_a", "pressure_b", "found", "expected", "hash"),
    ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """What came of a set of inputs."""

    #: Inputs, and calls from all states that each was tried from.
    pairs: int
    calls: int
    wrong: int
    wrong_status: int
    wrong_state: int
    #: Operations whose result is none of their type, and where the first is.
    faults: int
    first_fault: Place | None
    first_wrong: str
    outputs_hash: str


class ExactTables:
    """The exact law of every side over all pressure drops, as what a block is compared with."""

    def __init__(self, compensator: Compensator, interface: str) -> None:
        self.of_codes = interface == "codes"
        self.exact = [ExactBlock(compensator, sign, interface) for sign in compensator.signals.signs]
        self._held: list[np.ndarray] = []
        self.setup = self._setup()

    def _setup(self) -> _Setup:
        first = self.exact[0]
        setup = _Setup(
            sides=len(self.exact), command_zero=first.command_zero, command_low=first.commands[0],
            command_high=first.commands[1], unit=first.unit, a=_sensor(first.sensors[0]), b=_sensor(first.sensors[1]),
        )  # fmt: skip
        for place, exact in enumerate(self.exact):
            drops = range(-exact.reverse, self._largest_drop(exact) + 1)
            table = exact.table(drops)
            self._held.append(table)
            setup.side[place] = _Side(
                sign=exact.sign, along=exact.along, span=exact.span, zero_band=exact.zero_band,
                has_rest=int(exact.transition_end > 0), leave_zero=exact.leave_zero, limit=exact.compare_limit,
                turn=exact.turn, reverse=exact.reverse, tested_to=exact.tested_to, first_drop=drops[0],
                drops=len(drops), parts=table.ctypes.data,
            )  # fmt: skip
        return setup

    def _largest_drop(self, exact: ExactBlock) -> int:
        """Return the largest pressure drop of valid pressures."""
        a, b = exact.sensors
        ends = (a.high, b.low) if exact.turn > 0 else (a.low, b.high)
        return exact.turn * ((ends[0] - a.zero) * a.weight - (ends[1] - b.zero) * b.weight) // exact.unit


class TriedBlock:
    """A function block that is ready to be tried."""

    def __init__(
        self, block: FunctionBlock, kinds: dict[int, Kind], tables: ExactTables, options: Sequence[str] = ()
    ) -> None:
        self.block, self.kinds, self.of_codes = block, kinds, tables.of_codes
        self.tables, self.exact, self.setup = tables, tables.exact, tables.setup
        sources = {HEADER: block_in_c(block, kinds), PROGRAM.name: PROGRAM.read_text(encoding="utf-8")}
        self.library = load_library(sources, "the function block as C", options)

    @property
    def pressures(self) -> tuple[int, int]:
        """Pressures whose differences are tried with every command."""
        return (0, self.exact[0].code_max) if self.of_codes else PLC_PRESSURES

    def every_pair(self, drops: range | None = None) -> list[Tried]:
        """Try every command at every difference of pressures, or only at some of them; one result a side."""
        low, high = self.pressures
        reach = self._reach(low, high) if drops is None else drops

        def of_side(place: int) -> Callable[[int, int, _Result], None]:
            return lambda first, end, result: self.library.every_command(
                ctypes.byref(self.setup), *map(ctypes.c_int64, (place, first, end, low, high)), ctypes.byref(result)
            )

        return [self._tried(of_side(place), reach) for place in range(len(self.exact))]

    def _reach(self, low: int, high: int) -> range:
        """Return the differences that pressures make, of either side."""
        a, b = self.exact[0].sensors
        ends = [
            (x - a.zero) * a.weight - (y - b.zero) * b.weight for x, y in ((low, high), (high, low))
        ]  # fmt: skip
        largest = max(map(abs, ends)) // self.exact[0].unit + 1
        return range(-largest, largest + 1) if self.of_codes else range(-high, high + 1)

    def every_pressure(self, of_a: range | None = None) -> Tried:
        """Try every pair of pressures, valid or not, at zero command; or those of some pressures A."""
        low, high = self.pressures if self.of_codes else PLC_AROUND

        def work(first: int, end: int, result: _Result) -> None:
            self.library.every_pressure(
                ctypes.byref(self.setup), *map(ctypes.c_int64, (first, end, low, high)), ctypes.byref(result)
            )

        return self._tried(work, range(low, high + 1) if of_a is None else of_a)

    def extremes(self) -> Tried:
        """Try the ends of the type and the ends of what is valid, in all combinations."""
        first = self.exact[0]
        ends = RANGES["DINT"]
        commands = [first.command_zero, *ends, *(end + off for end in first.commands for off in (-1, 1))]
        if not self.of_codes:
            commands += [-(2**30), 2**30]
        commands = [each for each in commands if each == first.command_zero or not _within(each, first.commands)]
        pressures = [
            [*ends, 0, *(end + off for end in (sensor.low, sensor.high) for off in (-1, 0, 1))]
            for sensor in first.sensors
        ]
        grid = np.array(np.meshgrid(commands, *pressures), dtype=np.int64).reshape(3, -1).T.copy()

        def work(begin: int, end: int, result: _Result) -> None:
            pointer = grid[begin:end].ctypes.data_as(ctypes.c_void_p)
            self.library.any_inputs(
                ctypes.byref(self.setup), pointer, ctypes.c_int64(end - begin), ctypes.byref(result)
            )

        return self._tried(work, range(len(grid)))

    def _tried(self, work: Callable[[int, int, _Result], None], reach: range) -> Tried:
        """Do pieces of some work side by side, and add up what they found."""
        if reach.step != 1:
            pieces = [(first, first + 1) for first in reach]
        else:
            pieces = [(first, min(first + PIECE, reach.stop)) for first in range(reach.start, reach.stop, PIECE)]

        def one(piece: tuple[int, int]) -> _Result:
            result = _Result(hash=piece[0])
            work(*piece, result)
            return result

        with ThreadPoolExecutor(min(os.cpu_count() or 1, 4)) as pool:
            found = list(pool.map(one, pieces))
        return _sum(found, self.exact[0].sensors)

    def sample_differs(self) -> str:
        """Compare the C with NumPy's reading of the text on random inputs and states; return a difference in words."""
        random, first = np.random.default_rng(SEED), self.exact[0]
        low, high = self.pressures
        commands = random.integers(first.commands[0] - 2, first.commands[1] + 3, SAMPLE)
        commands[: SAMPLE // 4] = random.integers(-2 * first.leave_zero - 3, 2 * first.leave_zero + 4, SAMPLE // 4)
        inputs = np.stack([commands, *random.integers(low - 9, high + 10, (2, SAMPLE))], axis=1)
        states = self.block.of_section("VAR")
        given = np.stack([
            random.integers(-1, 2, SAMPLE) if each.kind == "DINT" else random.integers(0, 2, SAMPLE) for each in states
        ], axis=1) if states else np.zeros((SAMPLE, 0), dtype=np.int64)  # fmt: skip
        names = [each.name.lower() for each in self.block.of_section("VAR_INPUT")]
        evaluator = Evaluator(self.block, self.kinds, SAMPLE)
        columns = zip([*names, *(each.name.lower() for each in states)], np.hstack([inputs, given]).T, strict=True)
        read = evaluator.run(dict(columns))
        outputs, state, faults = self.as_it_is(inputs, given)
        for place, each in enumerate(self.block.of_section("VAR_OUTPUT")):
            if (outputs[:, place] != read[each.name.lower()]).any():
                return f"{each.name} is another one"
        for place, each in enumerate(states):
            if (state[:, place] != read[each.name.lower()]).any():
                return f"{each.name} is another one"
        return "" if (faults == 0) == (evaluator.faults == 0) else f"{faults} faults, and {evaluator.faults}"

    def as_it_is(self, inputs: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Return outputs and states after some inputs, (N, 3), from some states, and how many operations overflow."""
        inputs, states = (np.ascontiguousarray(each, dtype=np.int64).copy() for each in (inputs, states))
        outputs = np.zeros((len(inputs), len(self.block.of_section("VAR_OUTPUT"))), dtype=np.int64)
        faults = _Faults()
        pointers = [each.ctypes.data_as(ctypes.c_void_p) for each in (inputs, states, outputs)]
        self.library.as_it_is(*pointers, ctypes.c_int64(len(inputs)), ctypes.byref(faults))
        return outputs, states, int(faults.count)


def _sensor(sensor: Sensor) -> _Sensor:
    return _Sensor(low=sensor.low, high=sensor.high, zero=sensor.zero, weight=sensor.weight)


def _within(value: int, ends: Sequence[int]) -> bool:
    return ends[0] <= value <= ends[1]


def _sum(found: Sequence[_Result], sensors: Sequence[Sensor]) -> Tried:
    """Return what several pieces found together; the first of what is wrong is that of the first piece."""
    sums = {name: sum(getattr(each, name) for each in found) for name in RESULT_FIELDS}
    faulty = [each for each in found if each.faults.count]
    wrong = [each for each in found if each.wrong]
    words = ""
    if wrong:
        one = wrong[0]
        words = (
            f"command {one.command}, pressures {one.pressure_a} and {one.pressure_b}: {one.found}, "
            f"expected {one.expected}"
        )
    total = 0
    for each in found:
        total = (total * 1099511628211 + each.hash) % 2**64
    return Tried(
        **sums,
        faults=sum(each.faults.count for each in faulty),
        first_fault=place_of(faulty[0].faults.first) if faulty else None,
        first_wrong=words,
        outputs_hash=f"{total:016x}",
    )
