"""The numbers of the F280049C project, derived once from engineering quantities and checked here.

Functions and clocks: DriverLib of C2000Ware for the F28004x (epwm.h, adc.h, sysctl.h, device.h); limits of the
converter: data sheet SPRS945.
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
    c2000_target,
    current_timing,
    exact,
    printed,
    pwm_timing,
    within,
)
from dzdesign.codegen.target import FlashSector, Target
from dzdesign.core.errors import InputError
from dzdesign.design.target_inputs import Converter, peak_noise_codes

SYSCLK_HZ = 100_000_000  # DEVICE_SYSCLK_FREQ of device.h: 20 MHz crystal, times 10, over 2
SOCA_PRESCALE_MAX = 15  # EPWM_setADCTriggerEventPrescale()
ADC_DIVIDER = 2  # ADC_CLK_DIV_2_0
ADCCLK_MAX_HZ = 50_000_000
WINDOW_SYSCLKS, WINDOW_MAX_SYSCLKS = 50, 512  # ADC_setupSOC()
WINDOW_LEAST_S = Fraction(75, 10**9)
CONVERSION_ADCCLKS = 12  # one more than the 10.5 of 12 bits, rounded up
WATCHDOG_HZ = 10_000_000  # INTOSC1
#: ADC_CH_ADCINn of ADC A that is a pin of the package with 100: SPRS945G, "Analog Signals".
CHANNELS_OF_PINS = {f"A{number}": number for number in (*range(7), 8, 9, 10)}
PWM_MODULES = 8
ADC_SPAN_V = Fraction(33, 10)
# SPRS945G, table of the ADC's characteristics: largest offset error; largest gain error with the internal reference,
# which dz_hardware.c takes; SNR with SYSCLK from X1, which device.h takes.
OFFSET_CODES, GAIN_CODES, SNR_DB = 5, 45, 68.8


def timing() -> dict[str, str]:
    """Return figures of clock, PWM, interrupt and time-outs, printed."""
    return {
        **pwm_timing(SYSCLK_HZ, WATCHDOG_HZ, SOCA_PRESCALE_MAX),
        "sysclk_hz": str(SYSCLK_HZ),
        "clock_mhz": printed(Fraction(SYSCLK_HZ, 10**6)),
    }


def converter() -> dict[str, str]:
    """Return figures of the converter, printed; the conversions must be over well before the interrupt."""
    adcclk_hz = within(Fraction(SYSCLK_HZ, ADC_DIVIDER), 5_000_000, ADCCLK_MAX_HZ, "ADCCLK in Hz")
    exact(Fraction(WINDOW_SYSCLKS), "SYSCLK cycles of the sample window", WINDOW_MAX_SYSCLKS)
    window_s = Fraction(WINDOW_SYSCLKS, SYSCLK_HZ)
    within(window_s, max(WINDOW_LEAST_S, 1 / adcclk_hz), 1, "the sample window in s")
    conversion_s = window_s + CONVERSION_ADCCLKS / adcclk_hz
    sequence_s = within((DISCARDED + CHANNELS) * conversion_s, 0, ISR_DELAY_S / 2, "the conversions in s")
    with_supply_s = sequence_s + conversion_s
    current = current_timing(SYSCLK_HZ, window_s, conversion_s)
    within(with_supply_s, 0, Fraction(current["current_start"]) / SYSCLK_HZ, "the conversions with the supply in s")
    # A board's window: of the data sheet, and as long as the conversions may take.
    longest_s = ISR_DELAY_S / 2 / (DISCARDED + CHANNELS + 1) - CONVERSION_ADCCLKS / adcclk_hz
    return {
        "adc_divider": f"{ADC_DIVIDER}_0",
        "adcclk_mhz": printed(adcclk_hz / 10**6),
        "window_sysclks": str(WINDOW_SYSCLKS),
        "window_us": printed(window_s * 10**6),
        "sequence_us": printed(sequence_s * 10**6),
        "sequence_with_supply_us": printed(with_supply_s * 10**6),
        "window_least": str(ceil(max(WINDOW_LEAST_S, 1 / adcclk_hz) * SYSCLK_HZ)),
        "window_most": str(int(longest_s * SYSCLK_HZ)),
        "pwm_modules": str(PWM_MODULES),
        "channels_of_pins": f"0x{sum(1 << number for number in CHANNELS_OF_PINS.values()):04X}",
        **current,
        "current_held_us": printed(window_s * 10**6),
        "current_timeout_ticks": "2",  # a flag comes with the last of eight codes
        "adc_codes": str(2**ADC_BITS),
        "adc_code_max": str(2**ADC_BITS - 1),
        "adc_span_v": printed(ADC_SPAN_V),
    }


WARE, DRIVERLIB = "device_support/f28004x/common", "driverlib/f28004x/driverlib"
#: Device, headers of TI's that the C includes, options and files of TI's that its project takes, below C2000Ware.
#: device.h and the linker files expect these options of the compiler, as TI's own project files for this part set them.
PROJECT = {
    "device": "TMS320F280049C",
    "device_headers": "driverlib.h device.h",
    "serve_watchdog": "SysCtl_serviceWatchdog",
    "trip_inputs": "input X-BAR 1, TZ1;input X-BAR 2, TZ2",
    "ram_functions": "clear_flag",
    "output_format": "ELF",
    "compiler_options": "-v28 -ml -mt --float_support=fpu32 --tmu_support=tmu0 --abi=eabi -O2 --c99 -g "
    "--gen_func_subsections=on --diag_warning=225 --diag_suppress=10063",
    "linker_options": "--stack_size=0x3F8 --entry_point=code_start --rom_model",
    "library": "libc.a",
    "ti_folders": "driverlib/f28004x device_support/f28004x",
    "ti_includes": f"{DRIVERLIB} {WARE}/include",
    "ti_sources": f"{WARE}/source/device.c {WARE}/source/f28004x_codestartbranch.asm",
    "ti_flash_sources": "",
    "ti_linked": f"{DRIVERLIB}/ccs/Release/driverlib_eabi.lib",
    "ti_ram_linker_file": f"{WARE}/cmd/28004x_generic_ram_lnk.cmd",
    "ti_flash_linker_file": f"{WARE}/cmd/28004x_generic_flash_lnk.cmd",
    "ti_debug_target": f"{WARE}/targetConfigs/TMS320F280049C.ccxml",
}


def on_board(crystal_hz: int | None = None, channels: Sequence[str] = (), inputs: Sequence[str] = ()) -> Target:
    """Return the target on a declared board, see `Target.on_board`."""
    if crystal_hz:
        raise InputError("--crystal is for target f28335: the clock of f280049c is that of TI's device.h; leave it out")
    return c2000_target(
        "f280049c",
        "TI TMS320F280049C at 100 MHz: DriverLib, ePWM1 at 2.5 kHz, ADC at 1.25 kHz, CCS project and makefile",
        {**timing(), **converter(), **PROJECT},
        known_channels=CHANNELS_OF_PINS,
        channels=channels,
        inputs=inputs,
        converter=Converter(
            full_V=ADC_SPAN_V,
            levels=2**ADC_BITS,
            offset_codes=OFFSET_CODES,
            gain_codes=GAIN_CODES,
            noise_codes=peak_noise_codes(SNR_DB, 2**ADC_BITS),
        ),
        # Of bank 1, which can be erased while the firmware runs from bank 0.
        sector=FlashSector(
            region="FLASH_BANK1_SEC8", page=0, file="28004x_generic_flash_lnk.cmd", address=0x09_8000, words=0x1000
        ),
    )


TARGET = replace(on_board(), of_board=on_board)
