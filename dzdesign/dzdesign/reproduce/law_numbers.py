"""Table (A): the paper's numbers against the paper's law; and (C): readings of the paper that were tried and rejected.

One hypothesis each: every dead zone is read at one flow, those of its simulation too; the first valve has the stop that
the paper prints, at both pressure drops; the simulated spool's dead zone is an overlap. What is given is put into Eqs.
(5), (14), (18) and (24); the rounding of all that is given is carried along. Nothing here is simulated.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product as combinations

from dzdesign.derivation.account import published as paper
from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, FIRST, SECOND, SIMULATION, U_MAX_V, PublishedValve
from dzdesign.reproduce.artefact import LawNumber, Range, RejectedReading
from dzdesign.verify.closed_loop.loop import RECORD_S

#: Decimals in reproduction.json: more than the paper prints.
DIGITS = 4
#: Between these flows, L/min, lies the one at which every dead zone is read: the paper's numbers agree with each other
#: from the first on, and its meter starts at the last, where its simulation with beta would pass 0.01 L/min too much.
READ_BETWEEN_L_MIN = (0.4, float(paper.METER_FLOOR_L_MIN))
READING_L_MIN = sum(READ_BETWEEN_L_MIN) / 2
METER_L_MIN = float(paper.METER_ACCURACY_L_MIN)
#: A command is read between two records of a ramp, as in the paper (section 4.1), percent of full command.
ONE_RECORD_PERCENT = RECORD_S
#: A flow that prints as none, L/min.
PRINTED_NONE_L_MIN = 0.005
TOLERANCES = {
    "command": f"half a unit of the last printed digit, and one record of the ramp, {ONE_RECORD_PERCENT:g} % of full "
    "command",
    "digits": "half a unit of the last printed digit",
    "metered": f"half a unit of the last printed digit, and the meter's accuracy, 0.5 % of its range: {METER_L_MIN:g} "
    "L/min",
    "no flow": f"none is printed: the meter's accuracy about zero, 0.5 % of its range: {METER_L_MIN:g} L/min",
    "none": f"none is printed: what prints as 0.00, {PRINTED_NONE_L_MIN:g} L/min",
    "range": "the printed range, and one record of the ramp",
}
HYPOTHESES = (
    f"every dead zone is read at one flow, also in the simulation: {READING_L_MIN:g} L/min, in the middle of "
    f"{' to '.join(f'{end:g}' for end in READ_BETWEEN_L_MIN)} L/min, where the numbers agree with each other",
    f"the first valve has the stop that the paper prints, at both pressure drops: with compensator its flow is flat "
    f"from {'-'.join(paper.SATURATED_FROM_V)} V on",
    "the simulated spool's dead zone is an overlap: travel that opens nothing",
    f"second valve: its other pressure drop is {paper.DROP_ASSUMED.removeprefix('at ')}",
)
GIVEN = (
    "dead zones and largest flows without compensator; at the reference the dead zone with it, from which the offset "
    "follows, and the first valve's flat part; displacement and its dead zone at the reference"
)


def half_digit(published: str) -> float:
    """Return half a unit of the last printed digit.

    Examples
    --------
    >>> half_digit("53.5"), half_digit("15")
    (0.05, 0.5)
    """
    return 0.5 * 10.0 ** -len(published.partition(".")[2])


def around(published: str, room: float = 0.0) -> Range:
    """Return the range about a printed number: its rounding, and a measurement error."""
    reach = half_digit(published) + room
    return float(published) - reach, float(published) + reach


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """A valve of the paper under Eqs. (5), (14) and (18), from what is given; commands are shares of full command.

    `read0` and `read1` are its dead zones at the reading flow and `left0` that with compensator at dP0; `flat_from` is
    the command with compensator, at dP0, from which it is on its stop: 1 without one. `reading` is the flow at which
    dead zones are read. Without a given offset it follows from `left0`, Eq. (14).
    """

    read0: float
    read1: float
    flow0: float
    flow1: float
    left0: float
    flat_from: float = 1.0
    reading: float = READING_L_MIN
    given_offset: float | None = None

    @property
    def offset0(self) -> float:
        """The law's u_min0: Eq. (14) leaves with it the dead zone that is printed at dP0."""
        return (self.read0 - self.left0) / (1 - self.left0) if self.given_offset is None else self.given_offset

    @property
    def offset1(self) -> float:
        """The law's offset at dP1, Eqs. (5) and (18)."""
        return self.read1 / self.read0 * self.offset0

    @property
    def travel(self) -> float:
        """The command from the opening to the largest flow, at either pressure drop."""
        stop0 = self.offset0 + (1 - self.offset0) * self.flat_from
        return (stop0 - self.read0) * self.flow0 / (self.flow0 - self.reading)

    @property
    def per_command1(self) -> float:
        """The flow per command at dP1; without a stop the flow grows up to full command."""
        if self.flat_from < 1:
            return self.flow1 / self.travel
        return (self.flow1 - self.reading) / (1 - self.read1)

    def left1(self) -> float:
        """Return the dead zone with compensator at dP1, percent: Eq. (18) runs from its offset to full command."""
        return 100 * (self.read1 - self.offset1) / (1 - self.offset1)

    def zero(self, offset: float) -> float:
        """Return the flow at zero command and dP1 with an offset."""
        return max(0.0, self.reading + self.per_command1 * (offset - self.read1))

    def flat1_V(self) -> float:
        """Return the command from which the flow at dP1 is flat."""
        if self.flat_from >= 1:
            return float(U_MAX_V)
        stop1 = self.read1 - self.reading / self.per_command1 + self.travel
        return U_MAX_V * (stop1 - self.offset1) / (1 - self.offset1)

    def duty(self, share: float) -> float:
        """Return the duty cycle at a command and dP0, percent, Eq. (14)."""
        return 100 * (self.offset0 + (1 - self.offset0) * share)


def law_of(valve: PublishedValve, sides: Sequence[int], **changes: float) -> Law:
    """Return a valve's law from its printed numbers, each moved by its half digit to one side, -1, 0 or 1."""
    texts = (valve.dead_zone0_percent, valve.dead_zone1_percent, valve.flow0, valve.flow1, valve.residual_percent)
    read0, read1, flow0, flow1, left0 = (
        float(text) + side * half_digit(text) for text, side in zip(texts, sides, strict=False)
    )
    shares = {"read0": read0 / 100, "read1": read1 / 100, "left0": left0 / 100, "flow0": flow0, "flow1": flow1}
    if valve is FIRST and "flat_from" not in changes:
        low, high = (float(text) / U_MAX_V for text in paper.SATURATED_FROM_V)
        shares["flat_from"] = (low + high) / 2 + sides[5] * (high - low) / 2
    return Law(**shares | changes)


def of_the_law(valve: PublishedValve, state: Callable[[Law], float], **changes: float) -> tuple[float, Range]:
    """Return what a law states of a valve, and its range over the rounding of all that is given."""
    found = [state(law_of(valve, corner, **changes)) for corner in combinations((-1, 1), repeat=6)]
    return state(law_of(valve, (0,) * 6, **changes)), (min(found), max(found))


def spool(state: Callable[[float, float, float], float]) -> tuple[float, Range]:
    """Return what is stated of the simulated spool at dP1, of its displacement and dead zone at dP0, and its range.

    `state` takes the displacement, its dead zone as a share, and the opening at dP1 over that at dP0, Eq. (24).
    """
    texts = (SIMULATION.stroke0_mm, SIMULATION.displacement_dead_zone0_percent, SIMULATION.flow0, SIMULATION.flow1)

    def at(stroke: float, share: float, flow0: float, flow1: float) -> float:
        return state(stroke, share / 100, flow1 / flow0 / math.sqrt(DP1_MPA / DP0_MPA))

    found = [at(*corner) for corner in combinations(*map(around, texts))]
    return at(*map(float, texts)), (min(found), max(found))


def _row(
    valve: PublishedValve,
    quantity: str,
    unit: str,
    published: str,
    stated: tuple[float, Range],
    *,
    allowed: Range,
    tolerance: str,
    dp_MPa: int = DP1_MPA,
    reason: str = "",
    contradicts: bool = False,
) -> LawNumber:
    """Return a number of the paper beside what its law states; `reason` is that of a miss."""
    value, (low, high) = stated
    agrees = low <= allowed[1] and high >= allowed[0]
    return LawNumber(
        valve=valve.name, quantity=quantity, unit=unit, dp_MPa=float(dp_MPa), published=published,
        value=round(value, DIGITS), range=_rounded((low, high)), allowed=_rounded(allowed),
        tolerance=TOLERANCES[tolerance], agrees=agrees, reason="" if agrees else reason,
        contradiction=contradicts and not agrees,
    )  # fmt: skip


def _rounded(reach: Range) -> Range:
    return round(reach[0], DIGITS), round(reach[1], DIGITS)


def law_numbers() -> Iterator[LawNumber]:
    """Yield every number of Sections 2 to 4 that the law predicts, in the order of the paper's valves."""
    yield from _of_valve(SIMULATION)
    yield from _of_the_spool()
    yield from _of_valve(FIRST)
    yield from _of_the_first()
    yield from _of_valve(SECOND)
    yield from _of_the_pulse()


def _of_valve(valve: PublishedValve) -> Iterator[LawNumber]:
    """Yield what is printed of every valve with compensator."""
    left, (low, high) = of_the_law(valve, Law.left1)
    yield _row(
        valve, "dead zone with", "%", valve.residual_percent, (left, (low, high)),
        allowed=around(valve.residual_percent, ONE_RECORD_PERCENT), tolerance="command", contradicts=True,
        reason=f"the offset that leaves {valve.residual_percent} % at {DP0_MPA} MPa leaves by Eqs. (5) and (18) "
        f"{low:.2f} to {high:.2f} % at {DP1_MPA} MPa; it prints {valve.residual_percent} % of both",
    )  # fmt: skip
    metered = valve is not SIMULATION
    for dp_MPa, bare, text in (
        (DP0_MPA, valve.flow0, valve.flow0_with),
        (DP1_MPA, valve.flow1, valve.flow1_with),
    ):
        yield _row(
            valve, "largest flow with", "L/min", text, (float(bare), around(bare)), dp_MPa=dp_MPa,
            allowed=around(text, METER_L_MIN if metered else 0.0), tolerance="metered" if metered else "digits",
            contradicts=True,
            reason=f"Eq. (18) gives full command at full command, so the flow is the {bare} L/min that it prints "
            f"without compensator, and not {text}, beyond its meter's {METER_L_MIN:g}",
        )  # fmt: skip
    if text := valve.zero_flow_without_beta:
        yield _row(
            valve, "zero command without beta", "L/min", text, of_the_law(valve, lambda law: law.zero(law.offset0)),
            allowed=around(text, METER_L_MIN if metered else 0.0), tolerance="metered" if metered else "digits",
        )  # fmt: skip
        yield _row(
            valve, "zero command with beta", "L/min", "none", of_the_law(valve, lambda law: law.zero(law.offset1)),
            allowed=(0.0, METER_L_MIN if metered else PRINTED_NONE_L_MIN), tolerance="no flow" if metered else "none",
        )  # fmt: skip


def _with_overlap(stroke: float, share: float, opening: float) -> float:
    """Return the displacement at dP1: the overlap and what is left of the opening."""
    return stroke * (share + (1 - share) * opening)


def _of_the_spool() -> Iterator[LawNumber]:
    """Yield the displacement of Fig. 6."""
    text = SIMULATION.stroke1_mm
    yield _row(
        SIMULATION, "largest displacement", "mm", text, spool(_with_overlap), allowed=around(text), tolerance="digits",
    )  # fmt: skip
    text = SIMULATION.displacement_dead_zone1_percent
    share, (low, high) = spool(lambda at_rest, dead, opening: 100 * dead / _with_overlap(1.0, dead, opening))
    yield _row(
        SIMULATION, "spool's dead zone", "%", text, (share, (low, high)), allowed=around(text), tolerance="digits",
        contradicts=True,
        reason=f"the overlap at {DP0_MPA} MPa is by Eq. (24) and the printed flows {low:.1f} to {high:.1f} % of the "
        f"displacement at {DP1_MPA} MPa; it prints {text} %",
    )  # fmt: skip


def _of_the_first() -> Iterator[LawNumber]:
    """Yield what is printed of the first valve alone."""
    low, high = (float(text) + sign * ONE_RECORD_PERCENT / 100 * U_MAX_V
                 for text, sign in zip(paper.SATURATED_FROM_V, (-1, 1), strict=True))  # fmt: skip
    yield _row(
        FIRST, "largest flow reached at", "V", "-".join(paper.SATURATED_FROM_V), of_the_law(FIRST, Law.flat1_V),
        allowed=(low, high), tolerance="range",
    )  # fmt: skip
    text = paper.ABOUT_LARGEST_L_MIN
    yield _row(
        FIRST, "largest flow, about", "L/min", text, (float(FIRST.flow1), around(FIRST.flow1)),
        allowed=around(text, METER_L_MIN), tolerance="metered", contradicts=True,
        reason=f"one flow has three numbers: {FIRST.flow1} without and {FIRST.flow1_with} with compensator, and about "
        f"{text} (section 4.1)",
    )  # fmt: skip
    text = paper.TEMPERATURE_CHANGE_PER_MILLE
    yield _row(
        FIRST, "dead zone over oil temperature", "1/1000", text, (0.0, (0.0, 0.0)), dp_MPa=paper.LOAD_DP_MPA,
        allowed=around(text, 10 * ONE_RECORD_PERCENT), tolerance="command",
        reason="Assumption 1 takes the threshold for independent of the temperature; the paper measures how nearly",
    )  # fmt: skip


def _of_the_pulse() -> Iterator[LawNumber]:
    """Yield the duty cycles of Figs. 12 and 13, which name no valve: of the second, the nearer one."""
    share, text = paper.DUTY_COMMAND_V / U_MAX_V, paper.DUTY_WITHOUT_PERCENT
    yield _row(
        SECOND, f"duty cycle at {paper.DUTY_COMMAND_V} V without", "%", text, (100 * share, (100 * share, 100 * share)),
        allowed=around(text), tolerance="digits", dp_MPa=DP0_MPA,
    )  # fmt: skip
    text = paper.DUTY_WITH_PERCENT
    duty = {valve.name: of_the_law(valve, lambda law: law.duty(share)) for valve in (SECOND, FIRST, SIMULATION)}
    reach = ", ".join(f"{low:.1f} to {high:.1f} % ({name})" for name, (_, (low, high)) in duty.items())
    yield _row(
        SECOND, f"duty cycle at {paper.DUTY_COMMAND_V} V with", "%", text, duty[SECOND.name],
        allowed=around(text), tolerance="digits", dp_MPa=DP0_MPA, contradicts=True,
        reason=f"Fig. 13 names no valve; by Eq. (14) its valves with their printed dead zones have {reach}",
    )  # fmt: skip


# --- (C): readings that were tried and rejected --------------------------------------------------------------


def rejected_readings() -> Iterator[RejectedReading]:
    """Yield other readings of the paper, each with the printed number that rules it out."""
    at_printed = "offset: the printed dead zone itself"
    for valve in (SIMULATION, FIRST, SECOND):
        given = float(valve.dead_zone0_percent) / 100
        yield _rejected(
            at_printed, valve, "dead zone with", "%", valve.residual_percent, ONE_RECORD_PERCENT,
            of_the_law(valve, lambda law: 100 * (law.read0 - law.offset0) / (1 - law.offset0), given_offset=given),
        )  # fmt: skip
    yield _rejected(
        "offset: where the flow begins, so that the ideal line is met", FIRST, "dead zone with", "%",
        FIRST.residual_percent, ONE_RECORD_PERCENT, of_the_law(FIRST, lambda law: 100 * law.reading / law.flow1),
    )  # fmt: skip
    yield _rejected(
        "dead zones read at no flow", SIMULATION, "zero command without beta", "L/min",
        SIMULATION.zero_flow_without_beta, 0.0,
        of_the_law(SIMULATION, lambda law: law.zero(law.offset0), reading=0.0),
    )  # fmt: skip
    stopless, (low, high) = of_the_law(FIRST, Law.flat1_V, flat_from=1.0)
    yield RejectedReading(
        reading="no stop", valve=FIRST.name, quantity="largest flow reached at", unit="V",
        published="-".join(paper.SATURATED_FROM_V), value=stopless, range=(low, high),
        allowed=(float(paper.SATURATED_FROM_V[0]), float(paper.SATURATED_FROM_V[1])),
    )  # fmt: skip
    rise = math.sqrt(DP1_MPA / DP0_MPA)
    yield _rejected(
        "a stop, and a flow that grows with the root of the pressure drop, Eq. (24)", FIRST,
        "largest flow without", "L/min", FIRST.flow1, METER_L_MIN,
        of_the_law(FIRST, lambda law: rise * law.flow0),
    )  # fmt: skip
    yield _rejected(
        "preload in place of overlap", SIMULATION, "largest displacement", "mm",
        SIMULATION.stroke1_mm, 0.0, spool(lambda stroke, share, opening: stroke * opening),
    )  # fmt: skip


def _rejected(
    reading: str, valve: PublishedValve, quantity: str, unit: str, published: str, room: float,
    stated: tuple[float, Range],
) -> RejectedReading:  # fmt: skip
    value, reach = stated
    return RejectedReading(
        reading=reading, valve=valve.name, quantity=quantity, unit=unit, published=published,
        value=round(value, DIGITS), range=_rounded(reach), allowed=_rounded(around(published, room)),
    )  # fmt: skip
