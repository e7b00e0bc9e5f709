"""The flat plan of printed strings for the core's templates: one side of a `Compensator`, and its constants' origin."""

from dataclasses import dataclass
from fractions import Fraction
from textwrap import wrap
from typing import Any

from dzdesign.codegen.core.constants import COLUMNS, Constant, defines
from dzdesign.codegen.core.drive_constants import (
    drive_constants,
    drive_interface_constants,
    interface_constants,
    status_constants,
)
from dzdesign.codegen.core.integer_form import IntegerForm, integer_form
from dzdesign.codegen.core.law_constants import (
    KAPPA_ROUNDING,
    U_MIN0_ROUNDING,
    LawConstants,
    TableForm,
    equation_of,
    table_form,
)
from dzdesign.codegen.core.misra import misra_lines
from dzdesign.codegen.core.signal_constants import SignalConstants
from dzdesign.codegen.lot_banner import lot_in_words
from dzdesign.core.units import span_MPa
from dzdesign.derivation.law import Law, law
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive import RAMP_UNIT
from dzdesign.design.signals import WEIGHT_SHIFT, PressureSignal

#: Codes up to half of this leave the top bit of 16 for the sign of a difference.
SHORT_MAX = 2**15 - 1
#: Segments of a table in one line of C.
TABLE_COLUMNS = 2

Plan = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class FilePlan:
    """What a template of the core prints, and the constants among it, for the manifest."""

    values: Plan
    constants: tuple[Constant, ...]


def core_plan(compensator: Compensator, sign: int, arithmetic: str) -> FilePlan:
    """Return what the core's template prints for one sign of command.

    Parameters
    ----------
    compensator : Compensator
        The law in rationals.
    sign : {1, -1}
        Sign of the command.
    arithmetic : {"wide", "narrow"}
        Products of 32 by 32 to 64 bits, or arithmetic of 32 bits only.
    """
    form = integer_form(compensator, sign)
    narrow = arithmetic == "narrow"
    word_bits = _word_bits(compensator, arithmetic)
    codes = SignalConstants(compensator=compensator, sign=sign, word_bits=word_bits)
    of_law = LawConstants(compensator=compensator, form=form, sign=sign, narrow=narrow)
    signals, steps, integers = codes.signals(), codes.steps(), of_law.arithmetic()
    rows = table_form(form, compensator.beta_step_codes, arithmetic)
    tables = [of_law.table(False, rows)] + ([of_law.table(True, rows)] if form.zero_table else [])
    side, chosen = compensator.side(sign), law(compensator.law_name)
    values = {
        **_signal_plan(compensator, sign),
        **_arithmetic_plan(form, of_law),
        "word": f"uint{word_bits}_t",
        "word_bits": str(word_bits),
        "signal_defines": defines(signals),
        "step_defines": defines(steps),
        "law_defines": defines(integers),
        "tables": [_table_plan(table, rows, of_law, compensator) for table in tables],
        "change_sign": rows.change_sign,
        "change_type": rows.change_type,
        "misra_lines": misra_lines(),
        "narrow": narrow,
        "function": "dz_comp" if sign > 0 else "dz_comp_negative",
        "status_function": "dz_status" if sign > 0 else "dz_status_negative",
        "beta_function": "dz_beta" if sign > 0 else "dz_beta_negative",
        "side_text": "" if compensator.negative is None else f" for {'positive' if sign > 0 else 'negative'} commands",
        "law_text": _law_text(chosen),
        "law_equation": equation_of(chosen),
        "kappa_text": _rational(side.k_x_max_over_u_max) + f", {KAPPA_ROUNDING}",
        "u_min0_text": _rational(side.u_min0_over_u_max) + f", {U_MIN0_ROUNDING}",
        "guard": side.certificate.guard,
        "edge": bool(compensator.edge_codes),
        "edge_codes": str(compensator.edge_codes),
        "edge_text": f"{compensator.edge_codes / compensator.signals.command.span(sign):.2%}",
        "edge_sum_text": f"\n *           - (B - B_zero) * {form.edge} * max({compensator.edge_codes} - c, 0)"
        if form.edge
        else "",
        "beta_unit": str(of_law.unit),
        "segment_count": str(len(tables[0].value) - 1),
        "step_codes": str(compensator.beta_step_codes),
        "step_MPa": f"{float(compensator.signals.dp_MPa(compensator.beta_step_codes)):.4f}",
    }
    return FilePlan(values=values, constants=(*signals, *steps, *integers, *tables))


def _law_text(chosen: Law) -> str:
    return str(chosen.output).replace("**", "^")


def header_plan(compensator: Compensator) -> FilePlan:
    """Return what the core's header prints."""
    chosen, signals = law(compensator.law_name), compensator.signals
    ends, bits = interface_constants(compensator), status_constants()
    low, high = zero_command(compensator, 1)
    values = {
        **_signal_plan(compensator, 1),
        "misra_lines": misra_lines("dz_comp.h"),
        "interface_defines": defines(ends),
        "status_defines": defines(bits),
        "law_text": _law_text(chosen),
        "law_equation": equation_of(chosen),
        "u_max_V": f"{float(compensator.u_max_V):g}",
        "edge": bool(compensator.edge_codes),
        "zero_command_low": str(low),
        "zero_command_high": str(high),
        "certificate_lines": certificate_lines(compensator, 1),
        "bipolar": compensator.negative is not None,
        "swapped": signals.swapped,
    }
    if compensator.negative is not None:
        low, high = zero_command(compensator, -1)
        values |= {
            "negative_full": str(signals.command.negative_full_code),
            "negative_zero_low": str(low),
            "negative_zero_high": str(high),
            "negative_certificate_lines": certificate_lines(compensator, -1),
        }
    return FilePlan(values=values, constants=(*ends, *bits))


def drive_plan(compensator: Compensator) -> FilePlan:
    """Return what dz_drive.c prints, the amplifier around the law."""
    signals, amplifier = compensator.signals, compensator.amplifier
    constants = drive_constants(compensator)
    values = {
        "misra_lines": misra_lines(),
        "drive_defines": defines(constants),
        "bipolar": compensator.negative is not None,
        "ramp": amplifier.has_ramp,
        "dither": bool(amplifier.dither_counts),
        "rises": signals.command.direction(1) > 0,
        "ramp_unit": str(RAMP_UNIT),
        "sample_Hz": str(signals.sample_Hz),
    }
    return FilePlan(values=values, constants=tuple(constants))


def drive_header_plan(compensator: Compensator) -> FilePlan:
    """Return what dz_drive.h prints."""
    constants = drive_interface_constants(compensator)
    values = {
        **drive_plan(compensator).values,
        "misra_lines": misra_lines("dz_drive.h"),
        "interface_defines": defines(constants),
    }
    return FilePlan(values=values, constants=tuple(constants))


def certificate_lines(compensator: Compensator, sign: int = 1) -> list[str]:
    """Say in comment lines what the offset is certified for."""
    side = compensator.side(sign)
    certificate = side.certificate
    low, high = certificate.dp_MPa
    where = span_MPa(float(low), float(high)) + (", between the tests too" if low < high else "")
    text = (
        f"Certificate: {where}, that lies below the "
        f"{100 * certificate.confidence:.6g}% lower bound of the {certificate.guard} threshold, by "
        f"{1e3 * float(certificate.smallest_margin_V):.3g} mV at the least beyond {_counted(compensator)}"
    )
    if certificate.guard == "closing":
        text += f", so that nothing flows; flow below {certificate.level_L_min:.2f} L/min counts as none."
    else:
        text += ". After closing, flow may remain: the closing threshold lies lower, and is not the one guarded."
    lot = lot_in_words(compensator)
    return wrap(f"{text} {lot.certificate}" if lot else text, COLUMNS - 3)


def _counted(compensator: Compensator) -> str:
    """Say what the certificate's margin is left of."""
    rounding = "the converters' error and the rounding to counts"
    if not compensator.amplifier.dither_counts:
        return rounding
    peak = compensator.amplifier.dither_counts / compensator.signals.compare_max * float(compensator.u_max_V)
    return f"{rounding} and the dither's peak of {1e3 * peak:.4g} mV, which dz_drive adds to it"


def _signal_plan(compensator: Compensator, sign: int) -> Plan:
    signals = compensator.signals
    command, a, b = signals.command, signals.pressure_a, signals.pressure_b
    full = command.full_code if sign > 0 else command.negative_full_code
    rises = command.direction(sign) > 0
    swapped = sign < 0 and signals.swapped
    towards = sorted(command.direction(sign) * (code - command.zero_code) for code in command.valid_codes)
    return {
        "command_zero": str(command.zero_code),
        "command_full": str(full),
        "command_low": str(command.valid_codes[0]),
        "command_high": str(command.valid_codes[1]),
        "command_difference": "u - COMMAND_ZERO" if rises else "COMMAND_ZERO - u",
        "clip_low": towards[0] < 0,
        "clip_high": towards[1] > command.span(sign),
        "unclipped": "towards" if towards[0] < 0 else "from_zero",
        **_sensor_plan("a", a),
        **_sensor_plan("b", b),
        "like_sensors": signals.like_sensors,
        "a_weight": str(2**WEIGHT_SHIFT),
        "pressure_turn": "b - a" if swapped else "a - b",
        "reverse_text": f"{-float(signals.dp_MPa(compensator.reverse_codes)):.3f} MPa",
    }


def _sensor_plan(name: str, sensor: PressureSignal) -> Plan:
    low, high = sensor.valid_codes
    return {
        f"{name}_zero": str(sensor.zero_code),
        f"{name}_full": str(sensor.full_code),
        f"{name}_low": str(low),
        f"{name}_high": str(high),
        f"{name}_span_MPa": f"{float(sensor.span_MPa):g}",
    }


def _word_bits(compensator: Compensator, arithmetic: str) -> int:
    """Return the width of codes and their differences: 16 bits where a word of 32 costs more and they fit."""
    signals = compensator.signals
    return 16 if arithmetic == "narrow" and signals.like_sensors and 2 * signals.code_max <= SHORT_MAX else 32


def _table_plan(table: Constant, rows: TableForm, of_law: LawConstants, compensator: Compensator) -> Plan:
    """Return a table's rows, the pressure drop from which each line of them goes, and its beta there."""
    ending, step = "u" if rows.short else "", compensator.beta_step_codes
    turn = -1 if rows.falls else 1
    printed = [f"{{UINT32_C({start}), {change}{ending}}}," for start, change in table.value]
    lines = [f"{printed[0]} /* pressures can't be right: beta {table.value[0][0] / of_law.unit:.6f} */"]
    for at in range(1, len(printed), TABLE_COLUMNS):
        start, change = table.value[at]
        codes = (at - 1) * step
        beta = (start + turn * change * codes) % 2**32 / of_law.unit
        from_MPa = float(compensator.signals.dp_MPa(codes))
        lines.append(f"{' '.join(printed[at : at + TABLE_COLUMNS])} /* from {from_MPa:.3f} MPa: beta {beta:.6f} */")
    name = table.symbol
    product = (
        f"short_product{'' if of_law.sign > 0 else '_negative'}({name}[row].change, (uint16_t)dp)"
        if rows.short
        else f"((uint32_t){name}[row].change * dp)"
    )
    return {
        "symbol": name,
        "function": "zero_beta" if name == "zero_segment" else "law_beta",
        "comment": table.comment(),
        "size": str(len(printed)),
        "rows": lines,
        "product": product,
    }


def _arithmetic_plan(form: IntegerForm, of_law: LawConstants) -> Plan:
    straight_high, straight_low = divmod(form.linear << form.linear_shift, 1 << 32)
    straight = "" if not form.linear else "long" if straight_low else "word"  # a word stands in the sum's high one
    suffix = "" if of_law.sign > 0 else "_negative"
    rest_short = form.divisor * (form.estimate.corrections + 1) < 1 << 15
    short_estimate = form.estimate.factor < 1 << 16
    _, beta_shift = of_law.beta_scaling()
    beta_narrow = (
        "scaled.high >> (BETA_SHIFT - 32u)"
        if beta_shift >= 32
        else "(scaled.high << (32u - BETA_SHIFT)) | (scaled.low >> BETA_SHIFT)"
    )
    return {
        "slope": str(form.slope),
        "offset": str(form.offset),
        "has_slope": bool(form.slope),
        "slope_sign": "-" if form.slope < 0 else "+",
        "linear": str(form.linear),
        "linear_shift": str(form.linear_shift),
        "straight": straight,
        "straight_high": bool(straight_high),
        "straight_low": bool(straight_low),
        "straight_product": f"short_product{suffix}((uint16_t)command, COMMAND_HIGH_WORD)"
        if straight_high < 1 << 16
        else "COMMAND_HIGH_WORD * command",
        "half": str(form.half),
        # Half of an odd divisor times a power of two: alone in the low word it is its top bit, and else nothing.
        "half_carries": bool(form.half % 2**32),
        "uses_low_word": of_law.uses_low_word,
        "shift": str(form.shift),
        "high_shifts": form.shift > 32,
        "divisor": str(form.divisor),
        "exceeds": form.exceeds,
        "beta_narrow": beta_narrow,
        "estimate_product": f"short_product{suffix}((uint16_t)(quotient >> ESTIMATE_SHIFT), ESTIMATE_FACTOR)"
        if short_estimate
        else "((quotient >> ESTIMATE_SHIFT) * ESTIMATE_FACTOR)",
        "correction_steps": [str(step + 1) for step in range(form.estimate.corrections)],
        "rest_type": "uint16_t" if rest_short else "uint32_t",
        "rest_top": "15" if rest_short else "31",
    }


def zero_command(compensator: Compensator, sign: int) -> tuple[int, int]:
    """Return the least and the largest compare value at zero command."""
    zero = compensator.signals.command.zero_code
    nodes = [node * compensator.beta_step_codes for node in range(compensator.nodes(sign) - 1)]
    values = [compensator.compare(zero, code, sign) for code in nodes]
    return min(values), max(values)


def _rational(value: Fraction) -> str:
    return f"{value.numerator}/{value.denominator} = {float(value):.6f}"
