"""What the verdict on a compensator's outputs does not cover, whatever its requirements say."""

from dzdesign.design.compensator import Compensator
from dzdesign.design.pressure_inputs.negative_drop import is_wired, shown_direction


def not_covered(compensator: Compensator) -> tuple[str, ...]:
    """Return each thing that a good verdict says nothing of, as a part of its sentence."""
    if compensator.negative is None:
        if "negative" not in compensator.valve.sides:
            return ()
        return ("positive commands only: the negative side of this valve was identified and is not driven",)
    if is_wired(compensator):
        return ("at negative commands the machine must switch the pressure inputs",)
    if shown_direction(compensator.valve) == "nothing":
        return ("at negative commands the direction of the pressure drop is declared and was not recorded",)
    return ()
