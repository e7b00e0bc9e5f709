"""A row of the paper's numbers: a printed one beside ours, the range that its digits give, and why ours misses it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from dzdesign.derivation.account.published import U_MAX_V
from dzdesign.derivation.account.readings import METER_ACCURACY_L_MIN
from dzdesign.report.reproduction import Driver, Kind, Outcome, PaperNumber
from dzdesign.reproduce.load_and_oil import LoadAndOil
from dzdesign.reproduce.recovered_valves import half_digit
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRESSURES_MPA, PRODUCT, Drive, ValveRuns
from dzdesign.verify.closed_loop.loop import RECORD_S

#: Decimals in reproduction.json: more than the paper prints, fewer than a compiler's last bits reach.
DIGITS = 4
Range = tuple[float, float]
#: A command is read between two records of a ramp, as in the paper (section 4.1), per cent of full command.
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
            text, reach = _reason(value, limits, (reasons or {}).get(by), hysteresis_V > 0)
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


def _reason(
    value: float | None, allowed: Range | None, reason: Reason | None, hysteresis: bool
) -> tuple[str, Range | None]:
    """Return why a value misses, and how far that reaches; of a hysteresis that is assumed nothing is required."""
    if value is None or allowed is None or allowed[0] <= value <= allowed[1]:
        return "", None
    reach = None if reason is None else (round(reason.reach[0], DIGITS), round(reason.reach[1], DIGITS))
    if reason and reach and (not hysteresis or reach[0] <= value <= reach[1]):
        return reason.text, reach
    return (HYSTERESIS, None) if hysteresis else ("", None)


def around(published: str, room: float = 0.0) -> Range:
    """Return the range about a printed number: its rounding, and a measurement error."""
    reach = half_digit(published) + room
    return float(published) - reach, float(published) + reach


def command_around(published_percent: str) -> Range:
    """Return the range about a printed command, per cent of full."""
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
