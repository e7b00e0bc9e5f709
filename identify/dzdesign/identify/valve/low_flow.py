"""`LowFlow`: a flow that was measured by hand where the meter shows none; an entry of ``low_flow`` in valve.json.

`--low-flow` gives it, by a measuring glass or a cylinder's drift: one reading at rest. It is the flow with its largest
error, the command, the pressure drop over the metering edge, and the branch on which the command was reached: after
closing a spool with play stands elsewhere than after opening.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import quantity
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.option_readers import percent
from dzdesign.core.options import Texts
from dzdesign.core.units import parse_quantity
from dzdesign.identify.constants import L_MIN, LARGEST_DP, MPA, SMALLEST_DP
from dzdesign.identify.valve.quantity_types import PressureDrop, Voltage

Branch = Literal["rising", "falling"]
#: As a person says it.
IN_WORDS: dict[Branch, str] = {"rising": "opening", "falling": "closing"}
#: A reading tells of a test whose pressure drop is within this share of its own.
SAME_PRESSURE = 0.05
#: As `Flow`, which is rounded to L/min with seven decimals: 0.1 µL/min.
SmallFlow = Annotated[float, quantity("L/min", ge=0, le=1e6)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LowFlow:
    """One reading by hand at a constant command and pressure drop, by volume and time or by piston speed and area."""

    source: Annotated[str, Meta(description="Number of the reading, as given.")]
    branch: Annotated[
        Branch,
        Meta(description="Direction from which the command was approached: rising from below, falling from above."),
    ]
    u_V: Annotated[Voltage, Meta(description="Command during the reading.")]
    dp_MPa: Annotated[PressureDrop, Meta(description="Pressure drop across the metering edge.")]
    q_L_min: Annotated[SmallFlow, Meta(description="Measured flow, leak included.")]
    q_error_L_min: Annotated[SmallFlow, Meta(description="Largest error of the measured flow.")]

    @property
    def at_least_L_min(self) -> float:
        """The least that flows."""
        return self.q_L_min - self.q_error_L_min

    @property
    def at_most_L_min(self) -> float:
        """The most that flows."""
        return self.q_L_min + self.q_error_L_min

    def shows_flow_on(self, branch: Branch) -> bool:
        """Tell whether a flow of it flows on a branch too: after closing a spool is at least as far open."""
        return self.branch in (branch, "rising")

    def shows_none_on(self, branch: Branch) -> bool:
        """Tell whether no more than its flow flows on a branch too: after opening it is at most as far open."""
        return self.branch in (branch, "falling")

    def at_most_at(self, dp_MPa: float) -> float:
        """Return the most that flows at another pressure drop, L/min: a small flow is laminar at the most."""
        return self.at_most_L_min * max(1.0, dp_MPa / self.dp_MPa)

    def is_at(self, dp_MPa: float) -> bool:
        """Tell whether it tells of a test at that pressure drop."""
        return abs(self.dp_MPa - dp_MPa) <= SAME_PRESSURE * dp_MPa


OPTION, EXAMPLE = "--low-flow", "5 +- 1 mL/min at 5.16 V, 5 MPa, closing"
READING = re.compile(r"([^±+]{1,40})(?:±|\+/?-)([^@]{1,40}?)\s+at\s+([^,]{1,40}),([^,]{1,40}),\s*(\w{1,40})\s*")
#: Words for the branch on which a command was reached.
BRANCHES: dict[str, Branch] = {"opening": "rising", "closing": "falling"}
#: A command may exceed full command by the rounding of a display.
ABOVE_FULL = 1.001


def readings_of_side(rows: Sequence[LowFlow], sign: int) -> tuple[LowFlow, ...]:
    """Return the readings of one side (1, -1), their commands counted from zero."""
    return tuple(replace(row, u_V=abs(row.u_V)) for row in rows if (row.u_V < 0) == (sign < 0))


def read_low_flow(given: Texts, u_max: float) -> list[LowFlow]:
    """Read readings such as ``5 +- 1 mL/min at 5.16 V, 5 MPa, closing``; 100 % of a command is `u_max`, V.

    Raises
    ------
    InputError
        If one can't be read, no valve gives it, or it is given twice: as two they would seem to agree.

    Examples
    --------
    >>> (row,) = read_low_flow("5 +- 1 mL/min at 51.6 %, 50 bar, closing", 10.0)
    >>> row.branch, row.u_V, row.dp_MPa, row.q_L_min, row.q_error_L_min
    ('falling', 5.16, 5.0, 0.005, 0.001)
    """
    texts = [given] if isinstance(given, str) or not isinstance(given, Iterable) else list(given)
    rows = [_reading(text, number, u_max) for number, text in enumerate(texts, start=1)]
    for number, row in enumerate(rows):
        if any(replace(other, source="") == replace(row, source="") for other in rows[:number]):
            raise InputError(f"{OPTION} {quoted(texts[number])} is given twice; give each reading once")
    return rows


def _reading(text: object, number: int, u_max: float) -> LowFlow:
    found = READING.fullmatch(text.strip()) if isinstance(text, str) else None
    if found is None:
        raise InputError(f"{OPTION} is {quoted(text)}, expected a reading such as '{EXAMPLE}'")
    flow, error, command, drop, word = (part.strip() for part in found.groups())

    def wrong(expected: str) -> InputError:
        return InputError(f"{OPTION} {quoted(text)}: expected {expected}")

    if not re.search(r"[^\W\d]", flow):  # the unit stands behind the error, once
        flow = f"{flow} {re.sub(r'^[0-9.,eE+-]* *', '', error)}".strip()
    q, q_error = (parse_quantity(each, "flow", OPTION) for each in (flow, error))
    is_share = command.endswith("%")
    u = (
        u_max * percent("50 %", signed=True)(command, OPTION)
        if is_share
        else parse_quantity(command, "voltage", OPTION)
    )
    dp = parse_quantity(drop, "pressure", OPTION)
    if word.lower() not in BRANCHES:
        raise wrong("opening or closing, the direction in which the command was reached")
    if abs(u) > ABOVE_FULL * u_max:
        raise wrong(f"a command of at most full command, {u_max:g} V; give --u-max, or correct it")
    if not SMALLEST_DP <= dp <= LARGEST_DP:
        raise wrong(
            f"{SMALLEST_DP / MPA:g} to {LARGEST_DP / MPA:g} MPa: without a pressure drop nothing flows through any edge"
        )
    if not q_error > 0:
        raise wrong("an error above zero: the largest one from volume, time and, with a cylinder, its leakage")
    if u < 0:
        q = abs(q)  # counted from zero down, as a cylinder that moves the other way
    if q < -q_error:
        raise wrong("a flow in the direction of the command; leave out readings against it")
    return LowFlow(
        source=f"low-flow reading {number}", branch=BRANCHES[word.lower()], u_V=u, dp_MPa=dp / MPA,
        q_L_min=max(q, 0.0) / L_MIN, q_error_L_min=q_error / L_MIN,
    )  # fmt: skip
