"""From guarded thresholds to certified curves: the class that is taken, its bound, and the law's offset under it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dzdesign.core.artefact_types import own_result
from dzdesign.core.errors import InputError, InternalError
from dzdesign.identify.constants import MPA, PREMISES, REFUSED, Direction, Premise, Shown
from dzdesign.identify.fit.certificate import ROUNDING_V as ROUNDING
from dzdesign.identify.fit.certificate import (
    Certificate,
    NoCurveAgreesError,
    certify,
    continue_above,
    running_minimum,
)
from dzdesign.identify.fit.curve_class import FEWEST_FOR_BENDS, CurveClass, Kind, find_class, lack_of_fit
from dzdesign.identify.fit.scatter import Scatter
from dzdesign.identify.fitting.guarded_thresholds import GuardedThreshold
from dzdesign.identify.knees.between_ramps import DECIMALS
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.bound_proof import BoundProof
from dzdesign.identify.valve.guard_curve import AboveTests, CertifiedCurve, CurvePremise, Guard, PremiseCheck
from dzdesign.identify.valve.quantity_types import LARGEST_BETA

#: The premise of each class, as valve.json names it.
PREMISE_OF: dict[Kind, CurvePremise] = {
    "bends": "smooth", "line": "line", "smooth": "smooth", "monotone": "monotone", "points": "none"
}  # fmt: skip
WAYS: dict[Direction, int] = {"decreasing": -1, "flat": 0, "increasing": 1}
#: Largest pressure drop that valve.json holds, MPa, and what a bound is at least, V.
LARGEST_MPa, LOWEST_V = 1e3, -1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class Tested:
    """What all guards of a side have in common."""

    #: Pressure drops of the tests, MPa, rising; NaN where it is unknown.
    dp_MPa: np.ndarray
    #: Index of the test at dP0.
    reference: int
    direction: Direction
    #: Knees on opening, or on closing where no other branch was recorded, V (T,).
    opens_V: np.ndarray
    options: IdentifyOptions

    @property
    def with_dp(self) -> bool:
        """Whether the pressure drops are known."""
        return not bool(np.isnan(self.dp_MPa).any())


@dataclass(frozen=True, slots=True, kw_only=True)
class Certified:
    """A certified curve, the scatter of its ramps, and a premise that was asked for and that the tests refuse."""

    curve: CertifiedCurve
    #: The class that its bound rests on.
    curves: CurveClass
    scatter: Scatter
    refused: PremiseCheck | None
    #: Probability of tests like these if the threshold ran one way; None where they can't tell.
    one_way_p: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bounded:
    """A class, its certificate, and the offset on its nodes, V."""

    curves: CurveClass
    certificate: Certificate
    bound: np.ndarray
    offset: np.ndarray


def certify_thresholds(thresholds: Mapping[Guard, GuardedThreshold], tested: Tested) -> dict[Guard, Certified]:
    """Certify the offset under the bound of the first threshold, which must succeed, and of others.

    One of the others whose bounds leave no positive offset is left out: `design` then refuses that guard and says which
    there are.

    Raises
    ------
    InputError
        If the first threshold's bounds leave no positive offset.
    """
    curves: dict[Guard, Certified] = {}
    for name, threshold in thresholds.items():
        try:
            curves[name] = _certify(threshold, tested, compared=not curves)
        except (InputError, InternalError):  # a guard beside the default one is left out
            if not curves:
                raise
    return curves


@own_result()
def _certify(guarded: GuardedThreshold, tested: Tested, *, compared: bool) -> Certified:
    """Take the premise that is asked for, unless the tests refuse it; else what bends from test to test.

    `compared` states beside it what the other premises would leave.
    """
    options = tested.options
    scatter = guarded.scatter(options)
    asked, curvature = _asked(options, scatter), None if options.curvature is None else options.curvature * MPA**2
    refused = None
    if asked is not None:
        check = _checked(scatter, asked, curvature, tested)
        if check.lack_of_fit_p is not None and check.lack_of_fit_p < REFUSED:
            asked, refused = None, check
    try:
        bounded = _offset_below(scatter, asked, curvature, tested)
    except NoCurveAgreesError:
        if asked is None:
            raise
        bounded, refused = _offset_below(scatter, None, curvature, tested), check
    checks = []
    several = scatter.model.knots_MPa.size > 1
    for premise in PREMISES if several else ():
        known = premise != "smooth" or curvature is not None or scatter.model.knots_MPa.size >= FEWEST_FOR_BENDS
        if known and (compared or premise == PREMISE_OF[bounded.curves.kind]):
            checks.append(_checked(scatter, premise, curvature, tested))
    one_way_p = None
    if several and tested.direction != "flat":
        one_way_p = lack_of_fit(scatter, curve="monotone", curvature=None, direction=WAYS[tested.direction])
    return Certified(
        curve=_curve(guarded, scatter, bounded, curvature, tuple(checks), tested),
        curves=bounded.curves,
        scatter=scatter,
        refused=refused,
        one_way_p=one_way_p,
    )


def _asked(options: IdentifyOptions, scatter: Scatter) -> Premise | None:
    """Return the premise that the engineer states: who declares a curvature states `smooth`.

    Raises
    ------
    InputError
        If a curvature is to be estimated from too few tests.
    """
    if options.curve == "smooth" and options.curvature is None:
        count = scatter.model.knots_MPa.size
        if count < FEWEST_FOR_BENDS:
            raise InputError(
                f"--curve smooth with {count} pressure drop(s): a curvature is estimated from {FEWEST_FOR_BENDS} or "
                "more; declare it by --curvature, or record more tests"
            )
        return None
    return "smooth" if options.curvature is not None else options.curve


def _checked(scatter: Scatter, premise: Premise, curvature: float | None, tested: Tested) -> PremiseCheck:
    """Return how a premise fits the tests, and the dead zone that it would leave."""
    way = WAYS[tested.direction] if premise == "monotone" else 0
    estimated = premise == "smooth" and curvature is None
    p_value = None if estimated else lack_of_fit(scatter, curve=premise, curvature=curvature, direction=way)
    try:
        left = _dead_zone_left(_offset_below(scatter, None if estimated else premise, curvature, tested), tested)
    except InputError:
        left = None
    return PremiseCheck(premise=premise, lack_of_fit_p=p_value, dead_zone_over_u_max=left)


def _offset_below(scatter: Scatter, asked: Premise | None, curvature: float | None, tested: Tested) -> _Bounded:
    """Return the bound under a premise, None: what bends from test to test, and the law's offset under it.

    Raises
    ------
    InputError
        If no curve agrees with the tests, or no positive offset is left.
    """
    way = WAYS[tested.direction]
    several = scatter.model.knots_MPa.size > 1
    curves = find_class(scatter, curve=asked if several else None, curvature=curvature, direction=way)
    certificate = certify(scatter, curves, confidence=tested.options.confidence)
    bound = np.maximum(np.floor(certificate.bound * 10**DECIMALS - 1) / 10**DECIMALS, LOWEST_V)
    offset = running_minimum(bound, way) - ROUNDING
    if offset.min() <= 0:
        raise InputError(_why_none(scatter, curves, bound))
    at_dp0 = float(np.interp(tested.dp_MPa[tested.reference], curves.grid_MPa, offset)) if several else offset[0]
    beta = offset / at_dp0
    if beta.max() > LARGEST_BETA:
        raise InputError(
            f"beta(dP) reaches {beta.max():.2f}, expected at most {LARGEST_BETA}: the threshold at dP0 is less "
            "than half of that at another pressure drop; give the pressure drop with the largest threshold by --dp0"
        )
    return _Bounded(curves=curves, certificate=certificate, bound=bound, offset=offset)


def _why_none(scatter: Scatter, curves: CurveClass, bound: np.ndarray) -> str:
    """Say why no offset is left: the threshold where its bound is lowest, and what the bound takes off."""
    ramps, worst = scatter.model.ramps, int(bound.argmin())
    nearest = int(np.argmin(np.abs(ramps.dp_MPa - curves.grid_MPa[worst])))
    budget = ramps.shared + float(ramps.budgets[nearest])
    known = "" if scatter.origin != "repeats" else f" (degrees of freedom: {scatter.degrees:.0f})"
    return (
        f"the threshold's lower bound is {Shown(bound[worst]):.3f V}, not above zero. There the threshold is "
        f"{Shown(ramps.y[nearest]):.4g V}, with a standard deviation of "
        f"{Shown(1e3 * float(np.sqrt(scatter.variance))):.0f mV} from ramp to ramp{known} and a systematic error of up "
        f"to {Shown(1e3 * budget):.0f mV}; record more or slower ramps, leave out one that differs, or check the "
        "meter's zero"
    )


def _dead_zone_left(bounded: _Bounded, tested: Tested) -> float:
    """Return the largest dead zone on opening that a law without transition would leave, over u_max."""
    opens_V = tested.opens_V
    if bounded.offset.size > 1:
        opens_V = np.interp(bounded.curves.grid_MPa, tested.dp_MPa, opens_V)
    above = (opens_V - bounded.offset) / np.maximum(tested.options.u_max - bounded.offset, np.finfo(float).tiny)
    return float(np.clip(above.max(), 0.0, 1.0))


def _curve(
    guarded: GuardedThreshold,
    scatter: Scatter,
    bounded: _Bounded,
    curvature: float | None,
    checks: tuple[PremiseCheck, ...],
    tested: Tested,
) -> CertifiedCurve:
    """Return the curve for valve.json."""
    grid, kind = bounded.curves.grid_MPa, bounded.curves.kind
    nodes = tuple(map(float, grid)) if tested.with_dp else ()
    at_tests = np.interp(tested.dp_MPa, grid, bounded.bound) if tested.with_dp else bounded.bound
    at_dp0 = bounded.offset[0]
    if tested.with_dp and grid.size > 1:
        at_dp0 = np.interp(tested.dp_MPa[tested.reference], grid, bounded.offset)
    smooth = PREMISE_OF[kind] == "smooth"
    declared, assumed = tested.options.scatter_V
    return CertifiedCurve(
        premise=PREMISE_OF[kind],
        premises=checks,
        curvature_V_MPa2=float(bounded.curves.density.max()) if smooth else None,
        curvature_is=("declared" if kind == "smooth" else "estimated") if smooth else None,
        dp_MPa=tuple(map(float, tested.dp_MPa)) if tested.with_dp else (),
        u_threshold_V=tuple(map(float, np.maximum(guarded.threshold.value, at_tests))),
        u_lower_V=tuple(map(float, at_tests)),
        bound_dp_MPa=nodes,
        bound_V=tuple(map(float, bounded.bound)),
        proof=BoundProof.of(
            scatter, bounded.certificate, sources=guarded.sources, y=guarded.ramps.y,
            known_sd_V=assumed if declared is None else declared, least_sd_V=guarded.least_sd, curvature=curvature,
            with_dp=tested.with_dp,
        ),
        u_min0_V=float(at_dp0),
        offset_V=tuple(map(float, bounded.offset)),
        above=_above(scatter, bounded, tested),
    )  # fmt: skip


def _above(scatter: Scatter, bounded: _Bounded, tested: Tested) -> AboveTests | None:
    """Continue the bound above the last test, up to the first node where it says nothing any more."""
    if not tested.with_dp or tested.dp_MPa.size < 2:
        return None
    above = continue_above(scatter, bounded.certificate)
    if above is None:
        return None
    lower = np.floor(np.minimum(above.bound, bounded.bound[-1]) * 10**DECIMALS) / 10**DECIMALS
    lower = np.maximum(lower, LOWEST_V)
    ends = np.flatnonzero((lower[1:] <= 0) | (above.dp_MPa[1:] > LARGEST_MPa))
    kept = slice(0, int(ends[0]) + 2 if ends.size else lower.size)
    nodes = np.minimum(above.dp_MPa[kept], LARGEST_MPa)
    return AboveTests(
        certified=above.certified, dp_MPa=tuple(map(float, nodes)), u_lower_V=tuple(map(float, lower[kept]))
    )
