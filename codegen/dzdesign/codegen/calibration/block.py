"""A `Compensator` as the numbers of its calibration block or of a fixed firmware, and what that is compiled for."""

from math import floor
from typing import Any, TypeVar

from dzdesign.codegen.calibration.acceptance import refusals
from dzdesign.codegen.calibration.layout import (
    BLOCK_SIZES,
    LENGTH_WORDS,
    NO_INTERLOCK,
    NO_RAMP,
    RECORD_WORDS,
    SERIAL_WORDS,
    SHAPE_BITS,
    BuiltFor,
    CalibrationBlock,
    CurrentBlock,
    SensorBlock,
    SideBlock,
    Sizes,
    entries,
)
from dzdesign.codegen.calibration.packing import octet_words, text_words
from dzdesign.codegen.core.integer_form import INT32_MAX, WORD_BITS, IntegerForm, exact_reciprocal, integer_form
from dzdesign.codegen.telemetry.frame import beta_factor
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CurrentLoop
from dzdesign.design.signals import WEIGHT_SHIFT, PressureSignal

#: Nodes that stand for pressures that can't be right.
FALLBACKS = 2
ALTERNATIVE = "generate it with --calibration fixed"

Part = TypeVar("Part", SensorBlock, SideBlock, CurrentBlock)


def built_for(compensator: Compensator, *, fixed: bool = False) -> BuiltFor:
    """Return what the firmware of a compensator's block is compiled for, or the one with its numbers in it."""
    signals, drive = compensator.signals, compensator.current_drive
    holds = {
        "BIPOLAR": compensator.two_sided,
        "FALLING": signals.command.direction(1) < 0,
        **{f"AHEAD_{name}": signals.negative_pair[0] == name for name in "BC"},
        **{f"BEHIND_{name}": signals.negative_pair[1] == name for name in "AC"},
        "CURRENT": drive is not None,
        "SUPPLY": drive is not None and drive.loop.supply is not None,
        "SHUNTS": drive is not None and drive.loop.shunts == 2,
    }
    return BuiltFor(
        shape=sum(holds[name] << place for place, name in enumerate(SHAPE_BITS)),
        code_max=signals.code_max,
        compare_max=signals.compare_max,
        sample_Hz=signals.sample_Hz,
        tick_Hz=signals.tick_Hz,
        beta_step=compensator.beta_step_codes,
        samples=drive.loop.samples if drive else 0,
        sizes=_sizes_for(compensator) if fixed else BLOCK_SIZES,
        fixed=fixed,
    )


def _sizes_for(compensator: Compensator) -> Sizes:
    """Return the arrays that the numbers of a compensator take."""
    functions, drive, signs = compensator.drive_functions, compensator.current_drive, compensator.signals.signs
    play = max(len(functions.play_counts[place]) for place in range(len(signs))) if functions.has_play else 0
    supply = len(drive.loop.supply.nodes) if drive and drive.loop.supply else 0
    return Sizes(
        sensors=len(compensator.signals.pressures),
        sides=len(signs),
        # The fallback stands at the mask, behind every node of the table.
        node_mask=_all_ones(max(len(compensator.side(sign).beta) for sign in signs)),
        play_mask=_all_ones(play - 2),
        supply_mask=_all_ones(supply - 2),
    )


def _all_ones(least: int) -> int:
    """Return the smallest mask, all ones, that is no less; 0 of a negative number."""
    return (1 << max(least, 0).bit_length()) - 1


def entry_of_record(compensator: Compensator, name: str) -> str:
    """Return a text of the block: that entry of the test record; one setting for a lot is of no valve."""
    if compensator.lot:
        return ""
    return next((text for key, text in compensator.valve.record.items() if key.casefold() == name), "")


def block_of(
    compensator: Compensator, digest: str, *, serial: str | None = None, record: str | None = None
) -> CalibrationBlock:
    """Return the block of a compensator whose file has the SHA-256 `digest`.

    Serial number and record are by default those of the valve's test record. More nodes of beta or of the play than a
    block has room for, a longer text, and numbers that its own firmware would refuse are an `InputError`.
    """
    built = built_for(compensator)
    serial, record = (
        entry_of_record(compensator, name) if given is None else given
        for name, given in (("serial", serial), ("record", record))
    )
    block = _numbers(compensator, built, digest, serial, record)
    if refused := _refused(block, built):
        raise InputError(f"the firmware would refuse this compensator's calibration block ({refused}); {ALTERNATIVE}")
    return block


def numbers_of(compensator: Compensator) -> CalibrationBlock:
    """Return the numbers of a compensator for a firmware that has them as constants: nothing identifies them there.

    Numbers outside the range of the core's arithmetic are an `InputError`.
    """
    built = built_for(compensator, fixed=True)
    numbers = _numbers(compensator, built, "", "", "")
    if refused := _refused(numbers, built):
        raise InputError(f"numbers of this compensator leave the range of the firmware's arithmetic ({refused})")
    return numbers


def _refused(block: CalibrationBlock, built: BuiltFor) -> str:
    return "; ".join(f"{name}: {', '.join(rules)}" for name, rules in refusals(block, built).items())


def _numbers(compensator: Compensator, built: BuiltFor, digest: str, serial: str, record: str) -> CalibrationBlock:
    """Return the numbers, whatever their firmware says of them."""
    c, signals, functions = compensator, compensator.signals, compensator.drive_functions
    command = signals.command
    sensors = [_sensor(name, sensor, built) for name, sensor in signals.pressures.items()]
    interlock = functions.interlock_codes
    return CalibrationBlock(
        length=LENGTH_WORDS,
        shape=built.shape,
        code_max=signals.code_max,
        compare_max=signals.compare_max,
        sample_Hz=signals.sample_Hz,
        tick_Hz=signals.tick_Hz,
        compensator_sha256=octet_words(bytes.fromhex(digest)),
        serial=text_words(serial, SERIAL_WORDS, "the serial number"),
        record=text_words(record, RECORD_WORDS, "the record"),
        u_max_uV=0 if built.fixed else _displayed(float(c.u_max_V), "full command in V"),
        sensors=(sensors[0], sensors[1], sensors[2] if len(sensors) > 2 else _nothing(SensorBlock)),
        reverse=c.reverse_codes << WEIGHT_SHIFT,
        command_zero=command.zero_code,
        command_low=command.valid_codes[0],
        command_high=command.valid_codes[1],
        beta_step=c.beta_step_codes,
        transition_codes=c.transition_codes or 1,
        zero_band=c.zero_band_codes,
        compare_limit=functions.compare_limit,
        leave_zero=functions.leave_zero_codes,
        fault_samples=functions.fault_samples,
        fault_latch=int(functions.fault_latch),
        interlock=NO_INTERLOCK if interlock is None else interlock,
        ramps=int(functions.has_ramp),
        dither_counts=functions.dither_counts,
        dither_ticks=functions.dither_ticks,
        play_codes=functions.play_codes if functions.has_play else 0,
        play_noise=functions.play_noise_codes if functions.has_play else 0,
        play_step_shift=_shift(functions.play_step_codes) if functions.has_play else 0,
        play_shift=_shift(functions.play_codes * c.transition_codes) if functions.has_play else 0,
        sides=(_side(c, 1, built.sizes), _side(c, -1, built.sizes) if c.two_sided else _nothing(SideBlock)),
        current=current_block(c.current_drive.loop, built.sizes) if c.current_drive else _nothing(CurrentBlock),
        crc32=0,
    )


def _sensor(name: str, sensor: PressureSignal, built: BuiltFor) -> SensorBlock:
    """Return the numbers of the sensor at one pressure input."""
    return SensorBlock(
        span_Pa=0 if built.fixed else _displayed(float(sensor.span_MPa), f"the span of sensor {name} in MPa"),
        full=sensor.full_code,
        zero=sensor.zero_code,
        low=sensor.valid_codes[0],
        high=sensor.valid_codes[1],
    )


def _side(c: Compensator, sign: int, sizes: Sizes) -> SideBlock:
    """Return the law of one sign of command."""
    form, side, functions, command = integer_form(c, sign), c.side(sign), c.drive_functions, c.signals.command
    place = 0 if sign > 0 else 1
    pair = c.signals.pair(sign)
    codes = floor(pair.dp_code(side.certificate.dp_MPa[1]))
    unit = form.scale_beta * c.beta_denominator
    factor, shift = beta_factor(unit * c.beta_step_codes, max(form.table) * c.beta_step_codes)
    return SideBlock(
        offset=form.offset,
        slope=_twos_complement(form.slope),
        transition=form.transition,
        linear=form.linear << form.linear_shift,
        **_division(form, functions.compare_limit),
        balance=((pair.ahead.zero_code << WEIGHT_SHIFT) - pair.behind.zero_code * pair.weight) % 2**32,
        weight=pair.weight,
        tested_to=((codes + 1) << WEIGHT_SHIFT) - 1,
        beta_unit=unit,
        beta_factor=factor,
        ramp_up=functions.ramp_up[place] or NO_RAMP,
        ramp_down=functions.ramp_down[place] or NO_RAMP,
        nodes=_beta_nodes(form, c.valve.side_name(sign), sizes.node_mask),
        node_count=len(side.beta),
        beta_shift=shift,
        span=command.span(sign),
        room=command.span(sign) - c.zero_band_codes,
        band_end=command.zero_code + command.direction(sign) * c.zero_band_codes,
        play=_nodes(functions.play_counts[place], sizes.play_mask, "the width of the inverse play"),
    )


def _twos_complement(value: int) -> int:
    """Return a number as its word of 32 bits has it."""
    if abs(value) > INT32_MAX:
        raise InputError(
            f"the law's slope is {value}, beyond 32 bits; choose scalings with smaller common denominators"
        )
    return value % 2**32


def _beta_nodes(form: IntegerForm, side: str, room: int) -> tuple[int, ...]:
    """Return the nodes as pairs, that of the law and that at zero command, and at the end twice the smallest."""
    law, zero = form.table, form.zero_table or form.table
    if len(law) > room + FALLBACKS:
        raise InputError(
            f"beta of {side} commands has {len(law) - FALLBACKS} nodes, of which a calibration block holds {room} at "
            f"most; {ALTERNATIVE}, or give pressure sensors of more alike spans"
        )
    pairs = [*zip(law[:-FALLBACKS], zero[:-FALLBACKS], strict=True)]
    pairs += [(0, 0)] * (room - len(pairs)) + [(law[-1], zero[-1])] * FALLBACKS
    return tuple(number for pair in pairs for number in pair)


def _division(form: IntegerForm, compare_limit: int) -> dict[str, int]:
    """Return what brings the sum's upper 32 bits to counts: half a count, the largest quotient, and the reciprocal."""
    divisor = form.divisor << (form.shift - WORD_BITS)
    if divisor == 1:  # 2^32 is no reciprocal of 32 bits: a count more, times 2^32 - 1, is a count less
        return {"half": form.half + (1 << WORD_BITS), "quotient_limit": compare_limit + 1,
                "reciprocal": (1 << WORD_BITS) - 1, "reciprocal_shift": 0}  # fmt: skip
    # The sum stays below 2^63, so no quotient is larger, whatever the limit.
    largest = min((compare_limit + 1) * divisor - 1, INT32_MAX)
    reciprocal, shift = exact_reciprocal(divisor, largest)
    return {"half": form.half, "quotient_limit": largest, "reciprocal": reciprocal,
            "reciprocal_shift": shift - WORD_BITS}  # fmt: skip


def current_block(loop: CurrentLoop, sizes: Sizes = BLOCK_SIZES) -> CurrentBlock:
    """Return the current controller; what is not named here has its name, and its number, from the loop."""
    supply = loop.supply
    low, high = supply.valid_codes if supply else (0, 0)
    numbers: dict[str, Any] = {name: getattr(loop, name) for name in entries(CurrentBlock) if hasattr(loop, name)}
    numbers |= {
        "integral_limit": loop.integral_limit << loop.gain_shift,
        "release": loop.release << loop.gain_shift,
        "offset_low": max(loop.offset_nominal - loop.offset_tolerance, 0),
        "offset_high": loop.offset_nominal + loop.offset_tolerance,
        "supply_low": low,
        "supply_high": high,
        "supply_shift": _shift(supply.step_codes) if supply else 0,
        "supply": _nodes(supply.nodes if supply else (), sizes.supply_mask, "the supply's correction"),
    }
    return CurrentBlock(**numbers)


def _nothing(kind: type[Part]) -> Part:
    """Return a part of the block that its firmware does not use: all zero."""
    nothing: dict[str, Any] = {
        name: (0,) * entry.count if entry.count > 1 else 0 for name, entry in entries(kind).items()
    }
    return kind(**nothing)


def _nodes(numbers: tuple[int, ...], mask: int, what: str) -> tuple[int, ...]:
    room = mask + 2
    if len(numbers) > room:
        raise InputError(
            f"{what} has {len(numbers)} nodes, of which a calibration block holds {room} at most; {ALTERNATIVE}, or "
            "design it for a converter of fewer codes"
        )
    return (*numbers, *(0,) * (room - len(numbers)))


def _shift(power: int) -> int:
    """Return s of a power of two 2^s."""
    return power.bit_length() - 1


def _displayed(value: float, what: str) -> int:
    """Return a value in millionths of its unit."""
    if not 0 <= round(value * 1e6) < 1 << 32:
        raise InputError(f"{what} is {value:g}; a calibration block shows values below 4294; {ALTERNATIVE}")
    return round(value * 1e6)
