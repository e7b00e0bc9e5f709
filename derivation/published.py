"""The numbers that the paper prints, once: exact, as printed, with where they stand."""

from dataclasses import dataclass

import sympy

from dzdesign.derivation.statement import Replacements
from dzdesign.derivation.symbols import (
    Q_floor,
    Q_max0,
    Q_max1,
    beta,
    dP0,
    dP1,
    k,
    u_max,
    u_min0,
    u_min1,
    x_max,
)

U_MAX_V = 10
METER_FLOOR_L_MIN = sympy.Rational(6, 10)  # section 4.1


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedValve:
    """A valve of the paper, at the reference (1 MPa) and off it (5 MPa).

    Attributes
    ----------
    name, where : str
        What the report calls it, and where its numbers are printed.
    dead_zone0_percent, dead_zone1_percent : str
        Thresholds at dP0 and dP1 as printed, in per cent of u_max.
    flow0, flow1 : str
        Largest flow without compensator at dP0 and dP1 as printed, L/min.
    """

    name: str
    where: str
    dead_zone0_percent: str
    dead_zone1_percent: str
    flow0: str
    flow1: str

    def at(self) -> Replacements:
        """Return its numbers: commands in V, pressures in MPa, flows in L/min.

        k x_max, which the paper does not print, is the command left above the threshold: u_max - u_min0.
        """
        u0, u1 = (
            sympy.Rational(percent) * U_MAX_V / 100 for percent in (self.dead_zone0_percent, self.dead_zone1_percent)
        )
        return (
            (u_max, sympy.Integer(U_MAX_V)),
            (u_min0, u0),
            (u_min1, u1),
            (beta, u1 / u0),
            (k, (U_MAX_V - u0) / x_max),
            (dP0, sympy.Integer(1)),
            (dP1, sympy.Integer(5)),
            (Q_max0, sympy.Rational(self.flow0)),
            (Q_max1, sympy.Rational(self.flow1)),
            (Q_floor, METER_FLOOR_L_MIN),
        )


#: Where a number of the second valve depends on it.
DROP_ASSUMED = "at 5 MPa, which the paper does not say of this valve"
SIMULATION = PublishedValve(
    name="simulation",
    where="section 2.2",
    dead_zone0_percent="53.5",
    dead_zone1_percent="51.7",
    flow0="15",
    flow1="25.2",
)
FIRST = PublishedValve(
    name="first valve",
    where="Fig. 18",
    dead_zone0_percent="53.9",
    dead_zone1_percent="51.7",
    flow0="15.1",
    flow1="24.6",
)
SECOND = PublishedValve(
    name="second valve",
    where="Fig. 19",
    dead_zone0_percent="43.2",
    dead_zone1_percent="42.2",
    flow0="27.9",
    flow1="35.7",
)
VALVES = (SIMULATION, FIRST, SECOND)
