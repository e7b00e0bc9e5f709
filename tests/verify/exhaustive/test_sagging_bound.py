"""The drive at zero command against a bound that sags between the tests, and the faults that it must find."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.design.ceiling import offset_ceiling
from dzdesign.design.certificate import guarded_curve
from dzdesign.design.designing import design
from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import differences
from dzdesign.verify.exhaustive.zero_command import guarded_bounds, pressure_drops, zero_command_margins
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp


@pytest.fixture(scope="module", params=["line", "smooth"])
def drawn(request):
    """A compensator under a premise, its differences of codes, the law's own drive there and the valve's bounds."""
    tests = [
        synthetic_ramp(dp, Truth(knee_rising=5.6 - 0.06 * dp, slope=4 * dp**0.5, noise=0.02)) for dp in (1, 2, 3.5, 5)
    ]
    options = IdentifyOptions(
        meter_lag=0.0, curve=request.param, curvature=2e-14 if request.param == "smooth" else None
    )
    compensator = design(identify(tests, options))
    exact = ExactLaw(compensator)
    found = differences(exact)
    at_zero = np.array([exact.compare_value(exact.zero, exact.corners(exact.betas(int(dp)))) for dp in found.values])
    return compensator, exact, found, at_zero, guarded_bounds(compensator, 1)


def test_the_laws_own_drive_stays_below_it_and_the_margin_is_exact(drawn):
    compensator, exact, found, at_zero, bounds = drawn
    (margin,) = zero_command_margins(exact, found, at_zero, [bounds])
    assert margin.exceeded == 0 and 0 <= margin.margin_V < Fraction(1, 100)
    drops = pressure_drops(exact, found, {Fraction(repr(dp)) for dp in bounds.dp_MPa})
    unit_V, bound = compensator.u_max_V / exact.compare_max, bounds.bound()
    left = []
    for row in np.flatnonzero(drops.made)[::7]:
        low, high = (Fraction(int(each[row]), drops.scale) for each in (drops.least, drops.most))
        low, high = max(low, bound.dp_MPa[0]), min(high, bound.dp_MPa[1])
        if low <= high:
            places = [low + (high - low) * share / 8 for share in range(9)]
            left.append(min(bound.at(place) for place in places) - unit_V * int(at_zero[row]))
    assert margin.margin_V <= min(left) + Fraction(1, 10**7)
    assert float(min(left) - margin.margin_V) < 1e-3


@pytest.mark.parametrize("fault", ["sags deeper", "a test lower", "drive higher"])
def test_a_seeded_fault_is_found(drawn, fault):
    compensator, exact, found, at_zero, bounds = drawn
    higher = 0
    if fault == "sags deeper":
        bounds = replace(bounds, curvature_V_MPa2=tuple(bend + 0.05 for bend in bounds.curvature_V_MPa2))
    elif fault == "a test lower":
        lower = list(bounds.u_lower_V)
        lower[2] -= 0.02
        bounds = replace(bounds, u_lower_V=tuple(lower))
    else:
        (margin,) = zero_command_margins(exact, found, at_zero, [bounds])
        higher = int(margin.margin_V / (compensator.u_max_V / exact.compare_max)) + 1
    (margin,) = zero_command_margins(exact, found, at_zero + higher, [bounds])
    assert margin.exceeded > 0 and margin.margin_V < 0


def test_design_refuses_an_offset_that_lies_on_the_chords(drawn):
    """The chord of two bounds is a millivolt above what a curvature of 20 mV/MPa² leaves between them."""
    compensator, *_ = drawn
    side = compensator.valve.positive
    chords = replace(
        guarded_curve(side, "closing", "hold"),
        dp_MPa=tuple(Fraction(repr(dp)) for dp in side.curve.dp_MPa),
        offset_V=tuple(Fraction(repr(value)) for value in side.curve.u_lower_V),
    )
    if side.curve.premise == "line":  # of a straight threshold the chords are the bound
        assert min(offset_ceiling(chords, compensator.u_max_V, compensator.allowance(1)).limit) > 0
        return
    with pytest.raises(RequirementError):
        offset_ceiling(chords, compensator.u_max_V, compensator.allowance(1))
