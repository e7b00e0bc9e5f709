"""The law's offset under a bound, as valve.json rounds both."""

import numpy as np
import pytest

from dzdesign.identify.fitting.offsets import fit_offset_under
from dzdesign.identify.valve.certified_bound import CertifiedBound, largest_excess
from dzdesign.identify.valve.guard_curve import ROUNDING_V
from dzdesign.identify.valve.model import DECIMALS


@pytest.mark.parametrize("last_MPa", [3.0, 10.0, 38.0])
def test_an_offset_stays_under_a_bound_of_wide_intervals_when_both_are_rounded(last_MPa):
    """The fault: half a last digit of M over 15 MPa was more than the offset kept, and `identify` broke off."""
    dp, lower = np.array([1.0, 2.0, last_MPa]), np.array([5.2, 5.1, 4.6])
    # Rounded upwards by nearly half a digit, which lowers the bound.
    bends = [2.5e-4 + 0.51e-7, 1e-4 + 0.51e-7]

    def bound(decimals):
        numbers = [np.round(each, decimals).tolist() for each in (dp, lower, bends)]
        return CertifiedBound.of("smooth", *numbers, "decreasing")

    found = fit_offset_under(bound(15), dp, lower, 0, trend="decreasing", u_max=10.0)
    nodes, offset = (np.round(each, DECIMALS) for each in (found.dp_MPa, found.offset))
    assert largest_excess(bound(DECIMALS), nodes, offset) <= ROUNDING_V
