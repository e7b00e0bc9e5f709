"""The declared coil and its supply: what follows from them by formulas of this room's own, and the C in a loop with it.

Nothing of `design`'s formulas is used. In the loop the PWM is resolved: programs/coil_loop.c, one corner after another.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf, log, sqrt
from typing import NamedTuple

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import (
    CORRECTION_SHIFT,
    CoilCircuit,
    Corner,
    CurrentLoop,
    CurrentSampling,
    CurrentSensor,
)
from dzdesign.design.target_inputs import Converter
from dzdesign.verify.current.controller_states import PROGRAMS, tick_macro
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function

#: `struct trace` of programs/coil_loop.h: of each period of the PWM the mean currents of solenoids A and B, the largest
#: current in both at once, the compare value in it, the sum of codes that its interrupt was given, and the bits of the
#: faults after it.
TRACE = np.dtype(
    [("means_A", "<f8", 2), ("both_A", "<f8")] + [(name, "<u2") for name in ("compare", "total", "faults", "_")]
)
#: Bits of solenoids A and B.
BOTH = 3
#: `struct coil` and `struct sensor` of programs/coil.h.
COIL = np.dtype(
    [(name, "<f8") for name in ("resistance_ohm", "inductance_H", "supply_V", "freewheel_V")]
    + [(name, "<f8") for name in ("period_s", "full_counts", "rated_A")]
    + [(name, "<i4") for name in ("samples", "samples_before", "stuck", "solenoids")],
    align=True,
)
SENSOR = np.dtype([(name, "<f8") for name in ("V_per_A", "offset_V", "codes_per_V", "code_max", "supply_divider")])
#: Coils, from which period on each, and their number; sensor; set points and their number; traces.
COIL_LOOP = Function("coil_loop", ("in", "in", "uint32_t", "in", "in", "uint32_t", "out"))


@dataclass(frozen=True, slots=True, kw_only=True)
class CoilLoop:
    """A controller, its sensor and what the coil is switched by: all but the coil and its supply in one run."""

    loop: CurrentLoop
    circuit: CoilCircuit
    sensor: CurrentSensor
    converter: Converter
    sampling: CurrentSampling

    @classmethod
    def of(cls, compensator: Compensator) -> "CoilLoop | None":
        """Return the loop of a compensator; None of a drive by duty.

        Where nobody wrote down the converter it is an `InputError`.
        """
        drive, target = compensator.current_drive, compensator.target
        if drive is None:
            return None
        if target is None:
            text = "compensator.json names no target, so the converter of the current is not known; design again"
            raise InputError(text)
        return cls(
            loop=drive.loop, circuit=drive.circuit, sensor=drive.sensor, converter=target.converter,
            sampling=drive.sampling,
        )  # fmt: skip

    @property
    def codes_per_V(self) -> float:
        """Codes of the converter for a volt."""
        return self.converter.levels / float(self.converter.full_V)

    @property
    def codes_per_A(self) -> float:
        """Codes of the converter for a current."""
        return self.sensor.V_per_A * self.codes_per_V

    def at(self, *, resistance: float = 1.0, inductance: float = 1.0, supply_V: float | None = None) -> Corner:
        """Return the declared coil times factors, at a supply.

        Without one it is as far from the lowest supply as from the highest, in ratio.
        """
        circuit = self.circuit
        return Corner(
            resistance * circuit.resistance_ohm + circuit.series_ohm,
            inductance * circuit.inductance_H,
            sqrt(circuit.supply_V[0] * circuit.supply_V[1]) if supply_V is None else supply_V,
        )

    def corners(self) -> tuple[Corner, ...]:
        """Return all 27: the least, declared and largest resistance and inductance, both ends and the middle supply."""
        ranges = (self.circuit.resistance_factors, self.circuit.inductance_factors)
        ohms, henries = (sorted({low, min(max(low, 1.0), high), high}) for low, high in ranges)
        supplies = sorted({*self.circuit.supply_V, self.at().supply_V})
        return tuple(
            self.at(resistance=ohm, inductance=henry, supply_V=volts)
            for ohm, henry, volts in product(ohms, henries, supplies)
        )

    def duty(self, corner: Corner, share: float) -> float:
        """Return the duty whose mean voltage, supply by turns with the diode's drop, holds a share of rated current."""
        # duty V - (1 - duty) V_f = R i
        freewheel_V = self.circuit.freewheel_V
        return (corner.resistance_ohm * share * self.circuit.rated_A + freewheel_V) / (corner.supply_V + freewheel_V)

    def carries(self, corner: Corner, share: float) -> bool:
        """Tell whether a supply can hold so much of the rated current."""
        return self.duty(corner, share) < self.loop.compare_limit / self.loop.full_counts

    def correction(self, supply_V: float) -> float:
        """Return by what the controller's output is multiplied at a supply: 1 where it is not measured."""
        supply = self.loop.supply
        if supply is None:
            return 1.0
        codes = supply_V * self.sensor.supply_divider * self.codes_per_V
        at = supply.valid_codes[0] + supply.step_codes * np.arange(len(supply.nodes))
        return float(np.interp(np.clip(codes, *supply.valid_codes), at, supply.nodes)) / (1 << CORRECTION_SHIFT)

    def with_offset(self, codes: float) -> "CoilLoop":
        """Return it with a sensor whose zero is off by so many codes."""
        moved_V = self.sensor.offset_V + codes * float(self.converter.full_V) / self.converter.levels
        return replace(self, sensor=replace(self.sensor, offset_V=moved_V))

    def coil_struct(self, corner: Corner, *, stuck: bool = False, solenoids: int = BOTH) -> np.ndarray:
        """Return a coil at a supply as the C code takes it; of one that is stuck the switch stays on."""
        sampling = self.sampling
        values = (
            *corner, self.circuit.freewheel_V, sampling.period_s, self.loop.full_counts, self.circuit.rated_A,
            sampling.samples, sampling.before, stuck, solenoids,
        )  # fmt: skip
        return np.array([values], dtype=COIL)

    def sensor_struct(self) -> np.ndarray:
        """Return the sensor as the C code takes it."""
        sensor = self.sensor
        values = (
            sensor.V_per_A, sensor.offset_V, self.codes_per_V, self.converter.code_max, sensor.supply_divider,
        )  # fmt: skip
        return np.array([values], dtype=SENSOR)


def least_rise_s(corner: Corner, start_A: float, end_A: float) -> float:
    """Return the time from one current to another with the switch on; endless where it does not get there."""
    ends_A = corner.supply_V / corner.resistance_ohm
    if ends_A <= end_A:
        return inf
    return log((ends_A - start_A) / (ends_A - end_A)) * corner.inductance_H / corner.resistance_ohm


class Change(NamedTuple):
    """Another coil from a period on, whose switch may stay on; a bit for each solenoid that has it, A's first."""

    period: int
    corner: Corner
    stuck: bool = False
    solenoids: int = BOTH


class CoilSimulation:
    """A controller in C in a loop with any coil."""

    def __init__(self, around: CoilLoop, core: Mapping[str, str]) -> None:
        self.around = around
        names = ("coil.h", "coil_loop.c", "coil_loop.h")
        sources = {name: (PROGRAMS / name).read_text("utf-8") for name in names}
        self._library = CompiledLibrary(
            sources | dict(core) | {"tick.h": tick_macro(around.loop)}, [COIL_LOOP], "the coil's loop"
        )

    def run(
        self,
        corner: Corner,
        set_points: Sequence[int] | np.ndarray,
        changes: Sequence[Change] = (),
        around: CoilLoop | None = None,
    ) -> np.ndarray:
        """Run from no current, calibrated, over a set point for each period; return a `TRACE` of each.

        Of two solenoids it is that of A, or there are two columns. `around` may have another sensor.
        """
        around = around or self.around
        asked = np.asarray(set_points, dtype=np.uint16)
        if asked.ndim == 1:
            asked = np.stack([asked, np.zeros_like(asked)], axis=1)
        asked = np.ascontiguousarray(asked)
        found = np.zeros(len(asked), dtype=TRACE)
        coils = [
            around.coil_struct(each.corner, stuck=each.stuck, solenoids=each.solenoids)
            for each in (Change(0, corner), *changes)
        ]
        begins = np.array([0, *(each.period for each in changes)], dtype=np.uint32)
        self._library.call(
            "coil_loop", np.concatenate(coils), begins, len(coils), around.sensor_struct(), asked, len(asked), found
        )
        return found


def coil_sources(coil: CoilLoop | None) -> dict[str, str]:
    """Return what plant_period.h includes: the coil, or what stands in for it where the drive is by duty."""
    if coil is None:
        return {"coil.h": (PROGRAMS / "no_coil.h").read_text(encoding="utf-8")}
    return {"coil.h": (PROGRAMS / "coil.h").read_text(encoding="utf-8"), "tick.h": tick_macro(coil.loop)}
