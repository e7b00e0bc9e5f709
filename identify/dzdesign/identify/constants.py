"""Units, limits and words that several rooms of identify share; all numbers inside are SI."""

from typing import Literal, get_args

from dzdesign.core.recorded_units import worded

#: What is taken of the threshold between the tests, from the strongest on.
Premise = Literal["line", "smooth", "monotone"]
PREMISES: tuple[Premise, ...] = get_args(Premise)
#: Probability, if a premise were true, of data as unlike it as these, below which it is refused.
REFUSED = 0.01
#: How a threshold runs with the pressure drop.
Direction = Literal["decreasing", "flat", "increasing"]
MPA = 1e6
L_MIN = 1e-3 / 60
#: Pressure drops beyond these, Pa, are a wrong unit.
SMALLEST_DP, LARGEST_DP = 1e3, 200 * MPA
#: Where ramps stand whose pressure drop is unknown, MPa: nothing depends on it.
ANYWHERE_MPa = 1.0
#: Width of a bin of commands over u_max: fine enough that a straight line inside it is exact to the noise.
BIN_WIDTH = 1e-3
#: A sweep that comes to this share of the largest command is whole: the valve must have opened in it.
FULL_SWEEP = 0.95


class Shown(float):
    """A quantity in a text, in the units of `shown_in`; ``f"{Shown(low):.2f #V}"`` leaves the unit out."""

    def __format__(self, spec: str) -> str:
        return worded(f"{{value:{spec}}}", value=float(self))
