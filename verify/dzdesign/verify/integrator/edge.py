"""What flows at a position of the spool, written once more: Eq. (24), or the recorded characteristic by its rules."""

from dataclasses import dataclass
from math import log, sqrt

import numpy as np

from dzdesign.identify.valve.recorded_curve import RecordedBranch, RecordedCurve
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.stand_in import StandIn
from dzdesign.verify.integrator.spool import drop_left

#: Where the first flow of a recording is taken to be at least and at most, shares of full command.
LEAST, MOST = 1e-3, 0.99


@dataclass(slots=True)
class Orifice:
    """The metering edge of Eq. (24), past its overlap."""

    plant: Plant
    q_L_min: float = 0.0
    dp_MPa: float = 0.0
    #: Whether the flow is that of the mean position over a period, and not of its end.
    of_mean: bool = False

    def at(self, position_mm: float, supply_MPa: float) -> None:
        """Pass what it passes at a position."""
        plant = self.plant
        opening_m = max(position_mm - plant.overlap_mm, 0.0) * 1e-3
        self.dp_MPa = float(drop_left(plant, opening_m * 1e3, supply_MPa))
        # Eq. (24), m^3/s.
        flow = plant.C_d_W_mm * 1e-3 * opening_m * sqrt(2 * self.dp_MPa * 1e6 / plant.rho_kg_m3)
        self.q_L_min = flow * 60_000

    def supplied(self, position_mm: float, supply_MPa: float) -> None:
        """Take another pressure drop at no flow."""
        self.at(position_mm, supply_MPa)


class Recorded:
    """The recorded characteristic, by the rules that stand in stand_in.py."""

    of_mean = True

    def __init__(self, stand_in: StandIn) -> None:
        self._plant = stand_in.dynamics
        self._scale = stand_in.flow_scale
        self._tests = sorted(stand_in.side.tests, key=lambda test: test.dp_MPa or 0.0)
        self._dp = np.array([test.dp_MPa for test in self._tests])
        curves = [test.recorded for test in self._tests]
        self._curves: list[RecordedCurve] = curves
        # Straight lines through where the flow of each test begins, one a branch.
        self._per_MPa = [
            float(np.polyfit(self._dp, [_begins(branch) for branch in branches], 1)[0]) if len(curves) > 1 else 0.0
            for branches in zip(*((curve.opening, curve.closing) for curve in curves), strict=True)
        ]
        self._share = 0.0
        self._supply_MPa = 0.0
        self.q_L_min = 0.0
        self.dp_MPa = 0.0

    def supplied(self, _position_mm: float, supply_MPa: float) -> None:
        """Take another pressure drop at no flow: the spool is where it was, and so is the share of the flow."""
        self._supply_MPa = supply_MPa
        self._show()

    def at(self, position_mm: float, supply_MPa: float) -> None:
        """Pass what flows at the mean position of a period."""
        self._supply_MPa = supply_MPa
        plant = self._plant
        # Eqs. (19)-(23) at rest, without load: the command that holds the spool there.
        loop_ohm = plant.R_c_ohm + plant.r_p_ohm + plant.K_a * plant.K_fi_V_A
        command_V = position_mm * 1e-3 * plant.K_et_N_m * loop_ohm / (plant.K_i_N_A * plant.K_a)
        opening, closing = (self._share_of(branch, command_V) for branch in (0, 1))
        self._share = max(min(self._share, closing), opening)
        self._show()

    def _between(self) -> tuple[int, int, float]:
        """Return the tests on both sides of the supply, and how far it is towards the upper one."""
        if self._dp.size == 1:
            return 0, 0, 0.0
        upper = int(np.clip(np.searchsorted(self._dp, self._supply_MPa), 1, self._dp.size - 1))
        low, high = self._dp[upper - 1], self._dp[upper]
        return upper - 1, upper, float(np.clip((self._supply_MPa - low) / (high - low), 0.0, 1.0))

    def _share_of(self, branch: int, command_V: float) -> float:
        """Return the share of the largest flow that a branch passes at a command."""
        lower, upper, towards = self._between()
        full_V = self._plant.u_max_V
        branches = [(self._curves[each].opening, self._curves[each].closing)[branch] for each in (lower, upper)]
        firsts = [min(max(each.u_seen_V, LEAST * full_V), MOST * full_V) for each in branches]
        beyond_MPa = self._supply_MPa - min(max(self._supply_MPa, self._dp[lower]), self._dp[upper])
        first = firsts[0] + towards * (firsts[1] - firsts[0]) + beyond_MPa * self._per_MPa[branch]
        first = min(max(first, LEAST * full_V), MOST * full_V)
        room_V = full_V - first if command_V > first else first
        from_first = (command_V - first) / room_V
        share = 0.0
        for weight, each, own_first, test in zip(
            (1.0 - towards, towards), branches, firsts, (lower, upper), strict=True
        ):
            own_room = full_V - own_first if from_first > 0.0 else own_first
            flow = np.interp(own_first + from_first * own_room, each.u_V, each.q_L_min)
            share += weight * float(flow) / self._curves[test].q_max_L_min
        return share

    def _show(self) -> None:
        """Set flow and pressure drop of the share that flows."""
        lower, upper, towards = self._between()
        supply, low, high = self._supply_MPa, self._dp[lower], self._dp[upper]
        most = [self._curves[each].q_max_L_min for each in (lower, upper)]
        largest = most[0]
        if upper > lower:
            inside = min(max(supply, low), high)
            largest *= (most[1] / most[0]) ** (log(inside / low) / log(high / low))
            largest *= sqrt(supply / inside)
        else:
            largest *= sqrt(supply / low)
        left = 0.0
        for weight, test in ((1.0 - towards, lower), (towards, upper)):
            sag = self._curves[test].dp_at_flow_MPa
            if sag is None:
                left += weight
            else:
                at = np.linspace(0.0, 1.0, len(sag))
                left += weight * float(np.interp(self._share, at, sag)) / sag[0]
        self.q_L_min = self._share * largest * self._scale
        self.dp_MPa = supply * left


def edge_of(plant: Plant | StandIn) -> Orifice | Recorded:
    """Return what flows of a plant of equations, or of the recorded characteristic."""
    return Recorded(plant) if isinstance(plant, StandIn) else Orifice(plant)


def _begins(branch: RecordedBranch) -> float:
    """Return the command where the flow of a branch begins."""
    return min(branch.u_V[1], branch.u_seen_V) if len(branch.u_V) > 1 else branch.u_V[0]
