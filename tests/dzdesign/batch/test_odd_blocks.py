"""What makes one valve's block pass for another's in a lot: said beside the table, whatever each block is by itself."""

from dataclasses import replace

import pytest

from dzdesign.batch.odd_blocks import odd_blocks
from dzdesign.report.lot.summary import LOT_SETTING, LotFirmware
from tests.support.core_variants import variant


def with_serial(serial):
    compensator = variant("default", "wide")
    return replace(compensator, valve=replace(compensator.valve, record={"Serial": serial} if serial else {}))


def firmware(block_of):
    return LotFirmware(folder="lot/firmware", target="host", manifest_sha256="0" * 64, block_of=block_of, blocks=("a",))


def test_valves_of_one_serial_number_are_named(tmp_path):
    serials = {"V1": "47", "V2": "48", "V3": "47", "V4": "", "V5": ""}
    lot = {name: with_serial(serial) for name, serial in serials.items()}
    (found,) = odd_blocks(lot, None, tmp_path)
    assert "V1, V3" in found and "'47'" in found and "V2" not in found
    assert odd_blocks({"V1": lot["V1"], "V2": lot["V2"], "V4": lot["V4"], "V5": lot["V5"]}, None, tmp_path) == []


@pytest.mark.parametrize(("block_of", "valves", "odd"), [("V1", 2, 1), ("V1", 1, 0), (LOT_SETTING, 2, 0)])
def test_a_firmware_that_drives_every_valve_as_the_first_one_is_said(tmp_path, block_of, valves, odd):
    lot = {f"V{number}": with_serial("") for number in range(1, valves + 1)}
    found = odd_blocks(lot, firmware(block_of), tmp_path)
    assert len(found) == odd and all("V1" in text and "over-compensate" in text for text in found)


def test_a_lots_firmware_of_an_earlier_run_is_said(tmp_path):
    (tmp_path / "lot" / "firmware").mkdir(parents=True)
    (found,) = odd_blocks({}, None, tmp_path)
    assert "lot/firmware" in found
    assert odd_blocks({}, firmware(LOT_SETTING), tmp_path) == []
