"""The numbers of Section 3's pulse, Figs. 12 and 13, and of Section 4.3's load and oil, Figs. 20 to 22."""

from collections.abc import Iterator
from functools import partial

from dzdesign.derivation.account.published import (
    DUTY_COMMAND_V,
    DUTY_WITH_PERCENT,
    DUTY_WITHOUT_PERCENT,
    LOAD_COMMANDS_V,
    LOAD_DP_MPA,
    METER_ACCURACY_L_MIN,
    PWM_AMPLITUDE_V,
    PWM_KHZ,
    TEMPERATURE_CHANGE_PER_MILLE,
)
from dzdesign.reproduce import explanations
from dzdesign.reproduce.artefact import Driver, PaperNumber
from dzdesign.reproduce.load_and_oil import LoadAndOil
from dzdesign.reproduce.rows import ONE_RECORD_PERCENT, Subject, around, row
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRESSURES_MPA, ValveRuns, paper_duty_percent
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S

#: What rises at all, percent.
INCREASING_PERCENT = (1e-3, 100.0)


def of_section_4_3(first: Subject) -> Iterator[PaperNumber]:
    """Yield what the paper says of load and oil; nothing where they were not run."""
    if not first.load_and_oil:
        return
    runs_of = dict(zip((id(runs) for runs in first.all), first.load_and_oil, strict=True))

    def under(runs: ValveRuns) -> LoadAndOil:
        return runs_of[id(runs)]

    def spread(command: str, runs: ValveRuns, by: Driver) -> float:
        return under(runs).spread_L_min(by, command)

    dp_MPa = float(LOAD_DP_MPA)
    for command in LOAD_COMMANDS_V:
        yield row(
            first, dp_MPa, f"flow at {command} V over the load", "L/min", "little impact", "in words",
            partial(spread, command), first.compensators, allowed=(0.0, float(METER_ACCURACY_L_MIN)),
            why=explanations.LOAD,
        )  # fmt: skip
    text = TEMPERATURE_CHANGE_PER_MILLE
    yield row(
        first, dp_MPa, "dead zone over oil temperature", "1/1000", text, "predicted",
        lambda runs, by: under(runs).dead_zone_change_per_mille(by), (DIRECT, *first.compensators),
        allowed=around(text, 10 * ONE_RECORD_PERCENT), tolerance="command",
        reasons=dict.fromkeys((DIRECT, *first.compensators), explanations.temperature(first.runs)),
    )  # fmt: skip
    yield row(
        first, dp_MPa, "largest flow over oil temperature", "%", "increasing", "in words",
        lambda runs, by: under(runs).largest_flow_change_percent(by), (DIRECT, *first.compensators),
        allowed=INCREASING_PERCENT, why=explanations.OIL_FLOW,
    )  # fmt: skip


def of_the_pulse(subject: Subject) -> Iterator[PaperNumber]:
    """Yield what the text says of the pulse of Figs. 12 and 13, whatever the valve."""
    yield row(
        subject, None, "PWM frequency", "kHz", PWM_KHZ, "given", lambda runs, by: 1e-3 / PWM_PERIOD_S,
        allowed=around(PWM_KHZ),
    )  # fmt: skip
    yield row(
        subject, None, "PWM amplitude", "V", PWM_AMPLITUDE_V, "given", lambda runs, by: float(PWM_AMPLITUDE_V),
        allowed=around(PWM_AMPLITUDE_V), why=explanations.AMPLITUDE,
    )  # fmt: skip
    yield row(
        subject, PRESSURES_MPA[0], f"duty cycle at {DUTY_COMMAND_V} V without", "%", DUTY_WITHOUT_PERCENT, "predicted",
        lambda runs, by: runs.direct_duty_percent, allowed=around(DUTY_WITHOUT_PERCENT), tolerance="digits",
    )  # fmt: skip


def duty_cycles(first: Subject, second: Subject) -> Iterator[PaperNumber]:
    """Yield the duty cycle of Fig. 13 of each valve that it may be of."""

    def read(runs: ValveRuns, by: Driver) -> float | None:
        return paper_duty_percent(runs.valve.published) if by == PAPER else runs.product_duty_percent

    for subject in (second, first):
        reasons = {by: explanations.duty(subject.runs, by) for by in subject.compensators}
        if subject is second:
            del reasons[PAPER]
        yield row(
            subject, PRESSURES_MPA[0], f"duty cycle at {DUTY_COMMAND_V} V with", "%", DUTY_WITH_PERCENT, "predicted",
            read, subject.compensators, allowed=around(DUTY_WITH_PERCENT), tolerance="digits", reasons=reasons,
            why=explanations.DUTY_OF_ONE,
        )  # fmt: skip
