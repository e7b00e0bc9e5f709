"""Roots as the reference finds stops and turns: to the bit that tells, and never without a change of sign."""

from math import exp

import pytest

from dzdesign.verify.integrator.root import EXACT, root


@pytest.mark.parametrize("power", [1, 3])
@pytest.mark.parametrize("bend", [-40.0, 0.0, 40.0])
@pytest.mark.parametrize("at", [1e-9, 0.1, 0.3999999])
def test_a_root_is_found_where_it_is(power, bend, at):
    asked = []

    def value(x):
        asked.append(x)
        return (x - at) ** power * exp(bend * x)

    assert root(value, 0.0, 0.4) == pytest.approx(at, abs=2 * EXACT, rel=0)
    assert len(asked) < (40 if power == 1 else 130)


def test_ends_are_roots_and_signs_alike_are_none():
    assert root(lambda x: x, 0.0, 1.0) == 0.0
    assert root(lambda x: x - 1.0, 0.0, 1.0) == 1.0
    with pytest.raises(RuntimeError):
        root(lambda x: x + 1.0, 0.0, 1.0)
