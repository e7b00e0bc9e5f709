"""Wrong checks of calibration blocks: which of them another verdict on some block gives away."""

import ctypes
import random
from collections.abc import Sequence
from dataclasses import replace

from dzdesign.codegen.calibration.acceptance import refusals
from dzdesign.codegen.calibration.files import FINDINGS, block_core_files, texts
from dzdesign.codegen.calibration.layout import NODE_MASK
from dzdesign.codegen.calibration.limits import LARGEST_DROP
from dzdesign.codegen.calibration.packing import pack
from dzdesign.core.errors import RequirementError
from dzdesign.verify.analysis.c_mutants import Mutant, mutants_of
from dzdesign.verify.toolchain.host_compiler import load_library

CHECK = "dz_calibration.c"
INT32 = 2**31 - 1
BITS = {name: 1 << place for place, name in enumerate(FINDINGS)}
APART = BITS["LAW"] | BITS["DRIVE"]


def verdict(block, built) -> int:
    """The bits that a right check sets of a block with a right CRC."""
    return sum(BITS[name] for name in refusals(block, built))


class Corpus:
    """Blocks with the verdict that each must get; one that stands for others of codes out of order is left out."""

    def __init__(self, built, blocks) -> None:
        self.built = built
        self.octets, self.expected = [], []
        for block in blocks:
            bits, refused = verdict(block, built), refusals(block, built).get("SIGNALS", ())
            self.octets.append(pack(block))
            # Law and drive count with the codes: where these are out of order they may say more.
            self.expected.append((bits & ~APART, APART) if "codes" in str(refused) else (bits, 0))
        for place in (0, 5, 700, -5, -1):  # a damaged block, and a wrong CRC
            octets = bytearray(self.octets[0])
            octets[place] ^= 4
            header = BITS["FORMAT"] * (place in (0, 5))
            self.octets.append(bytes(octets))
            self.expected.append((BITS["CRC"] | header, 0 if place in (0, 5, -1) else 0xFFFF & ~BITS["CRC"]))
        self._sources = texts(block_core_files(built))
        self._all = ctypes.create_string_buffer(b"".join(self.octets), sum(map(len, self.octets)))

    @property
    def right(self) -> str:
        """The check as it is generated."""
        return self._sources[CHECK]

    def mutants(self) -> list[Mutant]:
        return list(mutants_of(CHECK, self._sources[CHECK]))

    def killed(self, text: str) -> bool | None:
        """Whether a block gets another verdict from a check; None: the compiler refuses it."""
        sources = {CHECK: text, "dz_calibration.h": self._sources["dz_calibration.h"]}
        try:
            library = load_library(sources, "a wrong check")
        except RequirementError:
            return None
        library.dz_calibration_check.restype = ctypes.c_uint16
        size, start = len(self.octets[0]), ctypes.addressof(self._all)
        for index, (expected, apart) in enumerate(self.expected):
            if library.dz_calibration_check(ctypes.c_void_p(start + index * size)) & ~apart != expected:
                return True
        return False


def drawn_mutants(corpora: Sequence[Corpus], count: int, seed: int) -> list[tuple[Corpus, Mutant]]:
    """So many mutants, of all firmware's checks."""
    every = [(corpus, mutant) for corpus in corpora for mutant in corpus.mutants()]
    return random.Random(seed).sample(every, min(count, len(every)))


def corners(block, built):
    """Blocks at a limit that one changed number alone does not reach: where two numbers hang together."""
    for weight in (0, 1):
        yield rebalanced(replace(block, weight_b=weight))
    yield from law_corners(block, built)
    yield from play_corners(block, built)
    for steps in ({"ramp_up": 0}, {"ramp_down": 0}, {"ramp_up": 1, "ramp_down": 2**31 - 1}, {"ramp_up": 2**31}):
        yield replace(with_sides(block, steps), ramps=1)
    for name in ("command", "a", "b"):
        low, zero, high = (getattr(block, f"{name}_{end}") for end in ("low", "zero", "high"))
        above, top = min(high + 1, 65535), built.code_max
        for codes in ((low, low, low), (high, high, high), (0, 0, 0), (low, above, high), (zero, low, high),
                      (low, zero, min(top + 1, 65535)), (low, zero, top)):  # fmt: skip
            made = dict(zip((f"{name}_{end}" for end in ("low", "zero", "high")), codes, strict=True))
            yield rebalanced(replace(block, **made))
    for zero in (0, built.code_max):
        for weight in (LARGEST_DROP // 4095, LARGEST_DROP // 4095 + 1, 65535):
            yield rebalanced(replace(block, b_low=0, b_zero=zero, b_high=built.code_max, weight_b=weight, a_low=0,
                                     a_zero=0, a_high=1))  # fmt: skip
    yield replace(block, leave_zero=block.zero_band)
    yield replace(block, leave_zero=block.zero_band + 1)
    yield replace(block, zero_band=0, leave_zero=0)
    if built.has("CURRENT"):
        yield from current_corners(block)


def current_corners(block):
    """The same of the current controller."""
    numbers = block.current
    for change in ({"integral_limit": 0, "release": 0}, {"release": numbers.integral_limit + 1},
                   {"integral_limit": 65535 << numbers.gain_shift}, {"supply_high": numbers.supply_low},
                   {"integral_limit": (65535 << numbers.gain_shift) + 1}, {"current_gain": 65535, "current_shift": 15},
                   {"open_sum": numbers.over_sum}, {"over_sum": numbers.short_sum}, {"open_sum": numbers.over_sum - 1},
                   {"over_sum": numbers.short_sum - 1}, {"offset_low": numbers.offset_nominal},
                   {"offset_high": numbers.offset_nominal}, {"offset_low": numbers.offset_nominal + 1},
                   {"offset_high": max(numbers.offset_nominal - 1, 0)}):  # fmt: skip
        yield replace(block, current=replace(numbers, **change))
    yield replace(block, current=replace(numbers, supply_high=numbers.supply_low + 1))
    for gain in ("proportional", "integral", "feed_forward"):
        for value in (8191, 8192):
            yield replace(block, current=replace(numbers, **{gain: value}))
    for shift in range(18):
        for integral in (0, 65535 << shift, (65535 << shift) + 1):
            changed = {"gain_shift": shift, "integral_limit": min(integral, 2**32 - 1), "release": 0}
            yield replace(block, current=replace(numbers, **changed))
        yield replace(block, current=replace(numbers, supply_shift=shift))
        yield replace(block, current=replace(numbers, current_shift=shift))
        yield replace(block, current=replace(numbers, gain_shift=shift))
        yield replace(block, current=replace(numbers, current_shift=shift, current_gain=1))


def law_corners(block, built):
    """Laws of one beta and nothing else: each number at its limit, and one beyond."""
    count = block.sides[0].node_count
    nothing = {"slope": 0, "offset": 1, "transition": 0, "linear": 0, "half": 0, "beta_factor": 0, "beta_shift": 0,
               "quotient_limit": 0, "reciprocal": 1, "reciprocal_shift": 0}  # fmt: skip

    def law(node: int, at_zero: int | None = None, **changes):
        zero = node if at_zero is None else at_zero
        nodes = (node, zero) * count + (0, 0) * (NODE_MASK - count) + (node, zero) * 2
        return with_sides(block, {"node_count": count, "nodes": nodes, **nothing, **changes})

    most = INT32 // built.beta_step
    yield from (law(node) for node in (0, 1, most, most + 1))
    for node, shift in ((65535, 6), (65536, 6), (1, 63), (1, 64)):
        yield law(node, beta_factor=1, beta_shift=shift)
    for shift in (31, 32):
        yield law(1, reciprocal_shift=shift)
    limit = block.compare_limit
    for counts in (limit, limit + 1):
        yield law(1, quotient_limit=counts * 2, reciprocal=2**31)
        yield law(max(limit // 8, 1), offset=INT32, quotient_limit=counts * 2, reciprocal=2**31)
    yield law(1, quotient_limit=INT32, reciprocal=0)
    yield law(1, quotient_limit=INT32 + 1, reciprocal=0)
    for tested in (2**30 - 1, 2**30):
        yield law(1, tested_to=tested)
    span = max(side.span for side in block.sides) * block.transition_codes
    for slope in (INT32 // span, INT32 // span + 1):
        yield law(1, slope=slope, offset=0)
        yield law(1, slope=-slope % 2**32, offset=0, linear=slope * built.beta_step)
        yield law(1, slope=-slope % 2**32, offset=0, linear=max(slope * built.beta_step - 1, 0))
        yield law(1, slope=slope, offset=max(INT32 - slope * span, 0))
        yield law(1, slope=slope, offset=max(INT32 - slope * span + 1, 0))
    for offset in (INT32, INT32 + 1):
        yield law(1, offset=offset)
    codes = block.transition_codes
    for lowered in (0, 1):
        yield law(1, offset=5 * codes, transition=5 + lowered)
    yield law(most, 1, offset=1, transition=INT32 // codes)
    falling = {"slope": -(INT32 // span) % 2**32, "offset": INT32, "reciprocal": 2**31}
    yield law(max(limit // 16, 1), quotient_limit=2 * limit, **falling)
    for over in (0, 1):
        yield law(1, half=2**63 - 1 - built.beta_step + over)
        yield law(1, offset=0, linear=(2**63 - 1) // span + over)
        yield law(1, offset=0, linear=((2**31 - 1 + over) << 32) // span + over)


def play_corners(block, built):
    """Plays of a short command: travel, width and nodes at their limits."""
    room = min(side.span for side in block.sides if side.span)

    def play(codes: int = 8, transition: int = 1, span: int = room, width: int = 5, **changes):
        made = replace(block, zero_band=0, leave_zero=0, transition_codes=transition, play_codes=codes,
                       play_shift=(codes * transition).bit_length() - 1, play_step_shift=12, play_noise=0)  # fmt: skip
        sides = {"span": span, "room": span, "band_end": block.command_zero, "play": (width,) * 17, "transition": 0}
        return replace(with_sides(made, sides), **changes)

    yield from (play(codes) for codes in (1, 2, 31, 32, 33, 64))
    yield from (play(play_noise=noise) for noise in (4095, 4096))
    yield from (play(play_step_shift=shift, span=min(16 << shift, room)) for shift in range(17))
    yield from (play(play_step_shift=shift, span=min((17 << shift) - 1, room)) for shift in range(8))
    yield from (play(play_step_shift=shift, span=min(17 << shift, room)) for shift in range(8))
    yield from (play(1, play_shift=shift) for shift in (0, 1, 31, 32))
    yield from (play(play_shift=shift) for shift in (2, 4, 3 + 32))
    for place in (0, 1, 8, 16):
        for width in (32767, 32768):
            wide = play(32, 2048 if room >= 2048 else 1)
            widths = (0,) * place + (width,) + (0,) * (16 - place)
            yield with_sides(wide, {"play": widths})


def with_sides(block, change):
    """The block with every side changed alike."""
    return replace(block, sides=tuple(replace(side, **change) for side in block.sides))


def rebalanced(block):
    """The block with what its difference is without pressures."""
    return replace(block, balance=((block.a_zero << 12) - block.b_zero * block.weight_b) % 2**32)
