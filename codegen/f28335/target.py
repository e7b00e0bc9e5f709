"""The numbers of the F28335 project, derived once from engineering quantities and checked here.

Register fields and limits: SPRUI07 (technical reference manual of the TMS320x2833x), data sheet SPRS439.
"""

from fractions import Fraction

from dzdesign.codegen.target import Target
from dzdesign.core.errors import DzdesignError

CRYSTAL_HZ = 30_000_000
PLL_DIV, PLL_DIVSEL = 10, 2  # SYSCLKOUT = crystal * DIV / DIVSEL, as C2000Ware's InitSysCtrl() sets it
SYSCLKOUT_MAX_HZ = 150_000_000
PWM_HZ = 2_500  # section 3 of the paper
SAMPLE_HZ = 1_250  # section 4.1 of the paper
ISR_DELAY_S = Fraction(20, 10**6)  # from the start of conversion to the interrupt
HISPCP, ADCCLKPS, ACQ_PS = 3, 1, 15
ADCCLK_MAX_HZ = 25_000_000
SEQUENCE_ADCCLKS = Fraction(113, 2)  # three channels with ACQ_PS = 15, cascaded
SAMPLE_TIMEOUT_S = Fraction(32, 10**4)  # four sample periods
WATCHDOG_COUNTS = 512 * 256  # OSCCLK / 512 into eight bits, WDPS = /1
ADC_BITS, ADC_SPAN_V = 12, 3
EVENT_PRESCALE = {1: "ET_1ST", 2: "ET_2ND", 3: "ET_3RD"}


def exact(quantity: Fraction, what: str, largest: int) -> int:
    """Return `quantity` as the integer that it must be.

    Parameters
    ----------
    quantity
        A number of counts or periods, exact.
    what
        Its name in the message.
    largest
        What its register holds.

    Raises
    ------
    DzdesignError
        If it is not an integer from 1 to `largest`.

    Examples
    --------
    >>> exact(Fraction(150_000_000, 2_500), "counts per PWM period", 65536)
    60000
    """
    if quantity.denominator != 1 or not 0 < quantity <= largest:
        raise DzdesignError(f"f28335: {what} must be an integer from 1 to {largest}, got {quantity}")
    return quantity.numerator


def at_most(quantity: Fraction, limit: Fraction | int, what: str) -> Fraction:
    """Return `quantity` if it keeps within its limit.

    Parameters
    ----------
    quantity, limit
        In the same unit.
    what
        Name and unit for the message.

    Raises
    ------
    DzdesignError
        If `quantity` exceeds `limit`.
    """
    if quantity > limit:
        raise DzdesignError(f"f28335: {what} must be at most {float(limit):g}, got {float(quantity):g}")
    return quantity


def printed(quantity: Fraction) -> str:
    """Print `quantity` for a comment: exactly if it is an integer, else with three significant digits.

    Examples
    --------
    >>> printed(Fraction(113, 25))
    '4.52'
    """
    return str(quantity.numerator) if quantity.denominator == 1 else f"{float(quantity):.3g}"


def timing() -> dict[str, str]:
    """Clock, PWM, interrupt and time-out figures."""
    sysclkout_hz = at_most(Fraction(CRYSTAL_HZ * PLL_DIV, PLL_DIVSEL), SYSCLKOUT_MAX_HZ, "SYSCLKOUT in Hz")
    # CMPA must reach period + 1 (100 % duty), so the period is limited to 65535 counts, not 65536.
    period = exact(sysclkout_hz / PWM_HZ, "counts per PWM period", 0xFFFF)
    delay = exact(sysclkout_hz * ISR_DELAY_S, "counts of the interrupt delay", period - 1)
    ticks_per_sample = exact(Fraction(PWM_HZ, SAMPLE_HZ), "PWM periods per sample", max(EVENT_PRESCALE))
    timeout = exact(SAMPLE_TIMEOUT_S * PWM_HZ, "PWM periods of the sample time-out", 0xFFFF)
    if timeout < 2 * ticks_per_sample:
        raise DzdesignError(f"f28335: a time-out of {timeout} PWM periods would trip on one late sample")
    watchdog_s = Fraction(WATCHDOG_COUNTS, CRYSTAL_HZ)
    at_most(Fraction(2, PWM_HZ), watchdog_s, "two PWM periods, in watchdog time,")
    return {
        "sysclkout_mhz": printed(sysclkout_hz / 10**6),
        "crystal_mhz": printed(Fraction(CRYSTAL_HZ, 10**6)),
        "pll_div": str(PLL_DIV),
        "pll_divsel": str(PLL_DIVSEL),
        "pwm_hz": str(PWM_HZ),
        "sample_hz": str(SAMPLE_HZ),
        "period_us": printed(Fraction(10**6, PWM_HZ)),
        "compare_max": str(period),
        "tbprd": str(period - 1),
        "cmpb": str(delay),
        "isr_delay_us": printed(ISR_DELAY_S * 10**6),
        "ticks_per_sample": str(ticks_per_sample),
        "soca_prescale": EVENT_PRESCALE[ticks_per_sample],
        "sample_timeout_ticks": str(timeout),
        "sample_timeout_ms": printed(SAMPLE_TIMEOUT_S * 1000),
        "watchdog_ms": printed(watchdog_s * 1000),
    }


def converter() -> dict[str, str]:
    """Clock and window of the converter; the sequence must be over well before the interrupt."""
    sysclkout_hz = Fraction(CRYSTAL_HZ * PLL_DIV, PLL_DIVSEL)
    hspclk_hz = at_most(sysclkout_hz / (2 * HISPCP), ADCCLK_MAX_HZ, "HSPCLK in Hz")
    adcclk_hz = at_most(hspclk_hz / (2 * ADCCLKPS), ADCCLK_MAX_HZ, "ADCCLK in Hz")
    sequence_s = at_most(SEQUENCE_ADCCLKS / adcclk_hz, ISR_DELAY_S / 2, "the sequence of three, in s,")
    return {
        "hispcp": str(HISPCP),
        "adcclkps": str(ADCCLKPS),
        "acq_ps": str(ACQ_PS),
        "hspclk_mhz": printed(hspclk_hz / 10**6),
        "adcclk_mhz": printed(adcclk_hz / 10**6),
        "window_us": printed((ACQ_PS + 1) / adcclk_hz * 10**6),
        "sequence_us": printed(sequence_s * 10**6),
        "adc_codes": str(2**ADC_BITS),
        "adc_code_max": str(2**ADC_BITS - 1),
        "adc_span_v": str(ADC_SPAN_V),
        "adcclk_max_mhz": printed(Fraction(ADCCLK_MAX_HZ, 10**6)),
        "code_at_tenth": str(2**ADC_BITS // 10),
        "code_at_half": str(2**ADC_BITS // 2),
    }


FOLDER = "f28335"
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
}

TARGET = Target(
    name=FOLDER,
    description="TI TMS320F28335 at 150 MHz: ePWM1 at 2.5 kHz, ADC at 1.25 kHz, CCS project and makefile",
    compare_max=int(CONTEXT["compare_max"]),
    adc_code_max=int(CONTEXT["adc_code_max"]),
    sample_Hz=SAMPLE_HZ,
    tick_Hz=PWM_HZ,
    templates={f"{FOLDER}/{file}": f"{file}.jinja" for file in FILES},
    context=CONTEXT,
)
