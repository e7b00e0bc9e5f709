"""The numbers that the paper prints, once: exact, as printed, with where they stand."""

from dataclasses import dataclass, fields

import sympy

from dzdesign.derivation.account.statement import Replacements
from dzdesign.derivation.symbols import *

U_MAX_V = 10
DP0_MPA, DP1_MPA = 1, 5  # section 2.1: the reference, and off it
RAMP_S = 100  # sections 2.2 and 4.1: from zero to full command
METER_FLOOR_L_MIN = sympy.Rational("0.6")  # section 4.1, as are the next four
METER_RANGE_L_MIN = "150"
METER_ACCURACY_PERCENT = "0.5"
#: Accuracy of the flow meter, of its range.
METER_ACCURACY_L_MIN = sympy.Rational(METER_RANGE_L_MIN) * sympy.Rational(METER_ACCURACY_PERCENT) / 100
RECORDS_HZ = 100
#: "About", of the first valve at 5 MPa.
ABOUT_LARGEST_L_MIN = "27"
#: Section 3: duty cycles at a command of 2 V without (Fig. 12) and with the compensator (Fig. 13), per cent.
DUTY_COMMAND_V = 2
DUTY_WITHOUT_PERCENT, DUTY_WITH_PERCENT = "20", "55"
#: Eqs. (29)-(31): largest code of the converter, full scale at its pin, counts per volt there.
LARGEST_CODE, PIN_V, COUNTS_PER_PIN_VOLT = "4095", "3", "1365"
#: Section 3: frequency and amplitude of the PWM that both figures show.
PWM_KHZ, PWM_AMPLITUDE_V = "2.5", "3.16"
#: Section 4.2: commands from which on the first valve's curves with compensator are flat, V.
SATURATED_FROM_V = ("8", "8.5")
#: Section 4.3, as are the next two: pressure drop and commands of the tests with load and oil temperature.
LOAD_DP_MPA = 3
LOAD_COMMANDS_V = ("1.5", "3.5")
#: Change of the dead zone with the oil's temperature, over 1000; which temperatures, the text leaves open.
TEMPERATURE_CHANGE_PER_MILLE = "2"


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedValve:
    """A valve of the paper, at the reference (1 MPa) and off it (5 MPa)."""

    #: What the report calls it, and where its numbers are printed.
    name: str
    where: str
    #: Thresholds at dP0 and dP1 as printed, in per cent of u_max.
    dead_zone0_percent: str
    dead_zone1_percent: str
    #: Largest flow without compensator at dP0 and dP1 as printed, L/min.
    flow0: str
    flow1: str
    #: The same with compensator.
    flow0_with: str
    flow1_with: str
    #: Dead zone with compensator, at both pressure drops, per cent.
    residual_percent: str
    #: Flow at zero command and dP1 with the compensator that ignores beta, L/min; empty where none is printed. With
    #: beta it is none.
    zero_flow_without_beta: str = ""
    #: Largest displacement of the spool at dP0 and dP1, mm; empty where none is printed.
    stroke0_mm: str = ""
    stroke1_mm: str = ""
    #: Command from which on the spool moves, per cent of u_max; empty where none is printed.
    displacement_dead_zone0_percent: str = ""
    displacement_dead_zone1_percent: str = ""

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
            (dP0, sympy.Integer(DP0_MPA)),
            (dP1, sympy.Integer(DP1_MPA)),
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
    flow0_with="15",
    flow1_with="25.2",
    residual_percent="2",
    zero_flow_without_beta="0.95",
    stroke0_mm="1.8",
    stroke1_mm="1.7",
    displacement_dead_zone0_percent="54",
    displacement_dead_zone1_percent="55",
)
FIRST = PublishedValve(
    name="first valve",
    where="Fig. 18",
    dead_zone0_percent="53.9",
    dead_zone1_percent="51.7",
    flow0="15.1",
    flow1="24.6",
    flow0_with="15.2",
    flow1_with="25.8",
    residual_percent="3.5",
    zero_flow_without_beta="1.6",
)
SECOND = PublishedValve(
    name="second valve",
    where="Fig. 19",
    dead_zone0_percent="43.2",
    dead_zone1_percent="42.2",
    flow0="27.9",
    flow1="35.7",
    flow0_with="28.3",
    flow1_with="36.3",
    residual_percent="1",
)
VALVES = (SIMULATION, FIRST, SECOND)


def transcribed() -> dict[str, str]:
    """Return every number of this module as the paper prints it, by what it is and where it stands."""
    numbers = {
        "full command": str(U_MAX_V),
        "dP0": str(DP0_MPA),
        "dP1": str(DP1_MPA),
        "duration of the ramp": str(RAMP_S),
        "meter's floor": str(METER_FLOOR_L_MIN.evalf(2)).rstrip("0"),
        "meter's range": METER_RANGE_L_MIN,
        "meter's accuracy": METER_ACCURACY_PERCENT,
        "rate of the records": str(RECORDS_HZ),
        "largest flow, about": ABOUT_LARGEST_L_MIN,
        "command of the duty cycles": str(DUTY_COMMAND_V),
        "duty cycle without": DUTY_WITHOUT_PERCENT,
        "duty cycle with": DUTY_WITH_PERCENT,
        "largest code": LARGEST_CODE,
        "volts at the pin": PIN_V,
        "counts per volt, (30)": COUNTS_PER_PIN_VOLT,
        "counts per volt, (31)": COUNTS_PER_PIN_VOLT,
        "flat from": SATURATED_FROM_V[0],
        "flat from, at most": SATURATED_FROM_V[1],
        "change with temperature": TEMPERATURE_CHANGE_PER_MILLE,
    }
    for valve in VALVES:
        for field in fields(valve):
            value = getattr(valve, field.name)
            if value and field.name not in ("name", "where"):
                numbers[f"{valve.name}, {field.name}"] = value
    # The paper prints these two as changes from dP0.
    for change, first, second in (
        ("stroke", "stroke0_mm", "stroke1_mm"),
        ("displacement dead zone", "displacement_dead_zone0_percent", "displacement_dead_zone1_percent"),
    ):
        before, after = (sympy.Rational(numbers[f"simulation, {name}"]) for name in (first, second))
        numbers[f"simulation, change of {change}"] = str(float(abs(after - before))).removesuffix(".0")
        del numbers[f"simulation, {second}"]
    return numbers
