"""An example for the Cortex-M4 that needs nothing but a compiler: vector table, start-up, SysTick, a board to fill in.

SysTick and the vector table: ARMv7-M architecture reference manual (DDI 0403), B1.5.3 and B3.3. Memory and clock are
those of ARM's image AN386 for the MPS2 board, which QEMU models; a user's chip has its own.
"""

from fractions import Fraction

from dzdesign.codegen.c2000 import PWM_HZ, SAMPLE_TIMEOUT_S, exact, printed
from dzdesign.codegen.target import Target
from dzdesign.core.errors import DzdesignError
from dzdesign.design.current.circuit import CurrentSampling
from dzdesign.design.target_inputs import Converter

FOLDER = "cortex_m4"
CLOCK_HZ = 25_000_000
SYSTICK_MAX = 2**24  # SYST_RVR has 24 bits
SELFTEST_TICKS = 25
ADC_SPAN_V, ADC_BITS = Fraction(3), 12  # what a compensator for this target is made for; a user's converter is his own
OTHER_SPAN_V = Fraction(33, 10)  # of the README's example
COMPARE_MAX = 60_000  # the PWM is the user's: full drive may be any 16-bit compare value


def systick_counts() -> int:
    """Return the clock cycles between two interrupts: an integer that SysTick holds."""
    counts = Fraction(CLOCK_HZ, PWM_HZ)
    if counts.denominator != 1 or not 1 < counts <= SYSTICK_MAX:
        raise DzdesignError(f"cortex-m4: SysTick must count an integer from 2 to {SYSTICK_MAX}, got {counts}")
    return counts.numerator


def rescaled_gain(gain: Fraction) -> str:
    """Print a gain at a converter of `OTHER_SPAN_V` as one at `ADC_SPAN_V`, rounded down to stay inside its range."""
    return f"{int(gain * ADC_SPAN_V / OTHER_SPAN_V * 10**5) / 10**5:.5f}"


BOARD_FILES = ("main.c", "dz_board.c", "dz_board.h", "startup.c", "mps2_an386.ld")  # the user's to fill in
OWN_FILES = ("main.c", "dz_board.c", "dz_board.h", "dz_hardware.h", "startup.c", "selftest.c")
SHARED_FILES = ("dz_isr.c", "dz_isr.h")  # the interrupt of the other targets
OTHER_FILES = ("dz_selftest.c", "dz_selftest.h", "mps2_an386.ld", "Makefile", "README.md")

TARGET = Target(
    name="cortex-m4",
    description="ARM Cortex-M4 without CMSIS: start-up, SysTick at 2.5 kHz, functions to fill in; runs in QEMU",
    compare_max=COMPARE_MAX,
    converter=Converter(full_V=ADC_SPAN_V, levels=2**ADC_BITS),
    takes_any_signals=True,
    current_sampling=CurrentSampling(),
    templates={f"{FOLDER}/{file}": f"{file}.jinja" for file in OWN_FILES + OTHER_FILES}
    | {f"{FOLDER}/{file}": f"c2000/{file}.jinja" for file in SHARED_FILES},
    board=frozenset(f"{FOLDER}/{file}" for file in BOARD_FILES),
    context={
        "clock_hz": str(CLOCK_HZ),
        "clock_mhz": str(CLOCK_HZ // 10**6),
        "pwm_hz": str(PWM_HZ),
        "systick_counts": str(systick_counts()),
        "systick_reload": str(systick_counts() - 1),
        "selftest_ticks": str(SELFTEST_TICKS),
        "device_headers": "dz_board.h",
        "sample_timeout_ticks": str(exact(SAMPLE_TIMEOUT_S * PWM_HZ, "PWM periods of the sample time-out", 0xFFFF)),
        "sample_timeout_ms": printed(SAMPLE_TIMEOUT_S * 1000),
        "adc_span_v": f"{float(ADC_SPAN_V):g}",
        "adc_bits": str(ADC_BITS),
        "full_count": str(COMPARE_MAX),
        "other_span_v": f"{float(OTHER_SPAN_V):g}",
        "other_gain": rescaled_gain(Fraction(3, 10)),
        "other_shunt": rescaled_gain(Fraction(150)),
    },
)
