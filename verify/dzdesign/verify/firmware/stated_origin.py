"""What a valve says of its recordings, against itself: the units they had, the files they are, the options."""

import contextlib
import math
from collections.abc import Iterator

from dzdesign.core.units import SI_UNIT, measures, si_factor
from dzdesign.identify.valve.model import ValveModel

#: Quantity of the recordings -> kind of its unit, and how many of that kind's SI unit one is in which it is computed.
COMPUTED = {"command": ("voltage", 1.0), "pressure": ("pressure", 1e6), "flow": ("flow", 1e-3 / 60)}
#: Factors have twelve digits.
NEAR = 1e-9


def about_units(valve: ValveModel) -> Iterator[str]:
    """Yield which factor is not that of its unit: every number of a report would be shown as another one.

    Of a command that is no voltage, or of a declared range, its recordings alone tell the factor.
    """
    units = valve.recorded_units
    for quantity, (kind, scale) in COMPUTED.items():
        unit = getattr(units, quantity)
        if quantity == "command" and (unit.declared or not measures(unit.unit, kind)):
            continue
        place = f"recorded_units.{quantity}"
        if not measures(unit.unit, kind):
            yield f"{place}.unit is {unit.unit!r}, which is no unit of {kind} (in {SI_UNIT[kind]})"
        elif not math.isclose(unit.factor, expected := scale / si_factor(unit.unit, kind), rel_tol=NEAR):
            yield f"{place}.factor is {unit.factor:g}, but {expected:g} is that of {unit.unit}"
        elif quantity == "command" and unit.at_zero:
            yield f"{place}.at_zero is {unit.at_zero:g}, but a voltage without a declared range is 0 at zero command"


def about_files(valve: ValveModel) -> Iterator[str]:
    """Yield the ramps that no file in made_from has: nobody could identify them again."""
    files = {each.source for each in valve.made_from}
    for name, side in valve.sides.items():
        for row, test in enumerate(side.tests):
            for ramp in test.ramps:
                if ramp not in files and ramp.rpartition(" (ramp ")[0] not in files:
                    yield f"sides.{name}.tests[{row}].ramps names {ramp!r}, which is no file of made_from"


def about_options(valve: ValveModel) -> Iterator[str]:
    """Yield the confidence that was asked for, where the bounds have another."""
    asked = valve.options.texts.get("confidence", "") if valve.options else ""
    for name, side in valve.sides.items():
        with contextlib.suppress(ValueError):  # other words than a number `identify` refuses itself
            found = side.certificate.confidence
            if asked and not math.isclose(float(asked), found, rel_tol=NEAR):
                yield f"options.texts.confidence is {asked[:20]}, but {found:g} in sides.{name}.certificate"
