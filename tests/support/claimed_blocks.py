"""Random and adversarial calibration blocks with a right CRC, and what the core makes of those that are accepted."""

import ctypes
from dataclasses import replace

import numpy as np

from dzdesign.codegen.calibration.acceptance import LARGEST_DROP, largest_node, refusals
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.layout import NODE_MASK, PLAY_NODES
from dzdesign.codegen.calibration.packing import pack
from tests.support.block_corners import rebalanced, sensors_of, with_sensors, with_sides
from tests.support.c_library import load_library
from tests.support.core_texts import texts
from tests.support.paths import TESTS

INT32, INT63 = 2**31 - 1, 2**63 - 1
CLAIMS = np.dtype([(name, "<u4") for name in ("calls", "wrong", "above_limit", "falls", "wraps")])


class Drawn:
    """Random integers of any size, near the ends as often as anywhere."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def between(self, low: int, high: int) -> int:
        """A number from `low` to `high`: an end, a small one, or any, of any number of bits."""
        high = max(low, high)
        span = high - low
        kind = int(self._rng.integers(6))
        if kind < 2:
            return (low, high)[kind]
        if kind == 2:
            return low + min(span, int(self._rng.integers(4)))
        bits = span.bit_length() if kind > 3 else int(self._rng.integers(span.bit_length() + 1))
        return low + min(span, int.from_bytes(self._rng.bytes(9), "little") % (1 << bits) if bits else 0)

    def codes(self, count: int, most: int) -> list[int]:
        return sorted(int(each) for each in self._rng.integers(0, most + 1, count))

    def chance(self, share: float) -> bool:
        return bool(self._rng.random() < share)


def random_block(block, built, drawn):
    """A block of random numbers, most of them at a limit of what is accepted, and some one beyond it."""
    low, high = drawn.codes(2, built.code_max - 2)
    high += 2
    zero = drawn.between(low + 1, high - 1)
    codes_of = [drawn.codes(3, built.code_max) for _ in built.inputs]
    sensors = {
        place: {"low": a, "zero": b, "high": c + (c == a)} for place, (a, b, c) in enumerate(codes_of)
    }  # fmt: skip
    longest = max(each["high"] - each["low"] for each in sensors.values())
    weight = drawn.between(1, min(65535, LARGEST_DROP // longest // 2))
    rises = not built.has("FALLING")
    valid = [high - zero if rises else zero - low, zero - low if rises else high - zero]
    spans = [drawn.between(1, each) for each in valid]
    used = spans if built.has("BIPOLAR") else spans[:1]
    codes = drawn.between(1, min(used))
    band = drawn.between(0, min(used) - codes)
    signals = {
        "command_low": low, "command_zero": zero, "command_high": high, "zero_band": band,
        "transition_codes": codes, "reverse": drawn.between(0, LARGEST_DROP),
        "compare_limit": drawn.between(0, built.compare_max),
    }  # fmt: skip
    made = replace(block, **signals, **random_drive(block, built, drawn, used, codes, band))
    made = rebalanced(with_sides(with_sensors(made, sensors), {"weight": weight}))
    ways = (rises, not rises)
    each = zip(made.sides, spans, ways, strict=True)
    sides = tuple(random_side(made, side, built, drawn, span, rising) for side, span, rising in each)
    return replace(made, sides=sides if built.has("BIPOLAR") else (sides[0], made.sides[1]))


def random_drive(block, built, drawn, spans, codes, band):
    """Drive functions at their limits; an inverse play where the transition is a power of two."""
    play = 1 << drawn.between(0, 5) if not codes & (codes - 1) and drawn.chance(0.7) else 0
    least = max((span // (PLAY_NODES - 1)).bit_length() for span in spans)
    return {
        "leave_zero": drawn.between(band + bool(band), 32767),
        "fault_samples": drawn.between(1, 10_000),
        "fault_latch": drawn.between(0, 1),
        "interlock": 65535 if drawn.chance(0.5) else drawn.between(0, 32767),
        "ramps": drawn.between(0, 1),
        "dither_counts": drawn.between(0, 65535),
        "dither_ticks": drawn.between(1, 32767),
        "play_codes": play,
        "play_noise": drawn.between(0, 4095),
        "play_step_shift": drawn.between(max(least - drawn.chance(0.2), 0), 12),
        "play_shift": (play * codes).bit_length() - 1 if play else drawn.between(0, 65535),
    }


def random_side(block, side, built, drawn, span, rises):
    """A law whose sums come up to what 64 bits hold."""
    pairs = [sensors_of(block, sign) for sign in (1, -1)]
    drop = max(((ahead.high - ahead.zero) << 12) + (behind.zero - behind.low) * side.weight for ahead, behind in pairs)
    count = drawn.between(min(drop // (built.beta_step << 12) + 2, NODE_MASK), NODE_MASK)
    most = drawn.between(1, largest_node(built.beta_step)) + drawn.chance(0.03)
    law = [drawn.between(1, most) for _ in range(count)]
    zero = [drawn.between(1, each) for each in law]
    pairs = [*zip(law, zero, strict=True), *[(0, 0)] * (NODE_MASK - count), *[(min(law), min(zero))] * 2]
    codes, beta, command = block.transition_codes, max(law) * built.beta_step, span * block.transition_codes
    slope = drawn.between(0, INT32 // command) * (-1 if drawn.chance(0.6) else 1)
    offset = drawn.between(0, INT32 - max(slope, 0) * command)
    rest = INT63 - beta * max(offset, offset + slope * command)
    least = -min(slope, 0) * beta
    if least * command > rest:
        slope, least, rest = 0, 0, INT63 - beta * offset
    half = drawn.between(0, rest - least * command)
    shift, reciprocal = drawn.between(0, 31), drawn.between(1, 2**32 - 1)
    largest = min(INT32, (((block.compare_limit + 1) << (32 + shift)) - 1) // reciprocal)
    beta_shift = drawn.between(0, 63)
    beyond = drawn.chance(0.1)
    return replace(
        side,
        offset=offset,
        slope=slope % 2**32,
        transition=min(drawn.between(0, offset // codes) + (beyond and drawn.chance(0.3)), 2**32 - 1),
        linear=drawn.between(least, (rest - half) // command) + (beyond and drawn.chance(0.3)),
        half=half,
        quotient_limit=largest + (beyond and drawn.chance(0.3) and largest < INT32),
        reciprocal=reciprocal,
        reciprocal_shift=shift,
        tested_to=drawn.between(0, 2**30 - 1),
        beta_factor=drawn.between(0, min(2**32 - 1, ((65536 << beta_shift) - 1) // beta)),
        beta_shift=beta_shift,
        nodes=tuple(number for pair in pairs for number in pair),
        node_count=count,
        ramp_up=drawn.between(int(drawn.chance(0.95)), INT32),
        ramp_down=drawn.between(1, INT32) + drawn.chance(0.05),
        play=tuple(drawn.between(0, min(65535, INT32 // max(block.play_codes * codes, 1))) for _ in range(PLAY_NODES)),
        span=span,
        room=span - block.zero_band,
        band_end=(block.command_zero + block.zero_band if rises else block.command_zero - block.zero_band),
    )


class TriedBlocks:
    """The core in block form and its check, with the program that tries what is claimed."""

    def __init__(self, built, edits=()) -> None:
        self.built = built
        sources = texts(block_core_files(built))
        for file, old, new in edits:
            if old not in sources[file]:
                raise ValueError(f"{file} has no {old}")
            sources[file] = sources[file].replace(old, new)
        program = {"block_claims.c": (TESTS / "support" / "block_claims.c").read_text()}
        flags = ("-DBIPOLAR",) if built.has("BIPOLAR") else ()
        self._library = load_library({**sources, **program}, "the claims", flags)
        self._library.dz_calibration_check.restype = ctypes.c_uint16

    def accepted(self, octets: bytes) -> bool:
        return self._library.dz_calibration_check(ctypes.create_string_buffer(octets, len(octets))) == 0

    def claims(self, octets: list[bytes], pairs: int, seed: int = 1) -> np.ndarray:
        """What was found of each of the blocks, accepted or not."""
        found = np.zeros(len(octets), dtype=CLAIMS)
        blocks = ctypes.create_string_buffer(b"".join(octets), sum(map(len, octets)))
        self._library.try_blocks(
            blocks, ctypes.c_uint32(len(octets)), ctypes.c_uint32(pairs), ctypes.c_uint32(seed),
            found.ctypes.data_as(ctypes.c_void_p),
        )  # fmt: skip
        return found


def random_octets(block, built, seed: int, count: int) -> tuple[list[bytes], list[bool]]:
    """So many random blocks as octets, and whether each is to be accepted."""
    drawn = Drawn(seed)
    blocks = [random_block(block, built, drawn) for _ in range(count)]
    return [pack(each) for each in blocks], [not refusals(each, built) for each in blocks]
