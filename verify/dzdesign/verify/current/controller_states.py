"""The current controller in C against what it must do, over random and hostile states; other machines by hashes.

What it must do is written from what a PI controller with feed-forward, limit and anti-windup is, in whole numbers over
the gains' denominator, and not from the template: the integral is a number of either sign, a fault a set of conditions.
"""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.current.circuit import CORRECTION_SHIFT, CurrentLoop
from dzdesign.verify.current.results import ControllerStates
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import Machine

PROGRAMS = Path(str(files("dzdesign.verify.current"))) / "programs"
#: Bits of the faults.
NO_OFFSET, SENSOR, OPEN, SHORT, OVER, HELD = (1 << place for place in range(6))
#: By how many bits those of solenoid B stand higher; and what stands for it where the controller has one of two.
OF_B, B = 8, -1
#: Faults of which every combination stands at the start of some calibration.
STANDING = SENSOR | OPEN | SHORT | OVER
BLOCK, OFFSETS, SEED = 10_000, 200, 22
#: Of programs/current_states.h.
FUNCTIONS = (
    Function("current_states", ("uint32_t", "uint32_t", "out"), "uint32_t"),
    Function("current_offsets", ("uint32_t", "uint32_t", "out", "out"), "uint32_t"),
    Function("current_initial", ("both",)),
)
COMPARED = ("integral", "compare", "faults", "over_ticks", "open_ticks", "ramped")
COMPARED_OF_TWO = (*COMPARED, "compare_a", "compare_b", "on_b", "held_ticks")


def compared(loop: CurrentLoop) -> tuple[str, ...]:
    """Return the names of the state that a period changes."""
    return COMPARED_OF_TWO if loop.two else COMPARED


def offset_names(loop: CurrentLoop) -> tuple[str, ...]:
    """Return the names of the offset of each shunt."""
    return ("offset_a", "offset_b") if loop.shunts == 2 else ("offset",)


def state_type(loop: CurrentLoop) -> np.dtype:
    """Return `struct dz_current`."""
    own = ("compare_a", "compare_b") if loop.two else ()
    names = ["offset_total", "offset_ticks", *offset_names(loop), *own, "compare"]
    names += ["on_b", "held_ticks"] if loop.two else []
    signed = {"integral": "<i4", "on_b": "<i4"}
    names = ["integral", *names, "faults", "over_ticks", "open_ticks", "ramped"]
    return np.dtype([(name, signed.get(name, "<u4")) for name in names])


def period_type(loop: CurrentLoop) -> np.dtype:
    """Return `struct period` of programs/current_states.h, with the set points of solenoids A and B."""
    state = state_type(loop)
    inputs = [("set_points", "<u2", 2), ("total", "<u2"), ("supply_code", "<u2")]
    return np.dtype([("before", state), ("after", state), *inputs])


def exact_ticks(loop: CurrentLoop, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return what a period of the PWM makes of many states at once.

    `given` has the state by the names of `compared`, which what is returned has too, the offsets, and what comes in:
    `set_points`, rows of two, `total` and `supply_code`.
    """
    if not loop.two:
        return _one_solenoid(loop, given, given["set_points"][:, 0], given["offset"], given["faults"])
    # Asked for is the solenoid with a set point; without one that which the controller has.
    asked = np.where(given["set_points"][:, 0] > 0, 0, given["on_b"])
    asked = np.where(given["set_points"][:, 1] > 0, B, asked)
    changes, on_b = asked != given["on_b"], given["on_b"] == B
    set_point = np.where(changes, 0, np.where(asked == B, given["set_points"][:, 1], given["set_points"][:, 0]))
    place, names = np.where(on_b, OF_B, 0), offset_names(loop)
    offset = np.where(on_b, given[names[-1]], given[names[0]])
    flows = changes & (given["total"] - offset >= loop.open_sum)
    held_ticks = np.where(flows, given["held_ticks"] + 1, 0)
    standing = given["faults"] | np.where(held_ticks >= loop.held_ticks, HELD << place, 0)
    after = _one_solenoid(loop, given, set_point, offset, standing, place)
    return after | {
        "compare_a": np.where(on_b, 0, after["compare"]),
        "compare_b": np.where(on_b, after["compare"], 0),
        "on_b": np.where(changes & ~flows & (given["compare"] == 0), asked, given["on_b"]),
        "held_ticks": held_ticks,
    }


def _one_solenoid(
    loop: CurrentLoop,
    given: Mapping[str, np.ndarray],
    set_point: np.ndarray,
    offset: np.ndarray,
    standing: np.ndarray,
    place: np.ndarray | int = 0,
) -> dict[str, np.ndarray]:
    """Return what a period makes of the solenoid that the controller has, whose faults stand so many bits higher."""
    unit = 1 << loop.gain_shift
    total = given["total"]
    above = np.maximum(total - offset, 0)
    aim = given["ramped"] + np.clip(set_point - given["ramped"], -loop.rate, loop.rate)
    error = aim - _rounded(loop.current_gain * above, 1 << loop.current_shift)
    too_high, dead = above >= loop.over_sum, (above < loop.open_sum) & (given["compare"] >= loop.open_compare)
    over_ticks = np.where(too_high, given["over_ticks"] + 1, 0)
    open_ticks = np.where(dead, given["open_ticks"] + 1, 0)
    faults = standing.copy()
    for bit, stands in (
        (SHORT, total >= loop.short_sum),
        (OVER, over_ticks >= loop.over_ticks),
        (OPEN, open_ticks >= loop.open_ticks),
    ):
        faults |= np.where(stands, bit << place, 0)
    asked = given["integral"] - loop.release * unit + loop.proportional * error + loop.feed_forward * aim
    counts = _corrected(loop, _rounded(np.maximum(asked, 0), unit), given["supply_code"])
    winds_up = ((counts > loop.compare_limit) & (error > 0)) | ((asked < 0) & (error < 0))
    end = loop.integral_limit * unit
    moved = np.clip(given["integral"] + loop.integral * error, -end, end)
    off = (set_point == 0) | (faults != 0)
    return {
        "integral": np.where(off, 0, np.where(winds_up, given["integral"], moved)),
        "compare": np.where(off, 0, np.minimum(counts, loop.compare_limit)),
        "faults": faults,
        "over_ticks": over_ticks,
        "open_ticks": open_ticks,
        "ramped": np.where(off, 0, aim),
    }


def exact_calibrations(loop: CurrentLoop, sums: np.ndarray, faults: np.ndarray) -> dict[str, np.ndarray]:
    """Return offsets and faults after many calibrations by their sums without current; any more are left.

    The sums are rows, of two shunts those of A first; `faults` are those that stood before.
    """
    count, found = 1 << loop.offset_shift, {"faults": faults & ~NO_OFFSET}
    for shunt, name in enumerate(offset_names(loop)):
        own = sums[:, shunt * count : (shunt + 1) * count].astype(np.int64)
        found[name] = _rounded(own.sum(axis=1), count)
        off = np.abs(found[name] - loop.offset_nominal) > loop.offset_tolerance
        found["faults"] = found["faults"] | np.where(off, SENSOR << OF_B * shunt, 0)
    return found


def _rounded(numerator: np.ndarray, denominator: int) -> np.ndarray:
    return (2 * numerator + denominator) // (2 * denominator)


def _corrected(loop: CurrentLoop, counts: np.ndarray, supply_code: np.ndarray) -> np.ndarray:
    supply = loop.supply
    if supply is None:
        return counts
    node, past = np.divmod(np.clip(supply_code, *supply.valid_codes) - supply.valid_codes[0], supply.step_codes)
    nodes = np.array(supply.nodes, dtype=np.int64)
    factor = (nodes[node] * (supply.step_codes - past) + nodes[node + 1] * past) // supply.step_codes
    return _rounded(np.minimum(counts, 65535) * factor, 1 << CORRECTION_SHIFT)


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
        "held_tick": (*lasts, loop.held_ticks),
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
    """Return tick.h: one way to call a controller of one solenoid or two, of one shunt or two, with any supply."""
    supply = ", supply" if loop.supply else ""
    asked = "(asked)[0], (asked)[1]" if loop.two else "(asked)[0]"
    return (
        f"#define SOLENOIDS {1 + loop.two}\n#define SHUNTS {loop.shunts}\n"
        f"#define TICK(loop, asked, sum, supply) (void)(supply), dz_current_tick(loop, {asked}, sum{supply})\n"
    )


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
        found = np.zeros(count, dtype=period_type(self._loop))
        return found, self._library.call("current_states", seed, count, found)

    def initial(self) -> dict[str, int]:
        """Return the state before anything."""
        found = np.zeros(1, dtype=state_type(self._loop))
        found.view(np.uint8)[:] = 0xAA  # what is not set shows
        self._library.call("current_initial", found)
        return {name: int(found[name][0]) for name in found.dtype.names or ()}

    def offsets(self, seed: int, count: int) -> tuple[np.ndarray, np.ndarray, int]:
        """Return the states at the end of so many calibrations, their sums, and the hash."""
        ends = np.zeros(count, dtype=state_type(self._loop))
        sums = np.zeros((count, self._loop.offset_ticks + 1), dtype=np.uint16)
        return ends, sums, self._library.call("current_offsets", seed, count, ends, sums)


def given_of(loop: CurrentLoop, periods: np.ndarray) -> dict[str, np.ndarray]:
    """Return state and inputs before each period, as `exact_ticks` takes them."""
    before = periods["before"]
    given = {name: before[name].astype(np.int64) for name in (*compared(loop), *offset_names(loop))}
    return given | {name: periods[name].astype(np.int64) for name in ("set_points", "total", "supply_code")}


def check_states(
    loop: CurrentLoop, core: Mapping[str, str], states: int, seed: int = SEED
) -> tuple[ControllerStates, tuple[int, ...]]:
    """Compare so many states on the host, and a few calibrations, with the exact controller; return their hashes too.

    There is a hash of each block of states, and one of the calibrations. A controller that crashes is a
    `RequirementError`.
    """
    host, names, wrong, first, hashes = HostStates(loop, core), compared(loop), 0, [], []
    for block in range(-(-states // BLOCK)):
        periods, hashed = host.periods(block + seed, BLOCK)
        hashes.append(hashed)
        expected = exact_ticks(loop, given_of(loop, periods))
        differs = {name: periods["after"][name] != expected[name] for name in names}
        places = np.flatnonzero(np.any(list(differs.values()), axis=0))
        wrong += len(places)
        for at in places[:1]:
            field = next(name for name in names if differs[name][at])
            first.append(f"{field} of {periods[at]}, expected {int(expected[field][at])}")
    # Before anything: nothing but the designed offset, and a fault until it is calibrated.
    known = dict.fromkeys(state_type(loop).names or (), 0) | {"faults": NO_OFFSET}
    known |= dict.fromkeys(offset_names(loop), loop.offset_nominal)
    if (initial := host.initial()) != known:
        wrong += 1
        first.append(f"initial state {initial}, expected {known}")
    ends, sums, hashed = host.offsets(seed, OFFSETS)
    calibrated = exact_calibrations(loop, sums, NO_OFFSET | (2 * np.arange(OFFSETS) & STANDING))
    calibrated |= {"on_b": np.zeros(OFFSETS)} if loop.two else {}
    places = np.flatnonzero(np.any([ends[name] != values for name, values in calibrated.items()], axis=0))
    wrong += len(places)
    for at in places[:1]:
        first.append(f"calibration {ends[at]}, expected { {name: int(each[at]) for name, each in calibrated.items()} }")
    found = ControllerStates(
        states=BLOCK * len(hashes) + OFFSETS + 1, seed=seed, wrong=wrong, first_wrong=first[0] if first else None
    )
    return found, (*hashes, hashed)


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
