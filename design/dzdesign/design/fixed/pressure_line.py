"""The whole characteristic of a compensator at one pressure drop, with the fixed offset at zero command.

Beyond the transition it is the law at that pressure drop. In the zero band it is not the law's offset there, which
would open the valve at another pressure drop, but the fixed one.
"""

from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.core.worded import worded
from dzdesign.design.compensator import Compensator
from dzdesign.design.fixed.characteristic import Characteristic, Node
from dzdesign.design.fixed.fixed_offset import FixedOffset


def zero_band(compensator: Compensator, sign: int = 1) -> Fraction:
    """Return up to which command, a share of full, a zero command may read, as declared for the design."""
    return Fraction(compensator.command_error.zero_band_codes, compensator.signals.command.span(sign))


def full_drive(compensator: Compensator, dp_MPa: Fraction, sign: int = 1) -> Fraction:
    """Return the drive of the law at full command and a pressure drop, limited as the design limits it."""
    signals = compensator.signals
    command, limit = signals.command, compensator.drive_functions.compare_limit
    code = command.zero_code + command.direction(sign) * command.span(sign)
    drive = compensator.drive(code, round(signals.dp_code(dp_MPa)), sign)
    return min(drive, Fraction(limit, signals.compare_max))


def pressure_line(
    compensator: Compensator, offset: FixedOffset, dp_MPa: Fraction, rest: Fraction | None = None
) -> Characteristic:
    """Return the characteristic at a pressure drop inside the tests, MPa: continuous, from no drive at zero command.

    At the command `rest`, a share of full, the drive has come to the fixed offset; without one that is the end of the
    design's zero band.

    Raises
    ------
    InputError
        If the pressure drop is outside the tested interval.
    """
    sign, low, high = offset.sign, *offset.dp_MPa
    if not low <= dp_MPa <= high:
        raise InputError(
            worded(
                "--table-dp is {dp:.4g MPa}, outside the tests from {low:.4g MPa} to {high:.4g MPa}; choose one inside",
                dp=float(dp_MPa),
                low=float(low),
                high=float(high),
            )
        )
    signals = compensator.signals
    command, dp_code = signals.command, round(signals.dp_code(dp_MPa))
    limit = Fraction(compensator.drive_functions.compare_limit, signals.compare_max)

    def law(share: Fraction) -> Fraction:
        code = command.zero_code + command.direction(sign) * round(share * command.span(sign))
        return compensator.drive(code, dp_code, sign)

    band = zero_band(compensator, sign) if rest is None else rest
    end, full = Fraction(compensator.transition_end, command.span(sign)), law(Fraction(1))
    nodes: list[Node] = [(Fraction(0), Fraction(0))] if band else []
    nodes.append((band, min(offset.share, limit)))
    # Without a transition the law jumps at zero command, to an offset that is not the fixed one: a line leads to its
    # full drive.
    if end > band and nodes[-1][1] < law(end) < limit:
        nodes.append((end, law(end)))
    if full > limit:
        left, start = nodes[-1]
        nodes.append((left + (1 - left) * (limit - start) / (full - start), limit))
    nodes.append((Fraction(1), max(min(full, limit), nodes[-1][1])))
    return Characteristic(rest=Fraction(0), nodes=tuple(nodes))
