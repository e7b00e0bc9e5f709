"""The controller in C in a loop with a coil, the PWM resolved: programs/coil_loop.c for one corner after another."""

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.design.current.choosing import CurrentSensor
from dzdesign.design.current.circuit import CoilCircuit, Corner, CurrentSampling
from dzdesign.design.current.loop import CurrentLoop
from dzdesign.design.target_inputs import Converter
from dzdesign.verify.current.state_check import PROGRAMS, tick_macro
from dzdesign.verify.toolchain.host_compiler import load_library

#: `struct trace` of programs/coil_loop.h.
TRACE = np.dtype([("mean_A", "<f8"), ("compare", "<u2"), ("total", "<u2"), ("_", "<u2", 2)])


class _Coil(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_double) for name in ("resistance_ohm", "inductance_H", "supply_V", "freewheel_V", "start_A")),
        *((name, ctypes.c_double) for name in ("period_s", "full_counts")),
        *((name, ctypes.c_int32) for name in ("samples", "samples_before")),
    ]


class _Sensor(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_double) for name in ("V_per_A", "offset_V", "codes_per_V", "code_max", "supply_divider")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Traces:
    """What a loop did: an entry for each period of the PWM."""

    set_points: np.ndarray
    #: Mean current over the period, A.
    mean_A: np.ndarray
    #: Compare value in it.
    compare: np.ndarray
    #: Sum of codes that its interrupt was given.
    total: np.ndarray
    faults: int


class CoilSimulation:
    """A controller in a loop with any coil."""

    def __init__(
        self,
        loop: CurrentLoop,
        core: Mapping[str, str],
        circuit: CoilCircuit,
        sensor: CurrentSensor,
        converter: Converter,
        sampling: CurrentSampling,
    ) -> None:
        self.loop, self.circuit, self.sampling = loop, circuit, sampling
        self._sensor = _Sensor(
            sensor.V_per_A,
            sensor.offset_V,
            converter.levels / float(converter.full_V),
            converter.code_max,
            sensor.supply_divider,
        )
        sources = {name: (PROGRAMS / name).read_text("utf-8") for name in ("coil_loop.c", "coil_loop.h")}
        own = {name: core[name] for name in ("dz_current.c", "dz_current.h")}
        self._library = load_library(sources | own | {"tick.h": tick_macro(loop)}, "the coil's loop")
        self._library.coil_loop.restype = ctypes.c_int32

    def run(self, corner: Corner, set_points: Sequence[int] | np.ndarray) -> Traces:
        """Run from no current, calibrated, over a set point for each period."""
        asked = np.ascontiguousarray(set_points, dtype=np.uint16)
        found = np.zeros(len(asked), dtype=TRACE)
        coil = _Coil(
            *corner,
            self.circuit.freewheel_V,
            0.0,
            self.sampling.period_s,
            self.loop.full_counts,
            self.sampling.samples,
            self.sampling.before,
        )
        faults = self._library.coil_loop(
            ctypes.byref(coil),
            ctypes.byref(self._sensor),
            asked.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_uint32(len(asked)),
            found.ctypes.data_as(ctypes.c_void_p),
        )
        return Traces(
            set_points=asked,
            mean_A=found["mean_A"].copy(),
            compare=found["compare"].copy(),
            total=found["total"].copy(),
            faults=faults,
        )
