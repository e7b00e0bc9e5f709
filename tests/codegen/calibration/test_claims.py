"""What every accepted block must hold, tried on random blocks at the limits of what is accepted."""

import ctypes

import pytest

from dzdesign.codegen.calibration.acceptance import refusals
from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.layout import SUPPLY_MASK
from dzdesign.codegen.calibration.packing import pack
from tests.codegen.calibration.test_check import with_current
from tests.support.block_corners import corners, current_corners
from tests.support.c_library import load_library
from tests.support.claimed_blocks import TriedBlocks, random_octets
from tests.support.core_texts import texts
from tests.support.core_variants import variant
from tests.support.paths import TESTS
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
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
