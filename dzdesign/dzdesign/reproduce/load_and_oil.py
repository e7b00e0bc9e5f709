"""Section 4.3 on a recovered valve: flow over the load at a constant pressure drop, and ramps with other oils."""

from dataclasses import dataclass, replace

import numpy as np

from dzdesign.derivation.account.published import LOAD_COMMANDS_V, LOAD_DP_MPA, METER_FLOOR_L_MIN, RAMP_S, U_MAX_V
from dzdesign.reproduce.artefact import Driver
from dzdesign.reproduce.assumptions import LOADS_MPA, OILS
from dzdesign.reproduce.recovered_valves import RecoveredValve
from dzdesign.reproduce.valve_runs import DIRECT, PAPER, PRODUCT, paper_drive, resting
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.ramps import dead_zone

#: The valve settles for so long; then the load rises for so long, s.
SETTLES_S, RISES_S = 1.0, 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadAndOil:
    """Runs of one valve at the pressure drop of Section 4.3."""

    #: Load of the records below, MPa.
    load_MPa: np.ndarray
    #: By driver and command as printed: mean flow over the load, L/min, (N,).
    over_load: dict[tuple[Driver, str], np.ndarray]
    #: By driver and temperature in °C: up to full command and back; `command` is the compensator's input.
    oils: dict[tuple[Driver, float], LoopRun]

    def spread_L_min(self, by: Driver, command: str) -> float:
        """Return the largest change of the flow over the load."""
        return float(np.ptp(self.over_load[by, command]))

    def dead_zone_change_per_mille(self, by: Driver) -> float:
        """Return the change of the command at which the meter starts, over the oils, per mille of full command."""
        read = [dead_zone(run, float(METER_FLOOR_L_MIN), rising=True) for run in self._of(by)]
        return 1e3 * float(np.ptp(read))

    def largest_flow_change_percent(self, by: Driver) -> float:
        """Return by how much the largest flow rises from the coldest to the warmest oil."""
        largest = [float(run.q_mean_L_min.max()) for run in self._of(by)]
        return 100 * (largest[-1] / largest[0] - 1)

    def _of(self, by: Driver) -> list[LoopRun]:
        return [self.oils[by, oil.temperature_C] for oil in OILS]


def run_load_and_oil(valve: RecoveredValve, loop: ClosedLoop, product: bool) -> LoadAndOil:
    """Run a recovered valve under load, and with each oil; with a firmware its product too."""
    dp_MPa, rest = float(LOAD_DP_MPA), resting(loop)
    settles, rises = (round(seconds / RECORD_S) for seconds in (SETTLES_S, RISES_S))
    load = np.concatenate([np.full(rest.size + settles, LOADS_MPA[0]), np.linspace(*LOADS_MPA, rises)])
    over_load: dict[tuple[Driver, str], np.ndarray] = {}
    for text in LOAD_COMMANDS_V:
        command = np.concatenate([rest, np.full(settles + rises, float(text) / U_MAX_V)])
        driven: dict[Driver, LoopRun] = {
            PAPER: loop.run(paper_drive(valve.published, command, dp_MPa), dp_MPa, back_MPa=load)
        }
        if product:
            driven[PRODUCT] = loop.run(command, dp_MPa, "compensated", back_MPa=load)
        over_load |= {(by, text): run.q_mean_L_min[-rises:] for by, run in driven.items()}
    command = RampSequence(ramp=float(RAMP_S)).command()
    oils: dict[tuple[Driver, float], LoopRun] = {}
    for oil in OILS:
        warm, at = loop.with_plant(valve.plant.with_oil(oil.viscosity, oil.density)), oil.temperature_C
        oils[DIRECT, at] = warm.run(command, dp_MPa)
        by_law = warm.run(paper_drive(valve.published, command, dp_MPa), dp_MPa)
        oils[PAPER, at] = replace(by_law, command=command)
        if product:
            oils[PRODUCT, at] = warm.run(command, dp_MPa, "compensated")
    return LoadAndOil(load_MPa=load[-rises:], over_load=over_load, oils=oils)
