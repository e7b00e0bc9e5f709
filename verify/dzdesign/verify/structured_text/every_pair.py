"""Every input of a function block, tried with its text turned into C, and a sample of them read by NumPy."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.verify.structured_text.evaluator import Evaluator
from dzdesign.verify.structured_text.exact_block import ExactBlock, Sensor
from dzdesign.verify.structured_text.syntax import RANGES, FunctionBlock, Kind, Place
from dzdesign.verify.structured_text.to_c import HEADER, block_in_c, place_of
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function, Given

PROGRAM = Path(__file__).parent / "programs" / "every_pair.c"
#: Pressures of a PLC, 0.1 bar, whose differences are tried with every command, and those tried at zero command.
PLC_PRESSURES, PLC_AROUND = (0, 4000), (-300, 4300)
#: Inputs that NumPy's reading is compared on, and the seed that draws them.
SAMPLE, SEED = 20_000, 61131
#: A piece of the work, in pressure drops or pressures.
PIECE = 64
SIDE_BY_SIDE = min(os.cpu_count() or 1, 4)
NO_MEMORY = "the function block as C found no memory for the check; run it on a machine with more"
SIDE_FIELDS = (
    "sign", "along", "span", "zero_band", "has_rest", "leave_zero", "limit", "turn", "reverse", "tested_to",
    "first_drop", "drops",
)  # fmt: skip
RESULT_FIELDS = ("pairs", "calls", "wrong", "wrong_status", "wrong_state")


def _integers(*names: str) -> np.dtype:
    return np.dtype([(name, "<i8") for name in names])


#: Structures of programs/every_pair.c; of a law that of its sides is its end, and of a result the faults its middle.
SIDE, SENSOR = _integers(*SIDE_FIELDS), _integers("low", "high", "zero", "weight")
SETUP = np.dtype([
    *((name, "<i8") for name in ("sides", "command_zero", "command_low", "command_high", "unit")),
    ("a", SENSOR), ("b", SENSOR), ("side", SIDE, (2,)),
])  # fmt: skip
FAULTS = _integers("count", "first")
RESULT = np.dtype([
    *((name, "<i8") for name in RESULT_FIELDS), ("faults", FAULTS),
    *((name, "<i8") for name in ("command", "pressure_a", "pressure_b", "found", "expected", "hash")),
])  # fmt: skip
FUNCTIONS = (
    Function("prepare", ("in", "in", "int64_t", "in", "int64_t"), "int32_t"),
    Function("every_command", (*["int64_t"] * 5, "both"), "int32_t"),
    Function("every_pressure", (*["int64_t"] * 4, "both")),
    Function("any_inputs", ("in", "int64_t", "both")),
    Function("as_it_is", ("in", "both", "both", "int64_t", "both")),
)


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
        #: The law, and the numbers of its parts over all pressure drops, of each side.
        self.setup, self.parts = np.zeros(1, dtype=SETUP), [np.zeros(0, dtype=np.int64)] * 2
        self._fill()

    def _fill(self) -> None:
        first, setup = self.exact[0], self.setup[0]
        a, b = first.sensors
        sensors = [(each.low, each.high, each.zero, each.weight) for each in (a, b)]
        head = (len(self.exact), first.command_zero, *first.commands, first.unit)
        for name, value in zip(SETUP.names or (), (*head, *sensors), strict=False):
            setup[name] = value
        for place, exact in enumerate(self.exact):
            drops = range(-exact.reverse, self._largest_drop(exact) + 1)
            self.parts[place] = np.ascontiguousarray(exact.table(drops), dtype=np.int64)
            setup["side"][place] = (
                exact.sign, exact.along, exact.span, exact.zero_band, int(exact.transition_end > 0), exact.leave_zero,
                exact.compare_limit, exact.turn, exact.reverse, exact.tested_to, drops[0], len(drops),
            )  # fmt: skip

    def _largest_drop(self, exact: ExactBlock) -> int:
        """Return the largest pressure drop of valid pressures."""
        a, b = exact.sensors
        ends = (a.high, b.low) if exact.turn > 0 else (a.low, b.high)
        return exact.turn * ((ends[0] - a.zero) * a.weight - (ends[1] - b.zero) * b.weight) // exact.unit


class TriedBlock:
    """A function block that is ready to be tried, in as many processes as try it side by side."""

    def __init__(
        self, block: FunctionBlock, kinds: dict[int, Kind], tables: ExactTables, options: Sequence[str] = ()
    ) -> None:
        self.block, self.kinds, self.of_codes = block, kinds, tables.of_codes
        self.tables, self.exact = tables, tables.exact
        sources = {HEADER: block_in_c(block, kinds), PROGRAM.name: PROGRAM.read_text(encoding="utf-8")}
        self._libraries: SimpleQueue[CompiledLibrary] = SimpleQueue()
        for _ in range(SIDE_BY_SIDE):
            self._libraries.put(CompiledLibrary(sources, FUNCTIONS, "the function block as C", options))
        self._prepared: set[CompiledLibrary] = set()

    @property
    def pressures(self) -> tuple[int, int]:
        """Pressures whose differences are tried with every command."""
        return (0, self.exact[0].code_max) if self.of_codes else PLC_PRESSURES

    def every_pair(self, drops: range | None = None) -> list[Tried]:
        """Try every command at every difference of pressures, or only at some of them; one result a side."""
        low, high = self.pressures
        reach = self._reach(low, high) if drops is None else drops

        def of_side(place: int) -> Callable[[int, int, np.ndarray], int]:
            return lambda first, end, result: self._call("every_command", place, first, end, low, high, result)

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

        def work(first: int, end: int, result: np.ndarray) -> int:
            return self._call("every_pressure", first, end, low, high, result)

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

        def work(begin: int, end: int, result: np.ndarray) -> int:
            return self._call("any_inputs", grid[begin:end], end - begin, result)

        return self._tried(work, range(len(grid)))

    def _call(self, name: str, *given: Given) -> int:
        """Call a function in a process that is free; a first call of it is told the law before."""
        library = self._libraries.get()
        try:
            if library not in self._prepared:
                parts = [word for each in self.tables.parts for word in (each, each.size)]
                if library.call("prepare", self.tables.setup, *parts):
                    raise RequirementError(NO_MEMORY)
                self._prepared.add(library)
            return library.call(name, *given)
        finally:
            self._libraries.put(library)

    def _tried(self, work: Callable[[int, int, np.ndarray], int], reach: range) -> Tried:
        """Do pieces of some work side by side, and add up what they found."""
        if reach.step != 1:
            pieces = [(first, first + 1) for first in reach]
        else:
            pieces = [(first, min(first + PIECE, reach.stop)) for first in range(reach.start, reach.stop, PIECE)]

        def one(piece: tuple[int, int]) -> dict[str, int]:
            result = np.zeros(1, dtype=RESULT)
            result["hash"] = piece[0]
            if work(*piece, result):
                raise RequirementError(NO_MEMORY)
            return _as_numbers(result)

        with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
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
        faults = np.zeros(1, dtype=FAULTS)
        self._call("as_it_is", inputs, states, outputs, len(inputs), faults)
        return outputs, states, int(faults["count"][0])


def _as_numbers(result: np.ndarray) -> dict[str, int]:
    """Return the numbers of a result by name, those of its faults as `faults` and `first_fault`."""
    found = {name: int(result[name][0]) for name in RESULT.names or () if name != "faults"}
    return found | {"faults": int(result["faults"]["count"][0]), "first_fault": int(result["faults"]["first"][0])}


def _within(value: int, ends: Sequence[int]) -> bool:
    return ends[0] <= value <= ends[1]


def _sum(found: Sequence[dict[str, int]], sensors: Sequence[Sensor]) -> Tried:
    """Return what several pieces found together; the first of what is wrong is that of the first piece."""
    sums = {name: sum(each[name] for each in found) for name in RESULT_FIELDS}
    faulty = [each for each in found if each["faults"]]
    wrong = [each for each in found if each["wrong"]]
    words = ""
    if wrong:
        one = wrong[0]
        words = (
            f"command {one['command']}, pressures {one['pressure_a']} and {one['pressure_b']}: {one['found']}, "
            f"expected {one['expected']}"
        )
    total = 0
    for each in found:
        total = (total * 1099511628211 + each["hash"]) % 2**64
    return Tried(
        **sums,
        faults=sum(each["faults"] for each in faulty),
        first_fault=place_of(faulty[0]["first_fault"]) if faulty else None,
        first_wrong=words,
        outputs_hash=f"{total:016x}",
    )
