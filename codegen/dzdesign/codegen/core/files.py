"""The files of the core: of each its template, the values that this prints, and the constants among them."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from dzdesign.codegen.core.certificate_text import certificate_lines, zero_command
from dzdesign.codegen.core.constants import Constant, Table, defines
from dzdesign.codegen.core.drive_constants import (
    drive_constants,
    drive_interface_constants,
    interface_constants,
    play_tables,
    status_constants,
)
from dzdesign.codegen.core.integer_form import integer_form
from dzdesign.codegen.core.law_constants import KAPPA_ROUNDING, U_MIN0_ROUNDING, LawConstants, equation_of
from dzdesign.codegen.core.misra import misra_lines
from dzdesign.codegen.core.signal_constants import SignalConstants
from dzdesign.codegen.core.table_form import TableForm, table_form
from dzdesign.derivation.law import law
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signals import WEIGHT_SHIFT

#: What a template prints: texts, and objects of `design` and of this room whose fields it prints.
Values = Mapping[str, object]
#: One file per sign of command, all from one template.
CORE_SOURCES = {1: "dz_comp.c", -1: "dz_comp_negative.c"}
CORE_HEADERS = ("dz_comp.h", "dz_drive.h")
#: Codes up to half of this leave the top bit of 16 for the sign of a difference.
SHORT_MAX = 2**15 - 1
#: Segments of a table in one line of C.
TABLE_COLUMNS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class CoreFile:
    """One file of the core: its template, what this prints, and the constants among it, for the manifest."""

    template: str
    values: Values
    constants: tuple[Constant, ...]


def core_files(compensator: Compensator, arithmetic: str) -> dict[str, CoreFile]:
    """Return every file of the core, by its name.

    The arithmetic is "wide", with products of 32 by 32 to 64 bits, or "narrow", of 32 bits only.
    """
    sources = {CORE_SOURCES[sign]: _law_source(compensator, sign, arithmetic) for sign in compensator.signals.signs}
    return {
        **sources,
        "dz_comp.h": _law_header(compensator),
        "dz_drive.c": _drive_source(compensator),
        "dz_drive.h": _drive_header(compensator),
    }


def _law_source(compensator: Compensator, sign: int, arithmetic: str) -> CoreFile:
    """Return dz_comp.c, or the same for negative commands."""
    form, narrow, step = integer_form(compensator, sign), arithmetic == "narrow", compensator.beta_step_codes
    word_bits = _word_bits(compensator, arithmetic)
    of_signals = SignalConstants(compensator=compensator, sign=sign, word_bits=word_bits)
    of_law = LawConstants(compensator=compensator, form=form, sign=sign, narrow=narrow)
    signals, steps, integers = of_signals.signals(), of_signals.steps(), of_law.arithmetic()
    rows = table_form(form, step, arithmetic)
    tables = [of_law.table(False, rows)] + ([of_law.table(True, rows)] if form.zero_table else [])
    side, transition = compensator.side(sign), compensator.transition_codes
    suffix = "" if sign > 0 else "_negative"
    values = {
        **_law_words(compensator),
        **_signal_expressions(compensator, sign),
        **_arithmetic_expressions(of_law, suffix),
        "s": suffix,
        "side_text": "" if compensator.negative is None else f" for {'positive' if sign > 0 else 'negative'} commands",
        "misra_lines": misra_lines(),
        "word": f"uint{word_bits}_t",
        "word_bits": word_bits,
        "narrow": narrow,
        "form": form,
        "rows": rows,
        "unit": of_law.unit,
        "guard": side.certificate.guard,
        "kappa_text": f"{_rational(side.drive_range_over_u_max)}, {KAPPA_ROUNDING}",
        "u_min0_text": f"{_rational(side.u_min0_over_u_max)}, {U_MIN0_ROUNDING}",
        "transition_share": f"{transition / compensator.signals.command.span(sign):.2%}",
        "segment_count": len(tables[0].value) - 1,
        "step_codes": step,
        "step_text": compensator.valve.recorded_units.text(float(compensator.signals.dp_MPa(step)), ".4f MPa"),
        "signal_defines": defines(signals),
        "step_defines": defines(steps),
        "law_defines": defines(integers),
        "tables": [_table(table, rows, of_law, suffix) for table in tables],
    }
    return CoreFile(template="dz_comp.c.jinja", values=values, constants=(*signals, *steps, *integers, *tables))


def _law_header(compensator: Compensator) -> CoreFile:
    """Return dz_comp.h, the interface of the law."""
    ends, bits, units = interface_constants(compensator), status_constants(), compensator.valve.recorded_units
    values = {
        **_law_words(compensator),
        "misra_lines": misra_lines("dz_comp.h"),
        "interface_defines": defines(ends),
        "status_defines": defines(bits),
        "reverse_text": units.text(-float(compensator.signals.dp_MPa(compensator.reverse_codes)), ".3f MPa"),
        "spans": [
            units.text(float(sensor.span_MPa), "g MPa")
            for sensor in (compensator.signals.pressure_a, compensator.signals.pressure_b)
        ],
        "at_zero": {sign: zero_command(compensator, sign) for sign in compensator.signals.signs},
        "certificates": {sign: certificate_lines(compensator, sign) for sign in compensator.signals.signs},
    }
    return CoreFile(template="dz_comp.h.jinja", values=values, constants=(*ends, *bits))


def _drive_source(compensator: Compensator) -> CoreFile:
    """Return dz_drive.c, the drive functions around the law."""
    constants, tables = drive_constants(compensator), play_tables(compensator)
    values = {
        **_drive_words(compensator),
        "misra_lines": misra_lines(),
        "drive_defines": defines(constants),
        "play_tables": tables,
    }
    return CoreFile(template="dz_drive.c.jinja", values=values, constants=(*constants, *tables))


def _drive_header(compensator: Compensator) -> CoreFile:
    """Return dz_drive.h."""
    constants = tuple(drive_interface_constants(compensator))
    values = {
        **_drive_words(compensator),
        "misra_lines": misra_lines("dz_drive.h"),
        "interface_defines": defines(constants),
        "ramp_unit": RAMP_UNIT,
    }
    return CoreFile(template="dz_drive.h.jinja", values=values, constants=constants)


def _law_words(compensator: Compensator) -> Values:
    """Return what source and header print of the law."""
    chosen = law(compensator.law)
    return {
        "signals": compensator.signals,
        "u_max": compensator.valve.recorded_units.of_controller.text(float(compensator.u_max_V), "g V"),
        "bipolar": compensator.negative is not None,
        "law_text": str(chosen.output).replace("**", "^"),
        "law_equation": equation_of(chosen),
        "transition_codes": compensator.transition_codes,
        "zero_band_codes": compensator.zero_band_codes,
    }


def _drive_words(compensator: Compensator) -> Values:
    """Return what source and header print of the drive functions."""
    functions, signals = compensator.drive_functions, compensator.signals
    return {
        "bipolar": compensator.negative is not None,
        "zero_band": compensator.zero_band_codes > 0,
        "away": "command" if compensator.negative is None else "away",
        "ramp": functions.has_ramp,
        "play": functions.has_play,
        "dither": functions.dither_counts > 0,
        "rises": signals.command.direction(1) > 0,
        "sample_Hz": signals.sample_Hz,
        "functions": functions,
        "interlock": functions.interlock_codes is not None,
        "latch": functions.fault_latch,
    }


def _signal_expressions(compensator: Compensator, sign: int) -> Values:
    """Return the C that depends on which way the signals count."""
    signals, command = compensator.signals, compensator.signals.command
    towards = sorted(command.direction(sign) * (code - command.zero_code) for code in command.valid_codes)
    return {
        "command_difference": "u - COMMAND_ZERO" if command.direction(sign) > 0 else "COMMAND_ZERO - u",
        "clip_low": towards[0] < 0,
        "clip_high": towards[1] > command.span(sign),
        "unclipped": "towards" if towards[0] < 0 or compensator.transition_codes else "from_zero",
        "clipped": "past" if compensator.transition_codes else "command",
        "pressure_turn": "b - a" if sign < 0 and signals.swapped else "a - b",
        "a_weight": 2**WEIGHT_SHIFT,
    }


def _arithmetic_expressions(of_law: LawConstants, suffix: str) -> Values:
    """Return the C that depends on the widths of the law's integers."""
    form = of_law.form
    high, low = divmod(form.linear << form.linear_shift, 1 << 32)
    rest_short = form.divisor * (form.estimate.corrections + 1) < 1 << 15
    _, beta_shift = of_law.beta_scaling()
    return {
        # A word stands in the sum's high one.
        "straight": "" if not form.linear else "long" if low else "word",
        "straight_high": high,
        "straight_low": low,
        "straight_product": f"short_product{suffix}((uint16_t)command, COMMAND_HIGH_WORD)"
        if high < 1 << 16 and not of_law.compensator.transition_codes
        else "COMMAND_HIGH_WORD * command",
        # Half of an odd divisor times a power of two: alone in the low word it is its top bit, and else nothing.
        "half_carries": form.half % 2**32,
        "uses_low_word": of_law.uses_low_word,
        "beta_narrow": "scaled.high >> (BETA_SHIFT - 32u)"
        if beta_shift >= 32
        else "(scaled.high << (32u - BETA_SHIFT)) | (scaled.low >> BETA_SHIFT)",
        "estimate_product": f"short_product{suffix}((uint16_t)(quotient >> ESTIMATE_SHIFT), ESTIMATE_FACTOR)"
        if form.estimate.factor < 1 << 16
        else "((quotient >> ESTIMATE_SHIFT) * ESTIMATE_FACTOR)",
        "rest_type": "uint16_t" if rest_short else "uint32_t",
        "rest_top": 15 if rest_short else 31,
    }


def _word_bits(compensator: Compensator, arithmetic: str) -> int:
    """Return the width of codes and their differences: 16 bits where a word of 32 costs more and they fit."""
    signals = compensator.signals
    return 16 if arithmetic == "narrow" and signals.like_sensors and 2 * signals.code_max <= SHORT_MAX else 32


def _table(table: Table, form: TableForm, of_law: LawConstants, suffix: str) -> Values:
    """Return a table's rows, the pressure drop from which each line of them goes, and its beta there."""
    compensator, name = of_law.compensator, table.symbol
    step, turn = compensator.beta_step_codes, -1 if form.falls else 1
    printed = [f"{{UINT32_C({start}), {change}{'u' if form.short else ''}}}," for start, change in table.value]
    lines = [f"{printed[0]} /* pressures can't be right: beta {table.value[0][0] / of_law.unit:.6f} */"]
    for at in range(1, len(printed), TABLE_COLUMNS):
        start, change = table.value[at]
        codes = (at - 1) * step
        beta = (start + turn * change * codes) % 2**32 / of_law.unit
        begins = compensator.valve.recorded_units.text(float(compensator.signals.dp_MPa(codes)), ".3f MPa")
        lines.append(f"{' '.join(printed[at : at + TABLE_COLUMNS])} /* from {begins}: beta {beta:.6f} */")
    return {
        "symbol": name,
        "function": "zero_beta" if name == "zero_segment" else "law_beta",
        "comment": table.comment(),
        "lines": lines,
        "product": f"short_product{suffix}({name}[row].change, (uint16_t)dp)"
        if form.short
        else f"((uint32_t){name}[row].change * dp)",
        "size": len(printed),
    }


def _rational(value: Fraction) -> str:
    return f"{value.numerator}/{value.denominator} = {float(value):.6f}"
