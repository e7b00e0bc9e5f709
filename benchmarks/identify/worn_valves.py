"""16. Worn valves: a leak in the overlap that grows as the spool comes to the edge, and a declared flow at zero.

Each valve is drawn at random: the clearance leaks in laminar flow, in proportion to the pressure drop and to one over
what is left of the overlap, beside a leak at rest; oil that differs from ramp to ramp changes the leak, the spool its
edge. It is recorded on a simulated bench, identified with and without the declared flow at zero, and closed once more
at every pressure drop, tested or between: the true flow at the law's offset is compared with what the bound answers
for. Spool and meter are those of `bench_plant`, which knows nothing of the law or of the fit.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from bench_plant import commanded, lagged, ramp, with_play
from recorded_ramps import L_MIN, recorded
from scoreboard import Row, print_rows, say

from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.guard_curve import Guard
from dzdesign.identify.valve.side_model import SideModel

PRESSURES_MPa = (1.0, 2.0, 3.0, 4.0, 5.0)
RATE_Hz, HOLD_S, PLAY_V, GAIN, U_MAX_V = 50, 3, 0.15, 3.2, 10.0
#: Of 100 valves.
LIMIT = 1


@dataclass(frozen=True, kw_only=True)
class Worn:
    """A valve and its bench; V, L/min, s, and MPa."""

    edge_V: float
    edge_V_MPa: float
    #: Leak at the edge at 5 MPa, the clearance's least length as a command, and the leak at rest beside it, per MPa.
    wear: float
    length_V: float
    rest: float
    #: Share by which the oil of a ramp leaks more or less, and scatter of the edge, V.
    oil: float
    scatter_V: float
    noise: float
    ramp_s: float
    repeats: int
    lag: float
    #: Of the meter.
    zero: float
    floor: float
    #: Declared.
    zero_flow: float

    def edge_at(self, dp_MPa: float) -> float:
        return self.edge_V + self.edge_V_MPa * (dp_MPa - 1)

    def flow(self, dp_MPa: float, spool_V: np.ndarray, leaks: float = 1.0) -> np.ndarray:
        """Return the flow where the spool stands, as the command at which it stands there on closing, L/min."""
        beyond = spool_V - self.edge_at(dp_MPa)
        clearance = self.wear * dp_MPa / 5 * self.length_V / (np.maximum(-beyond, 0) + self.length_V)
        flow: np.ndarray = GAIN * dp_MPa**0.5 * np.maximum(beyond, 0) + leaks * (clearance + self.rest * dp_MPa)
        return flow

    def passes(self, dp_MPa: float, flow: float) -> float:
        """Return the highest command that passes no more than a flow on closing, V; 0 where it leaks more at rest."""
        u = np.linspace(0, U_MAX_V, 20001)
        within = np.flatnonzero(self.flow(dp_MPa, u) <= flow)
        return float(u[within[-1]]) if within.size else 0.0


def worn(rng: np.random.Generator) -> Worn:
    """Return a worn valve, and a flow at zero that some of them leak at rest."""
    return Worn(
        edge_V=rng.uniform(3.0, 6.0),
        edge_V_MPa=rng.uniform(-0.06, 0.02),
        wear=rng.uniform(0.1, 0.5),
        length_V=rng.uniform(0.3, 3.0),
        rest=0.0,
        oil=float(rng.choice([0.0, 0.05])),
        scatter_V=4e-3,
        noise=float(np.exp(rng.uniform(np.log(0.01), np.log(0.15)))),
        ramp_s=float(rng.choice([40.0, 100.0])),
        repeats=int(rng.integers(1, 4)),
        lag=float(rng.choice([0.0, 0.1])),
        zero=0.0,
        floor=0.0,
        zero_flow=rng.uniform(0.15, 0.8),
    )


def leaking(rng: np.random.Generator) -> Worn:
    """Return one that leaks at rest too, beside a meter whose zero is off."""
    return replace(worn(rng), rest=rng.uniform(0.005, 0.05), zero=rng.uniform(-0.3, 0.3))


def floored(rng: np.random.Generator) -> Worn:
    """Return one before a meter that reads nothing below a floor."""
    return replace(worn(rng), floor=rng.uniform(0.05, 0.3))


def as_measured(rng: np.random.Generator) -> Worn:
    """Return the worn spool that was measured: 0.3 L/min in the overlap at 5 MPa."""
    return replace(worn(rng), edge_V=5.4, wear=0.3, length_V=0.9, noise=0.05, zero_flow=0.35)


Draw = Callable[[np.random.Generator], Worn]
CASES: dict[str, tuple[Draw, Guard]] = {
    "worn as measured, 0.35 L/min allowed": (as_measured, "closing"),
    "worn": (worn, "closing"),
    "worn, opening": (worn, "opening"),
    "worn, leak at rest and zero error": (leaking, "closing"),
    "worn, meter with a floor": (floored, "closing"),
}


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What is found of one valve."""

    #: Largest flow at zero command, at any pressure drop, over what the bound there answers for.
    excess: float
    #: Share of the tests whose bound answers for the declared flow.
    declared: float
    #: Command lost under that which passes the declared flow, and without the declaration, % of full; means.
    lost: float
    lost_before: float


def print_worn_valves(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 16."""
    count = 20 if quick else 100
    rows = []
    for number, (name, (draw, guard)) in enumerate(CASES.items()):
        say(f"worn valves: {name}, {count} valves")
        found, refused = [], 0
        for valve in range(count):
            rng = np.random.default_rng([seed, number, valve])
            outcome = examine(draw(rng), guard, rng)
            if outcome is None:
                refused += 1
            else:
                found.append(outcome)
        lost, before, declared = (
            float(np.mean([getattr(each, key) for each in found])) for key in ("lost", "lost_before", "declared")
        )
        note = (
            f"of {count}, {refused} refused; {lost:.1f} % of command lost, {before:.1f} % without --zero-flow; "
            f"{declared:.0%} of the tests answer for the declared flow"
        )
        opened = sum(each.excess > 1 for each in found)
        rows.append(Row(what=f"{name}: too much at zero", value=opened, limit=LIMIT, note=note))
    print_rows(f"16. Flow above the declared one at zero command, worn valves (seed {seed})", rows)
    return rows


def examine(valve: Worn, guard: Guard, rng: np.random.Generator) -> Outcome | None:
    """Record a valve, identify it with and without the declared flow at zero, and close it once more.

    None where no offset is given: tests that bend as those with a lowest threshold between them do ask for another.
    """
    order = rng.permutation(np.repeat(PRESSURES_MPa, valve.repeats))
    tests = [_ramp(valve, dp, f"ramp{at}.csv", 300.0 * at, rng) for at, dp in enumerate(order.tolist())]
    options = IdentifyOptions(
        meter_lag=valve.lag, repeatability=valve.scatter_V / U_MAX_V if valve.repeats == 1 else None
    )
    try:
        bare = identify(tests, options).positive
        side = identify(tests, replace(options, zero_flow=valve.zero_flow * L_MIN)).positive
    except InputError:
        return None
    if guard not in side.certified or guard not in bare.certified:
        return None
    up = PLAY_V if guard == "opening" else 0.0
    leaks, shift = 1 + valve.oil * rng.standard_normal(), valve.scatter_V * rng.standard_normal()
    excess, lost, before = [], [], []
    for dp in np.linspace(PRESSURES_MPa[0], PRESSURES_MPa[-1], 9).tolist():
        offset, offset_before = _offset(side, guard, dp), _offset(bare, guard, dp)
        flow = float(valve.flow(dp, np.array(offset - up - shift), leaks))
        allowed = float(np.interp(dp, PRESSURES_MPa, [test.zero_flow_L_min or 0.0 for test in side.tests]))
        excess.append(flow / allowed)
        if (passes := valve.passes(dp, valve.zero_flow)) > 0:
            lost.append(passes + up - offset)
            before.append(passes + up - offset_before)
    answers = [(test.zero_flow_L_min or 0.0) < 1.001 * valve.zero_flow for test in side.tests]
    return Outcome(
        excess=max(excess),
        declared=float(np.mean(answers)),
        lost=100 * float(np.mean(lost)) / U_MAX_V,
        lost_before=100 * float(np.mean(before)) / U_MAX_V,
    )


def _offset(side: SideModel, guard: Guard, dp_MPa: float) -> float:
    curve = side.certified[guard]
    return float(np.interp(dp_MPa, curve.offset_dp_MPa, curve.offset_V))


def _ramp(valve: Worn, dp_MPa: float, source: str, started: float, rng: np.random.Generator) -> RampTest:
    _, u = commanded(ramp(valve.ramp_s, before=HOLD_S, at_top=1.0, after=HOLD_S), RATE_Hz)
    leaks, shift = 1 + valve.oil * rng.standard_normal(), valve.scatter_V * rng.standard_normal()
    q = valve.flow(dp_MPa, with_play(u, PLAY_V) - PLAY_V / 2 - shift, leaks)
    if valve.lag:
        q = lagged(q, valve.lag * RATE_Hz)
    test = recorded(
        source, u + 2e-3 * rng.standard_normal(u.size), q + valve.zero, dp_MPa,
        rate_Hz=RATE_Hz, noise=valve.noise, rng=rng, started=started,
    )  # fmt: skip
    return replace(test, q=np.where(np.abs(test.q) < valve.floor * L_MIN, 0.0, test.q))
