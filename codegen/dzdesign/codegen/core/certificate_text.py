"""What the files say of the law: where it comes from, shares of its command, its values at zero, their certificate."""

from textwrap import wrap

from dzdesign.codegen.banner import lot_in_words
from dzdesign.codegen.core.constants import COLUMNS
from dzdesign.derivation.law import Law
from dzdesign.design.certificate import above_in_words, below_in_words, taken_off
from dzdesign.design.compensator import Compensator

#: Of the numerators over a power of two, by design/dzdesign/design/designing.py.
KAPPA_ROUNDING, U_MIN0_ROUNDING = "rounded to nearest", "rounded down with a margin of half a PWM count"


def equation_of(chosen: Law) -> str:
    """Return where a law comes from, as a reader looks for it."""
    return f"Eq. {chosen.equation}" if chosen.equation.startswith("(") else chosen.equation.replace("(", "Eq. (")


def share_of_command(compensator: Compensator, codes: int, sign: int = 1) -> str:
    """Return so many codes of command as a share of full command, and in the unit that a person sees."""
    share = codes / compensator.signals.command.span(sign)
    return f"{share:.2%} of command" + in_unit(compensator, share)


def in_unit(compensator: Compensator, share: float) -> str:
    """Return a share of full command or drive in the unit that a person sees, behind a comma; nothing in percent."""
    units = compensator.valve.recorded_units.of_controller
    if units.command.unit == "%":
        return ""
    return f", {units.text(share * float(compensator.u_max_V), '.4g dV')}"


def zero_command(compensator: Compensator, sign: int) -> tuple[int, int]:
    """Return the least and the largest compare value at zero command of one sign."""
    zero = compensator.signals.command.zero_code
    # Straight between nodes: the extremes stand at these, and at the largest difference, short of the last node.
    last = compensator.signals.pair(sign).largest_difference
    values = [compensator.compare(zero, code, sign) for code in (*range(0, last, compensator.beta_step_codes), last)]
    return min(values), max(values)


def certificate_lines(compensator: Compensator, sign: int) -> list[str]:
    """Return comment lines that say what the offset of one sign of command is certified for."""
    certificate, units = compensator.side(sign).certificate, compensator.valve.recorded_units
    low, high = certificate.dp_MPa
    where = units.span(float(low), float(high), ".2f MPa")
    between = compensator.valve.side(sign).between_in_words(certificate.guard)
    margin = units.text(1e3 * float(certificate.smallest_margin_V), ".3g mV")
    text = (
        f"Certificate of {compensator.certified_of}: {where}, this value lies below the "
        f"{100 * certificate.confidence:.6g}% lower bound of the {certificate.guard} threshold ({between}). The "
        f"least margin is {margin}, in addition to {_counted(compensator)}."
    )
    if certificate.guard == "closing" and certificate.zero_flow_L_min is not None:
        text += f" Hence {compensator.valve.side(sign).zero_flow_in_words(units)}."
    elif certificate.guard == "closing":
        meter_L_min = compensator.valve.side(sign).certificate.level_L_min
        by_hand, hidden = certificate.level_L_min < meter_L_min, certificate.level_L_min > meter_L_min
        flow = units.text(certificate.level_L_min, ".3g L/min" if by_hand else ".2f L/min")
        shown = "as the low-flow readings show" if by_hand else "which is less than the recordings can show"
        shown = "a zero error included that the flow meter may hide at rest" if hidden else shown
        text += f" The flow is less than {flow}, {shown}."
    else:
        text += " After closing, flow may remain: the closing threshold lies lower and is not the guarded one."
    text += f" {_beyond(compensator, sign)}"
    text += f" {_machine(compensator, sign)}"
    lot = lot_in_words(compensator)
    # The C is ASCII: only a unit's square is not.
    return wrap((f"{text} {lot.certificate}" if lot else text).replace("²", "^2"), COLUMNS - 3)


def _beyond(compensator: Compensator, sign: int) -> str:
    """Return what is certified above the tests, and what there is below them."""
    certificate, side = compensator.side(sign).certificate, compensator.valve.side(sign)
    units = compensator.valve.recorded_units.of_side(compensator.valve.side_name(sign))
    above = above_in_words(compensator.above, certificate, side, units)
    below = below_in_words(certificate, side, units)
    return f"{above[0].upper()}{above[1:]}. {below[0].upper()}{below[1:]}."


def _machine(compensator: Compensator, sign: int) -> str:
    """Return what of a machine is counted."""
    budget = compensator.side(sign).budget
    if compensator.machine is None or budget is None:
        return (
            "No machine was declared: the certificate does not cover coil temperature, supply voltage, "
            "pressure sensors, converters beyond rounding, oil or ageing."
        )
    words = taken_off(budget, compensator.valve.recorded_units.of_side(compensator.valve.side_name(sign)))
    return f"{words[0].upper()}{words[1:]}; compensator.json lists all of it."


def _counted(compensator: Compensator) -> str:
    """Return what the certificate's margin is left of."""
    rounding = "the rounding of readings to codes and of the drive to counts"
    if compensator.machine is not None:
        rounding += ", all declared differences of the machine"
    if not compensator.drive_functions.dither_counts:
        return rounding
    volts = compensator.dither_reserve_counts / compensator.signals.compare_max * float(compensator.u_max_V)
    counted = compensator.valve.recorded_units.text(1e3 * volts, ".4g mV")
    recorded = compensator.valve.dither
    if recorded is not None:
        return (
            f"{rounding} and {counted} by which dz_drive's dither may differ from that of the recordings, "
            f"{recorded.in_words()}, which the bound includes"
        )
    return f"{rounding} and the dither's peak of {counted}, which dz_drive adds to it"
