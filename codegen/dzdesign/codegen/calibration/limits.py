"""What the arithmetic of the block form bears: limits of single numbers, for the check in C and the one in Python."""

from dzdesign.codegen.calibration.layout import NO_INTERLOCK
from dzdesign.codegen.core.integer_form import INT32_MAX
from dzdesign.design.current.circuit import LARGEST_ERROR, LARGEST_GAIN
from dzdesign.design.drive_functions import MOST_FAULT_SAMPLES
from dzdesign.design.signals import LARGEST_DIFFERENCE, WEIGHT_SHIFT

#: 04C11DB7h, reflected.
CRC_POLYNOMIAL = 0xEDB88320
#: Pressure drop in codes of sensor A times 4096: one more would be a code too many.
LARGEST_DROP = ((LARGEST_DIFFERENCE + 1) << WEIGHT_SHIFT) - 1
#: Above it a difference from it could leave 31 bits.
LARGEST_TESTED = 2**30 - 1
#: Codes of command that the drive functions count with, and ticks of half a dither's wave.
LARGEST_CODES = 32767
LARGEST_PLAY, LARGEST_NOISE, LARGEST_STEP_SHIFT = 32, 4095, 12
LARGEST_GAIN_SHIFT, LARGEST_CURRENT_SHIFT, LARGEST_OFFSET_SHIFT = 13, 15, 12


def largest_node(beta_step: int) -> int:
    """Return the largest node: times the codes between two nodes it stays below 2^31.

    Examples
    --------
    >>> largest_node(64)
    33554431
    """
    return INT32_MAX // beta_step


def crc_steps() -> tuple[int, ...]:
    """Return what four zero bits more make of the CRC-32 of four bits, for each value of these.

    Examples
    --------
    >>> [f"{step:08X}" for step in crc_steps()[:3]]
    ['00000000', '1DB71064', '3B6E20C8']
    """
    found = list(range(16))
    for _ in range(4):
        found = [step >> 1 ^ (CRC_POLYNOMIAL if step & 1 else 0) for step in found]
    return tuple(found)


#: Limits that the C names; each its value, its literal and what it is.
NAMED: tuple[tuple[str, int, str, str], ...] = (
    ("LARGEST_WORD", 2**32 - 1, "uint32", "largest number of 32 bits"),
    ("LARGEST_INT32", INT32_MAX, "uint32", "largest number of 32 bits with a sign"),
    ("LARGEST_DROP", LARGEST_DROP, "uint32", "largest pressure drop of valid codes, codes of sensor A times 4096"),
    ("LARGEST_TESTED", LARGEST_TESTED, "uint32", "largest limit of the tested pressure drops, in the same unit"),
    ("LARGEST_CODES", LARGEST_CODES, "plain", "largest count of codes, or of ticks, in 16 bits with a sign"),
    ("LARGEST_PLAY", LARGEST_PLAY, "plain", "most codes of travel between the branches of the play"),
    ("LARGEST_NOISE", LARGEST_NOISE, "plain", "most codes that a command may stray without turning"),
    ("LARGEST_STEP_SHIFT", LARGEST_STEP_SHIFT, "plain", "largest distance of nodes, a power of two"),
    ("MOST_FAULT_SAMPLES", MOST_FAULT_SAMPLES, "plain", "most samples that end a fault"),
    ("NO_INTERLOCK", NO_INTERLOCK, "plain", "the drive waits for no zero command"),
)
#: The same of the current controller.
OF_CURRENT: tuple[tuple[str, int, str, str], ...] = (
    ("LARGEST_GAIN", LARGEST_GAIN, "plain", "largest gain"),
    ("LARGEST_GAIN_SHIFT", LARGEST_GAIN_SHIFT, "plain", "most fractional bits of the gains"),
    ("LARGEST_ERROR", LARGEST_ERROR, "uint32", "largest current that is no short, counts"),
    ("LARGEST_OFFSET_SHIFT", LARGEST_OFFSET_SHIFT, "plain", "most sums that the offset is the mean of, a power of two"),
)
