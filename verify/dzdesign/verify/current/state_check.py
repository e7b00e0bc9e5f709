"""The controller in C against the exact one, over random and hostile states; other machines by hashes of the same."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.current.circuit import CurrentLoop
from dzdesign.verify.current.exact_controller import (
    NO_OFFSET,
    OPEN,
    OVER,
    SENSOR,
    SHORT,
    ExactController,
    exact_ticks,
)
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import HOST, Machine

PROGRAMS = Path(str(files("dzdesign.verify.current"))) / "programs"
BLOCK = 10_000
OFFSETS = 200
SEED = 22
#: Faults of which every combination stands at the start of some calibration.
STANDING = SENSOR | OPEN | SHORT | OVER
STATE = np.dtype(
    [("integral", "<i4"), ("offset_total", "<u4")]
    + [(name, "<u4") for name in ("offset_ticks", "offset", "compare", "faults", "over_ticks", "open_ticks", "ramped")]
)
#: `struct period` of programs/current_states.h.
PERIOD = np.dtype(
    [("before", STATE), ("after", STATE), ("set_point", "<u2"), ("total", "<u2"), ("supply_code", "<u2"), ("_", "<u2")]
)
#: Of programs/current_states.h.
FUNCTIONS = (
    Function("current_states", ("uint32_t", "uint32_t", "out"), "uint32_t"),
    Function("current_offsets", ("uint32_t", "uint32_t", "out", "out"), "uint32_t"),
    Function("current_initial", ("both",)),
)
COMPARED = ("integral", "compare", "faults", "over_ticks", "open_ticks", "ramped")


@dataclass(frozen=True, slots=True, kw_only=True)
class StateFindings:
    """What a comparison of states found."""

    states: int
    wrong: int
    #: Of the first wrong state: which field, before, inputs and after; empty if there is none.
    first: str
    #: A hash of each block of states, and one of the calibrations.
    hashes: tuple[int, ...]


def edges_of(loop: CurrentLoop) -> str:
    """Return edges.h: values of each field that lie at the ends that matter, within two of them."""
    lasts = (2, 32767, 65533)
    low, high = loop.supply.valid_codes if loop.supply else (0, 4095)
    lowest, highest = (max(loop.offset_nominal + sign * loop.offset_tolerance, 2) for sign in (-1, 1))
    sums = (loop.short_sum, loop.over_sum, loop.open_sum)
    found = {
        "offset": (2, loop.offset_nominal, lowest, highest, loop.offset_nominal),
        "compare": (*lasts, loop.open_compare, loop.compare_limit),
        "over_tick": (*lasts, loop.over_ticks),
        "open_tick": (*lasts, loop.open_ticks),
        "set_point": (2, 2, 65533, loop.full_counts, loop.full_counts // 2),
        "sum": (*lasts, *sums, *(total + loop.offset_nominal for total in sums[1:])),
        "above": (2, *(2 * min(total, 32766) for total in sums[1:]), loop.short_sum),
        "supply": (*lasts, low, high, (low + high) // 2),
    }
    lines = [
        f"static const uint16_t {name}_edges[] = {{{', '.join(f'{min(value, 65533)}u' for value in values)}}};"
        for name, values in found.items()
    ]
    return "\n".join(
        [
            "#define COUNT(edges) ((uint16_t)(sizeof(edges) / sizeof((edges)[0])))",
            f"#define RATE_EDGE UINT32_C({loop.rate})",
            f"#define INTEGRAL_END UINT32_C({loop.integral_limit << loop.gain_shift})",
            *lines,
            "",
        ]
    )


def tick_macro(loop: CurrentLoop) -> str:
    """Return tick.h: one way to call a controller with and without the supply's voltage."""
    supply = ", supply" if loop.supply else ""
    return f"#define TICK(loop, set_point, sum, supply) (void)(supply), dz_current_tick(loop, set_point, sum{supply})\n"


def program_files(loop: CurrentLoop, core: Mapping[str, str], *mains: str) -> dict[str, str]:
    """Return the sources of a program over the states, with the controller's own among them."""
    names = ("current_states.c", "current_states.h", *mains)
    own = {**core, "edges.h": edges_of(loop), "tick.h": tick_macro(loop)}
    return own | {name: (PROGRAMS / name).read_text("utf-8") for name in names}


class HostStates:
    """The controller and the program over its states, compiled for the host."""

    def __init__(self, loop: CurrentLoop, core: Mapping[str, str]) -> None:
        self._loop = loop
        self._library = CompiledLibrary(program_files(loop, core), FUNCTIONS, "the current controller")

    def periods(self, seed: int, count: int) -> tuple[np.ndarray, int]:
        """Return so many periods, and their hash."""
        found = np.zeros(count, dtype=PERIOD)
        return found, self._library.call("current_states", seed, count, found)

    def initial(self) -> dict[str, int]:
        """Return the state before anything."""
        found = np.full(1, 0, dtype=STATE)
        found.view(np.uint8)[:] = 0xAA  # what is not set shows
        self._library.call("current_initial", found)
        return {name: int(found[name][0]) for name in STATE.names or ()}

    def offsets(self, seed: int, count: int) -> tuple[np.ndarray, np.ndarray, int]:
        """Return the states at the end of so many calibrations, their sums, and the hash."""
        ends = np.zeros(count, dtype=STATE)
        sums = np.zeros((count, (1 << self._loop.offset_shift) + 1), dtype=np.uint16)
        return ends, sums, self._library.call("current_offsets", seed, count, ends, sums)


def _initial(loop: CurrentLoop) -> dict[str, int]:
    """Return the state before anything: nothing but the designed offset, and a fault until it is calibrated."""
    return {**dict.fromkeys(STATE.names or (), 0), "offset": loop.offset_nominal, "faults": NO_OFFSET}


def given_of(periods: np.ndarray, loop: CurrentLoop) -> dict[str, np.ndarray]:
    """Return state and inputs before each period, as `exact_ticks` takes them."""
    before = periods["before"]
    given = {name: before[name].astype(np.int64) for name in (*COMPARED, "offset")}
    return given | {name: periods[name].astype(np.int64) for name in ("set_point", "total", "supply_code")}


def check_states(loop: CurrentLoop, core: Mapping[str, str], states: int, seed: int = SEED) -> StateFindings:
    """Compare so many states on the host, and a few calibrations, with the exact controller.

    A controller that crashes is a `RequirementError`: it is run in a program of its own first.
    """
    hashes_on(HOST, loop, core, states, seed)
    host = HostStates(loop, core)
    wrong, first, hashes = 0, "", []
    for block in range(-(-states // BLOCK)):
        periods, hashed = host.periods(block + seed, BLOCK)
        hashes.append(hashed)
        expected = exact_ticks(loop, given_of(periods, loop))
        differs = {name: periods["after"][name] != expected[name] for name in COMPARED}
        places = np.flatnonzero(np.any(list(differs.values()), axis=0))
        wrong += len(places)
        if len(places) and not first:
            at = int(places[0])
            field = next(name for name in COMPARED if differs[name][at])
            first = f"{field} of {periods[at]}, expected {int(expected[field][at])}"
    if (initial := host.initial()) != (expected_initial := _initial(loop)):
        wrong += 1
        first = first or f"initial state {initial}, expected {expected_initial}"
    ends, sums, hashed = host.offsets(seed, OFFSETS)
    for place, (end, totals) in enumerate(zip(ends, sums, strict=True)):
        exact = ExactController(loop, faults=NO_OFFSET | (2 * place & STANDING))
        for total in totals:
            exact.calibrate(int(total))
        if (exact.offset, exact.faults) != (end["offset"], end["faults"]):
            wrong += 1
            first = first or f"calibration {end}, expected offset {exact.offset}, faults {exact.faults}"
    return StateFindings(states=BLOCK * len(hashes) + OFFSETS + 1, wrong=wrong, first=first, hashes=(*hashes, hashed))


def hashes_on(
    machine: Machine, loop: CurrentLoop, core: Mapping[str, str], states: int, seed: int = SEED
) -> tuple[int, ...]:
    """Return the hashes of the same states by the machine code of another machine."""
    main = "on_machine.c"
    sources = {name: text.encode() for name, text in program_files(loop, core, main).items()} | machine.headers
    counts = {"BLOCKS": -(-states // BLOCK), "BLOCK": min(states, BLOCK), "OFFSETS": OFFSETS, "SEED": seed}
    defined = tuple(f"-D{name}=UINT32_C({count})" for name, count in counts.items())
    objects = [
        machine.compile(name, sources, machine.core_flags, "the current controller")
        for name in core
        if name.endswith(".c")
    ]
    objects += [
        machine.compile(name, sources, (*machine.check_flags, *defined), "the states")
        for name in ("current_states.c", main)
    ]
    what = f"the current controller ({machine.name})"
    printed = machine.run(machine.link(objects, what), [], what)
    hashes = tuple(printed[0]) if printed else ()
    if len(hashes) != counts["BLOCKS"] + 1:
        raise RequirementError(f"{what} reported {len(hashes)} hashes, expected {counts['BLOCKS'] + 1}")
    return hashes


def exact_controllers(loop: CurrentLoop, given: Mapping[str, np.ndarray]) -> Iterator[ExactController]:
    """Yield the exact controller after each of the periods that `exact_ticks` takes at once."""
    from fractions import Fraction

    rows = {name: values.tolist() for name, values in given.items()}
    for place in range(len(rows["total"])):
        row = {name: values[place] for name, values in rows.items()}
        controller = ExactController(
            loop,
            integral=Fraction(row["integral"], 1 << loop.gain_shift),
            **{name: row[name] for name in ("compare", "faults", "over_ticks", "open_ticks", "ramped", "offset")},
        )
        controller.tick(row["set_point"], row["total"], row["supply_code"])
        yield controller
