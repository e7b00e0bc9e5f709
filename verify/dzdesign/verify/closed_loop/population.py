"""A population of machines drawn from the declared budget: how many pass flow at zero command.

Each component of the budget is drawn by itself, evenly between its ends: valve, coil, supply or current, sensors,
converter, oil, ageing. The valve's threshold lies between the certified bound and as far on the other side of the
plant's own, at every pressure drop; that of a stand-in, which is known at the tests, runs linearly between them. Each
machine opens and closes at every tested pressure drop, and at one drawn between each two of them; then zero command is
held, with the converter's noise. No formula stands in for the loop.
"""

from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine.machine import Machine
from dzdesign.verify.closed_loop.drawn_machine import COMPONENTS, DrawnMachine, drawn_machine, worst_ends
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


def threshold_band(scene: Scene, tested_MPa: Sequence[float]) -> ThresholdBand:
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


def draw(count: int, seed: int, worst: np.ndarray, drawn: Collection[str] = COMPONENTS) -> np.ndarray:
    """Return where in its half-width each component of each machine lies, (count, components), from -1 to 1.

    Components that are not drawn stand at their worst ends. The first n of a larger number are the same.
    """
    shares = np.random.default_rng(seed).uniform(-1, 1, (count, len(COMPONENTS)))
    kept = [name not in drawn for name in COMPONENTS]
    shares[:, kept] = worst[kept]
    return shares


def run_population(
    scenes: Sequence[Scene], machines: int, seed: int, *, drawn: Collection[str] = COMPONENTS
) -> Population:
    """Draw machines from the declared one, and run each at zero command.

    Scenes of one side are one: its pressure drops. Components that are not `drawn` stand at their worst ends.
    """
    machine = scenes[0].compensator.machine
    if machine is None:
        raise InputError(NOT_DECLARED)
    flows: dict[Side, np.ndarray] = {}
    worst: tuple[float, DrawnMachine | None, float] = (-1.0, None, 0.0)
    closed, count = 0, 0
    for side in dict.fromkeys(scene.side for scene in scenes):
        tests = [scene.dp_MPa for scene in scenes if scene.side == side]
        scene = next(scene for scene in scenes if scene.side == side)
        found = _Run.of(scene, tests, machine, machines, seed, drawn)
        flows[side] = found.beyond_L_min
        closed += found.never_open
        count = max(count, found.pressures)
        if found.worst_L_min > worst[0]:
            worst = (found.worst_L_min, found.worst, found.worst_dp_MPa)
    flowing = int(np.any([each > NO_FLOW_L_MIN for each in flows.values()], axis=0).sum())
    return Population(
        machines=machines,
        seed=seed,
        flowing=flowing,
        never_open=closed,
        confidence=CONFIDENCE,
        upper_limit=upper_limit(flowing, machines),
        pressures=count,
        largest_L_min=round(max(worst[0], 0.0), DECIMALS),
        largest_dp_MPa=round(worst[2], DECIMALS),
        worst=worst[1].in_words() if worst[1] else {},
        drawn=tuple(name for name in COMPONENTS if name in drawn),
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
class _Run:
    """What the machines of one side did."""

    #: (machines,): largest flow at zero command beyond what is allowed.
    beyond_L_min: np.ndarray
    #: Machines that did not open at some pressure drop: they say nothing.
    never_open: int
    pressures: int
    worst: DrawnMachine
    worst_L_min: float
    worst_dp_MPa: float

    @classmethod
    def of(
        cls, scene: Scene, tested_MPa: Sequence[float], machine: Machine, machines: int, seed: int,
        drawn: Collection[str],
    ) -> "_Run":  # fmt: skip
        tested = np.array(sorted(tested_MPa))
        band = threshold_band(scene, tested_MPa)
        shares = draw(machines, seed, worst_ends(scene), drawn)
        # Where the threshold of the plant was found: it need not be linear between two tests.
        steps = np.random.default_rng([seed, 1]).integers(1, NODES, (machines, tested.size - 1))
        between = band.dp_MPa[steps + NODES * np.arange(tested.size - 1)]
        dp = np.concatenate([np.tile(tested, (machines, 1)), between], axis=1)
        none = np.array([_no_flow(scene, one) for one in tested])
        openings = Openings.of(dp.shape[1], settle_s=scene.settle_s, waits_s=scene.loop.waits_s)

        def one(index: int) -> tuple[np.ndarray, np.ndarray]:
            each = drawn_machine(scene, machine, shares[index], index)
            moved_V = band.moved_V(dp[index], each.threshold)
            run = each.loop.run(
                openings.command,
                dp[index][openings.place],
                "compensated",
                back_MPa=scene.back_MPa,
                added_V=each.added_V - moved_V[openings.place],
                errors=each.errors,
            )
            flow = run.q_largest_L_min
            return openings.largest(flow, judged=True), openings.largest(flow, judged=False)

        with ThreadPoolExecutor(WORKERS) as pool:
            at_zero, opened = (np.array(each) for each in zip(*pool.map(one, range(machines)), strict=True))
        beyond = at_zero - np.interp(dp, tested, none - NO_FLOW_L_MIN)
        machine_at, place = np.unravel_index(int(beyond.argmax()), beyond.shape)
        return cls(
            beyond_L_min=beyond.max(axis=1),
            never_open=int((opened <= NO_FLOW_L_MIN).any(axis=1).sum()),
            pressures=int(dp.shape[1]),
            worst=drawn_machine(scene, machine, shares[machine_at], int(machine_at)),
            worst_L_min=float(beyond.max()),
            worst_dp_MPa=float(dp[machine_at, place]),
        )
