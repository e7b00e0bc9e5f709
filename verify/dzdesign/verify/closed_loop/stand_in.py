"""The stand-in plant: the recorded characteristic of a side of the valve, moved by the default plant's coil and spool.

The rules. A test's flow over command is what was recorded (`recorded` in valve.json), each branch by itself; between
the branches the spool stands still, so that a command that turns finds the same flow until it meets the other branch.
Between two tests the command of the first flow seen runs straight over the pressure drop; the command counts from
there, as a share of what is left up to full command (or down to zero); the share of the largest flow at it is straight
between the tests' own, and the largest flow straight in logarithms. Beyond the tests that command goes straight on, as
steep as the line that fits best where the flow of all tests begins. The nearest test's shares hold there, and the
largest flow goes with the root of the pressure drop. The pressure drop sags over the flow as on the bench.

Below the noise level a recording shows no flow, and the plant none that is known: `unseen_below_L_min`.
"""

from dataclasses import dataclass, replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.valve.recorded_curve import SAG_STEPS, RecordedBranch
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.verify.closed_loop.plant import Plant

#: Travel of the spool beyond that at full command, as a share: it never meets the far stop, of which nothing is known.
BEYOND_FULL = 0.2
#: Numbers of a test before its pressure drops, as plant_curve.h has them: pressure drop, flow, two branches of four.
TEST_HEAD = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class StandIn:
    """Stands in for a valve whose plant is not known."""

    side: SideModel
    #: Coil, mass, spring and damping; nothing of its edge counts, nor of its thresholds.
    dynamics: Plant
    #: Flow over that of the tests, for oil of another density.
    flow_scale: float = 1.0
    #: Distance of the branches over the recorded one.
    hysteresis: float = 1.0

    @property
    def parameters(self) -> Plant:
        """The plant that moves the spool."""
        return self.dynamics

    @property
    def table(self) -> np.ndarray:
        """What plant_curve.h reads."""
        volts_per_metre = self.dynamics.K_et_N_m / self.dynamics.force_per_volt
        head = [len(self.side.tests), self.dynamics.u_max_V, volts_per_metre, self.flow_scale, SAG_STEPS, *self._slopes]
        tests, starts, begin = [], [], len(head) + len(self.side.tests)
        for test in self.side.tests:
            curve = test.recorded
            largest = curve.q_max_L_min
            sag = np.array(curve.dp_at_flow_MPa or [1.0] * (SAG_STEPS + 1))
            entries: list[float] = []
            points: list[np.ndarray] = []
            place = TEST_HEAD + SAG_STEPS + 1
            for branch, other in ((curve.opening, curve.closing), (curve.closing, curve.opening)):
                count, u_V, seen_V = len(branch.u_V), np.array(branch.u_V), _first_seen(branch, self.dynamics.u_max_V)
                if self.hysteresis != 1.0:
                    u_V, seen_V = self._moved(branch, other)
                entries += [seen_V, place, place + count, count]
                points += [u_V, np.array(branch.q_L_min) / largest]
                place += 2 * count
            tests.append(np.concatenate([[test.dp_MPa or 0.0, largest], entries, sag / sag[0], *points]))
            starts.append(begin)
            begin += tests[-1].size
        return np.concatenate([head, starts, *tests])

    def _moved(self, branch: RecordedBranch, other: RecordedBranch) -> tuple[np.ndarray, float]:
        """Return the commands of a branch, and that of its first flow seen, moved towards those of the other."""
        share, u_V, q = (1 - self.hysteresis) / 2, np.array(branch.u_V), np.array(branch.q_L_min)
        seen_V = _first_seen(branch, self.dynamics.u_max_V)
        between_V = np.interp(q, np.maximum.accumulate(other.q_L_min), other.u_V) - u_V
        # Below the first flow seen a flow tells no command.
        of_seen_V = _first_seen(other, self.dynamics.u_max_V) - seen_V
        between_V = np.where(u_V <= seen_V, of_seen_V, between_V)
        return np.maximum.accumulate(np.maximum(u_V + share * between_V, 0.0)), seen_V + share * of_seen_V

    @property
    def _slopes(self) -> list[float]:
        """How the command where the flow begins runs over the pressure drop, opening and closing, V/MPa."""
        dp = np.array([test.dp_MPa for test in self.side.tests])
        if dp.size < 2:
            return [0.0, 0.0]
        curves = [test.recorded for test in self.side.tests]
        return [
            float(np.polyfit(dp, [_begin(branch) for branch in branches], 1)[0])
            for branches in ([curve.opening for curve in curves], [curve.closing for curve in curves])
        ]

    def unseen_below_L_min(self, dp_MPa: float) -> float:
        """Return the flow below which nothing is known at a pressure drop: the noise level of the tests about it."""
        dp = np.array([test.dp_MPa for test in self.side.tests])
        levels = np.array([test.noise_level_L_min for test in self.side.tests])
        above = int(np.clip(np.searchsorted(dp, dp_MPa), 0, dp.size - 1))
        return float(max(levels[max(above - 1, 0) if dp[above] > dp_MPa else above], levels[above]))

    def with_hysteresis(self, share: float) -> "StandIn":
        """Return it with so many times the hysteresis."""
        return replace(self, hysteresis=share * self.hysteresis)

    def with_oil(self, viscosity: float, density: float) -> "StandIn":
        """Return it with oil of so many times the viscosity and density."""
        scale = self.flow_scale / density**0.5
        return replace(self, dynamics=self.dynamics.with_oil(viscosity, density), flow_scale=scale)


def _first_seen(branch: RecordedBranch, u_max_V: float) -> float:
    """Return the command of the first flow seen, off both ends: commands are counted from it, as shares."""
    return float(np.clip(branch.u_seen_V, 1e-3 * u_max_V, 0.99 * u_max_V))


def _begin(branch: RecordedBranch) -> float:
    """Return the command where the flow begins: of the second point, unless that is where it is first seen."""
    return min(branch.u_V[1], branch.u_seen_V) if len(branch.u_V) > 1 else branch.u_V[0]


def stand_in_of(side: SideModel, u_max_V: float) -> StandIn:
    """Return the stand-in of one side; a side without pressure drops is refused."""
    for test in side.tests:
        if test.dp_MPa is None:
            raise InputError(f"{test.source} has no pressure drop, so no plant can be made from it; give --plant")
    still = Plant(
        u_max_V=u_max_V,
        preload_N=0,
        overlap_mm=0,
        hysteresis_V=0,
        pressure_force_N_MPa=0,
        flow_force_N_mm_MPa=0,
        droop_MPa_L_min2=0,
    )
    full_mm = 1e3 * u_max_V * still.force_per_volt / still.K_et_N_m
    return StandIn(side=side, dynamics=replace(still, stroke_mm=(1 + BEYOND_FULL) * full_mm))
