"""What every accepted block must hold, tried on random blocks at the limits of what is accepted."""

import pytest

from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.built_for import built_for
from dzdesign.codegen.calibration.packing import pack
from tests.support.check_mutants import corners
from tests.support.claimed_blocks import TriedBlocks, random_octets
from tests.support.core_variants import variant
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
#: Wrong checks and a wrong core, each with the claim that a block then breaks.
SEEDED = {
    "a limit too high": ("dz_calibration.c", "0u, block->compare_limit)", "0u, 65536uL)", "above_limit"),
    "a sum too large": ("dz_calibration.c", "outside(high + upper, 0u, LARGEST_INT32)", "0u", "wraps"),
    "no slope in the command": ("dz_calibration.c", "(uint64_t)beta * slope * falls", "(uint64_t)0u", "falls"),
    "a transition too deep": ("dz_calibration.c", "0u, side->offset));", "0u, LARGEST_WORD));", "wraps"),
    "a core without its limit": ("dz_comp.c", "at_most(sum, side->quotient_limit)", "sum", "above_limit"),
}  # fmt: skip


@pytest.fixture(scope="module")
def firmware():
    compensator = variant("bipolar, all options", "wide")
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
