"""The numbers that the paper prints, once: exact, as printed, each with the section that prints it.

What is read from them and is not printed itself stands at the end.
"""

import re
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import sympy

from dzdesign.derivation.account.statement import Replacements, Value
from dzdesign.derivation.symbols import Q_floor, Q_max0, Q_max1, beta, dP0, dP1, k, u_max, u_min0, u_min1, x_max

#: Every number that is transcribed, with its section.
PRINTED: list[tuple[str, str]] = []


def _printed(number: str, section: str) -> str:
    if (number, section) not in PRINTED:
        PRINTED.append((number, section))
    return number


def find_misprints(paper: str) -> list[str]:
    """Say which numbers do not stand in their section of the paper's text."""
    # A section begins with its own number at the start of a line.
    parts = re.split(r"(?m)^(?:\d [^\d\n]+ )?(\d(?:\.\d)?) (?=[A-Z][a-z])", paper)
    numbers = {
        section: re.findall(r"\d+(?:\.\d+)?", text) for section, text in zip(parts[1::2], parts[2::2], strict=True)
    }
    return [
        f"{number} does not stand in section {section} of the text given"
        for number, section in PRINTED
        if number not in numbers.get(section, ())
    ]


U_MAX_V = int(_printed("10", "4.1"))
DP0_MPA, DP1_MPA = int(_printed("1", "4.1")), int(_printed("5", "4.1"))  # the reference, and off it
RAMP_S = int(_printed("100", "4.1"))  # from zero to full command
METER_FLOOR_L_MIN = sympy.Rational(_printed("0.6", "4.1"))
METER_RANGE_L_MIN = _printed("150", "4.1")
#: Of its range.
METER_ACCURACY_PERCENT = _printed("0.5", "4.1")
RECORDS_HZ = int(_printed("100", "4.1"))
#: "About", of the first valve at 5 MPa.
ABOUT_LARGEST_L_MIN = _printed("27", "4.1")
#: Duty cycles at a command of 2 V without (Fig. 12) and with the compensator (Fig. 13), percent.
DUTY_COMMAND_V = int(_printed("2", "3"))
DUTY_WITHOUT_PERCENT, DUTY_WITH_PERCENT = _printed("20", "3"), _printed("55", "3")
#: Eqs. (29)-(30): largest code of the converter, full scale at its pin, counts per volt there.
LARGEST_CODE, PIN_V, COUNTS_PER_PIN_VOLT = _printed("4095", "3"), _printed("3", "3"), _printed("1365", "3")
#: Frequency and amplitude of the PWM that both figures show.
PWM_KHZ, PWM_AMPLITUDE_V = _printed("2.5", "3"), _printed("3.16", "3")
#: Commands from which the first valve's curves with compensator are flat, V.
SATURATED_FROM_V = (_printed("8", "4.2"), _printed("8.5", "4.2"))
#: Pressure drop of the tests with load and oil temperature.
LOAD_DP_MPA = int(_printed("3", "4.3"))
#: Change of the dead zone with the oil's temperature, over 1000; which temperatures, the text leaves open.
TEMPERATURE_CHANGE_PER_MILLE = _printed("2", "4.3")


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedValve:
    """A valve of the paper, at the reference (1 MPa) and off it (5 MPa); a number that is not printed is empty."""

    #: What the report calls it, where its numbers are printed, and their section.
    name: str
    where: str
    section: str
    #: Thresholds at dP0 and dP1 as printed, in percent of u_max.
    dead_zone0_percent: str
    dead_zone1_percent: str
    #: Largest flow at dP0 and dP1 without and with compensator, L/min.
    flow0: str
    flow1: str
    flow0_with: str
    flow1_with: str
    #: Dead zone with compensator, at both pressure drops, percent.
    residual_percent: str
    #: Flow at zero command and dP1 with the compensator that ignores beta, L/min. With beta it is none.
    zero_flow_without_beta: str = ""
    #: Largest displacement of the spool at dP0, mm, and by how much less it is at dP1.
    stroke0_mm: str = ""
    stroke_falls_mm: str = ""
    #: The displacement's dead zone at dP0, percent, and by how much more it is at dP1.
    displacement_dead_zone0_percent: str = ""
    displacement_dead_zone_rises_percent: str = ""

    @property
    def stroke1_mm(self) -> str:
        """The largest displacement at dP1, mm."""
        return str(Decimal(self.stroke0_mm) - Decimal(self.stroke_falls_mm)) if self.stroke0_mm else ""

    @property
    def displacement_dead_zone1_percent(self) -> str:
        """The displacement's dead zone at dP1, percent."""
        at_dP0, rises = self.displacement_dead_zone0_percent, self.displacement_dead_zone_rises_percent
        return str(Decimal(at_dP0) + Decimal(rises)) if at_dP0 else ""

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

    def value(self, label: str, unit: str, *, also: Replacements = (), **more: Any) -> Value:
        """Return a number of a statement for this valve, `label` before its name; `more` is what `Value` takes."""
        return Value(f"{label}, {self.name}" if label else self.name, (*self.at(), *also), unit, **more)


SIMULATION = PublishedValve(
    name="simulation",
    where="section 2.2",
    section="2.2",
    dead_zone0_percent="53.5",
    dead_zone1_percent="51.7",
    flow0="15",
    flow1="25.2",
    flow0_with="15",
    flow1_with="25.2",
    residual_percent="2",
    zero_flow_without_beta=_printed("0.95", "2.2"),
    stroke0_mm="1.8",
    stroke_falls_mm="0.1",
    displacement_dead_zone0_percent="54",
    displacement_dead_zone_rises_percent="1",
)
FIRST = PublishedValve(
    name="first valve",
    where="Fig. 18",
    section="4.2",
    dead_zone0_percent="53.9",
    dead_zone1_percent="51.7",
    flow0="15.1",
    flow1="24.6",
    flow0_with="15.2",
    flow1_with="25.8",
    residual_percent="3.5",
    zero_flow_without_beta=_printed("1.6", "4.3"),
)
SECOND = PublishedValve(
    name="second valve",
    where="Fig. 19",
    section="4.2",
    dead_zone0_percent="43.2",
    dead_zone1_percent="42.2",
    flow0="27.9",
    flow1="35.7",
    flow0_with="28.3",
    flow1_with="36.3",
    residual_percent="1",
)
VALVES = (SIMULATION, FIRST, SECOND)
for _valve in VALVES:
    for _name in PublishedValve.__slots__[3:]:
        if getattr(_valve, _name) and _name != "zero_flow_without_beta":  # not always printed with the others
            _printed(getattr(_valve, _name), _valve.section)

#: Accuracy of the flow meter, of its range.
METER_ACCURACY_L_MIN = sympy.Rational(METER_RANGE_L_MIN) * sympy.Rational(METER_ACCURACY_PERCENT) / 100
#: Where a number of the second valve depends on it.
DROP_ASSUMED = f"at {DP1_MPA} MPa, which the paper does not say of this valve"
