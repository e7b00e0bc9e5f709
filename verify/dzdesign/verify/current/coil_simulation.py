"""The controller in C in a loop with a coil, the PWM resolved: programs/coil_loop.c for one corner after another."""

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.design.current.choosing import CurrentSensor
from dzdesign.design.current.circuit import CoilCircuit, Corner, CurrentSampling
from dzdesign.design.current.loop import CurrentLoop
from dzdesign.design.target_inputs import Converter
from dzdesign.verify.current.state_check import PROGRAMS, tick_macro
from dzdesign.verify.toolchain.host_compiler import load_library

#: `struct trace` of programs/coil_loop.h.
TRACE = np.dtype([("mean_A", "<f8"), ("compare", "<u2"), ("total", "<u2"), ("faults", "<u2"), ("_", "<u2")])


class CoilStruct(ctypes.Structure):
    """`struct coil` of programs/coil.h."""

    _fields_ = [
        *((name, ctypes.c_double) for name in ("resistance_ohm", "inductance_H", "supply_V", "freewheel_V")),
        *((name, ctypes.c_double) for name in ("period_s", "full_counts", "rated_A")),
        *((name, ctypes.c_int32) for name in ("samples", "samples_before", "stuck")),
    ]


class SensorStruct(ctypes.Structure):
    """`struct sensor` of programs/coil.h."""

    _fields_ = [
        (name, ctypes.c_double) for name in ("V_per_A", "offset_V", "codes_per_V", "code_max", "supply_divider")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class CoilLoop:
    """A controller, its sensor and what the coil is switched by: all but the coil and its supply."""

    loop: CurrentLoop
    circuit: CoilCircuit
    sensor: CurrentSensor
    converter: Converter
    sampling: CurrentSampling

    @property
    def codes_per_A(self) -> float:
        """Codes of the converter for a current."""
        return self.sensor.V_per_A * self.converter.levels / float(self.converter.full_V)

    def coil_struct(self, corner: Corner, *, stuck: bool = False) -> CoilStruct:
        """Return a coil at a supply as the C takes it; of one that is stuck the switch stays on."""
        sampling = self.sampling
        return CoilStruct(
            *corner,
            self.circuit.freewheel_V,
            sampling.period_s,
            self.loop.full_counts,
            self.circuit.rated_A,
            sampling.samples,
            sampling.before,
            stuck,
        )

    def sensor_struct(self) -> SensorStruct:
        """Return the sensor as the C takes it."""
        sensor, converter = self.sensor, self.converter
        codes_per_V = converter.levels / float(converter.full_V)
        return SensorStruct(sensor.V_per_A, sensor.offset_V, codes_per_V, converter.code_max, sensor.supply_divider)

    def with_offset(self, codes: float) -> "CoilLoop":
        """Return it with a sensor whose zero is off by so many codes."""
        moved_V = self.sensor.offset_V + codes * float(self.converter.full_V) / self.converter.levels
        return replace(self, sensor=replace(self.sensor, offset_V=moved_V))


def coil_loop_of(compensator: Compensator) -> CoilLoop | None:
    """Return the loop of a compensator; None of a drive by duty, or where nobody wrote down the converter."""
    drive, target = compensator.current_drive, compensator.target
    if drive is None or target is None:
        return None
    return CoilLoop(
        loop=drive.loop,
        circuit=drive.circuit,
        sensor=drive.sensor,
        converter=target.converter,
        sampling=drive.sampling,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Traces:
    """What a loop did: an entry for each period of the PWM."""

    #: Mean current over the period, A.
    mean_A: np.ndarray
    #: Compare value in it.
    compare: np.ndarray
    #: Sum of codes that its interrupt was given.
    total: np.ndarray
    #: Bits of the faults after it.
    faults: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Another coil from a period on."""

    period: int
    corner: Corner
    #: Its switch stays on.
    stuck: bool = False


class CoilSimulation:
    """A controller in C in a loop with any coil."""

    def __init__(self, around: CoilLoop, core: Mapping[str, str]) -> None:
        self.around = around
        names = ("coil.h", "coil_loop.c", "coil_loop.h")
        sources = {name: (PROGRAMS / name).read_text("utf-8") for name in names}
        own = {name: core[name] for name in ("dz_current.c", "dz_current.h")}
        self._library = load_library(sources | own | {"tick.h": tick_macro(around.loop)}, "the coil's loop")

    def run(
        self,
        corner: Corner,
        set_points: Sequence[int] | np.ndarray,
        changes: Sequence[Change] = (),
        around: CoilLoop | None = None,
    ) -> Traces:
        """Run from no current, calibrated, over a set point for each period; `around` may have another sensor."""
        around = around or self.around
        asked = np.ascontiguousarray(set_points, dtype=np.uint16)
        found = np.zeros(len(asked), dtype=TRACE)
        coils = [around.coil_struct(corner), *(around.coil_struct(each.corner, stuck=each.stuck) for each in changes)]
        self._library.coil_loop(
            (CoilStruct * len(coils))(*coils),
            (ctypes.c_uint32 * len(coils))(0, *(each.period for each in changes)),
            ctypes.c_uint32(len(coils)),
            ctypes.byref(around.sensor_struct()),
            asked.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_uint32(len(asked)),
            found.ctypes.data_as(ctypes.c_void_p),
        )
        return Traces(**{name: found[name].copy() for name in ("mean_A", "compare", "total", "faults")})
