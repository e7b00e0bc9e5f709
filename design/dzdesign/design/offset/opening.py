"""Where the transition ends and the law goes on: the offset of the opening threshold over the pressure drop."""

from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.design.beta_table import OffsetCeiling, OffsetCurve, pressures_MPa
from dzdesign.design.certificate import hold_below
from dzdesign.design.options import DesignOptions
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.side_model import SideModel

#: Standard errors by which the transition's end stands above the opening threshold.
OPENING_ERRORS = 3


def opening_offset(side: SideModel, options: DesignOptions) -> OffsetCurve:
    """Return where the transition ends and the law goes on: the opening threshold, and its error on top.

    A law that starts above the threshold only shortens the dead zone that is left; one that starts below lengthens it.
    """
    opening = side.opening_curve
    if opening is None:
        raise InputError(
            "a transition ends at the opening threshold, of which valve.json has no curve; record the rising branch "
            "with a column of dP, make valve.json again, or give --transition off"
        )
    error = max(opening.u_se_V)
    offset = [Fraction(repr(value)) + OPENING_ERRORS * Fraction(repr(error)) for value in opening.u_V]
    return OffsetCurve(
        dp_MPa=tuple(Fraction(repr(value)) for value in opening.dp_MPa),
        offset_V=tuple(offset),
        certified=None,
        hold_below_MPa=hold_below(side, options.below_dp0),
    )


def opening_ceiling(
    opening: OffsetCurve,
    certified: OffsetCurve,
    tested: range,
    *,
    released_from: int | None,
    signals: Signals,
    u_max: Fraction,
    sign: int,
) -> OffsetCeiling:
    """Return the opening threshold at every pressure code: no bound, so rounding to codes does not count.

    Above the tests it comes down by as much as the certified offset: a transition, and the hysteresis that a play takes
    out of it, stay as they are at the last test. Where the offset is let go, only that height is left of it.
    """
    pressures = pressures_MPa(signals, 0, signals.largest_difference(sign))
    limit = [opening.at(dp_MPa) for dp_MPa in pressures]
    for code in range(tested.stop, len(limit)) if certified.above is not None else ():
        let_go = released_from is not None and code >= released_from
        limit[code] -= certified.offset_V[-1] - (0 if let_go else certified.at(pressures[code]))
    return OffsetCeiling(limit=tuple(value / u_max for value in limit), certified=tested)
