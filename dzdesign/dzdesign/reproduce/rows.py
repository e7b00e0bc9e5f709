"""A row of the paper's numbers: a printed one beside ours, the range that its digits give, and why ours misses it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from dzdesign.derivation.account.published import METER_ACCURACY_L_MIN, U_MAX_V
from dzdesign.reproduce.artefact import Driver, Kind, Outcome, PaperNumber
from dzdesign.reproduce.load_and_oil import LoadAndOil
from dzdesign.reproduce.recovered_valves import RecoveredValve, at_rest, half_digit
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRESSURES_MPA, PRODUCT, Drive, ValveRuns
from dzdesign.verify.closed_loop.loop import RECORD_S

#: Decimals in reproduction.json: more than the paper prints, fewer than a compiler's last bits reach.
DIGITS = 4
Range = tuple[float, float]
#: By how much the closed loop may differ from the plant at rest, as a share.
OF_THE_LOOP = 0.01
#: Full command in the unit of a command.
PER_FULL: Mapping[str, float] = {"%": 100.0, "V": float(U_MAX_V), "1/1000": 1000.0, "1": 1.0}
#: A command is read between two records of a ramp, as in the paper (section 4.1), percent of full command.
ONE_RECORD_PERCENT = RECORD_S
#: A flow that prints as none, L/min.
PRINTED_NONE_L_MIN = 0.005
TOLERANCES: Mapping[str, str] = {
    "command": f"half a unit of the last printed digit, and one record of the ramp, {ONE_RECORD_PERCENT:g} % of full "
    "command",
    "digits": "half a unit of the last printed digit",
    "metered": "half a unit of the last printed digit, and the meter's accuracy, 0.5 % of its range: "
    f"{float(METER_ACCURACY_L_MIN):g} L/min",
    "no flow": "none is printed: the meter's accuracy about zero, 0.5 % of its range: "
    f"{float(METER_ACCURACY_L_MIN):g} L/min",
    "none": f"none is printed: what prints as 0.00, {PRINTED_NONE_L_MIN:g} L/min",
    "range": "the printed range, and one record of the ramp",
}
HYSTERESIS = (
    "of the assumed hysteresis: the valve closes below the command that it opens at, and the paper shows no closing "
    "branch"
)


class Reason(NamedTuple):
    """Why ours misses a printed number, and the range of values that this can explain."""

    text: str
    reach: Range


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """A valve's runs: as recovered, and with the assumed hysteresis; of the first valve those under load too."""

    runs: ValveRuns
    with_hysteresis: ValveRuns | None = None
    load_and_oil: tuple[LoadAndOil, ...] = ()

    @property
    def all(self) -> Iterator[ValveRuns]:
        """The runs that there are, without hysteresis first."""
        yield self.runs
        if self.with_hysteresis:
            yield self.with_hysteresis

    @property
    def compensators(self) -> tuple[Driver, ...]:
        """Who drove the valve: the product only where there was a firmware."""
        return (PAPER, PRODUCT) if (Drive(PRODUCT), PRESSURES_MPA[0]) in self.runs.ramps else (PAPER,)


Read = Callable[[ValveRuns, Driver], float | None]


def row(
    subject: Subject,
    dp_MPa: float | None,
    quantity: str,
    unit: str,
    published: str,
    kind: Kind,
    read: Read,
    drivers: tuple[Driver, ...] = (DIRECT,),
    *,
    allowed: Range | None = None,
    tolerance: str = "",
    reasons: Mapping[Driver, Reason] | None = None,
    why: str = "",
) -> PaperNumber:
    """Return a number of the paper beside ours; `tolerance` is a key of `TOLERANCES`."""
    try:
        printed: float | None = float(published)
    except ValueError:  # in words, or a range
        printed = None
    limits = None if allowed is None else (round(allowed[0], DIGITS), round(allowed[1], DIGITS))
    outcomes: list[Outcome] = []
    for runs in subject.all:
        for by in drivers:
            value = read(runs, by)
            value = None if value is None else round(value, DIGITS)
            hysteresis_V = runs.valve.plant.hysteresis_V
            reason = (reasons or {}).get(by)
            if hysteresis_V:  # beside what it does, the number is that without it, whatever is said of that
                plain = next(one for one in outcomes if one.by == by)
                reason = _of_hysteresis(runs.valve, dp_MPa, unit, plain)
            text, reach = _reason(value, limits, reason)
            outcomes.append(
                Outcome(
                    by=by, hysteresis_V=hysteresis_V, value=value, allowed=limits, reason=text, explained=reach,
                    difference=None if value is None or printed is None else round(value - printed, DIGITS),
                )
            )  # fmt: skip
    return PaperNumber(
        valve=subject.runs.valve.published.name, quantity=quantity, unit=unit, dp_MPa=dp_MPa, published=published,
        kind=kind, outcomes=tuple(outcomes), tolerance=TOLERANCES[tolerance] if tolerance else "", why=why,
    )  # fmt: skip


def _reason(value: float | None, allowed: Range | None, reason: Reason | None) -> tuple[str, Range | None]:
    """Return why a value misses, and how far that reaches; nothing if it agrees."""
    if value is None or allowed is None or reason is None or allowed[0] <= value <= allowed[1]:
        return "", None
    return reason.text, (round(reason.reach[0], DIGITS), round(reason.reach[1], DIGITS))


def _of_hysteresis(valve: RecoveredValve, dp_MPa: float | None, unit: str, plain: Outcome) -> Reason | None:
    """Return what an assumed hysteresis may do: hold a flow, or a command, that so many volts are."""
    if plain.value is None or dp_MPa is None:
        return None
    volts = valve.plant.hysteresis_V * (1 + OF_THE_LOOP)
    rest = at_rest(replace(valve.plant, hysteresis_V=0.0), dp_MPa)
    opened_V = U_MAX_V - float(rest.opens_V)
    # Before the compensator a command is worth less, by its gain.
    moves = volts * float(rest.flow_per_volt) if unit == "L/min" else PER_FULL[unit] * volts / opened_V
    outside = plain.allowed is not None and plain.agrees is False
    text = plain.reason if outside and plain.reason else HYSTERESIS
    return Reason(text, (min(plain.value, max(0.0, plain.value - moves)), plain.value + moves))


def around(published: str, room: float = 0.0) -> Range:
    """Return the range about a printed number: its rounding, and a measurement error."""
    reach = half_digit(published) + room
    return float(published) - reach, float(published) + reach


def command_around(published_percent: str) -> Range:
    """Return the range about a printed command, percent of full."""
    return around(published_percent, ONE_RECORD_PERCENT)


def flow_around(runs: ValveRuns, published: str) -> tuple[Range, str]:
    """Return the range about a printed flow, and which tolerance that is: a simulation has no meter."""
    if runs.valve.level_L_min:
        return around(published, float(METER_ACCURACY_L_MIN)), "metered"
    return around(published), "digits"


def volts_between(low: str, high: str) -> Range:
    """Return a printed range of commands, V."""
    one_record_V = ONE_RECORD_PERCENT / 100 * U_MAX_V
    return float(low) - one_record_V, float(high) + one_record_V
