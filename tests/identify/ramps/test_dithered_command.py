"""A command column that shows the dither: averaged where it was declared, pointed out where it was not."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.dither import read_dithered
from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from tests.support.synthetic import Truth, synthetic_ramp

DITHERED = IdentifyOptions(dithered=read_dithered("150 Hz 1 %", "--dithered"))


def ramps(peak_V=0.0, rate_Hz=100.0, noise_V=0.0):
    found = []
    for dp in (1.0, 5.0):
        clean = synthetic_ramp(dp, Truth(noise=0.03), seed=2, rate_Hz=rate_Hz, ramp_s=50)
        wave = np.where((clean.time * 156.25 + 0.1) % 1 < 0.5, peak_V, -peak_V)
        noise = noise_V * np.random.default_rng(5).standard_normal(clean.u.size)
        found.append(replace(clean, u=clean.u + (wave + noise) * (clean.u > 0.2)))
    return found


def knees(valve):
    return [value for test in valve.positive.tests for value in (test.u_knee_rising_V, test.u_knee_falling_V)]


def codes(valve):
    return [warning.code for warning in valve.warnings]


@pytest.mark.parametrize("rate_Hz", [25.0, 100.0, 1000.0])
def test_a_declared_dither_in_the_column_is_averaged_out(rate_Hz, wording):
    valve = identify(ramps(0.1, rate_Hz), DITHERED)
    assert codes(valve).count("dither-in-command") == 2
    assert knees(valve) == pytest.approx(knees(identify(ramps(0.0, rate_Hz), DITHERED)), abs=4e-3)
    if rate_Hz == 100.0:
        wording.of_test(next(each.text for each in valve.warnings if each.code == "dither-in-command"))


def test_a_column_without_it_stays_as_it_is():
    declared, plain = identify(ramps(), DITHERED), identify(ramps())
    assert "dither-in-command" not in codes(declared) and knees(declared) == knees(plain)
    assert declared.dither.in_words() == "150 Hz 1 %" and plain.dither is None


def test_one_that_nobody_declared_is_pointed_out(wording):
    valve = identify(ramps(0.1))
    assert codes(valve).count("dither-undeclared") == 2
    wording.of_test(next(each.text for each in valve.warnings if each.code == "dither-undeclared"))


@pytest.mark.parametrize("noise_V", [0.0, 0.02, 0.1])
def test_noise_on_the_command_is_no_dither(noise_V):
    try:
        found = codes(identify(ramps(0.0, noise_V=noise_V)))
    except InputError:  # of much noise
        found = []
    assert "dither-undeclared" not in found


def test_a_coarse_converter_is_no_dither():
    coarse = [replace(test, u=np.round(test.u / 0.04) * 0.04) for test in ramps()]
    assert "dither-undeclared" not in codes(identify(coarse))
