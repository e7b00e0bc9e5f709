"""The numbers that the paper prints, once: exact, as printed, with where they stand.

Nothing else stands here: `transcribed` finds every number of a constant of this module by itself, and one that is in no
section of `SECTION_OF` makes `dzdesign derive` fail.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from decimal import Decimal
from typing import Any

import sympy

from dzdesign.derivation.account.statement import Replacements, Statement
from dzdesign.derivation.symbols import Q_floor, Q_max0, Q_max1, beta, dP0, dP1, k, u_max, u_min0, u_min1, x_max

U_MAX_V = 10
DP0_MPA, DP1_MPA = 1, 5  # section 2.1: the reference, and off it
RAMP_S = 100  # sections 2.2 and 4.1: from zero to full command
METER_FLOOR_L_MIN = sympy.Rational("0.6")  # section 4.1, as are the next four
METER_RANGE_L_MIN = "150"
#: Of its range.
METER_ACCURACY_PERCENT = "0.5"
RECORDS_HZ = 100
#: "About", of the first valve at 5 MPa.
ABOUT_LARGEST_L_MIN = "27"
#: Section 3: duty cycles at a command of 2 V without (Fig. 12) and with the compensator (Fig. 13), percent.
DUTY_COMMAND_V = 2
DUTY_WITHOUT_PERCENT, DUTY_WITH_PERCENT = "20", "55"
#: Eqs. (29)-(30): largest code of the converter, full scale at its pin, counts per volt there.
LARGEST_CODE, PIN_V, COUNTS_PER_PIN_VOLT = "4095", "3", "1365"
#: Section 3: frequency and amplitude of the PWM that both figures show.
PWM_KHZ, PWM_AMPLITUDE_V = "2.5", "3.16"
#: Section 4.2: commands from which the first valve's curves with compensator are flat, V.
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
    #: Thresholds at dP0 and dP1 as printed, in percent of u_max.
    dead_zone0_percent: str
    dead_zone1_percent: str
    #: Largest flow without compensator at dP0 and dP1 as printed, L/min.
    flow0: str
    flow1: str
    #: The same with compensator.
    flow0_with: str
    flow1_with: str
    #: Dead zone with compensator, at both pressure drops, percent.
    residual_percent: str
    #: Flow at zero command and dP1 with the compensator that ignores beta, L/min; empty where none is printed. With
    #: beta it is none.
    zero_flow_without_beta: str = ""
    #: Largest displacement of the spool at dP0, mm, and by how much less it is at dP1; empty where none is printed.
    stroke0_mm: str = ""
    stroke_falls_mm: str = ""
    #: The displacement's dead zone at dP0, percent, and by how much more it is at dP1; empty where none is printed.
    displacement_dead_zone0_percent: str = ""
    displacement_dead_zone_rises_percent: str = ""

    @property
    def stroke1_mm(self) -> str:
        """The largest displacement at dP1, mm; empty where none is printed."""
        return str(Decimal(self.stroke0_mm) - Decimal(self.stroke_falls_mm)) if self.stroke0_mm else ""

    @property
    def displacement_dead_zone1_percent(self) -> str:
        """The displacement's dead zone at dP1, percent; empty where none is printed."""
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
    stroke_falls_mm="0.1",
    displacement_dead_zone0_percent="54",
    displacement_dead_zone_rises_percent="1",
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


#: Each number, and the section of the paper that prints it.
SECTION_OF = {
    number: section
    for section, numbers in {
        "2.2": "53.5 51.7 15 25.2 0.95 1.8 0.1 54",
        "3": "2 20 55 3 4095 1365 2.5 3.16",
        "4.1": "1 5 10 27 100 150 0.5 0.6",
        "4.2": "8 8.5 53.9 15.1 24.6 15.2 25.8 43.2 42.2 27.9 28.3 35.7 36.3",
        "4.3": "1.5 3.5 1.6",
    }.items()
    for number in numbers.split()
}


def transcribed() -> set[str]:
    """Return every number of every constant of this module, as printed."""
    constants = [value for name, value in globals().items() if name.isupper() and name != "SECTION_OF"]
    return {number for value in constants for number in _numbers_of(value)}


def _numbers_of(value: Any) -> Iterator[str]:
    """Yield the numbers in a value as printed; words have none."""
    if isinstance(value, PublishedValve):
        for field in fields(value)[2:]:  # what it is called and where it stands are no numbers
            yield from _numbers_of(getattr(value, field.name))
    elif isinstance(value, tuple):
        for each in value:
            yield from _numbers_of(each)
    elif not isinstance(value, str):
        exact = sympy.Rational(value)
        yield f"{Decimal(exact.p) / Decimal(exact.q):f}"
    elif any(letter.isdigit() for letter in value):
        yield value


def find_number_faults(statements: Sequence[Statement], paper: str | None = None) -> list[str]:
    """Say which numbers are not the paper's, and which beside a statement differ from ours without a remark.

    Without the text of the paper they are those in no section of `SECTION_OF`, with it those that its section has not.
    """
    printed, faults = transcribed(), []
    faults += [f"{number} is transcribed, and no section is stated for it" for number in printed - SECTION_OF.keys()]
    faults += [f"a section is stated for {number}, which is not transcribed" for number in SECTION_OF.keys() - printed]
    if paper is not None:
        sections = _sections(paper)
        faults += [
            f"{number} does not stand in section {section} of the text given"
            for number, section in SECTION_OF.items()
            if number not in sections.get(section, ())
        ]
    for statement, value in ((one, each) for one in statements for each in one.values if each.published):
        where = f"{statement.number}, {value.label}: {value.published}"
        if value.published not in printed:
            faults.append(f"{where} is called printed, and the paper has no such number")
        elif not value.agrees(statement) and not value.remark:
            ours = sympy.N(value.exact(statement), 4)
            faults.append(f"{where} is printed, the statement gives {ours}, and no remark says why")
    return sorted(faults)


def _sections(paper: str) -> dict[str, set[str]]:
    """Return the numbers in each section of the paper's text, by the section's own number at the start of a line."""
    parts = re.split(r"(?m)^(?:\d [^\d\n]+ )?(\d(?:\.\d)?) (?=[A-Z][a-z])", paper)
    return {
        number: set(re.findall(r"\d+(?:\.\d+)?", text)) for number, text in zip(parts[1::2], parts[2::2], strict=True)
    }
