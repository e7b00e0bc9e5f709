"""A lot's firmware that drives a valve by another valve's block, or is of another lot: said beside the table."""

import pytest

from dzdesign.batch.odd_blocks import odd_blocks
from dzdesign.report.lot.summary import LOT_SETTING, LotFirmware


def firmware(block_of):
    return LotFirmware(folder="lot/firmware", target="host", manifest_sha256="0" * 64, block_of=block_of, blocks=("a",))


@pytest.mark.parametrize(("block_of", "valves", "odd"), [("V1", 2, 1), ("V1", 1, 0), (LOT_SETTING, 2, 0)])
def test_a_firmware_that_drives_every_valve_as_the_first_one_is_said(tmp_path, block_of, valves, odd):
    found = odd_blocks(valves, firmware(block_of), tmp_path)
    assert len(found) == odd and all("V1" in text and "over-compensate" in text for text in found)


def test_a_lots_firmware_of_an_earlier_run_is_said(tmp_path):
    assert odd_blocks(0, None, tmp_path) == []
    (tmp_path / "lot" / "firmware").mkdir(parents=True)
    (found,) = odd_blocks(0, None, tmp_path)
    assert "lot/firmware" in found
    assert odd_blocks(2, firmware(LOT_SETTING), tmp_path) == []
