"""The dither of recordings beside the drive's: what is read, what is refused, what is kept free below the offset."""

from fractions import Fraction

import pytest

from dzdesign.core.artefact_types import RuleError
from dzdesign.core.dither import Dither, read_dithered
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED, CommandUnit, RecordedUnits
from dzdesign.design.drive_functions import DrivenDither

IN_mA = RecordedUnits(command=CommandUnit(unit="mA", at_zero=4.0, factor=1.6))
FALLING = RecordedUnits(command=CommandUnit(unit="codes", at_zero=4000.0, factor=-400.0))


@pytest.mark.parametrize(
    ("text", "units", "peak"),
    [
        ("150 Hz 1 %", AS_COMPUTED, 0.01),
        ("0.15 kHz 1%", AS_COMPUTED, 0.01),
        ("150 Hz 100 mV", AS_COMPUTED, 0.01),
        ("150 Hz 0.1 V", IN_mA, 0.01),
        ("150 Hz 0.16 mA", IN_mA, 0.01),
        ("150Hz 40 codes", FALLING, 0.01),
    ],
)
def test_a_peak_is_a_share_of_full_command_or_in_the_commands_unit(text, units, peak):
    dither = read_dithered(text, "--dithered").of(units, 10.0)
    assert dither.frequency_Hz == pytest.approx(150) and dither.peak == pytest.approx(peak)


@pytest.mark.parametrize(
    "text", ["150 Hz", "1 %", "150 1 %", "150 Hz 0.01", "150 Hz -1 %", "1 kHz 1 %", "150 Hz 11 %", "150 Hz 0 %", "off"]
)
def test_what_is_no_dither_is_refused(text, wording):
    with wording.refusal(InputError):
        read_dithered(text, "--dithered")


def test_a_unit_that_the_command_was_not_recorded_in_is_refused(wording):
    with wording.refusal(InputError):
        read_dithered("150 Hz 0.16 mA", "--dithered").of(AS_COMPUTED, 10.0)


def test_a_dither_checks_itself():
    for change in ({"frequency_Hz": 99.0}, {"peak": 0.0}, {"peak": 0.2}):
        with pytest.raises(RuleError):
            Dither(**{"frequency_Hz": 150.0, "peak": 0.01, **change})


def driven(counts=600, ticks=8):
    return DrivenDither(counts=counts, compare_max=60000, frequency_Hz=Fraction(2500, 2 * ticks))


def test_of_ramps_without_a_dither_the_whole_peak_is_kept_free():
    assert driven().reserve(None) == 600 and driven(counts=0).reserve(None) == 0
    driven().check(None)


def test_of_ramps_under_the_same_dither_nothing_is_kept_free_twice():
    same = Dither(frequency_Hz=156.25, peak=0.01)
    driven().check(same)
    assert driven().reserve(same) == 0


@pytest.mark.parametrize(
    ("frequency_Hz", "peak", "reserve"),
    [
        (150.0, 0.01, 48),  # 600 (1 - (150 / 156.25)²) = 47.04
        (160.0, 0.01, 30),  # 600 ((160 / 156.25)² - 1) = 29.15
        (156.25, 0.010005, 1),  # 0.3 of a count
    ],
)
def test_what_the_two_waves_differ_in_is_kept_free(frequency_Hz, peak, reserve):
    recorded = Dither(frequency_Hz=frequency_Hz, peak=peak)
    driven().check(recorded)
    assert driven().reserve(recorded) == reserve


@pytest.mark.parametrize(
    ("made", "recorded"),
    [
        (driven(counts=0), Dither(frequency_Hz=156.25, peak=0.01)),
        (driven(counts=601), Dither(frequency_Hz=156.25, peak=0.01)),
        (driven(), Dither(frequency_Hz=148.0, peak=0.01)),
        (driven(), Dither(frequency_Hz=165.0, peak=0.01)),
    ],
    ids=["none", "another peak", "too slow", "too fast"],
)
def test_another_dither_than_the_recorded_one_is_refused(made, recorded, wording):
    with wording.refusal(InputError):
        made.check(recorded)
