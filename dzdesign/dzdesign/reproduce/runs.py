"""The ramps and the step of Sections 2 and 4 on a recovered valve: bare, and with the product's C."""

from dataclasses import dataclass
from math import ceil

import numpy as np

from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, DUTY_COMMAND_V, RAMP_S, U_MAX_V
from dzdesign.design.compensator import Compensator
from dzdesign.reproduce.recovered_valves import RecoveredValve
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S
from dzdesign.verify.closed_loop.ramps import FLOW_SHARE, dead_zone

PRESSURES_MPA = (float(DP0_MPA), float(DP1_MPA))
#: Step of the command, Fig. 8: so long at zero, and at full command, s; one record a period of the PWM.
STEP_AT_S, STEP_FOR_S = 0.05, 0.1
#: The largest flow is reached where the flow comes this close to it.
REACHED = 0.999
#: What drives the valve, as the loop calls it.
DIRECT, PRODUCT, WITHOUT_BETA = "direct", "compensated", "without beta"


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveRuns:
    """Everything that was run of one valve."""

    valve: RecoveredValve
    #: By what drives and pressure drop in MPa: up to full command and back.
    ramps: dict[tuple[str, float], LoopRun]
    #: By what drives: to full command at dP0, one record a PWM period.
    steps: dict[str, LoopRun]
    #: Of the product at the command of Fig. 13 and dP0.
    duty_percent: float
    #: Commands about zero that the product takes for zero, percent of full.
    zero_band_percent: float
    #: Commands behind these in which the product goes from the closing offset to the opening threshold.
    transition_percent: float

    @property
    def direct_duty_percent(self) -> float:
        """Duty cycle of the loop's PWM at the command of Fig. 12, with nobody between, percent."""
        run = self.ramps[DIRECT, PRESSURES_MPA[0]]
        at = int(np.argmax(run.command >= DUTY_COMMAND_V / U_MAX_V))
        return 100 * float(run.compare[at] / run.compare.max())

    def dead_zone_percent(self, drive: str, dp_MPa: float) -> float:
        """Return the command, percent of full, at which rising flow passes what the paper takes for flow."""
        run = self.ramps[drive, dp_MPa]
        level = self.valve.level_L_min or FLOW_SHARE * float(run.q_mean_L_min.max())
        return 100 * dead_zone(run, level, rising=True)

    def largest_L_min(self, drive: str, dp_MPa: float) -> float:
        """Return the largest flow of a ramp."""
        return float(self.ramps[drive, dp_MPa].q_mean_L_min.max())

    def zero_L_min(self, drive: str, dp_MPa: float) -> float:
        """Return the flow at zero command, after closing."""
        return float(self.ramps[drive, dp_MPa].q_largest_L_min[-1])

    def flat_from_V(self, drive: str, dp_MPa: float) -> float:
        """Return the command at which the largest flow is reached."""
        run = self.ramps[drive, dp_MPa]
        return U_MAX_V * float(run.command[np.argmax(run.q_mean_L_min >= REACHED * run.q_mean_L_min.max())])

    def rise_ms(self, drive: str) -> float:
        """Return the time from the step of the command to nine tenths of the flow that it ends at."""
        run = self.steps[drive]
        reached = run.time[np.argmax(run.q_L_min >= 0.9 * run.q_L_min[-1])]
        return 1e3 * float(reached - STEP_AT_S)


def run_valve(valve: RecoveredValve, loop: ClosedLoop, compensator: Compensator) -> ValveRuns:
    """Run a recovered valve through the paper's ramps and its step, bare and with the loop's firmware."""
    dp0_MPa, span = PRESSURES_MPA[0], compensator.signals.command.span(1)
    ramp = RampSequence(ramp=float(RAMP_S)).command()
    records = np.arange(round((STEP_AT_S + STEP_FOR_S) / PWM_PERIOD_S)) * PWM_PERIOD_S
    step = np.where(records < STEP_AT_S, 0.0, 1.0)
    # Zero command for as long as the drive waits for it after a reset.
    held = np.append(np.zeros(ceil(loop.waits_s / RECORD_S) + 1), np.full(2, DUTY_COMMAND_V / U_MAX_V))
    drives = (DIRECT, PRODUCT, *([WITHOUT_BETA] if valve.published.zero_flow_without_beta else []))
    return ValveRuns(
        valve=valve,
        ramps={
            (drive, dp_MPa): loop.run(ramp, dp_MPa, drive, dp_frozen_MPa=dp0_MPa)
            for dp_MPa in PRESSURES_MPA
            for drive in drives
        },
        steps={drive: loop.run(step, dp0_MPa, drive, periods_per_record=1) for drive in (DIRECT, PRODUCT)},
        duty_percent=100 * float(loop.run(held, dp0_MPa, PRODUCT).compare[-1]) / compensator.signals.compare_max,
        zero_band_percent=100 * compensator.zero_band_codes / span,
        transition_percent=100 * compensator.transition_codes / span,
    )
