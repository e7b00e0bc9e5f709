"""Tolerances: how the plants of a series scatter, and how many machines are drawn from the declared budget.

Of a series: Monte Carlo over the tolerances of a plant, as no two valves are alike. Machines stand in population.py.
"""

import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from dzdesign.core.errors import InputError, quoted
from dzdesign.verify.closed_loop.dead_zone import FLOW_SHARE, dead_zone
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import Plant, read_parameters
from dzdesign.verify.closed_loop.stored_digits import DECIMALS
from dzdesign.verify.loop_results import MonteCarlo, Scatter, Side, Spread

#: Keys of a file of tolerances beside the parameters.
COUNTS = ("plants", "machines", "seed")
#: Ramps quick enough for hundreds of plants; the lag of a spool is a thousandth of them.
SEQUENCE = RampSequence(rest=1.0, ramp=10.0, top=0.5)
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
WORKERS = 2
MOST = {"plants": 100_000, "machines": 100_000_000, "seed": 100_000}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """How the plants of a series scatter, and how many machines are drawn."""

    #: Parameter of `Plant` to its relative spread and the distribution: "uniform" (plus and minus that much) or
    #: "normal" (its standard deviation); without one there is no series.
    spreads: dict[str, tuple[float, str]] = field(default_factory=dict)
    plants: int = 200
    #: Drawn from the declared budget, which says how they scatter.
    machines: int = 0
    seed: int = 1

    def draw(self, nominal: Plant) -> list[Plant]:
        """Return the plants; the first n of a larger number are the same.

        One whose parameters contradict each other is an `InputError`.
        """
        drawn = []
        for index in range(self.plants):
            random = np.random.default_rng([self.seed, index])
            factors = {
                name: 1 + spread * (random.uniform(-1, 1) if shape == "uniform" else random.standard_normal())
                for name, (spread, shape) in self.spreads.items()
            }
            drawn.append(replace(nominal, **{name: getattr(nominal, name) * by for name, by in factors.items()}))
        return drawn


def read_tolerances(path: Path) -> Tolerances:
    """Read tolerances from TOML: parameters as "3 %" (uniform) or "1 % sd" (normal), and how many are drawn.

    ``plants`` are those of a series over the parameters, ``machines`` those drawn from the declared budget, which needs
    no parameter; ``seed`` is of both.
    """
    values = read_parameters(path, "file of tolerances", COUNTS)
    counts = {name: _count(path, name, values.pop(name)) for name in COUNTS if name in values}
    if not values and ("plants" in counts or "machines" not in counts):
        raise InputError(
            f"'{path}' names no plant parameter; write one such as preload_N = \"3 %\", or machines = 1000000 to draw "
            "machines from the declared budget"
        )
    return Tolerances(spreads={name: _spread(path, name, value) for name, value in values.items()}, **counts)


def _count(path: Path, name: str, value: Any) -> int:
    least = 0 if name == "seed" else 1
    if type(value) is not int or not least <= value <= MOST[name]:
        raise InputError(f"'{path}': {name} is {quoted(value)}, expected a whole number from {least} to {MOST[name]}")
    return value


def _spread(path: Path, name: str, value: Any) -> tuple[float, str]:
    text = value if isinstance(value, str) else ""
    found = re.fullmatch(r"\s*(\d{1,3}(?:\.\d{1,6})?)\s*%\s*(sd)?\s*", text, re.ASCII)
    if found is None or not 0 < float(found[1]) < 100:
        raise InputError(
            f"'{path}': {name} is {quoted(value)}, expected plus and minus some per cent, or a standard deviation; "
            f'write for example {name} = "3 %", or {name} = "1 % sd"'
        )
    return float(found[1]) / 100, "normal" if found[2] else "uniform"


def scatter(
    loop: ClosedLoop, nominal: Plant, tolerances: Tolerances, dp_MPa: float, side: Side = "positive"
) -> Scatter:
    """Run every plant through a ramp at one pressure drop."""
    plants = tolerances.draw(nominal)
    command = SEQUENCE.for_drive(loop).command()

    def one(plant: Plant) -> tuple[float, ...]:
        run = loop.with_plant(plant).run(command, dp_MPa, "compensated")
        level = FLOW_SHARE * max(float(run.q_mean_L_min.max()), NO_FLOW_L_MIN)
        return (
            dead_zone(run, level, rising=True),
            dead_zone(run, level, rising=False),
            float(run.q_largest_L_min[-1]),
            float(run.q_mean_L_min.max()),
        )

    with ThreadPoolExecutor(WORKERS) as pool:
        opening, closing, q_zero, q_max = np.array(list(pool.map(one, plants))).T
    allowed = loop.allowed_at_zero_L_min(dp_MPa) or NO_FLOW_L_MIN
    drawn = [{name: getattr(plant, name) for name in tolerances.spreads} for plant in plants]
    return Scatter(
        side=side,
        dp_MPa=dp_MPa,
        plants=len(plants),
        leaking=int((q_zero > allowed).sum()),
        residual_opening=_spread_of(opening, drawn, int(opening.argmax())),
        residual_closing=_spread_of(closing, drawn, int(closing.argmax())),
        q_zero_L_min=_spread_of(q_zero, drawn, int(q_zero.argmax())),
        q_max_L_min=_spread_of(q_max, drawn, int(q_max.argmin())),
    )


def _spread_of(values: np.ndarray, drawn: Sequence[Mapping[str, float]], worst: int) -> Spread:
    """Return the quantiles of one quantity, and the plant at its bad end."""
    p01, p05, p50, p95, p99, end = np.round([*np.quantile(values, QUANTILES), values[worst]], DECIMALS).tolist()
    return Spread(p01=p01, p05=p05, p50=p50, p95=p95, p99=p99, worst=end, worst_plant=drawn[worst])


def monte_carlo(tolerances: Tolerances, found: Sequence[Scatter]) -> MonteCarlo:
    """Return what the evidence has of a series of plants."""
    spreads = {name: f"{100 * spread:g} % {shape}" for name, (spread, shape) in tolerances.spreads.items()}
    return MonteCarlo(plants=tolerances.plants, seed=tolerances.seed, spreads=spreads, pressures=tuple(found))
