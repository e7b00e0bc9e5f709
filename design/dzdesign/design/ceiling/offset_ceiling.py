"""What rounding, dither and the machine leave of a certified curve, at every difference of pressure codes."""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

from dzdesign.core.errors import InputError
from dzdesign.core.worded import worded
from dzdesign.design.ceiling.curve_row import certified_row
from dzdesign.design.ceiling.exact_row import ExactRow
from dzdesign.design.ceiling.offset_curve import OffsetCurve
from dzdesign.design.machine.allowance import Allowance


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetCeiling:
    """Largest offset over u_max that the certificate allows, at every difference of pressure codes 0...code_max."""

    #: Limit at each code, exact: the least over the pressures that the code may stand for.
    limit: ExactRow
    #: Codes inside the tested interval of the pressure drop.
    certified: range


def offset_ceiling(curve: OffsetCurve, u_max_V: Fraction, allowance: Allowance) -> OffsetCeiling:
    """Return the limit of the offset at every pressure code.

    It is the least certified offset over all pressure drops that the code may stand for, on the machine that moves the
    threshold furthest, less what rounding and the dither add to the drive. A curve that lies above its bound somewhere
    is refused: valve.json contradicts itself.
    """
    signals = allowance.signals
    first, last = (signals.dp_code(end) for end in (curve.dp_MPa[0], curve.dp_MPa[-1]))
    code_max = signals.largest_difference(allowance.sign)
    if last > code_max:
        raise InputError(
            worded(
                "the sensor's span of {span:g MPa} ends below the tested pressure drop of {tested:g MPa}; give the "
                "real span with --pressure-span",
                span=float(signals.pressure_a.span_MPa),
                tested=float(curve.dp_MPa[-1]),
            )
        )
    low, high = allowance.window
    factor, kept = allowance.factor / u_max_V, allowance.kept
    least = certified_row(curve, signals, low, code_max + high).least_of_windows(high - low + 1)
    return OffsetCeiling(limit=least.line(factor, kept), certified=range(ceil(first), floor(last) + 1))
