"""Frama-C's Eva on the core: no undefined behaviour where `int` has 16 bits, and faults that only it can see."""

import shutil
from pathlib import Path

import pytest

from dzdesign.core.errors import RequirementError
from tests.support.core_variants import firmware
from tests.support.frama_c import prove

needs_frama_c = pytest.mark.skipif(not shutil.which("frama-c"), reason="needs Frama-C: apt install frama-c-base")


def written(folder: Path, name: str) -> Path:
    """Write what the analysis reads of a variant's firmware."""
    for path, text in firmware(name).files.items():
        if path.startswith("core/") or path == "compensator.json":
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text)
    return folder


@pytest.mark.slow
@needs_frama_c
@pytest.mark.parametrize("name", ["default", "bipolar, all options"])
def test_no_place_of_the_core_and_the_drive_is_left_in_doubt(name, tmp_path):
    found = prove(written(tmp_path, name))
    assert found.alarms == ()
    assert ("dz_comp_negative" in found.functions) == name.startswith("bipolar")


@pytest.mark.slow
@needs_frama_c
@pytest.mark.parametrize(
    ("file", "right", "wrong", "function"),
    [
        # A node beyond the table; an inline function, of which each source has its own, has a number.
        ("dz_comp.c", "& DZ_CALIBRATION_NODE_MASK", "& 127u", "betas_at"),
        ("dz_comp.c", "(side->beta_shift & LARGEST_WIDE_SHIFT)", "(side->beta_shift + LARGEST_WIDE_SHIFT)", "dz_beta"),
        ("dz_comp.h", "below = difference + block->reverse;",
         "below = difference + block->reverse + (uint32_t)((int32_t)p_a_adc * 65536 * 0);", "dz_status_of_0"),
        # An int of the host has 32 bits, that of the C28x 16: every value on the host stays what it was.
        ("dz_comp.c", "uint32_t from_band = u -", "uint32_t from_band = (uint32_t)((int)u * 16 / 16) -", "dz_comp"),
        ("dz_drive.c", "= drive->law;", "= (uint32_t)(drive->side * 32767 * 2 * 0) + drive->law;", "dz_drive_tick"),
    ],
)  # fmt: skip
def test_a_fault_is_seen(file, right, wrong, function, tmp_path):
    folder = written(tmp_path, "default")
    path = folder / "core" / file
    text = path.read_text()
    assert text.count(right) == 1
    path.write_text(text.replace(right, wrong))
    assert function in {alarm.function for alarm in prove(folder).alarms}


@pytest.mark.slow
@needs_frama_c
def test_c_that_frama_c_refuses_is_not_without_alarms(tmp_path):
    folder = written(tmp_path, "default")
    (folder / "core" / "dz_comp.c").write_text("this is no C")
    with pytest.raises(RequirementError, match="frama-c"):
        prove(folder)
