"""What of a dither counts as drive at zero command, derived anew: a design that keeps too little free is seen."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from msgspec import UNSET

from dzdesign.codegen.core.certificate_text import certificate_lines
from dzdesign.core.dither import Dither, DrivenDither
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.certificate import with_certificates
from dzdesign.design.designing import design
from dzdesign.design.lot_setting import lot_setting
from dzdesign.design.options import DesignOptions
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import differences
from dzdesign.verify.exhaustive.zero_command import counted_dither, guarded_bounds, zero_command_margins

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
