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


#: By target; no compiler for the others was at hand.
MEASURED = {
    "cortex-m4": MeasuredCosts(
        processor="Cortex-M4",
        compiler="arm-none-eabi-gcc 12.2.1 -O2",
        unit="instructions",
        default=MeasuredCost(flash_bytes=1600, ram_bytes=0, valve_bytes=32, stack_bytes=36, most=(63, 119, 3)),
        everything=MeasuredCost(flash_bytes=3580, ram_bytes=0, valve_bytes=32, stack_bytes=40, most=(77, 241, 28)),
    ),
    "avr": MeasuredCosts(
        processor="AVR",
        compiler="avr-gcc 5.4.0 -Os",
        unit="cycles",
        default=MeasuredCost(flash_bytes=3016, ram_bytes=636, valve_bytes=30, stack_bytes=132, most=(1991, 2434, 13)),
        everything=MeasuredCost(
            flash_bytes=8370, ram_bytes=1196, valve_bytes=30, stack_bytes=166, most=(2696, 4658, 77)
        ),
    ),
}
#: The most that dz_calibration_check() takes there, of two solenoids with an inverse play.
CHECK_INSTRUCTIONS = 36_200
#: What stands in for a target without figures of its own.
STAND_IN = "cortex-m4"
