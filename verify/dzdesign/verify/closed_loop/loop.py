"""The compiled core in closed loop with the plant: ramps up and down, the pulse resolved, pressures through the ADC."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from math import ceil
from pathlib import Path

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant, numbers_of, step_header
from dzdesign.verify.closed_loop.stand_in import StandIn
from dzdesign.verify.current.coil import CoilLoop, coil_sources
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import core_sources

#: Periods of the PWM between two records: 100 a second, as in the paper's tests.
PERIODS_PER_RECORD = 25
RECORD_S = PERIODS_PER_RECORD * PWM_PERIOD_S
#: Numbers in a record, as loop.c has them.
RECORDED = (
    "compare", "dp_MPa", "q_L_min", "q_mean_L_min", "q_largest_L_min", "position_m", "code_ahead", "code_behind",
    "mean_V",
)  # fmt: skip
#: Pressure behind the edge where none is given, as on a bench: what both sensors see beside the drop.
BENCH_BACK_MPA = 1.0
#: Flow at zero command below this is none: the edge is shut, only the last bits of a number remain.
NO_FLOW_L_MIN = 1e-9
#: The command's ramps are longer than the drive's own by this factor.
RAMP_RESERVE = 1.1
#: Inductance of a plant's coil that keeps the current that it is given: over a period all but 2e-8 of it is left.
HOLDING_H = 1e6
#: No contraction to fused products: every processor gives the same digits.
FLOATING = ("-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
#: As loop.c has it: choices, series and channels, plant, coil and sensor; the record.
DZ_LOOP = Function("dz_loop", (*["in"] * 14, "out"))
#: Of a position loop: choices, numbers, channels of both signs, plant, both characteristics; the positions.
DZ_POSITION_LOOP = Function("dz_position_loop", (*["in"] * 8, "out"))
#: Parts of a PWM period in which it is advanced, as loop.c has it.
PARTS = 4
#: Of a stand-in: choices, supplies, mean positions, plant, recorded characteristic; the flows.
DZ_FLOWS = Function("dz_flows", (*["in"] * 5, "out"))
MODES = ("direct", "compensated", "without beta")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingErrors:
    """What the converter, and the sensors before it, read wrong; of command, sensor ahead and sensor behind, (3,) each.

    The noise is white: whole codes from minus its peak to plus it, drawn again at every sample of the core.
    """

    offset_codes: tuple[float, float, float] = (0.0, 0.0, 0.0)
    #: At the converter's largest code.
    gain_codes: tuple[float, float, float] = (0.0, 0.0, 0.0)
    #: Peak.
    noise_codes: tuple[int, int, int] = (0, 0, 0)
    #: Of the noise.
    seed: int = 1


NO_ERRORS = ReadingErrors()


class Channels:
    """The converter's channels of one sign of command: command, the sensors ahead of its edge and behind it."""

    def __init__(self, signals: Signals, sign: int) -> None:
        command, pair = signals.command, signals.pair(sign)
        sensors = (pair.ahead, pair.behind)
        full = command.zero_code + command.direction(sign) * command.span(sign)
        #: Codes at zero, (3,), and at the span, which is 1, MPa and MPa.
        self.zeros = np.array([command.zero_code, *(sensor.zero_code for sensor in sensors)], dtype=np.int32)
        self.fulls = np.array([full, *(sensor.full_code for sensor in sensors)], dtype=np.int32)
        self.spans = np.array([1.0, *(float(sensor.span_MPa) for sensor in sensors)])
        self.code_max = signals.code_max
        #: Names of the two inputs, and which of A, B and C each is.
        self.names = pair.names
        self.inputs = tuple("ABC".index(name) for name in pair.names)
        #: Code of the input that the side does not read: a pressure in the middle of its span.
        others = [sensor for name, sensor in signals.pressures.items() if name not in pair.names]
        self.other_code = sum((sensor.zero_code + sensor.full_code) // 2 for sensor in others)
        #: Codes for one of what each channel measures; and as a converter rounds: a span of n codes has n + 1 of them.
        self.per_unit = (self.fulls - self.zeros) / self.spans
        self.converted_per_unit = (self.fulls - self.zeros + np.sign(self.fulls - self.zeros)) / self.spans

    def command_of_codes(self, codes: np.ndarray) -> np.ndarray:
        """Return the commands, shares of full, that the converter reads as so many codes from zero, (N,) whole numbers.

        They may lie below zero: then the command is one of the other sign, or none that the signal has.
        """
        zero, full = int(self.zeros[0]), int(self.fulls[0])
        span, way = abs(full - zero), 1 if full > zero else -1
        middle: np.ndarray = (codes + 0.5 * way) / (span + 1)  # of the code: it is rounded down, whichever way it runs
        return middle

    def pressure_codes(self, dp_MPa: float | np.ndarray, back_MPa: float | np.ndarray) -> np.ndarray:
        """Return the codes ahead and behind at a pressure drop and a pressure downstream of the edge, (..., 2)."""
        back = np.asarray(back_MPa, dtype=float)
        ahead = back + dp_MPa
        values = np.stack([ahead, back], axis=-1)
        codes = np.floor(self.zeros[1:] + values * (self.fulls[1:] - self.zeros[1:] + 1) / self.spans[1:])
        whole: np.ndarray = np.clip(codes, 0, self.code_max).astype(np.int32)
        return whole


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
    MPa, flow in L/min, position of the spool in mm, the codes ahead and behind that the core read last, mean current
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
    code_ahead: np.ndarray
    code_behind: np.ndarray
    mean_V: np.ndarray


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
        #: Of a drive by current the coil and what is around it; and how the coil is, in one run.
        self.coil = CoilLoop.of(compensator) if firmware and compensator else None
        self._corner = self.coil.at() if self.coil else None
        sources |= coil_sources(self.coil)
        self._library = CompiledLibrary(sources, [DZ_LOOP, DZ_FLOWS, DZ_POSITION_LOOP], "the closed loop", FLOATING)
        #: Without a compensator no code is read, and any scaling serves.
        self._signals = compensator.signals if compensator else Signals()
        self._negative, self._has_core = sign < 0, firmware is not None
        #: Command, sensor A, sensor B.
        self.channels = Channels(self._signals, sign)
        #: Of a valve that was recorded under a dither the drive's own, (counts, PWM periods of half a wave).
        self._dither = dither
        #: Of the drive's own ramps on this side, from zero to full command or back, s; 0: none. And for which an
        #: interlock must see zero command.
        self.slowest_ramp_s = self.waits_s = 0.0
        self._side: SideModel | None = None
        if compensator:
            self._take_drive(compensator, sign)
        #: Added to the plant's drive, V of command; and times the drive at the plant.
        self.added_V, self.drive = 0.0, 1.0
        self.plant = plant

    def _take_drive(self, compensator: Compensator, sign: int) -> None:
        """Take from the drive what a command must wait for, and the dither of its valve's recordings."""
        functions, signals = compensator.drive_functions, compensator.signals
        if compensator.valve.dither is not None:  # `design` has seen to it that they are alike
            self._dither = self._dither or (functions.dither_counts, functions.dither_ticks)
        units = signals.command.span(sign) * RAMP_UNIT
        steps = [ramp[0 if sign > 0 else 1] for ramp in (functions.ramp_up, functions.ramp_down)]
        ramps_s = [units / step / signals.sample_Hz * RAMP_RESERVE for step in steps if step]
        self.slowest_ramp_s = max(ramps_s, default=0.0)
        if functions.interlock_codes is not None:
            self.waits_s = functions.fault_samples / signals.sample_Hz
        self._side = compensator.valve.sides.get(compensator.valve.side_name(sign))

    def _with(self, **changes: object) -> "ClosedLoop":
        """Return the same loop with other attributes; nothing is compiled again."""
        other = copy.copy(self)
        vars(other).update(changes)
        return other

    def with_plant(self, plant: Plant | StandIn) -> "ClosedLoop":
        """Return the same loop with another plant."""
        return self._with(plant=plant)

    def with_drive(self, ratio: float) -> "ClosedLoop":
        """Return the same loop with so many times the drive at the plant: another voltage, or another current."""
        return self._with(drive=self.drive * ratio)

    def with_added_drive(self, added_V: float) -> "ClosedLoop":
        """Return the same loop with so much added to the plant's drive, V of command."""
        return self._with(added_V=added_V)

    def with_coil(
        self, *, resistance: float = 1.0, inductance: float = 1.0, supply_V: float | None = None
    ) -> "ClosedLoop":
        """Return the same loop with another coil or supply, see `CoilLoop.at`; for a drive by current only."""
        if self.coil is None:
            raise InputError("this loop's drive is by duty; a coil and its supply belong to one by current")
        return self._with(_corner=self.coil.at(resistance=resistance, inductance=inductance, supply_V=supply_V))

    @property
    def u_max_V(self) -> float:
        """Full command, V."""
        return self.plant.parameters.u_max_V

    @property
    def stand_in(self) -> StandIn | None:
        """The recorded characteristic that stands in for the plant, if one does."""
        return self.plant if isinstance(self.plant, StandIn) else None

    @property
    def _curve(self) -> np.ndarray | None:
        """What plant_curve.h reads; None: the edge is that of a plant of equations."""
        return None if self.stand_in is None else self.stand_in.table

    @property
    def wave(self) -> tuple[int, int, bool]:
        """The wave about a direct command, counts and periods of half of it; whether the plant has it in it.

        A plant of equations feels the dither in time: that of the drive, and about a direct command that of the
        recordings. A stand-in is the recorded flow under the dither: a second one would shrink its hysteresis twice.
        """
        if self._dither is None:
            return 0, 1, False
        return (0, 1, True) if self.stand_in else (*self._dither, False)

    def leak_L_min(self, dp_MPa: float) -> float:
        """Return what the valve passes without any drive at a pressure drop: no compensator can stop it."""
        return float(self.run(np.zeros(1), dp_MPa, periods_per_record=1).q_mean_L_min[0])

    def allowed_at_zero_L_min(self, dp_MPa: float) -> float | None:
        """Return the flow that is allowed at zero command at a pressure drop, a leak included; None: none declared."""
        return self._side.zero_flow_at(dp_MPa) if self._side else None

    def unseen_below_L_min(self, dp_MPa: float) -> float | None:
        """Return the flow below which a stand-in's is not known at a pressure drop; None of a plant of equations."""
        return None if self.stand_in is None else self.stand_in.unseen_below_L_min(dp_MPa)

    @property
    def span_MPa(self) -> float:
        """The largest pressure that both sensors span."""
        return float(self.channels.spans[1:].min())

    def back_within_span(self, back_MPa: float, dp_MPa: float) -> float:
        """Return a pressure behind the edge, or the largest that leaves a pressure drop within the sensors' spans."""
        if dp_MPa > self.span_MPa:
            raise InputError(f"a pressure drop of {dp_MPa:g} MPa exceeds the sensors' span of {self.span_MPa:g} MPa")
        return min(back_MPa, self.span_MPa - dp_MPa)

    def flow_at(self, position_mm: np.ndarray, supply_MPa: np.ndarray) -> np.ndarray:
        """Return the flow of a stand-in at its mean positions in one period after another, L/min, (N,)."""
        flows, plant = np.empty(position_mm.size), numbers_of(self.plant.parameters, float(supply_MPa.max()))
        size = np.array([flows.size], dtype=np.int32)
        self._library.call("dz_flows", size, supply_MPa, 1e-3 * position_mm, plant, self._curve, flows)
        return flows

    def release(
        self, negative: "ClosedLoop", valves: Sequence[StandIn], samples: int, numbers: Sequence[float], dp_MPa: float
    ) -> np.ndarray:
        """Return the positions of a piston that a loop around both sides brings to zero, (samples,).

        `negative` is the loop of negative commands of the same firmware, `valves` are both sides, positive first, and
        `numbers` as loop.c has them: where the piston is let go and its `struct axis`.
        """
        channels, compare_max = (self.channels, negative.channels), self._signals.compare_max
        waits = ceil(self.waits_s * self._signals.sample_Hz) + 1
        choices = [samples, waits, compare_max, self._signals.code_max, self.wave[2]]
        for each in channels:
            choices += [*each.inputs, each.other_code]
        zeros, fulls, spans = (
            np.concatenate([getattr(each, name) for each in channels]) for name in ("zeros", "fulls", "spans")
        )
        back_MPa = self.back_within_span(BENCH_BACK_MPA, dp_MPa)
        plant, position = numbers_of(valves[0].parameters, dp_MPa), np.empty(samples)
        self._library.call(
            "dz_position_loop", np.array(choices, dtype=np.int32), np.array([*numbers, back_MPa, dp_MPa]), zeros, fulls,
            spans, plant, valves[0].table, valves[1].table, position,
        )  # fmt: skip
        return position

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
        sensors that fail `shown` (N, 2) are the codes ahead and behind; below zero: the plant's own. Pressures above a
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
            for each in (supply_MPa, back_MPa, self.added_V if added_V is None else added_V)
        )
        if mode == "without beta":
            shown = self.channels.pressure_codes(dp_frozen_MPa, back)
        codes = np.full((command.size, 2), -1) if shown is None else shown
        record = np.empty((command.size, len(RECORDED)))
        channels, coil, plant = self.channels, self.coil if mode != "direct" else None, self.plant.parameters
        structs: tuple[np.ndarray | None, ...] = (None, None)
        if coil and self._corner:  # the plant's own holds the current that it is given
            plant = replace(plant, L_c_H=HOLDING_H)
            structs = (coil.coil_struct(self._corner), coil.sensor_struct())
        choices = (
            command.size, periods_per_record, mode != "direct", self._negative, *channels.inputs, channels.other_code,
            *self.wave, channels.code_max, self._signals.compare_max, errors.seed,
        )  # fmt: skip
        of_channels = np.array([errors.offset_codes, errors.gain_codes, errors.noise_codes], dtype=float).T.copy()
        self._library.call(
            "dz_loop", np.array(choices, dtype=np.int32), command, supply, back, bias,
            np.ascontiguousarray(codes, dtype=np.int32), channels.zeros, channels.fulls, channels.spans, of_channels,
            numbers_of(plant, float(supply.max()), self.drive), self._curve, *structs, record,
        )  # fmt: skip
        recorded = dict(zip(RECORDED, record.T, strict=True))
        time = np.arange(command.size) * periods_per_record * PWM_PERIOD_S
        return LoopRun(time=time, command=command, position_mm=1e3 * recorded.pop("position_m"), **recorded)
