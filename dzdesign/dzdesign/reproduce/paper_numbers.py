"""Every number of Sections 2 to 4 beside ours, with what must agree, how closely, and why the rest differs."""

from collections.abc import Iterator, Mapping, Sequence

from dzdesign.derivation.account.published import (
    ABOUT_LARGEST_L_MIN,
    DP0_MPA,
    DUTY_COMMAND_V,
    DUTY_WITH_PERCENT,
    DUTY_WITHOUT_PERCENT,
    METER_ACCURACY_L_MIN,
    SATURATED_FROM_V,
    SECOND,
    TEMPERATURE_CHANGE_PER_MILLE,
    U_MAX_V,
)
from dzdesign.report.reproduction import Driver, Outcome, PaperNumber
from dzdesign.reproduce import explanations
from dzdesign.reproduce.explanations import LITTLE, MARGIN_PERCENT, PRINTED_NONE, READING, TOLERANCES
from dzdesign.reproduce.recovered_valves import half_digit, printed_at
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRESSURES_MPA, PRODUCT, Drive, ValveRuns, paper_duty_percent

#: Decimals in reproduction.json: more than the paper prints, fewer than a compiler's last bits reach.
DIGITS = 4
Range = tuple[float, float]


def paper_numbers(runs: Sequence[ValveRuns]) -> list[PaperNumber]:
    """Return the numbers of the simulated, the first and the second valve; without a firmware the product has none."""
    simulated, first, second = runs
    return [
        *numbers_of_valve(simulated),
        _step(simulated),
        *numbers_of_valve(first),
        *_of_the_first_valve_alone(first),
        *numbers_of_valve(second),
        *_duty_cycles(first, second),
    ]


def numbers_of_valve(runs: ValveRuns) -> Iterator[PaperNumber]:
    """Yield what the paper prints of every valve: dead zones and flows at both pressure drops, and at zero command."""
    for dp_MPa in PRESSURES_MPA:
        yield from _without_compensator(runs, dp_MPa)
    for dp_MPa in PRESSURES_MPA:
        yield from _with_compensator(runs, dp_MPa)
    if runs.valve.published.zero_flow_without_beta:
        yield from _zero_command(runs)


def _number(
    runs: ValveRuns,
    dp_MPa: float | None,
    quantity: str,
    unit: str,
    published: str,
    values: Mapping[Driver, float | None],
    allowed: Range | Mapping[Driver, Range] | None = None,
    *,
    in_fit: bool = False,
    tolerance: str = "",
    why: str = "",
) -> PaperNumber:
    """Return a number of the paper beside ours; `allowed` is the range of all of ours, or of each."""
    try:
        printed: float | None = float(published)
    except ValueError:  # in words, or a range
        printed = None
    ranges = allowed if isinstance(allowed, Mapping) else {by: allowed for by in values}
    outcomes = []
    for by, value in values.items():
        limits = ranges.get(by)
        outcomes.append(
            Outcome(
                by=by,
                value=None if value is None else round(value, DIGITS),
                difference=None if value is None or printed is None else round(value - printed, DIGITS),
                allowed=None if limits is None else (round(limits[0], DIGITS), round(limits[1], DIGITS)),
            )
        )
    return PaperNumber(
        valve=runs.valve.published.name, quantity=quantity, unit=unit, dp_MPa=dp_MPa, published=published,
        in_fit=in_fit, outcomes=tuple(outcomes), tolerance=tolerance, why=why,
    )  # fmt: skip


def _around(published: str, room: float) -> Range:
    """Return the range about a printed number: its rounding and some room."""
    reach = half_digit(published) + room
    return float(published) - reach, float(published) + reach


def _read_at(runs: ValveRuns) -> str:
    """Say at what flow a dead zone is read, where a meter stands between."""
    return f" (at {runs.valve.level_L_min:g} L/min)" if runs.valve.level_L_min else ""


def _drivers(runs: ValveRuns) -> tuple[Driver, ...]:
    """Return who drove the valve: the product only where there was a firmware."""
    return (PAPER, PRODUCT) if (Drive(PRODUCT), PRESSURES_MPA[0]) in runs.ramps else (PAPER,)


def _without_compensator(runs: ValveRuns, dp_MPa: float) -> Iterator[PaperNumber]:
    valve, bare = runs.valve.published, Drive(DIRECT)
    printed = printed_at(valve, dp_MPa)
    assumed = explanations.DROP if valve is SECOND and dp_MPa != DP0_MPA else ""
    yield _number(
        runs, dp_MPa, f"dead zone without{_read_at(runs)}", "%", printed.dead_zone_percent,
        {DIRECT: runs.dead_zone_percent(bare, dp_MPa)}, _around(printed.dead_zone_percent, READING["%"]),
        in_fit=True, tolerance=TOLERANCES["fitted"], why=assumed,
    )  # fmt: skip
    yield _number(
        runs, dp_MPa, "largest flow without", "L/min", printed.flow,
        {DIRECT: runs.largest_L_min(bare, dp_MPa)}, _around(printed.flow, READING["L/min"] * float(printed.flow)),
        in_fit=True, tolerance=TOLERANCES["fitted"], why=assumed,
    )  # fmt: skip
    if not printed.stroke_mm:
        return
    fitted = dp_MPa == DP0_MPA
    yield _number(
        runs, dp_MPa, "largest displacement", "mm", printed.stroke_mm,
        {DIRECT: float(runs.ramps[bare, dp_MPa].position_mm.max())},
        _around(printed.stroke_mm, 0.0) if fitted else None, in_fit=fitted,
        tolerance=TOLERANCES["fitted"] if fitted else "", why="" if fitted else explanations.displacement_beside(runs),
    )  # fmt: skip
    yield _number(
        runs, dp_MPa, "displacement's dead zone", "%", printed.displacement_dead_zone_percent,
        {DIRECT: runs.displacement_dead_zone_percent(dp_MPa)},
        in_fit=fitted, why=explanations.displacement_before_flow(runs, dp_MPa),
    )  # fmt: skip


def _with_compensator(runs: ValveRuns, dp_MPa: float) -> Iterator[PaperNumber]:
    level_L_min, valve = runs.valve.level_L_min, runs.valve.published
    _, without, flow, *_ = printed_at(valve, dp_MPa)
    most = float(valve.residual_percent) + half_digit(valve.residual_percent)
    if level_L_min:
        most = max(most, 100 * level_L_min / float(flow) + MARGIN_PERCENT)
    yield _number(
        runs, dp_MPa, f"dead zone with{_read_at(runs)}", "%", valve.residual_percent,
        {by: runs.dead_zone_percent(Drive(by), dp_MPa) for by in _drivers(runs)}, (0.0, most),
        tolerance=TOLERANCES["metered residual" if level_L_min else "residual"],
        why=explanations.residual(runs, dp_MPa),
    )  # fmt: skip
    room = float(METER_ACCURACY_L_MIN) if level_L_min else READING["L/min"] * float(flow)
    # Eq. (18) ends at u_max: a law that leaves full command alone gives the flow that there is without it.
    explained = abs(float(flow) - float(without)) <= room
    yield _number(
        runs, dp_MPa, "largest flow with", "L/min", flow,
        {by: runs.largest_L_min(Drive(by), dp_MPa) for by in _drivers(runs)},
        _around(flow, room) if explained else None,
        tolerance=TOLERANCES["metered flow" if level_L_min else "flow"] if explained else "",
        why=explanations.flow_with(flow, without, level_L_min > 0, explained),
    )  # fmt: skip


def _zero_command(runs: ValveRuns) -> Iterator[PaperNumber]:
    dp_MPa, published = PRESSURES_MPA[1], runs.valve.published.zero_flow_without_beta
    about = float(published)
    yield _number(
        runs, dp_MPa, "zero command without beta", "L/min", published,
        {by: runs.zero_L_min(Drive(by, False), dp_MPa) for by in _drivers(runs)},
        {PAPER: (about * (1 - READING["about"]), about * (1 + READING["about"]))},
        tolerance=TOLERANCES["about"], why=explanations.zero_without_beta(runs),
    )  # fmt: skip
    yield _number(
        runs, dp_MPa, "zero command with beta", "L/min", "0",
        {by: runs.zero_L_min(Drive(by), dp_MPa) for by in _drivers(runs)},
        {PAPER: (0.0, runs.valve.level_L_min + READING["L/min at zero"]), PRODUCT: (0.0, PRINTED_NONE)},
        tolerance=TOLERANCES["none"], why=explanations.zero_with_beta(runs),
    )  # fmt: skip


def _step(runs: ValveRuns) -> PaperNumber:
    bare = runs.rise_ms(Drive(DIRECT))
    return _number(
        runs, PRESSURES_MPA[0], "rise time over that without", "1", "little effect",
        {by: runs.rise_ms(Drive(by)) / bare for by in _drivers(runs)}, (1 - LITTLE, 1 + LITTLE),
        tolerance=TOLERANCES["step"], why=explanations.step(runs),
    )  # fmt: skip


def _of_the_first_valve_alone(runs: ValveRuns) -> Iterator[PaperNumber]:
    """Return what the paper prints of the first valve only, none of which has to agree."""
    reference, beside = PRESSURES_MPA
    yield _number(
        runs, beside, "largest flow, about", "L/min", ABOUT_LARGEST_L_MIN,
        {DIRECT: runs.largest_L_min(Drive(DIRECT), beside)}, why=explanations.ABOUT_LARGEST,
    )  # fmt: skip
    yield _number(
        runs, reference, "largest flow with: reached at", "V", "-".join(SATURATED_FROM_V),
        {by: runs.flat_from_V(Drive(by), reference) for by in _drivers(runs)}, why=explanations.saturation(runs),
    )  # fmt: skip
    yield _number(
        runs, None, "dead zone over oil temperature", "1/1000", TEMPERATURE_CHANGE_PER_MILLE,
        {DIRECT: None}, why=explanations.TEMPERATURE,
    )  # fmt: skip


def _duty_cycles(first: ValveRuns, second: ValveRuns) -> Iterator[PaperNumber]:
    dp_MPa, at = PRESSURES_MPA[0], f"duty cycle at {DUTY_COMMAND_V} V"
    yield _number(
        second, dp_MPa, f"{at} without", "%", DUTY_WITHOUT_PERCENT,
        {DIRECT: 100 * DUTY_COMMAND_V / U_MAX_V}, _around(DUTY_WITHOUT_PERCENT, 0.0), tolerance=TOLERANCES["rounding"],
    )  # fmt: skip
    for runs, why in ((second, explanations.DUTY_OF_SECOND), (first, explanations.DUTY_OF_FIRST)):
        values: dict[Driver, float | None] = {PAPER: paper_duty_percent(runs.valve.published)}
        if runs.product_duty_percent is not None:
            values[PRODUCT] = runs.product_duty_percent
        allowed: dict[Driver, Range] | None = {PAPER: _around(DUTY_WITH_PERCENT, 0.0)} if runs is second else None
        yield _number(
            runs, dp_MPa, f"{at} with", "%", DUTY_WITH_PERCENT, values, allowed,
            tolerance=TOLERANCES["rounding"] if allowed else "", why=why,
        )  # fmt: skip
