"""What law and drive take on two processors, as `verify --machine-code` measures it, for the READMEs.

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
    #: The most with any block, over all paths of the machine code; None where no bound is worked out.
    bounds: tuple[int, int, int] | None

    @property
    def other_blocks(self) -> tuple[int, int, int]:
        """What a call takes with other blocks: the bound, or the most that was counted."""
        return self.bounds or self.hardest


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
        default=MeasuredCost(flash_bytes=1600, ram_bytes=0, valve_bytes=32, stack_bytes=36, most=(63, 119, 3)),
        everything=MeasuredCost(flash_bytes=3580, ram_bytes=0, valve_bytes=32, stack_bytes=40, most=(77, 241, 28)),
        default_block=MeasuredBlockCost(
            core=MeasuredCost(flash_bytes=1540, ram_bytes=0, valve_bytes=32, stack_bytes=76, most=(83, 213, 7)),
            check_flash_bytes=1784,
            check_ram_bytes=0,
            check_stack_bytes=92,
            check_most=31463,
            hardest=(83, 287, 28),
            bounds=(83, 291, 28),
        ),
        everything_block=MeasuredBlockCost(
            core=MeasuredCost(flash_bytes=2520, ram_bytes=0, valve_bytes=32, stack_bytes=84, most=(84, 308, 35)),
            check_flash_bytes=1988,
            check_ram_bytes=0,
            check_stack_bytes=132,
            check_most=35810,
            hardest=(84, 370, 35),
            bounds=(84, 374, 35),
        ),
    ),
    "avr": MeasuredCosts(
        processor="AVR",
        compiler="avr-gcc 5.4.0 -Os",
        unit="cycles",
        default=MeasuredCost(flash_bytes=3016, ram_bytes=636, valve_bytes=30, stack_bytes=132, most=(1991, 2434, 13)),
        everything=MeasuredCost(
            flash_bytes=8370, ram_bytes=1196, valve_bytes=30, stack_bytes=166, most=(2696, 4658, 77)
        ),
        default_block=MeasuredBlockCost(
            core=MeasuredCost(flash_bytes=5494, ram_bytes=0, valve_bytes=30, stack_bytes=142, most=(3071, 4260, 69)),
            check_flash_bytes=5546,
            check_ram_bytes=64,
            check_stack_bytes=155,
            check_most=363524,
            hardest=(3267, 6085, 142),
            bounds=None,
        ),
        everything_block=MeasuredBlockCost(
            core=MeasuredCost(flash_bytes=7880, ram_bytes=0, valve_bytes=30, stack_bytes=136, most=(3153, 5783, 164)),
            check_flash_bytes=6010,
            check_ram_bytes=64,
            check_stack_bytes=181,
            check_most=387844,
            hardest=(3330, 6948, 164),
            bounds=None,
        ),
    ),
}
#: The most that dz_calibration_check() takes there, of two solenoids with an inverse play.
CHECK_INSTRUCTIONS = 36_200
#: What stands in for a target without figures of its own.
STAND_IN = "cortex-m4"
