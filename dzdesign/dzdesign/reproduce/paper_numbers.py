"""Every number of Sections 2 to 4 beside ours: what was fitted, what is predicted, and why what is missed is missed."""

from collections.abc import Iterator, Sequence
from functools import partial

from dzdesign.derivation.account.published import (
    ABOUT_LARGEST_L_MIN,
    DP0_MPA,
    METER_ACCURACY_L_MIN,
    SATURATED_FROM_V,
    SECOND,
    U_MAX_V,
)
from dzdesign.reproduce import explanations
from dzdesign.reproduce.artefact import Driver, PaperNumber
from dzdesign.reproduce.displacement_readings import DISPLACEMENT, DISPLACEMENT_DEAD_ZONE
from dzdesign.reproduce.first_valve_numbers import duty_cycles, of_section_4_3, of_the_pulse
from dzdesign.reproduce.offset_reading import of_the_offset
from dzdesign.reproduce.recovered_valves import (
    OF_READING,
    at_rest,
    printed_at,
    recover_simulated,
)
from dzdesign.reproduce.rows import (
    PRINTED_NONE_L_MIN,
    Reason,
    Subject,
    around,
    command_around,
    flow_around,
    row,
    volts_between,
)
from dzdesign.reproduce.valve_runs import DIRECT, PRESSURES_MPA, PRODUCT, Drive, ValveRuns


def paper_numbers(valves: Sequence[Subject], stopped: Subject) -> list[PaperNumber]:
    """Return the numbers of the simulated, the first and the second valve, and of the first with a stop."""
    simulated, first, second = valves
    return [
        *numbers_of_valve(simulated),
        *_of_the_displacement(),
        _step(simulated),
        _no_saturation(simulated),
        *numbers_of_valve(first),
        *_about_largest(first),
        *of_section_4_3(first),
        *_of_the_stop(stopped),
        *numbers_of_valve(second),
        _no_saturation(second),
        *of_the_pulse(second),
        *duty_cycles(first, second),
    ]


def numbers_of_valve(subject: Subject) -> Iterator[PaperNumber]:
    """Yield what the paper prints of every valve: dead zones and flows at both pressure drops, and at zero command."""
    for dp_MPa in PRESSURES_MPA:
        yield from _without_compensator(subject, dp_MPa)
    for dp_MPa in PRESSURES_MPA:
        yield _dead_zone_with(subject, dp_MPa)
        yield _flow_with(subject, dp_MPa)
    if subject.runs.valve.published.zero_flow_without_beta:
        yield from _zero_command(subject)
    yield from of_the_offset(subject)


def _read_at(subject: Subject) -> str:
    """Say at what flow a dead zone is read, where a meter stands between."""
    level = subject.runs.valve.level_L_min
    return f" (at {level:g} L/min)" if level else ""


def _without_compensator(subject: Subject, dp_MPa: float) -> Iterator[PaperNumber]:
    valve = subject.runs.valve.published
    printed = printed_at(valve, dp_MPa)
    assumed = explanations.DROP if valve is SECOND and dp_MPa != DP0_MPA else ""
    yield row(
        subject, dp_MPa, f"dead zone without{_read_at(subject)}", "%", printed.dead_zone_percent, "fitted",
        lambda runs, by: runs.dead_zone_percent(Drive(by), dp_MPa),
        allowed=command_around(printed.dead_zone_percent), tolerance="command", why=assumed,
    )  # fmt: skip
    allowed, tolerance = flow_around(subject.runs, printed.flow)
    yield row(
        subject, dp_MPa, "largest flow without", "L/min", printed.flow, "fitted",
        lambda runs, by: runs.largest_L_min(Drive(by), dp_MPa), allowed=allowed, tolerance=tolerance, why=assumed,
    )  # fmt: skip


def _of_the_displacement() -> Iterator[PaperNumber]:
    """Yield the displacement of Fig. 6 in both readings, of the plant at rest."""
    for reading in OF_READING:
        recovered = recover_simulated(reading)
        subject = Subject(runs=ValveRuns(valve=recovered, ramps={}, steps={}))
        for dp_MPa in PRESSURES_MPA:
            printed, rest = printed_at(recovered.published, dp_MPa), at_rest(recovered.plant, dp_MPa)
            travel = float(rest.position_mm(U_MAX_V))
            if reading == "overlap":
                dead = 100 * recovered.plant.overlap_mm / travel
            else:
                dead = 100 * float(rest.moves_V) / U_MAX_V
            for quantity, unit, text, value in (
                (DISPLACEMENT, "mm", printed.stroke_mm, travel),
                (DISPLACEMENT_DEAD_ZONE, "%", printed.displacement_dead_zone_percent, dead),
            ):
                name = f"{quantity} at {DP0_MPA} MPa"
                fitted = dp_MPa == DP0_MPA and any(
                    each.name in (name, name.removeprefix("largest ")) for each in recovered.figures
                )
                reason = explanations.displacement(quantity, reading, dp_MPa)
                yield row(
                    subject, dp_MPa, f"{quantity} ({reading})", unit, text,
                    "fitted" if fitted else "predicted", partial(_as_it_is, value), allowed=around(text),
                    tolerance="digits", reasons={} if fitted else {DIRECT: reason},
                    why=explanations.READINGS[reading] if quantity == DISPLACEMENT_DEAD_ZONE else "",
                )  # fmt: skip


def _as_it_is(value: float, runs: ValveRuns, by: Driver) -> float:
    return value


def _dead_zone_with(subject: Subject, dp_MPa: float) -> PaperNumber:
    text = subject.runs.valve.published.residual_percent
    return row(
        subject, dp_MPa, f"dead zone with{_read_at(subject)}", "%", text, "predicted",
        lambda runs, by: runs.dead_zone_percent(Drive(by), dp_MPa), subject.compensators,
        allowed=command_around(text), tolerance="command",
        reasons={by: explanations.residual(subject.runs, dp_MPa, by) for by in subject.compensators},
    )  # fmt: skip


def _flow_with(subject: Subject, dp_MPa: float, product: Reason | None = None) -> PaperNumber:
    printed = printed_at(subject.runs.valve.published, dp_MPa)
    allowed, tolerance = flow_around(subject.runs, printed.flow_with)
    # Eq. (18) ends at u_max: a law that leaves full command alone gives the flow that there is without it.
    more = abs(float(printed.flow_with) - float(printed.flow)) > allowed[1] - float(printed.flow_with)
    reasons = dict.fromkeys(subject.compensators, explanations.flow_with(subject.runs, dp_MPa)) if more else {}
    if product:
        reasons[PRODUCT] = product
    return row(
        subject, dp_MPa, "largest flow with", "L/min", printed.flow_with, "predicted",
        lambda runs, by: runs.largest_L_min(Drive(by), dp_MPa), subject.compensators,
        allowed=allowed, tolerance=tolerance, reasons=reasons,
    )  # fmt: skip


def _zero_command(subject: Subject) -> Iterator[PaperNumber]:
    dp_MPa, text = PRESSURES_MPA[1], subject.runs.valve.published.zero_flow_without_beta
    allowed, tolerance = flow_around(subject.runs, text)
    yield row(
        subject, dp_MPa, "zero command without beta", "L/min", text, "predicted",
        lambda runs, by: runs.zero_L_min(Drive(by, False), dp_MPa), subject.compensators,
        allowed=allowed, tolerance=tolerance,
        reasons={by: explanations.zero_without_beta(subject.runs, by) for by in subject.compensators},
    )  # fmt: skip
    metered = subject.runs.valve.level_L_min > 0
    yield row(
        subject, dp_MPa, "zero command with beta", "L/min", "none", "predicted",
        lambda runs, by: runs.zero_L_min(Drive(by), dp_MPa), subject.compensators,
        allowed=(0.0, float(METER_ACCURACY_L_MIN) if metered else PRINTED_NONE_L_MIN),
        tolerance="no flow" if metered else "none",
    )  # fmt: skip


def _step(subject: Subject) -> PaperNumber:
    return row(
        subject, PRESSURES_MPA[0], "rise time over that without", "1", "little effect", "in words",
        lambda runs, by: runs.rise_ms(Drive(by)) / runs.rise_ms(Drive(DIRECT)), subject.compensators,
        why=explanations.step(subject.runs),
    )  # fmt: skip


def _no_saturation(subject: Subject) -> PaperNumber:
    return row(
        subject, PRESSURES_MPA[0], "largest flow with: reached at", "V", "no saturation", "in words",
        lambda runs, by: runs.flat_from_V(Drive(by), PRESSURES_MPA[0]), subject.compensators,
        allowed=explanations.AT_THE_END_V, why=explanations.NO_SATURATION,
    )  # fmt: skip


def _about_largest(subject: Subject) -> Iterator[PaperNumber]:
    dp_MPa, text = PRESSURES_MPA[1], ABOUT_LARGEST_L_MIN
    yield row(
        subject, dp_MPa, "largest flow, about", "L/min", text, "predicted",
        lambda runs, by: runs.largest_L_min(Drive(by), dp_MPa), allowed=flow_around(subject.runs, text)[0],
        tolerance="metered", reasons={DIRECT: explanations.about_largest()},
    )  # fmt: skip


def _of_the_stop(subject: Subject) -> Iterator[PaperNumber]:
    """Yield what a stop changes of the first valve: where the flow saturates, and how much there is."""
    for dp_MPa in PRESSURES_MPA:
        fitted = dp_MPa == DP0_MPA
        meets: dict[Driver, Reason] = {PRODUCT: explanations.no_saturation_of_product()}
        yield row(
            subject, dp_MPa, "largest flow with: reached at", "V", "-".join(SATURATED_FROM_V),
            "fitted" if fitted else "predicted", partial(_flat_from_V, dp_MPa), subject.compensators,
            allowed=volts_between(*SATURATED_FROM_V), tolerance="range",
            reasons=meets if fitted else dict.fromkeys(subject.compensators, explanations.no_stop_beside()),
        )  # fmt: skip
    yield _flow_with(subject, PRESSURES_MPA[0])
    yield _flow_with(subject, PRESSURES_MPA[1], explanations.flow_with_stop(subject.runs))


def _flat_from_V(dp_MPa: float, runs: ValveRuns, by: Driver) -> float:
    return runs.flat_from_V(Drive(by), dp_MPa)
