"""The calibration block, stated once: the C header, packing, unpacking and the table in the docs come from here.

A block is a sequence of 16-bit words, as the C28x has them; in a file each word is two octets, the low one first.
Numbers of 32 and 64 bits begin at even words, their low word first, so that no compiler pads the C struct. The last two
words are the CRC-32 (of zlib) of the octets before them.
"""

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, NamedTuple

from dzdesign.design.signals import INPUT_NAMES, POSITIVE_PAIR

#: Octets of `magic` in a file, and the version of this layout.
MAGIC, LAYOUT = b"DZC1", 1
#: Nodes of beta that a side of a block has room for, the two of the fallback behind those of the table; the core masks
#: a node's number, and pressures that can't be right give the mask itself.
NODES, NODE_MASK = 129, 127
#: Nodes of the play's width, and of the supply's correction.
PLAY_NODES, PLAY_MASK = 17, 15
SUPPLY_NODES, SUPPLY_MASK = 65, 63
SHA256_WORDS, SERIAL_WORDS, RECORD_WORDS = 16, 12, 24
#: What the firmware was compiled for, bit by bit: its wiring and outputs.
SHAPE_BITS = {
    "BIPOLAR": "two solenoids: a command of both signs",
    "FALLING": "codes of the command fall towards full positive command",
    "AHEAD_B": "pressure B is ahead at negative commands, and not A",
    "AHEAD_C": "pressure C is ahead at negative commands, and not A",
    "BEHIND_A": "pressure A is behind at negative commands, and not B",
    "BEHIND_C": "pressure C is behind at negative commands, and not B",
    "CURRENT": "the drive's output is the set point of a current",
    "SUPPLY": "the supply's voltage is measured",
    "SHUNTS": "each of two solenoids has a shunt",
}
#: `interlock` where the drive waits for no zero command.
NO_INTERLOCK = 0xFFFF
#: A ramp's step where there is no limit: more than any change of the command.
NO_RAMP = 2**31 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """One entry of the layout: bits of a number (16, 32 or 64), how many of them, what they are, and where from."""

    bits: int = 16
    count: int = 1
    text: str
    unit: str = ""
    #: True of numbers that stand in pairs: in C an array of `struct dz_calibration_node`.
    pairs: bool = False
    #: Key of compensator.json; empty for what no single key holds.
    key: str = ""
    #: How it was rounded.
    rounding: str = "exact"
    #: Whether only a block has it, to be recognised, checked and displayed: no arithmetic reads it.
    of_block: bool = False
    #: Whether only two solenoids have it.
    of_two: bool = False

    @property
    def words(self) -> int:
        """16-bit words that it takes."""
        return self.bits // 16 * self.count


def _words(text: str, unit: str = "", key: str = "", bits: int = 16, *, value: object = MISSING, **more: Any) -> Any:
    """Return the field of an entry; `value` is one that every block has."""
    return field(default=value, metadata={"words": Words(text=text, unit=unit, key=key, bits=bits, **more)})


def _shown(text: str, unit: str = "", key: str = "", bits: int = 16, **more: Any) -> Any:
    """Return the field of an entry that only a block has."""
    return _words(text, unit, key, bits, of_block=True, **more)


_COMMAND, _SENSOR = "signals.command", "signals.pressure_*"
_DRIVE, _LOOP = "drive_functions", "current_drive.loop"
_WEIGHTED = "1/4096 code of the sensor ahead"
_CODE = "the converter's code, rounded down"
_POWER = "a power of two"
_NEAREST = "rounded to nearest"


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorBlock:
    """A pressure sensor; all zero where the firmware has none."""

    span_Pa: int = _shown("span, for display", "Pa", f"{_SENSOR}.span_MPa", 32)
    full: int = _shown("code at its span, for display", "codes", f"{_SENSOR}.full_code")
    zero: int = _shown("code at zero pressure", "codes", f"{_SENSOR}.zero_code")
    low: int = _words("lowest valid code", "codes", f"{_SENSOR}.valid_codes", rounding=_CODE)
    high: int = _words("highest valid code", "codes", f"{_SENSOR}.valid_codes", rounding=_CODE)


@dataclass(frozen=True, slots=True, kw_only=True)
class SideBlock:
    """The law of one sign of command, and what of the drive functions differs between the signs."""

    nodes: tuple[int, ...] = _words(
        "for each node beta that the law follows, then the certified beta at zero command; a node every beta_step "
        "codes from no pressure drop on, and the last two the smallest of all, used where the pressures can't be right",
        "1/beta_unit", "sides.*.beta", 32, count=2 * NODES, pairs=True,
        rounding="nodes rounded down, so that the certificate holds, and not again",
    )  # fmt: skip
    offset: int = _words("coefficient of beta in the sum", "", "sides.*.u_min0_over_u_max", 32)
    slope: int = _words(
        "coefficient of beta times command in the sum, two's complement", "", "sides.*.drive_range_over_u_max", 32
    )
    transition: int = _words(
        "coefficient of (beta - beta at zero command) for each code short of the transition's end", "",
        "transition_codes", 32,
    )  # fmt: skip
    linear: int = _words("coefficient of the command alone in the sum", "", "sides.*.drive_range_over_u_max", 64)
    half: int = _words("half a count in the sum: rounds to nearest", "", "signals.compare_max", 64)
    quotient_limit: int = _words(
        "largest quotient: the one whose compare value is the limit", "", f"{_DRIVE}.compare_limit", 32
    )
    reciprocal: int = _words(
        "factor from the quotient to counts, over 2^(32 + reciprocal_shift)", bits=32,
        rounding="above it, and exact for every quotient up to quotient_limit",
    )  # fmt: skip
    balance: int = _words(
        "difference of the codes at zero pressure: that ahead times 4096 minus that behind times weight, modulo 2^32",
        _WEIGHTED, "signals", 32,
    )  # fmt: skip
    weight: int = _words("weight of a code of the sensor behind", _WEIGHTED, "signals", 32, rounding=_NEAREST)
    tested_to: int = _words(
        "largest tested pressure drop", _WEIGHTED, "sides.*.certificate.dp_MPa", 32,
        rounding="rounded down to a code, with all that is rounded down to that code",
    )  # fmt: skip
    beta_unit: int = _shown("value of beta = 1 in a node, for display", "", "beta_denominator", 32)
    beta_factor: int = _words(
        "factor from interpolated nodes to beta times 2^15, over 2^beta_shift", "", "beta_denominator", 32,
        rounding="rounded up, and proved: beta is shown rounded down",
    )  # fmt: skip
    ramp_up: int = _words(
        "largest change of the command per sample, away from zero", "1/65536 code", f"{_DRIVE}.ramp_up", 32,
        rounding="rounded to nearest, 1 or more",
    )  # fmt: skip
    ramp_down: int = _words(
        "largest change of the command per sample, towards zero", "1/65536 code", f"{_DRIVE}.ramp_down", 32,
        rounding="rounded to nearest, 1 or more",
    )  # fmt: skip
    node_count: int = _shown("nodes of the table in use")
    reciprocal_shift: int = _words("right shift after the product with reciprocal, beyond 32")
    beta_shift: int = _words("right shift after the product with beta_factor")
    span: int = _words("codes from zero to full command", "codes", _COMMAND)
    room: int = _words("codes from the zero band's end to full command", "codes", _COMMAND)
    band_end: int = _words("code at the zero band's end", "codes", "zero_band_codes")
    play: tuple[int, ...] = _words(
        "width of the inverse play every 2^play_step_shift codes of command from zero on", "counts",
        f"{_DRIVE}.play_counts", count=PLAY_NODES, rounding=_NEAREST,
    )  # fmt: skip
    spare: int = _shown("0", value=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentBlock:
    """The current controller; all zero where the firmware has none."""

    integral_limit: int = _words(
        "largest magnitude of the integral", "counts / 2^gain_shift", f"{_LOOP}.integral_limit", 32
    )
    release: int = _words("output below the integral by", "counts / 2^gain_shift", f"{_LOOP}.release", 32)
    compare_limit: int = _words("largest compare value", "counts", f"{_LOOP}.compare_limit")
    rate: int = _words("largest change of the set point per PWM period", "counts", f"{_LOOP}.rate")
    samples: int = _shown("samples of the current in a sum", "", f"{_LOOP}.samples")
    current_gain: int = _words(
        "counts of current per code of the sum, times 2^current_shift", "", f"{_LOOP}.current_gain"
    )
    current_shift: int = _words("fractional bits of current_gain", "", f"{_LOOP}.current_shift")
    gain_shift: int = _words("fractional bits of the three gains", "", f"{_LOOP}.gain_shift")
    proportional: int = _words("PWM counts per count of error, times 2^gain_shift", "", f"{_LOOP}.proportional")
    integral: int = _words("PWM counts per count of error and PWM period, times 2^gain_shift", "", f"{_LOOP}.integral")
    feed_forward: int = _words("PWM counts per count of set point, times 2^gain_shift", "", f"{_LOOP}.feed_forward")
    offset_nominal: int = _words("sum without current, as designed", "codes", f"{_LOOP}.offset_nominal")
    offset_low: int = _words("lowest plausible sum without current", "codes", f"{_LOOP}.offset_tolerance")
    offset_high: int = _words("highest plausible sum without current", "codes", f"{_LOOP}.offset_tolerance")
    offset_shift: int = _words("the offset is the mean of 2^offset_shift sums", "", f"{_LOOP}.offset_shift")
    short_sum: int = _words("sum from which the load counts as shorted", "codes", f"{_LOOP}.short_sum")
    over_sum: int = _words("sum minus offset from which the current is too high", "codes", f"{_LOOP}.over_sum")
    over_ticks: int = _words("such PWM periods in a row that are a fault", "", f"{_LOOP}.over_ticks")
    open_sum: int = _words("sum minus offset below which no current flows", "codes", f"{_LOOP}.open_sum")
    open_compare: int = _words("compare value from which current must flow", "counts", f"{_LOOP}.open_compare")
    open_ticks: int = _words("such PWM periods in a row that are a fault", "", f"{_LOOP}.open_ticks")
    supply_low: int = _words("lowest code of the supply", "codes", f"{_LOOP}.supply.valid_codes")
    supply_high: int = _words("highest code of the supply", "codes", f"{_LOOP}.supply.valid_codes")
    supply_shift: int = _words(
        "codes between two nodes of the correction, a power of two", "", f"{_LOOP}.supply.step_codes"
    )
    supply: tuple[int, ...] = _words(
        "nominal over measured supply times 2^14, from supply_low on", "", f"{_LOOP}.supply.nodes", count=SUPPLY_NODES,
        rounding=_NEAREST,
    )  # fmt: skip
    held_ticks: int = _words(
        "PWM periods with a current after the other solenoid was asked for that are a fault; 0 with one solenoid",
        key=f"{_LOOP}.held_ticks", of_two=True,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationBlock:
    """Every number of one valve that its firmware needs, in the order of the block."""

    magic: int = _shown("octets DZC1", bits=32, value=int.from_bytes(MAGIC, "little"))
    layout: int = _shown("version of this layout", value=LAYOUT)
    length: int = _shown("length of the block, CRC included", "words")
    shape: int = _shown("what the firmware must be compiled for")
    code_max: int = _shown("largest code of the converter", "codes", "signals.code_max")
    compare_max: int = _shown("PWM compare value of full drive", "counts", "signals.compare_max")
    sample_Hz: int = _shown("sampling rate", "Hz", "signals.sample_Hz")
    tick_Hz: int = _shown("PWM frequency", "Hz", "signals.tick_Hz")
    reserved: int = _shown("0", value=0)
    compensator_sha256: tuple[int, ...] = _shown("SHA-256 of compensator.json", count=SHA256_WORDS)
    serial: tuple[int, ...] = _shown("serial number, up to 24 octets of UTF-8", count=SERIAL_WORDS)
    record: tuple[int, ...] = _shown("what the valve is filed under, up to 48 octets of UTF-8", count=RECORD_WORDS)
    u_max_uV: int = _shown("full command, for display", "uV", "u_max_V", 32)
    sensors: tuple[SensorBlock, SensorBlock, SensorBlock]
    reverse: int = _words(
        "a pressure drop less than minus this is a failed sensor", _WEIGHTED, "reverse_codes", 32,
        rounding="a hundredth of the span, rounded down to a code",
    )  # fmt: skip
    command_zero: int = _words("code of zero command", "codes", f"{_COMMAND}.zero_code", rounding=_CODE)
    command_low: int = _words("lowest valid code of the command", "codes", f"{_COMMAND}.valid_codes", rounding=_CODE)
    command_high: int = _words("highest valid code of the command", "codes", f"{_COMMAND}.valid_codes", rounding=_CODE)
    beta_step: int = _shown("codes of pressure drop between two nodes of beta", "codes", "beta_step_codes")
    transition_codes: int = _words(
        "codes of command of the transition; 1: none", "codes", "transition_codes", rounding=_POWER
    )
    zero_band: int = _words("codes of command that count as zero", "codes", "zero_band_codes")
    compare_limit: int = _words("largest compare value", "counts", f"{_DRIVE}.compare_limit", rounding="rounded down")
    leave_zero: int = _words(
        "codes beyond which the drive leaves its rest or its side", "codes", f"{_DRIVE}.leave_zero_codes"
    )
    fault_samples: int = _words("valid samples in a row that end a fault", "samples", f"{_DRIVE}.fault_samples")
    fault_latch: int = _words("1: a fault of as many faulty samples stays until a reset", "", f"{_DRIVE}.fault_latch")
    interlock: int = _words(
        "codes up to which a command is the zero command that the drive waits for; 65535: it does not wait", "codes",
        f"{_DRIVE}.interlock_codes",
    )  # fmt: skip
    ramps: int = _words("1: the command is ramped", "", f"{_DRIVE}.ramp_up")
    dither_counts: int = _words("peak of the dither; 0: none", "counts", f"{_DRIVE}.dither_counts", rounding=_NEAREST)
    dither_ticks: int = _words(
        "half the dither's period", "PWM periods", f"{_DRIVE}.dither_ticks", rounding="rounded to nearest, 1 or more"
    )
    play_codes: int = _words(
        "codes of travel from one branch to the other; 0: no inverse play", "codes", f"{_DRIVE}.play_codes",
        rounding=_POWER,
    )  # fmt: skip
    play_noise: int = _words(
        "codes of fluctuation that do not count as a reversal", "codes", f"{_DRIVE}.play_noise_codes"
    )
    play_step_shift: int = _words(
        "codes between two nodes of the play's width, a power of two", "", f"{_DRIVE}.play_step_codes"
    )
    play_shift: int = _words("play_codes times the transition's codes, a power of two", "", "transition_codes")
    sides: tuple[SideBlock, SideBlock]
    current: CurrentBlock
    crc32: int = _shown("CRC-32 of all octets before it, as zlib.crc32", bits=32)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """How long the arrays of a firmware are: those of every block, or what the numbers of one valve take.

    An array has two elements more than the mask of its index, which is all ones.
    """

    sensors: int = len(INPUT_NAMES)
    sides: int = 2
    node_mask: int = NODE_MASK
    play_mask: int = PLAY_MASK
    supply_mask: int = SUPPLY_MASK


#: Of every block.
BLOCK_SIZES = Sizes()


@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltFor:
    """Wiring, outputs, converter and rates: with the target all that the C of the core depends on, but for numbers.

    Of a firmware in block form every block that it takes must be of the same.
    """

    #: Bits of `SHAPE_BITS`.
    shape: int
    code_max: int
    compare_max: int
    sample_Hz: int
    tick_Hz: int
    #: Codes between two nodes of beta, a power of two.
    beta_step: int
    #: Codes of the current in a sum; 0 without current control.
    samples: int
    #: Those of a block, unless the numbers of a valve stand in the firmware.
    sizes: Sizes = BLOCK_SIZES
    #: Whether the numbers of a valve stand in the firmware, `struct dz_calibration` without what only a block has.
    fixed: bool = False

    def has(self, name: str) -> bool:
        """Tell whether the shape has a bit of `SHAPE_BITS`."""
        return bool(self.shape >> list(SHAPE_BITS).index(name) & 1)

    def keeps(self, entry: Words) -> bool:
        """Tell whether the C struct has an entry: every block has each, a firmware with its numbers what it reads."""
        return not self.fixed or not (entry.of_block or (entry.of_two and not self.has("BIPOLAR")))

    def pair(self, sign: int) -> str:
        """Return the names of the pressure inputs ahead and behind, for one sign of command."""
        ahead = next((name for name in "BC" if sign < 0 and self.has(f"AHEAD_{name}")), "A")
        behind = next((name for name in "AC" if sign < 0 and self.has(f"BEHIND_{name}")), "B")
        return ahead + behind

    @property
    def inputs(self) -> str:
        """Names of the pressure inputs."""
        return INPUT_NAMES if "C" in self.pair(-1) else POSITIVE_PAIR


class Member(NamedTuple):
    """One member of the C struct: its name there, the word it begins at, and what it is."""

    path: str
    at: int
    entry: Words


#: Number of elements of the members that are structs themselves, and their types.
INNER = {"sensors": (SensorBlock, len(INPUT_NAMES)), "sides": (SideBlock, 2), "current": (CurrentBlock, 1)}


def entries(block: type) -> dict[str, Words]:
    """Return the entries of a struct that are words, by name."""
    return {each.name: each.metadata["words"] for each in fields(block) if each.name not in INNER}


def words_of(block: type) -> int:
    """Return how many words a struct takes."""
    own = sum(entry.words for entry in entries(block).values())
    inner = [INNER[each.name] for each in fields(block) if each.name in INNER]
    return own + sum(words_of(kind) * count for kind, count in inner)


def members(block: type = CalibrationBlock, path: str = "", at: int = 0) -> Iterator[Member]:
    """Yield every member of the struct in its order."""
    own = entries(block)
    for each in fields(block):
        if each.name in own:
            yield Member(path + each.name, at, own[each.name])
            at += own[each.name].words
            continue
        kind, count = INNER[each.name]
        for index in range(count):
            place = f"{path}{each.name}[{index}]." if count > 1 else f"{path}{each.name}."
            yield from members(kind, place, at)
            at += words_of(kind)


LENGTH_WORDS = words_of(CalibrationBlock)
