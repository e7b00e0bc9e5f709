"""Which blocks a firmware accepts, in integers of any length: what dz_calibration_check() must say of each.

Written from what the arithmetic can handle, not from the C: that differs where 64 bits are few. Every rule is an
inequality of exact integers, so that a test can compare both on any block. The limits of single numbers are those of
the C too.
"""

from collections.abc import Iterator

from dzdesign.codegen.calibration.layout import (
    LAYOUT,
    LENGTH_WORDS,
    MAGIC,
    NO_INTERLOCK,
    BuiltFor,
    CalibrationBlock,
    CurrentBlock,
    SensorBlock,
    SideBlock,
)
from dzdesign.codegen.core.integer_form import INT32_MAX, INT64_MAX
from dzdesign.design.current.circuit import LARGEST_ERROR, LARGEST_GAIN
from dzdesign.design.drive_functions import MOST_FAULT_SAMPLES
from dzdesign.design.signals import INPUT_NAMES, LARGEST_DIFFERENCE, WEIGHT_SHIFT

#: Pressure drop in codes of the sensor ahead times 4096: one more would be a code too many.
LARGEST_DROP = ((LARGEST_DIFFERENCE + 1) << WEIGHT_SHIFT) - 1
#: Above it a difference from it could leave 31 bits.
LARGEST_TESTED = 2**30 - 1
#: Codes of command that the drive functions count with, and ticks of half a dither's wave.
LARGEST_CODES = 32767
LARGEST_PLAY, LARGEST_NOISE, LARGEST_STEP_SHIFT = 32, 4095, 12
LARGEST_GAIN_SHIFT, LARGEST_CURRENT_SHIFT, LARGEST_OFFSET_SHIFT = 13, 15, 12


def largest_node(beta_step: int) -> int:
    """Return the largest node: times the codes between two nodes it stays below 2^31.

    Examples
    --------
    >>> largest_node(64)
    33554431
    """
    return INT32_MAX // beta_step


#: Limits that the C names; each its value, its literal and what it is.
NAMED: tuple[tuple[str, int, str, str], ...] = (
    ("LARGEST_WORD", 2**32 - 1, "uint32", "largest number of 32 bits"),
    ("LARGEST_INT32", INT32_MAX, "uint32", "largest number of 32 bits with a sign"),
    (
        "LARGEST_DROP",
        LARGEST_DROP,
        "uint32",
        "largest pressure drop of valid codes, codes of the sensor ahead times 4096",
    ),
    ("LARGEST_TESTED", LARGEST_TESTED, "uint32", "largest limit of the tested pressure drops, in the same unit"),
    ("LARGEST_CODES", LARGEST_CODES, "plain", "largest count of codes, or of ticks, in 16 bits with a sign"),
    ("LARGEST_PLAY", LARGEST_PLAY, "plain", "most codes of travel between the branches of the play"),
    ("LARGEST_NOISE", LARGEST_NOISE, "plain", "most codes that a command may stray without turning"),
    ("LARGEST_STEP_SHIFT", LARGEST_STEP_SHIFT, "plain", "largest distance of nodes, a power of two"),
    ("MOST_FAULT_SAMPLES", MOST_FAULT_SAMPLES, "plain", "most samples that end a fault"),
    ("NO_INTERLOCK", NO_INTERLOCK, "plain", "the drive waits for no zero command"),
)
#: The same of the current controller.
OF_CURRENT: tuple[tuple[str, int, str, str], ...] = (
    ("LARGEST_GAIN", LARGEST_GAIN, "plain", "largest gain"),
    ("LARGEST_GAIN_SHIFT", LARGEST_GAIN_SHIFT, "plain", "most fractional bits of the gains"),
    ("LARGEST_ERROR", LARGEST_ERROR, "uint32", "largest current that is no short, counts"),
    ("LARGEST_OFFSET_SHIFT", LARGEST_OFFSET_SHIFT, "plain", "most sums that the offset is the mean of, a power of two"),
)
U16 = 0xFFFF
#: Rules of one group: what each is, and whether it holds.
Rules = Iterator[tuple[str, bool]]


def refusals(block: CalibrationBlock, built: BuiltFor) -> dict[str, tuple[str, ...]]:
    """Return what a firmware refuses of a block whose CRC is right: the rules that fail, by group; empty: accepted.

    Law and drive functions count with the codes: of codes out of order they are not judged.
    """
    groups = {
        "FORMAT": _format(block, built),
        "FIRMWARE": _firmware(block, built),
        "SIGNALS": _signals(block, built),
        "LAW": _law(block, built),
        "DRIVE": _drive(block, built),
        "CURRENT": _current(block.current, built) if built.has("CURRENT") else iter(()),
    }
    found = {name: tuple(rule for rule, holds in rules if not holds) for name, rules in groups.items()}
    unjudged = ("LAW", "DRIVE") if found["SIGNALS"] else ()
    return {name: failed for name, failed in found.items() if failed and name not in unjudged}


def _format(block: CalibrationBlock, built: BuiltFor) -> Rules:
    yield "magic", block.magic == int.from_bytes(MAGIC, "little")
    yield "layout", block.layout == LAYOUT
    yield "length", block.length == LENGTH_WORDS
    held = 0 if built.has("BIPOLAR") and built.has("CURRENT") else block.current.held_ticks
    yield "unused words are 0", not (block.reserved or held or any(side.spare for side in block.sides))


def _firmware(block: CalibrationBlock, built: BuiltFor) -> Rules:
    for name in ("shape", "code_max", "compare_max", "sample_Hz", "tick_Hz", "beta_step"):
        yield name, getattr(block, name) == getattr(built, name)


def _signals(block: CalibrationBlock, built: BuiltFor) -> Rules:
    codes = {"command": (block.command_low, block.command_zero, block.command_high)}
    codes |= {name: (each.low, each.zero, each.high) for name, each in zip(built.inputs, block.sensors, strict=False)}
    for name, (low, zero, high) in codes.items():
        yield f"codes of {name}", low <= zero <= high <= built.code_max and low < high
    yield "reverse", block.reverse <= LARGEST_DROP
    for sign, side in zip((1, -1) if built.has("BIPOLAR") else (1,), block.sides, strict=False):
        ahead, behind = (block.sensors[INPUT_NAMES.index(name)] for name in built.pair(sign))
        no_pressure = (ahead.zero << WEIGHT_SHIFT) - behind.zero * side.weight
        yield "balance", side.balance == no_pressure % 2**32
        yield "weight of the sensor behind", side.weight >= 1
        yield (
            "pressure drops",
            max(_drop(ahead, behind, side.weight), _rise(ahead, behind, side.weight)) <= LARGEST_DROP,
        )


def _drop(ahead: SensorBlock, behind: SensorBlock, weight: int) -> int:
    """Return the largest pressure drop of valid codes."""
    return ((ahead.high - ahead.zero) << WEIGHT_SHIFT) + (behind.zero - behind.low) * weight


def _rise(ahead: SensorBlock, behind: SensorBlock, weight: int) -> int:
    """Return the largest drop of valid codes the other way."""
    return ((ahead.zero - ahead.low) << WEIGHT_SHIFT) + (behind.high - behind.zero) * weight


def _law(block: CalibrationBlock, built: BuiltFor) -> Rules:
    yield "limit of the output", block.compare_limit <= built.compare_max
    rises = not built.has("FALLING")
    yield from _side(block, block.sides[0], built, 1, rises=rises)
    if built.has("BIPOLAR"):
        yield from _side(block, block.sides[1], built, -1, rises=not rises)


def _side(block: CalibrationBlock, side: SideBlock, built: BuiltFor, sign: int, *, rises: bool) -> Rules:
    ahead, behind = (block.sensors[INPUT_NAMES.index(name)] for name in built.pair(sign))
    drop = _drop(ahead, behind, side.weight)
    zero, band, codes = block.command_zero, block.zero_band, block.transition_codes
    law, at_zero, mask = side.nodes[::2], side.nodes[1::2], built.sizes.node_mask
    used = [node for node in range(len(law)) if node < side.node_count or node >= mask]
    yield "nodes", drop // (built.beta_step << WEIGHT_SHIFT) + 2 <= side.node_count <= mask
    yield "beta at zero command above the law's", all(low <= high for low, high in zip(at_zero, law, strict=True))
    yield (
        "beta in use is above 0 and no less than the fallback's",
        all(1 <= at_zero[node] >= at_zero[mask] and law[node] >= law[mask] for node in used),
    )
    yield "one fallback", side.nodes[2 * mask : 2 * mask + 2] == side.nodes[2 * mask + 2 :]
    yield "largest node", max(law) <= largest_node(built.beta_step)
    yield "span", 1 <= side.span <= (block.command_high - zero if rises else zero - block.command_low)
    yield "end of the zero band", side.band_end == (zero + band if rises else zero - band)
    yield "zero band and transition", side.room == side.span - band and 1 <= codes <= side.room
    slope = side.slope - 2**32 if side.slope > INT32_MAX else side.slope
    beta, command = max(law) * built.beta_step, side.span * codes
    factor = max(side.offset, side.offset + slope * command)
    yield "command", 1 <= command <= INT32_MAX
    yield "factor of beta", abs(slope) * command <= INT32_MAX and factor <= INT32_MAX
    yield "transition", side.transition * codes <= side.offset
    yield "sum", beta * factor + command * side.linear + side.half <= INT64_MAX
    yield "rises with the command", side.linear + min(slope, 0) * beta >= 0
    counts = side.quotient_limit * side.reciprocal >> (32 + side.reciprocal_shift)
    yield "largest quotient", side.quotient_limit <= INT32_MAX and counts <= block.compare_limit
    yield "shifts", side.reciprocal_shift <= 31 and side.beta_shift <= 63
    yield "beta as it is shown", beta * side.beta_factor >> side.beta_shift <= U16 and side.beta_unit >= 1
    yield "tested pressure drop", side.tested_to <= LARGEST_TESTED


def _drive(block: CalibrationBlock, built: BuiltFor) -> Rules:
    sides = block.sides if built.has("BIPOLAR") else block.sides[:1]
    longest = max(block.command_high - block.command_zero, block.command_zero - block.command_low)
    band = block.zero_band
    yield "leave_zero", (band + 1 if band else 0) <= block.leave_zero <= LARGEST_CODES
    yield "fault_samples", 1 <= block.fault_samples <= MOST_FAULT_SAMPLES
    yield "fault_latch", block.fault_latch <= 1
    yield "interlock", block.interlock <= LARGEST_CODES or block.interlock == NO_INTERLOCK
    yield "dither_ticks", 1 <= block.dither_ticks <= LARGEST_CODES
    yield "ramps", block.ramps <= 1
    if block.ramps:
        yield "ramped command", longest <= LARGEST_CODES
        yield "ramps", all(1 <= step <= INT32_MAX for side in sides for step in (side.ramp_up, side.ramp_down))
    if block.play_codes:
        travel = block.play_codes * block.transition_codes
        yield "travel of the play", block.play_codes <= LARGEST_PLAY and travel == 1 << block.play_shift
        yield "command of the play", longest <= LARGEST_CODES
        yield "noise of the play", block.play_noise <= LARGEST_NOISE
        yield "step of the play", block.play_step_shift <= LARGEST_STEP_SHIFT
        for side in sides:
            yield "nodes of the play", (side.span >> block.play_step_shift) <= built.sizes.play_mask
            yield "width of the play", max(side.play) * travel <= INT32_MAX


def _current(current: CurrentBlock, built: BuiltFor) -> Rules:
    c = current
    yield "samples", c.samples == built.samples
    yield "limit of the current controller", c.compare_limit <= built.compare_max
    yield "rate and ticks", min(c.rate, c.over_ticks, c.open_ticks, c.held_ticks or not built.has("BIPOLAR")) >= 1
    yield "shifts", 1 <= c.current_shift <= LARGEST_CURRENT_SHIFT and 1 <= c.gain_shift <= LARGEST_GAIN_SHIFT
    yield "gains", max(c.proportional, c.integral, c.feed_forward) <= LARGEST_GAIN and c.current_gain >= 1
    largest = (c.short_sum * c.current_gain + (1 << c.current_shift >> 1)) >> c.current_shift
    yield "largest current", largest <= LARGEST_ERROR
    yield "integral", c.release <= c.integral_limit <= U16 << c.gain_shift
    yield "offset", c.offset_low <= c.offset_nominal <= c.offset_high and c.offset_shift <= LARGEST_OFFSET_SHIFT
    yield "sums", 0 < c.open_sum < c.over_sum < c.short_sum
    if built.has("SUPPLY"):
        last = ((c.supply_high - c.supply_low) >> c.supply_shift) + 1
        yield "codes of the supply", c.supply_low < c.supply_high
        yield "correction", c.supply_shift <= LARGEST_STEP_SHIFT and last <= built.sizes.supply_mask + 1
        yield "nodes of the correction", all(node >= 1 for node in c.supply[: max(last, 0) + 1])
