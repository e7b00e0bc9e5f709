"""The compiled core in closed loop with the plant: ramps up and down, the pulse resolved, pressures through the ADC."""

import copy
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signals import SIDE_NAMES, Signals
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.plant_step import numbers_of, step_header
from dzdesign.verify.closed_loop.readings import NO_ERRORS, Channels, ReadingErrors
from dzdesign.verify.closed_loop.stand_in import StandIn
from dzdesign.verify.current.coil_simulation import HOLDING_H, coil_sources, nominal_coil
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import core_sources

#: Periods of the PWM between two records: 100 a second, as in the paper's tests.
PERIODS_PER_RECORD = 25
RECORD_S = PERIODS_PER_RECORD * PWM_PERIOD_S
#: Numbers in a record, as loop.c has them.
RECORDED = (
    "compare", "dp_MPa", "q_L_min", "q_mean_L_min", "q_largest_L_min", "position_m", "code_a", "code_b", "mean_V",
)  # fmt: skip
#: Pressure behind the edge where none is given, as on a bench: what both sensors see beside the drop.
BENCH_BACK_MPA = 1.0
#: Flow at zero command below this is none: the edge is shut, only the last bits of a number remain.
NO_FLOW_L_MIN = 1e-9
#: The command's ramps are longer than the drive's own by this factor.
RAMP_RESERVE = 1.1
#: No contraction to fused products: every processor gives the same digits.
FLOATING = ("-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
#: As loop.c has it: choices, series and channels, plant, coil and sensor; the record.
DZ_LOOP = Function("dz_loop", (*["in"] * 14, "out"))
#: Of a stand-in: choices, supplies, mean positions, plant, recorded characteristic; the flows.
DZ_FLOWS = Function("dz_flows", (*["in"] * 5, "out"))
MODES = ("direct", "compensated", "without beta")


@dataclass(frozen=True, slots=True, kw_only=True)
class RampSequence:
    """Command over time: hold at zero, ramp up, hold at full command, ramp down, hold at zero; all in s."""

    rest: float = 3.0
    ramp: float = 100.0
    top: float = 2.0

    def for_drive(self, loop: "ClosedLoop") -> "RampSequence":
        """Return the sequence with ramps no faster than the drive's own, and a rest for which its interlock waits."""
        return replace(self, ramp=max(self.ramp, loop.slowest_ramp_s), rest=max(self.rest, loop.waits_s))

    def command(self) -> np.ndarray:
        """Return the command as a share of u_max, one value a record."""
        corners = np.cumsum([0, self.rest, self.ramp, self.top, self.ramp, self.rest])
        time = np.arange(0, corners[-1], RECORD_S)
        return np.interp(time, corners, [0, 0, 1, 1, 0, 0])


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopRun:
    """Records of one run, 100 a second unless others were asked for: time in s, command share, compare value, dP in
    MPa, flow in L/min, position of the spool in mm, the codes of sensors A and B that the core read last, mean current
    of the last period in V of command, all (N,).

    Of the flow three: at the record's end; its mean over the record, and its largest there. A dither of 100 Hz or more
    has a whole wave in a record: its mean is what a meter sees, its largest is at the wave's top.
    """

    time: np.ndarray
    command: np.ndarray
    compare: np.ndarray
    dp_MPa: np.ndarray
    q_L_min: np.ndarray
    q_mean_L_min: np.ndarray
    q_largest_L_min: np.ndarray
    position_mm: np.ndarray
    code_a: np.ndarray
    code_b: np.ndarray
    mean_V: np.ndarray


def _waits_s(compensator: Compensator) -> float:
    """Return for how long the drive waits for zero command after a reset, s; 0 without an interlock."""
    functions = compensator.drive_functions
    return 0.0 if functions.interlock_codes is None else functions.fault_samples / compensator.signals.sample_Hz


def _slowest_ramp_s(compensator: Compensator, sign: int) -> float:
    """Return the time that the drive's own ramps take from zero to full command or back, at most; 0: none."""
    functions, signals = compensator.drive_functions, compensator.signals
    units, side = signals.command.span(sign) * RAMP_UNIT, 0 if sign > 0 else 1
    steps = [ramp[side] for ramp in (functions.ramp_up, functions.ramp_down) if ramp[side]]
    return max((units / step / signals.sample_Hz * RAMP_RESERVE for step in steps), default=0.0)


def _recorded_dither(compensator: Compensator | None) -> tuple[int, int] | None:
    """Return the drive's dither where the valve was recorded under it: `design` has seen to it that they are alike."""
    if compensator is None or compensator.valve.dither is None:
        return None
    functions = compensator.drive_functions
    return functions.dither_counts, functions.dither_ticks


class ClosedLoop:
    """One plant and, where given, the core of one firmware folder, compiled into one native loop.

    Without a firmware there is only the direct drive; with one, its compensator gives scalings and ramps. `sign` is
    that of the command that opens the side. `dither` is one about a direct command, counts and PWM periods of half a
    wave; of a compensator that of its valve's recordings.
    """

    def __init__(
        self,
        plant: Plant | StandIn,
        firmware: Path | None = None,
        compensator: Compensator | None = None,
        sign: int = 1,
        dither: tuple[int, int] | None = None,
    ) -> None:
        driver = files(__package__) / "programs"
        sources = {"plant_step.h": step_header()}
        for name in ("loop.c", "plant_period.h", "plant_curve.h", "plant.h"):
            sources[name] = driver.joinpath(name).read_text(encoding="utf-8")
        if firmware is None:
            sources["dz_drive.h"] = driver.joinpath("no_drive.h").read_text(encoding="utf-8")
        elif not (firmware / "core" / "dz_drive.h").is_file():
            raise InputError(f"'{firmware}' has no core/dz_drive.h; give the folder that `dzdesign codegen` made")
        else:
            sources |= core_sources(firmware)
        #: Of a drive by current the coil, at a supply.
        self.coil = nominal_coil(compensator) if firmware and compensator else None
        sources |= coil_sources(self.coil)
        self._library = CompiledLibrary(sources, [DZ_LOOP, DZ_FLOWS], "the closed loop", FLOATING)
        #: Of a valve that was recorded under a dither the drive's own, (counts, PWM periods of half a wave).
        self._dither = dither or _recorded_dither(compensator)
        #: Without a compensator no code is read, and any scaling serves.
        self._signals = compensator.signals if compensator else Signals()
        self._negative = sign < 0
        #: Command, sensor A, sensor B.
        self.channels = Channels(self._signals, sign)
        #: Of the drive's own ramps on this side, from zero to full command or back, s; 0: none.
        self.slowest_ramp_s = _slowest_ramp_s(compensator, sign) if compensator else 0.0
        #: For which an interlock must see zero command, s; 0: none.
        self.waits_s = _waits_s(compensator) if compensator else 0.0
        self._has_core = firmware is not None
        self._side = compensator.valve.sides.get(SIDE_NAMES[sign]) if compensator else None
        #: Added to the plant's drive, V of command.
        self._added_V = 0.0
        #: Times the drive at the plant.
        self.drive = 1.0
        self._take(plant)

    def _take(self, plant: Plant | StandIn) -> None:
        parameters = plant.parameters
        self._plant = numbers_of(parameters)
        #: The same, moved by a given current.
        self._of_current = numbers_of(replace(parameters, L_c_H=HOLDING_H)) if self.coil else self._plant
        #: Of a stand-in its recorded characteristic.
        self._curve = plant.table if isinstance(plant, StandIn) else None
        #: Full command, V.
        self.u_max_V = plant.parameters.u_max_V
        self._stand_in = plant if isinstance(plant, StandIn) else None

    def wave(self) -> tuple[int, int, bool]:
        """Return the wave about a direct command, counts and periods of half of it; whether the plant has it in it.

        A plant of equations feels the dither in time: that of the drive, and about a direct command that of the
        recordings. A stand-in is the recorded flow under the dither: a second one would shrink its hysteresis twice.
        """
        if self._dither is None:
            return 0, 1, False
        return (0, 1, True) if self._stand_in else (*self._dither, False)

    @property
    def is_stand_in(self) -> bool:
        """Whether a recorded characteristic stands in for the plant."""
        return self._stand_in is not None

    @property
    def has_dither(self) -> bool:
        """Whether a direct command has a wave about it."""
        return self.wave()[0] > 0

    def leak_L_min(self, dp_MPa: float) -> float:
        """Return what the valve passes without any drive at a pressure drop: no compensator can stop it."""
        return float(self.run(np.zeros(1), dp_MPa, periods_per_record=1).q_mean_L_min[0])

    def allowed_at_zero_L_min(self, dp_MPa: float) -> float | None:
        """Return the flow that is allowed at zero command at a pressure drop, a leak included; None: none declared."""
        return self._side.zero_flow_at(dp_MPa) if self._side else None

    def unseen_below_L_min(self, dp_MPa: float) -> float | None:
        """Return the flow below which a stand-in's is not known at a pressure drop; None of a plant of equations."""
        return None if self._stand_in is None else self._stand_in.unseen_below_L_min(dp_MPa)

    def with_drive(self, ratio: float) -> "ClosedLoop":
        """Return the same loop with so many times the drive at the plant: another voltage, or another current."""
        other = copy.copy(self)
        other.drive = self.drive * ratio
        other._plant = self._plant.driven(ratio)
        other._of_current = self._of_current.driven(ratio) if self.coil else other._plant
        return other

    def with_added_drive(self, added_V: float) -> "ClosedLoop":
        """Return the same loop with so much added to the plant's drive, V of command."""
        other = copy.copy(self)
        other._added_V = added_V
        return other

    @property
    def span_MPa(self) -> float:
        """The largest pressure that both sensors span."""
        return float(self.channels.spans[1:].min())

    def back_within_span(self, back_MPa: float, dp_MPa: float) -> float:
        """Return a pressure behind the edge, or the largest that leaves a pressure drop within the sensors' spans."""
        if dp_MPa > self.span_MPa:
            raise InputError(f"a pressure drop of {dp_MPa:g} MPa exceeds the sensors' span of {self.span_MPa:g} MPa")
        return min(back_MPa, self.span_MPa - dp_MPa)

    def with_plant(self, plant: Plant | StandIn) -> "ClosedLoop":
        """Return the same loop with another plant; nothing is compiled again."""
        other = copy.copy(self)
        other._take(plant)
        return other

    def with_coil(
        self, *, resistance: float = 1.0, inductance: float = 1.0, supply_V: float | None = None
    ) -> "ClosedLoop":
        """Return the same loop with another coil or supply; nothing is compiled again.

        Resistance and inductance are factors of the declared coil's; without a supply it is the nominal one. For a
        drive by current only.
        """
        if self.coil is None:
            raise InputError("this loop's drive is by duty; a coil and its supply belong to one by current")
        other = copy.copy(self)
        other.coil = self.coil.at(resistance=resistance, inductance=inductance, supply_V=supply_V)
        return other

    def step_s(self, dp_MPa: float) -> float:
        """Return the longest step of the plant in runs up to a pressure drop, s."""
        return self._plant.step_s(dp_MPa)

    def flow_at(self, position_mm: np.ndarray, supply_MPa: np.ndarray) -> np.ndarray:
        """Return the flow of a stand-in at its mean positions in one period after another, L/min, (N,)."""
        flows = np.empty(position_mm.size)
        size, position_m = np.array([flows.size], dtype=np.int32), 1e-3 * position_mm
        self._library.call("dz_flows", size, supply_MPa, position_m, self._plant.flat, self._curve, flows)
        return flows

    @property
    def controls_current(self) -> bool:
        """Whether the law's output is the set point of a current, in a coil that `with_coil` may change."""
        return self.coil is not None

    def run(
        self,
        command: np.ndarray,
        supply_MPa: float | np.ndarray,
        mode: str = "direct",
        dp_frozen_MPa: float = 0.0,
        *,
        back_MPa: float | np.ndarray | None = None,
        added_V: float | np.ndarray | None = None,
        shown: np.ndarray | None = None,
        errors: ReadingErrors = NO_ERRORS,
        periods_per_record: int = PERIODS_PER_RECORD,
    ) -> LoopRun:
        """Run the loop from rest, in one of `MODES`.

        `command` (N,) is a share of u_max, one value a record of `periods_per_record` periods of the PWM; `supply_MPa`
        is the pressure drop at no flow and `back_MPa` the pressure behind the edge, (N,) where they change; without one
        that of a bench, as far as the sensors span it. `added_V` is added to the plant's drive, V of command. Of
        sensors that fail `shown` (N, 2) are the codes of A and B; below zero: the plant's own. Pressures above a
        sensor's span read as the converter's largest code. Mode "without beta" shows `dp_frozen_MPa` to the core.
        """
        if mode not in MODES:
            raise ValueError(f"mode is '{mode}', expected one of {', '.join(MODES)}")
        if mode != "direct" and not self._has_core:
            raise InputError("this loop was built without a compensator; give the firmware folder")
        command = np.ascontiguousarray(command, dtype=float)
        if back_MPa is None:
            back_MPa = self.back_within_span(BENCH_BACK_MPA, float(np.max(supply_MPa)))
        supply, back, bias = (
            np.ascontiguousarray(np.broadcast_to(each, command.shape), dtype=float)
            for each in (supply_MPa, back_MPa, self._added_V if added_V is None else added_V)
        )
        if mode == "without beta":
            shown = self.channels.pressure_codes(dp_frozen_MPa, back)
        codes = np.full((command.size, 2), -1) if shown is None else shown
        record = np.empty((command.size, len(RECORDED)))
        channels, coil = self.channels, self.coil if mode != "direct" else None
        signals, plant, negative = self._signals, self._of_current if coil else self._plant, self._negative
        choices = (
            command.size, periods_per_record, mode != "direct", negative, channels.swapped, *self.wave(),
            signals.code_max, signals.compare_max, errors.seed,
        )  # fmt: skip
        series = (
            np.array(choices, dtype=np.int32), command, supply, back, bias, np.ascontiguousarray(codes, dtype=np.int32),
            channels.zeros, channels.fulls, channels.spans, errors.table,
            plant.up_to(float(supply.max())), self._curve,
        )  # fmt: skip
        self._library.call("dz_loop", *series, *(coil.structs() if coil else (None, None)), record)
        recorded = dict(zip(RECORDED, record.T, strict=True))
        time = np.arange(command.size) * periods_per_record * PWM_PERIOD_S
        return LoopRun(time=time, command=command, position_mm=1e3 * recorded.pop("position_m"), **recorded)
