"""From guarded thresholds to certified curves: the premise that is taken, its bound, and the law's offset under it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dzdesign.core.artefact_types import own_result
from dzdesign.core.errors import InputError, InternalError
from dzdesign.core.recorded_units import Worded, worded
from dzdesign.identify.constants import MPA, REFUSED, Premise
from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, FINEST_ERROR
from dzdesign.identify.fitting.constrained_fits import fit_offset
from dzdesign.identify.fitting.continuing import AtTests, bound_above
from dzdesign.identify.fitting.error_statement import budget_of_free, stated_errors
from dzdesign.identify.fitting.guarded_thresholds import GuardedThreshold
from dzdesign.identify.fitting.offsets import OffsetUnderBound, fit_offset_under
from dzdesign.identify.fitting.premises import bound_line, find_curvature
from dzdesign.identify.fitting.vertices import Vertex, find_vertex
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.above_tests import AboveTests
from dzdesign.identify.valve.certified_bound import CertifiedBound
from dzdesign.identify.valve.estimated_curvature import FEWEST_FOR_CURVATURE
from dzdesign.identify.valve.guard_curve import CertifiedCurve, Guard, PremiseCheck
from dzdesign.identify.valve.quantity_types import LARGEST_BETA
from dzdesign.identify.valve.staircase import Direction, staircase


@dataclass(frozen=True, slots=True, kw_only=True)
class Tested:
    """What all guards of a side have in common."""

    #: Pressure drops of the tests, MPa, rising; empty where it is unknown.
    dp_MPa: np.ndarray
    #: Index of the test at dP0.
    reference: int
    direction: Direction
    #: Knees on opening, or on closing where no other branch was recorded, V (T,).
    opens_V: np.ndarray
    options: IdentifyOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundUnderPremise:
    """Simultaneous bounds at the tests under one premise, V (T,), and what holds between them."""

    premise: Premise
    value: np.ndarray
    se: np.ndarray
    lower: np.ndarray
    #: M between neighbouring tests, V/MPa²; empty for `monotone`.
    curvature: np.ndarray
    p_value: float | None
    #: Where the tests show, significantly, that a threshold that is to be `monotone` is lowest between two of them.
    vertex: Vertex | None = None

    @property
    def refused(self) -> bool:
        """Whether the tests contradict the premise."""
        return self.p_value is not None and self.p_value < REFUSED


def bounds_under_premises(guarded: GuardedThreshold, tested: Tested) -> dict[Premise, BoundUnderPremise]:
    """Return the bounds under every premise that these tests allow to be taken, the strongest first."""
    free, between, dp, options = guarded.free, guarded.between, tested.dp_MPa, tested.options
    covariance = between.covariance_of_mean(free.se) + (FINEST_ERROR * options.u_max) ** 2 * np.eye(dp.size)
    degrees = float(between.degrees_of_freedom(free.se, DEGREES_OF_FREEDOM).min())
    found = [_monotone(guarded, find_vertex(dp, free.value, covariance, degrees))]
    declared = None if options.curvature is None else options.curvature * MPA**2
    if dp.size > 1 and (dp.size >= FEWEST_FOR_CURVATURE or options.curvature is not None):
        bends = find_curvature(dp, free.value, covariance, degrees, declared)
        smooth = BoundUnderPremise(
            premise="smooth", value=free.value, se=free.se, lower=free.bound, curvature=bends.allowed,
            p_value=bends.p_value,
        )  # fmt: skip
        found.insert(0, smooth)
    if dp.size > 1:
        budget = budget_of_free(guarded, options.confidence)
        fit = bound_line(dp, free.value, free.se, budget, between, confidence=options.confidence, u_max=options.u_max)
        line = BoundUnderPremise(
            premise="line", value=fit.value, se=free.se, lower=fit.bound, curvature=np.zeros(dp.size - 1),
            p_value=fit.p_value,
        )  # fmt: skip
        found.insert(0, line)
    return {each.premise: each for each in found}


def _monotone(guarded: GuardedThreshold, vertex: Vertex | None) -> BoundUnderPremise:
    """Return the bounds of a threshold that runs one way: two tests, of its steps and between them, each at 1 %."""
    ordered = guarded.ordered
    tested = [p for p in (guarded.one_way_p, vertex.p_value if vertex else None) if p is not None]
    return BoundUnderPremise(
        premise="monotone", value=ordered.value, se=ordered.se, lower=ordered.bound, curvature=np.zeros(0),
        p_value=min(tested, default=None),
        vertex=vertex if vertex and vertex.significant else None,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Certified:
    """A certified curve, which constraints of its offset hold with equality, and what the tests say against premises.

    `refused` is a premise that was asked for; the `vertex` contradicts the curve, or what would certify more.
    """

    curve: CertifiedCurve
    active: tuple[str, ...]
    refused: PremiseCheck | None
    vertex: Vertex | None


def certify_thresholds(thresholds: Mapping[Guard, GuardedThreshold], tested: Tested) -> dict[Guard, Certified]:
    """Fit the law's offset under the bound of the first threshold, which must succeed, and of others.

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
            curves[name] = _certify(threshold, tested)
        except (InputError, InternalError):  # a guard beside the default one is left out
            if not curves:
                raise
    return curves


@own_result()
def _certify(guarded: GuardedThreshold, tested: Tested) -> Certified:
    """Take the premise that is asked for, or the strongest of the default ones, unless the tests refuse it."""
    bounds = bounds_under_premises(guarded, tested)
    offsets: dict[Premise, OffsetUnderBound] = {}
    failures: dict[Premise, InputError] = {}
    for premise, bound in bounds.items():
        try:
            offsets[premise] = _fit_offset(bound, tested)
        except InputError as error:
            failures[premise] = error
    checks = {premise: _check(bound, offsets.get(premise), tested) for premise, bound in bounds.items()}
    one_way = not (guarded.departs or bounds["monotone"].refused)
    taken, refused = _take(bounds, offsets, _asked(tested.options), one_way=one_way)
    if taken not in offsets:
        raise _too_much_sag(bounds[taken]) or failures[taken]
    bound, offset, vertex = bounds[taken], offsets[taken], bounds["monotone"].vertex
    declared: Literal["declared", "estimated"] = "declared" if tested.options.curvature is not None else "estimated"
    with_dp = tested.dp_MPa.size > 0 and not np.isnan(tested.dp_MPa).any()
    value = np.maximum(bound.value, bound.lower)
    curve = CertifiedCurve(
        premise=taken,
        premises=tuple(checks.values()),
        curvature_V_MPa2=tuple(map(float, bound.curvature)),
        curvature_is=declared if taken == "smooth" else None,
        dp_MPa=tuple(map(float, tested.dp_MPa)) if with_dp else (),
        u_threshold_V=tuple(map(float, value)),
        u_lower_V=tuple(map(float, bound.lower)),
        errors=stated_errors(guarded, taken, bound.se, value, bound.lower, tested.options.confidence),
        u_min0_V=offset.u_min0,
        offset_dp_MPa=tuple(map(float, offset.dp_MPa)) if with_dp else (),
        offset_V=tuple(map(float, offset.offset)),
        above=_above(bound, guarded, tested) if with_dp and tested.dp_MPa.size > 1 else None,
    )
    costs = taken == "monotone" or ("monotone" in offsets and offsets["monotone"].mean > offset.mean)
    return Certified(
        curve=curve, active=offset.active, refused=checks[refused] if refused else None,
        vertex=vertex if costs else None,
    )  # fmt: skip


def _above(bound: BoundUnderPremise, guarded: GuardedThreshold, tested: Tested) -> AboveTests:
    """Continue the bound above the last test."""
    dp, lower = tested.dp_MPa, bound.lower
    whole = CertifiedBound.of(bound.premise, dp.tolist(), lower.tolist(), bound.curvature.tolist(), tested.direction)
    at_tests = AtTests(
        premise=bound.premise,
        trend=tested.direction,
        dp_MPa=dp,
        value=np.maximum(bound.value, lower),
        last_lower=float(whole.pieces[-1].at(whole.dp_MPa[1])),
    )
    return bound_above(at_tests, guarded, tested.options)


def _asked(options: IdentifyOptions) -> Premise | None:
    """Return the premise that the engineer states: who declares a curvature states `smooth`."""
    return "smooth" if options.curvature is not None else options.curve


def _take(
    bounds: Mapping[Premise, BoundUnderPremise],
    offsets: Mapping[Premise, OffsetUnderBound],
    asked: Premise | None,
    *,
    one_way: bool,
) -> tuple[Premise, Premise | None]:
    """Return the premise to take, and the one that was asked for but that the tests refuse.

    By default `smooth`, where its curvature can be told and it certifies more, on average, than `monotone`: a curvature
    that the tests know too badly supports nothing. But it certifies the less the more the tests bend, so where they
    bend to a vertex between two of them it is taken whatever it certifies; so it is where they do not run `one_way`.

    Raises
    ------
    InputError
        If the premise that is asked for needs more tests, or if the tests show a vertex and no curvature is supported.
    """
    # One that runs the wrong way has paid for it: its bounds are lowered.
    refused = asked if asked in ("line", "smooth") and asked in bounds and bounds[asked].refused else None
    if asked is not None and asked not in bounds:
        raise InputError(
            f"--curve {asked} with {next(iter(bounds.values())).lower.size} pressure drop(s): a curvature is estimated "
            f"from {FEWEST_FOR_CURVATURE} or more; declare it by --curvature, or record more tests"
        )
    if asked is not None and refused is None:
        return asked, None
    smooth, vertex = bounds.get("smooth"), bounds["monotone"].vertex
    if refused == "smooth" or smooth is None or smooth.refused or "smooth" not in offsets:
        if vertex:
            raise InputError(_no_premise(vertex))
        return "monotone", refused
    better = vertex or not one_way or "monotone" not in offsets or offsets["smooth"].mean > offsets["monotone"].mean
    return ("smooth" if better else "monotone"), refused


def _too_much_sag(bound: BoundUnderPremise) -> InputError | None:
    """Say that the curvature leaves no offset where the bounds at the tests themselves would."""
    if bound.premise != "smooth" or bound.lower.min() <= 0:
        return None
    largest = 1e3 * float(bound.curvature.max())
    return InputError(
        worded(
            "with a curvature M of up to {largest:.3g mV/MPa²} the threshold may sag between the tests so far that no "
            "positive offset is left, or one that varies beyond bounds; record tests between, declare the valve's "
            "--curvature if it is less, or ask for another --curve",
            largest=largest,
        )
    )


def _no_premise(vertex: Vertex) -> Worded:
    """Say that neither a direction nor a curvature is supported, and which test would help."""
    return worded(
        "the tests bend so much that the threshold seems lowest between {low:.3g #MPa} and {high:.3g MPa}, "
        "{depth:.3g mV} below both (p = {p:.2g}): no threshold that runs one way, and no curvature that leaves an "
        "offset, agrees with them. Record a test at about {at:.2g MPa}, declare the largest --curvature, or, if you "
        "know that it runs one way there, give --curve monotone",
        low=vertex.from_MPa, high=vertex.to_MPa, depth=1e3 * vertex.depth_V, p=vertex.p_value, at=vertex.at_MPa,
    )  # fmt: skip


def _fit_offset(bound: BoundUnderPremise, tested: Tested) -> OffsetUnderBound:
    """Fit the law's offset under a bound."""
    u_max, dp = tested.options.u_max, tested.dp_MPa
    if bound.premise == "monotone":
        _, ceiling = staircase(bound.lower, tested.direction)
        fit = fit_offset(bound.value, bound.se, ceiling, tested.reference, u_max=u_max, trend=tested.direction)
        active = tuple(f"offset at test {row + 1}" for row, holds in enumerate(fit.active) if holds)
        found = OffsetUnderBound(dp_MPa=dp, offset=fit.u_min0 * fit.beta, u_min0=fit.u_min0, active=active)
    else:
        found = fit_offset_under(
            CertifiedBound.of(bound.premise, dp.tolist(), bound.lower.tolist(), bound.curvature.tolist(),
                              tested.direction),
            dp, bound.value, tested.reference, trend=tested.direction, u_max=u_max,
        )  # fmt: skip
    beta = found.offset / found.u_min0
    if beta.max() > LARGEST_BETA:
        raise InputError(
            f"beta(dP) reaches {beta.max():.2f}, expected at most {LARGEST_BETA}: the threshold at dP0 is less "
            "than half of that at another pressure drop; give the pressure drop with the largest threshold by --dp0"
        )
    return found


def _check(bound: BoundUnderPremise, offset: OffsetUnderBound | None, tested: Tested) -> PremiseCheck:
    """Return a premise's test, and the largest dead zone on opening that a law without transition would leave.

    Between the tests too, where the offset may sag and the opening knee is taken as straight: by the tests alone a
    curvature would look cheaper than it is. Both are linear between their nodes, so one of these has the largest.
    """
    left = None
    if offset is not None:
        offset_V, opens_V = offset.offset, tested.opens_V
        if offset.dp_MPa.size > 1:
            nodes = np.union1d(offset.dp_MPa, tested.dp_MPa)
            offset_V = np.interp(nodes, offset.dp_MPa, offset_V)
            opens_V = np.interp(nodes, tested.dp_MPa, opens_V)
        above = (opens_V - offset_V) / np.maximum(tested.options.u_max - offset_V, np.finfo(float).tiny)
        left = float(np.clip(above.max(), 0.0, 1.0))
    return PremiseCheck(premise=bound.premise, lack_of_fit_p=bound.p_value, dead_zone_over_u_max=left)
