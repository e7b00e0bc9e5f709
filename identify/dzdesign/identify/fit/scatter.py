"""The scatter from ramp to ramp: whether it is equal at all knots, which ramps lie off, and how large it is.

Equal scatter is tested first. One variance for all would bound a knot that scatters ten times as much as the others
far too tightly, and its ramps would be set aside one after another. Only where a knot's ramps are like the others'
without one of them is that ramp the whole of it; elsewhere the knot keeps a variance of its own. Then outlying ramps
are set aside. That the valve will not do the same again is a premise, which a warning and the certificate state. Of
three ramps no test tells one that lies off from a wide scatter in which two happen to be alike.

The scatter is what the residuals show beside each ramp's own error (Paule and Mandel): the sum of their squares, each
over the variance of its ramp, is that of the degrees of freedom. The harmonic mean of these variances then has the
degrees of freedom of the residuals, and stands for a ramp that is still to come.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dzdesign.identify.fit.ramp_model import SMALLEST_SD, RampModel, Ramps, fit_ramp_model

Origin = Literal["repeats", "declared", "assumed"]
#: Probability, all ramps counted, of a residual for which a ramp is set aside.
OUTLYING = 0.01
#: Probability of one knot's share in the scatter below which it has a variance of its own.
UNEQUAL = 0.005
#: Probability of a knot's scatter without its outlying ramp above which that ramp explains it. Of three ramps but one
#: degree of freedom is left. At 0.2 a valve with one ramp off by 150 mV pays 6 mV more on average, for one family in
#: five is taken for an unequal scatter; at 0.0005 a knot of 40 mV beside 3 mV is seen in a third of the families, at
#: 0.02 in six of ten.
LIKE_OTHERS = 0.01
#: Fewest degrees of freedom of a scatter that is measured, and of a test for outlying ramps.
LEAST_DEGREES = 2
#: At most one ramp in so many is set aside.
ONE_IN = 7
#: Degrees of freedom below which a knot tells nothing of its scatter; of a residual at least; and their rounding.
NO_DEGREES, SMALLEST_FREE, ROUNDED = 0.5, 1e-6, 1e-6
#: Probability of the repeats, if the declared or assumed scatter were true, below which theirs counts.
CONTRADICTED = 1e-3
#: Degrees of freedom of the error of a ramp's own line, which blocks of its residuals tell; and the smallest share of
#: it in a variance that counts.
OF_LINE, SMALLEST_SHARE = 14, 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Unlike:
    """A knot whose ramps scatter more than the others'."""

    knot: int
    #: Variance of one ramp there, V², its degrees of freedom, and the probability of so large a share.
    variance: float
    degrees: float
    p_value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SetAside:
    """A ramp that lies off: its place among all, its distance from where the others put it, V, and in deviations."""

    ramp: int
    distance: float
    ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """The model of the ramps that are kept, weighted by their scatter and their own errors."""

    model: RampModel
    #: Mean variance of a ramp, V², and its degrees of freedom.
    variance: float
    degrees: float
    #: Share of it that the next closing has.
    share: float
    origin: Origin
    unlike: Unlike | None
    set_aside: tuple[SetAside, ...]

    @property
    def of_ramps(self) -> np.ndarray:
        """Variance of each ramp, V² (n,): that of its knot where it scatters unlike the others."""
        found = self.model.variances
        if self.unlike is None:
            return found
        there, noise = self.model.knot == self.unlike.knot, self.model.ramps.se**2
        more = max(self.unlike.variance - float(noise[there].mean()), self.model.scatter)
        found[there] = np.maximum(more + noise[there], found[there])
        return found

    @property
    def kept(self) -> np.ndarray:
        """Mask over all ramps of those that are kept."""
        kept = np.ones(self.model.ramps.y.size + len(self.set_aside), dtype=bool)
        kept[[each.ramp for each in self.set_aside]] = False
        return kept


def measure_scatter(ramps: Ramps, *, declared: float | None, assumed: float, least: float = 0.0) -> Scatter:
    """Fit the ramps of a branch, set aside those that lie off, and measure the scatter of the others.

    Parameters
    ----------
    ramps : Ramps
        At least one.
    declared : float or None
        Standard deviation from ramp to ramp, V; None measures it.
    assumed : float
        Taken where nothing tells it, V.
    least : float
        Standard deviation at least, V: half the distance of two groups in which the ramps lie. Then every ramp counts,
        for those of the smaller group lie off as the others do.
    """
    kept, found = np.ones(ramps.y.size, dtype=bool), list[SetAside]()
    while True:
        model = fit_ramp_model(ramps.only(kept), share_knots=declared is None)
        unlike = find_unlike_knot(model)
        scatter = describe_scatter(model, unlike, declared=declared, assumed=assumed, least=least)
        outlying = None
        if not least and len(found) < ramps.y.size // ONE_IN:
            outlying = _find_outlying(scatter.model, unlike, measured=scatter.origin == "repeats")
        if outlying is None:
            return replace(scatter, set_aside=tuple(found))
        at = int(np.flatnonzero(kept)[outlying.ramp])
        kept[at] = False
        found.append(SetAside(ramp=at, distance=outlying.distance, ratio=outlying.ratio))


def describe_scatter(
    model: RampModel, unlike: Unlike | None, *, declared: float | None, assumed: float, least: float = 0.0
) -> Scatter:
    """Return the scatter of ramps that are kept, of which those at a knot may be unlike the others."""
    alike = _alike(model, unlike)
    known = (assumed if declared is None else declared) ** 2
    origin = _origin(replace(model, scatter=known), alike, declared)
    measured = origin == "repeats"
    model = weigh_by_scatter(model, alike) if measured else replace(model, scatter=known)
    model = replace(model, scatter=max(model.scatter, least**2))
    told = np.where(alike, model.free, 0.0) if measured else np.ones(model.ramps.y.size)
    variance = float(told.sum() / np.sum(told / model.variances))
    # A measured variance has the noise in it, and counts whole: what the repeats tell of the valve alone errs more.
    share = 1.0 if measured else min(model.scatter / variance, 1.0)
    return Scatter(
        model=model,
        variance=variance,
        # A known scatter does not err, but the error of a ramp's line does.
        degrees=float(np.round(told.sum(), 6)) if measured else OF_LINE / max(1 - share, SMALLEST_SHARE) ** 2,
        share=share,
        origin=origin,
        unlike=unlike if measured else None,
        set_aside=(),
    )


def weigh_by_scatter(model: RampModel, alike: np.ndarray | None = None) -> RampModel:
    """Return the model with the scatter that its residuals show beside the ramps' own errors; zero if they show none.

    `alike` (n,) are the ramps that tell it; None: all.
    """
    from scipy.optimize import brentq

    alike = np.ones(model.ramps.y.size, dtype=bool) if alike is None else alike

    def missing(scatter: float) -> float:
        squares, degrees = _squares(replace(model, scatter=scatter), alike)
        return degrees / squares - 1

    squares, degrees = _squares(replace(model, scatter=0.0), alike)
    if degrees < NO_DEGREES or squares <= degrees:
        return replace(model, scatter=0.0)
    highest = float(np.sum(model.residual[alike] ** 2)) / degrees
    while missing(highest) < 0:
        highest *= 2
    return replace(model, scatter=float(brentq(missing, 0.0, highest, xtol=1e-14, rtol=1e-12)))


def find_unlike_knot(model: RampModel) -> Unlike | None:
    """Return the knot whose ramps scatter more than the others' (Cochran's test), if no single ramp explains it.

    The residuals are compared in units of the noise, and of noise and scatter together: a noise that is known to differ
    is no scatter. Where ramps share a knot by near pressures the sums of squares are nearly independent.
    """
    from scipy.special import betainc

    weighted = weigh_by_scatter(model)
    chances = np.ones((2, model.knots_MPa.size))
    for each, chance in zip((replace(model, scatter=0.0), weighted), chances, strict=True):
        degrees = np.bincount(model.knot, weights=each.free, minlength=chance.size)
        told = degrees > NO_DEGREES
        total = float(degrees[told].sum())
        if told.sum() < 2 or total < LEAST_DEGREES:
            return None
        ratio = np.bincount(model.knot, weights=each.residual**2 / each.variances, minlength=chance.size)
        share = ratio / max(float(ratio[told].sum()), np.finfo(float).tiny)
        more = told & (ratio > degrees)
        chance[more] = told.sum() * (1 - betainc(degrees[more] / 2, (total - degrees[more]) / 2, share[more]))
    worst = chances.max(axis=0)
    knot = int(np.argmin(worst))
    if worst[knot] > UNEQUAL or _one_explains(weighted, knot):
        return None
    return unlike_at(model, knot, float(worst[knot]))


def unlike_at(model: RampModel, knot: int, p_value: float) -> Unlike:
    """Return the scatter at a knot whose ramps are unlike the others."""
    model, there = weigh_by_scatter(model), model.knot == knot
    degrees = float(np.round(model.free[there].sum(), 6))
    squares = float(np.sum(model.residual[there] ** 2))
    return Unlike(knot=knot, variance=squares / degrees, degrees=degrees, p_value=p_value)


def _one_explains(model: RampModel, knot: int) -> bool:
    """Tell whether the knot's ramps are like the others without the one that lies off most."""
    from scipy.special import fdtrc

    ratio = model.residual**2 / np.maximum(model.free, SMALLEST_FREE) / model.variances
    kept = np.arange(ratio.size) != np.argmax(np.where(model.knot == knot, ratio, -1.0))
    if np.sum(model.knot[kept] == knot) < 2:  # of two that differ, either may be the one: the lower one stays, below
        return True
    rest = fit_ramp_model(model.ramps.only(kept), share_knots=False)
    if rest.knots_MPa.size != model.knots_MPa.size:
        return False
    own, others = rest.knot == knot, rest.knot != knot
    rest = weigh_by_scatter(rest, others)
    (squares, degrees), (_, of_others) = _squares(rest, own), _squares(rest, others)
    if min(degrees, of_others) < NO_DEGREES:
        return False
    return float(fdtrc(degrees, of_others, squares / degrees)) > LIKE_OTHERS


def _alike(model: RampModel, unlike: Unlike | None) -> np.ndarray:
    """Return which ramps scatter alike (n,)."""
    return np.ones(model.knot.size, dtype=bool) if unlike is None else model.knot != unlike.knot


def _squares(model: RampModel, ramps: np.ndarray) -> tuple[float, float]:
    """Return the sum of the squared residuals of some ramps over their variances, and its degrees of freedom."""
    projector = model.projector
    squares = (projector @ model.ramps.y) ** 2 / model.variances
    return float(squares[ramps].sum()), float(np.diag(projector)[ramps].sum())


def _find_outlying(model: RampModel, unlike: Unlike | None, *, measured: bool) -> SetAside | None:
    """Return the ramp with the largest externally studentised residual, if that is no chance (Bonferroni).

    Of two that differ and have no third beside them the higher one: the lower one is the safer.
    """
    from scipy.special import stdtr

    residual, free, rest = model.residual, np.maximum(model.free, SMALLEST_FREE), model.variances
    squares, degrees = _squares(model, _alike(model, unlike))
    if degrees <= LEAST_DEGREES + ROUNDED:
        return None
    if measured:
        others = (squares - residual**2 / free / rest) / (degrees - 1)
        rest = np.maximum(others * rest, np.maximum(model.ramps.se, SMALLEST_SD) ** 2)
    ratio = np.abs(residual) / np.sqrt(free * rest)
    if unlike is not None:
        ratio = np.where(model.knot == unlike.knot, 0.0, ratio)
    if 2 * ratio.size * stdtr(degrees - 1 if measured else np.inf, -ratio.max()) > OUTLYING:
        return None
    rows = np.flatnonzero(ratio > (1 - 1e-6) * ratio.max())
    row = int(rows[np.argmax(model.ramps.y[rows])])
    return SetAside(ramp=row, distance=float(residual[row] / free[row]), ratio=float(ratio[row]))


def _origin(known: RampModel, alike: np.ndarray, declared: float | None) -> Origin:
    """Return where the scatter is from: a declared or assumed one counts unless the repeats contradict it."""
    from scipy.special import chdtrc

    squares, degrees = _squares(known, alike)
    if declared is None and degrees >= LEAST_DEGREES - ROUNDED:
        return "repeats"
    if degrees > NO_DEGREES and chdtrc(degrees, squares) < CONTRADICTED:
        return "repeats"
    return "assumed" if declared is None else "declared"
