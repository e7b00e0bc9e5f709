"""8c. The one fit of a side on families of ramps: next closings above which the offset lies, and what that costs.

A family is one valve as its ramps' thresholds show it, with the error of each ramp's own line. Its bound is certified
by the product, without recordings in between. The next closing lies off the threshold's curve by one draw of the
scatter; its probability of lying below the offset anywhere is exact, so that a few families tell it. What is paid is
the mean distance of the offset below the curve.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr
from scoreboard import Row, print_rows, say

from dzdesign.identify.fit.certificate import certify
from dzdesign.identify.fit.curve_class import Kind, find_class
from dzdesign.identify.fit.ramp_model import Ramps
from dzdesign.identify.fit.scatter import measure_scatter

#: Standard error of a ramp's own line, V, and what is assumed of the scatter where nothing tells it.
LINE_SE, ASSUMED = 2e-3, 25e-3
#: The scatter of the targeted families, V.
SCATTER = 12.5e-3
#: Points at which offset and curve are compared.
PLACES = 401
#: Next closings that may lie below the offset: 1 % is promised.
PROMISED = 0.01

Curve = Callable[[np.ndarray], np.ndarray]
#: Thresholds over 1 to 5 MPa, V.
SHAPES: dict[str, Curve] = {
    "line": lambda p: 5.2 - 0.06 * (p - 1),
    "convex": lambda p: 4.96 + 0.015 * (5 - p) ** 2,
    "concave": lambda p: 5.2 - 0.015 * (p - 1) ** 2,
    "root": lambda p: 5.3 - 0.2 * (np.sqrt(p) - 1),
    "kink then level": lambda p: 5.2 - 0.12 * np.minimum(p - 1, 2.0),
    "kink up": lambda p: 5.2 - 0.06 * (p - 1) + 0.12 * np.maximum(p - 2.6, 0.0),
    "kink down": lambda p: 5.2 - 0.12 * np.maximum(p - 2.6, 0.0),
    "step": lambda p: 5.2 - 0.06 * (p - 1) - 0.05 * (p > 2.5),
    "U": lambda p: 5.0 + 0.03 * (p - 3) ** 2,
    "flat": lambda p: np.full_like(p, 5.0),
}
#: A threshold that steps between two tests is no smooth curve and has no single kink: it is a premise that it does not.
EXCLUDED = ("step",)
SCATTERS = (5e-3, 12.5e-3, 25e-3)


@dataclass(frozen=True, kw_only=True)
class Design:
    """How a family is recorded."""

    pressures: int = 5
    repeats: int = 3
    #: Standard deviation of a pressure that is set by hand, over itself.
    by_hand: float = 0.0
    #: Distance of one ramp from the others, V.
    off: float = 0.0
    #: Drift over the series, of the threshold; the ramps come in random order, with or without a closing repeat.
    drift: float = 0.0
    closing_repeat: bool = False
    ordered: bool = False
    #: Scatter at the lowest pressure, V; None: as elsewhere.
    first: float | None = None
    curve: Kind | None = None
    declared: float | None = None


@dataclass(frozen=True, kw_only=True)
class Family:
    """What became of one valve."""

    #: Probability that the next closing lies below the offset somewhere, and whether the curve itself does.
    below: float
    over: bool
    #: Mean distance of the offset below the curve, V.
    paid: float
    #: Ramps that were set aside, and whether a knot scatters unlike the others.
    aside: int
    unlike: bool


def simulate(shape: Curve, design: Design, scatter: float, rng: np.random.Generator) -> Family:
    """Simulate one family."""
    dp = np.repeat(np.linspace(1, 5, design.pressures), design.repeats)
    dp = dp if design.ordered else rng.permutation(dp)
    if design.closing_repeat:
        dp = np.append(dp, dp[0])
    dp = dp * (1 + design.by_hand * rng.standard_normal(dp.size))
    state = np.linspace(-0.5, 0.5, dp.size)
    y = shape(dp) + design.drift * shape(dp) * state + _scatter_at(dp, design, scatter) * rng.standard_normal(dp.size)
    y += LINE_SE * rng.standard_normal(dp.size)
    y[rng.integers(dp.size)] += design.off
    ramps = Ramps(dp_MPa=dp, y=y, se=np.full(dp.size, LINE_SE), clock=state if design.drift else None)
    found = measure_scatter(ramps, declared=design.declared, assumed=ASSUMED)
    curves = find_class(found, curve=design.curve, curvature=None)
    certified = certify(found, curves)
    at = np.linspace(curves.grid_MPa[0], curves.grid_MPa[-1], PLACES) if curves.kind != "points" else curves.grid_MPa
    truth = shape(at) * (1 - abs(design.drift) / 2)
    margin = truth - np.interp(at, curves.grid_MPa, certified.bound)
    return Family(
        below=float(ndtr(-np.min(margin / _scatter_at(at, design, scatter)))),
        over=bool(margin.min() < 0),
        paid=float(np.mean(margin)),
        aside=len(found.set_aside),
        unlike=found.unlike is not None,
    )


def _scatter_at(dp: np.ndarray, design: Design, scatter: float) -> np.ndarray:
    return np.where(dp < 1.5, scatter if design.first is None else design.first, scatter)


#: What is recorded, of which shape, and what may be paid at most, mV (IDENTIFICATION's limits); None shows it.
TARGETED: dict[str, tuple[str, Design, float | None]] = {
    "line, by hand to 3 %": ("line", Design(by_hand=0.03), 73.0),
    "line, by hand to 10 %": ("line", Design(by_hand=0.1), 88.0),
    "kink then level, by hand to 3 %": ("kink then level", Design(by_hand=0.03), None),
    "line, one ramp off by 150 mV": ("line", Design(off=0.15), 68.0),
    "line, one ramp off by -150 mV": ("line", Design(off=-0.15), 68.0),
    "line, sd 40 mV at the lowest pressure": ("line", Design(first=40e-3), None),
    "line, drift of 2 %, random order": ("line", Design(drift=0.02), None),
    "line, drift of 2 %, single ramps and a closing repeat": (
        "line", Design(drift=0.02, repeats=1, ordered=True, closing_repeat=True, declared=SCATTER), None,
    ),
    "line, two pressures": ("line", Design(pressures=2), None),
    "line, two pressures, line declared": ("line", Design(pressures=2, curve="line"), None),
    "U, two pressures": ("U", Design(pressures=2), None),
    "line, one ramp a pressure, 15 of them": ("line", Design(pressures=15, repeats=1), 89.0),
    "line, one ramp a pressure, scatter declared": ("line", Design(repeats=1, declared=SCATTER), 76.0),
    "line declared": ("line", Design(curve="line"), 50.0),
    "line, 5 repeats": ("line", Design(repeats=5), 54.0),
    "line, 9 pressures": ("line", Design(pressures=9), 64.0),
}  # fmt: skip
#: What may be paid for 5 pressures with 3 ramps each at 12.5 mV, mV.
PAID = {"line": 65.0, "kink then level": 71.0, "convex": 88.0, "U": 88.0}


def print_ramp_families(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 8c."""
    count, rows = (20 if quick else 400), list[Row]()
    for name, shape in SHAPES.items():
        for scatter in SCATTERS:
            what = f"{name}, sd {1e3 * scatter:g} mV"
            paid = PAID.get(name) if scatter == SCATTER else None
            rows += _rows(what, shape, Design(), scatter, count, paid, promised=name not in EXCLUDED, seed=seed)
    for what, (name, design, paid) in TARGETED.items():
        scatter = SCATTER if design.first is None else 3e-3
        promised = design.first is None
        rows += _rows(what, SHAPES[name], design, scatter, count, paid, promised=promised, seed=seed)
    print_rows(f"8c. Families of ramps: next closings below the offset, and the price, of {count} each ({seed})", rows)
    return rows


def _rows(
    what: str,
    shape: Curve,
    design: Design,
    scatter: float,
    count: int,
    paid: float | None,
    *,
    promised: bool,
    seed: int,
) -> list[Row]:
    say(f"ramp families: {what}")
    rng = np.random.default_rng([seed, len(what), round(1e4 * scatter)])
    families = [simulate(shape, design, scatter, rng) for _ in range(count)]
    below = np.array([each.below for each in families])
    error = float(below.std() / np.sqrt(count))
    said = (
        f"curve over in {np.mean([each.over for each in families]):.1%}; a ramp aside in "
        f"{np.mean([each.aside > 0 for each in families]):.0%}, unequal scatter in "
        f"{np.mean([each.unlike for each in families]):.0%}"
    )
    limit = PROMISED + 2 * error if promised else None
    price = 1e3 * np.array([each.paid for each in families])
    most = None if paid is None else paid + 2 * float(price.std() / np.sqrt(count))
    return [
        Row(what=f"{what}: next closing below the offset", value=float(below.mean()), limit=limit, note=said),
        Row(what=f"{what}: paid", value=float(price.mean()), limit=most, unit="mV"),
    ]
