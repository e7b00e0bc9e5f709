"""dz_calibration_check() against the same rules in exact integers, what an accepted block must hold, and its cost."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.calibration.acceptance import refusals
from dzdesign.codegen.calibration.block import block_of, built_for, current_block
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.layout import SUPPLY_MASK, CurrentBlock, SideBlock, entries
from dzdesign.codegen.calibration.packing import pack
from dzdesign.codegen.f28335.target import CHECK_INSTRUCTIONS
from dzdesign.verify.toolchain.machines import CORTEX_M4
from tests.support.block_cores import CompiledCheck
from tests.support.block_corners import corners, current_corners
from tests.support.c_library import load_library
from tests.support.claimed_blocks import TriedBlocks, random_octets
from tests.support.core_texts import texts
from tests.support.core_variants import variant
from tests.support.current_loops import PLAIN, SUPPLY
from tests.support.loading.device import firmware_files
from tests.support.paths import TESTS
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


def with_current(compensator):
    """A firmware and block with current control and the supply measured, beside what the compensator has."""
    loop = replace(PLAIN, supply=SUPPLY)
    built = replace(built_for(compensator), shape=0b11000000, samples=loop.samples)
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


def counted(built, block) -> int:
    files = texts(block_core_files(built))
    core = {name: files[name].encode() for name in ("dz_calibration.c", "dz_calibration.h")}
    program = (TESTS / "support" / "check_cost.c").read_bytes()
    octets = ",".join(map(str, pack(block))).encode()
    sources = {**core, "check_cost.c": program, "octets.h": octets, **CORTEX_M4.headers}
    what = "the cost of the check"
    objects = [
        CORTEX_M4.compile("dz_calibration.c", core, CORTEX_M4.core_flags, what),
        CORTEX_M4.compile("check_cost.c", sources, CORTEX_M4.check_flags, what),
    ]
    *runner, kernel = CORTEX_M4.runner
    counting = replace(CORTEX_M4, runner=(*runner, "-icount", "shift=10", kernel))
    ((found, count),) = counting.run(CORTEX_M4.link(objects, what), [], what)
    assert found == 0
    return count


@pytest.mark.slow
@pytest.mark.skipif(bool(CORTEX_M4.missing()), reason=f"{CORTEX_M4.name}: {CORTEX_M4.missing()}")
def test_the_readme_states_the_instructions_of_the_longest_check():
    counts = {name: counted(built, block) for name, built, block in forms()}
    assert CHECK_INSTRUCTIONS - 200 < max(counts.values()) <= CHECK_INSTRUCTIONS, counts


def test_no_check_of_a_block_at_the_start_is_watched_by_the_watchdog():
    main = firmware_files()["main.c"]
    assert main.index("InitSysCtrl()") < main.index("dz_load_init(") < main.index("dz_watchdog_start()")
    loop = main[main.index("for (;;)") :]
    assert loop.index("service_watchdog_if_isr_ran();") < loop.index("dz_telemetry_poll();")


#: Wrong checks and a wrong core, each with the claim that a block then breaks.
SEEDED = {
    "a limit too high": ("dz_calibration.c", "31u), block->compare_limit)", "31u), 65536uL)", "above_limit"),
    "a sum too large": ("dz_calibration.c", "above(high + upper, LARGEST_INT32)", "0u", "wraps"),
    "no slope in the command": ("dz_calibration.c", "(uint64_t)beta * slope * falls", "(uint64_t)0u", "falls"),
    "a transition too deep": ("dz_calibration.c", ", side->offset));", ", LARGEST_WORD));", "wraps"),
    "a core without its limit": ("dz_comp.c", "at_most(sum, side->quotient_limit)", "sum", "above_limit"),
}  # fmt: skip


@pytest.fixture(scope="module")
def firmware():
    compensator = variant("bipolar, all options")
    return built_for(compensator), block_of(compensator, "0" * 64)


def test_accepted_blocks_hold_what_is_claimed(firmware):
    built, block = firmware
    core = TriedBlocks(built)
    octets, expected = random_octets(block, built, 7, 120)
    verdicts = [core.accepted(each) for each in octets]
    assert verdicts == expected
    found = core.claims([each for each, holds in zip(octets, verdicts, strict=True) if holds], 4)
    assert found.size > 40 and found["calls"].min() > 10_000
    assert not any(found[name].any() for name in ("wrong", "above_limit", "falls", "wraps"))


@pytest.mark.parametrize("name", SEEDED)
def test_a_wrong_check_lets_a_block_break_its_claim(firmware, name):
    built, block = firmware
    file, old, new, claim = SEEDED[name]
    core = TriedBlocks(built, [(file, old, new)])
    octets = [pack(each) for each in corners(block, built)]
    found = core.claims([each for each in octets if core.accepted(each)], 4)
    assert found[claim].any(), found


def test_accepted_corrections_of_the_supply_are_straight_between_their_nodes():
    built, block = with_current(variant("default"))
    program = (TESTS / "support" / "supply_claims.c").read_text()
    files = texts(block_core_files(built))
    headers = {name: files[name] for name in ("dz_calibration.h", "dz_current.h")}
    sources = {**headers, "supply_claims.c": program.replace('#include "dz_current.c"\n', files["dz_current.c"])}
    library = load_library(sources, "the supply's correction")
    wrong = {True: [], False: []}
    for each in current_corners(block):
        c = each.current
        if c.supply_low < c.supply_high and (c.supply_high - c.supply_low) >> c.supply_shift <= SUPPLY_MASK + 1:
            octets = pack(each)
            count = library.wrong_corrections(ctypes.create_string_buffer(octets, len(octets)))
            wrong[refusals(each, built) == {}].append(count)
    assert len(wrong[True]) > 20 and not any(wrong[True])
    assert any(wrong[False])  # of a node beyond the core's mask, which is refused
