"""The factors of units that are known without pint are pint's, to the last bit, and of no other quantity."""

import pytest

from dzdesign.core.units import FACTORS, SI_UNIT, measures, si_factor


def test_the_known_factors_are_those_of_pint():
    import pint

    registry = pint.UnitRegistry()
    found = {unit: float(registry.Quantity(1.0, unit).to(SI_UNIT[of]).magnitude) for unit, (of, _) in FACTORS.items()}
    assert found == {unit: factor for unit, (_, factor) in FACTORS.items()}
    for unit, (of, _) in FACTORS.items():
        kinds = [kind for kind, si in SI_UNIT.items() if registry.Quantity(1.0, unit).is_compatible_with(si)]
        assert kinds == [of] == [kind for kind in SI_UNIT if measures(unit, kind)]


@pytest.mark.parametrize(("unit", "of", "factor"), [("gpm", "flow", 6.30901964e-5), ("kp/cm²", "pressure", 98066.5)])
def test_other_units_are_read_by_pint(unit, of, factor):
    assert si_factor(unit, of) == pytest.approx(factor, rel=1e-9)
