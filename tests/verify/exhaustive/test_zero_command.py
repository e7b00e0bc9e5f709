"""The drive at zero command against a bound that sags between the tests, with what of a dither counts, and as drawn."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from msgspec import UNSET

from dzdesign.codegen.core.certificate_text import certificate_lines
from dzdesign.core.dither import Dither
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.ceiling import offset_ceiling
from dzdesign.design.certificate import guarded_curve, with_certificates
from dzdesign.design.designing import design
from dzdesign.design.drive_functions import DrivenDither
from dzdesign.design.lot_setting import lot_setting
from dzdesign.design.options import DesignOptions
from dzdesign.identify import identification
from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.exhaustive import all_inputs
from dzdesign.verify.exhaustive.all_inputs import drives_at_zero
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs, differences
from dzdesign.verify.exhaustive.zero_command import counted_dither, guarded_bounds, pressure_drops, zero_command_margins
from tests.conftest import default_options
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
        first, last = bounds.dp_MPa[0], bounds.dp_MPa[-1]
        sag = [0.025 * (dp - first) * (last - dp) for dp in bounds.dp_MPa]
        bounds = replace(bounds, u_lower_V=tuple(np.subtract(bounds.u_lower_V, sag).tolist()))
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


OPTIONS = DesignOptions(dither_Hz=150.0, dither_peak=Fraction(1, 100))


def under(valve, frequency_Hz=150.0, peak=0.01):
    return replace(valve, dithered=Dither(frequency_Hz=frequency_Hz, peak=peak))


def margin_of(compensator):
    exact = ExactLaw(compensator)
    found = differences(exact)
    at_zero = np.array([exact.compare_value(exact.zero, exact.corners(exact.betas(int(dp)))) for dp in found.values])
    return zero_command_margins(exact, found, at_zero, [guarded_bounds(compensator, 1)])[0]


@pytest.mark.parametrize("frequency_Hz", [None, 149.3, 150.0, 156.25, 163.9])
def test_both_derivations_agree(example_valve, frequency_Hz):
    valve = under(example_valve, frequency_Hz) if frequency_Hz else example_valve
    compensator = design(valve, OPTIONS)
    assert counted_dither(compensator) == compensator.dither_reserve_counts
    assert (counted_dither(compensator) == 0) == (frequency_Hz == 156.25)
    assert margin_of(compensator).exceeded == 0
    assert with_certificates(compensator) == compensator


def test_the_offset_is_that_without_a_dither_where_the_bounds_have_it(example_valve):
    """No reserve counted twice: the same nodes as with no dither, but for a whole peak where the ramps had none."""
    without, same, twice = (
        design(valve, options).positive.certificate
        for valve, options in (
            (example_valve, DesignOptions()), (under(example_valve, 156.25), OPTIONS), (example_valve, OPTIONS),
        )
    )  # fmt: skip
    assert same.mean_loss_V == without.mean_loss_V
    assert twice.mean_loss_V == pytest.approx(same.mean_loss_V + 0.1, abs=1e-3)


@pytest.mark.parametrize("frequency_Hz", [None, 150.0])
def test_a_design_that_keeps_nothing_free_is_seen(example_valve, monkeypatch, frequency_Hz):
    valve = under(example_valve, frequency_Hz) if frequency_Hz else example_valve
    monkeypatch.setattr(DrivenDither, "reserve", lambda *_: 0)  # the seeded fault
    margin = margin_of(design(valve, OPTIONS))
    assert margin.exceeded > 0 and margin.margin_V < 0


def test_a_compensator_that_is_edited_to_another_dither_is_refused(example_valve):
    made = design(under(example_valve, 156.25), OPTIONS)
    larger = replace(made, drive_functions=replace(made.drive_functions, dither_counts=900))
    with pytest.raises(RequirementError):
        with_certificates(larger)


def test_the_header_says_whose_dither_the_bound_has(example_valve, wording):
    text = " ".join(certificate_lines(design(under(example_valve), OPTIONS), 1))
    assert "150 Hz 1 %" in text and "dither's peak" not in text


def test_a_lot_of_valves_recorded_under_unlike_dithers_is_refused(example_valve):
    off = replace(OPTIONS, transition=Fraction(0))
    batch = {"one": design(under(example_valve), off), "other": design(under(example_valve, 151.0), off)}
    with pytest.raises(InputError, match="dither of the recordings"):
        lot_setting(batch)


def test_a_play_beside_a_dither_needs_ramps_under_it(example_valve, wording):
    both = replace(OPTIONS, play=True)
    with wording.refusal(InputError):
        design(example_valve, both)
    assert design(under(example_valve), both).drive_functions.has_play
    with pytest.raises(InputError):
        design(replace(under(example_valve), dithered=UNSET), both)


def answers_at_zero(prepared):
    exact, found = prepared.exact, prepared.differences
    return np.array([exact.compare_value(exact.zero, exact.corners(exact.betas(int(dp)))) for dp in found.values])


@pytest.mark.parametrize("premise", ["monotone", "line", "smooth"])
@pytest.mark.parametrize("lowered_V", [0.0, 0.01], ids=["as certified", "a bound that is exceeded"])
def test_the_drawn_bound_is_that_of_the_check(example_tests, monkeypatch, premise, lowered_V):
    valve = identification.identify(example_tests, IdentifyOptions(curve=premise))
    compensator = design(valve, default_options())
    bounds = guarded_bounds(compensator, 1)
    assert valve.positive.curve.premise == premise
    lowered = replace(bounds, u_lower_V=tuple(bound - lowered_V for bound in bounds.u_lower_V))
    monkeypatch.setattr(all_inputs, "guarded_bounds", lambda *_: lowered)

    prepared = PreparedInputs(ExactLaw(compensator, 1))
    at_zero = answers_at_zero(prepared)
    drawn = drives_at_zero(prepared, at_zero)["zero_command_positive.csv"]
    margin = drawn["bound_V"] - drawn["drive_V"]
    (expected,) = zero_command_margins(prepared.exact, prepared.differences, at_zero, [lowered])
    assert margin.min() == pytest.approx(float(expected.margin_V), abs=1.1e-5)  # as rounded to be stored
    assert int((margin < 0).sum()) == expected.exceeded
    assert bool(expected.exceeded) == bool(lowered_V)
