"""The scatter from ramp to ramp: whether it is equal at all knots, which ramps lie off, and how large it is.

Equal scatter is tested first. One variance for all would bound a knot that scatters ten times as much as the others
far too tightly, and its ramps would be set aside one after another. Only where a knot's ramps are like the others'
without one of them is that ramp the whole of it; elsewhere the knot keeps a variance of its own. Then outlying ramps
are set aside. That the valve will not do the same again is a premise, which a warning and the certificate state. Of
three ramps no test tells one that lies off from a wide scatter in which two happen to be alike.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dzdesign.identify.fit.ramp_model import RampModel, Ramps, fit_ramp_model

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
#: Degrees of freedom below which a knot tells nothing of its scatter.
NO_DEGREES = 0.5
#: Probability of the repeats, if the declared or assumed scatter were true, below which theirs counts.
CONTRADICTED = 1e-3


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
    """The model of the ramps that are kept, and their scatter."""

    model: RampModel
    #: Of one ramp, V²: scatter and noise; infinite degrees of freedom where it was not measured.
    variance: float
    degrees: float
    #: Share of it that the next closing has.
    share: float
    origin: Origin
    unlike: Unlike | None
    set_aside: tuple[SetAside, ...]

    @property
    def noise(self) -> float:
        """Mean variance of the ramps by their own lines, V²."""
        return float(np.mean(self.model.ramps.se**2))

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
        outlying = None
        if not least and len(found) < ramps.y.size // ONE_IN:
            outlying = _find_outlying(model, unlike, declared, assumed)
        if outlying is None:
            break
        at = int(np.flatnonzero(kept)[outlying.ramp])
        kept[at] = False
        found.append(SetAside(ramp=at, distance=outlying.distance, ratio=outlying.ratio))
    return describe_scatter(model, unlike, declared=declared, assumed=assumed, least=least, set_aside=tuple(found))


def describe_scatter(
    model: RampModel,
    unlike: Unlike | None,
    *,
    declared: float | None,
    assumed: float,
    least: float = 0.0,
    set_aside: tuple[SetAside, ...] = (),
) -> Scatter:
    """Return the scatter of ramps that are kept, of which those at a knot may be unlike the others."""
    squares, degrees = _squares(model, unlike)
    noise = float(np.mean(model.ramps.se**2))
    origin = _origin(squares, degrees, noise, declared, assumed)
    known = (assumed if declared is None else declared) ** 2 + noise
    measured = origin == "repeats"
    return Scatter(
        model=model,
        variance=max(squares / degrees if measured else known, noise, least**2),
        degrees=degrees if measured else np.inf,
        # A measured variance has the noise in it, and counts whole: what the repeats tell of the valve alone errs more.
        share=1.0 if measured or not known > 0 else 1 - noise / known,
        origin=origin,
        unlike=unlike if measured else None,
        set_aside=set_aside,
    )


def find_unlike_knot(model: RampModel) -> Unlike | None:
    """Return the knot whose ramps scatter more than the others' (Cochran's test), if no single ramp explains it.

    The residuals are compared in units of the noise, and of noise and scatter together: a noise that is known to differ
    is no scatter. Where ramps share a knot by near pressures the sums of squares are nearly independent.
    """
    from scipy.special import betainc

    residual, free = model.projector @ model.ramps.y, np.diag(model.projector)
    knots = np.arange(model.knots_MPa.size)
    degrees = np.bincount(model.knot, weights=free, minlength=knots.size)
    told = knots[degrees > NO_DEGREES]
    total = float(degrees[told].sum())
    if told.size < 2 or total < LEAST_DEGREES:
        return None
    noise = model.ramps.se**2
    of_valve = max(float(residual @ residual) / total - float(noise.mean()), 0.0)
    chances = []
    for each in (0.0, of_valve):
        ratio = np.bincount(model.knot, weights=residual**2 / np.maximum(noise + each, np.finfo(float).tiny))[told]
        share = ratio / max(float(ratio.sum()), np.finfo(float).tiny)
        chance = told.size * (1 - betainc(degrees[told] / 2, (total - degrees[told]) / 2, share))
        chances.append(np.where(ratio > degrees[told], chance, 1.0))
    worst = int(np.argmin(np.max(chances, axis=0)))
    p_value, knot = float(np.max(chances, axis=0)[worst]), int(told[worst])
    if p_value > UNEQUAL or _one_explains(model, residual, knot):
        return None
    return unlike_at(model, knot, p_value)


def unlike_at(model: RampModel, knot: int, p_value: float) -> Unlike:
    """Return the scatter at a knot whose ramps are unlike the others."""
    there = model.knot == knot
    degrees = float(np.diag(model.projector)[there].sum())
    squares = float(np.sum((model.projector @ model.ramps.y)[there] ** 2))
    return Unlike(knot=knot, variance=squares / degrees, degrees=degrees, p_value=p_value)


def _one_explains(model: RampModel, residual: np.ndarray, knot: int) -> bool:
    """Tell whether the knot's ramps are like the others without the one that lies off most."""
    from scipy.special import fdtrc

    free = np.maximum(np.diag(model.projector), 1e-6)
    worst = int(np.argmax(np.where(model.knot == knot, np.abs(residual) / np.sqrt(free), -1.0)))
    kept = np.arange(residual.size) != worst
    if np.sum(model.knot[kept] == knot) < 2:  # of two that differ, either may be the one: the lower one stays, below
        return True
    rest = fit_ramp_model(model.ramps.only(kept), share_knots=False)
    if rest.knots_MPa.size != model.knots_MPa.size:
        return False
    left, free = rest.projector @ rest.ramps.y, np.diag(rest.projector)
    own, others = rest.knot == knot, rest.knot != knot
    degrees = [float(free[part].sum()) for part in (own, others)]
    if min(degrees) < NO_DEGREES:
        return False
    noise = float(np.mean(rest.ramps.se**2))
    variance = [max(float(np.sum(left[part] ** 2)), of * noise) / of
                for part, of in zip((own, others), degrees, strict=True)]  # fmt: skip
    return float(fdtrc(*degrees, variance[0] / variance[1])) > LIKE_OTHERS


def _squares(model: RampModel, unlike: Unlike | None) -> tuple[float, float]:
    """Return the sum of squared residuals, V², and the degrees of freedom of the ramps that scatter alike."""
    residual, free = model.projector @ model.ramps.y, np.diag(model.projector)
    alike = np.ones(residual.size, dtype=bool) if unlike is None else model.knot != unlike.knot
    return float(np.sum(residual[alike] ** 2)), float(np.round(free[alike].sum(), 6))


def _find_outlying(model: RampModel, unlike: Unlike | None, declared: float | None, assumed: float) -> SetAside | None:
    """Return the ramp with the largest externally studentised residual, if that is no chance (Bonferroni).

    Of two that differ and have no third beside them the higher one: the lower one is the safer.
    """
    from scipy.special import stdtr

    residual, own = model.projector @ model.ramps.y, np.maximum(np.diag(model.projector), 1e-6)
    squares, degrees = _squares(model, unlike)
    noise = float(np.mean(model.ramps.se**2))
    if degrees <= LEAST_DEGREES:
        return None
    if _origin(squares, degrees, noise, declared, assumed) == "repeats":
        rest, of_rest = np.maximum((squares - residual**2 / own) / (degrees - 1), noise), degrees - 1
    else:
        rest, of_rest = np.full(own.size, (assumed if declared is None else declared) ** 2 + noise), 1e6
    ratio = np.abs(residual) / np.sqrt(own * rest)
    if unlike is not None:
        ratio = np.where(model.knot == unlike.knot, 0.0, ratio)
    if 2 * ratio.size * stdtr(of_rest, -ratio.max()) > OUTLYING:
        return None
    rows = np.flatnonzero(ratio > (1 - 1e-6) * ratio.max())
    row = int(rows[np.argmax(model.ramps.y[rows])])
    return SetAside(ramp=row, distance=float(residual[row] / own[row]), ratio=float(ratio[row]))


def _origin(squares: float, degrees: float, noise: float, declared: float | None, assumed: float) -> Origin:
    """Return where the scatter is from: a declared or assumed one counts unless the repeats contradict it."""
    from scipy.special import chdtrc

    if declared is None and degrees >= LEAST_DEGREES:
        return "repeats"
    expected = max((assumed if declared is None else declared) ** 2 + noise, np.finfo(float).tiny)
    if degrees > NO_DEGREES and chdtrc(degrees, squares / expected) < CONTRADICTED:
        return "repeats"
    return "assumed" if declared is None else "declared"
