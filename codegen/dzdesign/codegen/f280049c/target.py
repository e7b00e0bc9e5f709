"""The numbers of the F280049C project, derived once from engineering quantities and checked here.

Functions and clocks: DriverLib of C2000Ware for the F28004x (epwm.h, adc.h, sysctl.h, device.h); limits of the
converter: data sheet SPRS945.
"""

from fractions import Fraction

from dzdesign.codegen.target import Target
from dzdesign.core.errors import DzdesignError

SYSCLK_HZ = 100_000_000  # DEVICE_SYSCLK_FREQ of device.h: 20 MHz crystal, times 10, over 2
PWM_HZ = 2_500  # section 3 of the paper
SAMPLE_HZ = 1_250  # section 4.1 of the paper
ISR_DELAY_S = Fraction(20, 10**6)  # from the start of conversion to the interrupt
SOCA_PRESCALE_MAX = 15  # EPWM_setADCTriggerEventPrescale()
ADC_DIVIDER = 2  # ADC_CLK_DIV_2_0
ADCCLK_MAX_HZ = 50_000_000
WINDOW_SYSCLKS, WINDOW_MAX_SYSCLKS = 50, 512  # ADC_setupSOC()
WINDOW_LEAST_S = Fraction(75, 10**9)
CONVERSION_ADCCLKS = 12  # one more than the 10.5 of 12 bits, rounded up
CONVERSIONS = 3
SAMPLE_TIMEOUT_S = Fraction(32, 10**4)  # four sample periods
WATCHDOG_HZ = 10_000_000  # INTOSC1
WATCHDOG_COUNTS = 512 * 256  # predivider 512, prescaler 1, eight bits
ADC_BITS, ADC_SPAN_V = 12, Fraction(33, 10)


def exact(quantity: Fraction, what: str, largest: int) -> int:
    """Return `quantity` as the integer that it must be.

    Parameters
    ----------
    quantity : Fraction
        A number of counts or periods, exact.
    what : str
        Its name in the message.
    largest : int
        What its register or function takes.

    Raises
    ------
    DzdesignError
        If it is not an integer from 1 to `largest`.
    """
    if quantity.denominator != 1 or not 0 < quantity <= largest:
        raise DzdesignError(f"f280049c: {what} must be an integer from 1 to {largest}, got {quantity}")
    return quantity.numerator


def within(quantity: Fraction, least: Fraction | int, most: Fraction | int, what: str) -> Fraction:
    """Return `quantity` if it lies from `least` to `most`.

    Parameters
    ----------
    quantity, least, most : Fraction
        In the same unit.
    what : str
        Name and unit for the message.

    Raises
    ------
    DzdesignError
        If it lies outside.
    """
    if not least <= quantity <= most:
        raise DzdesignError(
            f"f280049c: {what} must lie from {float(least):g} to {float(most):g}, got {float(quantity):g}"
        )
    return quantity


def printed(quantity: Fraction) -> str:
    """Print `quantity` for a comment: exactly if it is an integer, else with three significant digits."""
    return str(quantity.numerator) if quantity.denominator == 1 else f"{float(quantity):.3g}"


def timing() -> dict[str, str]:
    """Return figures of clock, PWM, interrupt and time-outs, printed."""
    # The compare value must reach period + 1 (100 % duty), so the period is limited to 65535 counts, not 65536.
    period = exact(Fraction(SYSCLK_HZ, PWM_HZ), "counts per PWM period", 0xFFFF)
    delay = exact(SYSCLK_HZ * ISR_DELAY_S, "counts of the interrupt delay", period - 1)
    ticks_per_sample = exact(Fraction(PWM_HZ, SAMPLE_HZ), "PWM periods per sample", SOCA_PRESCALE_MAX)
    timeout = exact(SAMPLE_TIMEOUT_S * PWM_HZ, "PWM periods of the sample time-out", 0xFFFF)
    if timeout < 2 * ticks_per_sample:
        raise DzdesignError(f"f280049c: a time-out of {timeout} PWM periods would trip on one late sample")
    watchdog_s = within(Fraction(WATCHDOG_COUNTS, WATCHDOG_HZ), Fraction(2, PWM_HZ), 1, "the watchdog's time in s")
    return {
        "sysclk_hz": str(SYSCLK_HZ),
        "sysclk_mhz": printed(Fraction(SYSCLK_HZ, 10**6)),
        "pwm_hz": str(PWM_HZ),
        "sample_hz": str(SAMPLE_HZ),
        "period_us": printed(Fraction(10**6, PWM_HZ)),
        "compare_max": str(period),
        "tbprd": str(period - 1),
        "cmpb": str(delay),
        "isr_delay_us": printed(ISR_DELAY_S * 10**6),
        "ticks_per_sample": str(ticks_per_sample),
        "sample_timeout_ticks": str(timeout),
        "sample_timeout_ms": printed(SAMPLE_TIMEOUT_S * 1000),
        "watchdog_ms": printed(watchdog_s * 1000),
    }


def converter() -> dict[str, str]:
    """Return figures of the converter, printed; the conversions must be over well before the interrupt."""
    adcclk_hz = within(Fraction(SYSCLK_HZ, ADC_DIVIDER), 5_000_000, ADCCLK_MAX_HZ, "ADCCLK in Hz")
    exact(Fraction(WINDOW_SYSCLKS), "SYSCLK cycles of the sample window", WINDOW_MAX_SYSCLKS)
    window_s = Fraction(WINDOW_SYSCLKS, SYSCLK_HZ)
    within(window_s, max(WINDOW_LEAST_S, 1 / adcclk_hz), 1, "the sample window in s")
    sequence_s = CONVERSIONS * (window_s + CONVERSION_ADCCLKS / adcclk_hz)
    within(sequence_s, 0, ISR_DELAY_S / 2, "the three conversions in s")
    return {
        "adc_divider": f"{ADC_DIVIDER}_0",
        "adcclk_mhz": printed(adcclk_hz / 10**6),
        "window_sysclks": str(WINDOW_SYSCLKS),
        "window_us": printed(window_s * 10**6),
        "sequence_us": printed(sequence_s * 10**6),
        "adc_codes": str(2**ADC_BITS),
        "adc_code_max": str(2**ADC_BITS - 1),
        "adc_span_v": printed(ADC_SPAN_V),
    }


FOLDER = "f280049c"
FILES = (
    "main.c",
    "dz_hardware.c",
    "dz_hardware.h",
    "dz_isr.c",
    "dz_isr.h",
    "dzdesign.projectspec",
    "Makefile",
    "README.md",
)
CONTEXT = {
    **timing(),
    **converter(),
    "cgt_version": "22.6.3.LTS",
    # Where TI's Windows installer puts C2000Ware; the user changes this one line of the projectspec.
    "c2000ware_default": "C:/ti/c2000/C2000Ware_26_01_00_00",
    # device.h and the linker files expect these of the compiler, as TI's own project files for this part set them.
    "compiler_options": "-v28 -ml -mt --float_support=fpu32 --tmu_support=tmu0 --abi=eabi -O2 --c99 -g "
    "--gen_func_subsections=on --diag_warning=225 --diag_suppress=10063",
    "linker_options": "--stack_size=0x3F8 --entry_point=code_start --rom_model",
}

TARGET = Target(
    name=FOLDER,
    description="TI TMS320F280049C at 100 MHz: DriverLib, ePWM1 at 2.5 kHz, ADC at 1.25 kHz, CCS project and makefile",
    compare_max=int(CONTEXT["compare_max"]),
    adc_code_max=int(CONTEXT["adc_code_max"]),
    adc_full_V=ADC_SPAN_V,
    sample_Hz=SAMPLE_HZ,
    tick_Hz=PWM_HZ,
    templates={f"{FOLDER}/{file}": f"{file}.jinja" for file in FILES},
    board=frozenset({f"{FOLDER}/dzdesign.projectspec"}),  # where the user's C2000Ware lies
    context=CONTEXT,
)
