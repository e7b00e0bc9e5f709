"""The calibration block, stated once: the C header, packing, unpacking and the table in the docs come from here.

A block is a sequence of 16-bit words, as the C28x has them; in a file each word is two octets, the low one first.
Numbers of 32 and 64 bits begin at even words, their low word first, so that no compiler pads the C struct. The last two
words are the CRC-32 (of zlib) of the octets before them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Annotated, NamedTuple, get_type_hints

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
    "SWAPPED": "the pressure drop of negative commands is B less A",
    "CURRENT": "the drive's output is the set point of a current",
    "SUPPLY": "the supply's voltage is measured",
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

    @property
    def words(self) -> int:
        """16-bit words that it takes."""
        return self.bits // 16 * self.count


def _one(
    text: str, unit: str = "", key: str = "", bits: int = 16, rounding: str = "exact", *, of_block: bool = False
) -> Words:
    return Words(text=text, unit=unit, key=key, bits=bits, rounding=rounding, of_block=of_block)


#: Rounding of a converter's code, and of numbers that are powers of two.
_CODE, _POWER = "the converter's code, rounded down", "a power of two"


@dataclass(frozen=True, slots=True, kw_only=True)
class SideBlock:
    """The law of one sign of command, and what of the drive functions differs between the signs."""

    nodes: Annotated[
        tuple[int, ...],
        Words(bits=32, count=2 * NODES, pairs=True, text="for each node beta that the law follows, then the "
              "certified beta at zero command; a node every beta_step codes from no pressure drop on, and the last two "
              "the smallest of all, used where the pressures can't be right", unit="1/beta_unit", key="sides.*.beta",
              rounding="nodes rounded down, so that the certificate holds, and not again"),
    ]
    offset: Annotated[int, _one("coefficient of beta in the sum", key="sides.*.u_min0_over_u_max", bits=32)]
    slope: Annotated[
        int, _one("coefficient of beta times command in the sum, two's complement",
                  key="sides.*.drive_range_over_u_max", bits=32)
    ]
    transition: Annotated[
        int, _one("coefficient of (beta - beta at zero command) for each code short of the transition's end",
                  key="transition_codes", bits=32)
    ]
    linear: Annotated[
        int, _one("coefficient of the command alone in the sum", key="sides.*.drive_range_over_u_max", bits=64)
    ]
    half: Annotated[int, _one("half a count in the sum: rounds to nearest", key="signals.compare_max", bits=64)]
    quotient_limit: Annotated[
        int, _one("largest quotient: the one whose compare value is the limit", key="drive_functions.compare_limit",
                  bits=32)
    ]
    reciprocal: Annotated[
        int, _one("factor from the quotient to counts, over 2^(32 + reciprocal_shift)", bits=32,
                  rounding="above it, and exact for every quotient up to quotient_limit")
    ]
    tested_to: Annotated[
        int, _one("largest tested pressure drop", "1/4096 code of A", "sides.*.certificate.dp_MPa", 32,
                  "rounded down to a code, with all that is rounded down to that code")
    ]
    beta_unit: Annotated[
        int, _one("value of beta = 1 in a node, for display", key="beta_denominator", bits=32, of_block=True)
    ]
    beta_factor: Annotated[
        int, _one("factor from interpolated nodes to beta times 2^15, over 2^beta_shift", key="beta_denominator",
                  bits=32, rounding="rounded up, and proved: beta is shown rounded down")
    ]
    ramp_up: Annotated[
        int,
        _one("largest change of the command per sample, away from zero", "1/65536 code", "drive_functions.ramp_up", 32,
             "rounded to nearest, 1 or more"),
    ]
    ramp_down: Annotated[
        int,
        _one("largest change of the command per sample, towards zero", "1/65536 code", "drive_functions.ramp_down", 32,
             "rounded to nearest, 1 or more"),
    ]
    node_count: Annotated[int, _one("nodes of the table in use", of_block=True)]
    reciprocal_shift: Annotated[int, _one("right shift after the product with reciprocal, beyond 32")]
    beta_shift: Annotated[int, _one("right shift after the product with beta_factor")]
    span: Annotated[int, _one("codes from zero to full command", "codes", "signals.command")]
    room: Annotated[int, _one("codes from the zero band's end to full command", "codes", "signals.command")]
    band_end: Annotated[int, _one("code at the zero band's end", "codes", "zero_band_codes")]
    play: Annotated[
        tuple[int, ...],
        Words(count=PLAY_NODES, text="width of the inverse play every 2^play_step_shift codes of command from zero on",
              unit="counts", key="drive_functions.play_counts", rounding="rounded to nearest"),
    ]
    spare: Annotated[int, _one("0", of_block=True)] = 0  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentBlock:
    """The current controller; all zero where the firmware has none."""

    integral_limit: Annotated[
        int, _one("largest magnitude of the integral", "counts / 2^gain_shift", "current_drive.loop.integral_limit", 32)
    ]
    release: Annotated[
        int, _one("output below the integral by", "counts / 2^gain_shift", "current_drive.loop.release", 32)
    ]
    compare_limit: Annotated[int, _one("largest compare value", "counts", "current_drive.loop.compare_limit")]
    rate: Annotated[int, _one("largest change of the set point per PWM period", "counts", "current_drive.loop.rate")]
    samples: Annotated[int, _one("samples of the current in a sum", key="current_drive.loop.samples", of_block=True)]
    current_gain: Annotated[
        int, _one("counts of current per code of the sum, times 2^current_shift",
                  key="current_drive.loop.current_gain")
    ]
    current_shift: Annotated[
        int, _one("fractional bits of current_gain", key="current_drive.loop.current_shift")
    ]
    gain_shift: Annotated[int, _one("fractional bits of the three gains", key="current_drive.loop.gain_shift")]
    proportional: Annotated[
        int, _one("PWM counts per count of error, times 2^gain_shift", key="current_drive.loop.proportional")
    ]
    integral: Annotated[
        int, _one("PWM counts per count of error and PWM period, times 2^gain_shift", key="current_drive.loop.integral")
    ]
    feed_forward: Annotated[
        int, _one("PWM counts per count of set point, times 2^gain_shift", key="current_drive.loop.feed_forward")
    ]
    offset_nominal: Annotated[
        int, _one("sum without current, as designed", "codes", "current_drive.loop.offset_nominal")
    ]
    offset_low: Annotated[
        int, _one("lowest plausible sum without current", "codes", "current_drive.loop.offset_tolerance")
    ]
    offset_high: Annotated[
        int, _one("highest plausible sum without current", "codes", "current_drive.loop.offset_tolerance")
    ]
    offset_shift: Annotated[
        int, _one("the offset is the mean of 2^offset_shift sums", key="current_drive.loop.offset_shift")
    ]
    short_sum: Annotated[
        int, _one("sum from which the load counts as shorted", "codes", "current_drive.loop.short_sum")
    ]
    over_sum: Annotated[
        int, _one("sum minus offset from which the current is too high", "codes", "current_drive.loop.over_sum")
    ]
    over_ticks: Annotated[int, _one("such PWM periods in a row that are a fault", key="current_drive.loop.over_ticks")]
    open_sum: Annotated[
        int, _one("sum minus offset below which no current flows", "codes", "current_drive.loop.open_sum")
    ]
    open_compare: Annotated[
        int, _one("compare value from which current must flow", "counts", "current_drive.loop.open_compare")
    ]
    open_ticks: Annotated[int, _one("such PWM periods in a row that are a fault", key="current_drive.loop.open_ticks")]
    supply_low: Annotated[
        int, _one("lowest code of the supply", "codes", "current_drive.loop.supply.valid_codes")
    ]
    supply_high: Annotated[
        int, _one("highest code of the supply", "codes", "current_drive.loop.supply.valid_codes")
    ]
    supply_shift: Annotated[
        int, _one("codes between two nodes of the correction, a power of two",
                  key="current_drive.loop.supply.step_codes")
    ]
    supply: Annotated[
        tuple[int, ...],
        Words(count=SUPPLY_NODES, text="nominal over measured supply times 2^14, from supply_low on",
              key="current_drive.loop.supply.nodes", rounding="rounded to nearest"),
    ]  # fmt: skip
    spare: Annotated[int, _one("0", of_block=True)] = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationBlock:
    """Every number of one valve that its firmware needs, in the order of the block."""

    magic: Annotated[int, _one("octets DZC1", bits=32, of_block=True)] = int.from_bytes(MAGIC, "little")
    layout: Annotated[int, _one("version of this layout", of_block=True)] = LAYOUT
    length: Annotated[int, _one("length of the block, CRC included", "words", of_block=True)]
    shape: Annotated[int, _one("what the firmware must be compiled for", of_block=True)]
    code_max: Annotated[int, _one("largest code of the converter", "codes", "signals.code_max", of_block=True)]
    compare_max: Annotated[int, _one("PWM compare value of full drive", "counts", "signals.compare_max", of_block=True)]
    sample_Hz: Annotated[int, _one("sampling rate", "Hz", "signals.sample_Hz", of_block=True)]
    tick_Hz: Annotated[int, _one("PWM frequency", "Hz", "signals.tick_Hz", of_block=True)]
    reserved: Annotated[int, _one("0", of_block=True)] = 0
    compensator_sha256: Annotated[
        tuple[int, ...], Words(count=SHA256_WORDS, text="SHA-256 of compensator.json", of_block=True)
    ]
    serial: Annotated[
        tuple[int, ...], Words(count=SERIAL_WORDS, text="serial number, up to 24 octets of UTF-8", of_block=True)
    ]
    record: Annotated[
        tuple[int, ...],
        Words(count=RECORD_WORDS, text="what the valve is filed under, up to 48 octets of UTF-8", of_block=True),
    ]
    u_max_uV: Annotated[int, _one("full command, for display", "uV", "u_max_V", 32, of_block=True)]
    a_span_Pa: Annotated[
        int, _one("span of sensor A, for display", "Pa", "signals.pressure_a.span_MPa", 32, of_block=True)
    ]
    b_span_Pa: Annotated[
        int, _one("span of sensor B, for display", "Pa", "signals.pressure_b.span_MPa", 32, of_block=True)
    ]
    a_full: Annotated[
        int, _one("code of sensor A at its span, for display", "codes", "signals.pressure_a.full_code", of_block=True)
    ]
    b_full: Annotated[
        int, _one("code of sensor B at its span, for display", "codes", "signals.pressure_b.full_code", of_block=True)
    ]
    balance: Annotated[
        int, _one("difference of the codes at zero pressure: a_zero times 4096 minus b_zero times "
                  "weight_b, modulo 2^32", "1/4096 code of A", "signals.pressure_a.zero_code", 32)
    ]
    reverse: Annotated[
        int, _one("a pressure drop less than minus this is a failed sensor", "1/4096 code of A", "reverse_codes", 32,
                  "a hundredth of the span, rounded down to a code")
    ]
    weight_b: Annotated[
        int, _one("weight of a code of sensor B", "1/4096 code of A", "signals.pressure_b.span_MPa", 32,
                  "rounded to nearest")
    ]
    command_zero: Annotated[
        int, _one("code of zero command", "codes", "signals.command.zero_code", rounding=_CODE)
    ]
    command_low: Annotated[
        int, _one("lowest valid code of the command", "codes", "signals.command.valid_codes", rounding=_CODE)
    ]
    command_high: Annotated[
        int, _one("highest valid code of the command", "codes", "signals.command.valid_codes", rounding=_CODE)
    ]
    a_zero: Annotated[
        int, _one("code at zero pressure, sensor A", "codes", "signals.pressure_a.zero_code", of_block=True)
    ]
    a_low: Annotated[
        int, _one("lowest valid code of sensor A", "codes", "signals.pressure_a.valid_codes", rounding=_CODE)
    ]
    a_high: Annotated[
        int, _one("highest valid code of sensor A", "codes", "signals.pressure_a.valid_codes", rounding=_CODE)
    ]
    b_zero: Annotated[
        int, _one("code at zero pressure, sensor B", "codes", "signals.pressure_b.zero_code", of_block=True)
    ]
    b_low: Annotated[
        int, _one("lowest valid code of sensor B", "codes", "signals.pressure_b.valid_codes", rounding=_CODE)
    ]
    b_high: Annotated[
        int, _one("highest valid code of sensor B", "codes", "signals.pressure_b.valid_codes", rounding=_CODE)
    ]
    beta_step: Annotated[
        int, _one("codes of pressure drop between two nodes of beta", "codes of A", "beta_step_codes", of_block=True)
    ]
    transition_codes: Annotated[
        int, _one("codes of command of the transition; 1: none", "codes", "transition_codes", rounding=_POWER)
    ]
    zero_band: Annotated[int, _one("codes of command that count as zero", "codes", "zero_band_codes")]
    compare_limit: Annotated[
        int, _one("largest compare value", "counts", "drive_functions.compare_limit", rounding="rounded down")
    ]
    leave_zero: Annotated[
        int, _one("codes beyond which the drive leaves its rest or its side", "codes",
                  "drive_functions.leave_zero_codes")
    ]
    fault_samples: Annotated[
        int, _one("valid samples in a row that end a fault", "samples", "drive_functions.fault_samples")
    ]
    fault_latch: Annotated[
        int, _one("1: a fault of as many faulty samples stays until a reset", key="drive_functions.fault_latch")
    ]
    interlock: Annotated[
        int, _one("codes up to which a command is the zero command that the drive waits for; 65535: it does not wait",
                  "codes", "drive_functions.interlock_codes")
    ]
    ramps: Annotated[int, _one("1: the command is ramped", key="drive_functions.ramp_up")]
    dither_counts: Annotated[
        int, _one("peak of the dither; 0: none", "counts", "drive_functions.dither_counts",
                  rounding="rounded to nearest")
    ]
    dither_ticks: Annotated[
        int, _one("half the dither's period", "PWM periods", "drive_functions.dither_ticks",
                  rounding="rounded to nearest, 1 or more")
    ]
    play_codes: Annotated[
        int, _one("codes of travel from one branch to the other; 0: no inverse play", "codes",
                  "drive_functions.play_codes", rounding=_POWER)
    ]
    play_noise: Annotated[
        int, _one("codes of fluctuation that do not count as a reversal", "codes", "drive_functions.play_noise_codes")
    ]
    play_step_shift: Annotated[
        int, _one("codes between two nodes of the play's width, a power of two", key="drive_functions.play_step_codes")
    ]
    play_shift: Annotated[
        int, _one("play_codes times the transition's codes, a power of two", key="transition_codes")
    ]
    sides: tuple[SideBlock, SideBlock]
    current: CurrentBlock
    crc32: Annotated[int, _one("CRC-32 of all octets before it, as zlib.crc32", bits=32, of_block=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """How long the arrays of a firmware are: those of every block, or what the numbers of one valve take.

    An array has two elements more than the mask of its index, which is all ones.
    """

    sides: int = 2
    node_mask: int = NODE_MASK
    play_mask: int = PLAY_MASK
    supply_mask: int = SUPPLY_MASK


#: Of every block.
BLOCK_SIZES = Sizes()


class Member(NamedTuple):
    """One member of the C struct: its name there, the word it begins at, and what it is."""

    path: str
    at: int
    entry: Words


#: Number of elements of the members that are structs themselves, and their types.
INNER = {"sides": (SideBlock, 2), "current": (CurrentBlock, 1)}


def entries(block: type) -> dict[str, Words]:
    """Return the entries of a struct that are words, by name."""
    hints = get_type_hints(block, include_extras=True)
    return {each.name: hints[each.name].__metadata__[0] for each in fields(block) if each.name not in INNER}


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
