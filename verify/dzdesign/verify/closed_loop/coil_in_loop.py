"""The coil of a drive by current in the valve's closed loop: what plant_coil.h and loop.c are given of it."""

from dataclasses import dataclass, replace
from importlib.resources import files

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import Corner
from dzdesign.verify.current.coil_simulation import CoilLoop, coil_loop_of
from dzdesign.verify.current.state_check import PROGRAMS, tick_macro

#: Inductance of a plant's coil that keeps the current that it is given: over a period all but 2e-8 of it is left.
HOLDING_H = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class CoilAtSupply:
    """A controller's coil as it is in one run."""

    around: CoilLoop
    corner: Corner

    def at(self, *, resistance: float, inductance: float, supply_V: float | None) -> "CoilAtSupply":
        """Return the declared coil times factors, at a supply; without one at the nominal."""
        circuit = self.around.circuit
        low, high = circuit.supply_V
        return replace(
            self,
            corner=Corner(
                resistance * circuit.resistance_ohm + circuit.series_ohm,
                inductance * circuit.inductance_H,
                (low * high) ** 0.5 if supply_V is None else supply_V,
            ),
        )

    def structs(self) -> tuple[np.ndarray, np.ndarray]:
        """Return coil and sensor as dz_loop() takes them."""
        return self.around.coil_struct(self.corner), self.around.sensor_struct()


def nominal_coil(compensator: Compensator) -> CoilAtSupply | None:
    """Return the declared coil at its nominal supply; None of a drive by duty."""
    if compensator.current_drive is None:
        return None
    around = coil_loop_of(compensator)
    if around is None:
        raise InputError("compensator.json names no target, so the converter of the current is not known; design again")
    nothing = CoilAtSupply(around=around, corner=Corner(1.0, 1.0, 1.0))
    return nothing.at(resistance=1.0, inductance=1.0, supply_V=None)


def coil_sources(coil: CoilAtSupply | None) -> dict[str, str]:
    """Return what plant_coil.h includes: the coil, or what stands in for it where the drive is by duty."""
    if coil is None:
        return {"coil.h": (files(__package__) / "programs" / "no_coil.h").read_text(encoding="utf-8")}
    coil_h = (PROGRAMS / "coil.h").read_text(encoding="utf-8")
    return {"coil.h": coil_h, "tick.h": tick_macro(coil.around.loop)}
