"""Valves for whose offset no certificate stands: knees in an order that no valve has, a side that bounds no guard."""

from dzdesign.core.errors import InputError
from dzdesign.core.worded import worded
from dzdesign.identify.valve.guard_curve import GUARDS
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.side_model import SideModel


def refuse_crossed_branches(side: SideModel) -> None:
    """Refuse knees in an order that no valve has: the guarded one is not where the valve closes."""
    for test in side.tests:
        if test.closes_above_opening:
            raise InputError(
                worded(
                    "'{source}': the valve closes ({closes:.3f V}) above where it opens ({opens:.3f V}), as no valve "
                    "does, so flow at zero command is possible; run `identify` again with the meter's true "
                    "--meter-lag or a right column of time, or take it as it is by --accept branch-order",
                    source=test.source,
                    closes=test.u_knee_falling_V,
                    opens=test.u_knee_rising_V,
                )
            )


def refuse_two_signs(valve: ValveModel, guard: str) -> None:
    """Refuse a command of both signs where a side was not tested, or does not bound the guarded threshold."""
    if "negative" not in valve.sides:
        raise InputError(
            "the command has both signs, but the valve's negative side was not tested; record its ramps, or give a "
            "command of one sign"
        )
    guards = {name: valve.sides[name].certified for name in ("positive", "negative")}
    lacking = [name for name, found in guards.items() if guard not in found]
    if not lacking:
        return
    common = [name for name in GUARDS if all(name in found for found in guards.values())]
    raise InputError(
        f"the {' and the '.join(lacking)} side's ramp tests do not bound the {guard} threshold, which is to be "
        "guarded; "
        + (f"take --guard {common[0]}, or " if common else "no guard serves both sides: ")
        + "record both branches of both sides"
    )
