"""Where the transition ends and the law goes on: the offset of the opening threshold over the pressure drop."""

from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.design.ceiling.curve_row import offset_row
from dzdesign.design.ceiling.exact_row import ExactRow
from dzdesign.design.ceiling.offset_ceiling import OffsetCeiling
from dzdesign.design.ceiling.offset_curve import OffsetCurve
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
    out of it, stay as they are at the last test. Where the offset is released, only that height is left of it.
    """
    last = signals.largest_difference(sign)
    limit = offset_row(opening, signals, 0, last)
    if certified.above is not None and tested.stop <= last:
        let_go = last + 1 if released_from is None else min(released_from, last + 1)
        limit = limit[: tested.stop].followed_by(
            _less_what_is_lowered(limit[tested.stop :], certified, signals, range(tested.stop, let_go))
        )
    return OffsetCeiling(limit=limit.line(1 / u_max), certified=tested)


def _less_what_is_lowered(opening: ExactRow, certified: OffsetCurve, signals: Signals, codes: range) -> ExactRow:
    """Return what is left above the tests of the opening threshold there; behind the codes the offset is released."""
    height = opening.line(Fraction(1), certified.offset_V[-1])
    if not codes:
        return height
    lowered = offset_row(certified, signals, codes.start, codes.stop - 1)
    return height[: len(codes)].plus(lowered).followed_by(height[len(codes) :])
