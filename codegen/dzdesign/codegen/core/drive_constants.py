"""The numbers of the interface and of the drive functions: `#define`s of dz_comp.h, dz_drive.h and dz_drive.c."""

from dzdesign.codegen.core.command_shares import in_unit, share_of_command
from dzdesign.codegen.core.constants import Define, Table
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signals import SIDE_NAMES

HERE = "codegen/dzdesign/codegen/core/drive_constants.py"
#: Bits that the drive adds to those of the core, each with its place.
DRIVE_BITS = {
    "WAITING": (5, "the drive waits: for valid commands, and with the interlock for zero command"),
    "HELD": (6, "the smallest beta is used until the pressures have been valid for long enough"),
    "LATCHED": (7, "a fault that stays until dz_drive_init()"),
}
OPTIONS, SIGNALS = "design/dzdesign/design/options.py", "design/dzdesign/design/signals.py"
PLAY, ZERO_BAND = "design/dzdesign/design/play.py", "design/dzdesign/design/zero_band.py"
INT32_MAX = 2**31 - 1
#: Bits of the status word, and what each says.
STATUS_BITS = {
    "COMMAND": "command outside its valid codes, so the valve is let go",
    "PRESSURE_A": "pressure A outside its valid codes, so the smallest beta is used",
    "PRESSURE_B": "pressure B outside its valid codes, so the smallest beta is used",
    "DIFFERENCE": "valid pressures, but their drop too far below zero, so the smallest beta is used",
    "ABOVE": "pressure drop above the highest tested one: no fault, but no recording either",
}


def interface_constants(compensator: Compensator) -> list[Define]:
    """Return the ends of inputs and output."""
    signals, limit = compensator.signals, compensator.drive_functions.compare_limit
    units, u_max_V = compensator.valve.recorded_units, float(compensator.u_max_V)
    share = limit / signals.compare_max
    return [
        Define(symbol="DZ_COMPARE_MAX", value=signals.compare_max, equation="Eq. (32), PWM compare value of u_max",
                 engineering=f"{units.text(u_max_V, 'g V')}, 100 % duty", data=("signals.compare_max", "u_max_V"),
                 generator=SIGNALS),
        Define(symbol="DZ_COMPARE_LIMIT", value=limit, equation="largest compare value that is put out",
                 engineering=f"{units.text(share * u_max_V, '.4g V')}, {share:.1%} duty", rounding="rounded down",
                 data=("drive_functions.compare_limit", "signals.compare_max", "u_max_V"), generator=OPTIONS),
        Define(symbol="DZ_ADC_CODE_MAX", value=signals.code_max, equation="largest code of the converter",
                 engineering="the top of its range, right-justified", data=("signals.code_max",), generator=SIGNALS),
    ]  # fmt: skip


def status_constants() -> list[Define]:
    """Return the bits of the status word: a convention, from no datum."""
    return [
        Define(symbol=f"DZ_STATUS_{name}", value=1 << place, equation=f"bit {place} of the status word",
                 engineering=text, rounding="a convention", generator=HERE)
        for place, (name, text) in enumerate(STATUS_BITS.items())
    ]  # fmt: skip


def drive_interface_constants(compensator: Compensator) -> list[Define]:
    """Return what a caller of the drive must know: `#define`s of dz_drive.h."""
    signals = compensator.signals
    return [
        Define(symbol="DZ_DRIVE_TICKS_PER_SAMPLE", value=signals.tick_Hz // signals.sample_Hz,
                 equation="PWM periods from one sample to the next",
                 engineering=f"{signals.tick_Hz} periods and {signals.sample_Hz} samples a second",
                 data=("signals.tick_Hz", "signals.sample_Hz"), generator=HERE),
        Define(symbol="DZ_DRIVE_COMMAND_ZERO", value=signals.command.zero_code,
                 equation="Eq. (29), code of zero command",
                 engineering=compensator.valve.recorded_units.of_controller.text(0.0, "g V"),
                 rounding="the converter's code, rounded down",
                 data=("signals.command.zero_code",), generator=SIGNALS),
        *drive_status_constants(),
    ]  # fmt: skip


def drive_status_constants() -> list[Define]:
    """Return the bits that the drive adds to the status word: a convention, from no datum."""
    return [
        Define(symbol=f"DZ_STATUS_{name}", value=1 << place, equation=f"bit {place} of the drive's status word",
                 engineering=text, rounding="a convention", generator=HERE)
        for name, (place, text) in DRIVE_BITS.items()
    ]  # fmt: skip


def drive_constants(compensator: Compensator) -> list[Define]:
    """Return what the drive functions need."""
    functions, bipolar = compensator.drive_functions, compensator.negative is not None
    found = [_fault_samples(compensator)]
    if functions.interlock_codes is not None:
        found.append(_interlock(compensator))
    found.append(
        Define(symbol="COMMAND_ZERO", value=compensator.signals.command.zero_code, literal="int32",
                 equation="Eq. (29), code of zero command",
                 engineering=compensator.valve.recorded_units.of_controller.text(0.0, "g V"),
                 rounding="the converter's code, rounded down", data=("signals.command.zero_code",),
                 generator=SIGNALS)
    )  # fmt: skip
    if compensator.zero_band_codes:
        found.append(_zero_band(compensator))
    if bipolar or compensator.zero_band_codes:
        found.append(_leave_zero(compensator))
    if functions.has_play:
        found += _play(compensator)
    if functions.has_ramp:
        found += _ramps(compensator)
    if functions.dither_counts:
        found += _dither(compensator)
    return found


def _fault_samples(compensator: Compensator) -> Define:
    signals, samples = compensator.signals, compensator.drive_functions.fault_samples
    return Define(
        symbol="FAULT_SAMPLES",
        value=samples,
        equation="valid samples in a row that end a fault",
        engineering=f"{1e3 * samples / signals.sample_Hz:.4g} ms",
        data=("drive_functions.fault_samples", "signals.sample_Hz"),
        generator=OPTIONS,
    )


def _interlock(compensator: Compensator) -> Define:
    codes = compensator.drive_functions.interlock_codes or 0
    return Define(
        symbol="INTERLOCK",
        value=codes,
        literal="int32",
        equation="codes of command up to which it counts as the zero command that the interlock waits for",
        engineering=share_of_command(compensator, codes),
        data=("drive_functions.interlock_codes", "signals.command", "u_max_V"),
        generator=ZERO_BAND,
    )


def _zero_band(compensator: Compensator) -> Define:
    return Define(
        symbol="ZERO_BAND",
        value=compensator.zero_band_codes,
        literal="int32",
        equation="codes of command up to which the drive comes to rest, the law's zero band",
        engineering=share_of_command(compensator, compensator.zero_band_codes),
        data=("zero_band_codes", "signals.command", "u_max_V"),
        generator=ZERO_BAND,
    )


def _leave_zero(compensator: Compensator) -> Define:
    codes = compensator.drive_functions.leave_zero_codes
    what = ["leaves its rest"] * bool(compensator.zero_band_codes)
    what += ["drives the other solenoid"] * (compensator.negative is not None)
    return Define(
        symbol="LEAVE_ZERO",
        value=codes,
        literal="int32",
        equation=f"codes by which the command must pass zero before the drive {' or '.join(what)}",
        engineering=f"{share_of_command(compensator, codes)}; a zero command with twice its noise stays within",
        data=("drive_functions.leave_zero_codes", "signals.command", "u_max_V"),
        generator=ZERO_BAND,
    )


def _play(compensator: Compensator) -> list[Define]:
    signals, functions = compensator.signals, compensator.drive_functions
    codes, band, u_max_V = functions.play_codes, compensator.transition_codes, float(compensator.u_max_V)
    units = compensator.valve.recorded_units.of_controller
    found = [
        Define(symbol="TRANSITION_CODES", value=band, literal="int32",
               equation="codes of command behind the zero band over which the play comes in, the law's transition",
               engineering=share_of_command(compensator, band), data=("transition_codes", "signals.command", "u_max_V"),
               rounding="a power of two", generator=OPTIONS),
        Define(symbol="PLAY_NOISE", value=functions.play_noise_codes, literal="int32",
               equation="codes of fluctuation to either side that do not count as a reversal",
               engineering=share_of_command(compensator, functions.play_noise_codes),
               data=("drive_functions.play_noise_codes", "signals.command", "u_max_V"), generator=PLAY),
        Define(symbol="PLAY_CODES", value=codes, literal="int32",
               equation="codes of travel from the one branch to the other",
               engineering=share_of_command(compensator, codes),
               data=("drive_functions.play_codes", "signals.command", "u_max_V"), rounding="a power of two",
               generator=PLAY),
        Define(symbol="PLAY_SHIFT", value=(codes * band).bit_length() - 1,
               equation="from travel times codes of the transition to the share of the play",
               engineering=f"1/({codes} * {band})", data=("drive_functions.play_codes", "transition_codes"),
               rounding="the share is rounded down to a count", generator=HERE),
    ]  # fmt: skip
    step = functions.play_step_codes
    found += [
        Define(symbol="PLAY_STEP", value=step, equation="codes of command between two nodes of the play's width",
               engineering=share_of_command(compensator, step), rounding="a power of two", generator=PLAY,
               data=("drive_functions.play_step_codes", "signals.command", "u_max_V")),
        Define(symbol="PLAY_STEP_SHIFT", value=step.bit_length() - 1, equation="the power of two in PLAY_STEP",
               engineering=f"1/{step}", data=("drive_functions.play_step_codes",),
               rounding="the width is rounded down to a count", generator=HERE),
        *(
            Define(symbol=f"SPAN_{SIDE_NAMES[sign].upper()}", value=signals.command.span(sign), literal="int32",
                   equation="Eq. (29), codes from zero to full command", engineering=units.text(sign * u_max_V, "g V"),
                   data=("signals.command", "u_max_V"), generator=SIGNALS)
            for sign in signals.signs
        ),
    ]  # fmt: skip
    return found


def play_tables(compensator: Compensator) -> list[Table]:
    """Return the play's width over the command, a table for each sign; none without a play."""
    functions, signals = compensator.drive_functions, compensator.signals
    units = compensator.valve.recorded_units.of_controller
    if not functions.has_play:
        return []
    found = []
    for place, sign in enumerate(signals.signs):
        nodes = functions.play_counts[place]
        volts = [float(compensator.u_max_V) * end(nodes) / signals.compare_max for end in (min, max)]
        found.append(
            Table(symbol=f"play_{SIDE_NAMES[sign]}", value=tuple((count, 0) for count in nodes),
                  equation="counts by which a falling command is driven lower than a rising one, every PLAY_STEP codes",
                  engineering=f"the recorded hysteresis, {units.number(volts[0], '.4g dV')} to "
                  f"{units.text(volts[1], '.4g dV')}",
                  rounding="rounded to nearest", generator=PLAY,
                  data=("drive_functions.play_counts", "signals.compare_max", "u_max_V"))
        )  # fmt: skip
    return found


def _ramps(compensator: Compensator) -> list[Define]:
    signals, functions = compensator.signals, compensator.drive_functions
    found = [
        Define(symbol="RAMP_UNIT", value=RAMP_UNIT, literal="int32", equation="unit of the ramped command",
                 engineering=f"1/{RAMP_UNIT} code of command", generator="design/dzdesign/design/drive_functions.py")
    ]  # fmt: skip
    for way, name, steps in (("up", "away from zero", functions.ramp_up), ("down", "to zero", functions.ramp_down)):
        for place, sign in enumerate(signals.signs):
            side = "positive" if sign > 0 else "negative"
            step, span = steps[place], signals.command.span(sign)
            seconds = f"full command in {span * RAMP_UNIT / (step * signals.sample_Hz):.4g} s" if step else "no limit"
            found.append(
                Define(
                    symbol=f"RAMP_{way.upper()}_{side.upper()}",
                    value=step or INT32_MAX,
                    literal="int32",
                    equation=f"largest change of a {side} command {name} in a sample, over RAMP_UNIT",
                    engineering=seconds,
                    rounding="rounded to nearest, 1 or more" if step else "larger than any change",
                    data=(f"drive_functions.ramp_{way}", "signals.command", "signals.sample_Hz"),
                    generator=OPTIONS,
                )
            )
    return found


def _dither(compensator: Compensator) -> list[Define]:
    signals, functions = compensator.signals, compensator.drive_functions
    ticks, counts = functions.dither_ticks, functions.dither_counts
    share = counts / signals.compare_max
    return [
        Define(symbol="DITHER_COUNTS", value=counts, equation="half the height of the dither's square wave",
                 engineering=f"{share:.3%} of full drive{in_unit(compensator, share)}",
                 rounding="rounded to nearest", generator=OPTIONS,
                 data=("drive_functions.dither_counts", "signals.compare_max", "u_max_V")),
        Define(symbol="DITHER_TICKS", value=ticks, equation="half the dither's period, PWM periods",
                 engineering=f"{1e3 * ticks / signals.tick_Hz:.4g} ms", rounding="rounded to nearest, 1 or more",
                 data=("drive_functions.dither_ticks", "signals.tick_Hz"), generator=OPTIONS),
        Define(symbol="DITHER_PERIOD", value=2 * ticks, equation="the dither's period, PWM periods",
                 engineering=f"{signals.tick_Hz / (2 * ticks):g} Hz",
                 data=("drive_functions.dither_ticks", "signals.tick_Hz"), generator=HERE),
    ]  # fmt: skip
