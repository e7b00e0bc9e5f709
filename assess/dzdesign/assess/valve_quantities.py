"""What a hydraulic valve test states of a flow curve: dead zone, knee, hysteresis, linearity, gain, flow at zero.

The words are those of such tests (as in ISO 10770-1); the formulas are ours, stand in `QUANTITIES`, and are printed
with every result. No conformity with a standard is claimed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

L_MIN = 1e-3 / 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A quantity of the assessment: what it is called, its unit, its formula, and the kind of its limit.

    `limit` is a quantity of `core.units`, or None where a limit makes no sense.
    """

    name: str
    unit: str
    formula: str
    limit: str | None = None


QUANTITIES: dict[str, Quantity] = {
    "dead_zone_opening": Quantity(
        name="dead zone, opening",
        unit="%",
        formula="u_r(Q_L) / u_max: command at which the rising branch passes the level Q_L",
        limit="ratio",
    ),
    "dead_zone_closing": Quantity(
        name="dead zone, closing",
        unit="%",
        formula="u_f(Q_L) / u_max: command at which the falling branch passes the level Q_L",
        limit="ratio",
    ),
    "knee_opening": Quantity(
        name="knee, opening",
        unit="%",
        formula="zero of the line through the straight part of Q/sqrt(dP) on the rising branch, over u_max",
        limit="ratio",
    ),
    "knee_closing": Quantity(
        name="knee, closing",
        unit="%",
        formula="the same on the falling branch",
        limit="ratio",
    ),
    "hysteresis": Quantity(
        name="hysteresis",
        unit="%",
        formula="largest |u_r(Q) - u_f(Q)| / u_max at Q = 5, 10, ... 90 % of the largest flow",
        limit="ratio",
    ),
    "linearity": Quantity(
        name="linearity",
        unit="%",
        formula="largest |m(u) - (a + b u)| / Q_rated in the window of u; m is the mean of both branches, each "
        "averaged over cells of 1 % of u_max (of single readings the noise would add to the largest), a + b u its "
        "least-squares line there, Q_rated the largest flow BEFORE at this pressure drop",
        limit="ratio",
    ),
    "gain": Quantity(
        name="gain",
        unit="L/min/V",
        formula="slope of the lines through the straight part, mean of both branches",
    ),
    "flow_at_zero": Quantity(
        name="flow at zero",
        unit="L/min",
        formula="mean of Q over the later half of the hold at zero command after closing",
        limit="flow",
    ),
    "largest_flow": Quantity(
        name="largest flow",
        unit="L/min",
        formula="Q at the largest command, as recorded (its pressure drop may sag)",
    ),
    "symmetry": Quantity(
        name="symmetry",
        unit="%",
        formula="gain of the positive side over that of the negative side, less 1",
        limit="ratio",
    ),
}
#: SI, or a share, to the unit of the table.
IN_UNIT = {"%": 100.0, "L/min": 1 / L_MIN, "L/min/V": 1 / L_MIN}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A quantity as read from a recording, SI or a share.

    Attributes
    ----------
    value, se : float or None
        With its standard error, where one can be had.
    at_most : float or None
        What it does not exceed, where the value itself can't be seen.
    not_observable : str
        Why there is no value; empty where there is one.
    note, where : str
        What must be known beside the value; at which flow or command it was found, of what is largest somewhere.
    """

    value: float | None = None
    se: float | None = None
    at_most: float | None = None
    not_observable: str = ""
    note: str = ""
    where: str = ""

    def __post_init__(self) -> None:
        if (self.value is None) == (not self.not_observable):
            raise ValueError("a reading has a value, or the reason why it has none")


def hidden(reason: str, at_most: float | None = None) -> Reading:
    """Return the reading of a quantity that is not observable."""
    return Reading(not_observable=reason, at_most=at_most)


def symmetry(positive: Reading | None, negative: Reading | None) -> Reading:
    """Return how much steeper one side is than the other, from the gains of both.

    Parameters
    ----------
    positive, negative : Reading or None
        Gains at one pressure drop; None where the side was not recorded there.
    """
    for gain, side in ((positive, "positive"), (negative, "negative")):
        if gain is None:
            return hidden(f"the {side} side was not recorded at this pressure drop")
        if gain.value is None:
            return hidden(f"the {side} side's gain is not observable: {gain.not_observable}")
    ratio = positive.value / negative.value
    error = math.hypot(positive.se / positive.value, negative.se / negative.value)
    return Reading(value=ratio - 1, se=abs(ratio) * error)


def differences(before: Mapping[str, Reading], after: Mapping[str, Reading]) -> dict[str, tuple[float, float | None]]:
    """Return AFTER less BEFORE and its standard error for each quantity that both show.

    Parameters
    ----------
    before, after : mapping
        Readings of `QUANTITIES`.
    """
    changes = {}
    for key in before:
        old, new = before[key], after.get(key)
        if new is not None and old.value is not None and new.value is not None:
            known = old.se is not None and new.se is not None
            changes[key] = (new.value - old.value, math.hypot(old.se, new.se) if known else None)
    return changes
