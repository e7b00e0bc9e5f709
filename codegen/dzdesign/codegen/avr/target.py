"""The core on an ATmega1280: `int` has 16 bits there, as on TI's C28x, so what only a long int hides comes out.

It is a proxy to test the arithmetic on, in simavr, not a controller: there is no converter and no PWM in it.
"""

from fractions import Fraction

from dzdesign.codegen.target import Target
from dzdesign.core.errors import DzdesignError

CLOCK_HZ = 16_000_000
BAUD = 38_400
BAUD_ERROR_MAX = Fraction(1, 100)


def baud_divider() -> int:
    """Return UBRR0 for 16 samples per bit: baud = clock / (16 (UBRR0 + 1)); a receiver bears a rate 1 % off."""
    divider = round(Fraction(CLOCK_HZ, 16 * BAUD)) - 1
    error = Fraction(CLOCK_HZ, 16 * (divider + 1)) / BAUD - 1
    if abs(error) > BAUD_ERROR_MAX:
        raise DzdesignError(f"avr: {BAUD} baud would be {float(error):+.1%} off at {CLOCK_HZ} Hz")
    return divider


FILES = ("main.c", "dz_selftest.c", "dz_selftest.h", "Makefile", "README.md")

TARGET = Target(
    name="avr",
    description="Atmel ATmega1280: self-test of the core where int has 16 bits, over UART; runs in simavr",
    compare_max=60_000,
    takes_any_signals=True,
    has_timer=False,
    arithmetic="narrow",  # an 8-bit processor pays for 64-bit products
    templates={f"avr/{file}": f"{file}.jinja" for file in FILES},
    context={
        "clock_hz": str(CLOCK_HZ),
        "clock_mhz": str(CLOCK_HZ // 10**6),
        "baud": str(BAUD),
        "baud_divider": str(baud_divider()),
    },
)
