"""The controller in C in a loop with a coil, the PWM resolved: programs/coil_loop.c for one corner after another."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CoilCircuit, Corner, CurrentLoop, CurrentSampling, CurrentSensor
from dzdesign.design.target_inputs import Converter
from dzdesign.verify.current.state_check import PROGRAMS, tick_macro
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function

#: `struct trace` of programs/coil_loop.h.
TRACE = np.dtype([("mean_A", "<f8"), ("compare", "<u2"), ("total", "<u2"), ("faults", "<u2"), ("_", "<u2")])


#: `struct coil` and `struct sensor` of programs/coil.h.
COIL = np.dtype(
    [(name, "<f8") for name in ("resistance_ohm", "inductance_H", "supply_V", "freewheel_V")]
    + [(name, "<f8") for name in ("period_s", "full_counts", "rated_A")]
    + [(name, "<i4") for name in ("samples", "samples_before", "stuck")],
    align=True,
)
SENSOR = np.dtype([(name, "<f8") for name in ("V_per_A", "offset_V", "codes_per_V", "code_max", "supply_divider")])
#: Inductance of a plant's coil that keeps the current that it is given: over a period all but 2e-8 of it is left.
HOLDING_H = 1e6
#: Coils, from which period on each, and their number; sensor; set points and their number; traces.
COIL_LOOP = Function("coil_loop", ("in", "in", "uint32_t", "in", "in", "uint32_t", "out"))


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

    def coil_struct(self, corner: Corner, *, stuck: bool = False) -> np.ndarray:
        """Return a coil at a supply as the C code takes it; of one that is stuck the switch stays on."""
        sampling = self.sampling
        values = (
            *corner, self.circuit.freewheel_V, sampling.period_s, self.loop.full_counts, self.circuit.rated_A,
            sampling.samples, sampling.before, stuck,
        )  # fmt: skip
        return np.array([values], dtype=COIL)

    def sensor_struct(self) -> np.ndarray:
        """Return the sensor as the C code takes it."""
        sensor, converter = self.sensor, self.converter
        codes_per_V = converter.levels / float(converter.full_V)
        values = (sensor.V_per_A, sensor.offset_V, codes_per_V, converter.code_max, sensor.supply_divider)
        return np.array([values], dtype=SENSOR)

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
        self._library = CompiledLibrary(
            sources | dict(core) | {"tick.h": tick_macro(around.loop)}, [COIL_LOOP], "the coil's loop"
        )

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
        begins = np.array([0, *(each.period for each in changes)], dtype=np.uint32)
        self._library.call(
            "coil_loop", np.concatenate(coils), begins, len(coils), around.sensor_struct(), asked, len(asked), found
        )
        return Traces(**{name: found[name].copy() for name in ("mean_A", "compare", "total", "faults")})


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
    """Return what plant_period.h includes: the coil, or what stands in for it where the drive is by duty."""
    if coil is None:
        return {"coil.h": (PROGRAMS / "no_coil.h").read_text(encoding="utf-8")}
    coil_h = (PROGRAMS / "coil.h").read_text(encoding="utf-8")
    return {"coil.h": coil_h, "tick.h": tick_macro(coil.around.loop)}
