"""The one form of the core's C, with the numbers of a valve in it and with a block: each against the exact law."""

from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.packing import pack
from dzdesign.core.artefact_files import write_folder
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from tests.support.block_cores import block_folder
from tests.support.core_texts import texts
from tests.support.core_variants import firmware, variant
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


def folder_of(name, form, folder):
    if form == "block":
        return block_folder(variant(name), folder)
    made = firmware(name)
    write_folder(folder, made.files, made.manifest)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "form"),
    [("default", "fixed"), ("default", "block"), ("bipolar, all options", "fixed"), ("bipolar, all options", "block"),
     ("target law, no transition", "fixed"), ("inverted", "fixed"), ("live zero", "fixed")],
)  # fmt: skip
def test_every_input_gives_what_the_law_does(name, form, tmp_path):
    folder = folder_of(name, form, tmp_path / "fw")
    for sign in variant(name).signals.signs:
        result = check_all_inputs(folder, sign)
        assert result.holds and result.inputs > 20_000_000, result


def test_a_core_is_compiled_once_and_a_wrong_number_is_seen(tmp_path):
    compensator = variant("bipolar, all options")
    folder = block_folder(compensator, tmp_path / "fw")
    block = block_of(compensator, "0" * 64)
    core = CompiledCore(folder, -1)
    sample = PreparedInputs(ExactLaw(compensator, -1)).sample()
    right = core.check(sample, sample=True)
    assert not right.faults
    side = block.sides[1]
    for wrong in (
        {"offset": side.offset - side.offset // 1000},
        {"nodes": (*side.nodes[:20], side.nodes[20] + 300, *side.nodes[21:])},
        {"nodes": (*side.nodes[:-1], side.nodes[-1] + 3000)},
        {"transition": side.transition - 1000},
        {"room": side.room // 2},
        {"quotient_limit": side.quotient_limit // 2},
        {"beta_factor": side.beta_factor - side.beta_factor // 1000},
        {"tested_to": side.tested_to // 2},
    ):
        octets = pack(replace(block, sides=(block.sides[0], replace(side, **wrong))))
        found = CompiledCore(folder, -1, octets).check(sample, sample=True)
        assert found.faults and found.object_sha256 == right.object_sha256, wrong


def test_the_same_block_firmware_serves_other_valves_and_a_fixed_one_does_not():
    first, second = (variant(name) for name in ("default", "no transition"))
    assert built_for(first) == built_for(second)
    assert texts(block_core_files(built_for(first))) == texts(block_core_files(built_for(second)))
    assert firmware("default").files["core/dz_valve.h"] != firmware("no transition").files["core/dz_valve.h"]
