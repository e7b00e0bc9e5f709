"""The drive functions with other valves' blocks: a core that is right for its own block alone is found."""

from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.block_checks import drives_checked
from dzdesign.codegen.calibration.block import block_of
from dzdesign.verify.exhaustive.drive_check import drive_follows
from tests.support.block_cores import block_folder
from tests.support.core_variants import variant
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]


def test_blocks_of_one_setting_are_tried_once_and_a_core_that_ignores_another_is_found(tmp_path):
    own = variant("default")
    ramped = replace(own, drive_functions=replace(own.drive_functions, ramp_up=(900, 0), ramp_down=(500, 0)))
    folder = block_folder(own, tmp_path / "firmware")
    given = [(Path(f"{name}.bin"), block_of(ramped, "0" * 64, serial=name), ramped) for name in ("V1", "V2")]
    (check,) = drives_checked(folder, given)
    assert check.holds and "V1.bin" in check.name and "V2.bin" in check.text
    drive = folder / "core" / "dz_drive.c"
    text = drive.read_text(encoding="utf-8")
    assert text.count("block->ramps != 0u") == 1
    drive.write_text(text.replace("block->ramps != 0u", "block->ramps > 1u"), encoding="utf-8")
    assert drive_follows(folder, own).holds, "with its own block nothing is wrong"
    (check,) = drives_checked(folder, given)
    assert check.holds is False and "compare_a" in check.text
