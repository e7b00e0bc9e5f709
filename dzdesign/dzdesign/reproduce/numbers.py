"""Every number of Sections 2 to 4 beside ours: what was fitted, what is predicted, and why what is missed is missed."""

from collections.abc import Iterator, Mapping, Sequence

from dzdesign.derivation.account import published as paper
from dzdesign.derivation.account.published import DP0_MPA, U_MAX_V
from dzdesign.reproduce import explanations
from dzdesign.reproduce.artefact import Driver, Kind, PaperNumber
from dzdesign.reproduce.explanations import (
    DISPLACEMENT,
    DISPLACEMENT_DEAD_ZONE,
    METER_L_MIN,
    OILS,
    ONE_RECORD_PERCENT,
    PRINTED_NONE_L_MIN,
    Range,
    Reason,
    around,
    ideal_line_percent,
)
from dzdesign.reproduce.recovered_valves import AtRest, printed_at
from dzdesign.reproduce.runs import DIRECT, PRESSURES_MPA, PRODUCT, WITHOUT_BETA, ValveRuns

#: Decimals in reproduction.json: more than the paper prints, fewer than a compiler's last bits reach.
DIGITS = 4
TOLERANCES: Mapping[str, str] = {
    "command": f"half a unit of the last printed digit, and one record of the ramp, {ONE_RECORD_PERCENT:g} % of full "
    "command",
    "digits": "half a unit of the last printed digit",
    "metered": f"half a unit of the last printed digit, and the meter's accuracy, 0.5 % of its range: {METER_L_MIN:g} "
    "L/min",
    "no flow": f"none is printed: the meter's accuracy about zero, 0.5 % of its range: {METER_L_MIN:g} L/min",
    "none": f"none is printed: what prints as 0.00, {PRINTED_NONE_L_MIN:g} L/min",
    "range": "the printed range, and one record of the ramp",
}
#: What the paper does not state and is taken for granted here.
ASSUMPTIONS = (
    "hysteresis: none, as the paper shows no closing branch; and no stop",
    "threshold between the two tested pressure drops: it only falls",
    f"second valve: its other pressure drop is {paper.DROP_ASSUMED.removeprefix('at ')}",
    "oil of Fig. 22: " + ", ".join(f"{oil.temperature_C:g}" for oil in OILS) + " °C, a mineral oil of 46 mm²/s",
)


def row(
    runs: ValveRuns,
    dp_MPa: float | None,
    quantity: str,
    unit: str,
    published: str,
    kind: Kind,
    by: Driver,
    value: float,
    *,
    allowed: Range,
    tolerance: str,
    reason: Reason | None = None,
    ideal: float | None = None,
    why: str = "",
) -> PaperNumber:
    """Return a number of the paper beside ours; `tolerance` is a key of `TOLERANCES`, the reason that of a miss."""
    value, limits = round(value, DIGITS), _rounded(allowed)
    if limits[0] <= value <= limits[1]:
        reason = None
    try:
        difference = round(value - float(published), DIGITS)
    except ValueError:  # none, or a range
        difference = None
    return PaperNumber(
        valve=runs.valve.published.name, quantity=quantity, unit=unit, dp_MPa=dp_MPa, published=published, kind=kind,
        by=by, value=value, difference=difference, ideal_line=None if ideal is None else round(ideal, DIGITS),
        allowed=limits, tolerance=TOLERANCES[tolerance], reason=reason.text if reason else "",
        explained=_rounded(reason.reach) if reason else None, why=why,
    )  # fmt: skip


def _rounded(reach: Range) -> Range:
    return round(reach[0], DIGITS), round(reach[1], DIGITS)


def _command_around(published_percent: str) -> Range:
    """Return the range about a printed command, percent of full."""
    return around(published_percent, ONE_RECORD_PERCENT)


def _flow_around(runs: ValveRuns, published: str) -> tuple[Range, str]:
    """Return the range about a printed flow, and which tolerance that is: a simulation has no meter."""
    return (around(published, METER_L_MIN), "metered") if runs.valve.level_L_min else (around(published), "digits")


def paper_numbers(valves: Sequence[ValveRuns]) -> list[PaperNumber]:
    """Return the numbers of the simulated, the first and the second valve."""
    simulated, first, second = valves
    return [
        *numbers_of_valve(simulated),
        *of_the_displacement(simulated),
        *numbers_of_valve(first),
        _about_largest(first),
        *_saturation(first),
        *of_the_oil(first),
        *numbers_of_valve(second),
        *_of_the_pulse(first, second),
    ]


def numbers_of_valve(runs: ValveRuns) -> Iterator[PaperNumber]:
    """Yield what the paper prints of every valve: dead zones and flows at both pressure drops, and at zero command."""
    for dp_MPa in PRESSURES_MPA:
        yield from _without_compensator(runs, dp_MPa)
    for dp_MPa in PRESSURES_MPA:
        yield from _with_compensator(runs, dp_MPa)
    if runs.valve.published.zero_flow_without_beta:
        yield from _zero_command(runs)


def _without_compensator(runs: ValveRuns, dp_MPa: float) -> Iterator[PaperNumber]:
    valve = runs.valve.published
    printed = printed_at(valve, dp_MPa)
    assumed = explanations.DROP if valve is paper.SECOND and dp_MPa != DP0_MPA else ""
    yield row(
        runs, dp_MPa, "dead zone without", "%", printed.dead_zone_percent, "fitted", "valve",
        runs.dead_zone_percent(DIRECT, dp_MPa), allowed=_command_around(printed.dead_zone_percent),
        tolerance="command", why=assumed,
    )  # fmt: skip
    allowed, tolerance = _flow_around(runs, printed.flow)
    yield row(
        runs, dp_MPa, "largest flow without", "L/min", printed.flow, "fitted", "valve",
        runs.largest_L_min(DIRECT, dp_MPa), allowed=allowed, tolerance=tolerance, why=assumed,
    )  # fmt: skip


def _with_compensator(runs: ValveRuns, dp_MPa: float) -> Iterator[PaperNumber]:
    text, printed = runs.valve.published.residual_percent, printed_at(runs.valve.published, dp_MPa)
    yield row(
        runs, dp_MPa, "dead zone with", "%", text, "predicted", "product", runs.dead_zone_percent(PRODUCT, dp_MPa),
        allowed=_command_around(text), tolerance="command", reason=explanations.residual(runs, dp_MPa),
        ideal=ideal_line_percent(runs, dp_MPa),
    )  # fmt: skip
    allowed, tolerance = _flow_around(runs, printed.flow_with)
    # Eq. (18) ends at u_max: a law that leaves full command alone gives the flow that there is without it.
    more = abs(float(printed.flow_with) - float(printed.flow)) > allowed[1] - float(printed.flow_with)
    yield row(
        runs, dp_MPa, "largest flow with", "L/min", printed.flow_with, "predicted", "product",
        runs.largest_L_min(PRODUCT, dp_MPa), allowed=allowed, tolerance=tolerance,
        reason=explanations.flow_with(runs, dp_MPa) if more else None,
    )  # fmt: skip


def _zero_command(runs: ValveRuns) -> Iterator[PaperNumber]:
    dp_MPa, text = PRESSURES_MPA[1], runs.valve.published.zero_flow_without_beta
    allowed, tolerance = _flow_around(runs, text)
    yield row(
        runs, dp_MPa, "zero command without beta", "L/min", text, "predicted", "product",
        runs.zero_L_min(WITHOUT_BETA, dp_MPa), allowed=allowed, tolerance=tolerance,
        reason=explanations.zero_without_beta(runs),
    )  # fmt: skip
    metered = runs.valve.level_L_min > 0
    yield row(
        runs, dp_MPa, "zero command with beta", "L/min", "none", "predicted", "product",
        runs.zero_L_min(PRODUCT, dp_MPa), allowed=(0.0, METER_L_MIN if metered else PRINTED_NONE_L_MIN),
        tolerance="no flow" if metered else "none",
    )  # fmt: skip


def of_the_displacement(simulated: ValveRuns) -> Iterator[PaperNumber]:
    """Yield the displacement of Fig. 6, of the plant at rest."""
    for dp_MPa in PRESSURES_MPA:
        printed, rest = printed_at(simulated.valve.published, dp_MPa), AtRest(simulated.valve.plant, dp_MPa)
        for quantity, unit, text, value in (
            (DISPLACEMENT, "mm", printed.stroke_mm, rest.position_mm(U_MAX_V)),
            (DISPLACEMENT_DEAD_ZONE, "%", printed.displacement_dead_zone_percent, 100 * rest.moves_V / U_MAX_V),
        ):
            fitted = quantity == DISPLACEMENT and dp_MPa == DP0_MPA
            yield row(
                simulated, dp_MPa, quantity, unit, text, "fitted" if fitted else "predicted", "valve", value,
                allowed=around(text), tolerance="digits", reason=explanations.displacement(quantity, dp_MPa),
            )  # fmt: skip


def _saturation(first: ValveRuns) -> Iterator[PaperNumber]:
    low, high = (float(text) + sign * ONE_RECORD_PERCENT / 100 * U_MAX_V
                 for text, sign in zip(paper.SATURATED_FROM_V, (-1, 1), strict=True))  # fmt: skip
    for dp_MPa in PRESSURES_MPA:
        yield row(
            first, dp_MPa, "largest flow reached at", "V", "-".join(paper.SATURATED_FROM_V), "predicted", "product",
            first.flat_from_V(PRODUCT, dp_MPa), allowed=(low, high), tolerance="range",
            reason=explanations.no_saturation(),
        )  # fmt: skip


def _about_largest(first: ValveRuns) -> PaperNumber:
    dp_MPa, text = PRESSURES_MPA[1], paper.ABOUT_LARGEST_L_MIN
    return row(
        first, dp_MPa, "largest flow, about", "L/min", text, "predicted", "valve", first.largest_L_min(DIRECT, dp_MPa),
        allowed=_flow_around(first, text)[0], tolerance="metered", reason=explanations.about_largest(),
    )  # fmt: skip


def of_the_oil(first: ValveRuns) -> Iterator[PaperNumber]:
    """Yield what Section 4.3 says of the oil's temperature, of the plant at rest."""
    dp_MPa, text = float(paper.LOAD_DP_MPA), paper.TEMPERATURE_CHANGE_PER_MILLE
    rests = [AtRest(first.valve.plant.with_oil(oil.viscosity, oil.density), dp_MPa) for oil in OILS]
    seen = [1e3 / U_MAX_V * (rest.opens_V + first.valve.level_L_min / rest.flow_per_volt) for rest in rests]
    yield row(
        first, dp_MPa, "dead zone over oil temperature", "1/1000", text, "predicted", "valve", max(seen) - min(seen),
        allowed=around(text, 10 * ONE_RECORD_PERCENT), tolerance="command", reason=explanations.temperature(first),
    )  # fmt: skip


def _of_the_pulse(first: ValveRuns, second: ValveRuns) -> Iterator[PaperNumber]:
    """Yield the duty cycles of Figs. 12 and 13, of the latter for each valve."""
    duty, dp_MPa = f"duty cycle at {paper.DUTY_COMMAND_V} V", PRESSURES_MPA[0]
    yield row(
        second, dp_MPa, f"{duty} without", "%", paper.DUTY_WITHOUT_PERCENT, "predicted", "valve",
        second.direct_duty_percent, allowed=around(paper.DUTY_WITHOUT_PERCENT), tolerance="digits",
    )  # fmt: skip
    for runs in (second, first):
        yield row(
            runs, dp_MPa, f"{duty} with", "%", paper.DUTY_WITH_PERCENT, "predicted", "product", runs.duty_percent,
            allowed=around(paper.DUTY_WITH_PERCENT), tolerance="digits", reason=explanations.duty(runs),
            why=explanations.DUTY_OF_ONE,
        )  # fmt: skip
