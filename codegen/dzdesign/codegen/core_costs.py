"""What law and drive take on a processor, for the READMEs.

A generator has no compiler for the target, so these are figures of two designs of dzdesign's own, which a test measures
again.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCost:
    """Bytes, and the most that a call takes, of one design; in block form of the check and with other blocks too."""

    flash_bytes: int
    stack_bytes: int
    ram_bytes: int = 0
    valve_bytes: int = 32
    #: Of dz_comp(), dz_drive_sample() and dz_drive_tick().
    most: tuple[int, int, int]
    #: The same with other blocks: every drive function on, and the longest shifts.
    hardest: tuple[int, int, int] = (0, 0, 0)
    check_flash_bytes: int = 0
    check_stack_bytes: int = 0
    check_ram_bytes: int = 0
    check_most: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCosts:
    """The figures of one processor, by the form of the core: "fixed" or "block"."""

    processor: str
    #: Name, version and options.
    compiler: str
    #: What of a call is counted.
    unit: str
    #: Of a command of one sign and like sensors, with the default options.
    default: Mapping[str, MeasuredCost]
    #: Of two solenoids, unlike sensors, ramps, dither, a largest output and latched faults.
    everything: Mapping[str, MeasuredCost]


#: By target; no compiler for the others was at hand.
MEASURED = {
    "cortex-m4": MeasuredCosts(
        processor="Cortex-M4",
        compiler="arm-none-eabi-gcc 12.2.1 -O2",
        unit="instructions",
        default={
            "fixed": MeasuredCost(flash_bytes=1508, stack_bytes=40, most=(68, 136, 3)),
            "block": MeasuredCost(
                flash_bytes=1560, stack_bytes=80, most=(84, 213, 7), hardest=(84, 294, 28),
                check_flash_bytes=1780, check_stack_bytes=92, check_most=31390,
            ),
        },
        everything={
            "fixed": MeasuredCost(flash_bytes=3276, stack_bytes=48, most=(74, 250, 29)),
            "block": MeasuredCost(
                flash_bytes=2556, stack_bytes=88, most=(85, 305, 35), hardest=(85, 373, 35),
                check_flash_bytes=1996, check_stack_bytes=132, check_most=35549,
            ),
        },
    ),
}  # fmt: skip
#: The most that dz_calibration_check() takes there, of two solenoids with an inverse play.
CHECK_INSTRUCTIONS = 35_500
#: What stands in for a target without figures of its own.
STAND_IN = "cortex-m4"
