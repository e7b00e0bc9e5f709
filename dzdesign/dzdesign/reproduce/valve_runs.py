"""The ramps and steps of Sections 2 and 4 on a recovered valve: bare, with the paper's law, and with the product."""

from dataclasses import dataclass, replace
from math import ceil
from typing import Literal, NamedTuple

import numpy as np

from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, DUTY_COMMAND_V, RAMP_S, U_MAX_V, PublishedValve
from dzdesign.derivation.law import law
from dzdesign.design.compensator import Compensator
from dzdesign.reproduce.artefact import Driver
from dzdesign.reproduce.recovered_valves import RecoveredValve
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S
from dzdesign.verify.closed_loop.ramps import FLOW_SHARE, dead_zone

PRESSURES_MPA = (float(DP0_MPA), float(DP1_MPA))
#: Step of the command, Fig. 8: so long at zero, and at full command, s; one record a period of the PWM.
STEP_AT_S, STEP_FOR_S = 0.05, 0.1
#: The largest flow is reached where the flow comes this close to it.
REACHED = 0.999
#: Who drives the valve: nobody between, the paper's law, or the product.
DIRECT: Literal["valve"] = "valve"
PAPER: Literal["paper's law"] = "paper's law"
PRODUCT: Literal["product"] = "product"


class Drive(NamedTuple):
    """What drives the valve, and whether it knows of beta."""

    by: Driver
    with_beta: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveRuns:
    """Everything that was run of one valve."""

    valve: RecoveredValve
    #: By drive and pressure drop in MPa, up to full command and back; `command` is the compensator's input.
    ramps: dict[tuple[Drive, float], LoopRun]
    #: To full command at dP0, one record a PWM period.
    steps: dict[Drive, LoopRun]
    #: Of the product at the command of Fig. 13 and dP0; None without a firmware.
    product_duty_percent: float | None = None
    #: Commands about zero that the product takes for zero, percent of full.
    product_zero_band_percent: float = 0.0
    #: Commands behind these in which the product goes from the closing offset to the opening threshold.
    product_transition_percent: float = 0.0

    @property
    def direct_duty_percent(self) -> float:
        """Duty cycle of the loop's PWM at the command of Fig. 12, with nobody between, percent."""
        run = self.ramps[Drive(DIRECT), PRESSURES_MPA[0]]
        at = int(np.argmax(run.command >= DUTY_COMMAND_V / U_MAX_V))
        return 100 * float(run.compare[at] / run.compare.max())

    def dead_zone_percent(self, drive: Drive, dp_MPa: float, level_L_min: float | None = None) -> float:
        """Return the command, percent of full, at which rising flow passes a level: of the paper unless given."""
        run = self.ramps[drive, dp_MPa]
        level = self.valve.level_L_min if level_L_min is None else level_L_min
        return 100 * dead_zone(run, level or FLOW_SHARE * float(run.q_mean_L_min.max()), rising=True)

    def onset_percent(self, drive: Drive, dp_MPa: float) -> float:
        """Return the command, percent of full, at which flow begins: no meter between."""
        level = FLOW_SHARE * float(self.ramps[drive, dp_MPa].q_mean_L_min.max())
        return self.dead_zone_percent(drive, dp_MPa, level)

    def still_percent(self, dp_MPa: float) -> float:
        """Return the command, percent of full, at which the spool of the bare valve begins to move."""
        run = self.ramps[Drive(DIRECT), dp_MPa]
        moved = np.flatnonzero(run.position_mm > FLOW_SHARE * run.position_mm.max())
        return 100 * float(run.command[moved[0]])

    def largest_L_min(self, drive: Drive, dp_MPa: float) -> float:
        """Return the largest flow of a ramp."""
        return float(self.ramps[drive, dp_MPa].q_mean_L_min.max())

    def zero_L_min(self, drive: Drive, dp_MPa: float) -> float:
        """Return the flow at zero command, after closing."""
        return float(self.ramps[drive, dp_MPa].q_largest_L_min[-1])

    def flat_from_V(self, drive: Drive, dp_MPa: float) -> float:
        """Return the command at which the largest flow is reached."""
        run = self.ramps[drive, dp_MPa]
        return U_MAX_V * float(run.command[np.argmax(run.q_mean_L_min >= REACHED * run.q_mean_L_min.max())])

    def rise_ms(self, drive: Drive) -> float:
        """Return the time from the step of the command to nine tenths of the flow that it ends at."""
        run = self.steps[drive]
        reached = run.time[np.argmax(run.q_L_min >= 0.9 * run.q_L_min[-1])]
        return 1e3 * float(reached - STEP_AT_S)


def paper_drive(valve: PublishedValve, command: np.ndarray, dp_MPa: float, with_beta: bool = True) -> np.ndarray:
    """Return the output of the paper's compensator over u_max, its parameters taken from what the paper prints.

    The valve's dead zones are u_min0 and, over it, beta, Eq. (5); k x_max is the command left above u_min0. `with_beta`
    says whether the selector of Eq. (7) heeds the pressure drop.
    """
    u_min0, u_min1 = (float(text) / 100 for text in (valve.dead_zone0_percent, valve.dead_zone1_percent))
    fitted = float(np.interp(dp_MPa, PRESSURES_MPA, (u_min0, u_min1)))  # Eq. (4): two tests determine a straight line
    beta = fitted / u_min0 if with_beta and dp_MPa > DP0_MPA else 1.0  # Eqs. (5), (7)
    chosen = law("paper")
    drive = chosen.evaluate_gain(beta, 1 - u_min0) * command + chosen.evaluate_offset(beta, u_min0)
    return np.asarray(np.clip(drive, 0.0, 1.0))


def paper_duty_percent(valve: PublishedValve) -> float:
    """Return the duty cycle that the paper's law gives at dP0 and the command of Fig. 13, percent."""
    return 100 * float(paper_drive(valve, np.array([DUTY_COMMAND_V / U_MAX_V]), DP0_MPA)[0])


def run_valve(valve: RecoveredValve, loop: ClosedLoop, compensator: Compensator | None = None) -> ValveRuns:
    """Run a recovered valve through the paper's ramps and its step; with a compensator the loop's firmware too."""
    command = RampSequence(ramp=float(RAMP_S)).command()
    ramps: dict[tuple[Drive, float], LoopRun] = {}
    for dp_MPa in PRESSURES_MPA:
        ramps[Drive(DIRECT), dp_MPa] = loop.run(command, dp_MPa)
        for with_beta in (True, False) if valve.published.zero_flow_without_beta else (True,):
            driven = loop.run(paper_drive(valve.published, command, dp_MPa, with_beta), dp_MPa)
            ramps[Drive(PAPER, with_beta), dp_MPa] = replace(driven, command=command)
            if compensator:
                ramps[Drive(PRODUCT, with_beta), dp_MPa] = _run_product(loop, command, dp_MPa, with_beta)
    duty, band, transition = None, 0.0, 0.0
    if compensator:
        held = np.concatenate([resting(loop), np.full(2, DUTY_COMMAND_V / U_MAX_V)])
        at_duty = _run_product(loop, held, PRESSURES_MPA[0], with_beta=True)
        duty = 100 * float(at_duty.compare[-1]) / compensator.signals.compare_max
        span = compensator.signals.command.span(1)
        band, transition = (100 * codes / span for codes in (compensator.zero_band_codes, compensator.transition_codes))
    return ValveRuns(
        valve=valve, ramps=ramps, steps=_steps(valve, loop, compensator is not None), product_duty_percent=duty,
        product_zero_band_percent=band, product_transition_percent=transition,
    )  # fmt: skip


def resting(loop: ClosedLoop) -> np.ndarray:
    """Return zero command for as long as the drive waits for it after a reset."""
    return np.zeros(ceil(loop.waits_s / RECORD_S) + 1)


def _run_product(loop: ClosedLoop, command: np.ndarray, dp_MPa: float, with_beta: bool) -> LoopRun:
    return loop.run(command, dp_MPa, "compensated" if with_beta else "without beta", dp_frozen_MPa=PRESSURES_MPA[0])


def _steps(valve: RecoveredValve, loop: ClosedLoop, product: bool) -> dict[Drive, LoopRun]:
    """Run the step from zero to full command at dP0."""
    records = np.arange(round((STEP_AT_S + STEP_FOR_S) / PWM_PERIOD_S)) * PWM_PERIOD_S
    command = np.where(records < STEP_AT_S, 0.0, 1.0)
    dp_MPa = PRESSURES_MPA[0]
    driven = {
        Drive(DIRECT): loop.run(command, dp_MPa, periods_per_record=1),
        Drive(PAPER): loop.run(paper_drive(valve.published, command, dp_MPa), dp_MPa, periods_per_record=1),
    }
    if product:
        driven[Drive(PRODUCT)] = loop.run(command, dp_MPa, "compensated", periods_per_record=1)
    return {drive: replace(run, command=command) for drive, run in driven.items()}
