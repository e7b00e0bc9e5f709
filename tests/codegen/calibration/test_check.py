"""dz_calibration_check() in C against the same rules in exact integers: every number of a block at its limits."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.calibration.acceptance import refusals
from dzdesign.codegen.calibration.block import block_of, built_for, current_block
from dzdesign.codegen.calibration.layout import CurrentBlock, SideBlock, entries
from dzdesign.codegen.calibration.packing import pack
from tests.support.block_cores import CompiledCheck
from tests.support.core_variants import variant
from tests.support.current_loops import PLAIN, SUPPLY
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


def with_current(compensator):
    """A firmware and block with current control and the supply measured, beside what the compensator has."""
    loop = replace(PLAIN, supply=SUPPLY)
    built = replace(built_for(compensator), shape=0b11000, samples=loop.samples)
    block = replace(block_of(compensator, "0" * 64), shape=built.shape, current=current_block(loop))
    return built, block


def forms():
    """Firmware and accepted block: two solenoids with everything on, an inverse play, current control."""
    for name in ("bipolar, all options", "bipolar, play", "inverted"):
        yield name, built_for(variant(name)), block_of(variant(name), "0" * 64)
    play = variant("bipolar, play")
    yield "current", *with_current(variant("default"))
    # A converter of 16 bits: a command may have more codes than the drive functions can count.
    yield "wide codes", replace(built_for(play), code_max=65535), replace(block_of(play, "0" * 64), code_max=65535)


@pytest.fixture(scope="module")
def checks():
    return {name: (built, block, CompiledCheck(built)) for name, built, block in forms()}


def agree(check, built, block) -> bool:
    """Whether both say the same."""
    return check.findings(pack(block)) == set(refusals(block, built))


def near(value: int, bits: int) -> set[int]:
    """Values at and beside a number, half of it and twice it, powers of two and the ends of its bits."""
    made = {value + by for by in (-1, 0, 1)} | {value // 2, 2 * value, 2 * value + 1, 0, 1, 2, (1 << bits) - 1}
    made |= {(1 << bits - 1) + by for by in (-1, 0, 1)} | {1 << place for place in range(0, bits, 5)}
    return {number for number in made if 0 <= number < 1 << bits}


def changed(part, name, entry, rng):
    """The part with one number of an entry elsewhere."""
    value = getattr(part, name)
    if not isinstance(value, tuple):
        for number in near(value, entry.bits):
            yield replace(part, **{name: number})
        return
    for place in {0, 1, len(value) - 1, len(value) - 2, len(value) - 4, int(rng.integers(len(value)))}:
        for number in (0, 1, value[place] + 1, max(value[place] - 1, 0), (1 << entry.bits) - 1):
            yield replace(part, **{name: (*value[:place], number % (1 << entry.bits), *value[place + 1 :])})


def changed_blocks(block, rng):
    """Blocks in which one number differs."""
    for name, entry in entries(type(block)).items():
        if name not in ("crc32", "compensator_sha256", "serial", "record"):
            yield from changed(block, name, entry, rng)
    for index in (0, 1):
        for name, entry in entries(SideBlock).items():
            for side in changed(block.sides[index], name, entry, rng):
                sides = (side, block.sides[1]) if index == 0 else (block.sides[0], side)
                yield replace(block, sides=sides)
    for name, entry in entries(CurrentBlock).items():
        yield from (replace(block, current=each) for each in changed(block.current, name, entry, rng))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bipolar, all options", "bipolar, play", "inverted", "current"])
def test_a_number_at_any_of_its_limits_is_judged_alike(checks, name):
    built, block, check = checks[name]
    rng = np.random.default_rng(3)
    tried = refused = 0
    for each in changed_blocks(block, rng):
        assert agree(check, built, each), (refusals(each, built), check.findings(pack(each)))
        tried, refused = tried + 1, refused + bool(refusals(each, built))
    assert tried > 800 and refused > 200


def test_any_octets_are_refused_and_a_damaged_block_is(checks):
    assert not any(check.findings(pack(block)) for _, block, check in checks.values())
    _, block, check = checks["current"]
    octets, rng = pack(block), np.random.default_rng(5)
    for content in (bytes(len(octets)), b"\xff" * len(octets), rng.bytes(len(octets))):
        assert {"FORMAT", "CRC", "FIRMWARE"} <= check.findings(content)
    for place in (*range(0, len(octets), 97), len(octets) - 1):
        damaged = octets[:place] + bytes([octets[place] ^ (1 << place % 8)]) + octets[place + 1 :]
        assert "CRC" in check.findings(damaged)


def test_a_block_of_another_firmware_is_refused(checks):
    built, block, _ = checks["bipolar, play"]
    other = replace(built, compare_max=built.compare_max - 1, sample_Hz=625)
    assert CompiledCheck(other).findings(pack(block)) == {"FIRMWARE"} | set(refusals(block, other))
