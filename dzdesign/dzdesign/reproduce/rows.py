"""Every number of Sections 2 to 4 beside ours, with what must agree, how closely, and why the rest differs."""

from collections.abc import Iterator, Sequence

from dzdesign.derivation.account.published import (
    ABOUT_LARGEST_L_MIN,
    DP0_MPA,
    DP1_MPA,
    DUTY_COMMAND_V,
    DUTY_WITH_PERCENT,
    DUTY_WITHOUT_PERCENT,
    METER_ACCURACY_L_MIN,
    SATURATED_FROM_V,
    SECOND,
    TEMPERATURE_CHANGE_PER_MILLE,
    U_MAX_V,
)
from dzdesign.reproduce import reasons
from dzdesign.reproduce.reasons import LITTLE, MARGIN_PERCENT, PRINTED_NONE, READING, TOLERANCES
from dzdesign.reproduce.row import Outcome, Row
from dzdesign.reproduce.runs import DIRECT, PAPER, PRODUCT, Drive, ValveRuns, paper_duty_percent
from dzdesign.reproduce.valves import half_digit

#: Whose number stands beside the paper's.
BY = {DIRECT: "valve", PAPER: "paper's law", PRODUCT: "product"}


def rows_of(runs: Sequence[ValveRuns]) -> list[Row]:
    """Return the rows of the simulated, the first and the second valve.

    Parameters
    ----------
    runs : sequence of ValveRuns
        In that order; without a firmware the product has no outcome.
    """
    simulated, first, second = runs
    return [
        *_rows_of_valve(simulated),
        _step_row(simulated),
        *_rows_of_valve(first),
        *_first_alone(first),
        *_rows_of_valve(second),
        *_duty_rows(first, second),
    ]


def _rows_of_valve(runs: ValveRuns) -> Iterator[Row]:
    for dp_MPa in (float(DP0_MPA), float(DP1_MPA)):
        yield from _without_compensator(runs, dp_MPa)
    for dp_MPa in (float(DP0_MPA), float(DP1_MPA)):
        yield from _with_compensator(runs, dp_MPa)
    if runs.valve.published.zero_flow_without_beta:
        yield from _zero_command(runs)


def _around(published: str, room: float) -> tuple[float, float]:
    """Return the range about a printed number: its rounding and some room."""
    reach = half_digit(published) + room
    return float(published) - reach, float(published) + reach


def _at(dp_MPa: float, at_reference: str, beside: str) -> str:
    return at_reference if dp_MPa == DP0_MPA else beside


def _without_compensator(runs: ValveRuns, dp_MPa: float) -> Iterator[Row]:
    valve, bare = runs.valve.published, Drive(DIRECT)
    dead_zone = _at(dp_MPa, valve.dead_zone0_percent, valve.dead_zone1_percent)
    flow = _at(dp_MPa, valve.flow0, valve.flow1)
    common = {"valve": valve.name, "dp_MPa": dp_MPa}
    assumed = reasons.DROP if valve is SECOND and dp_MPa != DP0_MPA else ""
    yield Row(
        **common, quantity=f"dead zone without{_first_seen(runs)}", unit="%", published=dead_zone, in_fit=True,
        outcomes=(_bare(runs.dead_zone_percent(bare, dp_MPa), _around(dead_zone, READING["%"])),),
        tolerance=TOLERANCES["fitted"], why=assumed,
    )  # fmt: skip
    yield Row(
        **common, quantity="largest flow without", unit="L/min", published=flow, in_fit=True,
        outcomes=(_bare(runs.largest_L_min(bare, dp_MPa), _around(flow, READING["L/min"] * float(flow))),),
        tolerance=TOLERANCES["fitted"], why=assumed,
    )  # fmt: skip
    if not valve.stroke0_mm:
        return
    at_reference = dp_MPa == DP0_MPA
    stroke = _at(dp_MPa, valve.stroke0_mm, valve.stroke1_mm)
    yield Row(
        **common, quantity="largest displacement", unit="mm", published=stroke, in_fit=at_reference,
        outcomes=(
            _bare(float(runs.ramps[bare, dp_MPa].position_mm.max()), _around(stroke, 0.0) if at_reference else None),
        ),
        tolerance=TOLERANCES["fitted"] if at_reference else "",
        why="" if at_reference else reasons.displacement_beside(runs),
    )  # fmt: skip
    yield Row(
        **common, quantity="displacement's dead zone", unit="%", in_fit=at_reference,
        published=_at(dp_MPa, valve.displacement_dead_zone0_percent, valve.displacement_dead_zone1_percent),
        outcomes=(_bare(runs.displacement_dead_zone_percent(dp_MPa)),),
        why=reasons.displacement_before_flow(runs, dp_MPa),
    )  # fmt: skip


def _first_seen(runs: ValveRuns) -> str:
    """Say at what flow a dead zone is read, where a meter stands between."""
    return f" (at {runs.valve.level_L_min:g} L/min)" if runs.valve.level_L_min else ""


def _bare(value: float, allowed: tuple[float, float] | None = None) -> Outcome:
    return Outcome(by=BY[DIRECT], value=value, allowed=allowed)


def _driven(runs: ValveRuns) -> tuple[str, ...]:
    """Return who drove the valve: the product only where there was a firmware."""
    return (PAPER, PRODUCT) if (Drive(PRODUCT), float(DP0_MPA)) in runs.ramps else (PAPER,)


def _with_compensator(runs: ValveRuns, dp_MPa: float) -> Iterator[Row]:
    recovered, valve = runs.valve, runs.valve.published
    common = {"valve": valve.name, "dp_MPa": dp_MPa}
    without, flow = _at(dp_MPa, valve.flow0, valve.flow1), _at(dp_MPa, valve.flow0_with, valve.flow1_with)
    hidden = 100 * recovered.level_L_min / float(flow)
    most = float(valve.residual_percent) + half_digit(valve.residual_percent)
    most = max(most, hidden + MARGIN_PERCENT) if hidden else most
    yield Row(
        **common, quantity=f"dead zone with{_first_seen(runs)}", unit="%", published=valve.residual_percent,
        outcomes=tuple(
            Outcome(by=BY[by], value=runs.dead_zone_percent(Drive(by), dp_MPa), allowed=(0.0, most))
            for by in _driven(runs)
        ),
        tolerance=TOLERANCES["metered residual" if hidden else "residual"],
        why=reasons.residual(runs, dp_MPa),
    )  # fmt: skip
    accuracy = float(METER_ACCURACY_L_MIN)
    room = accuracy if recovered.level_L_min else READING["L/min"] * float(flow)
    # Eq. (18) ends at u_max: a law that leaves full command alone gives the flow that there is without it.
    explained = abs(float(flow) - float(without)) <= room
    yield Row(
        **common, quantity="largest flow with", unit="L/min", published=flow,
        outcomes=tuple(
            Outcome(by=BY[by], value=runs.largest_L_min(Drive(by), dp_MPa),
                    allowed=_around(flow, room) if explained else None)
            for by in _driven(runs)
        ),
        tolerance=TOLERANCES["metered flow" if recovered.level_L_min else "flow"] if explained else "",
        why=reasons.flow_with(flow, without, recovered.level_L_min > 0, explained),
    )  # fmt: skip


def _zero_command(runs: ValveRuns) -> Iterator[Row]:
    valve, dp_MPa = runs.valve.published, float(DP1_MPA)
    common = {"valve": valve.name, "dp_MPa": dp_MPa, "unit": "L/min"}
    about = float(valve.zero_flow_without_beta)
    allowed = {PAPER: (about * (1 - READING["about"]), about * (1 + READING["about"]))}
    yield Row(
        **common, quantity="zero command without beta", published=valve.zero_flow_without_beta,
        outcomes=tuple(
            Outcome(by=BY[by], value=runs.zero_L_min(Drive(by, False), dp_MPa), allowed=allowed.get(by))
            for by in _driven(runs)
        ),
        tolerance=TOLERANCES["about"], why=reasons.zero_without_beta(runs),
    )  # fmt: skip
    limits = {PAPER: runs.valve.level_L_min + READING["L/min at zero"], PRODUCT: PRINTED_NONE}
    yield Row(
        **common, quantity="zero command with beta", published="0",
        outcomes=tuple(
            Outcome(by=BY[by], value=runs.zero_L_min(Drive(by), dp_MPa), allowed=(0.0, limits[by]))
            for by in _driven(runs)
        ),
        tolerance=TOLERANCES["none"], why=reasons.zero_with_beta(runs),
    )  # fmt: skip


def _step_row(runs: ValveRuns) -> Row:
    bare = runs.rise_ms(Drive(DIRECT))
    return Row(
        valve=runs.valve.published.name, dp_MPa=float(DP0_MPA), unit="1", published="little effect",
        quantity="rise time over that without",
        outcomes=tuple(
            Outcome(by=BY[by], value=runs.rise_ms(Drive(by)) / bare, allowed=(1 - LITTLE, 1 + LITTLE))
            for by in _driven(runs)
        ),
        tolerance=TOLERANCES["step"], why=reasons.step(runs),
    )  # fmt: skip


def _first_alone(runs: ValveRuns) -> Iterator[Row]:
    """Return what the paper prints of the first valve only, none of which has to agree."""
    common = {"valve": runs.valve.published.name}
    largest = runs.largest_L_min(Drive(DIRECT), float(DP1_MPA))
    yield Row(
        **common, quantity="largest flow, about", unit="L/min", dp_MPa=float(DP1_MPA), published=ABOUT_LARGEST_L_MIN,
        outcomes=(_bare(largest),), why=reasons.about_27(runs),
    )  # fmt: skip
    yield Row(
        **common, quantity="largest flow with: reached at", unit="V", dp_MPa=float(DP0_MPA),
        published="-".join(SATURATED_FROM_V),
        outcomes=tuple(
            Outcome(by=BY[by], value=runs.flat_from_V(Drive(by), float(DP0_MPA))) for by in _driven(runs)
        ),
        why=reasons.saturation(runs),
    )  # fmt: skip
    yield Row(
        **common, quantity="dead zone over oil temperature", unit="1/1000", dp_MPa=None,
        published=TEMPERATURE_CHANGE_PER_MILLE, outcomes=(Outcome(by=BY[DIRECT], value=None),),
        why=reasons.TEMPERATURE,
    )  # fmt: skip


def _duty_rows(first: ValveRuns, second: ValveRuns) -> Iterator[Row]:
    common = {"unit": "%", "dp_MPa": float(DP0_MPA)}
    at = f"duty cycle at {DUTY_COMMAND_V} V"
    yield Row(
        **common, valve=second.valve.published.name, quantity=f"{at} without", published=DUTY_WITHOUT_PERCENT,
        outcomes=(_bare(100 * DUTY_COMMAND_V / U_MAX_V, _around(DUTY_WITHOUT_PERCENT, 0.0)),),
        tolerance=TOLERANCES["rounding"],
    )  # fmt: skip
    for runs, printed in ((second, True), (first, False)):
        valve = runs.valve.published
        outcomes = [
            Outcome(by=BY[PAPER], value=paper_duty_percent(valve),
                    allowed=_around(DUTY_WITH_PERCENT, 0.0) if printed else None)
        ]  # fmt: skip
        if runs.product_duty_percent is not None:
            outcomes.append(Outcome(by=BY[PRODUCT], value=runs.product_duty_percent))
        yield Row(
            **common, valve=valve.name, quantity=f"{at} with", published=DUTY_WITH_PERCENT,
            outcomes=tuple(outcomes), tolerance=TOLERANCES["rounding"] if printed else "",
            why=reasons.duty(runs, printed),
        )  # fmt: skip
