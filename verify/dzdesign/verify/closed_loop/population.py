"""A population of machines drawn from the declared budget: how many pass flow at zero command.

Each component of the budget is drawn by itself, evenly between its ends: valve, coil, supply or current, sensors,
converter, oil, ageing. The valve's threshold lies between the certified bound and as far on the other side of the
plant's own, at every pressure drop; that of a stand-in, which is known at the tests, runs linearly between them. Each
machine closes at every tested pressure drop, and at one drawn between each two of them: its drive at zero command, with
the converter's noise at its peak, is compared with that threshold. Those that come nearest to it run through the loop,
where no formula stands in for it: they open and close at each of these pressure drops, then zero command is held.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.toml_documents import read_toml
from dzdesign.design.machine import Machine
from dzdesign.verify.closed_loop.drawn_machine import COMPONENTS, ZeroDrives, drawn_machine
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, RECORD_S
from dzdesign.verify.closed_loop.plant import LONGEST_KEY
from dzdesign.verify.closed_loop.scene import DECIMALS, SETTLE_S, Scene
from dzdesign.verify.exhaustive.zero_command import StraightBound, guarded_bounds
from dzdesign.verify.loop_results import Population, Side

#: Of one opening and closing, s: full command is held, closed quickly while the valve still is open, then slowly, so
#: that the spool comes to rest as from a slow closing; zero command is judged so long, once it has.
OPEN_S, QUICK_S, SLOW_S, JUDGED_S = 0.15, 0.1, 0.6, 0.2
SLOW_FROM = 0.02
#: Before the first opening: an interlock waits for zero command.
REST_S = 0.1
#: Where the plant's closing threshold is found: so many pressure drops from one test to the next, one of which is
#: drawn; and halvings of it.
NODES, HALVINGS = 16, 17
#: Machines that run through the loop; and how many are drawn at once, which a processor's cache has room for.
IN_LOOP, AT_ONCE = 200, 2048
#: So far within the tested pressure drops, MPa, their ends are inside them in doubles too.
RECORDING = COMPONENTS.index("recording")
NOT_DECLARED = (
    "machines are drawn from the declared one, and this compensator has none; design it again with --coil-temperature "
    "and --supply, or --amplifier"
)
#: Of the upper limit of the probability.
CONFIDENCE = 0.95
WORKERS = 2
#: Keys of a file of tolerances, and their least and largest.
KEYS = {"machines": (1, 100_000_000), "seed": (0, 100_000)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """How many machines are drawn from the declared budget, which says how they scatter."""

    machines: int
    seed: int = 1


def read_tolerances(path: Path) -> Tolerances:
    """Read tolerances from TOML: how many ``machines`` are drawn, and the ``seed`` of the draw."""
    values = read_toml(read_bytes(path, "file of tolerances"), str(path), "lines such as machines = 1000000")
    for name, value in values.items():
        if name not in KEYS:
            raise InputError(f"'{path}': there is no key {quoted(name)}{nearest(name[:LONGEST_KEY], KEYS)}")
        low, high = KEYS[name]
        if type(value) is not int or not low <= value <= high:
            raise InputError(f"'{path}': {name} is {quoted(value)}, expected a whole number from {low} to {high}")
    if "machines" not in values:
        raise InputError(f"'{path}' does not say how many machines are drawn; write for example machines = 1000000")
    return Tolerances(**values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Openings:
    """Command of openings and closings one after another, at one pressure drop each."""

    #: Share of full command, a value a record.
    command: np.ndarray
    #: Which opening each record belongs to.
    place: np.ndarray
    #: First records of each opening that are judged, and its last ones.
    judged: np.ndarray

    @classmethod
    def of(
        cls, count: int, *, down_to: float | np.ndarray = 0.0, settle_s: float = SETTLE_S, waits_s: float = 0.0
    ) -> "Openings":
        """Return so many of them, that close down to a command, (count,) where these differ."""
        opened, quick, slow, rest, judged = (
            round(seconds / RECORD_S) for seconds in (OPEN_S + settle_s - SETTLE_S, QUICK_S, SLOW_S, settle_s, JUDGED_S)
        )
        ends = np.broadcast_to(down_to, (count,))[:, None]
        from_full = np.concatenate([np.ones(opened), np.linspace(1, SLOW_FROM, quick, endpoint=False)])
        closing = np.concatenate([np.linspace(SLOW_FROM, 0, slow, endpoint=False), np.zeros(rest + judged)])
        each = np.concatenate([np.tile(from_full, (count, 1)), np.tile(closing, (count, 1))], axis=1)
        each = ends + each * (1 - ends)
        before = round(max(REST_S, waits_s) / RECORD_S)
        at_end = np.arange(each.shape[1]) >= each.shape[1] - judged
        return cls(
            command=np.concatenate([np.zeros(before), each.ravel()]),
            place=np.concatenate([np.zeros(before, dtype=int), np.repeat(np.arange(count), each.shape[1])]),
            judged=np.concatenate([np.zeros(before, dtype=bool), np.tile(at_end, count)]),
        )

    def largest(self, flow: np.ndarray, *, judged: bool) -> np.ndarray:
        """Return the largest flow of each opening, where it is judged or before."""
        taken = self.judged == judged
        found = np.zeros(self.place[-1] + 1)
        np.maximum.at(found, self.place[taken], flow[taken])
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdBand:
    """The valve's closing threshold, and how far it may lie from that of the plant; an entry for each pressure drop."""

    dp_MPa: np.ndarray
    #: Of the plant, and of the valve in the middle of its band.
    closing_V: np.ndarray
    middle_V: np.ndarray
    #: By how much the middle lies above the certified bound, at least nothing.
    half_V: np.ndarray


def threshold_band(scene: Scene, tested_MPa: Sequence[float] | np.ndarray) -> ThresholdBand:
    """Find where the plant of a scene closes, without the compensator, by halving; and what bounds it."""
    tested = np.array(sorted(tested_MPa))
    inner = [np.linspace(low, high, NODES, endpoint=False) for low, high in pairwise(tested)]
    dp = np.concatenate([*inner, tested[-1:]])
    # What flows without a drive counts as no flow, and so does what was declared as allowed.
    none = np.array([_allowed(scene, one) for one in dp]) + NO_FLOW_L_MIN
    low, high = np.zeros(dp.size), np.ones(dp.size)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        openings = Openings.of(dp.size, down_to=middle)
        run = scene.loop.run(openings.command, dp[openings.place])
        shut = openings.largest(run.q_largest_L_min, judged=True) <= none
        low, high = np.where(shut, middle, low), np.where(shut, high, middle)
    closing_V = low * scene.loop.u_max_V
    middle_V = np.interp(dp, tested, closing_V[::NODES]) if scene.loop.stand_in else closing_V
    half_V = np.maximum(middle_V - _certified_V(scene, dp), 0.0)
    return ThresholdBand(dp_MPa=dp, closing_V=closing_V, middle_V=middle_V, half_V=half_V)


def _allowed(scene: Scene, dp_MPa: float) -> float:
    return max(scene.loop.leak_L_min(dp_MPa), scene.loop.allowed_at_zero_L_min(dp_MPa) or 0.0)


def _certified_V(scene: Scene, dp_MPa: np.ndarray) -> np.ndarray:
    """Return the certified bound at pressure drops, from the ramp tests again."""
    bounds = guarded_bounds(scene.compensator, scene.sign)
    inside = np.clip(dp_MPa, bounds.dp_MPa[0], bounds.dp_MPa[-1])
    return StraightBound(bounds).least_in_doubles(inside, inside)


def draw(count: int, random: np.random.Generator) -> np.ndarray:
    """Return where in its half-width each component of each machine lies, (count, components), from -1 to 1.

    The first n of a larger number are the same.
    """
    return random.uniform(-1, 1, (count, len(COMPONENTS)))


def run_population(scenes: Sequence[Scene], machines: int, seed: int) -> Population:
    """Draw machines from the declared one, compare each with its threshold, and run the nearest ones through the loop.

    Scenes of one side are one: its pressure drops.
    """
    machine = scenes[0].compensator.machine
    if machine is None:
        raise InputError(NOT_DECLARED)
    sides: dict[Side, list[Scene]] = {}
    for scene in scenes:
        sides.setdefault(scene.side, []).append(scene)
    found = [(side, side.compared(machines)) for side in (MachinesOfSide(own, machine, seed) for own in sides.values())]
    worst_side, worst = min(found, key=lambda each: float(each[1].margins_V[0]))
    # Of each side of the valve the machines that ran: flow at zero command beyond what is allowed, and before.
    ran = [(*side.in_loop(nearest), side.dp_MPa(nearest.nodes)) for side, nearest in found]
    beyond, _, dp_MPa = max(ran, key=lambda each: float(each[0].max()))
    flowing = int(np.any([nearest.flows for _, nearest in found], axis=0).sum())
    return Population(
        machines=machines,
        seed=seed,
        flowing=flowing,
        confidence=CONFIDENCE,
        upper_limit=upper_limit(flowing, machines),
        pressures=max(nearest.nodes.shape[1] for _, nearest in found),
        least_margin_V=round(float(worst.margins_V[0]), DECIMALS),
        least_dp_MPa=round(worst_side.nearest_MPa(worst), DECIMALS),
        worst={name: round(float(share), 6) for name, share in zip(COMPONENTS, worst.shares[0], strict=True)},
        in_loop=sum(nearest.index.size for _, nearest in found),
        flowing_in_loop=sum(int((each > NO_FLOW_L_MIN).any(axis=1).sum()) for each, _, _ in ran),
        never_open=sum(int((opened <= NO_FLOW_L_MIN).any(axis=1).sum()) for _, opened, _ in ran),
        largest_L_min=round(max(float(beyond.max()), 0.0), DECIMALS),
        largest_dp_MPa=round(float(dp_MPa.flat[beyond.argmax()]), DECIMALS),
    )


def upper_limit(flowing: int, machines: int, confidence: float = CONFIDENCE) -> float:
    """Return the upper limit of a probability by Clopper and Pearson, exact for a binomial number.

    Examples
    --------
    >>> f"{upper_limit(0, 10_000):.2e}", upper_limit(3, 3)
    ('3.00e-04', 1.0)
    """
    from scipy.stats import beta

    return 1.0 if flowing >= machines else float(beta.ppf(confidence, flowing + 1, machines - flowing))


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """Machines of one side beside their thresholds, and of those that come nearest, nearest first, what they are."""

    #: (machines,): whether the drive at zero command is above the threshold at some pressure drop.
    flows: np.ndarray
    #: Which machine it is; by how much the threshold lies above its drive, V; where each component lies in its
    #: half-width; its pressure drops, (.., pressures) places in the band.
    index: np.ndarray
    margins_V: np.ndarray
    shares: np.ndarray
    nodes: np.ndarray


class MachinesOfSide:
    """The machines of one side, whose scenes are its pressure drops."""

    def __init__(self, scenes: Sequence[Scene], machine: Machine, seed: int) -> None:
        self._scene, self._machine, self._seed = scenes[0], machine, seed
        self._tested = np.array(sorted(scene.dp_MPa for scene in scenes))
        self._band = threshold_band(self._scene, self._tested)
        self._drives = ZeroDrives(self._scene, machine)

    def compared(self, machines: int) -> Compared:
        """Draw machines, and compare the drive of each at zero command with the threshold of its valve."""
        gaps = self._tested.size - 1
        places, steps = np.random.default_rng(self._seed), np.random.default_rng([self._seed, 1])
        at_tests = np.arange(gaps + 1) * NODES
        flows = np.zeros(machines, dtype=bool)
        index, margins = np.empty(0, int), np.empty(0)
        shares, nodes = np.empty((0, len(COMPONENTS))), np.empty((0, 2 * gaps + 1), int)
        for begin in range(0, machines, AT_ONCE):
            count = min(AT_ONCE, machines - begin)
            own = draw(count, places)
            # Where the threshold of the plant was found: it need not be linear between two tests.
            between = steps.integers(1, NODES, (count, gaps)) + at_tests[:-1]
            at = np.concatenate([np.tile(at_tests, (count, 1)), between], axis=1)
            margin_V = self._margins_V(own, at).min(axis=1)
            flows[begin : begin + count] = margin_V < 0
            near = np.flatnonzero(margin_V < margins[-1]) if margins.size == IN_LOOP else np.arange(count)
            if near.size:
                index, margins = np.append(index, begin + near), np.append(margins, margin_V[near])
                shares, nodes = np.vstack([shares, own[near]]), np.vstack([nodes, at[near]])
                nearest = np.argsort(margins, kind="stable")[:IN_LOOP]
                index, margins, shares, nodes = index[nearest], margins[nearest], shares[nearest], nodes[nearest]
        return Compared(flows=flows, index=index, margins_V=margins, shares=shares, nodes=nodes)

    def dp_MPa(self, nodes: np.ndarray) -> np.ndarray:
        """Return the pressure drops at places in the band."""
        found: np.ndarray = self._band.dp_MPa[nodes]
        return found

    def nearest_MPa(self, found: Compared) -> float:
        """Return where the nearest of all comes so near."""
        nodes = found.nodes[:1]
        return float(self.dp_MPa(nodes).flat[self._margins_V(found.shares[:1], nodes).argmin()])

    def _margins_V(self, shares: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Return by how much each threshold lies above the drive, at nodes of the band, V."""
        band, place = self._band, shares[:, [RECORDING]]
        threshold_V = band.middle_V[nodes] + place * band.half_V[nodes]
        margins: np.ndarray = threshold_V - self._drives.at(shares, band.dp_MPa[nodes])
        return margins

    def in_loop(self, found: Compared) -> tuple[np.ndarray, np.ndarray]:
        """Run machines; return the flow at zero command beyond what is allowed, and before, at each pressure drop."""
        scene, band = self._scene, self._band
        openings = Openings.of(found.nodes.shape[1], settle_s=scene.settle_s, waits_s=scene.loop.waits_s)

        def one(place: int) -> tuple[np.ndarray, np.ndarray]:
            nodes, shares = found.nodes[place], found.shares[place]
            loop, errors = drawn_machine(scene, self._machine, shares, int(found.index[place]))
            # By how much the valve closes above the plant.
            moved_V = band.middle_V[nodes] - band.closing_V[nodes] + shares[RECORDING] * band.half_V[nodes]
            run = loop.run(
                openings.command,
                band.dp_MPa[nodes][openings.place],
                "compensated",
                back_MPa=scene.back_MPa,
                added_V=loop.added_V - moved_V[openings.place],
                errors=errors,
            )
            flow = run.q_largest_L_min
            return openings.largest(flow, judged=True), openings.largest(flow, judged=False)

        with ThreadPoolExecutor(WORKERS) as pool:
            at_zero, opened = (np.array(each) for each in zip(*pool.map(one, range(len(found.nodes))), strict=True))
        allowed = np.array([_allowed(scene, one) for one in self._tested])
        return at_zero - np.interp(self.dp_MPa(found.nodes), self._tested, allowed), opened
