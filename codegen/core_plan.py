"""The flat plan of printed strings for the core's templates: one side of a `Compensator`, and its constants' origin."""

from fractions import Fraction
from typing import Any

from dzdesign.codegen.integer_form import IntegerForm, integer_form, segments_of
from dzdesign.codegen.telemetry import beta_factor
from dzdesign.derivation.law import law
from dzdesign.design.amplifier import RAMP_UNIT
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import WEIGHT_SHIFT, PressureSignal

#: Codes up to half of this leave the top bit of 16 for the sign of a difference.
SHORT_MAX = 2**15 - 1

Plan = dict[str, Any]


def core_plan(compensator: Compensator, sign: int, arithmetic: str) -> Plan:
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
    side, chosen = compensator.side(sign), law(compensator.law_name)
    return {
        **_signal_plan(compensator, sign),
        **_arithmetic_plan(form),
        **_table_plan(form, compensator.beta_step_codes, arithmetic),
        **_word_plan(compensator, arithmetic),
        "narrow": arithmetic == "narrow",
        "function": "dz_comp" if sign > 0 else "dz_comp_negative",
        "status_function": "dz_status" if sign > 0 else "dz_status_negative",
        "side_text": "" if compensator.negative is None else f", {'positive' if sign > 0 else 'negative'} commands",
        "law_text": str(chosen.output).replace("**", "^"),
        "law_equation": chosen.equation,
        "kappa_text": _rational(side.k_x_max_over_u_max) + ", rounded to nearest",
        "u_min0_text": _rational(side.u_min0_over_u_max) + ", rounded down with half a count to spare",
        "edge": bool(compensator.edge_codes),
        "edge_codes": str(compensator.edge_codes),
        "edge_text": f"{compensator.edge_codes / compensator.signals.command.span(sign):.2%}",
        "edge_sum_text": f"\n *           - (beta - beta_closing) * {form.edge} * max({compensator.edge_codes} - c, 0)"
        if form.edge
        else "",
        **_beta_plan(compensator, form),
        "beta_scale": str(form.scale_beta * compensator.beta_denominator),
        "step_codes": str(compensator.beta_step_codes),
        "step_MPa": f"{float(compensator.signals.dp_MPa(compensator.beta_step_codes)):.4f}",
        "step_shift": str(compensator.beta_step_codes.bit_length() - 1),
    }


def _beta_plan(compensator: Compensator, form: IntegerForm) -> Plan:
    """Return what brings the table's beta to the 2^-15 of dz_beta()."""
    step = compensator.beta_step_codes
    factor, shift = beta_factor(form.scale_beta * compensator.beta_denominator * step, max(form.table) * step)
    if shift >= 32:
        narrow = f"scaled.high >> {shift - 32}" if shift > 32 else "scaled.high"
    else:
        narrow = f"(scaled.high << {32 - shift}) | (scaled.low >> {shift})" if shift else "scaled.low"
    return {"beta_factor": str(factor), "beta_shift": str(shift), "beta_narrow": narrow}


def header_plan(compensator: Compensator) -> Plan:
    """Return what the core's header prints."""
    chosen, signals = law(compensator.law_name), compensator.signals
    limit = compensator.amplifier.compare_limit
    low, high = _zero_command(compensator, 1)
    plan = {
        **_signal_plan(compensator, 1),
        "law_text": str(chosen.output).replace("**", "^"),
        "law_equation": chosen.equation,
        "u_max_V": f"{float(compensator.u_max_V):g}",
        "compare_max": str(signals.compare_max),
        "compare_limit": str(limit),
        "limit_text": "" if limit == signals.compare_max else f", {limit / signals.compare_max:.1%} of full drive",
        "adc_code_max": str(signals.code_max),
        "zero_command_low": str(low),
        "zero_command_high": str(high),
        "certificate_text": certificate_text(compensator, 1),
        "bipolar": compensator.negative is not None,
    }
    if compensator.negative is not None:
        low, high = _zero_command(compensator, -1)
        plan |= {
            "negative_full": str(signals.command.negative_full_code),
            "negative_zero_low": str(low),
            "negative_zero_high": str(high),
            "negative_certificate_text": certificate_text(compensator, -1),
        }
    return plan


def drive_plan(compensator: Compensator) -> Plan:
    """Return what the templates of the amplifier around the law print."""
    signals, amplifier = compensator.signals, compensator.amplifier
    command = signals.command

    def ramp(step: int) -> str:
        return str(step) if step else "RAMP_NONE"

    names = ("up_positive", "up_negative", "down_positive", "down_negative")
    ramps = {
        f"ramp_{name}": ramp(step) for name, step in zip(names, amplifier.ramp_up + amplifier.ramp_down, strict=True)
    }
    return {
        **ramps,
        "bipolar": compensator.negative is not None,
        "ramp": amplifier.has_ramp,
        "dither": bool(amplifier.dither_counts),
        "command_zero": str(command.zero_code),
        "rises": command.direction(1) > 0,
        "window_codes": str(amplifier.window_codes),
        "window_text": f"{amplifier.window_codes / command.span(1):.2%}",
        "ramp_unit": str(RAMP_UNIT),
        "sample_Hz": str(signals.sample_Hz),
        "dither_counts": str(amplifier.dither_counts),
        "dither_ticks": str(amplifier.dither_ticks),
        "dither_period": str(2 * amplifier.dither_ticks),
        "dither_text": f"{signals.tick_Hz / (2 * amplifier.dither_ticks):.1f} Hz, peak "
        f"{amplifier.dither_counts / signals.compare_max:.3%} of full drive",
    }


def certificate_text(compensator: Compensator, sign: int = 1) -> str:
    """Say in one comment line what the offset is certified for."""
    certificate = compensator.side(sign).certificate
    low, high = (float(end) for end in certificate.dp_MPa)
    return (
        f"Certified for {low:.2f} to {high:.2f} MPa: below the {certificate.confidence:.0%} bound of the "
        f"{certificate.guard} threshold; flow below {certificate.level_L_min:.2f} L/min counts as none."
    )


def _signal_plan(compensator: Compensator, sign: int) -> Plan:
    signals = compensator.signals
    command, a, b = signals.command, signals.pressure_a, signals.pressure_b
    full = command.full_code if sign > 0 else command.negative_full_code
    rises = command.direction(sign) > 0
    swapped = sign < 0 and signals.swapped
    weight = 2**WEIGHT_SHIFT
    towards = sorted(command.direction(sign) * (code - command.zero_code) for code in command.valid_codes)
    reverse = compensator.reverse_codes if signals.like_sensors else compensator.reverse_codes * weight
    return {
        "command_zero": str(command.zero_code),
        "command_full": str(full),
        "command_span": str(command.span(sign)),
        "command_low": str(command.valid_codes[0]),
        "command_high": str(command.valid_codes[1]),
        "command_difference": "u - COMMAND_ZERO" if rises else "COMMAND_ZERO - u",
        "clip_low": towards[0] < 0,
        "clip_high": towards[1] > command.span(sign),
        "unclipped": "towards" if towards[0] < 0 else "from_zero",
        **_sensor_plan("a", a),
        **_sensor_plan("b", b),
        "like_sensors": signals.like_sensors,
        "a_weight": str(weight),
        "b_weight": str(signals.weight_b),
        "b_weight_text": f"{float(b.per_code_MPa):.6g} MPa over {float(a.per_code_MPa):.6g} MPa, rounded to nearest",
        "weight_shift": str(WEIGHT_SHIFT),
        "pressure_turn": "b - a" if swapped else "a - b",
        "code_MPa": f"{float(a.per_code_MPa):.6g}",
        "reverse": str(reverse),
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


def _word_plan(compensator: Compensator, arithmetic: str) -> Plan:
    """Return the type of codes and their differences: 16 bits where a word of 32 costs more and they fit."""
    signals = compensator.signals
    short = arithmetic == "narrow" and signals.like_sensors and 2 * signals.code_max <= SHORT_MAX
    return {"word": "uint16_t" if short else "uint32_t", "top_bit": "15" if short else "31"}


def _table_plan(form: IntegerForm, step: int, arithmetic: str) -> Plan:
    """Return the rows of the tables: signed where products of 32 bits are cheap, of one direction in 16 bits else."""
    tables = [segments_of(table, step) for table in (form.table, form.zero_table)]
    changes = [change for table in tables for _, change in table]
    falls = max(changes) <= 0
    short = (falls or min(changes) >= 0) and max(map(abs, changes)) < 1 << 16
    plan: Plan = {"change_sign": "+", "change_type": "int32_t", "change_product": ""}
    turn = 1
    if arithmetic == "narrow":
        if short:
            turn = -1 if falls else 1
            plan |= {"change_sign": "-" if falls else "+", "change_type": "uint16_t"}
            plan["change_product"] = "short_product({}[place].change, (uint16_t)dp)"
        else:
            plan |= {"change_type": "int32_t", "change_product": "((uint32_t){}[place].change * dp)"}
    rows = [[f"{{UINT32_C({start % 2**32}), {turn * change}}}," for start, change in table] for table in tables]
    law_rows, zero_rows = ([" ".join(row[at : at + 4]) for at in range(0, len(row), 4)] for row in rows)
    return {
        **plan,
        "law_rows": law_rows,
        "zero_rows": zero_rows,
        "segment_count": str(len(tables[0]) - 1),
        "segment_count_all": str(len(tables[0])),
    }


def _arithmetic_plan(form: IntegerForm) -> Plan:
    high, low = divmod(form.half, 1 << 32)
    straight_high, straight_low = divmod(form.linear << form.linear_shift, 1 << 32)
    if not form.linear:
        straight_text = ""
    elif straight_low == 0:  # a product of one word, that stands in the high one
        straight_text = f" + ((uint64_t)(UINT32_C({straight_high}) * command) << 32)"
    else:
        straight_text = f" + ((UINT64_C({form.linear}) * command) << {form.linear_shift})"
    estimate, rest = form.estimate, form.divisor * (form.estimate.corrections + 1)
    rest_short = rest < 1 << 15
    short_estimate = estimate.factor < 1 << 16
    return {
        "slope_c": _int32(form.slope),
        "offset_c": _int32(form.offset),
        "slope": str(form.slope),
        "offset": str(form.offset),
        "offset_modulo": str(form.offset % 2**32),
        "slope_sign": "-" if form.slope < 0 else "+",
        "slope_size": str(abs(form.slope)),
        "edge_factor": str(form.edge),
        "linear": str(form.linear),
        "linear_shift": str(form.linear_shift),
        "straight_text": straight_text,
        "straight_high": str(straight_high),
        "straight_low": str(straight_low),
        "straight_product": f"short_product((uint16_t)command, {straight_high}u)"
        if straight_high < 1 << 16
        else f"UINT32_C({straight_high}) * command",
        "half": str(form.half),
        "half_high": str(high),
        "half_low": str(low),
        # One half alone in the low word: it carries where the other has its top bit, and the sum then lacks it.
        "half_carry": "(law.low >> 31)"
        if low == 1 << 31
        else f"(((law.low & UINT32_C({low})) | ((law.low | UINT32_C({low})) & ~low)) >> 31)",
        "shift": str(form.shift),
        "high_shift": f" >> {form.shift - 32}" if form.shift > 32 else "",
        "divisor": str(form.divisor),
        "largest": str(form.largest),
        "exceeds": form.exceeds,
        "reciprocal": str(form.reciprocal),
        "reciprocal_shift": str(form.reciprocal_shift),
        "estimate_product": (
            f"short_product((uint16_t)(quotient >> {estimate.shift}), {estimate.factor}u)"
            if short_estimate
            else f"((quotient >> {estimate.shift}) * UINT32_C({estimate.factor}))"
        ),
        "corrections": str(estimate.corrections),
        "correction_bounds": [str(form.divisor * (step + 1)) for step in range(estimate.corrections)],
        "rest_type": "uint16_t" if rest_short else "uint32_t",
        "rest_top": "15" if rest_short else "31",
    }


def _zero_command(compensator: Compensator, sign: int) -> tuple[int, int]:
    """Return the least and the largest compare value at zero command."""
    zero = compensator.signals.command.zero_code
    nodes = [node * compensator.beta_step_codes for node in range(compensator.nodes(sign) - 1)]
    values = [compensator.compare(zero, code, sign) for code in nodes]
    return min(values), max(values)


def _rational(value: Fraction) -> str:
    return f"{value.numerator}/{value.denominator} = {float(value):.6f}"


def _int32(value: int) -> str:
    """Print a 32-bit constant that is one on every compiler, whatever its `long` is."""
    return f"{'-' if value < 0 else ''}INT32_C({abs(value)})"
