"""The numbers of the F28335 project, derived once from engineering quantities and checked here.

All follow from the board's crystal. Register fields and limits: SPRUI07 (technical reference manual of the
TMS320x2833x), data sheet SPRS439.
"""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import ceil

from dzdesign.codegen.c2000 import (
    ADC_BITS,
    CHANNELS,
    DISCARDED,
    ISR_DELAY_S,
    PWM_HZ,
    SAMPLE_HZ,
    c2000_target,
    current_timing,
    exact,
    printed,
    pwm_timing,
    within,
)
from dzdesign.codegen.calibration.layout import NO_INTERLOCK
from dzdesign.codegen.loading.protocol import LOAD_S
from dzdesign.codegen.target import FlashSector, Target
from dzdesign.codegen.telemetry.frame import BITS_PER_OCTET, CRC_OCTETS, FRAME_BITS, FRAME_OCTETS, Link, frame_context
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.target_inputs import Converter

CRYSTAL_HZ = 30_000_000  # where no other is declared
# Of an oscillator at X1; below, the clock is too slow to make a frame of telemetry in a quarter of a PWM period.
CRYSTAL_LEAST_HZ, CRYSTAL_MOST_HZ = 12_000_000, 150_000_000
PLL_DIV_MAX, PLL_DIVSEL = 10, 2  # SYSCLKOUT = crystal * DIV / DIVSEL
SYSCLKOUT_MAX_HZ = 150_000_000
ADCCLKPS, ACQ_PS = 1, 15
ADCCLK_MAX_HZ = 25_000_000
# SPRS439, sequential sampling mode: from the trigger to the sample window, and to the first result after it; ADCCLKs.
ADC_TRIGGER_ADCCLKS, ADC_RESULT_ADCCLKS = Fraction(5, 2), 4
ADC_SPAN_V = 3
CHANNELS_OF_PINS = {f"{half}{number}": at + number for half, at in (("A", 0), ("B", 8)) for number in range(8)}
LOSPCP, LSPCLK_MAX_HZ = 1, 75_000_000
LINK = Link(tick_Hz=PWM_HZ, frame_ticks=25, baud=115_200)  # section 4.1 of the paper records at 100 Hz
FIFO_OCTETS = 16
BAUD_ERROR_MAX = Fraction(2, 100)  # what a receiver bears, with as much again for its own clock
LINE_LOAD_MAX = Fraction(1, 2)
# Bound of what the main loop spends on one frame: tests/codegen/telemetry/test_frame.py holds it on an AVR, whose
# 8 bits take several instructions where the C28x takes one.
FRAME_CYCLES = 6_000
#: The most that dz_calibration_check() takes on a Cortex-M4, of two solenoids with an inverse play.
CHECK_INSTRUCTIONS = 36_000
#: An access to flash at 150 MHz: five wait states, as C2000Ware's InitFlash() sets them; and what an instruction of the
#: check of a block is given.
FLASH_CYCLES, CHECK_CYCLES = 6, 8
#: WDFLAG: crystal periods from a falling XRS to the look at it, and those for which a watchdog reset holds it low.
WDFLAG_PERIODS, WDRST_PERIODS = 4 * 8192 + 512, 512
PWM_MODULES = 6
EVENT_PRESCALE = {1: "ET_1ST", 2: "ET_2ND", 3: "ET_3RD"}


def in_us(time_s: Fraction) -> str:
    """Print a time in microseconds, to the nanosecond.

    Examples
    --------
    >>> in_us(Fraction(37, 25 * 10**6))
    '1.48'
    """
    return f"{float(time_s * 10**6):.3f}".rstrip("0").rstrip(".")


def pll_div(crystal_hz: int) -> int:
    """Return the PLL's factor that makes the fastest clock that the device bears.

    Examples
    --------
    >>> pll_div(30_000_000), pll_div(20_000_000), pll_div(50_000_000)
    (10, 10, 6)
    """
    return min(SYSCLKOUT_MAX_HZ * PLL_DIVSEL // crystal_hz, PLL_DIV_MAX)


def sysclkout(crystal_hz: int) -> Fraction:
    """Return the clock of processor and ePWM, Hz."""
    least, most = (Fraction(limit_hz, 10**6) for limit_hz in (CRYSTAL_LEAST_HZ, CRYSTAL_MOST_HZ))
    within(Fraction(crystal_hz, 10**6), least, most, "its frequency in MHz")
    return Fraction(crystal_hz * pll_div(crystal_hz), PLL_DIVSEL)


def timing(crystal_hz: int) -> dict[str, str]:
    """Clock, PWM, interrupt and time-out figures."""
    sysclkout_hz = sysclkout(crystal_hz)
    figures = pwm_timing(sysclkout_hz, crystal_hz, max(EVENT_PRESCALE))
    rest_s = Fraction(1, PWM_HZ) - ISR_DELAY_S
    return {
        **figures,
        "clock_mhz": printed(sysclkout_hz / 10**6),
        "sysclk_hz": str(exact(sysclkout_hz, "SYSCLKOUT in Hz", SYSCLKOUT_MAX_HZ)),
        "check_instructions": str(CHECK_INSTRUCTIONS),
        "check_cycles": str(CHECK_CYCLES),
        "flash_cycles": str(FLASH_CYCLES),
        "check_ms": f"{float(1000 * CHECK_INSTRUCTIONS * CHECK_CYCLES / sysclkout_hz):.2f}",
        "wdflag_cycles": str(WDFLAG_PERIODS),
        "wdflag_ms": f"{1e3 * WDFLAG_PERIODS / crystal_hz:.2f}",
        "wdrst_us": f"{1e6 * WDRST_PERIODS / crystal_hz:.0f}",
        "crystal_hz": str(crystal_hz),
        "crystal_mhz": printed(Fraction(crystal_hz, 10**6)),
        "pll_div": str(pll_div(crystal_hz)),
        "pll_divsel": str(PLL_DIVSEL),
        "pwm_modules": str(PWM_MODULES),
        "isr_rest_us": printed(rest_s * 10**6),
        "isr_rest_cycles": printed(rest_s * sysclkout_hz),
        "soca_prescale": EVENT_PRESCALE[int(figures["ticks_per_sample"])],
    }


def converter(sysclkout_hz: Fraction) -> dict[str, str]:
    """Clock and window of the converter; the sequence must be over well before the interrupt."""
    hispcp = ceil(sysclkout_hz / (2 * ADCCLK_MAX_HZ))
    hspclk_hz = within(sysclkout_hz / (2 * hispcp), 1, ADCCLK_MAX_HZ, "HSPCLK in Hz")
    adcclk_hz = within(hspclk_hz / (2 * ADCCLKPS), 1, ADCCLK_MAX_HZ, "ADCCLK in Hz")
    next_channel = ACQ_PS + 2
    first_s = (ADC_TRIGGER_ADCCLKS + ACQ_PS + 1) / adcclk_hz  # end of the window of the first conversion
    held_s = first_s + DISCARDED * next_channel / adcclk_hz  # of the command's, which follows those not used
    results = ADC_RESULT_ADCCLKS + (DISCARDED + CHANNELS - 1) * next_channel
    sequence_s = within(first_s + results / adcclk_hz, 0, ISR_DELAY_S / 2, "the sample's sequence in s")
    with_supply_s = sequence_s + next_channel / adcclk_hz
    current = current_timing(sysclkout_hz, first_s, first_s + ADC_RESULT_ADCCLKS / adcclk_hz)
    # The sequence of the sample must be over before the first conversion of the current starts.
    within(with_supply_s, 0, Fraction(current["current_start"]) / sysclkout_hz, "the sequence with the supply in s")
    period_s = Fraction(1, PWM_HZ)
    # The value is written before the period ends and loaded at its end; the latest falling edge is one count before
    # the next end. Between two samples the value is used once more.
    to_period_s = period_s - held_s
    to_edge_s = to_period_s + period_s - 1 / sysclkout_hz
    held_periods = Fraction(PWM_HZ, SAMPLE_HZ)
    return {
        "hispcp": str(hispcp),
        "adcclkps": str(ADCCLKPS),
        "acq_ps": str(ACQ_PS),
        "hspclk_mhz": printed(hspclk_hz / 10**6),
        "adcclk_mhz": printed(adcclk_hz / 10**6),
        "window_us": printed((ACQ_PS + 1) / adcclk_hz * 10**6),
        "sequence_us": printed(sequence_s * 10**6),
        "held_us": in_us(held_s),
        "delay_to_period_us": in_us(to_period_s),
        "delay_to_edge_us": in_us(to_edge_s),
        "delay_to_last_edge_us": in_us(to_edge_s + (held_periods - 1) * period_s),
        "sequence_with_supply_us": printed(with_supply_s * 10**6),
        "current_held_us": in_us(first_s),
        **current,
        "current_timeout_ticks": "1",  # a sequencer tells of each code
        "adc_codes": str(2**ADC_BITS),
        "adc_code_max": str(2**ADC_BITS - 1),
        "adc_span_v": str(ADC_SPAN_V),
        "adcclk_max_mhz": printed(Fraction(ADCCLK_MAX_HZ, 10**6)),
    }


def serial_line(sysclkout_hz: Fraction) -> dict[str, str]:
    """Clock and rate of the serial line, and what the frames cost."""
    lspclk_hz = within(sysclkout_hz / (2 * LOSPCP), 1, LSPCLK_MAX_HZ, "LSPCLK in Hz")
    brr = exact(Fraction(round(lspclk_hz / (8 * LINK.baud)) - 1), "the baud register", 0xFFFF)
    baud = lspclk_hz / (8 * (brr + 1))
    error = baud / LINK.baud - 1
    within(abs(error), 0, BAUD_ERROR_MAX, "the error of the baud rate")
    frame_hz = exact(Fraction(LINK.tick_Hz, LINK.frame_ticks), "frames a second", LINK.tick_Hz)
    load = within(FRAME_BITS * frame_hz / baud, 0, LINE_LOAD_MAX, "the load of the line")
    # A turn of the main loop makes one frame at most; with the interrupt's share off it must fit in a PWM period,
    # of which the watchdog allows several.
    frame_s = within(FRAME_CYCLES / sysclkout_hz, 0, Fraction(1, 4 * PWM_HZ), "the making of a frame, in s,")
    return {
        "lospcp": str(LOSPCP),
        "lspclk_mhz": printed(lspclk_hz / 10**6),
        "lspclk_max_mhz": printed(Fraction(LSPCLK_MAX_HZ, 10**6)),
        "baud": str(LINK.baud),
        "brr": str(brr),
        "baud_real": str(round(baud)),
        "baud_error": f"{float(100 * error):+.2f}",
        "frame_ticks": str(LINK.frame_ticks),
        "fifo_octets": str(FIFO_OCTETS),
        "fifo_ms": printed(FIFO_OCTETS * BITS_PER_OCTET / baud * 1000),
        "no_interlock": str(NO_INTERLOCK),
        "load_s": f"{LOAD_S:g}",
        "ramp_shift": str(RAMP_UNIT.bit_length() - 1),
        "frame_hz": str(frame_hz),
        "frame_ms": printed(FRAME_BITS / baud * 1000),
        "frame_crc_octets": str(FRAME_OCTETS - 2 - CRC_OCTETS),
        "line_load": f"{float(100 * load):.1f}",
        "frame_cycles": str(FRAME_CYCLES),
        "frame_us": printed(frame_s * 10**6),
        "cpu_load": f"{float(100 * frame_s * frame_hz):.2f}",
        "ticks_wrap_s": printed(Fraction(2**16, PWM_HZ)),
    }


WARE = "device_support/f2833x"
SOURCES = ("Adc.c", "DefaultIsr.c", "MemCopy.c", "PieCtrl.c", "PieVect.c", "SysCtrl.c")
ASSEMBLY = ("ADC_cal.asm", "CodeStartBranch.asm", "usDelay.asm")
#: Device, headers of TI's that the C includes, options and files of TI's that its project takes, below C2000Ware.
PROJECT = {
    "device": "TMS320F28335",
    "device_headers": "DSP28x_Project.h",
    "serve_watchdog": "ServiceDog",
    "trip_inputs": "TZ1;TZ2",
    "ram_functions": "",
    "output_format": "COFF",
    "compiler_options": "-v28 -ml -mt --float_support=fpu32 --abi=coffabi -O2 --c99 -g --define=LARGE_MODEL "
    "--diag_warning=225 --diag_suppress=10063",
    "linker_options": "--stack_size=0x380 --entry_point=code_start --rom_model",
    "library": "rts2800_fpu32.lib",
    "ti_folders": WARE,
    "ti_includes": f"{WARE}/headers/include {WARE}/common/include",
    "ti_sources": " ".join(
        [f"{WARE}/headers/source/DSP2833x_GlobalVariableDefs.c"]
        + [f"{WARE}/common/source/DSP2833x_{name}" for name in SOURCES + ASSEMBLY]
    ),
    "ti_flash_sources": f"{WARE}/common/source/DSP2833x_CSMPasswords.asm",
    "ti_linked": f"{WARE}/headers/cmd/DSP2833x_Headers_nonBIOS.cmd",
    "ti_ram_linker_file": f"{WARE}/common/cmd/28335_RAM_lnk.cmd",
    "ti_flash_linker_file": f"{WARE}/common/cmd/F28335.cmd",
    "ti_debug_target": f"{WARE}/common/targetConfigs/TMS320F28335.ccxml",
}


def on_board(declared_hz: int | None = None, channels: Sequence[str] = (), inputs: Sequence[str] = ()) -> Target:
    """Return the target on a declared board, see `Target.on_board`."""
    crystal_hz = declared_hz or CRYSTAL_HZ
    figures = {**timing(crystal_hz), **converter(sysclkout(crystal_hz)), **serial_line(sysclkout(crystal_hz))}
    return c2000_target(
        "f28335",
        "TI TMS320F28335 at 150 MHz: ePWM1 at 2.5 kHz, ADC at 1.25 kHz, CCS project and makefile",
        {**figures, **frame_context(), **PROJECT},
        converter=Converter(full_V=Fraction(ADC_SPAN_V), levels=2**ADC_BITS),
        known_channels=CHANNELS_OF_PINS,
        channels=channels,
        inputs=inputs,
        crystal_hz=declared_hz,
        sources=("dz_telemetry.c", "dz_telemetry.h", "dz_frame.c", "dz_frame.h"),
        block_sources=("dz_active.c", "dz_active.h"),
        sector=FlashSector(region="FLASHB", page=1, file="F28335.cmd", address=0x33_0000, words=0x8000),
        link=LINK,
    )


TARGET = replace(on_board(), of_board=on_board)
