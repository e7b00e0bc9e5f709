"""What law and drive take on a processor, as `verify --machine-code` measures it, for the READMEs.

A generator has no compiler for the target, so these are figures of two designs of dzdesign's own, which a test measures
again; whoever verifies a firmware is told its own.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCost:
    """Bytes, and the most that a call takes, of one design."""

    flash_bytes: int
    ram_bytes: int
    valve_bytes: int
    stack_bytes: int
    #: Of dz_comp(), dz_drive_sample() and dz_drive_tick().
    most: tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredBlockCost:
    """The same of a core in block form with the block of that design, and what other blocks and the check add."""

    core: MeasuredCost
    check_flash_bytes: int
    check_ram_bytes: int
    check_stack_bytes: int
    check_most: int
    #: The most of a call that was counted with other blocks too: every drive function on, and the longest shifts.
    hardest: tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCosts:
    """The figures of one processor."""

    processor: str
    #: Name, version and options.
    compiler: str
    #: What of a call is counted.
    unit: str
    #: Of a command of one sign and like sensors, with the default options.
    default: MeasuredCost
    #: Of two solenoids, unlike sensors, ramps, dither, a largest output and latched faults.
    everything: MeasuredCost
    #: Of the same two in block form.
    default_block: MeasuredBlockCost
    everything_block: MeasuredBlockCost


#: By target; no compiler for the others was at hand.
MEASURED = {
    "cortex-m4": MeasuredCosts(
        processor="Cortex-M4",
        compiler="arm-none-eabi-gcc 12.2.1 -O2",
        unit="instructions",
        default=MeasuredCost(flash_bytes=1508, ram_bytes=0, valve_bytes=32, stack_bytes=40, most=(68, 136, 3)),
        everything=MeasuredCost(flash_bytes=3276, ram_bytes=0, valve_bytes=32, stack_bytes=48, most=(74, 250, 29)),
        default_block=MeasuredBlockCost(
            core=MeasuredCost(flash_bytes=1560, ram_bytes=0, valve_bytes=32, stack_bytes=80, most=(84, 213, 7)),
            check_flash_bytes=1780,
            check_ram_bytes=0,
            check_stack_bytes=92,
            check_most=31390,
            hardest=(84, 294, 28),
        ),
        everything_block=MeasuredBlockCost(
            core=MeasuredCost(flash_bytes=2556, ram_bytes=0, valve_bytes=32, stack_bytes=88, most=(85, 305, 35)),
            check_flash_bytes=1996,
            check_ram_bytes=0,
            check_stack_bytes=132,
            check_most=35549,
            hardest=(85, 373, 35),
        ),
    ),
}
#: The most that dz_calibration_check() takes there, of two solenoids with an inverse play.
CHECK_INSTRUCTIONS = 35_500
#: What stands in for a target without figures of its own.
STAND_IN = "cortex-m4"
