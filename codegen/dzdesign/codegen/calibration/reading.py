"""`reading_of`: the numbers of a calibration block in V, MPa and s, whatever valve it is of."""

from collections.abc import Iterator
from dataclasses import dataclass

from dzdesign.codegen.calibration.acceptance import refusals
from dzdesign.codegen.calibration.layout import (
    NO_INTERLOCK,
    NO_RAMP,
    SHAPE_BITS,
    BuiltFor,
    CalibrationBlock,
    SensorBlock,
    SideBlock,
)
from dzdesign.codegen.calibration.packing import octets_of, text_of
from dzdesign.core.errors import InputError
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signals import INPUT_NAMES, SIDE_NAMES, WEIGHT_UNIT


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeReading:
    """A node of beta: its pressure drop, beta, and the law's output just above zero and at full command."""

    dp_MPa: float
    beta: float
    beta_at_zero: float
    offset_V: float
    full_V: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SideReading:
    """The law for one sign of the command. A ramp's time covers the whole command; None: no limit."""

    tested_to_MPa: float
    ramp_up_s: float | None
    ramp_down_s: float | None
    play_V: float
    nodes: tuple[NodeReading, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorReading:
    """A sensor: what it spans, its codes without pressure and at the span, and those that count as valid."""

    span_MPa: float
    zero_code: int
    full_code: int
    valid_codes: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandReading:
    """The command: its codes of zero, the largest valid ones, and codes from zero to full, by the sign of command."""

    zero_code: int
    valid_codes: tuple[int, int]
    codes: dict[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveReading:
    """The drive functions; None or 0 if a function is off."""

    output_max_V: float
    zero_band_V: float
    transition_V: float
    leave_zero_V: float
    interlock_V: float | None
    fault_samples: int
    fault_latch: bool
    dither_V: float
    dither_Hz: float | None
    play_travel_V: float
    play_noise_V: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationReading:
    """The content of a calibration block in engineering units."""

    serial: str
    record: str
    compensator_sha256: str
    crc32: str
    layout: int
    length_words: int
    shape: tuple[str, ...]
    u_max_V: float
    code_max: int
    compare_max: int
    sample_Hz: int
    tick_Hz: int
    command: CommandReading
    pressures: dict[str, SensorReading]
    reverse_MPa: float
    drive: DriveReading
    sides: dict[str, SideReading]
    #: Its integers, as they stand in the block: they count in sums of the converter's codes, of no known unit.
    current: dict[str, int | tuple[int, ...]] | None


def reading_of(block: CalibrationBlock, name: str) -> CalibrationReading:
    """Return what a block says.

    Numbers that no firmware accepts are an `InputError` that begins with `name`: in other units they mean nothing.
    """
    built = BuiltFor(
        shape=block.shape, code_max=block.code_max, compare_max=block.compare_max, sample_Hz=block.sample_Hz,
        tick_Hz=block.tick_Hz, beta_step=block.beta_step, samples=block.current.samples,
    )  # fmt: skip
    _refuse_unaccepted(block, built, name)
    scale = _Scale(block, built)
    signs = (1, -1) if block.shape & 1 else (1,)
    of_current = list(SHAPE_BITS).index("CURRENT")
    current = block.current
    return CalibrationReading(
        serial=text_of(block.serial),
        record=text_of(block.record),
        compensator_sha256=octets_of(block.compensator_sha256).hex(),
        crc32=f"{block.crc32:08x}",
        layout=block.layout,
        length_words=block.length,
        shape=tuple(text for place, text in enumerate(SHAPE_BITS.values()) if block.shape >> place & 1),
        u_max_V=scale.full_V,
        code_max=block.code_max,
        compare_max=block.compare_max,
        sample_Hz=block.sample_Hz,
        tick_Hz=block.tick_Hz,
        command=CommandReading(
            zero_code=block.command_zero,
            valid_codes=(block.command_low, block.command_high),
            codes={SIDE_NAMES[sign]: block.sides[sign < 0].span for sign in signs},
        ),
        pressures={name: _sensor(sensor) for name, sensor in zip(built.inputs, block.sensors, strict=False)},
        reverse_MPa=scale.dp_MPa(block.reverse, 1),
        drive=_drive(block, scale),
        sides={SIDE_NAMES[sign]: _side(block, sign, scale) for sign in signs},
        current={each: getattr(current, each) for each in current.__dataclass_fields__}
        if block.shape >> of_current & 1
        else None,
    )


@dataclass(frozen=True, slots=True)
class _Scale:
    """From codes and counts of a block to V and MPa."""

    block: CalibrationBlock
    built: BuiltFor

    @property
    def full_V(self) -> float:
        return self.block.u_max_uV / 1e6

    def output_V(self, counts: int) -> float:
        return counts / self.block.compare_max * self.full_V

    def command_V(self, codes: int) -> float:
        return codes / self.block.sides[0].span * self.full_V

    def dp_MPa(self, weighted: int, sign: int) -> float:
        """Return a pressure drop of weighted codes of the sensor ahead."""
        ahead = self.block.sensors[INPUT_NAMES.index(self.built.pair(sign)[0])]
        return weighted / WEIGHT_UNIT * ahead.span_Pa / 1e6 / (ahead.full - ahead.zero)

    def ramp_s(self, side: SideBlock, step: int) -> float | None:
        if not self.block.ramps or step == NO_RAMP:
            return None
        return side.span * RAMP_UNIT / step / self.block.sample_Hz


def _refuse_unaccepted(block: CalibrationBlock, built: BuiltFor, name: str) -> None:
    """Refuse numbers that the firmware of no compensator accepts."""
    wrong = [
        what
        for what, holds in {
            "shape": not block.shape >> len(SHAPE_BITS),
            "rates and counts": min(block.sample_Hz, block.tick_Hz, block.compare_max, block.code_max) > 0,
            "step of beta": block.beta_step.bit_count() == 1,
            "codes of a sensor at its span": all(
                sensor.full > sensor.zero for _, sensor in zip(built.inputs, block.sensors, strict=False)
            ),
        }.items()
        if not holds
    ]
    if not wrong:
        wrong = [f"{group}: {', '.join(rules)}" for group, rules in refusals(block, built).items()]
    if wrong:
        raise InputError(
            f"{name}: the CRC-32 is right, but no firmware accepts its numbers ({'; '.join(wrong)}); write the block "
            "again with `dzdesign calibration`"
        )


def _sensor(sensor: SensorBlock) -> SensorReading:
    return SensorReading(
        span_MPa=sensor.span_Pa / 1e6,
        zero_code=sensor.zero,
        full_code=sensor.full,
        valid_codes=(sensor.low, sensor.high),
    )


def _drive(block: CalibrationBlock, scale: _Scale) -> DriveReading:
    return DriveReading(
        output_max_V=scale.output_V(block.compare_limit),
        zero_band_V=scale.command_V(block.zero_band),
        transition_V=scale.command_V(block.transition_codes) if block.sides[0].transition else 0.0,
        leave_zero_V=scale.command_V(block.leave_zero),
        interlock_V=None if block.interlock == NO_INTERLOCK else scale.command_V(block.interlock),
        fault_samples=block.fault_samples,
        fault_latch=bool(block.fault_latch),
        dither_V=scale.output_V(block.dither_counts),
        dither_Hz=block.tick_Hz / (2 * block.dither_ticks) if block.dither_counts else None,
        play_travel_V=scale.command_V(block.play_codes),
        play_noise_V=scale.command_V(block.play_noise),
    )


def _side(block: CalibrationBlock, sign: int, scale: _Scale) -> SideReading:
    side = block.sides[sign < 0]
    return SideReading(
        tested_to_MPa=scale.dp_MPa(side.tested_to // WEIGHT_UNIT * WEIGHT_UNIT, sign),
        ramp_up_s=scale.ramp_s(side, side.ramp_up),
        ramp_down_s=scale.ramp_s(side, side.ramp_down),
        play_V=scale.output_V(max(side.play)),
        nodes=tuple(_nodes(block, sign, scale)),
    )


def _nodes(block: CalibrationBlock, sign: int, scale: _Scale) -> Iterator[NodeReading]:
    side = block.sides[sign < 0]
    for node in range(side.node_count):
        law, at_zero = side.nodes[2 * node : 2 * node + 2]
        yield NodeReading(
            dp_MPa=scale.dp_MPa(node * block.beta_step * WEIGHT_UNIT, sign),
            beta=law / side.beta_unit,
            beta_at_zero=at_zero / side.beta_unit,
            offset_V=scale.output_V(counts_at(block, side, node, 0)),
            full_V=scale.output_V(counts_at(block, side, node, side.room)),
        )


def counts_at(block: CalibrationBlock, side: SideBlock, node: int, past: int) -> int:
    """Return the compare value at a node of beta and a command so many codes past the zero band: the law of dz_comp."""
    law, at_zero = (beta * block.beta_step for beta in side.nodes[2 * node : 2 * node + 2])
    missing = max(block.transition_codes - past, 0)
    command = past * block.transition_codes + block.zero_band * (block.transition_codes - missing)
    slope = side.slope - (1 << 32 if side.slope >> 31 else 0)
    total = side.half + command * side.linear + law * (side.offset + slope * command)
    total -= (law - at_zero) * side.transition * missing
    quotient = min(total >> 32, side.quotient_limit)
    return quotient * side.reciprocal >> (32 + side.reciprocal_shift)
