"""A population of machines drawn from the declared budget: how many pass flow at zero command.

Each component of the budget is drawn by itself, evenly between its ends: valve, coil, supply or current, sensors,
converter, oil, ageing. The valve's threshold lies between the certified bound and as far on the other side of the
plant's own, at every pressure drop; that of a stand-in, which is known at the tests, runs linearly between them. Each
machine closes at every tested pressure drop, and at one drawn between each two of them: its drive at zero command, with
the converter's noise at its peak, is compared with that threshold. Those that come nearest to it run through the loop,
where no formula stands in for it: they open and close at each of these pressure drops, then zero command is held.
"""

from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine import Machine
from dzdesign.verify.closed_loop.drawn_machine import COMPONENTS, ZeroDrives, drawn_machine, worst_ends
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, RECORD_S
from dzdesign.verify.closed_loop.scene import SETTLE_S, Scene
from dzdesign.verify.closed_loop.stored_digits import DECIMALS
from dzdesign.verify.exhaustive.sagging_bound import SaggingBound
from dzdesign.verify.exhaustive.zero_command import Staircase, guarded_bounds
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
WITHIN_MPA = 1e-9
NOT_DECLARED = (
    "machines are drawn from the declared one, and this compensator has none; design it again with --coil-temperature "
    "and --supply, or --amplifier"
)
#: Of the upper limit of the probability.
CONFIDENCE = 0.95
WORKERS = 2


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
    """The valve's closing threshold, and how far it may lie from that of the plant; all of one pressure drop each."""

    dp_MPa: np.ndarray
    #: Of the plant, and of the valve in the middle of its band.
    closing_V: np.ndarray
    middle_V: np.ndarray
    #: Certified, V, of a pressure drop.
    bound: Callable[[np.ndarray], np.ndarray]

    def half_width_V(self, dp_MPa: np.ndarray) -> np.ndarray:
        """Return by how much the middle lies above the certified bound, at least nothing."""
        half_V: np.ndarray = np.maximum(np.interp(dp_MPa, self.dp_MPa, self.middle_V) - self.bound(dp_MPa), 0.0)
        return half_V

    def moved_V(self, dp_MPa: np.ndarray, share: float) -> np.ndarray:
        """Return by how much a valve closes above the plant, at so many half-widths from the middle."""
        middle: np.ndarray = np.interp(dp_MPa, self.dp_MPa, self.middle_V - self.closing_V)
        return middle + share * self.half_width_V(dp_MPa)


def threshold_band(scene: Scene, tested_MPa: Sequence[float] | np.ndarray) -> ThresholdBand:
    """Find where the plant of a scene closes, without the compensator, by halving; and what bounds it."""
    tested = np.array(sorted(tested_MPa))
    inner = [np.linspace(low, high, NODES, endpoint=False) for low, high in pairwise(tested)]
    dp = np.concatenate([*inner, tested[-1:]])
    # What flows without a drive counts as no flow, and so does what was declared as allowed.
    none = np.array([_no_flow(scene, one) for one in dp])
    low, high = np.zeros(dp.size), np.ones(dp.size)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        openings = Openings.of(dp.size, down_to=middle)
        run = scene.loop.run(openings.command, dp[openings.place])
        shut = openings.largest(run.q_largest_L_min, judged=True) <= none
        low, high = np.where(shut, middle, low), np.where(shut, high, middle)
    closing_V = low * scene.loop.u_max_V
    return ThresholdBand(
        dp_MPa=dp,
        closing_V=closing_V,
        middle_V=np.interp(dp, tested, closing_V[::NODES]) if scene.loop.is_stand_in else closing_V,
        bound=_certified(scene.compensator, scene.sign),
    )


def _no_flow(scene: Scene, dp_MPa: float) -> float:
    return max(scene.loop.leak_L_min(dp_MPa), scene.loop.allowed_at_zero_L_min(dp_MPa) or 0.0) + NO_FLOW_L_MIN


def _certified(compensator: Compensator, sign: int) -> Callable[[np.ndarray], np.ndarray]:
    """Return the certified bound, V, at pressure drops, from the ramp tests again."""
    bounds = guarded_bounds(compensator, sign)
    if bounds.premise != "monotone" and len(bounds.dp_MPa) > 1:
        sagging, ends_MPa = SaggingBound(bounds), (bounds.dp_MPa[0] + WITHIN_MPA, bounds.dp_MPa[-1] - WITHIN_MPA)

        def sagging_bound(dp_MPa: np.ndarray) -> np.ndarray:
            inside = np.clip(dp_MPa, *ends_MPa)
            return sagging.least_in_doubles(inside, inside)

        return sagging_bound
    stairs = Staircase(bounds)
    ends, levels = np.array([float(dp) for dp in stairs.dp_MPa]), np.array([float(v) for v in stairs.bounds_V])

    def bound(dp_MPa: np.ndarray) -> np.ndarray:
        inside = np.clip(dp_MPa, ends[0], ends[-1])
        if stairs.falling:
            place = np.searchsorted(ends, inside, side="left")
        else:
            place = np.searchsorted(ends, inside, side="right") - 1
        return np.asarray(levels[place])

    return bound


def draw(
    count: int, random: np.random.Generator, worst: np.ndarray, drawn: Collection[str] = COMPONENTS
) -> np.ndarray:
    """Return where in its half-width each component of each machine lies, (count, components), from -1 to 1.

    Components that are not drawn stand at their worst ends. The first n of a larger number are the same.
    """
    shares = random.uniform(-1, 1, (count, len(COMPONENTS)))
    kept = [name not in drawn for name in COMPONENTS]
    shares[:, kept] = worst[kept]
    return shares


def run_population(
    scenes: Sequence[Scene], machines: int, seed: int, *, drawn: Collection[str] = COMPONENTS
) -> Population:
    """Draw machines from the declared one, compare each with its threshold, and run the nearest ones through the loop.

    Scenes of one side are one: its pressure drops. Components that are not `drawn` stand at their worst ends.
    """
    machine = scenes[0].compensator.machine
    if machine is None:
        raise InputError(NOT_DECLARED)
    sides: dict[Side, list[Scene]] = {}
    for scene in scenes:
        sides.setdefault(scene.side, []).append(scene)
    found = [MachinesOfSide(own, machine, seed, drawn).of(machines) for own in sides.values()]
    worst = min(found, key=lambda each: float(each.compared.margins_V[0]))
    leaking = max(found, key=lambda each: each.largest_L_min)
    flowing = int(np.any([each.compared.flows for each in found], axis=0).sum())
    return Population(
        machines=machines,
        seed=seed,
        flowing=flowing,
        confidence=CONFIDENCE,
        upper_limit=upper_limit(flowing, machines),
        pressures=max(each.compared.dp_MPa.shape[1] for each in found),
        least_margin_V=round(float(worst.compared.margins_V[0]), DECIMALS),
        least_dp_MPa=round(worst.nearest_MPa, DECIMALS),
        worst={name: round(float(share), 6) for name, share in zip(COMPONENTS, worst.compared.shares[0], strict=True)},
        drawn=tuple(name for name in COMPONENTS if name in drawn),
        in_loop=sum(each.compared.index.size for each in found),
        flowing_in_loop=sum(each.flowing_in_loop for each in found),
        never_open=sum(each.never_open for each in found),
        largest_L_min=round(max(leaking.largest_L_min, 0.0), DECIMALS),
        largest_dp_MPa=round(leaking.largest_dp_MPa, DECIMALS),
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
    #: half-width; its pressure drops, MPa, (.., pressures).
    index: np.ndarray
    margins_V: np.ndarray
    shares: np.ndarray
    dp_MPa: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    """What the machines of one side do."""

    compared: Compared
    #: Where the nearest of all comes so near.
    nearest_MPa: float
    #: Of the nearest ones in the loop: how many flow, how many do not open at some pressure drop, the largest flow at
    #: zero command beyond what is allowed.
    flowing_in_loop: int
    never_open: int
    largest_L_min: float
    largest_dp_MPa: float


class MachinesOfSide:
    """The machines of one side, whose scenes are its pressure drops."""

    def __init__(self, scenes: Sequence[Scene], machine: Machine, seed: int, drawn: Collection[str]) -> None:
        self._scene, self._machine, self._drawn, self._seed = scenes[0], machine, drawn, seed
        self._tested = np.array(sorted(scene.dp_MPa for scene in scenes))
        self._band = threshold_band(self._scene, self._tested)
        self._half_V = self._band.half_width_V(self._band.dp_MPa)
        self._drives = ZeroDrives(self._scene, machine)

    def compared(self, machines: int) -> Compared:
        """Draw machines, and compare the drive of each at zero command with the threshold of its valve."""
        worst, gaps = worst_ends(self._scene), self._tested.size - 1
        places, steps = np.random.default_rng(self._seed), np.random.default_rng([self._seed, 1])
        at_tests = np.arange(gaps + 1) * NODES
        flows = np.zeros(machines, dtype=bool)
        index, margins = np.empty(0, int), np.empty(0)
        shares, nodes = np.empty((0, len(COMPONENTS))), np.empty((0, 2 * gaps + 1), int)
        for begin in range(0, machines, AT_ONCE):
            count = min(AT_ONCE, machines - begin)
            own = draw(count, places, worst, self._drawn)
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
        return Compared(flows=flows, index=index, margins_V=margins, shares=shares, dp_MPa=self._band.dp_MPa[nodes])

    def _margins_V(self, shares: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Return by how much each threshold lies above the drive, at nodes of the band, V."""
        threshold_V = self._band.middle_V[nodes] + shares[:, [COMPONENTS.index("recording")]] * self._half_V[nodes]
        margins: np.ndarray = threshold_V - self._drives.at(shares, self._band.dp_MPa[nodes])
        return margins

    def of(self, machines: int) -> _Found:
        """Return what the machines do, the nearest of them in the loop too."""
        found = self.compared(machines)
        nodes = np.searchsorted(self._band.dp_MPa, found.dp_MPa[:1])
        beyond, opened = self._in_loop(found)
        row, place = np.unravel_index(int(beyond.argmax()), beyond.shape)
        return _Found(
            compared=found,
            nearest_MPa=float(found.dp_MPa[0, np.argmin(self._margins_V(found.shares[:1], nodes))]),
            flowing_in_loop=int((beyond > NO_FLOW_L_MIN).any(axis=1).sum()),
            never_open=int((opened <= NO_FLOW_L_MIN).any(axis=1).sum()),
            largest_L_min=float(beyond.max()),
            largest_dp_MPa=float(found.dp_MPa[row, place]),
        )

    def _in_loop(self, found: Compared) -> tuple[np.ndarray, np.ndarray]:
        """Run machines; return the flow at zero command beyond what is allowed, and before, at each pressure drop."""
        scene, dp_MPa = self._scene, found.dp_MPa
        openings = Openings.of(dp_MPa.shape[1], settle_s=scene.settle_s, waits_s=scene.loop.waits_s)

        def one(place: int) -> tuple[np.ndarray, np.ndarray]:
            each = drawn_machine(scene, self._machine, found.shares[place], int(found.index[place]))
            moved_V = self._band.moved_V(dp_MPa[place], each.threshold)
            run = each.loop.run(
                openings.command,
                dp_MPa[place][openings.place],
                "compensated",
                back_MPa=scene.back_MPa,
                added_V=each.added_V - moved_V[openings.place],
                errors=each.errors,
            )
            flow = run.q_largest_L_min
            return openings.largest(flow, judged=True), openings.largest(flow, judged=False)

        with ThreadPoolExecutor(WORKERS) as pool:
            at_zero, opened = (np.array(each) for each in zip(*pool.map(one, range(len(dp_MPa))), strict=True))
        none = np.array([_no_flow(scene, one) for one in self._tested]) - NO_FLOW_L_MIN
        return at_zero - np.interp(dp_MPa, self._tested, none), opened
