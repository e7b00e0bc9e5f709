"""A lot's firmware that drives every valve by one valve's block: said beside the table."""

import pytest

from dzdesign.batch.summary import foreign_block
from dzdesign.report.lot.summary import LOT_SETTING, LotFirmware


@pytest.mark.parametrize(("block_of", "valves", "odd"), [("V1", 2, 1), ("V1", 1, 0), (LOT_SETTING, 2, 0)])
def test_a_firmware_that_drives_every_valve_as_the_first_one_is_said(block_of, valves, odd):
    firmware = LotFirmware(
        folder="lot/firmware", target="host", manifest_sha256="0" * 64, block_of=block_of, blocks=("calibration.bin",)
    )
    found = foreign_block(firmware, valves)
    assert len(found) == odd and all("V1" in text and "over-compensate" in text for text in found)


def test_a_lot_without_a_firmware_of_its_own_has_nothing_odd():
    assert foreign_block(None, 2) == ()
