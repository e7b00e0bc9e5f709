"""Designs of random options: the check accepts the block of each, and block form does what the fixed form does."""

from itertools import islice

import pytest
from block_designs import examined
from random_designs import random_designs

from dzdesign.codegen.project import target_named
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.identify.valve.model import ValveModel
from tests.support.golden_firmware import FULL, GOLDENS
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
DESIGNS = 6


@pytest.fixture(scope="module")
def valves() -> dict[str, ValveModel]:
    """A valve of one side, and one of two."""
    files = {"one side": GOLDENS / "valve.json", "two sides": FULL / "valve.json"}
    return {name: read_artefact(path.read_bytes(), ValveModel, str(path)) for name, path in files.items()}


@pytest.mark.slow
def test_both_forms_of_random_designs_agree_and_no_block_is_refused(valves):
    """Seed 24, as `benchmarks/blocks/run.py --only designs`, which tries hundreds with more inputs each."""
    for name, target, compensator in islice(random_designs(valves, seed=24), DESIGNS):
        found = examined(name, target, compensator, stride=1021, steps=4000)
        assert found.unlike == 0 and not found.refused_fixed and not found.only_block_refused, found
        assert not found.has_room or (found.inputs > 20_000 and found.steps > 4000), found


#: Options with which sensor B's span is far above that of A: too many nodes of B less A, a code too heavy.
NO_ROOM = {
    "nodes": {"command_signal": "-10..10 V x 0.15 + 1.5 V", "negative_dp": "swapped",
              "pressure_a": "4..20 mA on 140 ohm = 10 MPa", "pressure_b": "4..20 mA on 140 ohm = 60 MPa"},
    "weight": {"pressure_a": "4..20 mA on 120 ohm = 5 MPa", "pressure_b": "4..20 mA on 60 ohm = 60 MPa"},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("what", NO_ROOM)
def test_what_a_block_has_no_room_for_is_left_to_the_fixed_form(valves, what):
    compensator = design(valves["two sides"], options_of(NO_ROOM[what], target_named("f280049c").inputs()))
    found = examined("unlike", "f280049c", compensator)
    assert not found.has_room and "--calibration fixed" in found.refused_block and not found.refused_fixed
