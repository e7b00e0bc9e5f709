"""What the recordings tell of the coil's current, for a drive that controls it.

The law's output is then a share of the rated current, and the recorded thresholds are shares of the bench's full
command. They are the same share only where full command was the rated current on the bench.
"""

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures, si_factor
from dzdesign.identify.valve.model import ValveModel

#: Reading of the command that may be a coil's current and no signal of 0..20 mA, A.
LEAST_COIL_A = 0.05
#: Two currents are one to this share: the rounding of units.
SAME_CURRENT = 1e-6


def recorded_full_A(valve: ValveModel) -> float | None:
    """Return the coil's current at full command where the command was recorded as one; else None.

    A command with a live zero, such as 4..20 mA, or of no more than 20 mA is a signal.
    """
    command = valve.recorded_units.command
    if command.at_zero != 0 or not measures(command.unit, "current"):
        return None
    ampere = abs(command.factor) * valve.u_max_V * si_factor(command.unit, "current")
    return ampere if ampere >= LEAST_COIL_A else None


def check_bench_current(valve: ValveModel, rated_A: float, declared_A: float | None) -> None:
    """Refuse a rated current that is not the one of full command on the bench.

    The budget has that one's error, which is about the rated current: a distance between the two would not be in it.
    """
    recorded_A = recorded_full_A(valve)
    known = {"--bench-current": declared_A, "the recorded command": recorded_A}
    for what, ampere in known.items():
        if ampere is not None and abs(ampere / rated_A - 1) > SAME_CURRENT:
            raise InputError(
                f"--rated-current is {rated_A:g} A, but full command was {ampere:.9g} A on the bench by {what}, so the "
                f"recorded thresholds are not the same shares of it; give --rated-current '{ampere:.9g} A'"
            )


def premise_of_bench_current(valve: ValveModel, rated_A: float, declared_A: float | None) -> str:
    """Return what is taken for granted where nothing tells the bench's current; else nothing."""
    if declared_A is not None or recorded_full_A(valve) is not None:
        return ""
    unit = valve.recorded_units.command.unit
    return (
        f"the command was recorded in {unit}, which does not tell the coil's current: full command is taken as the "
        f"rated current of {rated_A:g} A, as an amplifier that controls the current makes it; of ramps recorded by "
        "duty it is the supply over a resistance that nobody knows while the coil heats up. Declare --bench-current, "
        "or record the current"
    )
